"""`Surface`: heights on a regular grid, with their filters, statistics and summits."""

import math
from typing import Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import (
    ArrayLike,
    Booleans,
    Floats,
    FrozenArrays,
    as_floats,
    per_axis,
    scalar,
)
from historysim.basics.units import quantity_text, range_text, to_si, warn_large_radius
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.surfaces.filters import Form, fit_form, gaussian_mean
from historysim.surfaces.resampling import COINCIDENT, Interpolation, centred_positions, resample
from historysim.surfaces.summits import Summits, find_summits
from historysim.surfaces.surface_statistics import (
    Autocorrelation,
    HeightStatistics,
    autocorrelation,
    height_statistics,
)

MOST_POINTS = 2**28  # the most points of a map
# Remainder after removal of the form, over the largest height, up to which it is a rounding error.
ROUNDING = 32 * np.finfo(np.float64).eps


def _heights(values: Any) -> Floats:
    try:
        values = to_si(values, "m")
    except InputError as error:
        raise InputError(f"heights: {error}") from None
    try:
        # numpy drops the masks of arrays in a list
        masks = isinstance(values, list | tuple) and any(map(np.ma.isMaskedArray, values))
        masked: Any = np.ma.stack(values) if masks else values
        array = np.asarray(np.ma.getdata(masked))
    except ValueError as error:
        raise InputError(
            "heights are lists of different lengths; expected an array (nx, ny) in m"
        ) from error
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"heights are of type {array.dtype}; expected an array (nx, ny) of numbers in m"
        )
    heights = np.where(np.ma.getmaskarray(masked), np.nan, array.astype(np.float64))
    if heights.ndim == 1:
        heights = heights[:, None]
    if heights.ndim != 2 or heights.size == 0:
        raise InputError(
            f"heights have shape {heights.shape}; expected (nx, ny), or (n,) for a profile"
        )
    if np.isinf(heights).any() or np.isnan(heights).all():
        raise InputError(
            "heights are infinite, or all missing; expected finite ones, and NaN where they are missing"
        )
    heights.flags.writeable = False
    return heights


@attrs.frozen(eq=False, init=False, getstate_setstate=False)
class Surface(FrozenArrays):
    """Heights on a regular grid: axis 0 runs along x, axis 1 along y.

    Parameters
    ----------
    heights : array_like (nx, ny)
        Heights over any datum [m], positive out of the material; NaN, or masked, where missing. A
        one-dimensional array is a profile along x.
    pixel_size : float or (float, float)
        Distance between neighbouring points along x and y [m], > 0; one number sets both.
    periodic : bool
        Whether the surface repeats: the point after the last one is the first.

    Raises
    ------
    InputError
        If heights are not numbers, infinite, all missing or of another shape, the pixel size is out
        of range, or `periodic` is not true or false.

    Examples
    --------
    >>> surface = hs.Surface(np.zeros((3, 3)), pixel_size=(1e-6, 1e-6))
    >>> surface.statistics().rms_height
    0.0
    """

    heights: Floats = attrs.field(repr=False)
    pixel_size: tuple[float, float]
    periodic: bool

    def __init__(
        self, heights: "ArrayLike", pixel_size: "ArrayLike", periodic: bool = False
    ) -> None:
        if not isinstance(periodic, bool | np.bool_):
            raise InputError(f"periodic is {periodic!r}; expected True or False")
        self.__attrs_init__(_heights(heights), per_axis("pixel_size", pixel_size), bool(periodic))

    def __repr__(self) -> str:
        return f"<Surface: {', '.join(f'{label} {text}' for label, text in self._lines())}>"

    def _repr_html_(self) -> str:
        return html_table(self._lines())

    def _lines(self) -> list[tuple[str, str]]:
        present = self.heights[~self.missing]
        return [
            ("points", " × ".join(f"{size:,}" for size in self.shape)),
            (
                "pixel size",
                " × ".join(dict.fromkeys(quantity_text(pixel, "m") for pixel in self.pixel_size)),
            ),
            ("heights", range_text(float(present.min()), float(present.max()), "m")),
            ("rms height", quantity_text(float(present.std()), "m")),
            ("periodic", "yes" if self.periodic else "no"),
            ("missing points", f"{self.heights.size - present.size:,}"),
        ]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of points along x and y."""
        return self.heights.shape[0], self.heights.shape[1]

    @property
    def size(self) -> tuple[float, float]:
        """Length of the surface along x and y [m]: points times pixel size."""
        return self.shape[0] * self.pixel_size[0], self.shape[1] * self.pixel_size[1]

    @property
    def nominal_area(self) -> float:
        """Area [m²], including missing points."""
        return self.size[0] * self.size[1]

    @property
    def missing(self) -> Booleans:
        """Points (nx, ny) without a height."""
        return np.isnan(self.heights)

    def summits(self, rule: int = 9, *, prominence: float = 0.0) -> Summits:
        """Return the summits by the 3-, 5- or 9-point rule, of least prominence [m]; see `find_summits`."""
        return find_summits(
            self.heights, self.pixel_size, rule, periodic=self.periodic, prominence=prominence
        )

    def statistics(self) -> HeightStatistics:
        """Return rms height, slopes, curvatures, … of the present points, across the border if periodic."""
        return height_statistics(self.heights, self.pixel_size, periodic=self.periodic)

    def autocorrelation(self) -> Autocorrelation:
        """Return the autocorrelation function of the heights about their mean; InputError if all heights are equal.

        At each lag it is the mean product of all pairs of present points at that distance, across
        the border if the surface is periodic; large lags have few pairs and may give values beyond
        ±1.
        """
        return autocorrelation(self.heights, self.pixel_size, periodic=self.periodic)

    def form(self, kind: str, degree: int | None = None) -> Form:
        """Return the mean height, mean plane, quadratic, polynomial or sphere of the surface; see `fit_form`."""
        return fit_form(self.heights, self.pixel_size, kind, degree)

    def detrended(self, form: str = "plane", degree: int | None = None) -> Self:
        """Return the surface without a form of `fit_form`; it stays periodic only with ``"mean"``."""
        remainder = self.heights - self.form(form, degree).heights
        # if the surface equals its form, the remainder is a rounding error, not roughness
        if np.nanmax(np.abs(remainder)) <= ROUNDING * np.nanmax(np.abs(self.heights)):
            remainder = np.where(self.missing, np.nan, 0.0)
        return type(self)(remainder, self.pixel_size, periodic=self.periodic and form == "mean")

    def cropped(self, x: ArrayLike | None = None, y: ArrayLike | None = None) -> Self:
        """Return the points between two positions [m] along x, y or both, ends included; the first point is at 0.

        The result is not periodic. InputError unless two increasing positions with points between
        them are given.
        """
        heights = self.heights
        for axis, (name, ends) in enumerate((("x", x), ("y", y))):
            if ends is None:
                continue
            limits = as_floats(name, ends)
            length = (self.shape[axis] - 1) * self.pixel_size[axis]
            if limits.shape != (2,) or not 0 <= limits[0] < limits[1]:
                raise InputError(
                    f"{name} is {ends!r}; expected two positions [m], from 0 on, in their order"
                )
            # tolerates rounding of positions that coincide with a point
            lowest, highest = limits / self.pixel_size[axis] + (-COINCIDENT, COINCIDENT)
            where = slice(math.ceil(lowest), math.floor(highest) + 1)
            if where.start >= self.shape[axis] or where.start >= where.stop:
                raise InputError(
                    f"{name} from {limits[0]:g} to {limits[1]:g} m has no points; they end at {length:g} m"
                )
            heights = np.take(heights, np.arange(self.shape[axis])[where], axis)
        return type(self)(heights, self.pixel_size, self.periodic and x is None and y is None)

    def without(self, points: Booleans) -> Self:
        """Return the surface with these points (nx, ny) missing; InputError if none remain."""
        return self._with(np.where(points, np.nan, self.heights))

    def _with(self, heights: Floats) -> Self:
        return type(self)(heights, self.pixel_size, self.periodic)

    def smoothed(self, cutoff: float, *, robust: bool = False) -> Self:
        """Return the waves longer than a cut-off [m] (S-filter); see `filters.gaussian_mean`."""
        return self._with(
            gaussian_mean(
                self.heights, self.pixel_size, cutoff, periodic=self.periodic, robust=robust
            )
        )

    def roughness(self, cutoff: float, *, robust: bool = False) -> Self:
        """Return the waves shorter than a cut-off [m] (L-filter); see `filters.gaussian_mean`."""
        return self._with(self.heights - self.smoothed(cutoff, robust=robust).heights)

    def at_resolution(self, pixel_size: ArrayLike) -> Self:
        """Resample the surface to another pixel size [m] by cubic splines; smooth it first if the grid is coarser.

        The grid keeps its centre. A periodic surface keeps its length and gets the nearest pixel
        size that divides it. InputError if the pixel size is not > 0 or is larger than the surface.
        """
        requested = [
            pixel if points > 1 else current
            for pixel, current, points in zip(
                per_axis("pixel_size", pixel_size), self.pixel_size, self.shape, strict=True
            )
        ]
        counts = [length / pixel for length, pixel in zip(self.size, requested, strict=True)]
        nx, ny = (
            round(count) if self.periodic else math.floor(count * (1 + COINCIDENT))
            for count in counts
        )
        if min(nx, ny) < 1 or nx * ny > MOST_POINTS:
            raise InputError(
                f"pixel_size of {requested[0]:g} × {requested[1]:g} m on {self.size[0]:g} × {self.size[1]:g} m is "
                f"{nx:,} × {ny:,} points; expected from 1 each way to {MOST_POINTS:,} in all"
            )
        onto = (
            (self.size[0] / nx, self.size[1] / ny)
            if self.periodic
            else (requested[0], requested[1])
        )
        heights = resample(
            self.heights, self.pixel_size, periodic=self.periodic, shape=(nx, ny), onto=onto
        )
        return type(self)(heights, onto, self.periodic)

    def scaled(self, rms_height: float) -> Self:
        """Stretch the surface about its mean height to an rms height Rq [m], > 0; InputError if it is level."""
        target = scalar("rms_height", rms_height, above=0)
        if np.nanmax(self.heights) == np.nanmin(self.heights):
            raise InputError(
                "the surface has one height everywhere; expected a rough surface to scale"
            )
        mean = np.nanmean(self.heights)
        deviation = self.heights - mean
        # scaled by the maximum first, since squares of small heights may underflow
        deviation = deviation / np.nanmax(np.abs(deviation))
        return self._with(mean + deviation * (target / math.sqrt(np.nanmean(deviation**2))))

    def on_ball(self, radius: float) -> Self:
        """Add the surface to a ball of this radius [m] whose top is at the centre; the sum is not periodic.

        √(R² - r²) - R is added at the distance r from the centre. InputError if the ball is smaller
        than the surface.
        """
        ball = scalar("radius", radius, above=0)
        warn_large_radius("radius", ball, stacklevel=2)
        x, y = map(centred_positions, self.shape, self.pixel_size)
        square = x[:, np.newaxis] ** 2 + y**2
        if square.max() >= ball**2:
            raise InputError(
                f"radius is {ball:g} m; expected more than {math.sqrt(square.max()):g} m, half the diagonal of the "
                "surface"
            )
        # R - √(R² - r²) without the difference of two large numbers
        drop = square / (ball + np.sqrt(ball**2 - square))
        return type(self)(self.heights - drop, self.pixel_size)

    def mirrored(self) -> Self:
        """Return the surface with x reversed, as seen from behind."""
        return self._with(self.heights[::-1])

    def __add__(self, other: object) -> Self:
        """Return the sum of two surfaces, centre over centre; see `combined`."""
        return self.combined(other) if isinstance(other, Surface) else NotImplemented

    def combined(
        self,
        other: "Surface",
        *,
        shift: ArrayLike = (0.0, 0.0),
        rotation: float = 0.0,
        interpolation: Interpolation = "spline",
    ) -> Self:
        """Return the sum of two surfaces, which touches a flat in the same way as the two touch each other.

        Asperities of the sum slide on a level flat, so that the friction is a lower limit.

        Parameters
        ----------
        other : Surface
            Heights positive out of its material, as here; use ``mirrored()`` of a map that was
            measured from the front.
        shift : (float, float)
            Displacement of its centre from the centre of this surface along x and y [m].
        rotation : float
            Rotation about its centre after the shift, from x towards y [rad].
        interpolation : {"spline", "fourier", "none"}
            Interpolation between its points: cubic splines; its Fourier series, if it is periodic
            and not rotated; or none, with a shift by the nearest whole number of pixels. README.md,
            "Sum", gives their requirements.

        Returns
        -------
        Surface
            On the grid of this surface, missing where either is missing; periodic if both are, with
            one size and no rotation.

        Raises
        ------
        InputError
            If the surfaces do not overlap, one is a profile and one a map, or they do not allow the
            interpolation.
        """
        heights = resample(
            other.heights,
            other.pixel_size,
            periodic=other.periodic,
            shape=self.shape,
            onto=self.pixel_size,
            shift=shift,
            rotation=rotation,
            interpolation=interpolation,
        )
        if np.isnan(self.heights + heights).all():
            raise InputError(
                "the two surfaces have no point in common; expected a shift within their lengths"
            )
        repeats = all(
            points == 1 or math.isclose(length, other_length, rel_tol=COINCIDENT)
            for points, length, other_length in zip(self.shape, self.size, other.size, strict=True)
        )
        periodic = self.periodic and other.periodic and rotation == 0 and repeats
        return type(self)(self.heights + heights, self.pixel_size, periodic=periodic)
