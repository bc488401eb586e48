"""What events that are no loads do to the state of an ensemble."""

from typing import TYPE_CHECKING, Any

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.friction import FrictionGoal, coulomb
from historysim.asperities.instrument import Instrument
from historysim.loads.events import FrictionChange, FrictionRamp, GeometryChange

if TYPE_CHECKING:
    from historysim.asperities.state import EnsembleState


def changed(
    ensemble: Ensemble,
    state: "EnsembleState",
    change: FrictionChange | GeometryChange,
    *,
    saturate: bool,
    instrument: Instrument,
) -> "EnsembleState":
    """Return the state after a change of friction or geometry; errors as for the methods of `Ensemble`."""
    place: dict[str, Any] = {"asperities": change.asperities, "instrument": instrument}
    if isinstance(change, FrictionChange):
        return ensemble.with_friction(state, change.friction, **place)
    place |= {"summit_height": change.summit_height, "summit_radius": change.summit_radius}
    return ensemble.with_geometry(state, saturate=saturate, **place)


def friction_goal(ensemble: Ensemble, ramp: FrictionRamp | None, part: float) -> FrictionGoal | None:
    """Return where friction goes on a path that leads a part of the way to a waypoint of friction, if it does."""
    return None if ramp is None else FrictionGoal(coulomb(ramp.friction, len(ensemble)), part)
