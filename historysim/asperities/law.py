"""What laws of friction, wear and yielding have in common: a name, numbers, and how they are written down."""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import attrs

from historysim.basics.registry import Registry
from historysim.errors import InputError, MissingPackageError


class Law(abc.ABC):
    """A law as a value: its numbers are its fields."""

    __slots__ = ()

    registry: ClassVar[Registry[Any]]  #: all laws of its sort by their names
    kind: ClassVar[str]  #: its name in scenarios and logs
    library_kind: ClassVar[str | None] = None  #: its name in the C library; None of a law of your own

    @property
    @abc.abstractmethod
    def text(self) -> str:
        """The law in a line: what is chosen, and where it comes from."""

    @property
    def described(self) -> dict[str, Any]:
        """Its name as ``law``, its numbers, and of a foreign one the package that it comes from."""
        numbers, origin = self.numbers, self.registry.provider(type(self))
        package = {} if origin is None else {"package": [origin.package, origin.version]}
        return {"law": numbers.pop("law"), **package, **numbers}

    @property
    def numbers(self) -> dict[str, Any]:
        """Its name as ``law``, and its numbers."""
        value: Any = self
        numbers = attrs.asdict(value, filter=lambda _, number: number is not None) if attrs.has(type(self)) else {}
        each = {key: list(number) if isinstance(number, tuple) else number for key, number in numbers.items()}
        return {"law": self.kind, **each}

    @property
    def settings(self) -> dict[str, Any]:
        """`described`, of a law that `from_settings` can read again; of another one an InputError."""
        laws = self.registry
        if laws.get(self.kind) is not type(self) or not attrs.has(type(self)):
            raise InputError(
                f"the {laws.noun} {self.kind!r} cannot be written down: {type(self).__name__} is not known by that "
                "name; expected a class below @register and @attrs.frozen, or one that its package declares in "
                f"{laws.group}"
            )
        return self.described

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """Return the law of `settings`; InputError for a name, a package or numbers that no law has."""
        laws, given = cls.registry, dict(settings)
        kind, package = given.pop("law", None), " ".join(map(str, given.pop("package", ()))).rstrip()
        if package and kind not in laws:
            raise MissingPackageError(
                f"the {laws.noun} {kind!r} is of {package}, which is not there; install that package, or where it is "
                "a module of your own, import it first"
            )
        law = laws.named(kind)
        try:
            made: Self = law(**given)
        except TypeError as error:
            here = laws.provider(law)
            raise InputError(
                f"the {laws.noun} {kind!r} of {here or 'historysim'} cannot be made of its settings"
                f"{f' with {package}' if package else ''} ({error}); expected the version that wrote them"
            ) from error
        return made
