"""historysim: event-sourced load-history simulator for rough frictional contacts before they slide.

Its names stand in the stub beside this file, and are imported when they are first used: importing
the package costs nothing.
"""

import importlib
from typing import Any

from historysim._version import __version__ as __version__
from historysim.basics import lazy

_GIVE_OR_TAKE_HISTORIES = tuple(
    f"{__name__}.{room}" for room in ("replaying", "log", "results", "scenario", "verbs", "studies")
)

_named, __dir__, __all__ = lazy.attach(__name__, __file__)


def __getattr__(name: str) -> Any:
    value = _named(name)
    if (getattr(value, "__module__", None) or value.__name__).startswith(_GIVE_OR_TAKE_HISTORIES):
        # histories get their questions: history.contact
        importlib.import_module(f"{__name__}.results.register_accessor")
    return value
