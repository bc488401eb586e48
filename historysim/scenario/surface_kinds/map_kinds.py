"""Surfaces given by a height map: random, measured, or the sum of two."""

import abc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import attrs

from historysim.basics.fields import Key, Length, Lengths, Number, Quantity
from historysim.basics.places import at, misfit
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.scenario.surface_kinds.surface_kind import SURFACES, BuiltSurface, SurfaceKind

if TYPE_CHECKING:
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

PREPARATION = (
    "crop_x",
    "crop_y",
    "spikes",
    "outliers",
    "s_filter",
    "resolution",
    "l_filter",
    "robust",
    "prune",
)
"""Keys that prepare a map, beside its form."""

Angle = Annotated[float, Quantity("rad")]

_DEVIATIONS = Key(lambda number: number > 0, "a number of standard deviations, greater than 0")


@attrs.frozen(kw_only=True)
class HeightMap(SurfaceKind):
    """What every kind with a height map has.

    Attributes
    ----------
    rule
        Which points are summits: higher than all 8 neighbours (9), than 4 (5), or, of a profile, than 2 (3).
    s_filter
        Keeps what is longer than this cut-off, two pixels or more (ISO 16610-21).
    l_filter
        Takes off what is longer than this cut-off.
    robust
        Both filters by ISO 16610-71.
    resolution
        Pixel size on which the map is laid after ``s_filter``, by splines.
    prune
        ``true``, or a share of Rz: takes only summits that rise over the saddle to a higher one by 5 % of Rz,
        or by that share.
    ball_radius
        Lays the map on a ball, its centre on top, after all that prepares it.
    """

    rule: int = 9
    s_filter: Length | None = None
    l_filter: Length | None = None
    robust: bool = False
    resolution: Lengths | None = None
    prune: bool | float | None = None
    ball_radius: Length | None = None

    @abc.abstractmethod
    def surface(self, folder: Path) -> "Surface":
        """Return the map."""

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the map, and nothing that the user should know."""
        return self.surface(folder), ()

    def unprepared(self) -> "HeightMap | None":
        """Return the same kind with its map as it comes, and all its summits; None where this is that."""
        default = {field.name: field.default for field in attrs.fields(type(self)) if field.name in PREPARATION}
        plain = attrs.evolve(self, **default)
        return None if plain == self else plain

    def filtered(self, surface: "Surface") -> "Surface":
        """Return a map after its S-filter, on the points of the resolution that is asked for, after its L-filter."""
        if self.robust and self.s_filter is None and self.l_filter is None:
            raise misfit("there is no filter; expected s_filter or l_filter beside it", "robust")
        if self.s_filter is not None:
            with at("s_filter"):
                surface = surface.smoothed(self.s_filter, robust=self.robust)
        if self.resolution is not None:
            with at("resolution"):
                surface = surface.at_resolution(self.resolution)
        if self.l_filter is not None:
            with at("l_filter"):
                surface = surface.roughness(self.l_filter, robust=self.robust)
        return surface

    def found_summits(self, surface: "Surface") -> "Summits":
        """Return the summits, without those that rise less than a share of the height range."""
        from historysim.surfaces.summits import WOLF

        if not self.prune:
            return surface.summits(self.rule)
        share = WOLF if self.prune is True else self.prune
        return surface.summits(self.rule, prominence=share * surface.statistics().height_range)

    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits of the map, and the map."""
        from historysim.basics.arguments import representable

        with representable():
            surface, notices = self.noticed(folder)
            if self.ball_radius is not None:
                with at("ball_radius"):
                    surface = surface.on_ball(self.ball_radius)
            summits = self.found_summits(surface)
        if not len(summits):
            points = " × ".join(map(str, surface.shape))
            raise InputError(
                f"the {self.rule}-point rule finds no summit among {points} points; expected a point with lower ones "
                "all around, none of them missing or beyond the border"
            )
        return BuiltSurface(summits, surface, notices=notices, ball_radius=self.ball_radius)


def _cropped(
    surface: "Surface", x: "float | tuple[float, ...] | None", y: "float | tuple[float, ...] | None"
) -> "Surface":
    """Return the points of a map between two positions along x and along y, their heights as they are."""
    for key, ends in (("x", x), ("y", y)):
        if ends is not None:
            with at(f"crop_{key}"):
                surface = surface.cropped(**{key: ends})
    return surface


@SURFACES.register
@attrs.frozen(kw_only=True)
class RandomMap(HeightMap):
    """Random heights with an autocorrelation function.

    Attributes
    ----------
    shape
        Points, ``[nx, ny]``.
    pixel_size
        Distance of the points, one length or one for x and one for y.
    rms_height
        Rq.
    autocorrelation_length
        Where the autocorrelation falls to 0.1: at least a pixel, at most half a side.
    seed
        The same seed makes the same surface.
    autocorrelation
        ``"exponential"`` or ``"gaussian"``.
    skewness
        Of the heights.
    kurtosis
        Of the heights; 3 is Gaussian.
    crop_x
        The points between two positions along x.
    crop_y
        Likewise along y.

    Examples
    --------
    [surface]
    kind = "random"
    shape = [256, 256]
    pixel_size = "1 µm"
    rms_height = "30 nm"
    autocorrelation_length = "20 µm"
    seed = 1
    """

    kind = "random"

    shape: tuple[int, ...]
    pixel_size: Lengths
    rms_height: Length
    autocorrelation_length: Lengths
    seed: int
    autocorrelation: str = "exponential"
    skewness: Number = 0.0
    kurtosis: Number = 3.0
    crop_x: Lengths | None = None
    crop_y: Lengths | None = None

    def surface(self, folder: Path) -> "Surface":  # noqa: ARG002 - it needs no file
        """Return the map."""
        from historysim.surfaces.random import random_surface

        made = random_surface(
            self.shape,  # type: ignore[arg-type] # its length is checked there
            self.pixel_size,
            self.rms_height,
            self.autocorrelation_length,
            seed=self.seed,
            autocorrelation=self.autocorrelation,
            skewness=self.skewness,
            kurtosis=self.kurtosis,
        )
        return self.filtered(_cropped(made, self.crop_x, self.crop_y))


@SURFACES.register
@attrs.frozen(kw_only=True)
class MeasuredMap(HeightMap):
    """A measured height map.

    Attributes
    ----------
    file
        Path, relative to the scenario.
    pixel_size
        Distance of the points, where the file does not say it.
    height_unit
        Unit of the heights, likewise.
    lateral_unit
        Unit of coordinates, likewise.
    channel
        Number, from 0, or name of the channel of a file that has several.
    crop_x
        The points between two positions along x; the first point is at 0.
    crop_y
        Likewise along y.
    spikes
        Points that stand off the median of the 24 around them by more than so many robust standard deviations
        become missing.
    form
        Taken off: ``"mean"``, ``"plane"``, ``"quadratic"``, ``"polynomial"`` or ``"sphere"``.
    degree
        Of ``"polynomial"``, 0 to 12.
    outliers
        Points farther from the median height than so many robust standard deviations become missing.
    rms_height
        The heights are stretched to it, after the filters.
    mirrored
        ``true`` reverses x.

    Examples
    --------
    [surface]
    kind = "measured"
    file = "data/heights_128.txt"
    pixel_size = "1 µm"
    height_unit = "nm"
    form = "sphere"
    """

    kind = "measured"

    file: str
    pixel_size: Lengths | None = None
    height_unit: str | None = None
    lateral_unit: str | None = None
    channel: int | str | None = None
    crop_x: Lengths | None = None
    crop_y: Lengths | None = None
    spikes: Number | None = attrs.field(default=None, validator=_DEVIATIONS)
    form: str = "plane"
    degree: int | None = None
    outliers: Number | None = attrs.field(default=None, validator=_DEVIATIONS)
    rms_height: Length | None = None
    mirrored: bool = False

    def surface(self, folder: Path) -> "Surface":
        """Return the map of the file, prepared."""
        return self.noticed(folder)[0]

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the map of the file, prepared, and what the user should know about it."""
        from historysim.surfaces.outliers import outliers, spikes
        from historysim.surfaces.quantisation import quantisation_notice

        measured = _cropped(self._read(folder), self.crop_x, self.crop_y)
        coarse = quantisation_notice(measured) if self.s_filter is None else None
        notices = [f"{self.file}: {coarse}"] if coarse else []
        if self.spikes is not None:
            wrong = spikes(measured.heights, self.spikes)
            measured = measured.without(wrong)
            notices.append(f"{self.file}: {counted(int(wrong.sum()), 'point', 'points')} taken off as spikes")
        with at("form"):
            measured = measured.detrended(self.form, self.degree)
        if self.outliers is not None:
            wrong = outliers(measured.heights, self.outliers)
            measured = measured.without(wrong)
            notices.append(f"{self.file}: {counted(int(wrong.sum()), 'point', 'points')} taken off as outliers")
        measured = self.filtered(measured)
        if self.rms_height is not None:
            with at("rms_height"):
                measured = measured.scaled(self.rms_height)
        return measured.mirrored() if self.mirrored else measured, tuple(notices)

    def _read(self, folder: Path) -> "Surface":
        from historysim.surfaces.reading import read_surface

        with at("file"):
            return read_surface(
                folder / self.file,
                pixel_size=self.pixel_size,  # type: ignore[arg-type] # its length is checked there
                height_unit=self.height_unit,
                lateral_unit=self.lateral_unit,
                channel=self.channel,
            )


@SURFACES.register
@attrs.frozen(kw_only=True)
class SumOfMaps(HeightMap):
    """Two rough surfaces against each other, as the sum of both against a flat.

    Attributes
    ----------
    first
        A surface that is ``"random"``, ``"measured"`` or again a ``"sum"``.
    second
        The other one, which lies on the first centre over centre.
    shift
        By which the second is moved, ``[x, y]``.
    rotation
        By which the second is turned about its own centre, from x towards y.
    interpolation
        Of the second on the points of the first: ``"spline"``, ``"fourier"`` or ``"none"``.

    Examples
    --------
    [surface]
    kind = "sum"
    rotation = "30 degree"

    [surface.first]
    kind = "random"
    shape = [64, 64]
    pixel_size = "1 µm"
    rms_height = "20 nm"
    autocorrelation_length = "10 µm"
    seed = 1

    [surface.second]
    kind = "random"
    shape = [128, 128]
    pixel_size = "1 µm"
    rms_height = "20 nm"
    autocorrelation_length = "10 µm"
    seed = 2
    """

    kind = "sum"

    first: HeightMap
    second: HeightMap
    shift: Lengths = (0.0, 0.0)
    rotation: Angle = 0.0
    interpolation: str = "spline"

    def surface(self, folder: Path) -> "Surface":
        """Return the sum of both maps."""
        return self.noticed(folder)[0]

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the sum of both maps, and what splines take from the second one."""
        from historysim.surfaces.smoothing import smoothing_notice

        with at("first"):
            first, notices = self.first.noticed(folder)
        with at("second"):
            second, more = self.second.noticed(folder)
        total = first.combined(
            second,
            shift=self.shift,
            rotation=self.rotation,
            interpolation=self.interpolation,  # type: ignore[arg-type] # its value is checked there
        )
        smoothed = None
        if self.interpolation == "spline":
            smoothed = smoothing_notice(first, second, shift=self.shift, rotation=self.rotation)
        return self.filtered(total), (
            *notices,
            *more,
            *([f"second surface of the sum: {smoothed}"] if smoothed else []),
        )
