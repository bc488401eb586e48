"""historysim: event-sourced load-history simulator for rough frictional contacts before they slide.

Names are imported when they are first used, so that importing the package costs nothing.
"""

import importlib
from typing import TYPE_CHECKING, Any

from historysim._version import __version__
from historysim.errors import FrictionLimitError, HistorySimError, InputError, LoadError

if TYPE_CHECKING:
    from historysim.asperity import Asperity as Asperity
    from historysim.asperity import SlipState as SlipState
    from historysim.contact.greenwood_williamson import GreenwoodWilliamson as GreenwoodWilliamson
    from historysim.ensemble import Ensemble as Ensemble
    from historysim.ensemble import EnsembleState as EnsembleState
    from historysim.event_log import EventLog as EventLog
    from historysim.events import FrictionChange as FrictionChange
    from historysim.events import NormalDisplacement as NormalDisplacement
    from historysim.events import NormalLoad as NormalLoad
    from historysim.events import TangentialDisplacement as TangentialDisplacement
    from historysim.events import TangentialLoad as TangentialLoad
    from historysim.instrument import Instrument as Instrument
    from historysim.materials import Material as Material
    from historysim.materials import MaterialPair as MaterialPair
    from historysim.materials import material as material
    from historysim.simulation import replay as replay
    from historysim.simulation import run as run
    from historysim.surfaces.distribution import drawn_summits as drawn_summits
    from historysim.surfaces.distribution import quantile_summits as quantile_summits
    from historysim.surfaces.heights import Surface as Surface
    from historysim.surfaces.measured import read_surface as read_surface
    from historysim.surfaces.random import random_surface as random_surface
    from historysim.surfaces.summits import Summits as Summits
    from historysim.surfaces.textured import textured_summits as textured_summits

_HOMES = {
    "asperity": ("Asperity", "SlipState"),
    "ensemble": ("Ensemble", "EnsembleState"),
    "event_log": ("EventLog",),
    "events": ("FrictionChange", "NormalDisplacement", "NormalLoad", "TangentialDisplacement", "TangentialLoad"),
    "instrument": ("Instrument",),
    "materials": ("Material", "MaterialPair", "material"),
    "simulation": ("replay", "run"),
    "contact.greenwood_williamson": ("GreenwoodWilliamson",),
    "surfaces.distribution": ("drawn_summits", "quantile_summits"),
    "surfaces.heights": ("Surface",),
    "surfaces.measured": ("read_surface",),
    "surfaces.random": ("random_surface",),
    "surfaces.summits": ("Summits",),
    "surfaces.textured": ("textured_summits",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [  # noqa: PLE0604 - the names of _HOMES are texts, which the linter cannot see
    "FrictionLimitError",
    "HistorySimError",
    "InputError",
    "LoadError",
    "__version__",
    *_HOME_OF,
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
