"""Surfaces from given summits (one, a list, a table), from a normal curve, or a cylinder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from historysim.basics.fields import Length, Lengths, Numbers
from historysim.errors import field_error
from historysim.scenario.schema import ColumnsOf, NumbersFile, explicit_fields
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.surfaces.summits import Summits
from historysim.tables import Column


@SURFACES.register
@attrs.frozen
class Sphere(SurfaceKind):
    """One spherical asperity.

    Examples
    --------
    [surface]
    kind = "sphere"
    radius = "2.5 mm"
    """

    kind = "sphere"
    also_called = ("ball", "asperity", "indenter", "tip", "hertz", "cap")

    radius: Length  #: radius of the ball

    def build(self, folder: Path) -> BuiltSurface:  # noqa: ARG002 - a sphere needs no file
        """Build one summit at height 0."""
        return BuiltSurface(Summits(0.0, self.radius))


@SURFACES.register
@attrs.frozen
class InlineSummits(SurfaceKind):
    """Summits written out in the scenario; a single number applies to all.

    Examples
    --------
    [surface]
    kind = "summits"
    height = ["0 nm", "-30 nm", "-80 nm"]
    radius = "10 µm"
    """

    kind = "summits"
    also_called = ("asperities", "list", "spheres", "balls", "peaks", "table")

    height: Lengths  #: heights, or one for all
    radius: Lengths  #: radii, or one for all
    x: Lengths | None = None  #: positions along x
    y: Lengths | None = None  #: positions along y
    #: Slopes of the contact planes along x, tan α, or one for all: asperities are inclined.
    slope: Numbers | None = None

    @classmethod
    def chosen(cls, entry: Mapping[str, Any]) -> type[SurfaceKind]:
        """Return the class of a table if the entry names a file."""
        return SummitTable if {"file", "columns"} & set(entry) else cls

    def build(self, folder: Path) -> BuiltSurface:  # noqa: ARG002 - no file needed
        """Build the summits."""
        sizes = {key: np.size(value) for key, value in explicit_fields(self).items()}
        for key, size in sizes.items():
            if size == 0:
                raise field_error(
                    "an empty array; expected one number, or one for each summit", key
                )
        height = (
            np.broadcast_to(self.height, max(sizes.values()))
            if sizes["height"] == 1
            else self.height
        )
        return BuiltSurface(Summits(height, self.radius, self.x, self.y, slope=self.slope))


@attrs.frozen(kw_only=True)
class SummitTable(NumbersFile, SurfaceKind):
    """Summits from a table.

    Examples
    --------
    [surface]
    kind = "summits"
    file = "data/summits_200.csv"
    columns = { height = { column = "height_nm", unit = "nm" }, radius = { column = "radius_um", unit = "µm" } }
    """

    #: Columns: ``height``, ``radius``, and optionally ``x``, ``y`` and ``friction``.
    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("height radius", "x y friction"))

    def build(self, folder: Path) -> BuiltSurface:
        """Read the summits of the table."""
        units = {"height": "m", "radius": "m", "x": "m", "y": "m", "friction": "1"}
        rows = self.table(folder, self.columns, units)
        columns = rows.columns
        for key, expected in (("radius", "more than 0"), ("friction", "0 or more")):
            values = np.asarray(columns.get(key, ()))
            for row in np.flatnonzero((values <= 0) if key == "radius" else (values < 0))[:1]:
                problem = (
                    f"{rows.place(int(row))}: {key} is {values[row]:g}; expected {expected}, in SI"
                )
                raise field_error(f"{self.name}: {problem}", "file")
        summits = Summits(columns["height"], columns["radius"], columns.get("x"), columns.get("y"))
        return BuiltSurface(summits, friction=columns.get("friction"))


@SURFACES.register
@attrs.frozen(kw_only=True)
class NormalCurveTable(NumbersFile, SurfaceKind):
    """A normal curve from a table, such as an indentation."""

    kind = "normal_curve"
    also_called = ("curve", "stiffness", "finite elements", "fem")

    #: Columns: ``approach`` from first touch, ``load``, whose slope increases, and optionally the
    #: contact ``area``.
    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("approach load", "area"))

    def build(self, folder: Path) -> BuiltSurface:
        """Read the curve."""
        columns = self.table(
            folder, self.columns, {"approach": "m", "load": "N", "area": "m2"}
        ).columns
        return BuiltSurface(None, curve=(columns["approach"], columns["load"], columns.get("area")))


@SURFACES.register
@attrs.frozen
class Cylinder(SurfaceKind):
    """A cylinder on a flat: a line contact, which moves across its axis.

    Examples
    --------
    [surface]
    kind = "cylinder"
    radius = "10 mm"
    length = "5 mm"
    reference_depth = "10 mm"
    """

    kind = "cylinder"
    also_called = ("line", "line contact", "roller", "pad", "fretting")

    radius: Length  #: radius of the cylinder
    length: Length  #: length of the contact along its axis
    #: Depth below the surface to which displacements refer, such as the thickness of the body;
    #: loads, energies and tractions do not depend on it.
    reference_depth: Length

    def build(self, folder: Path) -> BuiltSurface:  # noqa: ARG002 - a cylinder needs no file
        """Build the cylinder."""
        return BuiltSurface(None, cylinder=(self.radius, self.length, self.reference_depth))
