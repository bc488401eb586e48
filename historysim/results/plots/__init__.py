"""Pictures as functions: ``hs.plots.traction(history, steps=["A", "B"])``."""

import importlib
from typing import Any

from historysim.basics.wording import nearest


def __getattr__(name: str) -> Any:
    """Return a moving picture, or a picture by its name in `PICTURES`, with ``_`` in place of ``-``."""
    if name == "__all__":
        return __dir__()
    if name.startswith("__"):
        raise AttributeError(name)
    if name in MOVING:
        # who asks for another picture does not import the engine
        return getattr(importlib.import_module("historysim.results.plots.contact_maps"), name)
    from historysim.results.plots.pictures import PICTURES, as_function

    kinds = {each.replace("-", "_"): each for each in PICTURES}
    if name not in kinds:
        raise AttributeError(f"there is no picture {name!r}; {nearest(name, dir())}")
    return as_function(PICTURES[kinds[name]])


MOVING = ("animate_contact_map", "save_animation")


def __dir__() -> list[str]:
    from historysim.results.plots.pictures import PICTURES

    return sorted([*(each.replace("-", "_") for each in PICTURES), *MOVING])
