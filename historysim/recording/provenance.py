"""Attributes of a result: software, laws, digest of the events, violated assumptions, and names of states."""

import json
import math
import platform
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim._version import __version__
from historysim.asperities import validity
from historysim.asperities.body import Body
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.law import FrictionLaw
from historysim.basics.arguments import NAMED_STATES
from historysim.basics.units import quantity_text
from historysim.basics.wording import Finding, count_text, written_findings
from historysim.loads.event_sequence import channel_values, digest
from historysim.loads.events import Event, LoadEvent, TangentialDisplacement, TangentialLoad
from historysim.loads.schedule import changes_geometry
from historysim.recording.recorder import UNTOUCHED, largest_approach

if TYPE_CHECKING:
    from historysim.recording.unknown_past import Bounds

CONVENTIONS = "CF-1.11, ACDD-1.3"
KEYWORDS = "friction, pre-sliding, rough surfaces, contact mechanics, hysteresis"

# Key of the encoding of a history in memory for the `Replay` that has made it; a file holds its
# events itself.
MADE_BY = "replay"
# change of a slope as its spheres move past each other, up to which it is taken as kept
MOST_TURN = 5e-3
# Attributes of a history: findings as JSON (`basics.written_findings`), and a JSON object of times
# [s] by name.
VALIDITY = "validity"


def made_with() -> str:
    """Return Python, NumPy and processor, which may change the last bits."""
    return f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}"


def _laws(ensemble: Body) -> dict[str, str]:
    """Describe the laws, one line each; laws of other packages also with their settings and versions."""
    minimum, maximum = ensemble.friction.min(), ensemble.friction.max()
    texts = {
        "friction_law": f"Coulomb, {minimum:g}"
        if minimum == maximum
        else f"Coulomb, of each, from {minimum:g} to {maximum:g}"
    }
    for kind, law in ensemble.laws.items():
        name, elsewhere = f"{kind}_law", isinstance(law, FrictionLaw) and not law.same_bits
        texts[name] = f"{law.text}{'; last bits may differ on other machines' if elsewhere else ''}"
        if "package" in law.described:
            texts |= {
                "packages": ", ".join(ensemble.packages),
                f"{name}_settings": json.dumps(law.described),
            }
    return texts


def attributes(ensemble: Body, events: Sequence[Event], instrument: Instrument) -> dict[str, Any]:
    """Return the attributes of a history of these events."""
    asperities, loads = (
        count_text(len(ensemble), "asperity", "asperities"),
        count_text(len(events), "event", "events"),
    )
    optional = {
        "lateral_stiffness": None if instrument.rigid else instrument.lateral_stiffness,
        "parallel_stiffness": instrument.parallel_stiffness or None,
        "nominal_area": ensemble.settings.get("nominal_area"),
        **{f"line_{name}": size for name, size in ensemble.settings.get("line", {}).items()},
    }
    return {
        "Conventions": CONVENTIONS,
        "title": f"Load history of {asperities}",
        "summary": f"Loads, displacements, slip and dissipated energy of {asperities} in frictional contact along "
        f"{count_text(len(events), 'load event', 'load events')}.",
        "keywords": KEYWORDS,
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "history": f"replayed from {loads} by historysim {__version__}",
        "historysim_version": __version__,
        "made_with": made_with(),
        "contact_modulus": ensemble.pair.contact_modulus,
        "shear_modulus": ensemble.pair.shear_modulus,
        **_laws(ensemble),
        **{name: value for name, value in optional.items() if value is not None},
        "number_of_asperities": len(ensemble),
        "number_of_events": len(events),
        "event_digest": f"sha256:{digest(events)}",
        VALIDITY: written_findings(validity_findings(ensemble, events, instrument)),
    }


def validity_findings(
    ensemble: Body,
    events: Sequence[Event],
    instrument: Instrument = RIGID,
    approach: float | None = None,
) -> tuple[Finding, ...]:
    """Return the assumptions of the model that are violated at the largest loads of asperities.

    They combine `asperities.validity.findings` and the functions below. `approach` is the largest
    one of the history [m]; computed by default.
    """
    approach = largest_approach(ensemble, events) if approach is None else approach
    of_contact = validity.findings(ensemble, approach, instrument)
    of_events = (
        *_amplitudes(events, instrument),
        *_never_touches(events, approach),
        *_turning(ensemble, events, approach),
    )
    return of_contact + of_events


def warn_of_no_contact(ensemble: Body, events: Sequence[Event]) -> None:
    """Warn (three calls up) if tangential events move a contact that never touches."""
    for finding in _never_touches(events, largest_approach(ensemble, events)):
        warnings.warn(finding.text, stacklevel=3)


def _never_touches(events: Sequence[Event], approach: float) -> Iterator[Finding]:
    moves = any(_largest(events, kind) for kind in (TangentialDisplacement, TangentialLoad))
    if moves and not approach > 0 and not changes_geometry(events):
        yield Finding(
            "contact",
            approach,
            0.0,
            "nothing ever touches: no normal load presses, and before its first event a contact is unloaded; all loads "
            "are 0. Give a normal load, or a normal displacement above 0, before the tangential motion",
        )


def _largest(events: Sequence[Event], kind: type[LoadEvent]) -> float:
    """Return the largest magnitude of the values of tangential events of one type; 0 without such events."""
    values = np.nan_to_num(channel_values(events, kind))
    sizes = np.linalg.norm(values, axis=-1) if values.ndim > 1 else np.abs(values)
    return float(sizes.max(initial=0.0))


def _turning(ensemble: Body, events: Sequence[Event], approach: float) -> Iterator[Finding]:
    touching = ensemble.first_touch < approach
    if "slope" not in ensemble.coordinates or not touching.any():
        return
    amplitude = _largest(events, TangentialDisplacement)
    # the centres of two spheres are four radii of their contact apart, or more
    turn = amplitude / (4 * float(ensemble.coordinates["summit_radius"][touching].min()))
    if turn > MOST_TURN:
        moved = quantity_text(amplitude, "m", 3)
        text = f"the contact moves by {moved}, which would turn slopes, kept here, by up to {turn:.2g}: move less"
        yield Finding("turning", turn, MOST_TURN, text)


def _amplitudes(events: Sequence[Event], instrument: Instrument) -> Iterator[Finding]:
    for kind, name, unit, resolution in (
        (TangentialDisplacement, "displacement", "m", instrument.displacement_resolution),
        (TangentialLoad, "load", "N", instrument.load_resolution),
    ):
        amplitude = _largest(events, kind)
        if 0 < amplitude < resolution:
            reached, resolved = (quantity_text(value, unit, 3) for value in (amplitude, resolution))
            text = f"the greatest tangential {name}, {reached}, is below what the instrument resolves, {resolved}: no "
            yield Finding(
                "amplitude",
                amplitude,
                resolution,
                text + "instrument would see the history; move further",
            )


def named_states_attribute(times: Mapping[str, float]) -> dict[str, str]:
    """Return the attribute with names and times of states; empty without names."""
    return {NAMED_STATES: json.dumps(dict(times), ensure_ascii=False)} if times else {}


def find_bounds(job: Any, until: float = math.inf) -> "Bounds | None":  # noqa: ANN401 - a Replay, below
    """Return the bounds of an unknown past, which are not computed yet; None if it is untouched."""
    if job.past == UNTOUCHED:
        return None
    from historysim.recording.unknown_past import Bounds

    return Bounds(job, until)
