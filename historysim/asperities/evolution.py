"""What makes asperities evolve, as the library takes it: friction, wear, yielding, and where friction goes."""

import contextlib
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from historysim.asperities.friction import FrictionGoal, FrictionLaw, Loaded
from historysim.asperities.law import Law
from historysim.asperities.wear import WearLaw
from historysim.asperities.yielding import YieldingLaw
from historysim.basics.arguments import Floats
from historysim.basics.library import ffi, pointer
from historysim.contact.materials import MaterialPair
from historysim.errors import HistorySimError, InputError
from historysim.memory.binding import fill, view


@contextlib.contextmanager
def evolution_of(
    pair: MaterialPair,
    law: FrictionLaw | None,
    wear: WearLaw | None,
    yielding: YieldingLaw | None,
    *,
    follow_sliding: bool,
    virgin_radius: Floats,
    goal: FrictionGoal | None,
) -> Iterator[Any]:
    """Give what makes asperities evolve as the library takes it, for one call; then raise errors of a user's own law.

    The radii are those of the summits before they yielded [m] (asperity).
    """
    raised: list[BaseException] = []
    found = ffi.new("hs_evolution *")
    found.contact_modulus, found.goal_fraction = pair.contact_modulus, 1.0
    found.count, found.follow_sliding = virgin_radius.size, follow_sliding
    # what the struct points to has to live as long as it does
    kept: list[Any] = []
    if goal is not None:
        kept.append(pointer(goal.coefficients))
        found.goal, found.goal_fraction = kept[-1], goal.fraction

    def add(name: str, law: Law, fields: Mapping[str, Any], asked: Callable[..., int]) -> None:
        struct = getattr(found, name)
        kept.append(fill(struct, fields))
        if not struct.kind:
            # a law that the library does not know is asked in Python
            struct.kind = ffi.integer_const(f"HS_CALLERS_{name.upper()}")
            kept.append(_callback(f"hs_{name}_function", law, asked, raised))
            struct.function = kept[-1]

    if law is not None:
        add("law", law, law.core(), _coefficients(law, pair))
    if wear is not None:
        add("wear", wear, wear.core(), _volumes(wear))
    if yielding is not None:
        add("yielding", yielding, yielding.core(pair), _first_loading(yielding, pair))
        onset = yielding.critical_approach(virgin_radius, pair)
        kept.append(_numbers(onset, virgin_radius.size, "critical approaches"))
        found.yielding.critical_approach = pointer(kept[-1])
    try:
        yield found
    finally:
        if raised:
            raise raised[0]


def _coefficients(law: FrictionLaw, pair: MaterialPair) -> Callable[..., int]:
    def fill(_user: Any, loaded: Any, friction: Any) -> int:
        count = loaded.count
        names = ("normal_load", "summit_radius", "slid_distance")
        each = {name: _given(getattr(loaded, name), count) for name in names}
        given = Loaded(pair=pair, total_normal_load=loaded.total_normal_load, **each)
        _put(friction, count, law.coefficients(given), "coefficients", least=0.0)
        return 0

    return fill


def _volumes(law: WearLaw) -> Callable[..., int]:
    def fill(_user: Any, count: int, load: Any, slid: Any, energy: Any, volume: Any) -> int:
        _put(volume, count, law.volume(*(_given(each, count) for each in (load, slid, energy))), "volumes")
        return 0

    return fill


def _first_loading(law: YieldingLaw, pair: MaterialPair) -> Callable[..., int]:
    def fill(_user: Any, count: int, approach: Any, radius: Any, load: Any, contact_radius: Any) -> int:
        loads, radii = law.first_loading(_given(approach, count), _given(radius, count), pair)
        _put(load, count, loads, "loads of first loading")
        _put(contact_radius, count, radii, "contact radii of first loading")
        return 0

    return fill


def _given(numbers: Any, count: int) -> Floats:
    """Return numbers of the library that a law may keep: a copy, since the library's own end with the call."""
    return view(numbers, count).copy()


def _put(place: Any, count: int, values: Any, what: str, least: float = -np.inf) -> None:
    """Give the library what a law returns for its asperities, checked."""
    view(place, count)[:] = _numbers(values, count, what, least)


def _numbers(values: Any, count: int, what: str, least: float = -np.inf) -> Floats:
    """Return what a law returns for its asperities, checked."""
    try:
        found = np.broadcast_to(np.asarray(values, dtype=np.float64), count)
    except (TypeError, ValueError):
        shape = f"an array {np.shape(values)}" if isinstance(values, np.ndarray) else repr(values)
        raise InputError(f"the {what} are {shape}; expected a number for each of {count} asperities") from None
    wrong = ~(np.isfinite(found) & (found >= least))
    if wrong.any():
        bound = f" of {least:g} or more" if least > -np.inf else ""
        raise InputError(f"one of the {what} is {found[wrong][0]:g}; expected a finite number{bound}")
    return np.ascontiguousarray(found)


def _callback(kind: str, law: Law, function: Callable[..., int], raised: list[BaseException]) -> Any:
    def failed(_kind: Any, error: BaseException, trace: TracebackType) -> None:
        raised.append(_of_law(law, error, trace) if isinstance(error, Exception) else error)

    return ffi.callback(kind, function, error=1, onerror=failed)


def _of_law(law: Law, error: Exception, trace: TracebackType) -> Exception:
    """Return the error of a user's own law as one that names the law and the line."""
    if isinstance(error, HistorySimError):
        return InputError(f"the law '{law.kind}': {error}").with_traceback(trace)
    *_, last = traceback.extract_tb(trace)
    where = f"{Path(last.filename).name}, line {last.lineno}"
    found = InputError(f"the law '{law.kind}' fails in {where}: {type(error).__name__}: {error}")
    found.__cause__ = error
    return found
