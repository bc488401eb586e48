"""A scenario built: its sections read once into the surface, the ensemble and the events that everything else takes."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs

from historysim.basics.notices import Teller, silent
from historysim.basics.places import at, misfit
from historysim.basics.wording import counted, shown
from historysim.errors import InputError
from historysim.loads.events import Event, NormalDisplacement, NormalLoad
from historysim.scenario.schema import reported
from historysim.scenario.sections import Sections
from historysim.scenario.surface_kinds import BuiltSurface

if TYPE_CHECKING:
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.laws import FrictionLaw
    from historysim.replaying import Replay
    from historysim.surfaces.summits import Summits


@attrs.frozen
class BuiltScenario:
    """What a scenario describes, checked and built once."""

    sections: Sections = attrs.field(repr=False)
    name: str
    """The file's, as messages call it."""
    surface: BuiltSurface
    """As it is loaded."""
    ensemble: "Ensemble"
    events: list[Event]
    """In time order; each fits the number of asperities."""

    @property
    def replay(self) -> "Replay":
        """The replay of the events on the ensemble, as the scenario says."""
        from historysim.replaying import Replay

        loading, record = self.sections.loading, self.sections.record.asperities
        return Replay(
            self.ensemble,
            self.events,
            substeps=loading.substeps,
            saturate=loading.saturate,
            record=record,
            instrument=self.sections.instrument_in_series,
        )

    def adhering(self) -> "AdheringAsperities | None":
        """Return how adhesive the asperities are where they are pressed most.

        None without ``[adhesion]``, or where nothing touches.

        Raises InputError: an ``[adhesion]`` that cannot be used; the message names the field.
        """
        from historysim.asperities.adhering import adhering_asperities
        from historysim.recording.recorder import largest_approach

        adhesion = self.sections.adhesion
        with reported(self.name), at("adhesion"):
            if adhesion is None:
                return None
            work = adhesion.work(self.ensemble.pair)
            approach = largest_approach(self.ensemble, self.events)
            if approach == 0:
                return None
            return adhering_asperities(
                self.ensemble, approach, work_of_adhesion=work, equilibrium_separation=adhesion.equilibrium_separation
            )


def build(
    sections: Sections, name: str, surface: BuiltSurface, events: list[Event], tell: Teller = silent
) -> BuiltScenario:
    """Build a scenario from its sections, the surface as it comes, and its events.

    Raises InputError: what cannot be used, or an event that does not fit the number of asperities; the message names
    file and field.
    """
    surface = as_loaded(sections, name, surface, events, tell)
    ensemble = ensemble_on(sections, name, surface)
    for event in events:
        if problem := event.misfit(len(ensemble)):
            raise InputError(f"{name}: loading: {event.name} at t = {event.time:g} s: {problem}")
    return BuiltScenario(sections, name, surface, ensemble, events)


def as_loaded(
    sections: Sections, name: str, surface: BuiltSurface, events: Sequence[Event], tell: Teller = silent
) -> BuiltSurface:
    """Return a surface with what depends on the largest load; what is to be known of that is told.

    That is the normal contact of a map whose asperities press on one another, and the nominal area of one that lies on
    a ball: that of the smooth ball under that load, after Hertz. Any other surface is returned as it is.

    Raises InputError: a map that cannot be solved, or nothing ever touches.
    """
    if surface.solutions is not None or not (surface.interacts or surface.ball_radius):
        return surface
    modulus = sections.materials.pair().contact_modulus
    largest_load = max([0.0, *(event.value for event in events if isinstance(event, NormalLoad))]) / modulus
    largest_approach = max([0.0, *(event.value for event in events if isinstance(event, NormalDisplacement))])
    if surface.ball_radius:
        surface = attrs.evolve(surface, summits=_on_ball(surface, largest_load, largest_approach))
    if not surface.interacts or surface.surface is None:
        return surface
    from historysim.interaction.solutions import NormalSolutions

    with reported(name), at("surface", "interaction"):
        solutions = NormalSolutions.of(
            surface.surface, largest_load=largest_load, largest_approach=largest_approach, progress=True, tell=tell
        )
    for notice in solutions.notices:
        tell(f"{name}: {notice}")
    return attrs.evolve(surface, solutions=solutions)


def ensemble_on(sections: Sections, name: str, surface: BuiltSurface) -> "Ensemble":
    """Return the ensemble on a surface as it is loaded.

    Raises InputError: materials, summits or friction that cannot be used; the message names file and field.
    """
    from historysim.asperities.ensemble import Ensemble

    with reported(name):
        pair = sections.materials.pair()
        if sections.adhesion and sections.adhesion.work_of_adhesion is not None:
            with at("adhesion"):
                pair = pair.with_work_of_adhesion(sections.adhesion.work_of_adhesion)
        friction = _friction(sections, in_surface=surface.friction is not None)
        coefficients: Any = surface.friction if friction is None else friction
        if surface.curve is not None or surface.solutions is not None:
            _check_steady(sections)
        if surface.curve is not None:
            with at("surface"):
                curve = surface.curve
                ensemble = Ensemble.from_normal_curves(pair, curve.approach, curve.load, curve.area, coefficients)
        elif surface.solutions is not None:
            ensemble = Ensemble.from_solutions(pair, surface.solutions, coefficients)
        else:
            with at("surface"):
                wear = sections.wear.of if sections.wear else None
                evolving = {"wear": wear, "follow_sliding": sections.record.sliding, "yielding": surface.yielding}
                ensemble = Ensemble.from_summits(pair, surface.summits, coefficients, **evolving)
        _check_record(sections.record.asperities, len(ensemble))
    return ensemble


def _friction(sections: Sections, *, in_surface: bool) -> "float | tuple[float, ...] | FrictionLaw | None":
    friction = sections.friction
    if in_surface == (friction is not None):
        problem = (
            "given both here and in surface.columns; expected one of them"
            if in_surface
            else "missing; expected [friction] with a coefficient, or surface.columns.friction"
        )
        raise misfit(problem, "friction")
    return friction.friction if friction else None


def _check_steady(sections: Sections) -> None:
    """Check that nothing is asked for that patches of a normal curve cannot do."""
    asked = {
        ("wear",): sections.wear is not None,
        ("record", "sliding"): sections.record.sliding,
        ("friction", "law"): sections.friction is not None and sections.friction.law is not None,
    }
    for place, is_asked in asked.items():
        if is_asked:
            problem = "patches of one contact keep their shape and share one coefficient; expected independent summits"
            raise misfit(problem, *place)


def _check_record(record: str | tuple[int, ...], count: int) -> None:
    if isinstance(record, str):
        return
    if not record or len(set(record)) < len(record):
        raise misfit("expected one or more indices, each of them once", "record", "asperities")
    for position, index in enumerate(record):
        if not 0 <= index < count:
            asperities = counted(count, "asperity", "asperities")
            problem = f"{shown(index)}; expected an index from 0 to {count - 1}, since the surface has {asperities}"
            raise misfit(problem, "record", "asperities", position)


def _on_ball(surface: BuiltSurface, load: float, approach: float) -> "Summits | None":
    """Return the summits on the area of the smooth ball: by Hertz under a load over E* [m²], or at an approach [m]."""
    from historysim.contact import hertz

    radius = surface.ball_radius or 0.0
    pressed = float(hertz.approach(load, summit_radius=radius, contact_modulus=1.0))
    area = math.pi * radius * max(pressed, approach)
    return surface.summits.on_area(area) if surface.summits is not None and area > 0 else surface.summits
