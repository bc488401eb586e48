"""The group of commands: lookup, help, and one message and exit code for each error."""

import functools
import importlib
import io
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from historysim.basics.files import write_reason
from historysim.basics.system import open_standard_streams
from historysim.basics.wording import nearest, printable
from historysim.errors import HistorySimError, InputError, UnlikelyValueWarning

INTERRUPTED = "interrupted; unfinished output is discarded"
OUT_OF_MEMORY = "not enough memory; record fewer asperities, or split the loads"


class CommandError(click.ClickException):
    """Failure of a command: a message, and an exit code as listed in the README."""

    def __init__(self, message: str, *, code: int) -> None:
        super().__init__(printable(message))
        self.exit_code = code  # type: ignore[misc] # click reads the attribute of the object


def _command_error(error: BaseException) -> CommandError | None:
    """Convert an exception to message and exit code; None for an internal error."""
    if isinstance(error, HistorySimError):
        return CommandError(str(error), code=2 if isinstance(error, InputError) else 1)
    if isinstance(error, OSError) and not isinstance(error, BrokenPipeError):
        prefix = f"{error.filename}: " if error.filename else ""
        return CommandError(f"{prefix}{write_reason(error)}", code=1)
    if isinstance(error, MemoryError):
        return CommandError(OUT_OF_MEMORY, code=1)
    if isinstance(error, KeyboardInterrupt):
        return CommandError(str(error) or INTERRUPTED, code=130)
    # after an interrupt the cleanup itself may fail
    return (
        CommandError(INTERRUPTED, code=130)
        if isinstance(error.__context__, KeyboardInterrupt)
        else None
    )


def _show_as_note(show_warning: Callable[..., None]) -> Callable[..., None]:
    """Return a function that prints warnings for the user as notes, without source lines."""

    def show(message: Warning | str, category: type[Warning], *location: object) -> None:
        if issubclass(category, UnlikelyValueWarning):
            click.echo(f"Note: {printable(str(message))}", err=True)
        else:
            show_warning(message, category, *location)

    return show


# Options of earlier versions, and the options that replace them where a command has these.
REPLACED_OPTIONS = {
    "--across": "--with across=diameter",
    "--adhesion": "--picture adhesion-map",
    "--asperity": "--with asperity=LABEL",
    "--labels": "--with labels=A,B",
    "--panels": "--with panels=loop,energy",
    "--picture": "-o NAME.png",
    "--plot": "-o NAME.png",
    "--steps": "--with steps=A,B",
    "--verbose": "--attributes",
    "-v": "--attributes",
}
CLOSE_OPTION = 0.75  # similarity of an option to an unknown one from which it is suggested


def _with_option(error: click.NoSuchOption, options: set[str]) -> click.UsageError:
    """Add the option that replaces an unknown one, or where options are written."""
    import difflib

    unknown = f"No such option: {error.option_name}."
    replacement = REPLACED_OPTIONS.get(error.option_name, "")
    if replacement.partition(" ")[0] in options:
        return click.UsageError(f"{unknown} Expected {replacement}.", error.ctx)
    if difflib.get_close_matches(error.option_name, error.possibilities or (), cutoff=CLOSE_OPTION):
        return error
    if "--set" in options:
        fix = "A key of the scenario is set by --set KEY=VALUE."
    else:
        fix = "Options of a command follow its name."
    return click.UsageError(f"{unknown} {fix}", error.ctx)


def _with_fix(error: click.UsageError) -> click.UsageError:
    """Add a suggestion to an error of the command line, if there is one."""
    parameters = error.ctx.command.params if error.ctx else []
    options = {name for parameter in parameters for name in parameter.opts}
    if isinstance(error, click.NoSuchOption):
        return _with_option(error, options)
    if extra := re.search(r"unexpected extra arguments? \(([^\s)]+)", error.message):
        names = " ".join(
            item.human_readable_name for item in parameters if isinstance(item, click.Argument)
        )
        forms = {
            "--at": f"a time is given as --at {extra[1]}",
            "-o": f"a file to write as -o {extra[1]}",
        }
        forms["--set"] = "a key of the scenario as --set KEY=VALUE"
        fix = "; ".join(
            [f"Expected only {names}", *(text for name, text in forms.items() if name in options)]
        )
        return click.UsageError(
            f"{error.message.rstrip('.')}. {fix}; a value with blanks needs quotes.", error.ctx
        )
    return error


# Commands in the order of use; all others follow.
GROUPS = {
    "Begin": "columns validate run show table plot report explore cycles",
    "Measured records": "loops sliding compare fit creep",
    "Studies": "sweep design gallery",
    "Other programs": "fmu reduce reference",
    "The log": "verify state log shorten",
    "Reference": "kinds",
}
# suggested if a file is given as command
COMMAND_FOR_SUFFIX = {".toml": "run", ".nc": "show", ".history": "log"}

# Source of a command: its name if it differs from the function name, the function, and its first
# paragraph.
_COMMAND = r'^@click\.command\((?:"([\w-]+)")?.*?^def (\w+)\(.*?"""(.*?)(?:\n\n|""")'


class Commands(click.Group):
    """Commands of the modules in this package, imported on use; errors become one message and an exit code."""

    @functools.cached_property
    def sources(self) -> dict[str, tuple[str, str, str]]:
        """Module, function and short help of each command by name, read from the source."""
        sources = {}
        # importing the modules takes as long as a small run
        for path in sorted(Path(__file__).parent.glob("[!_]*.py")):
            source = path.read_text(encoding="utf-8")
            for name, function, text in re.findall(_COMMAND, source, re.DOTALL | re.MULTILINE):
                sources[name or function] = path.stem, function, text
        return sources

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the requested command; otherwise raise an error with a suggestion."""
        word, *further = args
        if word in self.sources or word.startswith("-"):
            if word == "log" and further and further[0] in GROUPS["The log"].split():
                raise click.UsageError(
                    f"Expected historysim {further[0]}, without log before it.", ctx
                )
            return super().resolve_command(ctx, args)
        if word == "help":
            raise click.UsageError(f"Expected historysim {' '.join([*further[:1], '--help'])}", ctx)
        if Path(word).is_file():
            command = COMMAND_FOR_SUFFIX.get(
                Path(word).suffix, "columns (a record) or historysim show (a height map)"
            )
            raise click.UsageError(
                f"{word} is a file; expected a command before it: historysim {command}", ctx
            )
        hint = nearest(word, self.sources)
        fix = hint if hint.startswith("did") else "expected a command listed by historysim --help"
        raise click.UsageError(f"No such command {word!r}; {fix}", ctx)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - as click calls it
        """Return the names of all commands."""
        return sorted(self.sources)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - as click calls it
        """Return a command."""
        if cmd_name not in self.sources:
            return None
        module, function, _ = self.sources[cmd_name]
        command: click.Command = getattr(
            importlib.import_module(f"historysim.cli.{module}"), function
        )
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as click calls it
        """Write each command with its first sentence, in the order of use, without importing any."""
        grouped = " ".join(GROUPS.values()).split()
        width = max(map(len, self.sources))
        for title, names in {
            **GROUPS,
            "Others": " ".join(sorted(self.sources.keys() - {*grouped})),
        }.items():
            rows = [
                (name.ljust(width), " ".join(self.sources[name][2].split()))
                for name in names.split()
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program; characters that the terminal cannot encode are replaced by ?."""
        open_standard_streams()
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        return super().main(*args, **kwargs)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the options before the command."""
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            raise _with_fix(error) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _show_as_note(warnings.showwarning)
                return super().invoke(ctx)
        except click.UsageError as error:
            raise _with_fix(error) from None
        except (Exception, KeyboardInterrupt) as error:
            if failure := _command_error(error):
                raise failure from error
            raise
