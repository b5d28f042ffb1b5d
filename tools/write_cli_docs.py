"""Write docs/cli.md from the commands themselves; ``--check`` says whether it is stale."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from hdrusd.cli.main import COMMANDS, hdrusd

PAGE = Path(__file__).resolve().parents[1] / "docs" / "cli.md"
HEAD = """# Command line

Made by `python tools/write_cli_docs.py` from the commands' own help.
Exit codes are in the [README](../README.md#options-and-exit-codes).
"""


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    group = click.Context(hdrusd, info_name="hdrusd")
    for name in COMMANDS:
        command = hdrusd.get_command(group, name)
        assert command is not None
        context = click.Context(command, info_name=name, parent=group, terminal_width=88)
        text = "\n".join(line.rstrip() for line in command.get_help(context).splitlines())
        parts.append(f"## hdrusd {name}\n\n```text\n{text}\n```\n")
    return "\n".join(parts)


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(0 if PAGE.read_text(encoding="utf-8") == page() else f"{PAGE.name} is stale")
    PAGE.write_text(page(), encoding="utf-8")
