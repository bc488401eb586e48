"""The kinds of ``[loading]`` in a scenario: waypoints, blocks of them, or a measured file, and the events they make."""

from cattrs import Converter

from historysim.errors import InputError
from historysim.scenario.loading_kinds.channels import channel_hooks
from historysim.scenario.loading_kinds.from_file import MeasuredLoading
from historysim.scenario.loading_kinds.loading_kind import LOADINGS, Loading
from historysim.scenario.loading_kinds.written import Blocks, Waypoints, waypoint_hooks
from historysim.scenario.schema import kind_from_toml, table

__all__ = [
    "LOADINGS",
    "Blocks",
    "Loading",
    "MeasuredLoading",
    "Waypoints",
    "channel_hooks",
    "loading_from_toml",
    "waypoint_hooks",
]

NAMED_BY_A_KEY = (Waypoints.kind, Blocks.kind, MeasuredLoading.kind)
"""Kinds whose name is a key of their own, so that no ``kind`` is needed."""


def loading_from_toml(converter: Converter, value: object, _: object) -> Loading:
    """Return the loading that ``[loading]`` says.

    Raises InputError: not exactly one kind of loading, or keys that do not fit it.
    """
    entry = table(value)
    given = [key for key in NAMED_BY_A_KEY if key in entry]
    if "kind" not in entry and len(given) != 1:
        came = " and ".join(given) or ", ".join(repr(key) for key in entry) or "nothing"
        others = ", ".join(name for name in LOADINGS if name not in NAMED_BY_A_KEY)
        more = f", or kind, one of {others}" if others else ""
        raise InputError(f"{came} given; expected exactly one of waypoints, blocks and file{more}")
    loading: Loading = kind_from_toml(converter, {"kind": given[0], **entry} if given else entry, LOADINGS)
    return loading
