"""How a command ends: with one message and an exit code, whatever went wrong."""

import codecs
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

from historysim.basics.display import printable
from historysim.errors import HistorySimError, InputError, UnlikelyValueWarning

PLAIN = "historysim.plain"
_PLAIN = {"≥": ">=", "≤": "<=", "−": "-", "θ": "theta", "δ": "delta", "μ": "u", "Σ": "sum", "√": "sqrt", "→": "->"}


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """Write what an encoding does not have in another way, as consoles of Windows need it."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_PLAIN.get(each, "?") for each in error.object[error.start : error.end]), error.end


codecs.register_error(PLAIN, _plainly)


class NotPossible(click.ClickException):
    """What was asked for cannot be carried out."""

    exit_code = 1


class BadInput(click.ClickException):
    """What was given cannot be used."""

    exit_code = 2


class Interrupted(click.ClickException):
    """The user has stopped the program."""

    exit_code = 130


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


_COMMAND = r'^@click\.command\((?:"([\w-]+)")?.*?^def (\w+)\(.*?"""(.*?)(?:\n\n|""")'
"""In a source a command: its name, where it is not that of the function, the function, and its first paragraph."""


class Commands(click.Group):
    """Commands of the modules in this folder, each imported when it is used; errors end as one message and a code."""

    @functools.cached_property
    def found(self) -> dict[str, tuple[str, str, str]]:
        """By the name of each command its module, its function, and its short help, all from the source."""
        found = {}
        for path in sorted(Path(__file__).parent.glob("[!_]*.py")):
            source = path.read_text(encoding="utf-8")
            for name, function, text in re.findall(_COMMAND, source, re.DOTALL | re.MULTILINE):
                found[name or function] = path.stem, function, text
        return found

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

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the name and the short help of each command, none of which is imported for that."""
        names = self.list_commands(ctx)
        limit = formatter.width - 6 - max(map(len, names))
        with formatter.section("Commands"):
            short = (click.Command(name, help=self.found[name][2]).get_short_help_str(limit) for name in names)
            formatter.write_dl(list(zip(names, short, strict=True)))

    def main(self, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - as click has it
        """Run the program; a terminal that does not know a sign gets another in its place."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors=PLAIN)
        return super().main(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:  # noqa: ANN401 - as click has it
        """Run a command."""
        try:
            with warnings.catch_warnings():
                warnings.showwarning = _showing(warnings.showwarning)
                return super().invoke(ctx)
        except InputError as error:
            raise BadInput(printable(str(error))) from error
        except HistorySimError as error:
            raise NotPossible(printable(str(error))) from error
        except BrokenPipeError:
            raise
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            raise NotPossible(printable(f"{place}{error.strerror or error}")) from error
        except MemoryError as error:
            raise NotPossible("the memory does not suffice; record fewer asperities, or split the loads") from error
        except Exception as error:
            # what an interrupt has left in the midst may fail as it is closed
            if _after_interrupt(error):
                raise Interrupted("interrupted; what was not finished is not kept") from error
            raise
        except KeyboardInterrupt as error:
            raise Interrupted(str(error) or "interrupted; what was not finished is not kept") from error
