"""Summits from statistics instead of a height map: a distribution of their heights, and their number per area.

The distribution is Gaussian or a table of heights and densities. The n summits are drawn at random with a seed, or they
are quantiles, without chance: the medians of n intervals of equal probability.
"""

import math
from typing import Protocol, Self

import attrs
import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from historysim.basics.arguments import checked, scalar
from historysim.basics.array_types import Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.errors import InputError
from historysim.surfaces.seeds import generator
from historysim.surfaces.summits import Summits

MOST_SUMMITS = 50_000_000
"""The most summits that are made at once; with their positions they take some gigabytes."""


class HeightDistribution(Protocol):
    """How the heights of summits are distributed."""

    @property
    def mean(self) -> float:
        """Mean height over the datum [m]."""

    @property
    def deviation(self) -> float:
        """Standard deviation of the heights [m]."""

    def quantile(self, probability: "npt.ArrayLike") -> Floats:
        """Return the heights [m] below which a summit lies with these probabilities [1]."""


@attrs.frozen(init=False)
class Gaussian:
    """Gaussian heights.

    Parameters
    ----------
    rms_height : float
        Root mean square of the heights about their mean [m], > 0.
    mean : float
        Mean height over the datum [m].

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """

    rms_height: float
    mean: float

    def __init__(self, rms_height: float, mean: float = 0.0) -> None:
        self.__attrs_init__(rms_height=scalar("rms_height", rms_height, above=0), mean=scalar("mean", mean))

    @property
    def deviation(self) -> float:
        """Standard deviation of the heights [m]."""
        return self.rms_height

    def quantile(self, probability: "npt.ArrayLike") -> Floats:
        """Return the heights [m] below which a summit lies with these probabilities.

        Parameters
        ----------
        probability : array_like
            Greater than 0 and less than 1 [1]: a Gaussian has no lowest and no highest height.

        Raises
        ------
        InputError
            A probability that is not a number or out of its range.
        """
        values = checked("probability", probability, above=0)
        if np.any(values >= 1):
            raise InputError(
                f"probability is {values.max():g}; expected less than 1: Gaussian heights have no highest one"
            )
        result: Floats = self.mean + self.rms_height * ndtri(values)
        return result


@attrs.frozen(eq=False, init=False, getstate_setstate=False)
class Tabulated(FrozenArrays):
    """Heights with a density given in a table, straight between its rows and 0 outside.

    Parameters
    ----------
    height : array_like (row)
        Increasing heights over the datum [m], two or more.
    density : array_like (row)
        Probability density there, 0 or more and not 0 throughout, in any unit: it is normalised.

    Attributes
    ----------
    height : array (row)
        [m], read-only.
    density : array (row)
        [1/m], with an integral of 1; read-only.

    Raises
    ------
    InputError
        A number that is not finite or a negative density, heights that do not increase, arrays of different lengths,
        or a density that is 0 throughout.
    """

    height: Floats
    density: Floats
    _cumulative: Floats = attrs.field(repr=False)

    def __init__(self, height: "npt.ArrayLike", density: "npt.ArrayLike") -> None:
        heights, densities = _table("height", height, density)
        # the largest first, so that no unit makes the integral overflow
        densities = densities / densities.max()
        cumulative = np.concatenate([[0.0], np.cumsum(np.diff(heights) * (densities[:-1] + densities[1:]) / 2)])
        total = cumulative[-1]
        self.__attrs_init__(
            height=_read_only(heights),
            density=_read_only(densities / total),
            cumulative=_read_only(cumulative / total),
        )

    @classmethod
    def from_gaps(cls, gap: "npt.ArrayLike", density: "npt.ArrayLike") -> Self:
        """Return the distribution of the heights that belong to gaps, as the literature of joints tabulates them.

        The datum of the heights is the plane in which the gap is 0. The flat has to come closer than that by the gap
        of a summit to touch it, so that the height of the summit is minus its gap.

        Parameters
        ----------
        gap : array_like (row)
            Increasing distances from the summits to the flat at first touch [m], 0 or more.
        density : array_like (row)
            As for heights: in any unit, such as that per gap divided by the largest gap.

        Raises
        ------
        InputError
            As for heights; a negative gap.
        """
        gaps, densities = _table("gap", checked("gap", gap, least=0), density)
        return cls(0.0 - gaps[::-1], densities[::-1])

    @property
    def mean(self) -> float:
        """Mean height over the datum [m]."""
        start, width, left, right = self._cells
        # ∫ s p ds over a cell, with s from its start
        first = width**2 * (left + 2 * right) / 6
        return float(self.height[0] + np.sum((start - self.height[0]) * width * (left + right) / 2 + first))

    @property
    def deviation(self) -> float:
        """Standard deviation of the heights [m]."""
        start, width, left, right = self._cells
        offset = start - self.mean
        # ∫ (offset + s)² p ds over a cell, with s from its start
        squares = (
            offset**2 * width * (left + right) / 2
            + 2 * offset * width**2 * (left + 2 * right) / 6
            + width**3 * (left + 3 * right) / 12
        )
        return math.sqrt(np.sum(squares))

    def quantile(self, probability: "npt.ArrayLike") -> Floats:
        """Return the heights [m] below which a summit lies with these probabilities: the exact inverse.

        Where the density is 0 between two heights, the probability there has the lower of them as its height.
        Probability 0 has the lowest height that a summit can have.

        Parameters
        ----------
        probability : array_like
            From 0 to 1 [1].

        Raises
        ------
        InputError
            A probability that is not a number or out of its range.
        """
        values = checked("probability", probability, least=0)
        if np.any(values > 1):
            raise InputError(f"probability is {values.max():g}; expected 1 or less")
        lowest = np.searchsorted(self._cumulative, 0.0, side="right") - 1
        cell = np.maximum(np.searchsorted(self._cumulative, values, side="left") - 1, lowest)
        start, width, left, right = (column[cell] for column in self._cells)
        # left s + slope s²/2 = rise, solved for s without a difference of near numbers
        rise = values - self._cumulative[cell]
        root = np.sqrt(np.maximum(left**2 + 2 * rise * (right - left) / width, 0))
        offset = np.divide(2 * rise, left + root, out=np.zeros_like(rise), where=left + root > 0)
        result: Floats = np.minimum(start + offset, self.height[cell + 1])
        return result

    @property
    def _cells(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Start, width and the densities at both ends of the cells of the table."""
        return self.height[:-1], np.diff(self.height), self.density[:-1], self.density[1:]


def drawn_summits(
    distribution: HeightDistribution,
    radius: "npt.ArrayLike",
    *,
    summit_density: float,
    nominal_area: float,
    seed: int,
) -> Summits:
    """Return summits drawn at random: independent heights, uniform positions on a square of the nominal area.

    Parameters
    ----------
    distribution : HeightDistribution
        `Gaussian` or `Tabulated`. One seed gives the same positions and the same ranking by height with either.
    radius : array_like
        R [m], > 0; one for all, or one per summit.
    summit_density : float
        D [1/m²], > 0.
    nominal_area : float
        A0 [m²], > 0; D A0, rounded, is the number of summits, at least 1 and at most `MOST_SUMMITS`.
    seed : int
        Whole number, 0 or more; the same seed draws the same summits.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, or too few or too many summits.
    """
    count = _count(summit_density, nominal_area)
    random = generator(seed)
    # 0 stands for a strip of 2^-53, and the middle of that strip has a finite height in any distribution
    probability = np.maximum(random.random(count), 2.0**-54)
    x, y = math.sqrt(scalar("nominal_area", nominal_area)) * random.random((2, count))
    return Summits(distribution.quantile(probability), radius, x, y, nominal_area=nominal_area)


def quantile_summits(
    distribution: HeightDistribution, radius: "npt.ArrayLike", *, summit_density: float, nominal_area: float
) -> Summits:
    """Return summits without chance: the heights at the probabilities (i + ½)/n, from low to high, without positions.

    The mean of any function of the height over these summits is its mean over the distribution by the midpoint rule.

    Parameters and errors as in `drawn_summits`.
    """
    count = _count(summit_density, nominal_area)
    return Summits(distribution.quantile((np.arange(count) + 0.5) / count), radius, nominal_area=nominal_area)


def _count(summit_density: float, nominal_area: float) -> int:
    density = scalar("summit_density", summit_density, above=0)
    area = scalar("nominal_area", nominal_area, above=0)
    if not 0.5 < density * area <= MOST_SUMMITS:
        raise InputError(
            f"summit_density {density:g} 1/m² times nominal_area {area:g} m² makes {density * area:g} summits; "
            f"expected 1 to {MOST_SUMMITS:,}: change the area or the density"
        )
    return round(density * area)


def _table(name: str, place: "npt.ArrayLike", density: "npt.ArrayLike") -> tuple[Floats, Floats]:
    places, densities = checked(name, place), checked("density", density, least=0)
    if places.ndim != 1 or places.shape != densities.shape or places.size < 2:
        raise InputError(
            f"{name} has shape {places.shape} and density {densities.shape}; expected two lists of one length ≥ 2"
        )
    if np.any(np.diff(places) <= 0):
        row = int(np.argmax(np.diff(places) <= 0)) + 1
        raise InputError(f"{name}[{row}] is {places[row]:g} after {places[row - 1]:g}; expected increasing numbers")
    if not densities.any():
        raise InputError("density is 0 throughout; expected a number greater than 0 somewhere")
    return places, densities


def _read_only(values: Floats) -> Floats:
    array = np.array(values)
    array.flags.writeable = False
    return array
