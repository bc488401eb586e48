"""What events that are no loads do to the state of an ensemble."""

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.friction import FrictionGoal, coulomb
from historysim.loads.events import FrictionRamp


def friction_goal(ensemble: Ensemble, ramp: FrictionRamp | None, part: float) -> FrictionGoal | None:
    """Return where friction goes on a path that leads a part of the way to a waypoint of friction, if it does."""
    return None if ramp is None else FrictionGoal(coulomb(ramp.friction, len(ensemble)), part)
