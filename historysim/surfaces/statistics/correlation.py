"""Autocorrelation function of a height map."""

import math
from typing import Literal

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.errors import InputError
from historysim.surfaces.statistics.centred_map import Curve, centred, checked_map, frozen, ring_means, square

Axis = Literal["x", "y"]


@attrs.frozen(eq=False, getstate_setstate=False)
class Autocorrelation(FrozenArrays):
    """Autocorrelation function ρ of a surface, from `autocorrelation`.

    Attributes
    ----------
    lags_x, lags_y : array (lag)
        Lags along x and y [m], from minus to plus half the length of the surface; 0 alone across a profile.
    values : array (lag_x, lag_y)
        ρ [1]: 1 at lag 0, and ρ(-lag) = ρ(lag). NaN at lags that no two present points have.
    """

    lags_x: Floats
    lags_y: Floats
    values: Floats = attrs.field(repr=False)

    def along_x(self) -> Curve:
        """Return the lags along x from 0 up [m], and ρ at them."""
        return self._along("x")

    def along_y(self) -> Curve:
        """Return the lags along y from 0 up [m], and ρ at them."""
        return self._along("y")

    def length(self, axis: Axis, level: float = 0.1) -> float:
        """Return the autocorrelation length along an axis [m]: the first lag at which ρ falls to a level.

        Parameters
        ----------
        axis : {"x", "y"}
            The axis.
        level : float
            The level [1], from -1 to below 1; 0.1 and 1/e are usual.

        Returns
        -------
        float
            Interpolated linearly between the lags that have a value; NaN where ρ stays above the level at all lags.

        Raises
        ------
        InputError
            Another axis, or a level out of range.
        """
        if axis not in ("x", "y"):
            raise InputError(f"axis is {axis!r}; expected 'x' or 'y'")
        target = float(checked("level", level, least=-1))
        if target >= 1:
            raise InputError(f"level is {target:g}; expected less than 1, where every surface starts at lag 0")
        lags, values = self._along(axis)
        known = ~np.isnan(values)
        lags, values = lags[known], values[known]
        fallen = np.flatnonzero(values <= target)
        if fallen.size == 0:
            return math.nan
        ends = slice(fallen[0] - 1, fallen[0] + 1)
        return float(np.interp(-target, -values[ends], lags[ends]))

    @property
    def lay(self) -> float:
        """γ [1]: autocorrelation length along x over that along y, at 0.1; NaN where there is none."""
        return self.length("x") / self.length("y")

    def radial(self) -> Curve:
        """Return ρ averaged over all directions: the mean lag of each ring [m], and the mean of ρ in it.

        Rings are as wide as the shorter pixel, and reach to half the shorter length of the surface. Lags without a
        value are left out.
        """
        axes = [lags for lags in (self.lags_x, self.lags_y) if lags.size > 1]
        width = min(lags[1] - lags[0] for lags in axes)
        count = round(min(lags[-1] for lags in axes) / width)
        lag = np.hypot(self.lags_x[:, None], self.lags_y[None, :])
        return ring_means(lag, self.values, (np.arange(count + 2) - 0.5) * width)

    def _along(self, axis: Axis) -> Curve:
        zero_x, zero_y = self.lags_x.size // 2, self.lags_y.size // 2
        if axis == "x":
            return self.lags_x[zero_x:], self.values[zero_x:, zero_y]
        return self.lags_y[zero_y:], self.values[zero_x, zero_y:]


def autocorrelation(heights: npt.ArrayLike, pixel_size: npt.ArrayLike, *, periodic: bool = False) -> Autocorrelation:
    """Return the autocorrelation function of the heights about their mean.

    At each lag, the products of all pairs of present points that are so far apart are averaged: over the border of a
    periodic surface, else only within the map (unbiased by their number, so that the few pairs of a great lag may
    give values beyond ±1).

    Parameters
    ----------
    heights : array_like (nx, ny)
        Heights [m]; NaN where missing.
    pixel_size : float or (float, float)
        Distance between the points along x and y [m], > 0.
    periodic : bool
        Whether the surface repeats.

    Raises
    ------
    InputError
        Heights that are not a map, all missing or all equal, or a pixel size out of range.
    """
    from scipy import fft

    z, pixel = checked_map(heights, pixel_size)
    present = ~np.isnan(z)
    deviation = np.zeros(z.shape)
    deviation[present] = centred(z[present])[1]
    greatest = np.abs(deviation).max()
    if greatest == 0:
        raise InputError("all heights are equal; expected a rough surface, since a flat one has no autocorrelation")
    deviation /= greatest
    # half the length of zeros behind the map keeps the lags up to half the length apart from their mirror images
    shape = z.shape if periodic else tuple(fft.next_fast_len(n + n // 2, real=True) for n in z.shape)
    steps = [np.arange(-(n // 2), n // 2 + 1) for n in z.shape]
    # negative lags stand at the end of the transform, where negative indices point
    pairs = np.rint(_products(present, shape)[np.ix_(*steps)])
    values = _products(deviation, shape)[np.ix_(*steps)]
    values /= np.where(pairs > 0, pairs, np.nan)
    values /= values[z.shape[0] // 2, z.shape[1] // 2]
    return Autocorrelation(frozen(steps[0] * pixel[0]), frozen(steps[1] * pixel[1]), frozen(values))


def _products(values: npt.NDArray[np.generic], shape: tuple[int, ...]) -> Floats:
    """Return the sum over the products of values one lag apart, for all lags on a periodic grid of this shape."""
    from scipy import fft

    result: Floats = fft.irfft2(square(fft.rfft2(values, shape)), shape)
    return result
