"""Lazy imports of the public names of a package, from the stub file that type checkers read."""

import importlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

EARLIER = "# earlier places, which dir() leaves out"
_IMPORT = re.compile(r"^from (\S+) import (\S+) as (\S+)", re.MULTILINE)


def attach(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` for a package with this ``__name__`` and ``__file__``.

    The stub file of the package has a line ``from home import name as name`` for each name; names
    below the line `EARLIER` can be imported but are not listed.
    """
    listed, _, earlier = (
        Path(file).with_suffix(".pyi").read_text(encoding="utf-8").partition(EARLIER)
    )
    homes = {name: (home, original) for home, original, name in _IMPORT.findall(listed + earlier)}
    names = sorted(name for *_, name in _IMPORT.findall(listed))

    def found(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home, original = homes[name]
        module = importlib.import_module(home)
        # a module that has not been imported yet is not an attribute of its package
        return (
            vars(module)[original]
            if original in vars(module)
            else importlib.import_module(f"{home}.{original}")
        )

    return found, lambda: names, names
