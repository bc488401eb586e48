"""Where a history comes from: the attributes of a Dataset that say what made it, and from what."""

import json
import platform
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim._version import __version__
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import Instrument
from historysim.basics import findings
from historysim.basics.wording import counted
from historysim.loads.event_sequence import digest
from historysim.loads.events import Event
from historysim.recording import recorded_validity
from historysim.recording.recorder import largest_approach

if TYPE_CHECKING:
    import xarray as xr

CONVENTIONS = "CF-1.11, ACDD-1.3"
KEYWORDS = "friction, pre-sliding, rough surfaces, contact mechanics, hysteresis"

MADE_BY = "replay"
"""Where the encoding of a history in memory holds the `Replay` that has made it; a file holds its events itself."""


def traced(history: "xr.Dataset", job: object) -> "xr.Dataset":
    """Return a history that knows the replay that has made it."""
    history.encoding[MADE_BY] = job
    return history


def made_with() -> str:
    """Return what computes: the last bits may differ between versions, compilers and processors."""
    return f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}"


def friction_text(ensemble: Ensemble) -> str:
    """Return in a line which friction law holds at the start."""
    if ensemble.law is not None:
        elsewhere = "" if ensemble.law.same_bits else "; last bits may differ on other machines"
        return f"{ensemble.law.text}{elsewhere}"
    least, most = ensemble.friction.min(), ensemble.friction.max()
    return f"Coulomb, {least:g}" if least == most else f"Coulomb, given for each asperity, from {least:g} to {most:g}"


def _of_other_packages(ensemble: Ensemble) -> dict[str, str]:
    """Return the packages of others that computed, and their laws, whole: name, package and version, numbers."""
    laws = {"friction_law": ensemble.law, "wear_law": ensemble.wear, "yielding_law": ensemble.yielding}
    settings = {f"{name}_settings": law.told for name, law in laws.items() if law is not None}
    packages = {"packages": ", ".join(ensemble.packages)} if ensemble.packages else {}
    return packages | {name: json.dumps(each) for name, each in settings.items() if "package" in each}


def attributes(ensemble: Ensemble, events: Sequence[Event], instrument: Instrument) -> dict[str, Any]:
    """Return the attributes of a history of these events."""
    validity = recorded_validity.findings(ensemble, events, instrument, largest_approach(ensemble, events))
    in_series = {} if instrument.rigid else {"lateral_stiffness": instrument.lateral_stiffness}
    return {
        "Conventions": CONVENTIONS,
        "title": f"Load history of {counted(len(ensemble), 'asperity', 'asperities')}",
        "summary": (
            f"Loads, displacements, slip and dissipated energy of {counted(len(ensemble), 'asperity', 'asperities')} "
            f"in frictional contact along {counted(len(events), 'load event', 'load events')}."
        ),
        "keywords": KEYWORDS,
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "history": f"replayed from {counted(len(events), 'event', 'events')} by historysim {__version__}",
        "historysim_version": __version__,
        "made_with": made_with(),
        "contact_modulus": ensemble.pair.contact_modulus,
        "shear_modulus": ensemble.pair.shear_modulus,
        **in_series,
        "friction_law": friction_text(ensemble),
        **({} if ensemble.wear is None else {"wear_law": ensemble.wear.text}),
        **({} if ensemble.yielding is None else {"yielding_law": ensemble.yielding.text}),
        **_of_other_packages(ensemble),
        **({} if ensemble.nominal_area is None else {"nominal_area": ensemble.nominal_area}),
        "number_of_asperities": len(ensemble),
        "number_of_events": len(events),
        "event_digest": f"sha256:{digest(events)}",
        recorded_validity.ATTRIBUTE: findings.written(validity),
    }
