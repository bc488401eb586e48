"""What stands open to other packages: kinds of things by their names, from this package and from entry points."""

import importlib
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

import attrs

from historysim.basics.wording import nearest, shown
from historysim.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T", bound=type)
OWN = "historysim"


@attrs.frozen
class Provider:
    """The package that a kind comes from."""

    package: str  #: its name; the module of a class that no installed package declares
    version: str
    declared: bool = True  #: whether an installed package declares it

    def __str__(self) -> str:
        return f"{self.package} {self.version}".rstrip()


class Registry(Mapping[str, T], Generic[T]):
    """Classes by the names that scenarios and logs call them.

    Those of this package register themselves when their modules are imported: for one name, only those that quote it
    in their source. Those of other packages are entry points of a group, read anew whenever they are asked for: nothing
    is kept, and a name of this package is never replaced.
    """

    #: The group of entry points, as ``"historysim.laws"``; the base class of all, as ``"module:Class"``; what one is
    #: called in messages; packages and modules of this package with such classes; the class variable with the name.
    def __init__(self, group: str, base: str, noun: str, *homes: str, label: str = "kind") -> None:
        self.group, self.noun, self._base, self._homes, self.label = group, noun, base, homes, label
        self._known: dict[str, T] = {}

    def register(self, kind: T) -> T:
        """Make a class known by its name, for as long as the process runs; a decorator.

        A class without a name, or with that of another class, is an InputError.
        """
        name: Any = vars(kind).get(self.label)
        if not isinstance(name, str) or not name:
            raise InputError(
                f"{kind.__name__} has {name!r} as its {self.label}; expected a name, as in {self.label} = 'my own'"
            )
        before = self._known.get(name)
        # a class that is carried out again, as in a notebook, takes the place of itself
        if before is not None and _full_name(before) != _full_name(kind):
            raise InputError(f"the {self.noun} {name!r} is {_full_name(before)} already; expected another name")
        self._known[name] = kind
        return kind

    def own(self) -> dict[str, T]:
        """Return what is registered so far, in that order."""
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
        return self._loaded(self._foreign()[name])

    def __iter__(self) -> Iterator[str]:
        self.import_own()
        yield from dict.fromkeys((*sorted(self._known), *sorted(self._foreign())))

    def __len__(self) -> int:
        """Return how many there are."""
        return sum(1 for _ in self)

    def names(self, among: type = object) -> list[str]:
        """Return the names, of subclasses of a class alone where one is given."""
        return [name for name in self if among is object or issubclass(self[name], among)]

    def named(self, name: Any, among: type = object) -> T:
        """Return the class of a name, among subclasses of a class; an unknown name is an InputError."""
        known = name in self
        if known and issubclass(found := self[name], among):
            return found
        # one that is known elsewhere is no slip of the pen
        word = "" if known or not isinstance(name, str) else name
        names = self.names(among)
        meant = [each for each in names if word.lower() in getattr(self[each], "also_called", ())]
        mend = f"did you mean {meant[0]!r}?" if meant else nearest(word, names)
        own = f"; one of your own is an entry point of {self.group!r}, see 'How to add' in historysim/README.md"
        raise InputError(f"{shown(name)}; {mend}{'' if meant or known or mend.startswith('did') else own}")

    def provider(self, kind: type) -> Provider | None:
        """Return the package that a class comes from; None of what comes with this one."""
        module = kind.__module__
        if module.split(".")[0] == OWN:
            return None
        point = self._foreign().get(getattr(kind, self.label, ""))
        if point is not None and point.dist is not None and point.module == module:
            return Provider(point.dist.name, point.dist.version)
        top = module.split(".")[0]
        return Provider(module, str(getattr(sys.modules.get(top), "__version__", "")), declared=False)

    def import_own(self, name: str | None = None) -> None:
        """Import the modules of this package where its kinds stand; for one name, those that quote it."""
        for home in self._homes:
            try:
                found = importlib.import_module(home)
            except ModuleNotFoundError as error:
                # a leaf room may be left out of the package
                if error.name and f"{home}.".startswith(f"{error.name}."):
                    continue
                raise
            for folder in getattr(found, "__path__", ()):
                for file in sorted(Path(folder).glob("[!_]*.py")):
                    if name is None or f'"{name}"' in file.read_text(encoding="utf-8"):
                        importlib.import_module(f"{home}.{file.stem}")

    def _foreign(self) -> "dict[str, EntryPoint]":
        from importlib.metadata import entry_points

        found: dict[str, EntryPoint] = {}
        for point in entry_points(group=self.group):
            other = found.setdefault(point.name, point)
            if other.value != point.value:
                packages = " and ".join(str(each.dist and each.dist.name) for each in (other, point))
                raise InputError(f"the {self.noun} {point.name!r} is declared by {packages}; uninstall one of them")
        return found

    def _loaded(self, point: "EntryPoint") -> T:
        what = f"the {self.noun} {point.name!r} of the package {point.dist.name if point.dist else '?'}"
        try:
            kind: Any = point.load()
        except Exception as error:
            raise InputError(f"{what} cannot be loaded from {point.value} ({error}); mend or update it") from error
        module, _, name = self._base.partition(":")
        base = getattr(importlib.import_module(module), name)
        if not (isinstance(kind, type) and issubclass(kind, base)) or getattr(kind, self.label, None) != point.name:
            raise InputError(
                f"{what} is {kind!r}; expected a subclass of {module}.{name} with {self.label} = {point.name!r}"
            )
        return cast("T", kind)


def _full_name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
