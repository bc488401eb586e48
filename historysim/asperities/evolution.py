"""What makes asperities evolve, as the library takes it: friction, wear, yielding, and where friction goes."""

import contextlib
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import attrs
import numpy as np

from historysim.asperities.friction import FrictionGoal, FrictionLaw, Loaded
from historysim.asperities.law import Law
from historysim.asperities.wear import WearLaw
from historysim.asperities.yielding import YieldingLaw
from historysim.basics.array_types import Floats
from historysim.basics.library import ffi, pointer
from historysim.contact.materials import MaterialPair
from historysim.errors import HistorySimError, InputError
from historysim.memory.binding import fill, view


@attrs.frozen(eq=False)
class Evolution:
    """What makes asperities evolve, as `Ensemble` has it."""

    pair: MaterialPair
    law: FrictionLaw | None
    wear: WearLaw | None
    yielding: YieldingLaw | None = None
    follow_sliding: bool = False

    @contextlib.contextmanager
    def as_struct(self, virgin_radius: Floats, goal: FrictionGoal | None = None) -> Iterator[Any]:
        """Give it as the library takes it, for one call, after which errors of a user's own law are raised.

        The radii are those of the summits before they yielded [m] (asperity).
        """
        raised: list[BaseException] = []
        kept: list[Any] = []
        found = ffi.new("hs_evolution *")
        found.contact_modulus, found.goal_fraction = self.pair.contact_modulus, 1.0
        found.count = virgin_radius.size
        if goal is not None:
            kept.append(pointer(goal.coefficients))
            found.goal, found.goal_fraction = kept[-1], goal.fraction
        if self.law is not None:
            kept.append(fill(found.law, self.law.core()))
            if not found.law.kind:
                found.law.kind = ffi.integer_const("HS_CALLERS_LAW")
                kept.append(_callback("hs_law_function", self.law, self._coefficients(self.law), raised))
                found.law.function = kept[-1]
        if self.wear is not None:
            kept.append(fill(found.wear, self.wear.core()))
            if not found.wear.kind:
                found.wear.kind = ffi.integer_const("HS_CALLERS_WEAR")
                kept.append(_callback("hs_wear_function", self.wear, _volumes(self.wear), raised))
                found.wear.function = kept[-1]
        if self.yielding is not None:
            law = self.yielding
            kept.append(fill(found.yielding, law.core(self.pair)))
            onset = _numbers(law.critical_approach(virgin_radius, self.pair), virgin_radius.size, "critical approaches")
            kept += [onset, pointer(onset)]
            found.yielding.critical_approach = kept[-1]
            found.follow_sliding = self.follow_sliding
            if not found.yielding.kind:
                found.yielding.kind = ffi.integer_const("HS_CALLERS_YIELDING")
                kept.append(_callback("hs_yielding_function", law, self._first_loading(law), raised))
                found.yielding.function = kept[-1]
        try:
            yield found
        finally:
            if raised:
                raise raised[0]

    def _coefficients(self, law: FrictionLaw) -> Callable[..., int]:
        def fill(_user: Any, loaded: Any, friction: Any) -> int:
            count = loaded.count
            given = Loaded(
                pair=self.pair,
                normal_load=_given(loaded.normal_load, count),
                total_normal_load=loaded.total_normal_load,
                summit_radius=_given(loaded.summit_radius, count),
                slid_distance=_given(loaded.slid_distance, count),
            )
            _put(friction, count, law.coefficients(given), "coefficients", least=0.0)
            return 0

        return fill

    def _first_loading(self, law: YieldingLaw) -> Callable[..., int]:
        def fill(_user: Any, count: int, approach: Any, radius: Any, load: Any, contact_radius: Any) -> int:
            loads, radii = law.first_loading(_given(approach, count), _given(radius, count), self.pair)
            _put(load, count, loads, "loads of first loading")
            _put(contact_radius, count, radii, "contact radii of first loading")
            return 0

        return fill


def _volumes(wear: WearLaw) -> Callable[..., int]:
    def fill(_user: Any, count: int, load: Any, slid: Any, energy: Any, volume: Any) -> int:
        _put(volume, count, wear.volume(*(_given(each, count) for each in (load, slid, energy))), "volumes")
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
