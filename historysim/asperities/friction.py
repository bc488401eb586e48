"""Friction coefficients: what every law is, those at the start, and where a path goes to others."""

from typing import Any, ClassVar

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.law import Law
from historysim.basics.arguments import Floats, checked, workable
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.registry import Registry
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check, fill

# The laws by their names in scenarios and logs.
LAWS: Registry[type["FrictionLaw"]] = Registry(
    "historysim.laws",
    "historysim.asperities.friction:FrictionLaw",
    "friction law",
    "historysim.asperities.laws",
)


@attrs.frozen(eq=False)
class Loaded:
    """How asperities are loaded at one moment.

    Attributes
    ----------
    pair : MaterialPair
    normal_load, summit_radius, slid_distance : array (asperity)
        Load > 0 [N], radius [m], and how far each has slid [m].
    total_normal_load : float
        Of all asperities together [N].
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


class FrictionLaw(Law):
    """A friction law.

    The cone of Coulomb's law |τ| ≤ μ p then has the coefficient that the law gives the asperity as a whole at its
    present load, T_max = μ(N) N: how the limit is spread over its contact stays that of the pressure. This is a choice
    of the model, common to all laws that depend on the load.
    """

    registry: ClassVar[Registry[Any]] = LAWS
    #: What it depends on: "nothing", "total" (the total load), "own" (the asperity's load), "slid" (what it slid).
    depends_on: ClassVar[str]

    #: Whether it has the same bits on every machine: it only adds, multiplies, divides and takes square roots.
    same_bits: bool = False

    def core(self) -> dict[str, Any]:
        """Return the fields of ``hs_law``; a law without a ``kind`` there is asked by `coefficients`."""
        fields = {"depends_on": _DEPENDENCE[self.depends_on]}
        if self.library_kind is None:
            return fields
        numbers = {name: number for name, number in self.numbers.items() if isinstance(number, float)}
        return fields | {"kind": self.library_kind} | numbers

    def coefficients(self, loaded: Loaded) -> Floats:
        """Return the coefficient μ of each asperity (asperity); a law of your own computes it here, for arrays."""
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

    def at_start(self, count: int) -> Floats:
        """Return the coefficient of each asperity before anything has happened (asperity): 0 where it needs a load."""
        if self.depends_on == "nothing":
            raise NotImplementedError(f"{type(self).__name__} depends on nothing; expected a method at_start")
        return np.zeros(count)

    def steepest_rise(self) -> float:
        """Return by how much friction rises with the distance slid where it rises most [1/m]; 0 where it does not."""
        return 0.0


def coulomb(friction: npt.ArrayLike, count: int) -> Floats:
    """Return one coefficient μ ≥ 0 per asperity (asperity), of one for all or one per asperity."""
    coefficients = workable("friction", checked("friction", friction, least=0))
    if coefficients.ndim > 1 or coefficients.size not in {1, count}:
        raise InputError(
            f"friction has shape {coefficients.shape}; expected one coefficient, or one for each of {count} asperities"
        )
    return np.array(np.broadcast_to(coefficients, count))


def at_start(friction: npt.ArrayLike | FrictionLaw, count: int) -> Floats:
    """Return one coefficient μ per asperity before anything has happened, given or of a law."""
    return coulomb(friction.at_start(count) if isinstance(friction, FrictionLaw) else friction, count)


@attrs.frozen(eq=False)
class FrictionGoal:
    """Coefficients (asperity) that a path goes a fraction of the way to, from where they are."""

    coefficients: Floats
    fraction: float = 1.0
