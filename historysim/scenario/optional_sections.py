"""Sections that few scenarios have, imported on use: one class each, as in `sections`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim.basics.fields import NOT_NEGATIVE, Force, Length, Number, SurfaceEnergy
from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, error_path, field_error
from historysim.loads.friction_course import FrictionCourse, check_one
from historysim.scenario.grid import Grid, build_grid
from historysim.scenario.schema import STRUCTURES, ColumnsOf, NumbersFile, from_table, table
from historysim.tables import Column

if TYPE_CHECKING:
    from historysim.contact.materials import MaterialPair


@attrs.frozen(kw_only=True)
class CourseFile(NumbersFile):
    """A friction course from a file of numbers."""

    #: Columns: ``coefficient``, and ``time`` or ``distance``.
    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("coefficient", "time distance"))

    def __attrs_post_init__(self) -> None:
        """Check that it depends on either time or distance."""
        with error_path("columns"):
            check_one(time=self.columns.get("time"), distance=self.columns.get("distance"))

    def course(self, folder: Path) -> FrictionCourse:
        """Read the course from the file; its path is relative to the folder."""
        return self.read(
            folder, self.columns, {"time": "s", "distance": "m", "coefficient": "1"}, FrictionCourse
        )


def _course_from_toml(value: object) -> FrictionCourse | CourseFile:
    """Structure a course: read from a file, or written out."""
    if "file" in table(value):
        return from_table(CourseFile, value)
    return from_table(FrictionCourse, value)


STRUCTURES[FrictionCourse] = _course_from_toml


@attrs.frozen
class AdhesionSection:
    """``[adhesion]``: adhesion parameters for the regime of the asperities; the replay itself has no adhesion.

    The default work of adhesion follows from the surface energies of the two materials (Girifalco
    and Good).

    Examples
    --------
    [adhesion]
    equilibrium_separation = "0.3 nm"
    """

    equilibrium_separation: Length  #: equilibrium separation z0 of the surfaces
    #: Work of adhesion W; by default from the surface energies of the two materials.
    work_of_adhesion: SurfaceEnergy | None = None

    def work(self, pair: "MaterialPair") -> float:
        """Return the work of adhesion [J/m²]."""
        if self.work_of_adhesion is not None:
            return self.work_of_adhesion
        from historysim.contact.materials import work_of_adhesion

        energies = [material.surface_energy for material in (pair.first, pair.second) if material]
        available = [energy for energy in energies if energy is not None]
        if len(available) < 2:
            raise field_error(
                "missing; the materials have no surface energies to compute it from",
                "work_of_adhesion",
            )
        return float(work_of_adhesion(*available))


FITTED = (
    "friction",
    "shear_modulus",
    "lateral_stiffness",
    "parallel_stiffness",
    "height_scale",
    "displacement_offset",
)


@attrs.frozen
class FitSection:
    """``[fit]``: parameters to fit to a record, and the noise of the record.

    Examples
    --------
    [fit]
    parameters = ["friction"]
    skip = 1
    """

    #: Fitted parameters, which start from the values of the scenario: any of ``"friction"``,
    #: ``"shear_modulus"``, ``"lateral_stiffness"``, ``"parallel_stiffness"``, ``"height_scale"``,
    #: ``"displacement_offset"``. The last is the ``offset`` of the tangential displacement, whose
    #: zero is the displacement without a load.
    parameters: tuple[str, ...]
    #: Loops at the start of the record that are not compared.
    skip: int = attrs.field(default=0, validator=NOT_NEGATIVE)
    #: Standard deviation of the measured displacement; by default from the record.
    displacement_noise: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    #: Standard deviation of the measured load; by default from the record.
    load_noise: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)

    def __attrs_post_init__(self) -> None:
        """Check the names."""
        if not self.parameters or len(set(self.parameters)) < len(self.parameters):
            raise field_error("expected one or more parameters, each of them once", "parameters")
        for index, name in enumerate(self.parameters):
            if name not in FITTED:
                raise field_error(
                    f"{format_value(name)}; {nearest(name, FITTED)}", "parameters", index
                )


@attrs.frozen
class SweepSection:
    """``[sweep]``: keys with several values each, for `historysim.sweep`.

    Examples
    --------
    [sweep]
    outputs = ["preliminary_displacement"]

    [sweep.over]
    friction.coefficient = [0.1, 0.2, 0.3]
    """

    #: keys with several values each: arrays, or ranges ``{ from, to, count, spacing }``
    over: dict[str, Any]
    #: lists of keys whose values vary together, as one dimension
    together: tuple[tuple[str, ...], ...] = ()
    #: summary values, totals or variables of each cell; by default ten summary values
    outputs: tuple[str, ...] = ()

    def __attrs_post_init__(self) -> None:
        """Check that there is a grid."""
        self.grid()

    def grid(self) -> Grid:
        """Return the grid spanned by the keys."""
        return build_grid(self.over, self.together)


@attrs.frozen
class DesignSection:
    """``[design]``: a free key and the output that `historysim.design` finds its value for.

    Examples
    --------
    [design]
    key = "friction.coefficient"
    between = [0.05, 0.5]
    target = "10 nm"
    output = "preliminary_displacement"
    """

    key: str  #: the key to find a value for
    between: tuple[Any, ...]  #: the smallest and the largest value
    target: Any = None  #: wanted output; one of ``target``, ``below`` and ``above`` is needed
    below: Any = None  #: upper limit of the output, kept in a fraction of the points of ``over``
    above: Any = None  #: lower limit, likewise
    quantile: Number | None = None  #: that fraction; by default 0.95
    output: str = "drift"  #: summary value of a sweep
    #: keys over which the search is repeated, as in ``[sweep.over]``
    over: dict[str, Any] | None = None

    def __attrs_post_init__(self) -> None:
        """Check the range, the target and the grid."""
        if len(self.between) != 2:
            raise field_error(
                f"{len(self.between)} values; expected two, the smallest and the largest", "between"
            )
        goals = [name for name in ("target", "below", "above") if getattr(self, name) is not None]
        if len(goals) != 1:
            raise InputError(
                f"{' and '.join(goals) or 'no target'}; expected one of target, below and above"
            )
        if self.quantile is not None and (goals == ["target"] or not 0.5 <= self.quantile < 1):
            raise field_error(
                "expected a fraction from 0.5 to below 1, with below or above", "quantile"
            )
        self.grid()

    def grid(self) -> Grid:
        """Return the grid over which the search is repeated; a single point without ``over``."""
        return build_grid(self.over) if self.over is not None else Grid(())
