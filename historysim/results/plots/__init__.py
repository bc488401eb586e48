"""Pictures as functions: ``hs.plots.traction(history, steps=["A", "B"])``."""

from typing import Any

from historysim.basics.wording import nearest


def __getattr__(name: str) -> Any:
    """Return a picture by its name in `PICTURES`, with ``_`` in place of ``-``."""
    if name == "__all__":
        return __dir__()
    if name.startswith("__"):
        raise AttributeError(name)
    from historysim.results.plots.pictures import PICTURES, as_function, removal_text

    kinds = {kind.replace("-", "_"): kind for kind in PICTURES}
    if name not in kinds:
        removed = removal_text(name.replace("_", "-"))
        raise AttributeError(removed or f"there is no picture {name!r}; {nearest(name, dir())}")
    return as_function(PICTURES[kinds[name]])


def __dir__() -> list[str]:
    from historysim.results.plots.pictures import PICTURES

    return sorted(name.replace("-", "_") for name in PICTURES)
