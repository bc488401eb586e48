"""Questions to a history, each one function, for ``history.contact``, `hs.analysis` and `historysim table`."""

import functools
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import attrs

from historysim.basics.arguments import DIRECTION
from historysim.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])
# modules, and packages of modules, that may declare questions
HOMES = tuple(f"historysim.results.{name}" for name in ("analysis", "history_drift", "rebuilt"))


@attrs.frozen
class Question:
    """A question to a history."""

    name: str
    function: Callable[..., Any]
    """Takes the history, and what else is asked for."""
    per_step: bool
    """Whether it can be answered at one step, without those before."""
    unit: str
    """Of an answer that is one number."""
    table: str | None
    """How the header of its table (CSV) begins, where not with its name; None where the answer is no table."""

    @property
    def text(self) -> str:
        """What it is, from the first line of its documentation."""
        first, *_ = (inspect.getdoc(self.function) or "").splitlines()
        return re.split(r"[:;.]| \[", first.removeprefix("Return "))[0]

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """What is asked for beside the history, by name; a shell gives no definitions."""
        _, *given = inspect.signature(self.function).parameters.values()
        return {one.name: one for one in given if one.name != "definitions"}

    @property
    def step(self) -> str:
        """The name of the parameter that says which step, or steps; empty where there is none."""
        return next((name for name in ("step", "steps") if name in self.parameters), "")

    def headers(self) -> tuple[str, ...]:
        """Return how the header of its table may begin."""
        return (self.table,) if self.table else (self.name, f"time,{self.name}")


_declared: dict[str, Question] = {}


def question(
    *, per_step: bool = False, unit: str = "", table: str | None = "", name: str = "", planar: bool = False
) -> Callable[[F], F]:
    """Declare a function of a history as a question; the parameters are those of `Question`.

    One that is not ``planar`` refuses a history with two tangential directions.
    """

    def declare(function: F) -> F:
        called = name or function.__name__

        @functools.wraps(function)
        def asked(history: Any, *given: Any, **options: Any) -> Any:
            check_direction(history, called)
            return function(history, *given, **options)

        answers: Any = function if planar else asked
        _declared[called] = Question(called, answers, per_step, unit, table)
        return cast("F", answers)

    return declare


def check_direction(history: Any, what: str) -> None:
    """Check that a history or a measurement moves in one tangential direction; else it is an InputError."""
    there = DIRECTION in getattr(history, "sizes", ())
    # friction loops that were found have directions, too: forward and backward, along one line
    along = there and DIRECTION in getattr(history, "coords", ()) and "forward" in history[DIRECTION].values
    if (there and not along) or getattr(history, "planar", False):
        raise InputError(
            f"{what} goes with one tangential direction, and the history has two; expected a history in which loads "
            "and displacements are one number each"
        )


@functools.cache
def _import_homes() -> None:
    for home in HOMES:
        found = importlib.import_module(home)
        for module in pkgutil.iter_modules(getattr(found, "__path__", ())):
            importlib.import_module(f"{home}.{module.name}")


def questions() -> Mapping[str, Question]:
    """Return all questions by name."""
    _import_homes()
    return dict(sorted(_declared.items()))
