"""historysim: event-sourced load-history simulator for rough frictional contacts before they slide.

Its names are listed in the stub next to this file and imported on first use, so that importing the
package costs nothing.
"""

import importlib
from typing import Any

from historysim._version import __version__ as __version__
from historysim.basics import lazy

_PACKAGES_WITH_HISTORIES = tuple(
    f"{__name__}.{package}"
    for package in ("replaying", "log", "results", "scenario", "verbs", "studies")
)

_named, __dir__, __all__ = lazy.attach(__name__, __file__)


def __getattr__(name: str) -> Any:
    value = _named(name)
    if (getattr(value, "__module__", None) or value.__name__).startswith(_PACKAGES_WITH_HISTORIES):
        # registers the accessor history.contact
        importlib.import_module(f"{__name__}.results.register_accessor")
    return value
