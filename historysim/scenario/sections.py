"""The sections of a scenario, one class for each: their keys, and what these must be."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import attrs
from cattrs import Converter

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
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError, at, field_error
from historysim.loads.friction_course import FrictionCourse, check_one
from historysim.scenario.grid import Grid, grid_of
from historysim.scenario.loading_kinds import Loading
from historysim.scenario.schema import (
    AnyFrictionLaw,
    AnyWearLaw,
    ColumnsOf,
    NumbersFile,
    from_table,
    given,
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
MaterialEntry = Annotated[Any, "material"]  # A `Material`, which is imported when there is one


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
    contact_modulus: Pressure | None = None  #: E* of the pair, in place of materials, together with ``shear_modulus``
    shear_modulus: Pressure | None = None  #: G* of the pair
    #: Of the softer one, where the pair is given by its moduli. Without ``yielding`` it changes no result: it serves
    #: the check whether the model may be used.
    hardness: Pressure | None = None
    yield_stress: Pressure | None = None  #: of the softer one, likewise

    def __attrs_post_init__(self) -> None:
        """Check that the pair is given in one way, and fully."""
        limits = {"hardness", "yield_stress"} & given(self).keys()
        keys = [key for key in given(self) if key not in limits]
        if self.first is not None and limits:
            raise field_error("belongs to one material; expected it in first or second", min(limits))
        if keys not in (["first", "second"], ["contact_modulus", "shear_modulus"]):
            raise InputError(
                f"{' and '.join(keys) or 'nothing'} given; expected either first and second, or contact_modulus and "
                "shear_modulus"
            )

    def pair(self) -> "MaterialPair":
        """Return the material pair."""
        from historysim.contact.materials import MaterialPair

        with at("materials"):
            if self.first is None or self.second is None:
                return MaterialPair.from_moduli(**given(self))
            return MaterialPair(self.first, self.second)


def material_from_toml(converter: Converter, value: object, _: object) -> "Material":
    """Return a built-in material by its name, or that of a table."""
    from historysim.contact.materials import Material, material

    return from_table(Material, value, converter) if isinstance(value, dict) else material(text(value))


@attrs.frozen(kw_only=True)
class CourseFile(NumbersFile):
    """A course from a file of numbers."""

    #: Which column holds what: ``coefficient``, and ``time`` or ``distance``.
    columns: dict[str, Column] = attrs.field(validator=ColumnsOf("coefficient", "time distance"))

    def __attrs_post_init__(self) -> None:
        """Check that it goes with one thing."""
        with at("columns"):
            check_one(time=self.columns.get("time"), distance=self.columns.get("distance"))

    def course(self, folder: Path) -> FrictionCourse:
        """Return the course that the file has; its path is relative to the folder."""
        return self.read(folder, self.columns, {"time": "s", "distance": "m", "coefficient": "1"}, FrictionCourse)


def course_from_toml(converter: Converter, value: object, _: object) -> FrictionCourse | CourseFile:
    """Return the course of a table: with a file, or written out."""
    if "file" in table(value):
        return converter.structure(value, CourseFile)
    return from_table(FrictionCourse, value, converter)


@attrs.frozen
class Coefficients:
    """Of ``[friction]``: one coefficient and its course, or one for each asperity."""

    #: Coefficient of friction μ, or an array with one for each asperity.
    coefficient: Numbers = attrs.field(validator=NOT_NEGATIVE)
    course: FrictionCourse | None = None  #: A coefficient that changes over time or distance, as below

    @classmethod
    def from_toml(cls, value: object, converter: Converter) -> Any:  # noqa: ANN401 - coefficients, or a law
        """Return the coefficients of ``[friction]``, or its law."""
        entry = table(value)
        if "law" in entry:
            return converter.structure(entry, AnyFrictionLaw)
        if not entry:
            raise field_error("missing; expected a coefficient, or law with what it needs", "coefficient")
        return from_table(cls, entry, converter)

    @classmethod
    def meant(cls, key: str) -> str:
        """Return what to write in place of an unknown key: it may belong to a law."""
        from historysim.asperities.laws import LAWS

        of_law = any(key == field.name for law in LAWS.values() for field in list_fields(law))
        return f"it belongs to a law; expected law, one of {', '.join(LAWS)}" if of_law else ""


@attrs.frozen
class AdhesionSection:
    """``[adhesion]``: what says how adhesive the asperities are; the replay itself has no adhesion.

    Without a work of adhesion it follows from the surface energies of the two materials (Girifalco and Good).

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
        known = [energy for energy in energies if energy is not None]
        if len(known) < 2:
            raise field_error("missing; the materials have no surface energy to take it from", "work_of_adhesion")
        return float(work_of_adhesion(*known))


FITTED = ("friction", "shear_modulus", "lateral_stiffness", "parallel_stiffness", "height_scale", "displacement_offset")


@attrs.frozen
class FitSection:
    """``[fit]``: what is fitted to what was measured, and how noisy that is.

    Examples
    --------
    [fit]
    parameters = ["friction"]
    skip = 1
    """

    #: What is fitted, from the scenario's own values on: any of ``"friction"``, ``"shear_modulus"``,
    #: ``"lateral_stiffness"``, ``"parallel_stiffness"``, ``"height_scale"``, ``"displacement_offset"``. The last is the
    #: ``offset`` of the tangential displacement, whose zero is the displacement without a load.
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
                raise field_error(f"{shown(name)}; {nearest(name, FITTED)}", "parameters", index)


@attrs.frozen
class MetadataSection:
    """``[metadata]``: who made the data, what for, and under which licence, by the names of ACDD 1.3.

    Examples
    --------
    [metadata]
    creator_name = "A. Tribologist"
    license = "CC-BY-4.0"
    keywords = ["friction", "drift"]
    """

    summary: str | None = None  #: A paragraph on the data; by default one of the program's own
    keywords: tuple[str, ...] | None = None  #: words for a catalogue
    comment: str | None = None  #: anything else
    creator_name: str | None = None  #: who made the data
    creator_email: str | None = None  #: where to write to
    creator_url: str | None = None  #: A page on who made the data
    institution: str | None = None  #: where the data were made
    project: str | None = None  #: what for
    publisher_name: str | None = None  #: who publishes them
    publisher_email: str | None = None  #: where to write to
    publisher_url: str | None = None  #: A page on the publisher
    acknowledgement: str | None = None  #: who is thanked
    references: str | None = None  #: what describes the data or how they were made
    license: str | None = None  #: under which licence they may be used
    naming_authority: str | None = None  #: who gives the ``id``
    product_version: str | None = None  #: which version of the data

    def attributes(self) -> dict[str, str]:
        """Return the attributes of a file; keywords are one string, with commas."""
        return {key: value if isinstance(value, str) else ", ".join(value) for key, value in given(self).items()}


RECORDS = ("touching", "all", "totals")


@attrs.frozen
class RecordSection:
    """``[record]``: the asperities that are written out one by one, and whether it is followed how far they slide.

    Examples
    --------
    [record]
    asperities = "totals"
    """

    #: ``"touching"``, ``"all"``, ``"totals"`` (none of them), or an array of indices, counted from 0 in the order of
    #: the surface.
    asperities: str | tuple[int, ...] = attrs.field(
        default="touching",
        validator=Key(
            lambda value: isinstance(value, tuple) or value in RECORDS,
            ", ".join(f'"{word}"' for word in RECORDS) + " or an array of indices",
        ),
    )
    #: Also records how far each asperity slides, ∫|dU| while all its springs slip: ``slid_distance``. With wear, or
    #: friction that evolves, it is recorded in any case.
    sliding: bool = False

    @property
    def text(self) -> str:
        """Which asperities, in a word or two."""
        return self.asperities if isinstance(self.asperities, str) else f"{len(self.asperities):,} chosen"


@attrs.frozen
class SweepSection:
    """``[sweep]``: keys with several values each, which `historysim.sweep` goes through.

    Examples
    --------
    [sweep]
    outputs = ["preliminary_displacement"]

    [sweep.over]
    friction.coefficient = [0.1, 0.2, 0.3]
    """

    over: dict[str, Any]  #: keys with several values each: arrays, or ranges ``{ from, to, count, spacing }``
    together: tuple[tuple[str, ...], ...] = ()  #: lists of keys that are taken side by side, as one dimension
    outputs: tuple[str, ...] = ()  #: numbers, totals or variables that each cell gives; by default ten numbers

    def __attrs_post_init__(self) -> None:
        """Check that there is a grid."""
        self.grid()

    def grid(self) -> Grid:
        """Return the grid that the keys span."""
        return grid_of(self.over, self.together)


@attrs.frozen
class DesignSection:
    """``[design]``: a key that is free, and what `historysim.design` finds its value for.

    Examples
    --------
    [design]
    key = "friction.coefficient"
    between = [0.05, 0.5]
    target = "10 nm"
    output = "preliminary_displacement"
    """

    key: str  #: the key to find a value for
    between: tuple[Any, ...]  #: the least and the greatest value
    target: Any = None  #: what the output shall be; one of ``target``, ``below`` and ``above`` is needed
    below: Any = None  #: A limit that the output shall keep in a share of the points of ``over``
    above: Any = None  #: likewise, from below
    quantile: Number | None = None  #: that share; by default 0.95
    output: str = "drift"  #: which number of a sweep
    over: dict[str, Any] | None = None  #: keys over which the search is repeated, as in ``[sweep.over]``

    def __attrs_post_init__(self) -> None:
        """Check the ends, and that there is a grid where one is asked for."""
        if len(self.between) != 2:
            raise field_error(f"{len(self.between)} values; expected two, the least and the greatest", "between")
        goals = [name for name in ("target", "below", "above") if getattr(self, name) is not None]
        if len(goals) != 1:
            raise InputError(f"{' and '.join(goals) or 'no target'}; expected one of target, below and above")
        if self.quantile is not None and (goals == ["target"] or not 0.5 <= self.quantile < 1):
            raise field_error("expected a share from 0.5 to below 1, with below or above", "quantile")
        self.grid()

    def grid(self) -> Grid:
        """Return the grid over which the search is repeated: of one point where there is none."""
        return grid_of(self.over) if self.over is not None else Grid(())


@attrs.frozen
class Sections:
    """A scenario file, section by section."""

    materials: MaterialsSection
    surface: SurfaceKind
    loading: Loading
    friction: Coefficients | None = None
    wear: AnyWearLaw | None = None
    adhesion: AdhesionSection | None = None
    instrument: Instrument = RIGID
    rings: Rings = RINGS
    record: RecordSection = RecordSection()
    fit: FitSection | None = None
    metadata: MetadataSection = MetadataSection()
    sweep: SweepSection | None = None
    design: DesignSection | None = None
    picture: Pictures = ()
    title: str = ""  #: A heading, before the first section

    @classmethod
    def meant(cls, key: str) -> str:
        """Return what to write in place of a key that stands before the first section; empty where it is unknown."""
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
            name for name, of in kinds.items() if any(key == each.name for kind in of for each in list_fields(kind))
        ]
        return f"did you mean {' or '.join(f'{home}.{key}' for home in homes)}?" if homes else ""

    @property
    def course(self) -> FrictionCourse | CourseFile | None:
        """The course of the coefficient of friction, where it has one."""
        return self.friction.course if isinstance(self.friction, Coefficients) else None

    def pair(self) -> "MaterialPair":
        """Return the pair of materials, with the work of adhesion of ``[adhesion]``."""
        pair, adhesion = self.materials.pair(), self.adhesion
        if adhesion is None or adhesion.work_of_adhesion is None:
            return pair
        with at("adhesion"):
            return pair.with_work_of_adhesion(adhesion.work_of_adhesion)
