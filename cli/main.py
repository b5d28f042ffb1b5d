"""The ``hdrusd`` group: commands imported when named, errors as one line and an exit code."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from types import FrameType

import click

from hdrusd import __version__
from hdrusd.errors import HdrusdError

#: Name, module beside this file, and the help's one line: read without importing the module.
COMMANDS = {
    "convert": "Turn a legacy database into a photometric USD stage.",
    "render": "Render a stage: frames in cd/m2 (EXR) and tone-mapped (PNG).",
    "tonemap": "Tone map frames in cd/m2.",
    "bracket": "Merge bracketed photographs into an HDR picture in cd/m2.",
    "check": "Run the photometric validators on a stage.",
    "recipe": "Write a first photometry file, by what a database holds.",
    "inspect": "Print what a legacy database says, in its own numbers.",
    "info": "Say what a database, a stage or a frame holds.",
    "photometry": "Check, convert or draw a photometric file (IES LM-63, EULUMDAT).",
    "operators": "List the tone mapping operators, or explain one.",
    "observers": "List the observers whose eyes are known, or explain one.",
    "screens": "List the screens, or explain one.",
    "schemas": "Print the folder of the USD schemas, for PXR_PLUGINPATH_NAME.",
    "doctor": "Say which device, versions and missing pieces there are.",
}


class Commands(click.Group):
    """A group whose commands live in a module each; other packages may add some."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Built-in commands in their order, then those of plug-ins."""
        return [*COMMANDS, *sorted(e.name for e in entry_points(group="hdrusd.commands"))]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command's module."""
        if cmd_name in COMMANDS:
            module = import_module(f".{cmd_name}", __package__)
            command: click.Command = module.command
            return command
        for entry in entry_points(group="hdrusd.commands", name=cmd_name):
            try:
                loaded: click.Command = entry.load()
            except Exception as problem:  # whatever a stranger's module raises
                return _broken(entry, problem)
            return loaded
        return None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list in ``--help``, from the table alone: importing everything takes a second."""
        rows = [(name, COMMANDS.get(name, "(plug-in)")) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Say what the nearest command is when a name is wrong."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            from difflib import get_close_matches

            near = get_close_matches(args[0], self.list_commands(ctx), n=1) if args else []
            if not near:
                raise
            hint = f"{error.message} Did you mean {near[0]!r}?"
            raise click.UsageError(hint, ctx) from error


def _broken(entry: EntryPoint, problem: Exception) -> click.Command:
    """Stands in for a plug-in that cannot be imported: the others and ``--help`` still work."""

    def tell(**_: object) -> None:
        click.echo("".join(traceback.format_exception(problem)), err=True, nl=False)
        raise HdrusdError(f"{entry.name}: the plug-in {entry.value} cannot be loaded")

    swallow = click.Argument(["arguments"], nargs=-1, type=click.UNPROCESSED)
    settings = {"ignore_unknown_options": True}
    help_text = "A plug-in that cannot be loaded."
    return click.Command(
        entry.name, settings, tell, [swallow], help=help_text, short_help=help_text
    )


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Exit codes: 0 done, 1 error, 2 wrong use, 3 input unreadable, 4 validation failed, "
    "5 no OpenGL, 6 findings under --strict, 130 interrupted.",
)
@click.version_option(__version__, prog_name="hdrusd")
def hdrusd() -> None:
    """Photometric night rendering of LDR 3D databases on OpenUSD."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """Ctrl-C. Inside an import, which USD's libraries go on with all the same, a moment later."""
    inside = frame
    while inside is not None and inside.f_code is not main.__code__:
        if inside.f_code.co_filename.startswith("<frozen importlib"):
            again = threading.Timer(0.05, signal.pthread_kill, [threading.get_ident(), number])
            again.daemon = True
            again.start()
            return
        inside = inside.f_back
    signal.default_int_handler(number, frame)


def main() -> None:
    """Entry point: run, and turn what goes wrong into one line and an exit code."""
    # A scheduler's SIGTERM is a Ctrl-C: what is half done is cleared away.
    signal.signal(signal.SIGTERM, interrupt)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # of nohup it is ignored
        signal.signal(signal.SIGINT, interrupt)
    try:
        code = hdrusd.main(prog_name="hdrusd", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        code = 130
    except HdrusdError as error:
        click.echo(str(error), err=True)
        code = error.exit_code
    except BrokenPipeError:
        # The reader went away (| head): nothing to say, and nothing to say it to.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 141
    except OSError as error:
        click.echo(f"{error.filename or 'file'}: {error.strerror or error}", err=True)
        code = 1
    sys.stdout.flush()
    sys.exit(code if isinstance(code, int) else 0)
