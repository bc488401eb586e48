"""Queries of a history as functions, from the modules of this package and from others that declare some."""

import pkgutil
from typing import Any

from historysim.results.queries import all_queries, earlier_names

# Python looks up modules as names first: those of this package are not queries and need no import
# of all queries
_MODULES = {module.name for module in pkgutil.iter_modules(__path__)}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()
    if not name.startswith("__") and name not in _MODULES:
        present = earlier_names().get(name, name)
        if present in (queries := all_queries()):
            return queries[present].function
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*all_queries()]
