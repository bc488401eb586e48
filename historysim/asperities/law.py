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

    registry: ClassVar[Registry[Any]]
    """All laws of its sort by their names."""
    kind: ClassVar[str]
    """Its name in scenarios and logs."""

    @property
    @abc.abstractmethod
    def text(self) -> str:
        """Say in a line what it is, what is chosen, and where it comes from."""

    @property
    def told(self) -> dict[str, Any]:
        """Its name as ``law``, its numbers, and of a foreign one the package that it comes from."""
        value: Any = self
        numbers = attrs.asdict(value, filter=lambda _, number: number is not None) if attrs.has(type(self)) else {}
        origin = self.registry.provider(type(self))
        return {
            "law": self.kind,
            **({} if origin is None else {"package": [origin.package, origin.version]}),
            **{key: list(number) if isinstance(number, tuple) else number for key, number in numbers.items()},
        }

    @property
    def settings(self) -> dict[str, Any]:
        """What `told` says of a law that `from_settings` can read again.

        Raises
        ------
        InputError
            Its name is not known, so that what is written could not be read again.
        """
        laws = self.registry
        if laws.get(self.kind) is not type(self) or not attrs.has(type(self)):
            raise InputError(
                f"the {laws.noun} {self.kind!r} cannot be written down: {type(self).__name__} is not known by that "
                "name; expected a class below @register and @attrs.frozen, or one that its package declares in "
                f"{laws.group}"
            )
        return self.told

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """Return the law that `settings` told.

        Raises
        ------
        InputError
            A name that no law has, a law of a package that is not there, or numbers that it cannot have.
        """
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
                f"the {laws.noun} {kind!r} of {here or 'historysim'} cannot be made of what was written"
                f"{f' with {package}' if package else ''} ({error}); expected the version that has written it"
            ) from error
        return made
