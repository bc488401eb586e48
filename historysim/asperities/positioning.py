"""What a controller sees when the normal load of a contact at rest is changed."""

import attrs

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.state import EnsembleState


@attrs.frozen
class Disturbance:
    """What a change of the normal load at rest does to the tangential channel.

    Attributes
    ----------
    tangential_load : float
        Change of the tangential load while the drive is held [N].
    tangential_displacement : float
        Change of the displacement of the drive while the tangential load is held [m]; that of the contact, since the
        held load bends the instrument as before.
    """

    tangential_load: float
    tangential_displacement: float


def disturbance_at_rest(
    ensemble: Ensemble, state: EnsembleState, normal_load: float, *, instrument: Instrument = RIGID
) -> Disturbance:
    """Return what a controller sees when the normal load of a contact at rest changes; ``state`` itself does not.

    A rise is not seen, since what touches anew is not strained. Where the load falls the strain of what it lets go
    is lost: a held position needs less force, a held force moves the contact on.

    Parameters
    ----------
    ensemble : Ensemble
    state : EnsembleState
        Where it rests.
    normal_load : float
        Total normal load that is reached [N], 0 or more.
    instrument : Instrument, optional
        Between the drive and the contact.

    Raises
    ------
    FrictionLimitError
        The contact no longer holds its tangential load at the new normal load.
    InputError
        A normal load that is not a finite number of 0 or more.
    """
    load, displacement = state.tangential_load, state.tangential_displacement
    drive = instrument.drive_displacement(displacement, load)
    held = ensemble.advance(state, normal_load=normal_load, tangential_displacement=drive, instrument=instrument)
    pushed = ensemble.advance(state, normal_load=normal_load, tangential_load=load)
    return Disturbance(held.tangential_load - load, pushed.tangential_displacement - displacement)
