"""Whether the model may be used for a history: the checks of `asperities.validity` at its greatest load."""

from collections.abc import Iterator, Sequence

from historysim.asperities import validity
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.findings import Finding
from historysim.basics.units import quantity_text
from historysim.loads.events import Event, TangentialDisplacement, TangentialLoad
from historysim.recording.recorder import largest_approach

ATTRIBUTE = "validity"
"""The attribute of a history that has its findings, as `basics.findings.written` gives them."""


def findings(
    ensemble: Ensemble, events: Sequence[Event], instrument: Instrument = RIGID, approach: float | None = None
) -> tuple[Finding, ...]:
    """Return which assumptions of the model do not hold where the asperities are pressed most.

    Those of `asperities.validity.findings`, and ``amplitude``: the greatest tangential displacement [m] or load [N]
    that is asked for, below the resolution of the instrument. `approach` is the largest one of the history [m], as
    `largest_approach` gives it; by default it is found without the compiler, which differs by no more than rounding.
    Loads that are not finite are an InputError.
    """
    approach = largest_approach(ensemble, events) if approach is None else approach
    of_contact = validity.findings(ensemble, approach, instrument)
    return of_contact + tuple(_amplitudes(events, instrument))


def _amplitudes(events: Sequence[Event], instrument: Instrument) -> Iterator[Finding]:
    for kind, name, unit, resolution in (
        (TangentialDisplacement, "displacement", "m", instrument.displacement_resolution),
        (TangentialLoad, "load", "N", instrument.load_resolution),
    ):
        amplitude = max((abs(event.value) for event in events if isinstance(event, kind)), default=0.0)
        if 0 < amplitude < resolution:
            yield Finding(
                "amplitude",
                amplitude,
                resolution,
                f"the greatest tangential {name}, {quantity_text(amplitude, unit, 3)}, is below what the instrument "
                f"resolves, {quantity_text(resolution, unit, 3)}: no instrument would see the history; move further",
            )
