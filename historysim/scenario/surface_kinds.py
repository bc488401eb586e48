"""The kinds of ``[surface]`` in a scenario: the keys of each, and the summits that it gives."""

import abc
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import attrs
from cattrs import Converter

from historysim.basics.places import at, misfit
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.scenario.columns import NumbersFile
from historysim.scenario.schema import Length, Lengths, Number, Numbers, Quantity, given, table
from historysim.tables import Column

if TYPE_CHECKING:
    from historysim.surfaces.distribution import HeightDistribution
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

Area = Annotated[float, Quantity("m2")]
SummitDensity = Annotated[float, Quantity("m-2")]
Angle = Annotated[float, Quantity("rad")]

DEEPEST = 20
"""Sums within sums that are followed."""


@attrs.frozen(eq=False)
class Ground:
    """What a ``[surface]`` gives.

    Attributes
    ----------
    summits : Summits
        The summits that become asperities.
    surface : Surface, optional
        The height map that they were found on.
    friction : array (summit), optional
        Their friction coefficients, where the surface has its own.
    notices : tuple of str
        What the user should know about how it was made.
    """

    summits: "Summits"
    surface: "Surface | None" = None
    friction: Any = None
    notices: tuple[str, ...] = ()


class SurfaceKind(Protocol):
    """``[surface]``: one class for each kind; a new kind is a new class in ``KINDS``."""

    def ground(self, folder: Path) -> Ground:
        """Make the summits; paths are relative to the folder."""


@contextmanager
def _in_file(name: str) -> Iterator[None]:
    """Say of an InputError raised inside that this file is to blame."""
    try:
        yield
    except InputError as error:
        raise misfit(f"{name}: {error}", "file") from error


# -- summits ---------------------------------------------------------------------------------------


@attrs.frozen
class Sphere:
    """One spherical asperity."""

    radius: Length

    def ground(self, folder: Path) -> Ground:  # noqa: ARG002 - a sphere needs no file
        """Give one summit at height 0."""
        from historysim.surfaces.summits import Summits

        return Ground(Summits(0.0, self.radius))


@attrs.frozen
class InlineSummits:
    """Summits written out in the scenario; a single number stands for all."""

    height: Lengths
    radius: Lengths
    x: Lengths | None = None
    y: Lengths | None = None

    def ground(self, folder: Path) -> Ground:  # noqa: ARG002 - they are in the scenario itself
        """Give the summits."""
        import numpy as np

        from historysim.surfaces.summits import Summits

        sizes = {key: np.size(value) for key, value in given(self).items()}
        for key, size in sizes.items():
            if size == 0:
                raise misfit("an empty array; expected one number, or one for each summit", key)
        height = np.broadcast_to(self.height, max(sizes.values())) if sizes["height"] == 1 else self.height
        return Ground(Summits(height, self.radius, self.x, self.y))


@attrs.frozen
class SummitColumns:
    """Which column of the summit table holds what."""

    height: Column
    radius: Column
    x: Column | None = None
    y: Column | None = None
    friction: Column | None = None


@attrs.frozen(kw_only=True)
class SummitTable(NumbersFile):
    """Summits from a table."""

    columns: SummitColumns

    def ground(self, folder: Path) -> Ground:
        """Read the summits."""
        from historysim.surfaces.summits import Summits

        units = {"height": "m", "radius": "m", "x": "m", "y": "m", "friction": "1"}
        rows = self.table(folder, given(self.columns), units)
        found = rows.columns
        for key, expected in (("radius", "more than 0"), ("friction", "0 or more")):
            for row, value in enumerate(found.get(key, ())):
                if value < 0 or (value == 0 and key == "radius"):
                    problem = f"{rows.place(row)}: {key} is {value:g}; expected {expected}, in SI"
                    raise misfit(f"{self.file}: {problem}", "file")
        summits = Summits(found["height"], found["radius"], found.get("x"), found.get("y"))
        return Ground(summits, friction=found.get("friction"))


@attrs.frozen
class Textured:
    """A regular array of equal asperities, with scatter on request."""

    count: tuple[int, ...]
    pitch: Lengths
    radius: Length
    scaling: str | None = None
    height_scatter: Length = 0.0
    radius_scatter: Number = 0.0
    seed: int | None = None

    def ground(self, folder: Path) -> Ground:  # noqa: ARG002 - a texture needs no file
        """Make the array; by a scaling law the radius is that of the one asperity which the array replaces."""
        import math

        from historysim.basics.arguments import representable
        from historysim.surfaces.textured import LAWS, split, textured_summits

        radius = self.radius
        if self.scaling is not None:
            if self.scaling not in LAWS:
                raise misfit(f"{shown(self.scaling)}; {nearest(self.scaling, LAWS)}", "scaling")
            radius = float(split(radius, max(math.prod(self.count), 1), self.scaling))
        with representable():
            summits = textured_summits(
                self.count,  # type: ignore[arg-type] # its length is checked there
                self.pitch,  # type: ignore[arg-type] # likewise
                radius,
                height_scatter=self.height_scatter,
                radius_scatter=self.radius_scatter,
                seed=self.seed,
            )
        return Ground(summits)


# -- statistics ------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Statistics(abc.ABC):
    """So many summits per area, drawn with a seed or, without one, as quantiles."""

    radius: Length
    summit_density: SummitDensity
    nominal_area: Area
    seed: int | None = None

    @abc.abstractmethod
    def distribution(self, folder: Path) -> "HeightDistribution":
        """Give the distribution of the heights."""

    def ground(self, folder: Path) -> Ground:
        """Make the summits."""
        from historysim.basics.arguments import representable
        from historysim.surfaces.distribution import drawn_summits, quantile_summits

        amount = {"summit_density": self.summit_density, "nominal_area": self.nominal_area}
        with representable():
            heights = self.distribution(folder)
            if self.seed is None:
                return Ground(quantile_summits(heights, self.radius, **amount))
            return Ground(drawn_summits(heights, self.radius, **amount, seed=self.seed))


@attrs.frozen(kw_only=True)
class GaussianStatistics(Statistics):
    """Gaussian heights."""

    rms_height: Length

    def distribution(self, folder: Path) -> "HeightDistribution":  # noqa: ARG002 - it is in the scenario itself
        """Give the distribution of the heights."""
        from historysim.surfaces.distribution import Gaussian

        return Gaussian(self.rms_height)


def _tabulated(height: Any, gap: Any, density: Any) -> "HeightDistribution":
    from historysim.surfaces.distribution import Tabulated

    return Tabulated(height, density) if gap is None else Tabulated.from_gaps(gap, density)


def _height_or_gap(self: "InlineStatistics | DensityColumns") -> None:
    if (self.height is None) == (self.gap is None):
        told = "neither height nor gap" if self.height is None else "both height and gap"
        raise InputError(f"{told}; expected one of them")


@attrs.frozen(kw_only=True)
class InlineStatistics(Statistics):
    """A density of heights, or of gaps (0 for the summit that touches first), written out."""

    height: Lengths | None = None
    gap: Lengths | None = None
    density: Numbers

    def __attrs_post_init__(self) -> None:
        """Check that the density is of one thing."""
        _height_or_gap(self)

    def distribution(self, folder: Path) -> "HeightDistribution":  # noqa: ARG002 - it is in the scenario itself
        """Give the distribution of the heights."""
        return _tabulated(self.height, self.gap, self.density)


@attrs.frozen
class DensityColumns:
    """Which column of the table of a density holds what."""

    density: Column
    height: Column | None = None
    gap: Column | None = None

    def __attrs_post_init__(self) -> None:
        """Check that the density is of one thing."""
        _height_or_gap(self)


@attrs.frozen(kw_only=True)
class StatisticsTable(NumbersFile, Statistics):
    """A density of heights or gaps from a file."""

    columns: DensityColumns

    def distribution(self, folder: Path) -> "HeightDistribution":
        """Read the distribution of the heights."""
        units = {"height": "m", "gap": "m", "density": "1"}
        found = self.table(folder, given(self.columns), units).columns
        with _in_file(self.file):
            return _tabulated(found.get("height"), found.get("gap"), found["density"])


# -- height maps -----------------------------------------------------------------------------------


class MapKind(Protocol):
    """A surface that is a height map."""

    def surface(self, folder: Path) -> "Surface":
        """Make the map; paths are relative to the folder."""

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Make the map, and say what the user should know about how it was made."""


@attrs.frozen(kw_only=True)
class HeightMap(abc.ABC):
    """What every kind with a height map has."""

    rule: int = 9

    @abc.abstractmethod
    def surface(self, folder: Path) -> "Surface":
        """Make the map."""

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Make the map, about which there is nothing to say."""
        return self.surface(folder), ()

    def ground(self, folder: Path) -> Ground:
        """Make the map and find its summits."""
        from historysim.basics.arguments import representable

        with representable():
            surface, notices = self.noticed(folder)
            summits = surface.summits(self.rule)
        if not len(summits):
            points = " × ".join(map(str, surface.shape))
            raise InputError(
                f"the {self.rule}-point rule finds no summit among {points} points; expected a point with lower ones "
                "all around, none of them missing or beyond the border"
            )
        return Ground(summits, surface, notices=notices)


@attrs.frozen(kw_only=True)
class Random(HeightMap):
    """Random heights with an autocorrelation function."""

    shape: tuple[int, ...]
    pixel_size: Lengths
    rms_height: Length
    autocorrelation_length: Lengths
    seed: int
    autocorrelation: str = "exponential"
    skewness: Number = 0.0
    kurtosis: Number = 3.0

    def surface(self, folder: Path) -> "Surface":  # noqa: ARG002 - it needs no file
        """Generate the map."""
        from historysim.surfaces.random import random_surface

        return random_surface(
            self.shape,  # type: ignore[arg-type] # its length is checked there
            self.pixel_size,
            self.rms_height,
            self.autocorrelation_length,
            seed=self.seed,
            autocorrelation=self.autocorrelation,
            skewness=self.skewness,
            kurtosis=self.kurtosis,
        )


@attrs.frozen(kw_only=True)
class Measured(HeightMap):
    """A measured height map."""

    file: str
    pixel_size: Lengths | None = None
    height_unit: str | None = None
    lateral_unit: str | None = None
    channel: int | str | None = None
    form: str = "plane"
    rms_height: Length | None = None
    mirrored: bool = False

    def surface(self, folder: Path) -> "Surface":
        """Read the map, take off its form, and scale it."""
        from historysim.surfaces.reading import read_surface

        with at("file"):
            measured = read_surface(
                folder / self.file,
                pixel_size=self.pixel_size,  # type: ignore[arg-type] # its length is checked there
                height_unit=self.height_unit,
                lateral_unit=self.lateral_unit,
                channel=self.channel,
            )
        with at("form"):
            measured = measured.detrended(self.form)
        if self.rms_height is not None:
            with at("rms_height"):
                measured = measured.scaled(self.rms_height)
        return measured.mirrored() if self.mirrored else measured


@attrs.frozen(kw_only=True)
class Sum(HeightMap):
    """Two rough surfaces against each other, as the sum of both against a flat."""

    first: MapKind
    second: MapKind
    shift: Lengths = (0.0, 0.0)
    rotation: Angle = 0.0
    interpolation: str = "spline"

    def surface(self, folder: Path) -> "Surface":
        """Make both maps and add them."""
        return self.noticed(folder)[0]

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Make both maps, add them, and return what splines take from the second one."""
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
        return total, (*notices, *more, *([f"second surface of the sum: {smoothed}"] if smoothed else []))


# -- of any kind -----------------------------------------------------------------------------------


def _positive(_: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    if not value > 0:
        raise misfit(f"{value:g}; expected a number greater than 0", attribute.name)


@attrs.frozen
class Scaled:
    """Any surface, with the heights of its summits stretched about their mean; their radii stay."""

    kind: SurfaceKind
    height_scale: float = attrs.field(validator=_positive)

    def ground(self, folder: Path) -> Ground:
        """Make the summits."""
        ground = self.kind.ground(folder)
        mean = ground.summits.height.mean()
        height = mean + self.height_scale * (ground.summits.height - mean)
        return attrs.evolve(ground, summits=ground.summits.at_heights(height))


# -- by their names --------------------------------------------------------------------------------

Choice = Callable[[Mapping[str, Any]], type]


def _summits(entry: Mapping[str, Any]) -> type:
    return SummitTable if {"file", "columns"} & set(entry) else InlineSummits


def _statistics(entry: Mapping[str, Any]) -> type:
    if {"file", "columns"} & set(entry):
        return StatisticsTable
    return InlineStatistics if {"density", "height", "gap"} & set(entry) else GaussianStatistics


MAPS: Mapping[str, Choice] = {
    "random": lambda _: Random,
    "measured": lambda _: Measured,
    "sum": lambda _: Sum,
}
KINDS: Mapping[str, Choice] = {
    "sphere": lambda _: Sphere,
    "summits": _summits,
    "textured": lambda _: Textured,
    "statistics": _statistics,
    **MAPS,
}


def surface_from_toml(converter: Converter, value: object, _: object) -> SurfaceKind:
    """Structure ``[surface]``.

    Raises
    ------
    InputError
        An unknown kind, keys that do not fit it, or sums within sums without end.
    """
    level, depth = _parts(value), 0
    while level:
        level, depth = [part for entry in level for part in _parts(entry)], depth + 1
        if depth > DEEPEST:
            raise InputError(f"sums within sums, more than {DEEPEST} deep; expected fewer")
    entry = dict(table(value))
    scale = converter.structure(entry.pop("height_scale"), Number) if "height_scale" in entry else None
    surface: SurfaceKind = _structured(converter, entry, KINDS)
    return surface if scale is None else Scaled(surface, scale)


def map_from_toml(converter: Converter, value: object, _: object) -> MapKind:
    """Structure a surface that has to be a height map; errors as for `surface_from_toml`."""
    if "rule" in table(value):
        raise misfit("belongs to the surface as a whole; expected it beside first and second", "rule")
    surface: MapKind = _structured(converter, value, MAPS)
    return surface


def _parts(entry: object) -> list[object]:
    """Give the two surfaces of what may be a sum."""
    return [entry[key] for key in ("first", "second") if key in entry] if isinstance(entry, dict) else []


def channel_from_toml(converter: Converter, value: object, _: object) -> int | str | None:
    """Structure the number or name of a channel.

    Raises
    ------
    InputError
        Anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int | str | None):
        raise InputError(f"{shown(value)}; expected the number of a channel, from 0, or its name")
    return converter.structure(value, int) if isinstance(value, int) else value


def _structured(converter: Converter, value: object, kinds: Mapping[str, Choice]) -> Any:
    entry = dict(table(value))
    if "kind" not in entry:
        raise misfit(f"missing; expected one of {', '.join(kinds)}", "kind")
    kind = entry.pop("kind")
    if not isinstance(kind, str) or kind not in kinds:
        # one that is known elsewhere is no slip of the pen
        word = kind if isinstance(kind, str) and kind not in KINDS else ""
        raise misfit(f"{shown(kind)}; {nearest(word, kinds)}", "kind")
    return converter.structure(entry, kinds[kind](entry))
