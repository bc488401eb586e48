"""The contact as a system of python-control, with inputs and outputs, that is interconnected with others."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError

if TYPE_CHECKING:
    import control

    from historysim.asperities.ensemble import Ensemble
    from historysim.asperities.state import EnsembleState

INPUTS = ("normal_load", "normal_displacement", "tangential_load", "tangential_displacement")
OUTPUTS = (
    "normal_load",
    "tangential_load",
    "approach",
    "tangential_displacement",
    "tangential_stiffness",
    "normal_stiffness",
    "contact_count",
    "slip_share",
    "dissipated_energy",
)


def contact_system(
    ensemble: "Ensemble",
    state: "EnsembleState | None" = None,
    *,
    dt: float,
    inputs: Sequence[str] = ("tangential_displacement",),
    outputs: Sequence[str] = ("tangential_load",),
    name: str = "contact",
    saturate: bool = False,
    instrument: Instrument = RIGID,
) -> "control.NonlinearIOSystem":
    """Return a contact as a discrete-time system of python-control.

    At each sample the contact goes straight to its inputs, and its outputs are those there (direct feedthrough). What
    it remembers is no vector of numbers: the one state of the system is the number of the sample, and outputs that are
    asked for more than once in a sample, as interconnected systems are, are tried from the state at its beginning.

    Parameters
    ----------
    ensemble : Ensemble
    state : EnsembleState, optional
        The contact at the beginning; the unloaded one by default.
    dt : float
        Sampling time [s].
    inputs : sequence of str
        What drives it, of `INPUTS`, at most one of each channel; the other channel is held as `state` has it.
    outputs : sequence of str
        What is read, of `OUTPUTS`.
    name : str
        Of the system; its signals are ``name.signal``.
    saturate, instrument
        As for `Ensemble.advance`.

    Returns
    -------
    control.NonlinearIOSystem
        Each simulation begins at 0, with `state`.

    Raises
    ------
    InputError
        Signals that a contact does not have, both of one channel, a sampling time that is not positive, or
        python-control is not installed.
    """
    try:
        import control
    except ImportError as error:
        raise InputError("the package control is not installed; expected: pip install control") from error
    for named, known, what in ((inputs, INPUTS, "inputs"), (outputs, OUTPUTS, "outputs")):
        if wrong := [each for each in named if each not in known] or not named:
            raise InputError(f"{what}: {wrong if named else 'none'}; expected some of {', '.join(known)}")
    for channel in ("normal", "tangential"):
        if sum(each.startswith(channel) for each in inputs) > 1:
            raise InputError(f"inputs: both load and displacement of the {channel} channel; expected one of them")
    given: dict[str, Any] = {"saturate": saturate, "instrument": instrument}
    start = state or ensemble.initial_state()
    sampled = _SampledContact(ensemble, start, inputs=tuple(inputs), outputs=tuple(outputs), given=given)
    return control.nlsys(
        sampled.update,
        sampled.output,
        inputs=list(inputs),
        outputs=list(outputs),
        states=["sample"],
        dt=scalar("dt", dt, above=0),
        name=name,
    )


class _SampledContact:
    """A contact whose state is found by the number of a sample: the first one, the present, and the one before."""

    def __init__(
        self,
        ensemble: "Ensemble",
        state: "EnsembleState",
        *,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...],
        given: dict[str, Any],
    ) -> None:
        self.ensemble, self.inputs, self.outputs, self.given = ensemble, inputs, outputs, given
        self.states = {0: state}

    def output(self, _time: float, x: npt.ArrayLike, u: npt.ArrayLike, _params: object) -> Floats:
        """Return the outputs of a trial from the state at the beginning of the sample."""
        moved = self._moved(self._number(x), u)
        return np.array([float(getattr(moved, name)) for name in self.outputs])

    def update(self, _time: float, x: npt.ArrayLike, u: npt.ArrayLike, _params: object) -> Floats:
        """Commit what the inputs of a sample do, and return the number of the next one."""
        number = self._number(x)
        after = self._moved(number, u)
        self.states = {0: self.states[0], number: self.states[number], number + 1: after}
        return np.array([float(number + 1)])

    def _moved(self, number: int, u: npt.ArrayLike) -> "EnsembleState":
        targets: dict[str, Any] = dict(zip(self.inputs, np.atleast_1d(u).astype(float).tolist(), strict=True))
        return self.ensemble.advance(self.states[number], **targets, **self.given)

    def _number(self, x: npt.ArrayLike) -> int:
        number = float(np.atleast_1d(x)[0])
        if number not in self.states:
            raise InputError(
                f"sample {number:g} of the contact: expected the present one of a simulation that begins at 0. It "
                "remembers its way and has no state to set or to linearise at; its tangential_stiffness is an output"
            )
        return int(number)
