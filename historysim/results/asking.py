"""Questions to a history, each one function, for ``history.contact``, `hs.analysis` and `historysim table`."""

import functools
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import attrs

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


def question(*, per_step: bool = False, unit: str = "", table: str | None = "", name: str = "") -> Callable[[F], F]:
    """Declare a function of a history as a question; the parameters are those of `Question`."""

    def declare(function: F) -> F:
        called = name or function.__name__
        _declared[called] = Question(called, function, per_step, unit, table)
        return function

    return declare


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
