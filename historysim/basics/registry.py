"""Registries of classes by name, from this package and from entry points of other packages."""

import functools
import importlib
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

import attrs

from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

T = TypeVar("T", bound=type)
OWN = "historysim"
_QUOTED = re.compile(r'"(?=([^"\n]+)")')  # also where quotation marks overlap


@attrs.frozen
class Provider:
    """Package that provides a class."""

    package: str  #: name of the package; the module of a class that no installed package declares
    version: str
    declared: bool = True  #: True if an installed package declares the class

    def __str__(self) -> str:
        return f"{self.package} {self.version}".rstrip()


class Registry(Mapping[str, T], Generic[T]):
    """Classes by their names in scenarios and logs.

    Classes of this package are registered when their modules are imported: a lookup of one name
    imports only modules that contain it in quotes. Classes of other packages are entry points of a
    group; they never replace a name of this package.
    """

    #: Group of entry points, as ``"historysim.laws"``; common base class, as ``"module:Class"``;
    #: noun in messages; packages and modules of this package with such classes; class variable that
    #: holds the name.
    def __init__(self, group: str, base: str, noun: str, *homes: str, label: str = "kind") -> None:
        self.group, self.noun, self._base, self._homes, self.label = group, noun, base, homes, label
        self._known: dict[str, T] = {}

    def register(self, kind: T) -> T:
        """Register a class by its name for the lifetime of the process; a decorator.

        InputError if the class has no name, or the name of another class.
        """
        name: Any = vars(kind).get(self.label)
        if not isinstance(name, str) or not name:
            raise InputError(
                f"{kind.__name__} has {name!r} as its {self.label}; expected a name, as in {self.label} = 'my own'"
            )
        registered = self._known.get(name)
        # a class definition that is executed again, as in a notebook, replaces the earlier one
        if registered is not None and _full_name(registered) != _full_name(kind):
            raise InputError(
                f"the {self.noun} {name!r} is {_full_name(registered)} already; expected another name"
            )
        self._known[name] = kind
        return kind

    def own(self) -> dict[str, T]:
        """Return the classes registered so far by name, in order of registration."""
        return dict(self._known)

    def forget(self, name: str) -> None:
        """Undo `register`."""
        self._known.pop(name, None)

    def __getitem__(self, name: str) -> T:
        if not isinstance(name, str):
            raise KeyError(name)
        if name not in self._known:
            self.import_own(name)
        if name in self._known:
            return self._known[name]
        return self._load_entry_point(self._foreign()[name])

    def __iter__(self) -> Iterator[str]:
        self.import_own()
        yield from dict.fromkeys((*sorted(self._known), *sorted(self._foreign())))

    def __len__(self) -> int:
        """Return the number of classes."""
        return sum(1 for _ in self)

    def names(self, among: type = object) -> list[str]:
        """Return the names of all classes, or of the subclasses of a class."""
        return [name for name in self if among is object or issubclass(self[name], among)]

    def lookup(self, name: Any, among: type = object) -> T:
        """Look up a class by its name among the subclasses of a class; InputError for an unknown name."""
        is_known = name in self
        if is_known and issubclass(member := self[name], among):
            return member
        # a name of another subclass is not a misspelling
        word = "" if is_known or not isinstance(name, str) else name
        names = self.names(among)
        matches = [
            candidate
            for candidate in names
            if word.lower() in getattr(self[candidate], "also_called", ())
        ]
        remedy = f"did you mean {matches[0]!r}?" if matches else nearest(word, names)
        entry_point_hint = (
            f"; one of your own is an entry point of {self.group!r}, "
            "see 'How to add' in historysim/README.md"
        )
        hint = "" if matches or is_known or remedy.startswith("did") else entry_point_hint
        raise InputError(f"{format_value(name)}; {remedy}{hint}")

    def provider(self, kind: type) -> Provider | None:
        """Return the package that provides a class; None for a class of this package."""
        module = kind.__module__
        if module.split(".")[0] == OWN:
            return None
        point = self._foreign().get(getattr(kind, self.label, ""))
        if point is not None and point.dist is not None and point.module == module:
            return Provider(point.dist.name, point.dist.version)
        top = module.split(".")[0]
        return Provider(
            module, str(getattr(sys.modules.get(top), "__version__", "")), declared=False
        )

    def import_own(self, name: str | None = None) -> None:
        """Import the modules of this package that register classes; for one name, modules that contain it in quotes."""
        for home in self._homes:
            try:
                module = importlib.import_module(home)
            except ModuleNotFoundError as error:
                # a leaf package may be missing from an installation
                if error.name and f"{home}.".startswith(f"{error.name}."):
                    continue
                raise
            for folder in getattr(module, "__path__", ()):
                for file, strings in _quoted_strings(folder).items():
                    if name is None or name in strings:
                        importlib.import_module(f"{home}.{file}")

    def _foreign(self) -> "dict[str, EntryPoint]":
        points: dict[str, EntryPoint] = {}
        for point in _entry_points(self.group, _search_path()):
            registered = points.setdefault(point.name, point)
            if registered.value != point.value:
                packages = " and ".join(
                    str(declared.dist and declared.dist.name) for declared in (registered, point)
                )
                raise InputError(
                    f"the {self.noun} {point.name!r} is declared by {packages}; uninstall one of them"
                )
        return points

    def _load_entry_point(self, point: "EntryPoint") -> T:
        subject = f"the {self.noun} {point.name!r} of the package {point.dist.name if point.dist else '?'}"
        try:
            kind: Any = point.load()
        except Exception as error:
            raise InputError(
                f"{subject} cannot be loaded from {point.value} ({error}); repair or update it"
            ) from error
        module, _, name = self._base.partition(":")
        base = getattr(importlib.import_module(module), name)
        if (
            not (isinstance(kind, type) and issubclass(kind, base))
            or getattr(kind, self.label, None) != point.name
        ):
            raise InputError(
                f"{subject} is {kind!r}; expected a subclass of {module}.{name} with {self.label} = {point.name!r}"
            )
        return cast("T", kind)


@functools.cache
def _quoted_strings(folder: str) -> dict[str, set[str]]:
    """Return the strings in double quotes of each module in a folder, by the names of the modules."""
    return {
        file.stem: {*_QUOTED.findall(file.read_text(encoding="utf-8"))}
        for file in sorted(Path(folder).glob("[!_]*.py"))
    }


def _search_path() -> tuple[tuple[str, int], ...]:
    """Return the folders of packages and the times at which packages were last added or removed [ns]."""
    folders = [Path(folder) for folder in sys.path]
    return tuple((str(folder), folder.stat().st_mtime_ns) for folder in folders if folder.exists())


@functools.cache
def _entry_points(group: str, path: tuple[tuple[str, int], ...]) -> "EntryPoints":  # noqa: ARG001 - its packages
    """Return the entry points of a group that the packages on a search path declare."""
    from importlib.metadata import entry_points

    return entry_points(group=group)


def _full_name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
