"""Surfaces given by how their summits' heights are distributed, and how many summits there are."""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import attrs

from historysim.basics.arguments import representable
from historysim.basics.fields import Length, Lengths, Numbers, Quantity
from historysim.basics.places import at, misfit
from historysim.errors import InputError
from historysim.scenario.column_keys import NumbersFile
from historysim.scenario.schema import ColumnsOf, given
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.surfaces.distribution import Gaussian, HeightDistribution, Tabulated, drawn_summits, quantile_summits
from historysim.tables import Column

Area = Annotated[float, Quantity("m2")]
SummitDensity = Annotated[float, Quantity("m-2")]


@attrs.frozen(kw_only=True)
class DistributedSummits(SurfaceKind):
    """So many summits per area, drawn with a seed or, without one, as quantiles."""

    radius: Length
    """Radius of all summits."""
    summit_density: SummitDensity
    """Summits per nominal area."""
    nominal_area: Area
    """Nominal area."""
    seed: int | None = None
    """With a seed heights and positions are drawn; without one the summits are the quantiles (i + ½)/n of the
    density."""

    @abc.abstractmethod
    def distribution(self, folder: Path) -> HeightDistribution:
        """Return the distribution of the heights."""

    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits."""
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

    rms_height: Length
    """Standard deviation of the heights."""

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> type[SurfaceKind]:
        """Return the class of a table, or of a density that is written out, where the keys say so."""
        if {"file", "columns"} & set(entry):
            return DistributionTable
        return InlineDistribution if {"density", "height", "gap"} & set(entry) else cls

    def distribution(self, folder: Path) -> HeightDistribution:  # noqa: ARG002 - it is in the scenario itself
        """Return the distribution of the heights."""
        return Gaussian(self.rms_height)


def _tabulated(columns: Mapping[str, Any]) -> HeightDistribution:
    """Return the distribution of a density over heights, or over gaps."""
    if "height" in columns:
        return Tabulated(columns["height"], columns["density"])
    return Tabulated.from_gaps(columns["gap"], columns["density"])


def _check_one(columns: Mapping[str, Any]) -> None:
    """Check that a density is of heights or of gaps."""
    if ("height" in columns) == ("gap" in columns):
        problem = "both height and gap" if "gap" in columns else "neither height nor gap"
        raise InputError(f"{problem}; expected one of them")


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

    height: Lengths | None = None
    """Heights at which the density is given; or ``gap``."""
    gap: Lengths | None = None
    """Distances from the flat at first touch, 0 or more."""
    density: Numbers
    """Density at each of them, in any unit; straight in between."""

    def __attrs_post_init__(self) -> None:
        """Check that the density is of one thing."""
        _check_one(given(self))

    def distribution(self, folder: Path) -> HeightDistribution:  # noqa: ARG002 - it is in the scenario itself
        """Return the distribution of the heights."""
        return _tabulated(given(self))


@attrs.frozen(kw_only=True)
class DistributionTable(NumbersFile, DistributedSummits):
    """A density of heights or gaps from a file."""

    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("density", "height gap"))
    """Which column holds what: ``density``, and ``height`` or ``gap``."""

    def __attrs_post_init__(self) -> None:
        """Check that the density is of one thing."""
        with at("columns"):
            _check_one(self.columns)

    def distribution(self, folder: Path) -> HeightDistribution:
        """Return the distribution of the heights, read from the file."""
        units = {"height": "m", "gap": "m", "density": "1"}
        columns = self.table(folder, self.columns, units).columns
        try:
            return _tabulated(columns)
        except InputError as error:
            raise misfit(f"{self.name}: {error}", "file") from error
