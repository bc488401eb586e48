"""Sections of a scenario: one class each, with its keys and their checks."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings
from historysim.basics.fields import (
    NOT_NEGATIVE,
    Force,
    Key,
    Length,
    Number,
    Numbers,
    Pressure,
    SurfaceEnergy,
    list_fields,
)
from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, error_path, field_error
from historysim.loads.friction_course import FrictionCourse, check_one
from historysim.scenario.grid import Grid, build_grid
from historysim.scenario.loading_kinds import Loading
from historysim.scenario.schema import (
    STRUCTURES,
    AnyAttraction,
    AnyFrictionLaw,
    AnyWearLaw,
    By,
    ColumnsOf,
    NumbersFile,
    explicit_fields,
    from_table,
    structure,
    structure_array,
    table,
    text,
)
from historysim.scenario.surface_kinds import SurfaceKind
from historysim.tables import Column

if TYPE_CHECKING:
    from collections.abc import Iterable

    from historysim.contact.materials import Material, MaterialPair
    from historysim.results.plots.pictures import Picture

Pictures = tuple["Picture", ...]


def _material_from_toml(value: object) -> "Material":
    """Structure a built-in material from its name, or a custom one from a table."""
    from historysim.contact.materials import Material, material

    return from_table(Material, value) if isinstance(value, dict) else material(text(value))


def _pictures_from_toml(value: object) -> Pictures:
    # modules that draw are imported only if a picture is requested
    from historysim.scenario.picture_section import pictures_from_toml

    return pictures_from_toml(value)


MaterialEntry = Annotated[Any, By(_material_from_toml)]
PictureSections = Annotated[Any, By(_pictures_from_toml)]


@attrs.frozen
class MaterialsSection:
    """``[materials]``: two materials, or the moduli of the pair.

    Examples
    --------
    [materials]
    first = "silicon"
    second = "float glass"
    """

    first: MaterialEntry | None = None  #: A built-in material by its name, or a table as below
    second: MaterialEntry | None = None  #: the other material
    #: E* of the pair, in place of materials, together with ``shear_modulus``
    contact_modulus: Pressure | None = None
    shear_modulus: Pressure | None = None  #: G* of the pair
    #: Of the softer one, if the pair is given by its moduli. Without ``yielding`` it changes no
    #: result: it is used to check the validity of the model.
    hardness: Pressure | None = None
    yield_stress: Pressure | None = None  #: of the softer one, likewise

    def __attrs_post_init__(self) -> None:
        """Check that the pair is given either by two materials or by two moduli."""
        limits = {"hardness", "yield_stress"} & explicit_fields(self).keys()
        keys = [key for key in explicit_fields(self) if key not in limits]
        if self.first is not None and limits:
            raise field_error(
                "belongs to one material; expected it in first or second", min(limits)
            )
        if keys not in (["first", "second"], ["contact_modulus", "shear_modulus"]):
            raise InputError(
                f"{' and '.join(keys) or 'nothing'} given; expected either first and second, or contact_modulus and "
                "shear_modulus"
            )

    def pair(self) -> "MaterialPair":
        """Return the material pair."""
        from historysim.contact.materials import MaterialPair

        with error_path("materials"):
            if self.first is None or self.second is None:
                return MaterialPair.from_moduli(**explicit_fields(self))
            return MaterialPair(self.first, self.second)


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
class Coefficients:
    """``[friction]`` without a law: one coefficient and its course, or one coefficient per asperity."""

    #: Coefficient of friction μ, or an array with one for each asperity.
    coefficient: Numbers = attrs.field(validator=NOT_NEGATIVE)
    #: A coefficient that changes over time or distance, as below
    course: FrictionCourse | None = None

    @classmethod
    def from_toml(cls, value: object) -> Any:  # noqa: ANN401 - coefficients, or a law
        """Structure ``[friction]``: coefficients, or a law."""
        entry = table(value)
        if "law" in entry:
            return structure(entry, AnyFrictionLaw)
        if not entry:
            raise field_error(
                "missing; expected a coefficient, or law with its keys", "coefficient"
            )
        return from_table(cls, entry)

    @classmethod
    def hint_for_key(cls, key: str) -> str:
        """Suggest the law that an unknown key belongs to; empty if none."""
        from historysim.asperities.laws import LAWS

        of_law = any(key == field.name for law in LAWS.values() for field in list_fields(law))
        return f"it belongs to a law; expected law, one of {', '.join(LAWS)}" if of_law else ""


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


# Attributes of a result that describe how it was computed.
COMPUTED_ATTRIBUTES = frozenset(
    {
        "Conventions",
        "title",
        "source",
        "history",
        "historysim_version",
        "made_with",
        "contact_modulus",
        "shear_modulus",
        "friction_law",
        "wear_law",
        "yielding_law",
        "friction_law_settings",
        "wear_law_settings",
        "yielding_law_settings",
        "packages",
        "lateral_stiffness",
        "parallel_stiffness",
        "nominal_area",
        "number_of_asperities",
        "number_of_events",
        "event_digest",
        "validity",
        "named_states",
        "scenario",
        "seed",
        "log_digest",
        "date_created",
        "id",
        "content",
        "complete",
    }
)


@attrs.frozen
class MetadataSection:
    """``[metadata]``: attributes of the written files, such as author, purpose and licence.

    Any name of letters, digits and underscores; catalogues read those of ACDD 1.3. A value is a
    string, a number or an array of strings, which become one string with commas.

    Examples
    --------
    [metadata]
    creator_name = "A. Tribologist"
    license = "CC-BY-4.0"
    keywords = ["friction", "drift"]
    """

    values: dict[str, str] = attrs.field(factory=dict)

    @classmethod
    def from_toml(cls, value: object) -> "MetadataSection":
        """Check names and values; an InputError names the key."""
        values = {}
        for key, entry in table(value).items():
            with error_path(key):
                values[key] = cls._attribute(key, entry)
        return cls(values)

    @staticmethod
    def _attribute(key: str, entry: object) -> str:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", key):
            raise InputError(
                "is not the name of an attribute; expected letters, digits and underscores"
            )
        if key in COMPUTED_ATTRIBUTES:
            raise InputError(
                f"describes how a result was computed; choose another name, such as my_{key}"
            )
        if isinstance(entry, list):
            return ", ".join(structure_array(entry, text))
        is_number = isinstance(entry, int | float) and not isinstance(entry, bool)
        return str(entry) if is_number else text(entry)


RECORDS = ("touching", "all", "totals")


@attrs.frozen
class RecordSection:
    """``[record]``: asperities recorded individually, and whether their slid distance is recorded.

    Examples
    --------
    [record]
    asperities = "totals"
    """

    #: ``"touching"``, ``"all"``, ``"totals"`` (none of them), or an array of indices, counted from
    #: 0 in the order of the surface.
    asperities: str | tuple[int, ...] = attrs.field(
        default="touching",
        validator=Key(
            lambda value: isinstance(value, tuple) or value in RECORDS,
            ", ".join(f'"{word}"' for word in RECORDS) + " or an array of indices",
        ),
    )
    #: Also records the slid distance of each asperity, ∫|dU| in gross slip: ``slid_distance``. With
    #: wear or evolving friction it is always recorded.
    sliding: bool = False

    @property
    def text(self) -> str:
        """Short description of the recorded asperities."""
        return (
            self.asperities
            if isinstance(self.asperities, str)
            else f"{len(self.asperities):,} chosen"
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


@attrs.frozen
class Sections:
    """A scenario file, section by section."""

    materials: MaterialsSection
    surface: SurfaceKind
    loading: Loading
    friction: Coefficients | None = None
    wear: AnyWearLaw | None = None
    attraction: AnyAttraction | None = None
    adhesion: AdhesionSection | None = None
    instrument: Instrument = RIGID
    rings: Rings = RINGS
    record: RecordSection = RecordSection()
    fit: FitSection | None = None
    metadata: MetadataSection = MetadataSection()
    sweep: SweepSection | None = None
    design: DesignSection | None = None
    picture: PictureSections = ()
    title: str = ""  #: A heading, before the first section

    @classmethod
    def hint_for_key(cls, key: str) -> str:
        """Suggest the section of a key that precedes the first section; empty if unknown."""
        from historysim.asperities.laws import LAWS
        from historysim.scenario.loading_kinds import LOADINGS
        from historysim.scenario.surface_kinds import SURFACES

        kinds: dict[str, Iterable[type]] = {
            "friction": (Coefficients, *LAWS.values()),
            "surface": SURFACES.values(),
            "loading": LOADINGS.values(),
            "record": (RecordSection,),
            "instrument": (Instrument,),
            "rings": (Rings,),
            "materials": (MaterialsSection,),
        }
        homes = [
            name
            for name, of in kinds.items()
            if any(key == field.name for kind in of for field in list_fields(kind))
        ]
        return f"did you mean {' or '.join(f'{home}.{key}' for home in homes)}?" if homes else ""

    @property
    def course(self) -> FrictionCourse | CourseFile | None:
        """Course of the friction coefficient; None if it is constant."""
        return self.friction.course if isinstance(self.friction, Coefficients) else None

    def pair(self) -> "MaterialPair":
        """Return the pair of materials, with the work of adhesion of ``[adhesion]``."""
        pair, adhesion = self.materials.pair(), self.adhesion
        if adhesion is None or adhesion.work_of_adhesion is None:
            return pair
        with error_path("adhesion"):
            return pair.with_work_of_adhesion(adhesion.work_of_adhesion)
