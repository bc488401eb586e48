"""Summits without a height map: from a distribution of their heights, or in a regular array.

A regular array may replace one asperity by n equal ones that share its load, F/n each: self-similar
ones have R/√n, curvature-invariant ones keep R (Winogrodzka, *Pre-sliding behaviour of multi
asperity ceramic contacts*, section 6.2.1; the loads per contact printed there, F/n² and F/√n, do
not add up to F and are not used).
"""

import math
from collections.abc import Mapping
from typing import Final, Self

import attrs
import numpy as np

from historysim.basics.arguments import (
    ArrayLike,
    Floats,
    FrozenArrays,
    as_floats,
    as_item_array,
    per_axis,
    scalar,
)
from historysim.errors import InputError
from historysim.surfaces.summits import Summits

# the most summits that are generated; with their positions they need some gigabytes
MOST_SUMMITS = 50_000_000

# Scaling laws by name: exponent of n in the radius of each asperity.
LAWS: Final[Mapping[str, float]] = {"self-similar": -0.5, "curvature-invariant": 0.0}


def generator(seed: object) -> "np.random.Generator":
    """Return the PCG64 generator of a seed; InputError unless the seed is a whole number of 0 or more."""
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed is {seed!r}; expected a whole number of 0 or more")
    return np.random.Generator(np.random.PCG64(int(seed)))


@attrs.frozen(init=False)
class Gaussian:
    """Gaussian heights: rms height about the mean [m], > 0, and mean over the datum [m]."""

    rms_height: float
    mean: float

    def __init__(self, rms_height: float, mean: float = 0.0) -> None:
        self.__attrs_init__(
            rms_height=scalar("rms_height", rms_height, above=0), mean=scalar("mean", mean)
        )

    def quantile(self, probability: ArrayLike) -> Floats:
        """Return the heights [m] below which a summit is with these probabilities [1], above 0 and below 1."""
        values = _probability(probability, above=0)
        if np.any(values == 1):
            raise InputError(
                "probability is 1; expected less than 1: Gaussian heights have no highest one"
            )
        # a slow import that scenarios without Gaussian heights do not need
        from scipy.special import ndtri

        result: Floats = self.mean + self.rms_height * ndtri(values)
        return result


@attrs.frozen(eq=False, init=False, getstate_setstate=False)
class Tabulated(FrozenArrays):
    """Heights with a tabulated density, linear between its rows and 0 outside.

    Heights (row) [m] increase; the density (row) is 0 or more in any unit, and is normalised.
    InputError if there are fewer than two rows, the heights do not increase or the density is 0
    throughout.
    """

    height: Floats
    density: Floats
    _cumulative: Floats = attrs.field(repr=False)

    def __init__(self, height: ArrayLike, density: ArrayLike) -> None:
        heights, densities = _table("height", height, density)
        # scaled by the maximum, so that the integral does not overflow in any unit
        densities = densities / densities.max()
        cumulative = np.concatenate(
            [[0.0], np.cumsum(np.diff(heights) * (densities[:-1] + densities[1:]) / 2)]
        )
        columns = (heights, densities / cumulative[-1], cumulative / cumulative[-1])
        self.__attrs_init__(*(as_item_array("row", "rows", "height", column) for column in columns))

    @classmethod
    def from_gaps(cls, gap: ArrayLike, density: ArrayLike) -> Self:
        """Return the height distribution of tabulated gaps [m], as the literature on joints gives them: height = -gap.

        Gaps (row) are increasing distances from the summits to the flat at first touch, 0 or more.
        """
        gaps, densities = _table("gap", as_floats("gap", gap, least=0), density)
        return cls(0.0 - gaps[::-1], densities[::-1])

    def quantile(self, probability: ArrayLike) -> Floats:
        """Return the heights [m] below which a summit is with these probabilities, 0 to 1: the exact inverse.

        Where the density is 0 between two heights, the lower one; at probability 0 the lowest
        possible height.
        """
        values = _probability(probability, least=0)
        lowest = np.searchsorted(self._cumulative, 0.0, side="right") - 1
        cell = np.maximum(np.searchsorted(self._cumulative, values, side="left") - 1, lowest)
        density_below, density_above = self.density[cell], self.density[cell + 1]
        # left s + slope s²/2 = rise, solved for s without a difference of near numbers
        rise = values - self._cumulative[cell]
        root = np.sqrt(
            np.maximum(
                density_below**2
                + 2 * rise * (density_above - density_below) / np.diff(self.height)[cell],
                0,
            )
        )
        offset = np.divide(
            2 * rise, density_below + root, out=np.zeros_like(rise), where=density_below + root > 0
        )
        result: Floats = np.minimum(self.height[cell] + offset, self.height[cell + 1])
        return result


HeightDistribution = Gaussian | Tabulated


def drawn_summits(
    distribution: HeightDistribution,
    radius: ArrayLike,
    *,
    summit_density: float,
    nominal_area: float,
    seed: int,
) -> Summits:
    """Draw random summits: independent heights, uniform positions on a square of the nominal area.

    Their number is D A0, rounded, with D ``summit_density`` [1/m²] and A0 ``nominal_area`` [m²], at
    least 1 and at most `MOST_SUMMITS`; the radius [m] is one number, or one per summit. A seed, a
    whole number of 0 or more, gives the same positions and the same ranking by height with either
    distribution.
    """
    count = _count(summit_density, nominal_area)
    random = generator(seed)
    # 0 represents an interval of 2^-53, whose middle has a finite height in any distribution
    probability = np.maximum(random.random(count), 2.0**-54)
    x, y = math.sqrt(scalar("nominal_area", nominal_area)) * random.random((2, count))
    return Summits(distribution.quantile(probability), radius, x, y, nominal_area=nominal_area)


def quantile_summits(
    distribution: HeightDistribution,
    radius: ArrayLike,
    *,
    summit_density: float,
    nominal_area: float,
) -> Summits:
    """Return summits at the quantiles (i + ½)/n of a distribution, from low to high, without positions.

    Parameters and errors as in `drawn_summits`.
    """
    count = _count(summit_density, nominal_area)
    return Summits(
        distribution.quantile((np.arange(count) + 0.5) / count), radius, nominal_area=nominal_area
    )


def textured_summits(
    count: tuple[int, int],
    pitch: float | tuple[float, float],
    radius: float,
    *,
    height_scatter: float = 0.0,
    radius_scatter: float = 0.0,
    seed: int | None = None,
) -> Summits:
    """Return the summits of a regular array, summit i ny + j at x = i pitch_x and y = j pitch_y [m].

    Parameters
    ----------
    count : (int, int)
        Numbers of summits along x and y.
    pitch : float or (float, float)
        Distance from one summit to the next along x and y [m], > 0.
    radius : float
        R [m], > 0, the mean of the radii.
    height_scatter : float
        Standard deviation of the Gaussian heights around 0 [m].
    radius_scatter : float
        Standard deviation of the log-normal radii over R [1], 0 to 1.
    seed : int, optional
        Required for scatter. A seed gives the same heights for any scatter of the radii, and vice
        versa.
    """
    sides = [
        number for number in np.atleast_1d(count).tolist() if isinstance(number, int) and number > 0
    ]
    if len(sides) != 2 or math.prod(sides) > MOST_SUMMITS:
        raise InputError(
            f"count is {count!r}; expected two whole numbers (nx, ny), 1 or more each, and at most {MOST_SUMMITS:,} in "
            "all"
        )
    nx, ny = sides
    px, py = per_axis("pitch", pitch)
    mean_radius = scalar("radius", radius, above=0)
    deviation = scalar("height_scatter", height_scatter, least=0)
    relative = scalar("radius_scatter", radius_scatter, least=0)
    if relative > 1:
        raise InputError(
            f"radius_scatter is {relative:g}; expected 0 to 1: a fraction of the radius, not a percentage"
        )
    heights, radii = np.zeros(nx * ny), np.full(nx * ny, mean_radius)
    if deviation or relative:
        if seed is None:
            raise InputError(
                "height_scatter or radius_scatter without a seed; expected a whole number as seed"
            )
        normal = generator(seed).standard_normal((2, nx * ny))
        heights += deviation * normal[0]
        # parameters of the Gaussian logarithm that give the requested mean and deviation
        variance = math.log1p(relative**2)
        radii *= np.exp(math.sqrt(variance) * normal[1] - variance / 2)
    x, y = np.repeat(np.arange(nx) * px, ny), np.tile(np.arange(ny) * py, nx)
    return Summits(heights, radii, x, y, nominal_area=nx * px * ny * py)


def _count(summit_density: float, nominal_area: float) -> int:
    density = scalar("summit_density", summit_density, above=0)
    area = scalar("nominal_area", nominal_area, above=0)
    if not 0.5 < density * area <= MOST_SUMMITS:
        raise InputError(
            f"summit_density {density:g} 1/m² times nominal_area {area:g} m² makes {density * area:g} summits; "
            f"expected 1 to {MOST_SUMMITS:,}: change the area or the density"
        )
    return round(density * area)


def _table(name: str, abscissa: ArrayLike, density: ArrayLike) -> tuple[Floats, Floats]:
    abscissae, densities = as_floats(name, abscissa), as_floats("density", density, least=0)
    if abscissae.ndim != 1 or abscissae.shape != densities.shape or abscissae.size < 2:
        raise InputError(
            f"{name} has shape {abscissae.shape} and density {densities.shape}; expected two lists of one length ≥ 2"
        )
    if np.any(np.diff(abscissae) <= 0):
        row = int(np.argmax(np.diff(abscissae) <= 0)) + 1
        raise InputError(
            f"{name}[{row}] is {abscissae[row]:g} after {abscissae[row - 1]:g}; expected increasing numbers"
        )
    if not densities.any():
        raise InputError("density is 0 throughout; expected a number greater than 0 somewhere")
    return abscissae, densities


def _probability(values: ArrayLike, **limits: float) -> Floats:
    probability = as_floats("probability", values, **limits)
    if np.any(probability > 1):
        raise InputError(f"probability is {probability.max():g}; expected 1 or less")
    return probability
