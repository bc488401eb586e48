"""How a command ends: with one message and an exit code, whatever went wrong."""

import codecs
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

from historysim.basics.wording import nearest, printable
from historysim.errors import HistorySimError, InputError, UnlikelyValueWarning

PLAIN = "historysim.plain"
_PLAIN = {"≥": ">=", "≤": "<=", "−": "-", "θ": "theta", "δ": "delta", "μ": "u", "Σ": "sum", "√": "sqrt", "→": "->"}


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """Write what an encoding does not have in another way, as consoles of Windows need it."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_PLAIN.get(each, "?") for each in error.object[error.start : error.end]), error.end


codecs.register_error(PLAIN, _plainly)


class Ended(click.ClickException):
    """The end of a command with a message, and the exit code that the README lists."""

    def __init__(self, message: str, *, code: int) -> None:
        super().__init__(printable(message))
        self.exit_code = code  # type: ignore[misc] # click reads that of the object


INTERRUPTED = "interrupted; what was not finished is not kept"


def _showing(others: Callable[..., None]) -> Callable[..., None]:
    """Return what shows a warning: one for the user as a note, without lines of the program."""

    def show(message: Warning | str, category: type[Warning], *place: object) -> None:
        if issubclass(category, UnlikelyValueWarning):
            click.echo(f"Note: {printable(str(message))}", err=True)
        else:
            others(message, category, *place)

    return show


def _after_interrupt(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _with_mend(error: click.UsageError) -> click.UsageError:
    """Return an error of a command line that says what to write instead, where that is known."""
    taken = error.ctx.command.params if error.ctx else []
    options = {name for each in taken if isinstance(each, click.Option) for name in each.opts}
    text, mend = error.message, ""
    if isinstance(error, click.NoSuchOption):
        text = f"No such option {error.option_name!r}."
        plain = [name.lstrip("-") for name in options]
        if near := difflib.get_close_matches(error.option_name.lstrip("-"), plain, n=1):
            mend = f"Did you mean '--{near[0]}'?"
        elif isinstance(error.ctx and error.ctx.command, click.Group):
            mend = "Options of a command stand behind its name."
        elif "--set" in options:
            mend = "A key of the scenario is set by --set KEY=VALUE."
    elif extra := re.search(r"unexpected extra arguments? \(([^\s)]+)", text):
        if "--at" in options:
            mend = f"A time is given by --at, as --at {extra[1]}."
        elif "--set" in options and re.fullmatch(r"[-+.\d]\S*", extra[1]):
            mend = f"--set takes KEY=VALUE without blanks, as --set friction.coefficient={extra[1]}."
        elif "-o" in options and Path(extra[1]).suffix:
            mend = f"A file to write is named by -o, as -o {extra[1]}."
        else:
            names = [each.human_readable_name for each in taken if isinstance(each, click.Argument)]
            mend = f"Expected {' '.join(names)} alone; a value with blanks stands in quotes."
    return click.UsageError(f"{text.rstrip('.')}. {mend}", error.ctx) if mend else error


# The commands in the order of use; any other stands below.
GROUPS = {
    "Begin": "columns validate run show plot report",
    "Measured records": "loops sliding compare fit creep",
    "Studies": "sweep design gallery",
    "Other programs": "fmu reduce",
    "The log": "verify state log fork append",
    "Reference": "table kinds",
}

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

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read what stands before the command."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            raise _with_mend(error) from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is meant, or end with what to write instead."""
        word, *others = args
        if word == "help":
            raise click.UsageError(f"Expected historysim {others[0] if others else ''} --help".replace("  ", " "), ctx)
        if word == "log" and others and others[0] in GROUPS["The log"].split():
            raise click.UsageError(f"Expected historysim {others[0]}, without log before it.", ctx)
        if word not in self.found and Path(word).is_file():
            known = {".toml": "run", ".nc": "show", ".history": "log"}
            command = known.get(Path(word).suffix, "columns (a record) or historysim show (a height map)")
            raise click.UsageError(f"{word} is a file; expected a command before it: historysim {command}", ctx)
        if word not in self.found and not word.startswith("-"):
            near = nearest(word, self.found)
            mend = near if near.startswith("did") else "expected one that historysim --help lists"
            raise click.UsageError(f"No such command {word!r}; {mend}", ctx)
        return super().resolve_command(ctx, args)

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
        """Run the program; a terminal that does not know a sign gets another in its place."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors=PLAIN)
        return super().main(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _showing(warnings.showwarning)
                return super().invoke(ctx)
        except click.UsageError as error:
            raise _with_mend(error) from None
        except InputError as error:
            raise Ended(str(error), code=2) from error
        except HistorySimError as error:
            raise Ended(str(error), code=1) from error
        except BrokenPipeError:
            raise
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            raise Ended(f"{place}{error.strerror or error}", code=1) from error
        except MemoryError as error:
            raise Ended("the memory does not suffice; record fewer asperities, or split the loads", code=1) from error
        except Exception as error:
            # an interrupt may leave something open that cannot be closed
            if _after_interrupt(error):
                raise Ended(INTERRUPTED, code=130) from error
            raise
        except KeyboardInterrupt as error:
            raise Ended(str(error) or INTERRUPTED, code=130) from error
