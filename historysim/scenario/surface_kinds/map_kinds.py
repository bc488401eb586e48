"""Surfaces from height maps: random, measured, the sum of two maps, or the meeting summits of two maps."""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import attrs
import numpy as np

from historysim.basics.arguments import representable
from historysim.basics.fields import Key, Length, Lengths, Numbers, Quantity
from historysim.basics.wording import Notify, format_value, silent
from historysim.errors import InputError, error_path, field_error
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.surfaces.inspection import quantisation_notice
from historysim.surfaces.preparation import (
    PREPARATIONS,
    Preparation,
    list_keys,
    registered_steps,
    select_steps,
)
from historysim.surfaces.reading import read_surface
from historysim.surfaces.summits import WOLF, Summits

if TYPE_CHECKING:
    from historysim.surfaces.heights import Surface

Angle = Annotated[float, Quantity("rad")]

_FRACTION = Key(
    lambda fraction: isinstance(fraction, bool) or 0 <= fraction < 1,
    "true, or a fraction of the height range, from 0 to less than 1",
)


def declared_fields(kind: type, section: object) -> dict[str, Any]:
    """Return the fields that a class itself declares, by name, as arguments of a function."""
    return {key: getattr(section, key) for key in kind.__annotations__}


def _with_steps(kind: type, fields: "list[attrs.Attribute[Any]]") -> "list[attrs.Attribute[Any]]":
    """Add the keys of the preparation steps to the fields of a kind of map."""
    names = {field.name for field in fields}
    keys = list_keys(select_steps(getattr(kind, "kind", None), kind.preparations))  # type: ignore[attr-defined] # of a HeightMap
    return [*fields, *(key for key in keys if key.name not in names)]


@attrs.frozen(kw_only=True, field_transformer=_with_steps)
class HeightMap(SurfaceKind):
    """Base class of surfaces with a height map."""

    preparations: ClassVar[tuple[type[Preparation], ...]] = registered_steps()

    #: Which points are summits: higher than all 8 neighbours (9), than 4 (5), or, of a profile,
    #: than 2 (3).
    rule: int = 9
    #: ``true``, or a fraction of Rz: accepts only summits that rise above the saddle to a higher
    #: one by 5 % of Rz, or by that fraction.
    prune: bool | float | None = attrs.field(default=None, validator=_FRACTION)
    #: places the map on a ball, centre on top, after all preparation
    ball_radius: Length | None = None

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> type[SurfaceKind]:
        """Return this class, with the keys of preparation steps of other packages if an entry has unknown keys."""
        # the search for them takes time
        if entry.keys() <= {*attrs.fields_dict(cls), "kind"}:
            return cls
        everything = {"preparations": tuple(PREPARATIONS.values())}
        return attrs.frozen(kw_only=True, field_transformer=_with_steps)(
            type(cls.__name__, (cls,), everything)
        )

    @abc.abstractmethod
    def read_or_generate(self, folder: Path, notify: Notify) -> "Surface":
        """Read or generate the map before its preparation; ``notify`` receives notices for the user."""

    def surface(self, folder: Path, notify: Notify = silent) -> "Surface":
        """Return the prepared map."""
        surface = self.read_or_generate(folder, notify)
        for step in select_steps(self.kind, self.preparations):
            keys = {key: getattr(self, key) for key in attrs.fields_dict(step)}
            surface = step(**keys).prepare(surface, lambda notice: notify(f"{self.source}{notice}"))
        return surface

    @property
    def source(self) -> str:
        """Prefix of notices on the map."""
        return ""

    def without_preparation(self) -> "HeightMap | None":
        """Return the kind without preparation and with all summits; None if nothing prepares it."""
        steps = [step for step in select_steps(self.kind, self.preparations) if step.compared]
        defaults: dict[str, Any] = {key.name: key.default for key in list_keys(steps)}
        plain = attrs.evolve(self, **defaults, prune=None)
        return None if plain == self else plain

    def find_summits(self, surface: "Surface") -> Summits:
        """Return the summits, except those of too small prominence if ``prune`` is set."""
        if not self.prune:
            return surface.summits(self.rule)
        share = WOLF if self.prune is True else self.prune
        return surface.summits(self.rule, prominence=share * surface.statistics().height_range)

    def build(self, folder: Path) -> BuiltSurface:
        """Build the summits of the map."""
        notices: list[str] = []
        with representable():
            surface = self.surface(folder, notices.append)
            if self.ball_radius is not None:
                with error_path("ball_radius"):
                    surface = surface.on_ball(self.ball_radius)
            summits = self.find_summits(surface)
        if not len(summits):
            points = " × ".join(map(str, surface.shape))
            raise InputError(
                f"the {self.rule}-point rule finds no summit among {points} points; expected a point with only lower "
                "neighbours, none of them missing or beyond the border"
            )
        return BuiltSurface(summits, surface, notices=tuple(notices), ball_radius=self.ball_radius)


@SURFACES.register
@attrs.frozen(kw_only=True, field_transformer=_with_steps)
class RandomMap(HeightMap):
    """Random heights with an autocorrelation function.

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
    also_called = ("rough", "gaussian", "fractal", "self-affine", "generated", "isotropic")

    shape: tuple[int, ...]  #: points, ``[nx, ny]``
    pixel_size: Lengths  #: distance of the points, one length or one for x and one for y
    rms_height: Length  #: Rq
    #: Length at which the autocorrelation is 0.1: at least a pixel, at most half a side.
    autocorrelation_length: Lengths
    seed: int  #: the same seed gives the same surface
    autocorrelation: str = "exponential"  #: ``"exponential"`` or ``"gaussian"``

    def read_or_generate(self, folder: Path, notify: Notify) -> "Surface":  # noqa: ARG002 - no file needed
        """Generate the map."""
        # imports scipy, which maps from files do not need
        from historysim.surfaces.random import random_surface

        return random_surface(**declared_fields(RandomMap, self))


@SURFACES.register
@attrs.frozen(kw_only=True, field_transformer=_with_steps)
class MeasuredMap(HeightMap):
    """A measured height map.

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
    also_called = ("map", "height map", "heights", "topography", "file", "afm", "profilometer")

    file: str  #: path, relative to the scenario
    pixel_size: Lengths | None = None  #: spacing of the points, if the file does not state it
    height_unit: str | None = None  #: unit of the heights, likewise
    lateral_unit: str | None = None  #: unit of coordinates, likewise
    #: number, from 0, or name of the channel of a file that has several
    channel: int | str | None = None
    missing: Numbers = ()  #: numbers that mark missing points in the file, such as ``-9999``

    @property
    def source(self) -> str:
        """The file."""
        return f"{self.file}: "

    def read_or_generate(self, folder: Path, notify: Notify) -> "Surface":
        """Read the map; notify if its heights are too coarse for summit radii."""
        with error_path("file"):
            keys = declared_fields(MeasuredMap, self)
            measured = read_surface(folder / keys.pop("file"), **keys)
        unfiltered = getattr(self, "s_filter", None) is None
        if unfiltered and (notice := quantisation_notice(measured)):
            notify(f"{self.source}{notice}")
        return measured


@SURFACES.register
@attrs.frozen(kw_only=True, field_transformer=_with_steps)
class SumOfMaps(HeightMap):
    """Two rough surfaces in contact, as the sum of both against a flat.

    Examples
    --------
    [surface]
    kind = "sum"
    first = { kind = "measured", file = "data/heights_128.txt", pixel_size = "1 µm", height_unit = "nm" }
    second = { kind = "measured", file = "data/heights_128.txt", pixel_size = "1 µm", height_unit = "nm" }
    rotation = "30 degree"
    """

    kind = "sum"

    first: HeightMap  #: A surface that is ``"random"``, ``"measured"`` or again a ``"sum"``
    second: HeightMap  #: the other surface, centred on the first
    shift: Lengths = (0.0, 0.0)  #: displacement of the second, ``[x, y]``
    rotation: Angle = 0.0  #: rotation of the second about its centre, from x towards y
    #: Of the second on the points of the first: ``"spline"``, ``"fourier"`` or ``"none"``.
    interpolation: str = "spline"

    def read_or_generate(self, folder: Path, notify: Notify) -> "Surface":
        """Add both maps."""
        with error_path("first"):
            first_map = self.first.surface(folder, notify)
        with error_path("second"):
            second_map = self.second.surface(folder, notify)
        return first_map.combined(
            second_map,
            shift=self.shift,
            rotation=self.rotation,
            interpolation=self.interpolation,  # type: ignore[arg-type] # its value is checked there
        )


@SURFACES.register
@attrs.frozen(kw_only=True)
class MeetingMaps(SurfaceKind):
    """Two rough surfaces whose summits meet on slopes: asperities are inclined.

    Examples
    --------
    [surface]
    kind = "meeting"
    first = { kind = "measured", file = "data/heights_128.txt", pixel_size = "1 µm", height_unit = "nm" }
    second = { kind = "measured", file = "data/heights_128.txt", pixel_size = "1 µm", height_unit = "nm" }
    """

    kind = "meeting"

    first: HeightMap  #: A surface of a kind that has a height map
    #: The other surface, with heights towards the first; centred on the first, it moves along x.
    second: HeightMap
    shift: Lengths = (0.0, 0.0)  #: initial displacement of the second, ``[x, y]``

    def build(self, folder: Path) -> BuiltSurface:
        """Build the meeting summits."""
        if np.shape(self.shift) != (2,):
            raise field_error(
                f"{format_value(self.shift)}; expected one length along x and one along y", "shift"
            )
        notices: list[str] = []
        summits, centres = [], []
        for name, kind in (("first", self.first), ("second", self.second)):
            with error_path(name), representable():
                surface = kind.surface(folder, notices.append)
                summits.append(kind.find_summits(surface))
                centres.append((np.array(surface.shape) - 1) / 2 * surface.pixel_size)
        x, y = centres[0] - centres[1] + self.shift
        return BuiltSurface(
            summits[0].meeting(summits[1], shift=(float(x), float(y))), notices=tuple(notices)
        )
