"""Errors that a caller can distinguish: each message names the input, what was expected, the fix and the location.

Errors can be pickled: unpickling rebuilds one from the arguments of its base class.
"""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Self

LONGEST_NAME = 40  # characters of a name of the input in a message


class HistorySimError(Exception):
    """Any error that historysim raises on purpose.

    Attributes
    ----------
    event : int or None
        Number of the load event that cannot be carried out; None if the error concerns no event.
    """

    event: int | None = None

    @classmethod
    def for_event(cls, index: int, time: str, error: Exception) -> Self:
        """Return an error that names the event at which another error ended a replay, and its time."""
        named = cls(f"event {index} at t = {time}: {error}")
        named.event = index
        return named


class InputError(HistorySimError, ValueError):
    """A value, scenario or file that cannot be used.

    Attributes
    ----------
    place : tuple of str or int
        Location of the value in the input: names and indices, outermost first; empty if the message
        states it.
    path : int
        Position of the load path that failed, if several are integrated.
    """

    place: tuple[str | int, ...] = ()
    path: int = 0

    def __str__(self) -> str:
        problem = super().__str__()
        return f"{path_text(self.place)}: {problem}" if self.place else problem


def distinct_texts(value: float, bound: float, digits: int = 6) -> tuple[str, str]:
    """Format a value and the bound that it violates with at least `digits` digits, and as many as tell them apart."""
    texts = f"{value:.{digits}g}", f"{bound:.{digits}g}"
    # 17 digits tell any two floats apart
    return (
        texts if texts[0] != texts[1] or digits >= 17 else distinct_texts(value, bound, digits + 1)
    )


def path_text(path: Iterable[str | int]) -> str:
    """Format the location of a key as in scenarios: ``"loading.waypoints[3].time"``."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            name = step if len(step) <= LONGEST_NAME else f"{step[:LONGEST_NAME]}…"
            text += ("." if text else "") + (
                name if re.fullmatch(r"[A-Za-z0-9_-]+…?", name) else repr(name)
            )
    return text


class MissingPackageError(InputError):
    """Content that was written with a package that is not installed."""


class LoadError(HistorySimError):
    """A load that the contact cannot carry: there is no equilibrium at the requested value."""


class FrictionLimitError(LoadError):
    """A tangential load beyond the friction limit.

    Attributes
    ----------
    request, limit : float
        The requested load and the largest load that the contact supports [N].
    path : int
        Position of the load path that failed, among the requested paths.
    formula : str
        Definition of the limit.
    """

    def __init__(self, request: float, limit: float, path: int = 0, formula: str = "Σ μ N") -> None:
        super().__init__(request, limit, path, formula)
        self.request, self.limit, self.path, self.formula = request, limit, path, formula

    def __str__(self) -> str:
        request, limit = distinct_texts(self.request, self.limit)
        return (
            f"a tangential load of {request} N is beyond the friction limit of {limit} N ({self.formula}), so "
            "there is no equilibrium; lower it, raise the normal load first, control the displacement instead, or "
            "choose `saturate` to hold the load at the limit"
        )


class PullOffError(LoadError):
    """A normal load beyond the one at which a contact that attracts separates.

    Attributes
    ----------
    request, pull_off : float
        The requested load from outside, and the least one that the contact carries [N].
    path : int
        As for `FrictionLimitError`.
    """

    def __init__(self, request: float, pull_off: float, path: int = 0) -> None:
        super().__init__(request, pull_off, path)
        self.request, self.pull_off, self.path = request, pull_off, path

    def __str__(self) -> str:
        separates = f"separates at {self.pull_off:.6g} N" if self.pull_off else "is separated"
        return f"a normal load of {self.request:.6g} N pulls on a contact that {separates}; pull less, or move it apart"


class CurveEndError(LoadError):
    """A load or an approach beyond the end of a tabulated normal curve.

    Attributes
    ----------
    request, end : str
        The requested value and the end of the curve, both with units.
    path : int
        As for `FrictionLimitError`.
    curve, fix : str
        What ends there, and what to do.
    """

    def __init__(
        self,
        request: str,
        end: str,
        path: int = 0,
        curve: str = "the normal curve, which ends",
        fix: str = "load less, or extend the curve",
    ) -> None:
        super().__init__(request, end, path, curve, fix)
        self.request, self.end, self.path, self.curve, self.fix = request, end, path, curve, fix

    def __str__(self) -> str:
        return f"{self.request} is beyond {self.curve} at {self.end}; {self.fix}"


class InstallationError(HistorySimError, ImportError):
    """The package is not installed correctly."""


class UnlikelyValueWarning(UserWarning):
    """A number is implausible in SI, the unit of plain numbers."""


class RampWarning(UserWarning):
    """A load channel ramps between two waypoints through events that do not set it, which may not be intended."""


@contextmanager
def error_path(*place: str | int) -> Iterator[None]:
    """Prefix the path of an InputError, or of each of a group, raised inside with these names and indices."""
    try:
        yield
    except InputError as error:
        error.place = (*place, *error.place)
        raise
    except ExceptionGroup as group:
        # errors of several keys of a scenario
        for inner in group.exceptions:
            if isinstance(inner, InputError):
                inner.place = (*place, *inner.place)
        raise


def field_error(problem: str, *place: str | int) -> InputError:
    """Return an InputError at a location inside the value that is being read."""
    error = InputError(problem)
    error.place = place
    return error
