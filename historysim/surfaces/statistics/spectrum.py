"""Power spectral density of a height map."""

import math
from typing import Literal

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.frozen_arrays import FrozenArrays
from historysim.errors import InputError
from historysim.surfaces.form import fit_form
from historysim.surfaces.statistics.centred_map import Curve, centred, checked_map, frozen, ring_means, square


@attrs.frozen(eq=False, getstate_setstate=False)
class PowerSpectralDensity(FrozenArrays):
    """Power spectral density C of a surface, from `power_spectral_density`.

    C = |∫∫ z exp(-i (q_x x + q_y y)) dx dy|² / area, so that ∫∫ C dq_x dq_y / (2π)² = Rq²: the convention of Jacobs,
    Junge & Pastewka, *Surf. Topogr. Metrol. Prop.* 5 (2017) 013001.

    Attributes
    ----------
    q_x, q_y : array (wavevector)
        Wavevectors along x and y [rad/m], rising, of both signs, 2π over the length of the surface apart; 0 alone
        across a profile. The shortest wave, of two pixels, stands once, as -π over the pixel size.
    values : array (q_x, q_y)
        C [m⁴], and C(-q) = C(q). Across a profile it holds the pixel size as width: see `along_x` for [m³].
    size : (float, float)
        Length of the surface along x and y [m].
    """

    q_x: Floats
    q_y: Floats
    values: Floats = attrs.field(repr=False)
    size: tuple[float, float]

    def along_x(self) -> Curve:
        """Return the wavevectors q_x from 0 up [rad/m], and the density of the profiles along x [m³].

        This is C1 = ∫ C dq_y / (2π), of a periodic map the mean over its profiles, with ∫ C1 dq_x / (2π) = Rq² over
        both signs of q_x.
        """
        return _half(self.q_x, self.values.sum(axis=1) / self.size[1])

    def along_y(self) -> Curve:
        """Return the wavevectors q_y from 0 up [rad/m], and the density of the profiles along y [m³]; see `along_x`."""
        return _half(self.q_y, self.values.sum(axis=0) / self.size[0])

    def radial(self, bins: int | None = None, spacing: Literal["log", "linear"] = "log") -> Curve:
        """Return C averaged over all directions: the mean |q| of each ring [rad/m], and the mean of C in it [m⁴].

        The rings reach from the longest wave of the map to two of the larger pixels. Where the lengths of the surface
        differ, the innermost hold few directions.

        Parameters
        ----------
        bins : int, optional
            Number of rings, some of which may be empty and left out; 10 per decade, or as wide as the distance
            between two wavevectors, unless it is given.
        spacing : {"log", "linear"}
            Whether the rings are equally wide in log q or in q.

        Raises
        ------
        InputError
            A profile, another spacing, or a number of rings below 1.
        """
        if 1 in self.values.shape:
            raise InputError("a profile has no directions to average over; expected a map, or use along_x or along_y")
        first = 2 * math.pi / max(self.size)
        last = math.pi * min(q.size / length for q, length in zip((self.q_x, self.q_y), self.size, strict=True))
        widths = {"log": 10 * math.log10(last / first), "linear": last / first - 1}
        if spacing not in widths:
            raise InputError(f"spacing is {spacing!r}; expected 'log' or 'linear'")
        count = float(checked("bins", max(1, round(widths[spacing])) if bins is None else bins, least=1))
        if not count.is_integer():
            raise InputError(f"bins is {bins!r}; expected a whole number of rings")
        edges = (np.geomspace if spacing == "log" else np.linspace)(first, last, int(count) + 1)
        # a wave at an edge belongs to the ring that begins there, and the last one to the last, whatever the rounding
        edges *= 1 - 1e-9
        edges[-1] = last * (1 + 1e-9)
        return ring_means(np.hypot(self.q_x[:, None], self.q_y[None, :]), self.values, edges)


def power_spectral_density(
    heights: npt.ArrayLike, pixel_size: npt.ArrayLike, *, periodic: bool = False
) -> PowerSpectralDensity:
    """Return the power spectral density of the heights.

    Of a periodic surface, that of the heights about their mean. Of any other, the mean plane is taken off and the
    rest multiplied by a Hann window w, sin²(π (i + ½)/n) along either axis, over √mean(w²), which keeps the power:
    the density then adds up to the mean of w² z² over that of w², Rq² but for the weights.

    Parameters
    ----------
    heights : array_like (nx, ny)
        Heights [m]; none may be missing.
    pixel_size : float or (float, float)
        Distance between the points along x and y [m], > 0.
    periodic : bool
        Whether the surface repeats.

    Raises
    ------
    InputError
        Heights that are not a map, of which some are missing, or that are too few for a mean plane; a pixel size out
        of range.
    """
    from scipy import fft

    z, pixel = checked_map(heights, pixel_size)
    if missing := int(np.isnan(z).sum()):
        raise InputError(
            f"{missing:,} of {z.size:,} heights are missing; a power spectral density needs them all: fill them, or "
            "crop the map to a part without gaps, before"
        )
    deviation = centred(z)[1]
    if not periodic:
        deviation -= fit_form(deviation, pixel, "plane").heights
        deviation *= _hann(z.shape[0])[:, None]
        deviation *= _hann(z.shape[1])[None, :]
    power = square(fft.rfft2(deviation)) * (pixel[0] * pixel[1] / z.size)
    waves_x, waves_y = (np.arange(n) - n // 2 for n in z.shape)
    # the transform of real heights comes with q_y ≥ 0 only; the other half is that of -q
    negative, positive = np.ix_(-waves_x, -waves_y[waves_y < 0]), np.ix_(waves_x, waves_y[waves_y >= 0])
    size = z.shape[0] * pixel[0], z.shape[1] * pixel[1]
    return PowerSpectralDensity(
        frozen(waves_x * (2 * math.pi / size[0])),
        frozen(waves_y * (2 * math.pi / size[1])),
        frozen(np.concatenate([power[negative], power[positive]], axis=1)),
        size,
    )


def _hann(count: int) -> Floats:
    """Return the Hann window over the square root of its mean square; 1 for the single point across a profile."""
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2
    result: Floats = window / np.sqrt(np.mean(window**2))
    return result


def _half(q: Floats, density: Floats) -> Curve:
    """Return both from wavevector 0 up, read from the negative side, which alone has the shortest wave."""
    zero = q.size // 2
    return np.abs(q[zero::-1]), density[zero::-1]
