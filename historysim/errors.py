"""The errors that a caller can distinguish: each message names the input, what was expected, how to mend it, and where.

Errors cross processes whole: pickling makes one again of the arguments that its base class was given.
"""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Self


class HistorySimError(Exception):
    """Any error that historysim raises on purpose.

    Attributes
    ----------
    event : int or None
        Number of the load event that cannot be carried out, where it is one.
    """

    event: int | None = None

    @classmethod
    def of_event(cls, index: int, time: str, error: Exception) -> Self:
        """Return an error that names the event, and its time, at which another one has ended a replay."""
        named = cls(f"event {index} at t = {time}: {error}")
        named.event = index
        return named


class InputError(HistorySimError, ValueError):
    """A value, scenario or file that cannot be used as it is.

    Attributes
    ----------
    place : tuple of str or int
        Where the value stands in what was given: names and indices, from outside in; empty where the message says it.
    path : int
        Position of the path that it is about, where several are walked.
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
    return texts if texts[0] != texts[1] or digits >= 17 else distinct_texts(value, bound, digits + 1)


def path_text(place: Iterable[str | int]) -> str:
    """Return a place as scenarios write it: ``"loading.waypoints[3].time"``."""
    text = ""
    for step in place:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            text += ("." if text else "") + (step if re.fullmatch(r"[A-Za-z0-9_-]+", step) else repr(step))
    return text


class MissingPackageError(InputError):
    """What was written with a package of others that is not there."""


class LoadError(HistorySimError):
    """A load that the contact cannot carry: there is no equilibrium at the requested value."""


class FrictionLimitError(LoadError):
    """A tangential load beyond what friction can hold.

    Attributes
    ----------
    request, limit : float
        The load asked for and the largest the contact carries [N].
    path : int
        Position, in the paths that were asked for, of the one that could not be walked.
    """

    def __init__(self, request: float, limit: float, path: int = 0) -> None:
        super().__init__(request, limit, path)
        self.request, self.limit, self.path = request, limit, path

    def __str__(self) -> str:
        request, limit = distinct_texts(self.request, self.limit)
        return (
            f"a tangential load of {request} N is beyond the friction limit of {limit} N (Σ μ N), so "
            "there is no equilibrium; lower it, raise the normal load first, control the displacement instead, or "
            "choose `saturate` to hold the load at the limit"
        )


class CurveEndError(LoadError):
    """A load or an approach beyond the end of the normal curve that the contact was given as.

    Attributes
    ----------
    asked, end : str
        What was asked for, and where the curve ends, both with units.
    path : int
        As for `FrictionLimitError`.
    """

    def __init__(self, asked: str, end: str, path: int = 0) -> None:
        super().__init__(asked, end, path)
        self.asked, self.end, self.path = asked, end, path

    def __str__(self) -> str:
        return f"{self.asked} is beyond the normal curve, which ends at {self.end}; load less, or extend the curve"


class InstallationError(HistorySimError, ImportError):
    """The package is not installed as it has to be."""


class UnlikelyValueWarning(UserWarning):
    """A number is implausible in SI, the unit of plain numbers."""


class RampWarning(UserWarning):
    """A load channel ramps between two waypoints through events that do not set it, which may not be intended."""


@contextmanager
def at(*place: str | int) -> Iterator[None]:
    """Note at an InputError raised inside that it belongs to this place."""
    try:
        yield
    except InputError as error:
        error.place = (*place, *error.place)
        raise


def misfit(problem: str, *place: str | int) -> InputError:
    """Return an InputError that belongs to a place inside the value that is being read."""
    error = InputError(problem)
    error.place = place
    return error
