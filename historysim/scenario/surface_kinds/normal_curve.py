"""``[surface] kind = "normal_curve"``: a contact given by its load over the approach."""

from pathlib import Path

import attrs

from historysim.scenario.column_keys import NumbersFile
from historysim.scenario.schema import given
from historysim.scenario.surface_kinds.surface_kind import SURFACES, BuiltSurface, Curve, SurfaceKind
from historysim.tables import Column


@attrs.frozen
class CurveColumns:
    """Which column of the table of a normal curve holds what.

    Attributes
    ----------
    approach
        Column of the approach, counted from first touch.
    load
        Column of the load, which rises ever faster.
    area
        Column of the contact area.
    """

    approach: Column
    load: Column
    area: Column | None = None


@SURFACES.register
@attrs.frozen(kw_only=True)
class NormalCurveTable(NumbersFile, SurfaceKind):
    """A normal curve from a table, such as an indentation.

    Attributes
    ----------
    columns
        Which column holds what.
    """

    kind = "normal_curve"

    columns: CurveColumns

    def build(self, folder: Path) -> BuiltSurface:
        """Read the curve."""
        columns = self.table(folder, given(self.columns), {"approach": "m", "load": "N", "area": "m2"}).columns
        return BuiltSurface(None, curve=Curve(columns["approach"], columns["load"], columns.get("area")))
