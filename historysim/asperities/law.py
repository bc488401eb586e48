"""Laws of friction, wear and yielding: serialisation, and the interface to the C library."""

import abc
import contextlib
import traceback
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Floats, as_floats, workable
from historysim.basics.fields import QuantityFields
from historysim.basics.library import ffi, lib, pointer
from historysim.basics.limits import MOST_FRICTION
from historysim.basics.registry import Registry
from historysim.contact.materials import MaterialPair
from historysim.errors import HistorySimError, InputError, MissingPackageError
from historysim.memory.binding import check, fill, view


def _registry(name: str, base: str, noun: str) -> Registry[Any]:
    """Return the registry of the laws of a module, by their names in scenarios and logs."""
    home = f"historysim.asperities.{name}"
    return Registry(f"historysim.{name}", f"{home}:{base}", noun, home)


# here, so that a module of laws is imported only for one of its laws
LAWS: Registry[type["FrictionLaw"]] = _registry("laws", "FrictionLaw", "friction law")
WEAR_LAWS = _registry("wear", "WearLaw", "wear law")
YIELDING_LAWS = _registry("yielding", "YieldingLaw", "yielding law")
ATTRACTIONS = _registry("attraction", "Attraction", "law of attraction")

_DEPENDENCE = {
    "nothing": "HS_ON_NOTHING",
    "total": "HS_ON_TOTAL_LOAD",
    "own": "HS_ON_OWN_LOAD",
    "slid": "HS_ON_SLID_DISTANCE",
}


class Law(QuantityFields, abc.ABC):
    """A law as a value: its numbers are its fields."""

    __slots__ = ()

    registry: ClassVar[Registry[Any]]  #: all laws of its type by name
    kind: ClassVar[str]  #: its name in scenarios and logs
    #: its name in the C library; None for a user-defined law
    library_kind: ClassVar[str | None] = None
    struct: ClassVar[str]  #: its field of ``hs_evolution``: "law", "wear" or "yielding"
    answers: ClassVar[str]  #: the method that a user-defined law implements

    @property
    @abc.abstractmethod
    def text(self) -> str:
        """One-line description: the choice of law, and its source."""

    @abc.abstractmethod
    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of its C structure; without a ``library_kind`` the library calls `answer`."""

    @abc.abstractmethod
    def answer(self, pair: MaterialPair, *numbers: Any) -> None:
        """Answer a call of the library: the last arguments are arrays for the results."""

    def in_library(self, pair: Any) -> tuple[Any, list[Any]]:
        """Return the C structure of the law, and the objects that must outlive it; user-defined laws have none."""
        if self.library_kind is None:
            raise NotImplementedError(
                f"{type(self).__name__} has no {self.answers}; expected a method that returns it"
            )
        structure = ffi.new(f"hs_{self.struct} *")
        return structure, fill(structure, self.core(pair) | {"kind": self.library_kind})

    @property
    def described(self) -> dict[str, Any]:
        """Its name as ``law``, its numbers, and the package that provides it if third-party."""
        numbers, origin = self.numbers, self.registry.provider(type(self))
        package = {} if origin is None else {"package": [origin.package, origin.version]}
        return {"law": numbers.pop("law"), **package, **numbers}

    @property
    def numbers(self) -> dict[str, Any]:
        """Its name as ``law``, and its numbers."""
        value: Any = self
        numbers = (
            attrs.asdict(value, filter=lambda _, value_of_field: value_of_field is not None)
            if attrs.has(type(self))
            else {}
        )
        fields = {
            key: list(value_of_field) if isinstance(value_of_field, tuple) else value_of_field
            for key, value_of_field in numbers.items()
        }
        return {"law": self.kind, **fields}

    @property
    def settings(self) -> dict[str, Any]:
        """`described`, of a law that `from_settings` can read again; InputError for any other law."""
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
        """Reconstruct a law from its serialised settings; InputError if name, package or numbers are invalid."""
        return law_from_settings(cls.registry, settings)  # type: ignore[no-any-return]


def law_from_settings(laws: Registry[Any], settings: Mapping[str, Any]) -> Any:
    """Reconstruct a law of a registry; errors as for `Law.from_settings`."""
    fields = dict(settings)
    kind = fields.pop("law", None)
    package = " ".join(map(str, fields.pop("package", ()))).rstrip()
    if package and kind not in laws:
        raise MissingPackageError(
            f"the {laws.noun} {kind!r} is of {package}, which is not there; install that package, or where it is "
            "a module of your own, import it first"
        )
    law = laws.lookup(kind)
    try:
        return law(**fields)
    except TypeError as error:
        provider = laws.provider(law)
        raise InputError(
            f"the {laws.noun} {kind!r} of {provider or 'historysim'} cannot be made of its settings"
            f"{f' with {package}' if package else ''} ({error}); expected the version that wrote them"
        ) from error


@attrs.frozen(eq=False)
class Loaded:
    """Loads of asperities at one instant; arrays are (asperity)."""

    pair: MaterialPair
    normal_load: Floats  #: > 0 [N]
    total_normal_load: float  #: of all asperities together [N]
    summit_radius: Floats  #: [m]
    slid_distance: Floats  #: how far each has slid [m]


class Attraction(Law):
    """A law of attraction: a constant force on each asperity while it touches."""

    __slots__ = ()

    registry = ATTRACTIONS
    struct, answers = "", "forces"

    def core(self, pair: Any) -> dict[str, Any]:
        """Return no field: the library knows the loads of the contact alone."""
        del pair
        return {}

    def answer(self, pair: Any, *numbers: Any) -> None:
        """Refuse: the library does not call it."""
        raise NotImplementedError("an attraction is not called by the library")

    def forces(self, summit_radius: Floats) -> Floats:
        """Return the force on each touching asperity [N] (asperity)."""
        raise NotImplementedError(
            f"{type(self).__name__} has no forces; expected a method that returns them"
        )


class FrictionLaw(Law):
    """A friction law.

    Coulomb's cone |τ| ≤ μ p has the coefficient of the whole asperity at its present load, T_max =
    μ(N) N: over the contact the limit remains proportional to the pressure. This is an assumption
    of the model, common to all laws that depend on the load.
    """

    registry: ClassVar[Registry[Any]] = LAWS
    struct, answers = "law", "coefficients"
    #: Argument of the law: "nothing", "total" (the total load), "own" (the asperity's load), "slid"
    #: (its slid distance).
    depends_on: ClassVar[str]
    #: Whether it has the same bits on every machine: it only adds, multiplies, divides and takes
    #: square roots.
    same_bits: bool = False

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_law``."""
        fields = {"depends_on": _DEPENDENCE[self.depends_on]}
        if self.library_kind is None:
            return fields
        return fields | {
            name: number for name, number in self.numbers.items() if isinstance(number, float)
        }

    def coefficients(self, loaded: Loaded) -> Floats:
        """Return the coefficient μ of each asperity (asperity); a user-defined law computes it here, on arrays."""
        law, owners = self.in_library(loaded.pair)
        arguments, coefficients = ffi.new("hs_loaded *"), np.empty(loaded.normal_load.size)
        names = ("normal_load", "summit_radius", "slid_distance", "total_normal_load")
        owners += fill(
            arguments,
            {name: getattr(loaded, name) for name in names} | {"count": coefficients.size},
        )
        check(
            lib.hs_coefficients(law, loaded.pair.contact_modulus, arguments, pointer(coefficients))
        )
        return coefficients

    def answer(self, pair: MaterialPair, *numbers: Any) -> None:
        """Answer ``hs_law_function``."""
        arguments, friction = numbers
        arrays = {
            name: copy_array(getattr(arguments, name), arguments.count)
            for name in ("normal_load", "summit_radius", "slid_distance")
        }
        loaded = Loaded(pair=pair, total_normal_load=arguments.total_normal_load, **arrays)
        put(friction, arguments.count, self.coefficients(loaded), "coefficients", minimum=0.0)

    def at_start(self, count: int) -> Floats:
        """Return the coefficient of each asperity at the start (asperity), 0 if it depends on a load."""
        if self.depends_on == "nothing":
            raise NotImplementedError(
                f"{type(self).__name__} depends on nothing; expected a method at_start"
            )
        return np.zeros(count)

    def steepest_rise(self) -> float:
        """Return the largest increase of friction with slid distance [1/m]; 0 if there is none."""
        return 0.0


def coulomb(friction: npt.ArrayLike, count: int) -> Floats:
    """Return one coefficient μ ≥ 0 per asperity (asperity), from one for all or one per asperity."""
    coefficients = workable("friction", as_floats("friction", friction, least=0))
    if (large := coefficients > MOST_FRICTION).any():
        raise InputError(
            f"friction is {coefficients[large].ravel()[0]:g}; expected {MOST_FRICTION:g} at most, with which the "
            "contact sticks as with any larger coefficient: narrower slip zones are not resolved"
        )
    if coefficients.ndim > 1 or coefficients.size not in {1, count}:
        raise InputError(
            f"friction has shape {coefficients.shape}; expected one coefficient, or one for each of {count} asperities"
        )
    return np.array(np.broadcast_to(coefficients, count))


@attrs.frozen(eq=False)
class FrictionGoal:
    """Target coefficients (asperity) of a path, and the fraction of the change that the path covers."""

    coefficients: Floats
    fraction: float = 1.0


def copy_array(numbers: Any, count: int) -> Floats:
    """Copy an array of the library, whose memory ends with the call, for a law that may keep it."""
    return view(numbers, count).copy()


def put(target: Any, count: int, values: Any, quantity: str, minimum: float = -np.inf) -> None:
    """Check the results of a law and write them to an array of the library."""
    view(target, count)[:] = _numbers(values, count, quantity, minimum)


def _numbers(values: Any, count: int, quantity: str, minimum: float = -np.inf) -> Floats:
    """Check the results of a law for its asperities and return them as an array."""
    try:
        array = np.broadcast_to(np.asarray(values, dtype=np.float64), count)
    except (TypeError, ValueError):
        shape = f"an array {np.shape(values)}" if isinstance(values, np.ndarray) else repr(values)
        raise InputError(
            f"the {quantity} are {shape}; expected a number for each of {count} asperities"
        ) from None
    wrong = ~(np.isfinite(array) & (array >= minimum))
    if wrong.any():
        bound = f" of {minimum:g} or more" if minimum > -np.inf else ""
        raise InputError(
            f"one of the {quantity} is {array[wrong][0]:g}; expected a finite number{bound}"
        )
    return np.ascontiguousarray(array)


@contextlib.contextmanager
def make_evolution(
    pair: MaterialPair,
    laws: tuple[Law, ...],
    *,
    follow_sliding: bool,
    virgin_radius: Floats,
    goal: FrictionGoal | None,
) -> Iterator[Any]:
    """Yield the ``hs_evolution`` of the laws for one call; afterwards raise errors of a user-defined law.

    ``virgin_radius`` are the radii of the summits before they yielded [m] (asperity).
    """
    raised: list[BaseException] = []
    evolution = ffi.new("hs_evolution *")
    evolution.contact_modulus, evolution.goal_fraction = pair.contact_modulus, 1.0
    evolution.count, evolution.follow_sliding = virgin_radius.size, follow_sliding
    # arrays that the struct points to have to live as long as it does
    owners: list[Any] = []
    if goal is not None:
        owners.append(pointer(goal.coefficients))
        evolution.goal, evolution.goal_fraction = owners[-1], goal.fraction
    for law in laws:
        struct = getattr(evolution, law.struct)
        # a law that the library does not know is evaluated in Python
        kind = law.library_kind or f"HS_CALLERS_{law.struct.upper()}"
        fields = law.core(pair) | {"kind": kind}
        if law.struct == "yielding":
            onset = law.critical_approach(virgin_radius, pair)  # type: ignore[attr-defined] # of all of these
            fields["critical_approach"] = _numbers(onset, virgin_radius.size, "critical approaches")
        if law.library_kind is None:
            fields["function"] = _callback(law, pair, raised)
        owners += [*fill(struct, fields), fields]
    try:
        yield evolution
    finally:
        if raised:
            raise raised[0]


def _callback(law: Law, pair: MaterialPair, raised: list[BaseException]) -> Any:
    def answer_call(_user: Any, *numbers: Any) -> int:
        law.answer(pair, *numbers)
        return 0

    def record_error(_kind: Any, error: BaseException, trace: TracebackType) -> None:
        raised.append(_name_law(law, error, trace) if isinstance(error, Exception) else error)

    return ffi.callback(f"hs_{law.struct}_function", answer_call, error=1, onerror=record_error)


def _name_law(law: Law, error: Exception, trace: TracebackType) -> Exception:
    """Return the error of a user-defined law as one that names the law and the line."""
    if isinstance(error, HistorySimError):
        return InputError(f"the law '{law.kind}': {error}").with_traceback(trace)
    *_, frame = traceback.extract_tb(trace)
    where = f"{Path(frame.filename).name}, line {frame.lineno}"
    named = InputError(f"the law '{law.kind}' fails in {where}: {type(error).__name__}: {error}")
    named.__cause__ = error
    return named
