"""The kinds of ``[loading]`` in a scenario: waypoints, blocks of them, or a measured file, and the events they make."""

from collections.abc import Mapping

from cattrs import Converter

from historysim.errors import InputError
from historysim.scenario.loading_kinds.channels import channel_hooks
from historysim.scenario.loading_kinds.from_file import MeasuredLoading
from historysim.scenario.loading_kinds.written import Blocks, Waypoints
from historysim.scenario.schema import table

__all__ = [
    "LOADINGS",
    "AnyLoading",
    "Blocks",
    "MeasuredLoading",
    "Waypoints",
    "channel_hooks",
    "loading_from_toml",
]

AnyLoading = Waypoints | Blocks | MeasuredLoading
LOADINGS: Mapping[str, type] = {"waypoints": Waypoints, "blocks": Blocks, "file": MeasuredLoading}


def loading_from_toml(converter: Converter, value: object, _: object) -> AnyLoading:
    """Return the loading that ``[loading]`` says.

    Raises
    ------
    InputError
        Not exactly one kind of loading, or keys that do not fit it.
    """
    entry = table(value)
    given = [key for key in LOADINGS if key in entry]
    if len(given) != 1:
        found = " and ".join(given) or ", ".join(repr(key) for key in entry) or "nothing"
        raise InputError(f"{found} given; expected exactly one of waypoints, blocks and file")
    loading: AnyLoading = converter.structure(entry, LOADINGS[given[0]])
    return loading
