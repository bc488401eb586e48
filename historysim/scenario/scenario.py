"""A scenario: materials, surface, friction, loading and what to record, from one TOML file.

Numbers are SI; texts may carry units. Relative paths are relative to the scenario file. The sections
build the same objects that a program would: an ``Ensemble`` and a list of events.
"""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.limits import at_most, most
from historysim.basics.notices import Teller, silent
from historysim.basics.places import at, misfit
from historysim.basics.wording import counted, shown
from historysim.errors import InputError
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.loads.events import misfit as event_misfit
from historysim.recording import named_states
from historysim.scenario.document import read_sections, sections_of
from historysim.scenario.input_files import files_of
from historysim.scenario.loading_kinds import MeasuredLoading
from historysim.scenario.schema import given, reported
from historysim.scenario.sections import Sections
from historysim.scenario.surface_kinds import Ground
from historysim.scenario.surface_kinds.map_kinds import HeightMap

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.laws import FrictionLaw
    from historysim.measured.measurement import Measurement
    from historysim.replaying import Replay
    from historysim.surfaces.summits import Summits


@attrs.frozen
class Scenario:
    """A scenario and the file that it came from.

    Attributes
    ----------
    path : Path
        The file.
    text : str
        What stands in the file (TOML), with the values that take the place of some.
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

    @property
    def metadata(self) -> dict[str, str]:
        """Who made the data, what for, under which licence (ACDD), and named states: attributes of what is written."""
        return self.sections.metadata.attributes() | named_states.written(self.sections.loading.names)

    @property
    def seeds(self) -> list[int]:
        """The seeds of all that is drawn by chance: of the surface, in the order of the file, and of friction."""
        drawn = (self.sections.surface, self.sections.friction)
        return [seed for section in drawn if section is not None for seed in _seeds(section)]

    def ground(self) -> Ground:
        """Return the surface and its summits.

        Raises
        ------
        InputError
            A surface that cannot be used; the message names file and field.
        """
        # numpy would make the start of each command longer
        from historysim.basics.arguments import workable

        with reported(self.path.name), at("surface"):
            ground = self.sections.surface.ground(self.path.parent)
            if ground.passes is not None:
                friction = self.sections.friction
                coefficient = None if friction is None else friction.coefficient
                ground = ground.passes.done(ground, self.sections.materials.pair(), coefficient)
            if ground.summits is not None:
                workable("the radius of a summit", ground.summits.radius)
                workable("the height of a summit", ground.summits.height)
            return ground

    def unprepared_ground(self) -> Ground | None:
        """Return the surface as it comes, without filters and what else prepares a map; None where nothing does.

        Raises
        ------
        InputError
            As for `ground`.
        """
        kind: Any = self.sections.surface
        # a map may be scaled, or interact
        while not isinstance(kind, HeightMap) and hasattr(kind, "kind"):
            kind = kind.kind
        plain = kind.unprepared() if isinstance(kind, HeightMap) else None
        with reported(self.path.name), at("surface"):
            return plain.ground(self.path.parent) if plain else None

    def ensemble(self, ground: Ground | None = None) -> "Ensemble":
        """Return the ensemble.

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

        ground = self.solved(ground or self.ground())
        with reported(self.path.name):
            pair = self.sections.materials.pair()
            if self.sections.adhesion and self.sections.adhesion.work_of_adhesion is not None:
                with at("adhesion"):
                    pair = pair.with_work_of_adhesion(self.sections.adhesion.work_of_adhesion)
            friction = self._friction(ground.friction is not None)
            coefficients: Any = ground.friction if friction is None else friction
            if ground.curve is not None or ground.solutions is not None:
                self._check_steady()
            if ground.curve is not None:
                with at("surface"):
                    curve = ground.curve
                    ensemble = Ensemble.from_normal_curves(pair, curve.approach, curve.load, curve.area, coefficients)
            elif ground.solutions is not None:
                ensemble = Ensemble.from_solutions(pair, ground.solutions, coefficients)
            else:
                with at("surface"):
                    wear = self.sections.wear.wear() if self.sections.wear else None
                    evolving = {
                        "wear": wear,
                        "follow_sliding": self.sections.record.sliding,
                        "yielding": ground.yielding,
                    }
                    ensemble = Ensemble.from_summits(pair, ground.summits, coefficients, **evolving)
            self._check_record(len(ensemble))
        return ensemble

    def solved(self, ground: Ground) -> Ground:
        """Return the ground as it is loaded, with what depends on the largest load.

        That is the normal contact of a map whose asperities press on one another, and the nominal area of one that lies
        on a ball: that of the smooth ball under that load, after Hertz. Any other ground is returned as it is.

        Raises
        ------
        InputError
            A map that cannot be solved, or nothing ever touches.
        """
        if ground.solutions is not None or not (ground.interacts or ground.ball_radius):
            return ground
        events, modulus = self.events(), self.sections.materials.pair().contact_modulus
        loads = [event.value for event in events if isinstance(event, NormalLoad)]
        approaches = [event.value for event in events if isinstance(event, NormalDisplacement)]
        if ground.ball_radius:
            ground = attrs.evolve(ground, summits=_on_ball(ground, max([*loads, 0.0]) / modulus, approaches))
        if not ground.interacts or ground.surface is None:
            return ground
        from historysim.interaction.solutions import NormalSolutions

        with reported(self.path.name), at("surface", "interaction"):
            found = NormalSolutions.of(
                ground.surface,
                largest_load=max([*loads, 0.0]) / modulus,
                largest_approach=max([*approaches, 0.0]),
                progress=True,
            )
        return attrs.evolve(ground, solutions=found)

    def events(self, tell: Teller = silent) -> list[Event]:
        """Return the events, in time order; what is to be known of how a file was read is told.

        Raises
        ------
        InputError
            Loads that cannot be used; the message names file and field, or line and column.
        """
        with reported(self.path.name):
            events = self.sections.loading.events(self.path.parent, tell)
            if not events:
                raise misfit("no waypoints; expected one or more", "loading")
            friction = self.sections.friction
            if friction is not None and friction.course is not None:
                with at("friction", "course"):
                    events = friction.course.course(self.path.parent).along(events)
            steps = len(events) * self.substeps
            if steps > most("STEPS"):
                problem = f"{steps:,} steps; {at_most('STEPS')}; use fewer substeps"
                raise misfit(problem, "loading", "substeps")
        return events

    def adhering(self, ensemble: "Ensemble", events: Sequence[Event]) -> "AdheringAsperities | None":
        """Return how adhesive the asperities are where they are pressed most.

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
    def files(self) -> tuple[Path, ...]:
        """The file that it came from, and all that it names."""
        return self.path, *files_of(self.sections, self.path.parent)

    @property
    def measured_files(self) -> tuple[Path, ...]:
        """The files that the scenario replays.

        Raises
        ------
        InputError
            A scenario whose loading is not measured.
        """
        return tuple(self.path.parent / file for file in self._measured_loading().files)

    def measurement(self) -> "Measurement":
        """Return what was measured, from the file that the scenario replays.

        Raises
        ------
        InputError
            A scenario whose loading is not measured, or a file that cannot be used.
        """
        loading = self._measured_loading()
        with reported(self.path.name):
            return loading.measurement(self.path.parent)

    @property
    def run(self) -> int | str | None:
        """Which run of its file is read, or ``"each"``; None where that is not said."""
        loading = self.sections.loading
        return loading.run if isinstance(loading, MeasuredLoading) else None

    def runs(self) -> "list[Scenario]":
        """Return a scenario for each run of its file; itself alone, unless ``loading.run`` is ``"each"``.

        Raises
        ------
        InputError
            A scenario whose loading is not measured, or a file that cannot be used.
        """
        from historysim.scenario.loading_kinds.assembly import runs_of
        from historysim.scenario.loading_kinds.channels import EACH

        loading = self._measured_loading()
        if loading.run != EACH:
            return [self]
        with reported(self.path.name), at("loading"):
            numbers = runs_of(self.path.parent, loading)
        return [
            attrs.evolve(self, sections=attrs.evolve(self.sections, loading=attrs.evolve(loading, run=number)))
            for number in numbers
        ]

    def check_steady_friction(self) -> None:
        """Check that friction has no course, along which a record is not compared.

        Raises
        ------
        InputError
            It has one.
        """
        with reported(self.path.name):
            if self.sections.friction is not None and self.sections.friction.course is not None:
                problem = (
                    "a record is compared with, and fitted by, one coefficient throughout; expected none, or run it"
                )
                raise misfit(problem, "friction", "course")

    def replay(self, ground: Ground | None = None) -> "Replay":
        """Return the replay that the scenario describes; parameters as for `ensemble`.

        Raises
        ------
        InputError
            As for `checked`.
        """
        from historysim.replaying import Replay

        ensemble, events = self.checked(ground)
        return Replay(
            ensemble,
            events,
            substeps=self.substeps,
            saturate=self.saturate,
            record=self.record,
            instrument=self.instrument,
        )

    def checked(self, ground: Ground | None = None, tell: Teller = silent) -> "tuple[Ensemble, list[Event]]":
        """Return ensemble and events, the one checked against the other; parameters as for `ensemble`.

        Raises
        ------
        InputError
            As for either, or an event that does not fit the number of asperities.
        """
        ensemble, events = self.ensemble(ground), self.events(tell)
        for event in events:
            if problem := event_misfit(event, len(ensemble)):
                raise InputError(f"{self.path.name}: loading: {event.name} at t = {event.time:g} s: {problem}")
        return ensemble, events

    def _measured_loading(self) -> MeasuredLoading:
        loading = self.sections.loading
        with reported(self.path.name):
            if not isinstance(loading, MeasuredLoading):
                raise misfit("is written out; expected a measured file", "loading")
        return loading

    def _friction(self, in_surface: bool) -> "float | tuple[float, ...] | FrictionLaw | None":
        friction = self.sections.friction
        if in_surface == (friction is not None):
            problem = (
                "given both here and in surface.columns; expected one of them"
                if in_surface
                else "missing; expected [friction] with a coefficient, or surface.columns.friction"
            )
            raise misfit(problem, "friction")
        return friction.friction() if friction else None

    def _check_steady(self) -> None:
        """Check that nothing is asked for that patches of a normal curve cannot do."""
        asked = {
            ("wear",): self.sections.wear is not None,
            ("record", "sliding"): self.sections.record.sliding,
            ("friction", "law"): self.sections.friction is not None and self.sections.friction.law is not None,
        }
        for place, is_asked in asked.items():
            if is_asked:
                problem = (
                    "patches of one contact keep their shape and share one coefficient; expected independent summits"
                )
                raise misfit(problem, *place)

    def _check_record(self, count: int) -> None:
        if isinstance(self.record, str):
            return
        if not self.record or len(set(self.record)) < len(self.record):
            raise misfit("expected one or more indices, each of them once", "record", "asperities")
        for position, index in enumerate(self.record):
            if not 0 <= index < count:
                asperities = counted(count, "asperity", "asperities")
                problem = f"{shown(index)}; expected an index from 0 to {count - 1}, since the surface has {asperities}"
                raise misfit(problem, "record", "asperities", position)


def _on_ball(ground: Ground, load: float, approaches: Sequence[float]) -> "Summits | None":
    """Return the summits on the area of the smooth ball: by Hertz under a load over E* [m²], or at approaches [m]."""
    from historysim.contact import hertz

    radius = ground.ball_radius or 0.0
    approach = float(hertz.approach(load, summit_radius=radius, contact_modulus=1.0))
    area = math.pi * radius * max([approach, *approaches])
    return ground.summits.on_area(area) if ground.summits is not None and area > 0 else ground.summits


def load(path: str | os.PathLike[str], values: Mapping[str, Any] | None = None) -> Scenario:
    """Return the scenario that stands in a file.

    Parameters
    ----------
    path : path-like
        A TOML file.
    values : dict, optional
        Values that take the place of those in the file, by key, as ``{"friction.coefficient": 0.3}`` or
        ``{"loading.waypoints[1].tangential_load": "5 mN"}``; a key that is not in the file is added.

    Returns
    -------
    Scenario
        The scenario; its ``ensemble()`` and ``events()`` build what ``replay`` takes.

    Raises
    ------
    InputError
        No path, a file that cannot be read or is not TOML, or fields that cannot be used: one line for each, with
        the path to it.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"{path!r} is no scenario; expected the path of a TOML file")
    path = Path(path)
    with reported(path.name or str(path)):
        return Scenario(path, *read_sections(path, values))


def scenario_of(document: Mapping[str, Any], name: str) -> Scenario:
    """Return the scenario that tables say, as if a file of that name in the present folder held them.

    Parameters
    ----------
    document : dict
        The tables of a scenario, with values as TOML has them.
    name : str
        What messages and titles call it.

    Raises
    ------
    InputError
        Fields that cannot be used: one line for each, with the path to it.
    """
    import tomlkit

    with reported(name):
        return Scenario(Path(name), tomlkit.dumps(document), sections_of(document))


def as_scenario(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """Return a scenario, read from its file where that is given; errors as for `load`."""
    return scenario if isinstance(scenario, Scenario) else load(scenario)


def _seeds(section: Any) -> list[int]:
    """Return the seeds of a section, and of those within it."""
    found: list[int] = []
    for key, value in given(section).items():
        if key == "seed":
            found.append(value)
        elif attrs.has(type(value)):
            found += _seeds(value)
    return found
