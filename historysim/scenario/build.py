"""From the sections of a scenario to the surface, the ensemble and the events of a replay."""

import math
from collections.abc import Sequence
from time import monotonic
from typing import TYPE_CHECKING, Any

import attrs

from historysim.asperities.asperity_set import require_asperities
from historysim.asperities.body import Body, Feature
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.inclined import InclinedEnsemble
from historysim.asperities.line_contact import LineContact
from historysim.asperities.patches import Patches
from historysim.basics.wording import Notify
from historysim.contact import hertz
from historysim.errors import InputError, error_path, field_error
from historysim.loads.event_sequence import as_events, channel_values, to_loads
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.recording.recorder import StateOnly, chosen_asperities, largest_approach
from historysim.recording.unknown_past import UNKNOWN, check_bracketed
from historysim.replaying import Replay
from historysim.scenario.schema import located_errors
from historysim.scenario.sections import Coefficients, Sections
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.loads.schedule import Cursor

WALKED_AT_ONCE = 256  # event times between two checks of the clock


class _EndedError(Exception):
    """The time limit of a trial replay is reached; its argument is the time [s] of the last event."""


@attrs.frozen
class BuiltScenario:
    """Surface, ensemble and events of a scenario, checked and built once."""

    name: str  #: name of the file, for messages
    sections: Sections = attrs.field(repr=False)
    surface: BuiltSurface  #: with the quantities that depend on the largest load
    ensemble: Body
    events: Sequence[Event]  #: in time order; each fits the number of asperities

    def __attrs_post_init__(self) -> None:
        """Check that the events and the recorded indices fit the number of asperities."""
        record = self.sections.record.asperities
        with located_errors(self.name), error_path("record", "asperities"):
            if not isinstance(record, str):
                chosen_asperities(self.ensemble, (), record)
        if self.sections.loading.past == UNKNOWN:
            with located_errors(self.name), error_path("loading", "past"):
                check_bracketed(self.ensemble, self.events, self.sections.instrument)
        for event in self.events if to_loads(self.events) is None else ():
            if problem := event.problem(len(self.ensemble)):
                raise InputError(
                    f"{self.name}: loading: {event.name} at t = {event.time:g} s: {problem}"
                )

    @property
    def replay(self) -> Replay:
        """Replay of the events on the ensemble, with the options of the scenario."""
        sections = self.sections
        return Replay(
            self.ensemble,
            self.events,
            substeps=sections.loading.substeps,
            saturate=sections.loading.saturate,
            record=sections.record.asperities,
            instrument=sections.instrument,
            hold=False,
            past=sections.loading.past,
        )

    def walk(self, seconds: float) -> float | None:
        """Replay the loads for some seconds without recording; errors as for `Replay`.

        Returns the time of the last event reached [s]; None if all events were replayed.
        """
        deadline = monotonic() + seconds

        def look(cursor: "Cursor", _: object) -> None:
            if monotonic() > deadline and cursor.events < len(self.events):
                raise _EndedError(cursor.time)

        job = attrs.evolve(self.replay, substeps=1, record="totals")
        # with evolving asperities one event may take a second
        rows = WALKED_AT_ONCE if job.changes.steady else 1
        try:
            job.walk(job.recorder(StateOnly), most_rows=rows, on_event=look)
        except _EndedError as ended:
            return float(ended.args[0])
        return None

    def adhering(self) -> "AdheringAsperities | None":
        """Return the adhesion state of the asperities at the largest load.

        None without ``[adhesion]`` or without contact; InputError if ``[adhesion]`` cannot be used.
        """
        adhesion = self.sections.adhesion
        if adhesion is None:
            return None
        from historysim.asperities.adhering import adhering_asperities

        with located_errors(self.name), error_path("adhesion"):
            work = adhesion.work(self.ensemble.pair)
            approach = largest_approach(self.ensemble, self.events)
            if approach == 0:
                return None
            return adhering_asperities(
                require_asperities(self.ensemble),
                approach,
                work_of_adhesion=work,
                equilibrium_separation=adhesion.equilibrium_separation,
            )


def build_scenario(
    name: str, sections: Sections, surface: BuiltSurface, events: Sequence[Event], notify: Notify
) -> BuiltScenario:
    """Build a scenario from its surface and events; ``name`` is its file, for messages."""
    events = as_events(events)
    if surface.solutions is None and (surface.interacts or surface.ball_radius):
        surface = _surface_at_largest_load(name, sections, surface, events, notify)
    return BuiltScenario(name, sections, surface, build_ensemble(name, sections, surface), events)


def _surface_at_largest_load(
    name: str, sections: Sections, surface: BuiltSurface, events: Sequence[Event], notify: Notify
) -> BuiltSurface:
    """Add the quantities of a surface that depend on the largest load.

    These are the normal contact of a map with interaction, and the nominal area of a map on a ball:
    the Hertzian contact area of the smooth ball at that load.
    """
    load = (
        float(channel_values(events, NormalLoad).max(initial=0.0)) / sections.pair().contact_modulus
    )
    approach = float(channel_values(events, NormalDisplacement).max(initial=0.0))
    if surface.ball_radius:
        pressed = float(
            hertz.approach(load, summit_radius=surface.ball_radius, contact_modulus=1.0)
        )
        area = math.pi * surface.ball_radius * max(pressed, approach)
        if surface.summits is not None and area > 0:
            surface = attrs.evolve(surface, summits=surface.summits.with_area(area))
    if not surface.interacts or surface.surface is None:
        return surface
    from historysim.interaction.solutions import NormalSolutions

    with located_errors(name), error_path("surface", "interaction"):
        solutions = NormalSolutions.solve(
            surface.surface,
            largest_load=load,
            largest_approach=approach,
            progress=True,
            notify=notify,
        )
    for notice in solutions.notices:
        notify(f"{name}: {notice}")
    return attrs.evolve(surface, solutions=solutions)


def build_ensemble(name: str, sections: Sections, surface: BuiltSurface) -> Body:
    """Build the ensemble on a surface; errors as for `Scenario.ensemble`."""
    with located_errors(name):
        pair, friction = sections.pair(), sections.friction
        if (friction is None) == (surface.friction is None):
            both = "given both here and in surface.columns; expected one of them"
            none = "missing; expected [friction] with a coefficient, or surface.columns.friction"
            raise field_error(none if friction is None else both, "friction")
        of_scenario: Any = friction.coefficient if isinstance(friction, Coefficients) else friction
        coefficients = surface.friction if friction is None else of_scenario
        kind = _body_type(surface)
        _check_supported(kind, sections, surface)
        with error_path("surface"):
            if surface.curve is not None:
                return Patches.from_normal_curves(
                    pair, *surface.curve, coefficients, rings=sections.rings
                )
            if surface.cylinder is not None:
                radius, length, depth = surface.cylinder
                return LineContact(pair, radius, length, coefficients, depth)
            if surface.solutions is not None:
                return Ensemble.from_solutions(
                    pair, surface.solutions, coefficients, rings=sections.rings
                )
            if kind is InclinedEnsemble:
                return InclinedEnsemble.from_summits(pair, surface.summits, coefficients)
            return Ensemble.from_summits(
                pair,
                surface.summits,
                coefficients,
                wear=sections.wear,
                follow_sliding=sections.record.sliding,
                rings=sections.rings,
                yielding=surface.yielding,
                attraction=sections.attraction,
            )


def _body_type(surface: BuiltSurface) -> type[Body]:
    """Return the type of body on a surface: independent summits, summits on slopes, patches, or a cylinder."""
    if surface.cylinder is not None:
        return LineContact
    if surface.curve is not None or surface.solutions is not None:
        return Patches
    inclined = surface.summits is not None and surface.summits.slope is not None
    return InclinedEnsemble if inclined else Ensemble


def _check_supported(kind: type[Body], sections: Sections, surface: BuiltSurface) -> None:
    """Check that a type of body supports all features that the keys of a scenario request."""
    requested: dict[Feature, tuple[bool, tuple[str, ...]]] = {
        "wear": (sections.wear is not None, ("wear",)),
        "sliding": (sections.record.sliding, ("record", "sliding")),
        "friction law": (
            not isinstance(sections.friction, Coefficients | None),
            ("friction", "law"),
        ),
        "attraction": (sections.attraction is not None, ("attraction",)),
        "yielding": (surface.yielding is not None, ("surface", "yielding")),
    }
    for feature, (is_requested, place) in requested.items():
        if is_requested and feature in kind.unsupported:
            raise field_error(kind.unsupported[feature], *place)
