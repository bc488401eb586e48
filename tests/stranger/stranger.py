"""A package of somebody else with one of each class that has an entry point."""

from contextlib import contextmanager

import attrs
import numpy as np

from historysim.asperities.attraction import Attraction
from historysim.asperities.laws import FrictionLaw
from historysim.asperities.wear import WearLaw
from historysim.asperities.yielding import YieldingLaw
from historysim.basics.fields import Force, Length, Number, SurfaceEnergy, Time, at_least
from historysim.loads.events import Event, NormalLoad, TangentialDisplacement
from historysim.results.plots.chart import Chart, Curve
from historysim.results.plots.pictures import Picture
from historysim.results.report.page import Section, page, paragraph, render_page
from historysim.results.result_files import FileKind
from historysim.scenario.loading_kinds import Loading
from historysim.scenario.surface_kinds import BuiltSurface, SurfaceKind
from historysim.scenario.surface_kinds.map_kinds import HeightMap
from historysim.surfaces.heights import Surface
from historysim.surfaces.map_files import MapReader, RawMap
from historysim.surfaces.preparation import Preparation
from historysim.surfaces.summits import Summits
from historysim.tables.arrays import Array, Contents
from historysim.tables.readers import LineReader, TableReader


@attrs.frozen
class Warming(FrictionLaw):
    """Friction that falls with the load of the asperity, μ = μ0/(1 + N/N0)."""

    cold: Number = attrs.field(validator=at_least(0.0))
    half_load: Force = attrs.field(validator=at_least(0.0, above=True))

    kind, depends_on, same_bits = "warming", "own", True

    def coefficients(self, loaded):
        return self.cold / (1 + loaded.normal_load / self.half_load)

    @property
    def text(self):
        return f"warming: {self.cold:g} when cold, half of it at {self.half_load:g} N"


@attrs.frozen(kw_only=True)
class SquaredWear(WearLaw):
    """Volume that varies with the square of the load, dV = rate N² ds."""

    rate: Number = attrs.field(validator=at_least(0.0))

    kind = "squared"

    def volume(self, normal_load, slid_distance, dissipated_energy):
        del dissipated_energy
        return self.rate * normal_load**2 * slid_distance

    @property
    def text(self):
        return f"squared: {self.rate:g} m²/N²"


@attrs.frozen
class Halved(Attraction):
    """Half the attraction of a sphere, πRW."""

    work: SurfaceEnergy = attrs.field(validator=at_least(0.0))

    kind = "halved"

    def forces(self, summit_radius):
        return np.pi * self.work * summit_radius

    @property
    def text(self):
        return f"halved: {self.work:g} J/m²"


@attrs.frozen(kw_only=True)
class Filled(Preparation):
    """Fills the map below a height.

    Attributes
    ----------
    floor
        Lower points are raised to it.
    """

    kind, order = "filled", 70

    floor: Length | None = None

    def prepare(self, surface, notify):
        if self.floor is None:
            return surface
        notify(f"filled up to {self.floor:g} m")
        return Surface(
            np.maximum(surface.heights, self.floor), surface.pixel_size, surface.periodic
        )


@attrs.frozen
class Soft(YieldingLaw):
    """First loading along the tangent of Hertz's from an approach on, as Thornton's with another onset."""

    onset: Length = attrs.field(validator=at_least(0.0, above=True))

    kind = "soft"

    def critical_approach(self, summit_radius, pair):
        del pair
        return np.full(summit_radius.size, self.onset)

    def first_loading(self, approach, summit_radius, pair):
        at_onset = 4 / 3 * pair.contact_modulus * np.sqrt(summit_radius * self.onset**3)
        load = at_onset * (1 + 1.5 * (approach / self.onset - 1))
        return load, np.sqrt(summit_radius * approach)

    @property
    def text(self):
        return f"soft: yields from {self.onset:g} m on"


@attrs.frozen
class Grease(Event):
    """All friction becomes a part of what it was."""

    time: Time = attrs.field(validator=at_least(-np.inf))
    part: Number = attrs.field(validator=at_least(0.0))

    name, changes_friction = "grease", True

    def act(self, ensemble, state, *, saturate, instrument):
        del saturate
        return ensemble.with_friction(state, self.part * state.friction, instrument=instrument)


@attrs.frozen
class Stairs(SurfaceKind):
    """Summits on the steps of a stair."""

    step: Length
    radius: Length
    count: int = 4

    kind = "stairs"

    def build(self, folder):
        del folder
        return BuiltSurface(Summits(-self.step * np.arange(self.count), self.radius))


@attrs.frozen(kw_only=True)
class Cone(HeightMap):
    """A map with one summit in its middle."""

    height: Length
    points: int = 9

    kind = "cone"

    def read_or_generate(self, folder, notify):
        del folder
        notify("a cone")
        distance = np.abs(np.linspace(-1, 1, self.points))
        return Surface(-self.height * np.add.outer(distance, distance), (1e-6, 1e-6))


@attrs.frozen(kw_only=True)
class Strokes(Loading):
    """So many strokes to and fro under a load."""

    load: Force
    stroke: Length
    count: int = 1

    kind = "strokes"

    def events(self, folder, notify=None):
        del folder, notify
        ends = [(-1) ** number * self.stroke for number in range(2 * self.count)]
        return [
            NormalLoad(0.0, self.load),
            *(TangentialDisplacement(1.0 + k, end) for k, end in enumerate(ends)),
        ]


class StairMap(MapReader):
    """Height maps of two numbers: the count of points along x and y, and the height of the last over the first."""

    kind, endings = "stairmap", (".stairs",)

    def read(self, path, channel):
        del channel
        count, height = path.read_text(encoding="utf-8").split()
        heights = np.add.outer(*2 * [np.linspace(0, float(height) / 2, int(count))])
        return RawMap(heights, "nm", (1.0, 1.0), "µm")


class Doubles(TableReader):
    """Tables of two columns, load and stroke, one after the other as doubles."""

    kind, endings = "doubles", (".doubles",)

    @contextmanager
    def open(self, path, layout):
        del layout
        columns = np.fromfile(path).reshape(2, -1)
        yield Contents(
            [
                Array(name, values.shape, values.__getitem__, unit)
                for name, unit, values in zip(
                    ("load", "stroke"), ("mN", "nm"), columns, strict=True
                )
            ]
        )


class Slashed(LineReader):
    """Tables with a slash between values."""

    kind, endings = "slashed", (".slashed",)

    @contextmanager
    def open(self, path, layout):
        with path.open(encoding=layout.encoding or "utf-8") as file:
            yield (line.replace("/", "\t") for line in file)


@attrs.frozen(kw_only=True)
class Limits(Picture):
    """Friction limit over time."""

    kind = "limits"

    def sheet(self, data):
        curve = Curve(data["time"].to_numpy(), data["friction_limit"].to_numpy())
        return Chart(items=[curve], x="time (s)", y="friction limit (N)")


@attrs.frozen(kw_only=True)
class Gaps(Picture):
    """How far the flat is above the datum of the summits, over time."""

    colour: str = "black"

    kind, caption, of = "gaps", "How far the flat is above the datum.", ("history",)

    def draw(self, page, what):
        axes = page.axes()
        axes.plot(what["time"], what["separation"], color=self.colour)
        axes.set(xlabel="time (s)", ylabel="separation (m)")


@attrs.frozen
class Stamp:
    """A time that was written down."""

    time: float

    def summary(self):
        return [("stamped", f"{self.time:g} s")]


class StampFile(FileKind):
    """A file with a time in it."""

    kind = "stamped time"

    @classmethod
    def is_one(cls, path):
        return path.suffix == ".stamp"

    @classmethod
    def read(cls, path):
        return Stamp(float(path.read_text(encoding="utf-8")))


@render_page.register(Stamp)
def _page(stamp):
    return page("A stamp", [Section("Time", (paragraph(f"{stamp.time:g} s"),))])
