"""Registries that other packages may extend, by name."""

from collections.abc import Mapping
from typing import Any

from historysim.basics.fields import about, list_fields
from historysim.basics.registry import Registry
from historysim.basics.wording import Lines, nearest
from historysim.errors import InputError


def registries() -> Mapping[str, Registry[Any]]:
    """Return the registries by the last word of their group of entry points."""
    from historysim.asperities.law import ATTRACTIONS, LAWS, WEAR_LAWS, YIELDING_LAWS
    from historysim.loads.events import EVENTS
    from historysim.results.plots.pictures import PICTURES
    from historysim.results.result_files import FILES
    from historysim.scenario.loading_kinds import LOADINGS
    from historysim.scenario.surface_kinds import SURFACES
    from historysim.surfaces.preparation import PREPARATIONS
    from historysim.surfaces.reading import read_surface  # noqa: F401 - registers the readers of height maps
    from historysim.tables.readers import READERS

    all_registries = (
        LAWS,
        ATTRACTIONS,
        WEAR_LAWS,
        YIELDING_LAWS,
        EVENTS,
        SURFACES,
        PREPARATIONS,
        LOADINGS,
        READERS,
        FILES,
        PICTURES,
    )
    return {registry.group.rpartition(".")[2]: registry for registry in all_registries}


def kinds(what: str | None = None, name: str | None = None) -> Lines:
    """Return lines of (name, text): all groups, the kinds of one group such as ``"laws"``, or the keys of one kind.

    Raises InputError: an unknown group or kind.
    """
    groups = registries()
    if what is None:
        return Lines(
            (group, ", ".join(_list_kinds(registry))) for group, registry in groups.items()
        )
    if what not in groups:
        raise InputError(f"{what!r} is not a group of kinds; {nearest(what, groups)}")
    registry = groups[what]
    if name is None:
        return Lines(
            (listed, _line(registry, kind)) for listed, kind in _list_kinds(registry).items()
        )
    kind = registry.lookup(name)
    fields = [
        (field.name, field.text.removeprefix(field.name).strip()) for field in list_fields(kind)
    ]
    return Lines([(name, _line(registry, kind)), *fields])


def _list_kinds(registry: Registry[Any]) -> dict[str, Any]:
    """Return the kinds that a user selects by name: not the pictures of one type only."""
    is_listed = {name: getattr(kind, "is_listed", None) for name, kind in registry.items()}
    return {name: registry[name] for name, check in is_listed.items() if check is None or check()}


def _line(registry: Registry[Any], kind: type) -> str:
    provider = registry.provider(kind)
    return about(kind) + ("" if provider is None else f" [{provider}]")
