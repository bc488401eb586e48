"""A stage on a rough contact under a sampled controller, as in a positioning system."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.state import EnsembleState


@attrs.frozen(eq=False)
class StageMotion:
    """How a stage has moved.

    Attributes
    ----------
    time : array (sample)
        Of the samples, at which the controller was asked [s].
    place, contact_force, motor_force : array (sample)
        Place of the stage [m] and tangential load of the contact [N] at the end of each sample, and the force that the
        motor had during it [N].
    work : float
        Of the motor [J].
    kinetic, stored, dissipated : float
        Energies at the end [J]: of the motion, in the tractions, and lost to friction since the beginning.
    state : EnsembleState
        The contact at the end.
    """

    time: Floats
    place: Floats
    contact_force: Floats
    motor_force: Floats
    work: float
    kinetic: float
    stored: float
    dissipated: float
    state: "EnsembleState"


def controlled_stage(  # noqa: PLR0913 - a stage, its controller, and its contact
    ensemble: "Ensemble",
    state: "EnsembleState",
    controller: Callable[[float, float], float],
    *,
    mass: float,
    sample_time: float,
    duration: float,
    substeps: int = 10,
    saturate: bool = False,
    instrument: Instrument = RIGID,
) -> StageMotion:
    """Move a stage on a contact by a motor whose force a controller sets at each sample.

    The stage begins at rest where `state` is, which is place 0. Between samples it is integrated by the leap-frog
    method, whose one force per step is that of the contact carried to the new place: nothing is tried, and all places
    are ones that the stage was at.

    Parameters
    ----------
    ensemble : Ensemble
    state : EnsembleState
        The contact at the beginning, pressed. Its normal channel is held as it is: a load, or an approach.
    controller : callable
        ``controller(time, place)`` returns the force of the motor [N] until the next sample; it is called once for each
        sample, in their order, so it may remember, too.
    mass : float
        Of the stage [kg].
    sample_time, duration : float
        [s].
    substeps : int
        Steps of the integration per sample, each much shorter than √(mass / stiffness).
    saturate, instrument
        As for `Ensemble.advance`.

    Returns
    -------
    StageMotion

    Raises
    ------
    InputError
        Numbers that are not positive, steps too long to be stable, or a force that is no number.
    """
    mass, sample_time = scalar("mass", mass, above=0), scalar("sample_time", sample_time, above=0)
    samples = round(scalar("duration", duration, above=0) / sample_time)
    if isinstance(substeps, bool) or not isinstance(substeps, int) or substeps < 1:
        raise InputError(f"substeps is {substeps!r}; expected a whole number of 1 or more")
    pause = sample_time / substeps
    longest = 2.0 * (mass / state.stiffness(1)) ** 0.5 if state.stiffness(1) > 0.0 else np.inf
    if pause >= longest:
        raise InputError(
            f"substeps is {substeps}: steps of {pause:.3g} s are unstable, as the mass on the contact swings faster; "
            f"expected {int(sample_time / longest) + 1} or more, and ten times that to follow it well"
        )
    stepper = ensemble.stepper(state, saturate=saturate, instrument=instrument)
    origin = stepper.tangential_displacement
    before = stepper.dissipated_energy
    place = velocity = work = motor = 0.0
    record = np.empty((3, samples))
    for sample in range(samples):
        motor = scalar("the force of the controller", controller(sample * sample_time, place))
        for _ in range(substeps):
            velocity += pause / mass * (motor - stepper.tangential_load)
            step = pause * velocity
            place += step
            work += motor * step
            stepper.step(tangential_displacement=origin + place)
        record[:, sample] = place, stepper.tangential_load, motor
    end = stepper.save()
    # the velocity is that of half a step before
    velocity += 0.5 * pause / mass * (motor - end.tangential_load)
    return StageMotion(
        time=np.arange(samples, dtype=np.float64) * sample_time,
        place=record[0],
        contact_force=record[1],
        motor_force=record[2],
        work=work,
        kinetic=0.5 * mass * velocity**2,
        stored=end.stored_energy,
        dissipated=end.dissipated_energy - before,
        state=end,
    )
