"""A height map as its file holds it, in its own units, and what all readers of files check."""

import abc
import math
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import attrs

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.tables.readers import Reader

MOST_POINTS = 2**28
"""The most points of a map that are read."""


@attrs.frozen(eq=False)
class RawMap:
    """What a file holds; None where the file does not say.

    Attributes
    ----------
    heights : numpy.ndarray (nx, ny) or (n,)
        Heights, NaN where missing.
    unit : str, optional
        Unit of the heights.
    spacing : tuple of float, optional
        Distance between neighbouring points along x and y.
    lateral_unit : str, optional
        Unit of the spacing.
    periodic : bool
        Whether the surface repeats.
    """

    heights: Floats
    unit: str | None = None
    spacing: tuple[float, float] | None = None
    lateral_unit: str | None = None
    periodic: bool = False


class MapReader(Reader):
    """What reads a format of height maps."""

    @abc.abstractmethod
    def read(self, path: Path, channel: int | str | None) -> RawMap:
        """Read a file; ``channel`` says which of its channels, where the user names one.

        Raises
        ------
        InputError
            A damaged file, or of another kind, or no such channel.
        """


def check_size(shape: Iterable[int]) -> None:
    """Check that a map has no more points than `MOST_POINTS`.

    Raises
    ------
    InputError
        It has more.
    """
    points = math.prod(shape)
    if points > MOST_POINTS:
        raise InputError(f"has {points:,} points; expected {MOST_POINTS:,} or fewer: thin or cut it")


def refuse_channel(channel: int | str | None) -> None:
    """Check that no channel is asked for, where the file has none.

    Raises
    ------
    InputError
        One is.
    """
    if channel is not None:
        raise InputError(f"channel is {channel!r}, but a matrix has no channels; leave it out")


@contextmanager
def blamed(problem: str) -> Iterator[None]:
    """Turn whatever a library raises inside into this problem of the file, and silence its warnings.

    Raises
    ------
    InputError
        The problem; an InputError from inside is passed on as it is.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:  # readers of damaged files raise whatever they stumble over
        raise InputError(problem) from error
