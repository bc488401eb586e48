"""A scenario: materials, surface, friction, loading and what to record, from one TOML file.

Numbers are SI; texts may carry units. Relative paths are relative to the scenario file. The sections
build the same objects that a program would: an ``Ensemble`` and a list of events.
"""

import os
import tomllib
from collections.abc import Sequence
from functools import partial
from operator import eq
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
from cattrs import Converter

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.places import at, misfit
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.loads.events import Event, FrictionChange
from historysim.scenario.columns import column_hooks
from historysim.scenario.loading_kinds import (
    MOST_STEPS,
    AnyLoading,
    MeasuredLoading,
    channel_hooks,
    loading_from_toml,
)
from historysim.scenario.schema import (
    Force,
    Length,
    Number,
    Numbers,
    Pressure,
    Stiffness,
    SurfaceEnergy,
    given,
    reported,
    schema_converter,
    text,
)
from historysim.scenario.surface_kinds import (
    Ground,
    MapKind,
    SurfaceKind,
    channel_from_toml,
    map_from_toml,
    surface_from_toml,
)

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.ensemble import Ensemble
    from historysim.contact.materials import Material, MaterialPair
    from historysim.measured.measurement import Measurement
    from historysim.replay import Replay


# -- materials -------------------------------------------------------------------------------------


@attrs.frozen
class MaterialTable:
    """A material that is not built in."""

    name: str
    youngs_modulus: Pressure
    poissons_ratio: Number
    shear_modulus: Pressure | None = None
    surface_energy: SurfaceEnergy | None = None


MaterialEntry = str | MaterialTable


@attrs.frozen
class Materials:
    """``[materials]``: two materials, or the moduli of the pair."""

    first: MaterialEntry | None = None
    second: MaterialEntry | None = None
    contact_modulus: Pressure | None = None
    shear_modulus: Pressure | None = None

    def __attrs_post_init__(self) -> None:
        """Check that the pair is given in one way, and fully."""
        keys = list(given(self))
        if keys not in (["first", "second"], ["contact_modulus", "shear_modulus"]):
            raise InputError(
                f"{' and '.join(keys) or 'nothing'} given; expected either first and second, or contact_modulus and "
                "shear_modulus"
            )

    def pair(self) -> "MaterialPair":
        """Build the material pair."""
        from historysim.contact.materials import MaterialPair

        if self.contact_modulus is not None and self.shear_modulus is not None:
            with at("materials"):
                return MaterialPair.from_moduli(contact_modulus=self.contact_modulus, shear_modulus=self.shear_modulus)
        first, second = _material("first", self.first), _material("second", self.second)
        with at("materials"):
            return MaterialPair(first, second)


def _material(key: str, entry: MaterialEntry | None) -> "Material":
    from historysim.contact.materials import Material, material

    with at("materials", key):
        if isinstance(entry, MaterialTable):
            return Material(**given(entry))
        return material(str(entry))


# -- friction --------------------------------------------------------------------------------------


@attrs.frozen
class Friction:
    """``[friction]``: one coefficient, or one for each asperity."""

    coefficient: Numbers


# -- instrument ------------------------------------------------------------------------------------


@attrs.frozen
class InSeries:
    """``[instrument]``: what stands between the drive and the contact."""

    lateral_stiffness: Stiffness

    def __attrs_post_init__(self) -> None:
        """Check that it can be an instrument."""
        self.instrument()

    def instrument(self) -> Instrument:
        """Build the instrument."""
        return Instrument(self.lateral_stiffness)


# -- adhesion --------------------------------------------------------------------------------------


@attrs.frozen
class Adhesion:
    """``[adhesion]``: what says how adhesive the asperities are; the replay itself has no adhesion.

    Without a work of adhesion it follows from the surface energies of the two materials (Girifalco and Good).
    """

    equilibrium_separation: Length
    work_of_adhesion: SurfaceEnergy | None = None

    def work(self, pair: "MaterialPair") -> float:
        """Give the work of adhesion [J/m²]."""
        if self.work_of_adhesion is not None:
            return self.work_of_adhesion
        from historysim.contact.adhesion import work_of_adhesion

        energies = [material.surface_energy for material in (pair.first, pair.second) if material]
        known = [energy for energy in energies if energy is not None]
        if len(known) < 2:
            raise misfit("missing; the materials have no surface energy to take it from", "work_of_adhesion")
        return float(work_of_adhesion(*known))


# -- the whole -------------------------------------------------------------------------------------


FITTED = ("friction", "shear_modulus", "lateral_stiffness", "height_scale")


@attrs.frozen
class FitSection:
    """``[fit]``: what is fitted to what was measured, and how noisy that is."""

    parameters: tuple[str, ...]
    skip: int = 0
    displacement_noise: Length | None = None
    load_noise: Force | None = None

    def __attrs_post_init__(self) -> None:
        """Check the names and the numbers."""
        if not self.parameters or len(set(self.parameters)) < len(self.parameters):
            raise misfit("expected one or more parameters, each of them once", "parameters")
        for index, name in enumerate(self.parameters):
            if name not in FITTED:
                raise misfit(f"{shown(name)}; {nearest(name, FITTED)}", "parameters", index)
        if self.skip < 0:
            raise misfit(f"{self.skip}; expected 0 or more", "skip")
        for key in ("displacement_noise", "load_noise"):
            value = getattr(self, key)
            if value is not None and value < 0:
                raise misfit(f"{value:g}; expected 0 or more", key)


RECORDS = ("touching", "all", "totals")


@attrs.frozen
class RecordSection:
    """``[record]``: the asperities that are written out one by one."""

    asperities: str | tuple[int, ...] = "touching"


@attrs.frozen
class Sections:
    """A scenario file, section by section."""

    materials: Materials
    surface: SurfaceKind
    loading: AnyLoading
    friction: Friction | None = None
    adhesion: Adhesion | None = None
    instrument: InSeries | None = None
    record: RecordSection = RecordSection()
    fit: FitSection | None = None
    title: str = ""


@attrs.frozen
class Scenario:
    """A scenario and the file that it came from.

    Attributes
    ----------
    path : Path
        The file.
    text : str
        What stands in the file (TOML).
    sections : Sections
        What that means.
    """

    path: Path
    text: str = attrs.field(repr=False)
    sections: Sections

    @property
    def title(self) -> str:
        """The title, empty if it has none."""
        return self.sections.title

    @property
    def substeps(self) -> int:
        """The number of steps that each stretch between two event times is divided into."""
        return self.sections.loading.substeps

    @property
    def saturate(self) -> bool:
        """Whether a tangential load beyond the limit is held at the limit."""
        return self.sections.loading.saturate

    @property
    def record(self) -> str | tuple[int, ...]:
        """The asperities to record: ``"touching"``, ``"all"``, ``"totals"`` or indices."""
        return self.sections.record.asperities

    @property
    def instrument(self) -> Instrument:
        """The instrument in series with the contact, rigid where none is named."""
        return self.sections.instrument.instrument() if self.sections.instrument else RIGID

    def ground(self) -> Ground:
        """Make the surface and its summits.

        Raises
        ------
        InputError
            A surface that cannot be used; the message names file and field.
        """
        with reported(self.path.name), at("surface"):
            return self.sections.surface.ground(self.path.parent)

    def ensemble(self, ground: Ground | None = None) -> "Ensemble":
        """Build the ensemble.

        Parameters
        ----------
        ground : Ground, optional
            What `ground` has made, where it is needed for something else too.

        Raises
        ------
        InputError
            Materials, summits or friction that cannot be used; the message names file and field.
        """
        from historysim.asperities.ensemble import Ensemble

        ground = ground or self.ground()
        with reported(self.path.name):
            pair = self.sections.materials.pair()
            friction = self._friction(ground.friction is not None)
            with at("surface"):
                coefficients = ground.friction if friction is None else friction
                ensemble = Ensemble.from_summits(pair, ground.summits, coefficients)
            self._check_record(len(ensemble))
        return ensemble

    def events(self) -> list[Event]:
        """Build the events, in time order.

        Raises
        ------
        InputError
            Loads that cannot be used; the message names file and field, or line and column.
        """
        with reported(self.path.name):
            events = self.sections.loading.events(self.path.parent)
            if not events:
                raise misfit("no waypoints; expected one or more", "loading")
            steps = len(events) * self.substeps
            if steps > MOST_STEPS:
                problem = f"{steps:,} steps; expected {MOST_STEPS:,} at most; use fewer substeps"
                raise misfit(problem, "loading", "substeps")
        return events

    def adhering(self, ensemble: "Ensemble", events: Sequence[Event]) -> "AdheringAsperities | None":
        """Say how adhesive the asperities are where they are pressed most.

        None without ``[adhesion]``, or where nothing touches.

        Raises
        ------
        InputError
            An ``[adhesion]`` that cannot be used; the message names the field.
        """
        from historysim.asperities.adhering import adhering_asperities
        from historysim.recording.recorder import largest_approach

        adhesion = self.sections.adhesion
        with reported(self.path.name), at("adhesion"):
            if adhesion is None:
                return None
            work = adhesion.work(ensemble.pair)
            approach = largest_approach(ensemble, events)
            if approach == 0:
                return None
            return adhering_asperities(
                ensemble, approach, work_of_adhesion=work, equilibrium_separation=adhesion.equilibrium_separation
            )

    @property
    def measured_file(self) -> Path:
        """The file that the scenario replays.

        Raises
        ------
        InputError
            A scenario whose loading is not measured.
        """
        return self.path.parent / self._measured_loading().file

    def measurement(self) -> "Measurement":
        """Read the file that the scenario replays, and return what was measured.

        Raises
        ------
        InputError
            A scenario whose loading is not measured, or a file that cannot be used.
        """
        loading = self._measured_loading()
        with reported(self.path.name):
            return loading.measurement(self.path.parent)

    def replay(self) -> "Replay":
        """Return the replay that the scenario describes.

        Raises
        ------
        InputError
            As for `checked`.
        """
        from historysim.replay import Replay

        ensemble, events = self.checked()
        return Replay(
            ensemble,
            events,
            substeps=self.substeps,
            saturate=self.saturate,
            record=self.record,
            instrument=self.instrument,
        )

    def checked(self, ground: Ground | None = None) -> "tuple[Ensemble, list[Event]]":
        """Build ensemble and events, and check the one against the other; parameters as for `ensemble`.

        Raises
        ------
        InputError
            As for either, or a change of friction with a wrong number of coefficients.
        """
        ensemble, events = self.ensemble(ground), self.events()
        for event in events:
            if isinstance(event, FrictionChange) and isinstance(event.friction, tuple):
                given, expected = len(event.friction), len(ensemble)
                if given not in {1, expected}:
                    raise InputError(
                        f"{self.path.name}: loading: friction at t = {event.time:g} s has {given} coefficients for "
                        f"{expected} asperities; expected one, or one per asperity"
                    )
        return ensemble, events

    def _measured_loading(self) -> MeasuredLoading:
        loading = self.sections.loading
        with reported(self.path.name):
            if not isinstance(loading, MeasuredLoading):
                raise misfit("is written out; expected a measured file", "loading")
        return loading

    def _friction(self, in_surface: bool) -> float | tuple[float, ...] | None:
        friction = self.sections.friction
        if in_surface == (friction is not None):
            problem = (
                "given both here and in surface.columns; expected one of them"
                if in_surface
                else "missing; expected [friction] with a coefficient, or surface.columns.friction"
            )
            raise misfit(problem, "friction")
        return friction.coefficient if friction else None

    def _check_record(self, count: int) -> None:
        if isinstance(self.record, str):
            return
        if not self.record or len(set(self.record)) < len(self.record):
            raise misfit("expected one or more indices, each of them once", "record", "asperities")
        for position, index in enumerate(self.record):
            if not 0 <= index < count:
                problem = f"{shown(index)}; expected an index from 0 to {count - 1}, since there are {count} asperities"
                raise misfit(problem, "record", "asperities", position)


def load(path: str | os.PathLike[str]) -> Scenario:
    """Read a scenario.

    Parameters
    ----------
    path : path-like
        A TOML file.

    Returns
    -------
    Scenario
        The scenario; its ``ensemble()`` and ``events()`` build what ``replay`` takes.

    Raises
    ------
    InputError
        A file that cannot be read or is not TOML, or fields that cannot be used: one line for each, with
        the path to it.
    """
    path = Path(path)
    with reported(path.name or str(path)):
        source = _source(path)
        try:
            document = tomllib.loads(source)
        except (ValueError, RecursionError) as error:
            raise InputError(f"is not TOML: {error}") from error
        if not document:
            raise InputError("is empty; expected at least [materials], [surface], [friction] and [loading]")
        sections = _converter().structure(document, Sections)
    return Scenario(path, source, sections)


def as_scenario(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """Return a scenario, read from its file where that is given; errors as for `load`."""
    return scenario if isinstance(scenario, Scenario) else load(scenario)


def _converter() -> Converter:
    converter = schema_converter()
    for kind, hook in (
        (MaterialEntry | None, _material_entry),
        (SurfaceKind, surface_from_toml),
        (MapKind, map_from_toml),
        (int | str | None, channel_from_toml),
        (AnyLoading, loading_from_toml),
        (str | tuple[int, ...], _record),
    ):
        converter.register_structure_hook_func(partial(eq, kind), partial(hook, converter))
    column_hooks(converter)
    channel_hooks(converter)
    return converter


def _material_entry(converter: Converter, value: object, _: object) -> MaterialEntry:
    return converter.structure(value, MaterialTable) if isinstance(value, dict) else text(value)


def _record(converter: Converter, value: object, _: object) -> str | tuple[int, ...]:
    if isinstance(value, list):
        return converter.structure(value, tuple[int, ...])
    if not isinstance(value, str) or value not in RECORDS:
        words = ", ".join(f'"{word}"' for word in RECORDS)
        raise InputError(f"{shown(value)}; expected {words} or an array of indices")
    return value


def _source(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(
            f"there is no such file in {path.absolute().parent}; expected a scenario file (TOML)"
        ) from None
    except IsADirectoryError:
        raise InputError("is a folder; expected a scenario file (TOML)") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"is not UTF-8 text ({error.reason} at byte {error.start}); expected TOML") from error
    except ValueError as error:
        raise InputError(f"cannot be a path: {error}") from error
