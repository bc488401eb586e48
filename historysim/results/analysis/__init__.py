"""Questions to a history as functions of it, from the modules of this package and from others that declare some."""

import pkgutil
from typing import Any

from historysim.results.asking import earlier_names, questions

# Python looks for a module as a name first: those of this package are no questions, and need not import all of them
_MODULES = {module.name for module in pkgutil.iter_modules(__path__)}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()
    if not name.startswith("__") and name not in _MODULES:
        present = earlier_names().get(name, name)
        if present in (queries := questions()):
            return queries[present].function
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*questions()]
