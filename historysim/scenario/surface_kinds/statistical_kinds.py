"""Surfaces given by how their summits' heights are distributed, and how many summits there are."""

import abc
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.basics.fields import Length, Lengths, Numbers, Quantity
from historysim.basics.places import misfit
from historysim.errors import InputError
from historysim.scenario.column_keys import NumbersFile
from historysim.scenario.schema import ColumnsOf
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.tables import Column

if TYPE_CHECKING:
    import numpy.typing as npt

    from historysim.surfaces.distribution import HeightDistribution

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
    def distribution(self, folder: Path) -> "HeightDistribution":
        """Return the distribution of the heights."""

    def build(self, folder: Path) -> BuiltSurface:
        """Return the summits."""
        from historysim.basics.arguments import representable
        from historysim.surfaces.distribution import drawn_summits, quantile_summits

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

    rms_height: Length
    """Standard deviation of the heights."""

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> type[SurfaceKind]:
        """Return the class of a table, or of a density that is written out, where the keys say so."""
        if {"file", "columns"} & set(entry):
            return DistributionTable
        return InlineDistribution if {"density", "height", "gap"} & set(entry) else cls

    def distribution(self, folder: Path) -> "HeightDistribution":  # noqa: ARG002 - it is in the scenario itself
        """Return the distribution of the heights."""
        from historysim.surfaces.distribution import Gaussian

        return Gaussian(self.rms_height)


def _tabulated(  # one of height and gap is None
    height: Any,  # noqa: ANN401 - numbers in any form that numpy takes
    gap: Any,  # noqa: ANN401 - likewise
    density: "npt.ArrayLike",
) -> "HeightDistribution":
    from historysim.surfaces.distribution import Tabulated

    return Tabulated(height, density) if gap is None else Tabulated.from_gaps(gap, density)


def _height_or_gap(height: object, gap: object, *place: str) -> None:
    if (height is None) == (gap is None):
        problem = "neither height nor gap" if height is None else "both height and gap"
        raise misfit(f"{problem}; expected one of them", *place)


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
        _height_or_gap(self.height, self.gap)

    def distribution(self, folder: Path) -> "HeightDistribution":  # noqa: ARG002 - it is in the scenario itself
        """Return the distribution of the heights."""
        return _tabulated(self.height, self.gap, self.density)


@attrs.frozen(kw_only=True)
class DistributionTable(NumbersFile, DistributedSummits):
    """A density of heights or gaps from a file."""

    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("density", "height gap"))
    """Which column holds what: ``density``, and ``height`` or ``gap``."""

    def __attrs_post_init__(self) -> None:
        """Check that the density is of one thing."""
        _height_or_gap(self.columns.get("height"), self.columns.get("gap"), "columns")

    def distribution(self, folder: Path) -> "HeightDistribution":
        """Return the distribution of the heights, read from the file."""
        units = {"height": "m", "gap": "m", "density": "1"}
        columns = self.table(folder, self.columns, units).columns
        try:
            return _tabulated(columns.get("height"), columns.get("gap"), columns["density"])
        except InputError as error:
            raise misfit(f"{self.name}: {error}", "file") from error
