"""`Surface`: heights on a regular grid, and what can be done with them."""

import math
from typing import Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, FrozenArrays, checked, per_axis, scalar
from historysim.basics.units import in_si, quantity_text, range_text
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.surfaces.filters import Form, fit_form, gaussian_mean
from historysim.surfaces.resampling import COINCIDENT, Interpolation, centred, resampled
from historysim.surfaces.summits import Summits, find_summits
from historysim.surfaces.surface_statistics import Autocorrelation, HeightStatistics, autocorrelation, height_statistics

MOST_POINTS = 2**28  # the most points of a map
# Share of the largest height up to which the heights that are left without the form are taken for rounding.
ROUNDING = 32 * np.finfo(np.float64).eps


def _heights(values: Any) -> Floats:
    try:
        values = in_si(values, "m")
    except InputError as error:
        raise InputError(f"heights: {error}") from None
    try:
        # numpy drops the masks of arrays in a list
        masks = isinstance(values, list | tuple) and any(map(np.ma.isMaskedArray, values))
        masked: Any = np.ma.stack(values) if masks else values
        array = np.asarray(np.ma.getdata(masked))
    except ValueError as error:
        raise InputError("heights are lists of different lengths; expected an array (nx, ny) in m") from error
    if array.dtype.kind not in "fiu":
        raise InputError(f"heights are of type {array.dtype}; expected an array (nx, ny) of numbers in m")
    heights = np.where(np.ma.getmaskarray(masked), np.nan, array.astype(np.float64))
    if heights.ndim == 1:
        heights = heights[:, None]
    if heights.ndim != 2 or heights.size == 0:
        raise InputError(f"heights have shape {heights.shape}; expected (nx, ny), or (n,) for a profile")
    if np.isinf(heights).any() or np.isnan(heights).all():
        raise InputError("heights are infinite, or all missing; expected finite ones, and NaN where they are missing")
    heights.flags.writeable = False
    return heights


@attrs.frozen(eq=False, init=False, getstate_setstate=False)
class Surface(FrozenArrays):
    """Heights on a regular grid: axis 0 runs along x, axis 1 along y.

    Parameters
    ----------
    heights : array_like (nx, ny)
        Heights over any datum [m], positive out of the material; NaN, or masked, where they are missing. One
        dimension alone is a profile along x.
    pixel_size : float or (float, float)
        Distance between neighbouring points along x and y [m], > 0; one number stands for both.
    periodic : bool
        Whether the surface repeats: the point after the last one is the first.

    Raises
    ------
    InputError
        Heights that are not numbers, infinite or all missing, another shape, a pixel size out of range, or a
        `periodic` that is not true or false.

    Examples
    --------
    >>> surface = hs.Surface(np.zeros((3, 3)), pixel_size=(1e-6, 1e-6))
    >>> surface.statistics().rms_height
    0.0
    """

    heights: Floats = attrs.field(repr=False)
    pixel_size: tuple[float, float]
    periodic: bool

    def __init__(self, heights: "ArrayLike", pixel_size: "ArrayLike", periodic: bool = False) -> None:
        if not isinstance(periodic, bool | np.bool_):
            raise InputError(f"periodic is {periodic!r}; expected True or False")
        self.__attrs_init__(_heights(heights), per_axis("pixel_size", pixel_size), bool(periodic))

    def __repr__(self) -> str:
        return f"<Surface: {', '.join(f'{label} {text}' for label, text in self._lines())}>"

    def _repr_html_(self) -> str:
        return html_table(self._lines())

    def _lines(self) -> list[tuple[str, str]]:
        known = self.heights[~self.missing]
        return [
            ("points", " × ".join(f"{size:,}" for size in self.shape)),
            ("pixel size", " × ".join(dict.fromkeys(quantity_text(pixel, "m") for pixel in self.pixel_size))),
            ("heights", range_text(float(known.min()), float(known.max()), "m")),
            ("rms height", quantity_text(float(known.std()), "m")),
            ("periodic", "yes" if self.periodic else "no"),
            ("missing points", f"{self.heights.size - known.size:,}"),
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
        """Area [m²], that of missing points included."""
        return self.size[0] * self.size[1]

    @property
    def missing(self) -> Booleans:
        """Where heights are missing (nx, ny)."""
        return np.isnan(self.heights)

    def summits(self, rule: int = 9, *, prominence: float = 0.0) -> Summits:
        """Return the summits by the 3-, 5- or 9-point rule, of least prominence [m]; see `find_summits`."""
        return find_summits(self.heights, self.pixel_size, rule, periodic=self.periodic, prominence=prominence)

    def statistics(self) -> HeightStatistics:
        """Return rms height, slopes, curvatures, … of the present points, also across the border where it repeats."""
        return height_statistics(self.heights, self.pixel_size, periodic=self.periodic)

    def autocorrelation(self) -> Autocorrelation:
        """Return the autocorrelation function of the heights about their mean; equal heights are an InputError.

        At each lag it is the mean product of all pairs of present points that are so far apart, over the border where
        the surface repeats; the few pairs of a great lag may give values beyond ±1.
        """
        return autocorrelation(self.heights, self.pixel_size, periodic=self.periodic)

    def form(self, kind: str, degree: int | None = None) -> Form:
        """Return the mean height, mean plane, quadratic, polynomial or sphere of the surface; see `fit_form`."""
        return fit_form(self.heights, self.pixel_size, kind, degree)

    def detrended(self, form: str = "plane", degree: int | None = None) -> Self:
        """Return the surface without a form of `fit_form`; periodic only where that is ``"mean"``."""
        left = self.heights - self.form(form, degree).heights
        # where the surface is nothing but its form, rounding is left, which is no roughness
        if np.nanmax(np.abs(left)) <= ROUNDING * np.nanmax(np.abs(self.heights)):
            left = np.where(self.missing, np.nan, 0.0)
        return type(self)(left, self.pixel_size, periodic=self.periodic and form == "mean")

    def cropped(self, x: ArrayLike | None = None, y: ArrayLike | None = None) -> Self:
        """Return the points between two positions [m] along x, along y, or both, ends included; the first is at 0.

        What is cropped does not repeat. Anything but two positions in their order, with points between them, is an
        InputError.
        """
        heights = self.heights
        for axis, (name, ends) in enumerate((("x", x), ("y", y))):
            if ends is None:
                continue
            between = checked(name, ends)
            most = (self.shape[axis] - 1) * self.pixel_size[axis]
            if between.shape != (2,) or not 0 <= between[0] < between[1]:
                raise InputError(f"{name} is {ends!r}; expected two positions [m], from 0 on, in their order")
            # positions on a point are on it, whatever their last digit
            first, last = between / self.pixel_size[axis] + (-COINCIDENT, COINCIDENT)
            where = slice(math.ceil(first), math.floor(last) + 1)
            if where.start >= self.shape[axis] or where.start >= where.stop:
                raise InputError(
                    f"{name} from {between[0]:g} to {between[1]:g} m has no points; they end at {most:g} m"
                )
            heights = np.take(heights, np.arange(self.shape[axis])[where], axis)
        return type(self)(heights, self.pixel_size, self.periodic and x is None and y is None)

    def without(self, points: Booleans) -> Self:
        """Return the surface with these points (nx, ny) missing; all of them are an InputError."""
        return self._with(np.where(points, np.nan, self.heights))

    def _with(self, heights: Floats) -> Self:
        return type(self)(heights, self.pixel_size, self.periodic)

    def smoothed(self, cutoff: float, *, robust: bool = False) -> Self:
        """Return what is longer than a cut-off [m] (S-filter); see `filters.gaussian_mean`."""
        return self._with(gaussian_mean(self.heights, self.pixel_size, cutoff, periodic=self.periodic, robust=robust))

    def roughness(self, cutoff: float, *, robust: bool = False) -> Self:
        """Return what is shorter than a cut-off [m] (L-filter); see `filters.gaussian_mean`."""
        return self._with(self.heights - self.smoothed(cutoff, robust=robust).heights)

    def at_resolution(self, pixel_size: ArrayLike) -> Self:
        """Return the surface on points this far apart [m], by cubic splines; smooth it before, where that is coarser.

        The grid keeps its centre. A surface that repeats keeps its length: it gets the nearest pixel size that divides
        it. A pixel size that is not > 0, or larger than the surface, is an InputError.
        """
        wanted = [
            pixel if points > 1 else own
            for pixel, own, points in zip(per_axis("pixel_size", pixel_size), self.pixel_size, self.shape, strict=True)
        ]
        counts = [length / pixel for length, pixel in zip(self.size, wanted, strict=True)]
        nx, ny = (round(count) if self.periodic else math.floor(count * (1 + COINCIDENT)) for count in counts)
        if min(nx, ny) < 1 or nx * ny > MOST_POINTS:
            raise InputError(
                f"pixel_size of {wanted[0]:g} × {wanted[1]:g} m on {self.size[0]:g} × {self.size[1]:g} m is {nx:,} × "
                f"{ny:,} points; expected from 1 each way to {MOST_POINTS:,} in all"
            )
        onto = (self.size[0] / nx, self.size[1] / ny) if self.periodic else (wanted[0], wanted[1])
        heights = resampled(self.heights, self.pixel_size, periodic=self.periodic, shape=(nx, ny), onto=onto)
        return type(self)(heights, onto, self.periodic)

    def scaled(self, rms_height: float) -> Self:
        """Return the surface stretched about its mean height to an rms height Rq [m], > 0; it has to be rough."""
        wanted = scalar("rms_height", rms_height, above=0)
        if np.nanmax(self.heights) == np.nanmin(self.heights):
            raise InputError("the surface has one height everywhere; expected a rough one to scale")
        mean = np.nanmean(self.heights)
        deviation = self.heights - mean
        # divided by the greatest first, since squares of nanometres may underflow
        deviation = deviation / np.nanmax(np.abs(deviation))
        return self._with(mean + deviation * (wanted / math.sqrt(np.nanmean(deviation**2))))

    def on_ball(self, radius: float) -> Self:
        """Return the surface as the roughness of a ball of this radius [m], its centre on top; it does not repeat.

        √(R² - r²) - R is added at the distance r from the centre. A ball that is smaller than the surface is an
        InputError.
        """
        ball = scalar("radius", radius, above=0)
        x, y = map(centred, self.shape, self.pixel_size)
        square = x[:, np.newaxis] ** 2 + y**2
        if square.max() >= ball**2:
            raise InputError(
                f"radius is {ball:g} m; expected more than {math.sqrt(square.max()):g} m, half the diagonal of the "
                "surface, which lies on the ball"
            )
        # R - √(R² - r²) without the difference of two large numbers
        drop = square / (ball + np.sqrt(ball**2 - square))
        return type(self)(self.heights - drop, self.pixel_size)

    def mirrored(self) -> Self:
        """Return the surface with x reversed, as it is seen from behind."""
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
        """Return the sum of two surfaces, which touches a flat as the two touch each other.

        Asperities of the sum slide on a level flat, so that the friction is a lower limit.

        Parameters
        ----------
        other : Surface
            Positive out of its own material, as this one; a map that was measured from its front: ``mirrored()``.
        shift : (float, float)
            How far it is moved along x and y from where its centre is over that of this one [m].
        rotation : float
            By how much it is then turned about its centre, from x towards y [rad].
        interpolation : {"spline", "fourier", "none"}
            What the other is between its points: cubic splines; its Fourier series, where it is periodic and not
            turned; or moved by the nearest whole number of pixels. README.md, "Sum", has what each takes.

        Returns
        -------
        Surface
            On the grid of this one, missing wherever either is; periodic where both are, of one size, and not turned.

        Raises
        ------
        InputError
            Surfaces that do not overlap, a profile on a map, or an interpolation that these surfaces do not allow.
        """
        heights = resampled(
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
            raise InputError("the two surfaces have no point in common; expected a shift within their lengths")
        repeats = all(
            points == 1 or math.isclose(length, others, rel_tol=COINCIDENT)
            for points, length, others in zip(self.shape, self.size, other.size, strict=True)
        )
        periodic = self.periodic and other.periodic and rotation == 0 and repeats
        return type(self)(self.heights + heights, self.pixel_size, periodic=periodic)
