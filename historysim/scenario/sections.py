"""Sections of a scenario: one class each, with its keys and their checks."""

import re
from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.asperities.instrument import RIGID, RINGS, Instrument, Rings
from historysim.basics.fields import (
    NOT_NEGATIVE,
    Key,
    Numbers,
    Pressure,
    list_fields,
)
from historysim.errors import InputError, error_path, field_error
from historysim.scenario.loading_kinds import Loading
from historysim.scenario.schema import (
    AnyAttraction,
    AnyFrictionLaw,
    AnyWearLaw,
    By,
    ImportedKind,
    explicit_fields,
    from_table,
    structure,
    structure_array,
    table,
    text,
)
from historysim.scenario.surface_kinds import SurfaceKind

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
_OPTIONAL = "historysim.scenario.optional_sections"
AnyCourse = Annotated[Any, ImportedKind(f"{_OPTIONAL}:FrictionCourse")]
AnyAdhesion = Annotated[Any, ImportedKind(f"{_OPTIONAL}:AdhesionSection")]
AnyFit = Annotated[Any, ImportedKind(f"{_OPTIONAL}:FitSection")]
AnySweep = Annotated[Any, ImportedKind(f"{_OPTIONAL}:SweepSection")]
AnyDesign = Annotated[Any, ImportedKind(f"{_OPTIONAL}:DesignSection")]


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


@attrs.frozen
class Coefficients:
    """``[friction]`` without a law: one coefficient and its course, or one coefficient per asperity."""

    #: Coefficient of friction μ, or an array with one for each asperity.
    coefficient: Numbers = attrs.field(validator=NOT_NEGATIVE)
    #: A coefficient that changes over time or distance, as below
    course: AnyCourse | None = None

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
class Sections:
    """A scenario file, section by section."""

    materials: MaterialsSection
    surface: SurfaceKind
    loading: Loading
    friction: Coefficients | None = None
    wear: AnyWearLaw | None = None
    attraction: AnyAttraction | None = None
    adhesion: AnyAdhesion | None = None
    instrument: Instrument = RIGID
    rings: Rings = RINGS
    record: RecordSection = RecordSection()
    fit: AnyFit | None = None
    metadata: MetadataSection = MetadataSection()
    sweep: AnySweep | None = None
    design: AnyDesign | None = None
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
    def course(self) -> Any:  # noqa: ANN401 - a FrictionCourse or a CourseFile
        """Course of the friction coefficient; None if it is constant."""
        return self.friction.course if isinstance(self.friction, Coefficients) else None

    def pair(self) -> "MaterialPair":
        """Return the pair of materials, with the work of adhesion of ``[adhesion]``."""
        pair, adhesion = self.materials.pair(), self.adhesion
        if adhesion is None or adhesion.work_of_adhesion is None:
            return pair
        with error_path("adhesion"):
            return pair.with_work_of_adhesion(adhesion.work_of_adhesion)
