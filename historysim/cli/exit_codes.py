"""How a command ends: with one message and an exit code, whatever went wrong."""

import difflib
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

INTERRUPTED = "interrupted; what was not finished is not kept"
OUT_OF_MEMORY = "the memory does not suffice; record fewer asperities, or split the loads"


class Ended(click.ClickException):
    """The end of a command with a message, and the exit code that the README lists."""

    def __init__(self, message: str, *, code: int) -> None:
        super().__init__(printable(message))
        self.exit_code = code  # type: ignore[misc] # click reads that of the object


def _ended(error: BaseException) -> Ended | None:
    """Return the end that an error makes; None for one of the program itself."""
    if isinstance(error, HistorySimError):
        return Ended(str(error), code=2 if isinstance(error, InputError) else 1)
    if isinstance(error, OSError) and not isinstance(error, BrokenPipeError):
        place = f"{error.filename}: " if error.filename else ""
        return Ended(f"{place}{write_reason(error)}", code=1)
    if isinstance(error, MemoryError):
        return Ended(OUT_OF_MEMORY, code=1)
    if isinstance(error, KeyboardInterrupt):
        return Ended(str(error) or INTERRUPTED, code=130)
    # an interrupt may leave something open that cannot be closed
    return Ended(INTERRUPTED, code=130) if isinstance(error.__context__, KeyboardInterrupt) else None


def _showing(others: Callable[..., None]) -> Callable[..., None]:
    """Return what shows a warning: one for the user as a note, without lines of the program."""

    def show(message: Warning | str, category: type[Warning], *place: object) -> None:
        if issubclass(category, UnlikelyValueWarning):
            click.echo(f"Note: {printable(str(message))}", err=True)
        else:
            others(message, category, *place)

    return show


CLOSE_OPTION = 0.75  # similarity of an option to an unknown one from which it is suggested


def _with_mend(error: click.UsageError) -> click.UsageError:
    """Return an error of a command line that says what to write instead, where that is known."""
    taken = error.ctx.command.params if error.ctx else []
    options = {name for each in taken for name in each.opts}
    if isinstance(error, click.NoSuchOption) and not difflib.get_close_matches(
        error.option_name, error.possibilities or (), cutoff=CLOSE_OPTION
    ):
        set_key = "A key of the scenario is set by --set KEY=VALUE."
        mend = set_key if "--set" in options else "Options of a command stand behind its name."
        return click.UsageError(f"No such option: {error.option_name}. {mend}", error.ctx)
    if extra := re.search(r"unexpected extra arguments? \(([^\s)]+)", error.message):
        names = " ".join(each.human_readable_name for each in taken if isinstance(each, click.Argument))
        forms = {"--at": f"a time is given as --at {extra[1]}", "-o": f"a file to write as -o {extra[1]}"}
        forms["--set"] = "a key of the scenario as --set KEY=VALUE"
        mend = "; ".join([f"Expected {names} alone", *(text for name, text in forms.items() if name in options)])
        return click.UsageError(
            f"{error.message.rstrip('.')}. {mend}; a value with blanks stands in quotes.", error.ctx
        )
    return error


# The commands in the order of use; any other stands below.
GROUPS = {
    "Begin": "columns validate run show plot report",
    "Measured records": "loops sliding compare fit creep",
    "Studies": "sweep design gallery",
    "Other programs": "fmu reduce",
    "The log": "verify state log",
    "Reference": "table kinds",
}
OF_FILES = {".toml": "run", ".nc": "show", ".history": "log"}  # a command for a file that stands in place of one

# A command in a source: its name if it differs from that of the function, the function, and its first paragraph.
_COMMAND = r'^@click\.command\((?:"([\w-]+)")?.*?^def (\w+)\(.*?"""(.*?)(?:\n\n|""")'


class Commands(click.Group):
    """Commands of the modules in this folder, each imported when it is used; errors end as one message and a code."""

    @functools.cached_property
    def found(self) -> dict[str, tuple[str, str, str]]:
        """By the name of each command its module, its function, and its short help, all from the source."""
        found = {}
        # by the source, since importing the modules takes as long as a small run
        for path in sorted(Path(__file__).parent.glob("[!_]*.py")):
            source = path.read_text(encoding="utf-8")
            for name, function, text in re.findall(_COMMAND, source, re.DOTALL | re.MULTILINE):
                found[name or function] = path.stem, function, text
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is meant, or end with what to write instead."""
        word, *others = args
        if word in self.found or word.startswith("-"):
            if word == "log" and others and others[0] in GROUPS["The log"].split():
                raise click.UsageError(f"Expected historysim {others[0]}, without log before it.", ctx)
            return super().resolve_command(ctx, args)
        if word == "help":
            raise click.UsageError(f"Expected historysim {' '.join([*others[:1], '--help'])}", ctx)
        if Path(word).is_file():
            command = OF_FILES.get(Path(word).suffix, "columns (a record) or historysim show (a height map)")
            raise click.UsageError(f"{word} is a file; expected a command before it: historysim {command}", ctx)
        near = nearest(word, self.found)
        mend = near if near.startswith("did") else "expected one that historysim --help lists"
        raise click.UsageError(f"No such command {word!r}; {mend}", ctx)

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - as click calls it
        """Return the names of all commands."""
        return sorted(self.found)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - as click calls it
        """Return a command."""
        if cmd_name not in self.found:
            return None
        module, function, _ = self.found[cmd_name]
        command: click.Command = getattr(importlib.import_module(f"historysim.cli.{module}"), function)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as click calls it
        """Write each command with its first sentence, in the order of use; none is imported for that."""
        known = " ".join(GROUPS.values()).split()
        width = max(map(len, self.found))
        for title, names in {**GROUPS, "Others": " ".join(sorted(self.found.keys() - {*known}))}.items():
            rows = [(name.ljust(width), " ".join(self.found[name][2].split())) for name in names.split()]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program; a terminal that does not know a sign gets ? in its place."""
        open_standard_streams()
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        return super().main(*args, **kwargs)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read what stands before the command."""
        try:
            return super().parse_args(ctx, args)
        except click.UsageError as error:
            raise _with_mend(error) from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _showing(warnings.showwarning)
                return super().invoke(ctx)
        except click.UsageError as error:
            raise _with_mend(error) from None
        except (Exception, KeyboardInterrupt) as error:
            if end := _ended(error):
                raise end from error
            raise
