"""The documents against the code: commands, operators, findings, decisions, links."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from hdrusd.tonemap.operator import OPERATORS

ROOT = Path(__file__).parents[1]
MARKDOWN = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("samples/**/*.md")])
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
FINDINGS = ROOT / "docs" / "findings.md"
MAPPING = ROOT / "docs" / "concept-mapping.md"

COMMANDS = {
    "convert",
    "render",
    "tonemap",
    "bracket",
    "check",
    "info",
    "photometry",
    "operators",
    "observers",
    "screens",
    "schemas",
    "doctor",
}
HEADINGS = ["Decision", "Why", "Alternatives", "Consequences"]

#: A finding code: words joined by hyphens.
CODE = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")

#: Names of one workplace, which mean nothing to anybody else. Spelt so that this file has none.
WORKPLACE = re.compile(
    r"/wor[k]/|/far[m]/|\.librar[y]\b|before-sto[p]|\bCE[O]\b|co-enginee[r]"
    r"|\b(?:hous[e]|importer[s]|performanc[e]|ecosyste[m]|styl[e]|brie[f])\.md\b|human_visio[n]"
    r"|(?i:\b(?:close|fixe|resolve)s #\d)"
)


def run_hdrusd(*arguments: str) -> str:
    """Standard output of the command line, which must end well."""
    program = (
        f"import sys; sys.argv = {['hdrusd', *arguments]!r}; from hdrusd.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def listed_commands() -> dict[str, str]:
    """Name and short help of each command, as ``hdrusd --help`` has them."""
    listing = run_hdrusd("--help").split("Commands:\n")[1].split("\n\n")[0]
    return dict(re.findall(r"^  (\S+)(?: +(.*))?$", listing, re.MULTILINE))


def prose(text: str) -> str:
    """Markdown without its fenced blocks."""
    return re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)


def anchors(text: str) -> set[str]:
    """The fragments by which a Markdown page's headings are linked."""
    titles = re.findall(r"^#+ +(.*)$", prose(text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title).strip().lower().replace(" ", "-") for title in titles}


def is_kind(node: ast.expr) -> bool:
    """Whether an expression is ``Kind.DROPPED`` or another of them."""
    return isinstance(node, ast.Attribute) and ast.unparse(node.value) == "Kind"


def literals(nodes: Iterable[ast.expr | None]) -> list[str]:
    """Those of ``nodes`` that are literal finding codes."""
    values = [node.value for node in nodes if isinstance(node, ast.Constant)]
    return [value for value in values if isinstance(value, str) and CODE.fullmatch(value)]


def finding_codes(source: str) -> Iterator[str]:
    """The codes of findings that a module can make, as far as they are spelt out.

    A code stands behind its Kind, is the key of ``(Kind, text)`` in a table, or is an
    argument of a function that is named for findings.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Dict):
            rows = zip(node.keys, node.values, strict=True)
            yield from literals(
                key
                for key, row in rows
                if isinstance(row, ast.Tuple) and any(map(is_kind, row.elts))
            )
        parts = node.args if isinstance(node, ast.Call) else getattr(node, "elts", [])
        yield from literals(code for kind, code in pairwise(parts) if is_kind(kind))
        if isinstance(node, ast.Call) and re.search(
            r"finding$|keep_going$", ast.unparse(node.func)
        ):
            yield from literals(parts)[:1]


def test_every_command_has_help_and_is_documented() -> None:
    pages = [ROOT / "README.md", ROOT / "docs" / "cli.md"]
    text = "".join(page.read_text(encoding="utf-8") for page in pages if page.is_file())
    commands = listed_commands()
    assert commands.keys() >= COMMANDS
    assert [name for name, short in commands.items() if not short] == []
    assert [name for name in commands if f"hdrusd {name}" not in text] == []


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_option_has_help(command: str) -> None:
    options = re.findall(
        r"^  (-\S.*?)(?:  +(.*)|\n {4,}(.*))?$", run_hdrusd(command, "--help"), re.M
    )
    assert options
    assert [name for name, beside, below in options if not (beside or below)] == []


@pytest.mark.parametrize("name", OPERATORS.names())
def test_every_operator_cites_its_source(name: str) -> None:
    # An author or a standard, and a work of theirs: "Ward, falsecolor, Radiance".
    assert re.search(r"[A-Z]\w+.*,\s*\S", OPERATORS[name].cite)


def test_every_finding_code_is_documented_and_every_documented_one_exists() -> None:
    files = [file for folder in ("hdrusd", "cli") for file in (ROOT / folder).rglob("*.py")]
    sources = [file.read_text(encoding="utf-8") for file in files]
    made = {code for source in sources for code in finding_codes(source)}
    page = FINDINGS.read_text(encoding="utf-8")
    documented = set(re.findall(r"^\| `([a-z0-9-]+)` \|", page, re.MULTILINE))
    assert "light-range" in made
    assert made - documented == set()
    # A code may be put together at run time: f"{name}-texture".
    everything = "".join(sources)
    endings = tuple(re.findall(r'f"\{\w+\}(-[a-z-]+)"', everything))
    invented = {code for code in documented - made if f'"{code}"' not in everything}
    assert {code for code in invented if not code.endswith(endings)} == set()
    mentioned = re.findall(r"^\|.*\| ([^|]*)\|$", MAPPING.read_text(encoding="utf-8"), re.MULTILINE)
    in_last_column = {code for cell in mentioned for code in re.findall(r"`([a-z0-9-]+)`", cell)}
    assert in_last_column - documented == set()


def test_decisions_are_numbered_without_gaps() -> None:
    numbers = [int(page.name[:4]) for page in DECISIONS]
    assert numbers == list(range(1, len(DECISIONS) + 1))
    assert len(numbers) >= 12


@pytest.mark.parametrize("page", DECISIONS, ids=lambda page: page.stem)
def test_decision_record_has_its_parts(page: Path) -> None:
    lines = page.read_text(encoding="utf-8").splitlines()
    assert re.match(rf"# {page.name[:4]} \S", lines[0])
    assert re.match(r"Status: (proposed|accepted|superseded by \d{4}), \d{4}-\d\d-\d\d", lines[2])
    assert [line[3:] for line in lines if line.startswith("## ")] == HEADINGS


@pytest.mark.parametrize("page", MARKDOWN, ids=lambda page: str(page.relative_to(ROOT)))
def test_internal_links_resolve(page: Path) -> None:
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)[^)]*\)", prose(page.read_text(encoding="utf-8"))):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, fragment = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (
            fragment and fragment not in anchors(file.read_text(encoding="utf-8"))
        ):
            broken.append(target)
    assert broken == []


def test_nothing_names_a_workplace() -> None:
    git = shutil.which("git")
    listing = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run([git, *listing], cwd=ROOT, capture_output=True) if git else None
    if done is None or done.returncode:
        pytest.skip("no git or no git checkout, so there is no list of the project's files")
    found = []
    for name in filter(None, done.stdout.decode().split("\0")):
        content = (ROOT / name).read_bytes() if (ROOT / name).is_file() else b""
        for number, line in enumerate(content.decode(errors="replace").splitlines(), start=1):
            if WORKPLACE.search(line):
                found.append(f"{name}:{number}: {line.strip()[:80]}")
    assert found == []
