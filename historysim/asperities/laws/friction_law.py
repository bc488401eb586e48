"""What every friction law is: a value that tells each asperity's coefficient from how it is loaded."""

import abc
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, TypeVar

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.library import ffi, lib, pointer
from historysim.basics.units import is_number
from historysim.basics.wording import nearest
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check, fill

Floats = npt.NDArray[np.float64]
Law = TypeVar("Law")


def made_from(settings: Mapping[str, Any], laws: Mapping[str, type[Law]]) -> Law:
    """Return the law that settings name as ``law``, with their numbers.

    Raises
    ------
    InputError
        A name that no law has, or numbers that it cannot have.
    """
    given = dict(settings)
    kind = given.pop("law", None)
    if kind not in laws:
        raise InputError(f"law is {kind!r}; {nearest(str(kind), laws)}")
    return laws[kind](**given)


@attrs.frozen(eq=False)
class Loaded:
    """How asperities are loaded at one moment.

    Attributes
    ----------
    pair : MaterialPair
    normal_load : array (asperity)
        [N], > 0.
    total_normal_load : float
        Of all asperities together [N].
    summit_radius : array (asperity)
        [m].
    slid_distance : array (asperity)
        How far each has slid [m].
    """

    pair: MaterialPair
    normal_load: Floats
    total_normal_load: float
    summit_radius: Floats
    slid_distance: Floats


_DEPENDENCE = {
    "nothing": "HS_ON_NOTHING",
    "total": "HS_ON_TOTAL_LOAD",
    "own": "HS_ON_OWN_LOAD",
    "slid": "HS_ON_SLID_DISTANCE",
}


class FrictionLaw(abc.ABC):
    """A friction law.

    The cone of Coulomb's law |τ| ≤ μ p then has the coefficient that the law gives the asperity as a whole at its
    present load, T_max = μ(N) N: how the limit is spread over its contact stays that of the pressure. This is a choice
    of the model, common to all laws that depend on the load.
    """

    kind: ClassVar[str]
    """Its name in scenarios and logs."""
    depends_on: ClassVar[str]
    """What it depends on: "nothing", "total" (the total load), "own" (the asperity's load), "slid" (what it slid)."""

    same_bits: bool = False
    """Whether it has the same bits on every machine, as what adds, multiplies, divides and takes square roots does."""

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law`` that say what it is; a law without a kind there is asked itself."""
        return {"depends_on": _DEPENDENCE[self.depends_on]}

    def coefficients(self, loaded: Loaded) -> Floats:
        """Return the coefficient μ of each asperity (asperity).

        Laws of the library are asked there. A law of your own says it here, for arrays.
        """
        fields = self.core()
        if "kind" not in fields:
            raise NotImplementedError(f"{type(self).__name__} has no coefficients; expected a method that returns them")
        law, given, found = ffi.new("hs_law *"), ffi.new("hs_loaded *"), np.empty(loaded.normal_load.size)
        names = ("normal_load", "summit_radius", "slid_distance", "total_normal_load")
        kept = fill(law, fields), fill(given, {name: getattr(loaded, name) for name in names})
        given.count = found.size
        check(lib.hs_coefficients(law, loaded.pair.contact_modulus, given, pointer(found)))
        del kept
        return found

    @property
    @abc.abstractmethod
    def text(self) -> str:
        """Say in a line what it is, what is chosen, and where it comes from."""

    @property
    def settings(self) -> dict[str, Any]:
        """Its name as ``law``, and its numbers, as `law_from` takes them."""
        value: Any = self
        numbers = attrs.asdict(value, filter=lambda _, number: number is not None)
        return {
            "law": self.kind,
            **{key: list(value) if isinstance(value, tuple) else value for key, value in numbers.items()},
        }


def at_least(least: float, *, above: bool = False) -> Callable[[object, "attrs.Attribute[float]", Any], None]:
    """Return a validator of a finite number that is at least, or above, another."""

    def check(law: object, attribute: "attrs.Attribute[float]", value: Any) -> None:
        fits = is_number(value) and math.isfinite(value) and (value > least if above else value >= least)
        if not fits:
            wanted = f"above {least:g}" if above else "finite" if least == -math.inf else f"of {least:g} or more"
            raise InputError(f"{type(law).__name__}: {attribute.name} is {value!r}; expected a number {wanted}")

    return check


def one_of(*words: str) -> Callable[[object, "attrs.Attribute[str]", Any], None]:
    """Return a validator of a word."""

    def check(law: object, attribute: "attrs.Attribute[str]", value: Any) -> None:
        if value not in words:
            expected = " or ".join(map(repr, words))
            raise InputError(f"{type(law).__name__}: {attribute.name} is {value!r}; expected {expected}")

    return check
