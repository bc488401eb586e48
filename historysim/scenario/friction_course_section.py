"""``[friction.course]``: a friction coefficient over time or distance, written out or from a file of numbers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import attrs
from cattrs import Converter

from historysim.basics.fields import Quantity
from historysim.basics.places import at, misfit
from historysim.errors import InputError
from historysim.scenario.column_keys import NumbersFile
from historysim.scenario.schema import given, table
from historysim.tables import Column

if TYPE_CHECKING:
    from historysim.loads.friction_course import FrictionCourse

UNITS = {"time": "s", "distance": "m", "coefficient": "1"}

Times = Annotated[tuple[float, ...], Quantity("s")]
Distances = Annotated[tuple[float, ...], Quantity("m")]
Coefficients = Annotated[tuple[float, ...], Quantity("1")]


def _one_place(section: "WrittenCourse | CourseColumns") -> None:
    if (section.time is None) == (section.distance is None):
        came = "neither time nor distance" if section.time is None else "time and distance together"
        raise InputError(f"{came}; expected one of them, with which the coefficient goes")


@attrs.frozen(kw_only=True)
class WrittenCourse:
    """A course that stands in the scenario.

    Attributes
    ----------
    time
        Times of the coefficients; or ``distance``.
    distance
        Way of the tangential displacement, both directions counting; it must be controlled throughout.
    coefficient
        Coefficients, as many as times or distances; straight in between. At each event the coefficient becomes
        that of its time or distance, and acts on what comes behind it.

    Examples
    --------
    [friction]
    coefficient = 0.5

    [friction.course]
    distance = ["0 m", "1 mm", "20 mm"]
    coefficient = [0.5, 0.35, 0.3]
    """

    time: Times | None = None
    distance: Distances | None = None
    coefficient: Coefficients

    def __attrs_post_init__(self) -> None:
        """Check that it goes with one thing, and can be a course."""
        _one_place(self)
        self.course(Path())

    def course(self, folder: Path) -> "FrictionCourse":  # noqa: ARG002 - it is in the scenario itself
        """Return the course."""
        from historysim.loads.friction_course import FrictionCourse

        if self.distance is not None:
            return FrictionCourse("distance", self.distance, self.coefficient)
        return FrictionCourse("time", self.time or (), self.coefficient)


@attrs.frozen(kw_only=True)
class CourseColumns:
    """Which column of the file holds what.

    Attributes
    ----------
    time
        Column of the times; or ``distance``.
    distance
        Column of the distances.
    coefficient
        Column of the coefficients.
    """

    time: Column | None = None
    distance: Column | None = None
    coefficient: Column

    def __attrs_post_init__(self) -> None:
        """Check that it goes with one thing."""
        _one_place(self)


@attrs.frozen(kw_only=True)
class CourseFile(NumbersFile):
    """A course from a file of numbers.

    Attributes
    ----------
    columns
        Which column holds what.
    """

    columns: CourseColumns

    def course(self, folder: Path) -> "FrictionCourse":
        """Return the course that the file has; its path is relative to the folder."""
        from historysim.loads.friction_course import FrictionCourse

        rows = self.table(folder, given(self.columns), UNITS).columns
        with at("file"):
            try:
                if "time" in rows:
                    return FrictionCourse("time", rows["time"], rows["coefficient"])
                return FrictionCourse("distance", rows["distance"], rows["coefficient"])
            except InputError as error:
                raise misfit(f"{self.name}: {error.args[0]}") from error


AnyCourse = WrittenCourse | CourseFile


def course_from_toml(converter: Converter, value: object, _: object) -> AnyCourse:
    """Return the course that ``[friction.course]`` says: with a file, or written out."""
    entry = table(value)
    kind: Any = CourseFile if "file" in entry else WrittenCourse
    course: AnyCourse = converter.structure(entry, kind)
    return course
