"""A scenario built: its sections made once into the surface, the ensemble and the events of a replay."""

import math
from collections.abc import Sequence
from time import monotonic
from typing import TYPE_CHECKING, Any

import attrs

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.inclined import InclinedEnsemble
from historysim.basics.wording import Notify
from historysim.contact import hertz
from historysim.errors import InputError, at, field_error
from historysim.loads.event_sequence import as_events, channel_values, to_loads
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.recording.recorder import StateOnly, chosen_asperities, largest_approach
from historysim.replaying import Replay
from historysim.scenario.schema import reported
from historysim.scenario.sections import Coefficients, Sections
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.loads.schedule import Cursor

WALKED_AT_ONCE = 256  # event times between two looks at the clock


class _EndedError(Exception):
    """The seconds of a walk are over; its argument is the time [s] of the last event."""


@attrs.frozen
class BuiltScenario:
    """What a scenario describes, checked and built once."""

    name: str  #: of the file, for messages
    sections: Sections = attrs.field(repr=False)
    surface: BuiltSurface  #: as it is loaded
    ensemble: Ensemble
    events: Sequence[Event]  #: in time order; each fits the number of asperities

    def __attrs_post_init__(self) -> None:
        """Check that the events and the recorded indices fit the number of asperities."""
        record = self.sections.record.asperities
        with reported(self.name), at("record", "asperities"):
            if not isinstance(record, str):
                chosen_asperities(self.ensemble, (), record)
        for event in self.events if to_loads(self.events) is None else ():
            if problem := event.problem(len(self.ensemble)):
                raise InputError(f"{self.name}: loading: {event.name} at t = {event.time:g} s: {problem}")

    @property
    def replay(self) -> Replay:
        """The replay of the events on the ensemble, as the scenario says."""
        sections = self.sections
        return Replay(
            self.ensemble,
            self.events,
            substeps=sections.loading.substeps,
            saturate=sections.loading.saturate,
            record=sections.record.asperities,
            instrument=sections.instrument,
            hold=False,
        )

    def walk(self, seconds: float) -> float | None:
        """Walk the loads for some seconds, recording nothing; errors as for `Replay`.

        Returns the time of the last event that was reached [s], where that was not all of them.
        """
        end = monotonic() + seconds

        def look(cursor: "Cursor", _: object) -> None:
            if monotonic() > end and cursor.events < len(self.events):
                raise _EndedError(cursor.time)

        job = attrs.evolve(self.replay, substeps=1, record="totals")
        # where asperities evolve an event may take a second
        rows = WALKED_AT_ONCE if job.changes.steady else 1
        try:
            job.walk(job.recorder(StateOnly), most_rows=rows, on_event=look)
        except _EndedError as ended:
            return float(ended.args[0])
        return None

    def adhering(self) -> "AdheringAsperities | None":
        """Return how adhesive the asperities are where they are pressed most.

        None without ``[adhesion]``, or where nothing touches; one that cannot be used is an InputError.
        """
        adhesion = self.sections.adhesion
        if adhesion is None:
            return None
        from historysim.asperities.adhering import adhering_asperities

        with reported(self.name), at("adhesion"):
            work = adhesion.work(self.ensemble.pair)
            approach = largest_approach(self.ensemble, self.events)
            if approach == 0:
                return None
            return adhering_asperities(
                self.ensemble, approach, work_of_adhesion=work, equilibrium_separation=adhesion.equilibrium_separation
            )


def built(
    name: str, sections: Sections, surface: BuiltSurface, events: Sequence[Event], notify: Notify
) -> BuiltScenario:
    """Return a scenario built with the surface as it comes, and its events; ``name`` is its file, for messages."""
    events = as_events(events)
    if surface.solutions is None and (surface.interacts or surface.ball_radius):
        surface = _as_loaded(name, sections, surface, events, notify)
    return BuiltScenario(name, sections, surface, ensemble_on(name, sections, surface), events)


def _as_loaded(
    name: str, sections: Sections, surface: BuiltSurface, events: Sequence[Event], notify: Notify
) -> BuiltSurface:
    """Return a surface with what depends on the largest load.

    That is the normal contact of a map with interaction, and the nominal area of one that lies on a ball: that of the
    smooth ball under that load, after Hertz.
    """
    load = float(channel_values(events, NormalLoad).max(initial=0.0)) / sections.pair().contact_modulus
    approach = float(channel_values(events, NormalDisplacement).max(initial=0.0))
    if surface.ball_radius:
        pressed = float(hertz.approach(load, summit_radius=surface.ball_radius, contact_modulus=1.0))
        area = math.pi * surface.ball_radius * max(pressed, approach)
        if surface.summits is not None and area > 0:
            surface = attrs.evolve(surface, summits=surface.summits.with_area(area))
    if not surface.interacts or surface.surface is None:
        return surface
    from historysim.interaction.solutions import NormalSolutions

    with reported(name), at("surface", "interaction"):
        solutions = NormalSolutions.solve(
            surface.surface, largest_load=load, largest_approach=approach, progress=True, notify=notify
        )
    for notice in solutions.notices:
        notify(f"{name}: {notice}")
    return attrs.evolve(surface, solutions=solutions)


def ensemble_on(name: str, sections: Sections, surface: BuiltSurface) -> Ensemble:
    """Return the ensemble on a surface as it is loaded; errors as for `Scenario.ensemble`."""
    with reported(name):
        pair, friction = sections.pair(), sections.friction
        if (friction is None) == (surface.friction is None):
            both = "given both here and in surface.columns; expected one of them"
            none = "missing; expected [friction] with a coefficient, or surface.columns.friction"
            raise field_error(none if friction is None else both, "friction")
        of_scenario: Any = friction.coefficient if isinstance(friction, Coefficients) else friction
        coefficients = surface.friction if friction is None else of_scenario
        if surface.curve is not None or surface.solutions is not None:
            _check_steady(sections)
        with at("surface"):
            if surface.curve is not None:
                return Ensemble.from_normal_curves(pair, *surface.curve, coefficients, rings=sections.rings)
            if surface.solutions is not None:
                return Ensemble.from_solutions(pair, surface.solutions, coefficients, rings=sections.rings)
            sloping = surface.summits is not None and surface.summits.slope is not None
            return (InclinedEnsemble if sloping else Ensemble).from_summits(
                pair,
                surface.summits,
                coefficients,
                wear=sections.wear,
                follow_sliding=sections.record.sliding,
                rings=sections.rings,
                yielding=surface.yielding,
            )


def _check_steady(sections: Sections) -> None:
    """Check that no key asks for what patches of a normal curve cannot do."""
    asked = {
        ("wear",): sections.wear is not None,
        ("record", "sliding"): sections.record.sliding,
        ("friction", "law"): not isinstance(sections.friction, Coefficients | None),
    }
    for place in (key for key, is_asked in asked.items() if is_asked):
        problem = "patches of one contact keep their shape and share one coefficient; expected independent summits"
        raise field_error(problem, *place)
