"""How a command ends: with one message and an exit code, whatever went wrong."""

import codecs
import io
import sys
import warnings
from collections.abc import Callable
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


class Commands(click.Group):
    """Commands whose errors end as one message and an exit code."""

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
        except KeyboardInterrupt as error:
            raise Interrupted("interrupted") from error
