"""Names of a package that are imported when they are first used, from the one list that type checkers read, too."""

import importlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

EARLIER = "# earlier places, which dir() leaves out"
_IMPORT = re.compile(r"^from (\S+) import (\S+) as (\S+)", re.MULTILINE)


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package, from its ``__name__`` and ``__file__``.

    The stub beside it has a line ``from home import name as name`` for each name; those below the line `EARLIER` are
    found but not listed.
    """
    listed, _, earlier = Path(file).with_suffix(".pyi").read_text(encoding="utf-8").partition(EARLIER)
    homes = {name: (home, there) for home, there, name in _IMPORT.findall(listed + earlier)}
    names = sorted(name for *_, name in _IMPORT.findall(listed))

    def found(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home, there = homes[name]
        module = importlib.import_module(home)
        # a module that nobody has imported yet is no attribute of its package
        return vars(module)[there] if there in vars(module) else importlib.import_module(f"{home}.{there}")

    return found, lambda: names, names
