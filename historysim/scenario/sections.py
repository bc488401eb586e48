"""The sections of a scenario, one class for each: their keys, and what these must be."""

from typing import TYPE_CHECKING, Any

import attrs

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.fields import NOT_NEGATIVE, Force, Length, Number, Pressure, Stiffness, SurfaceEnergy
from historysim.basics.places import at, misfit
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.scenario.law_sections import FrictionSection, WearSection
from historysim.scenario.loading_kinds import Loading
from historysim.scenario.picture_kinds import Pictures
from historysim.scenario.schema import given
from historysim.scenario.surface_kinds import SurfaceKind

if TYPE_CHECKING:
    from historysim.contact.materials import Material, MaterialPair
    from historysim.scenario.grid import Grid


@attrs.frozen
class MaterialTable:
    """A material that is not built in.

    Attributes
    ----------
    name
        What it is called.
    youngs_modulus
        Young's modulus E.
    poissons_ratio
        Poisson's ratio ν.
    shear_modulus
        Shear modulus G; by default E/(2 (1 + ν)).
    surface_energy
        Surface energy γ, from which the work of adhesion follows.
    hardness
        Hardness, for ``yielding`` and for the warning that asperities yield.
    yield_stress
        Yield stress, for the same.
    fracture_toughness
        K_Ic in Pa √m, a plain number; for the warning that asperities crack.

    Examples
    --------
    second = { name = "my glass", youngs_modulus = "64 GPa", poissons_ratio = 0.2 }
    """

    name: str
    youngs_modulus: Pressure
    poissons_ratio: Number
    shear_modulus: Pressure | None = None
    surface_energy: SurfaceEnergy | None = None
    hardness: Pressure | None = None
    yield_stress: Pressure | None = None
    fracture_toughness: Number | None = None


MaterialEntry = str | MaterialTable


@attrs.frozen
class MaterialsSection:
    """``[materials]``: two materials, or the moduli of the pair.

    Attributes
    ----------
    first
        A built-in material by its name, or a table as below.
    second
        The other material.
    contact_modulus
        E* of the pair, in place of materials, together with ``shear_modulus``.
    shear_modulus
        G* of the pair.
    hardness
        Of the softer one, where the pair is given by its moduli. Without ``yielding`` it changes no result: it
        tells whether the model may be used.
    yield_stress
        Of the softer one, likewise.

    Examples
    --------
    [materials]
    first = "silicon"
    second = "float glass"
    """

    first: MaterialEntry | None = None
    second: MaterialEntry | None = None
    contact_modulus: Pressure | None = None
    shear_modulus: Pressure | None = None
    hardness: Pressure | None = None
    yield_stress: Pressure | None = None

    def __attrs_post_init__(self) -> None:
        """Check that the pair is given in one way, and fully."""
        limits = {"hardness", "yield_stress"} & set(given(self))
        keys = [key for key in given(self) if key not in limits]
        if self.first is not None and limits:
            raise misfit("belongs to one material; expected it in first or second", min(limits))
        if keys not in (["first", "second"], ["contact_modulus", "shear_modulus"]):
            raise InputError(
                f"{' and '.join(keys) or 'nothing'} given; expected either first and second, or contact_modulus and "
                "shear_modulus"
            )

    def pair(self) -> "MaterialPair":
        """Return the material pair."""
        from historysim.contact.materials import MaterialPair

        if self.contact_modulus is not None:
            with at("materials"):
                return MaterialPair.from_moduli(**given(self))
        first, second = _material("first", self.first), _material("second", self.second)
        with at("materials"):
            return MaterialPair(first, second)


def _material(key: str, entry: MaterialEntry | None) -> "Material":
    from historysim.contact.materials import Material, material

    with at("materials", key):
        if isinstance(entry, MaterialTable):
            return Material(**given(entry))
        return material(str(entry))


@attrs.frozen
class InstrumentSection:
    """``[instrument]``: what stands between the drive and the contact, and what it resolves.

    Attributes
    ----------
    lateral_stiffness
        Stiffness in series with the contact. Tangential displacements of the loading are then those of the
        drive: drive displacement = contact displacement + T/k_s.
    displacement_resolution
        What the instrument resolves. Changes no result: a run warns of what is below it.
    load_resolution
        Likewise, of loads.

    Examples
    --------
    [instrument]
    lateral_stiffness = "334 mN/µm"
    displacement_resolution = "1 nm"
    """

    lateral_stiffness: Stiffness | None = None
    displacement_resolution: Length | None = None
    load_resolution: Force | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it can be an instrument."""
        if not given(self):
            raise misfit("missing; expected a value", "lateral_stiffness")
        self.instrument()

    def instrument(self) -> Instrument:
        """Return the instrument."""
        return Instrument(**given(self))


@attrs.frozen
class AdhesionSection:
    """``[adhesion]``: what says how adhesive the asperities are; the replay itself has no adhesion.

    Without a work of adhesion it follows from the surface energies of the two materials (Girifalco and Good).

    Attributes
    ----------
    equilibrium_separation
        Equilibrium separation z0 of the surfaces.
    work_of_adhesion
        Work of adhesion W; by default from the surface energies of the two materials.

    Examples
    --------
    [adhesion]
    equilibrium_separation = "0.3 nm"
    """

    equilibrium_separation: Length
    work_of_adhesion: SurfaceEnergy | None = None

    def work(self, pair: "MaterialPair") -> float:
        """Return the work of adhesion [J/m²]."""
        if self.work_of_adhesion is not None:
            return self.work_of_adhesion
        from historysim.contact.adhesion import work_of_adhesion

        energies = [material.surface_energy for material in (pair.first, pair.second) if material]
        known = [energy for energy in energies if energy is not None]
        if len(known) < 2:
            raise misfit("missing; the materials have no surface energy to take it from", "work_of_adhesion")
        return float(work_of_adhesion(*known))


FITTED = ("friction", "shear_modulus", "lateral_stiffness", "height_scale")


@attrs.frozen
class FitSection:
    """``[fit]``: what is fitted to what was measured, and how noisy that is.

    Attributes
    ----------
    parameters
        What is fitted, from the scenario's own values on: any of ``"friction"``, ``"shear_modulus"``,
        ``"lateral_stiffness"``, ``"height_scale"``.
    skip
        Loops at the start of the record that are not compared.
    displacement_noise
        Standard deviation of the measured displacement; by default from the record.
    load_noise
        Standard deviation of the measured load; by default from the record.

    Examples
    --------
    [fit]
    parameters = ["friction"]
    skip = 1
    """

    parameters: tuple[str, ...]
    skip: int = attrs.field(default=0, validator=NOT_NEGATIVE)
    displacement_noise: Length | None = attrs.field(default=None, validator=NOT_NEGATIVE)
    load_noise: Force | None = attrs.field(default=None, validator=NOT_NEGATIVE)

    def __attrs_post_init__(self) -> None:
        """Check the names."""
        if not self.parameters or len(set(self.parameters)) < len(self.parameters):
            raise misfit("expected one or more parameters, each of them once", "parameters")
        for index, name in enumerate(self.parameters):
            if name not in FITTED:
                raise misfit(f"{shown(name)}; {nearest(name, FITTED)}", "parameters", index)


@attrs.frozen
class MetadataSection:
    """``[metadata]``: who made the data, what for, and under which licence, by the names of ACDD 1.3.

    Attributes
    ----------
    summary
        A paragraph on the data; by default one of the program's own.
    keywords
        Words for a catalogue.
    comment
        Anything else.
    creator_name
        Who made the data.
    creator_email
        Where to write to.
    creator_url
        A page on who made the data.
    institution
        Where the data were made.
    project
        What for.
    publisher_name
        Who publishes them.
    publisher_email
        Where to write to.
    publisher_url
        A page on the publisher.
    acknowledgement
        Who is thanked.
    references
        What describes the data or how they were made.
    license
        Under which licence they may be used.
    naming_authority
        Who gives the ``id``.
    product_version
        Which version of the data.

    Examples
    --------
    [metadata]
    creator_name = "A. Tribologist"
    license = "CC-BY-4.0"
    keywords = ["friction", "drift"]
    """

    summary: str | None = None
    keywords: tuple[str, ...] | None = None
    comment: str | None = None
    creator_name: str | None = None
    creator_email: str | None = None
    creator_url: str | None = None
    institution: str | None = None
    project: str | None = None
    publisher_name: str | None = None
    publisher_email: str | None = None
    publisher_url: str | None = None
    acknowledgement: str | None = None
    references: str | None = None
    license: str | None = None
    naming_authority: str | None = None
    product_version: str | None = None

    def attributes(self) -> dict[str, str]:
        """Return what is given as attributes of a file; keywords stand in one text, with commas."""
        return {key: value if isinstance(value, str) else ", ".join(value) for key, value in given(self).items()}


RECORDS = ("touching", "all", "totals")


@attrs.frozen
class RecordSection:
    """``[record]``: the asperities that are written out one by one, and whether it is followed how far they slide.

    Attributes
    ----------
    asperities
        ``"touching"``, ``"all"``, ``"totals"`` (none of them), or an array of indices, counted from 0 in the
        order of the surface.
    sliding
        Also records how far each asperity slides, ∫|dU| while all its springs slip: ``slid_distance``. With
        wear, or friction that evolves, it is recorded in any case.

    Examples
    --------
    [record]
    asperities = "totals"
    """

    asperities: str | tuple[int, ...] = "touching"
    sliding: bool = False


@attrs.frozen
class SweepSection:
    """``[sweep]``: keys with several values each, which `historysim.sweep` goes through.

    Attributes
    ----------
    over
        Keys with several values each: arrays, or ranges ``{ from, to, count, spacing }``.
    together
        Lists of keys that are taken side by side, as one dimension.
    outputs
        Numbers, totals or variables that each cell gives; by default ten numbers.

    Examples
    --------
    [sweep]
    outputs = ["preliminary_displacement"]

    [sweep.over]
    friction.coefficient = [0.1, 0.2, 0.3]
    """

    over: dict[str, Any]
    together: tuple[tuple[str, ...], ...] = ()
    outputs: tuple[str, ...] = ()

    def __attrs_post_init__(self) -> None:
        """Check that there is a grid."""
        self.grid()

    def grid(self) -> "Grid":
        """Return the grid that the keys span."""
        from historysim.scenario.grid import grid_of

        return grid_of(self.over, self.together)


@attrs.frozen
class DesignSection:
    """``[design]``: a key that is free, and what `historysim.design` finds its value for.

    Attributes
    ----------
    key
        The key whose value is looked for.
    between
        The least and the greatest value.
    target
        What the output shall be; one of ``target``, ``below`` and ``above`` is needed.
    below
        A limit that the output shall keep in a share of the points of ``over``.
    above
        Likewise, from below.
    quantile
        That share; by default 0.95.
    output
        Which number of a sweep.
    over
        Keys over which the search is repeated, as in ``[sweep.over]``.

    Examples
    --------
    [design]
    key = "friction.coefficient"
    between = [0.05, 0.5]
    target = "10 nm"
    output = "preliminary_displacement"
    """

    key: str
    between: tuple[Any, ...]
    target: Any = None
    below: Any = None
    above: Any = None
    quantile: Number | None = None
    output: str = "drift"
    over: dict[str, Any] | None = None

    def __attrs_post_init__(self) -> None:
        """Check the ends, and that there is a grid where one is asked for."""
        if len(self.between) != 2:
            raise misfit(f"{len(self.between)} values; expected two, the least and the greatest", "between")
        goals = [name for name in ("target", "below", "above") if getattr(self, name) is not None]
        if len(goals) != 1:
            raise InputError(f"{' and '.join(goals) or 'no target'}; expected one of target, below and above")
        if self.quantile is not None and (goals == ["target"] or not 0.5 <= self.quantile < 1):
            raise misfit("expected a share from 0.5 to below 1, with below or above", "quantile")
        self.grid()

    def grid(self) -> "Grid":
        """Return the grid over which the search is repeated: of one point where there is none."""
        from historysim.scenario.grid import Grid, grid_of

        return grid_of(self.over) if self.over is not None else Grid(())


@attrs.frozen
class Sections:
    """A scenario file, section by section.

    Attributes
    ----------
    title
        A heading, before the first section.
    """

    materials: MaterialsSection
    surface: SurfaceKind
    loading: Loading
    friction: FrictionSection | None = None
    wear: WearSection | None = None
    adhesion: AdhesionSection | None = None
    instrument: InstrumentSection | None = None
    record: RecordSection = RecordSection()
    fit: FitSection | None = None
    metadata: MetadataSection = MetadataSection()
    sweep: SweepSection | None = None
    design: DesignSection | None = None
    picture: Pictures = ()
    title: str = ""

    @property
    def instrument_in_series(self) -> Instrument:
        """The instrument in series with the contact, rigid where none is named."""
        return self.instrument.instrument() if self.instrument else RIGID
