"""Surfaces from generated summits: a regular array, or a distribution of heights."""

import abc
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import attrs

from historysim.basics.arguments import representable
from historysim.basics.fields import Length, Lengths, Number, Numbers, Quantity
from historysim.basics.wording import format_value, nearest
from historysim.errors import error_path, field_error
from historysim.loads.friction_course import check_one
from historysim.scenario.schema import ColumnsOf, NumbersFile
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.surfaces.distribution import (
    LAWS,
    Gaussian,
    HeightDistribution,
    Tabulated,
    drawn_summits,
    quantile_summits,
    textured_summits,
)
from historysim.tables import Column


@SURFACES.register
@attrs.frozen
class Textured(SurfaceKind):
    """A regular array of equal asperities, with scatter on request.

    Examples
    --------
    [surface]
    kind = "textured"
    count = [8, 8]
    pitch = "200 µm"
    radius = "1 mm"
    height_scatter = "5 nm"
    seed = 1
    """

    kind = "textured"
    also_called = ("texture", "pattern", "laser", "grid", "bumps", "pillars")

    count: tuple[int, ...]  #: asperities along x and y, ``[nx, ny]``
    pitch: Lengths  #: spacing of the asperities, one length or ``[px, py]``
    #: radius of each; with ``scaling`` the radius of the single asperity that the array replaces
    radius: Length
    #: ``"self-similar"``: each of n asperities gets R/√n. ``"curvature-invariant"``: R.
    scaling: str | None = None
    height_scatter: Length = 0.0  #: standard deviation of Gaussian heights
    #: standard deviation of log-normal radii, as a fraction of their mean
    radius_scatter: Number = 0.0
    seed: int | None = None  #: seed of the scatter; required with scatter

    def build(self, folder: Path) -> BuiltSurface:  # noqa: ARG002 - a texture needs no file
        """Build the array; with a scaling law the radius belongs to the single asperity that the array replaces."""
        radius = self.radius
        if self.scaling is not None:
            if self.scaling not in LAWS:
                raise field_error(
                    f"{format_value(self.scaling)}; {nearest(self.scaling, LAWS)}", "scaling"
                )
            radius *= max(math.prod(self.count), 1) ** LAWS[self.scaling]
        with representable():
            scatter: Any = {
                key: getattr(self, key) for key in ("height_scatter", "radius_scatter", "seed")
            }
            return BuiltSurface(textured_summits(self.count, self.pitch, radius, **scatter))  # type: ignore[arg-type]


Area = Annotated[float, Quantity("m2")]
SummitDensity = Annotated[float, Quantity("m-2")]


@attrs.frozen(kw_only=True)
class DistributedSummits(SurfaceKind):
    """Summits of a given density, sampled with a seed or, without one, at quantiles."""

    radius: Length  #: radius of all summits
    summit_density: SummitDensity  #: summits per nominal area
    nominal_area: Area  #: nominal area
    #: With a seed heights and positions are random; without one the summits are the quantiles (i +
    #: ½)/n of the density.
    seed: int | None = None

    @abc.abstractmethod
    def distribution(self, folder: Path) -> HeightDistribution:
        """Return the distribution of the heights."""

    def build(self, folder: Path) -> BuiltSurface:
        """Build the summits."""
        amount = {"summit_density": self.summit_density, "nominal_area": self.nominal_area}
        with representable():
            heights = self.distribution(folder)
            if self.seed is None:
                return BuiltSurface(quantile_summits(heights, self.radius, **amount))
            return BuiltSurface(drawn_summits(heights, self.radius, **amount, seed=self.seed))


@SURFACES.register
@attrs.frozen(kw_only=True)
class GaussianHeights(DistributedSummits):
    """Gaussian heights.

    Examples
    --------
    [surface]
    kind = "statistics"
    radius = "10 µm"
    summit_density = "0.01 µm-2"
    nominal_area = "0.01 mm2"
    rms_height = "50 nm"
    seed = 1
    """

    kind = "statistics"
    also_called = ("greenwood-williamson", "gw", "statistical", "distribution")

    rms_height: Length  #: standard deviation of the heights

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> type[SurfaceKind]:
        """Return the class of a table, or of a density that is written out, if the entry has their keys."""
        if {"file", "columns"} & set(entry):
            return DistributionTable
        return InlineDistribution if {"density", "height", "gap"} & set(entry) else cls

    def distribution(self, folder: Path) -> HeightDistribution:  # noqa: ARG002 - no file needed
        """Return the distribution of the heights."""
        return Gaussian(self.rms_height)


def _tabulate(density: Any, height: Any = None, gap: Any = None) -> HeightDistribution:  # noqa: ANN401 - numbers
    """Build the distribution of a density over heights or over gaps."""
    return Tabulated(height, density) if gap is None else Tabulated.from_gaps(gap, density)


@attrs.frozen(kw_only=True)
class InlineDistribution(DistributedSummits):
    """A density of heights, or of gaps (0 for the summit that touches first), written out.

    Examples
    --------
    [surface]
    kind = "statistics"
    radius = "10 µm"
    summit_density = "0.01 µm-2"
    nominal_area = "0.01 mm2"
    height = ["0 nm", "50 nm", "100 nm"]
    density = [0, 1, 0]
    """

    height: Lengths | None = None  #: heights at which the density is given; or ``gap``
    gap: Lengths | None = None  #: distances from the flat at first touch, 0 or more
    density: Numbers  #: density at each of them, in any unit; linear in between

    def __attrs_post_init__(self) -> None:
        """Check that the density depends on either height or gap."""
        check_one(height=self.height, gap=self.gap)

    def distribution(self, folder: Path) -> HeightDistribution:  # noqa: ARG002 - no file needed
        """Return the distribution of the heights."""
        return _tabulate(self.density, self.height, self.gap)


@attrs.frozen(kw_only=True)
class DistributionTable(NumbersFile, DistributedSummits):
    """A density of heights or gaps from a file."""

    #: Columns: ``density``, and ``height`` or ``gap``.
    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("density", "height gap"))

    def __attrs_post_init__(self) -> None:
        """Check that the density depends on either height or gap."""
        with error_path("columns"):
            check_one(height=self.columns.get("height"), gap=self.columns.get("gap"))

    def distribution(self, folder: Path) -> HeightDistribution:
        """Read the height distribution from the file."""
        return self.read(
            folder, self.columns, {"height": "m", "gap": "m", "density": "1"}, _tabulate
        )
