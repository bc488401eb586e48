"""What makes asperities evolve, as the library takes it: friction, wear, yielding, and where friction goes."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from historysim.asperities.friction import FrictionGoal
from historysim.asperities.laws.friction_law import FrictionLaw, Loaded
from historysim.asperities.wear import WearLaw
from historysim.asperities.yielding import YieldingLaw
from historysim.basics.array_types import Floats
from historysim.basics.library import ffi, pointer
from historysim.contact.materials import MaterialPair
from historysim.memory.binding import fill, view


@attrs.frozen(eq=False)
class Evolution:
    """What makes asperities evolve.

    Parameters
    ----------
    pair : MaterialPair
    law : FrictionLaw, optional
        Of asperities whose friction no event has given.
    wear : WearLaw, optional
    yielding : YieldingLaw, optional
    follow_sliding : bool
        Whether it is followed how far asperities slide that do no more than yield.
    """

    pair: MaterialPair
    law: FrictionLaw | None
    wear: WearLaw | None
    yielding: YieldingLaw | None = None
    follow_sliding: bool = False

    @contextlib.contextmanager
    def handed(self, virgin_radius: Floats, goal: FrictionGoal | None = None) -> Iterator[Any]:
        """Give it as the library takes it, for a call; what a law of the user's own raises there is raised after it.

        Parameters
        ----------
        virgin_radius : array (asperity)
            Of the summits before they yielded [m].
        goal : FrictionGoal, optional
            Where friction goes on the path.
        """
        raised: list[BaseException] = []
        kept: list[Any] = []
        found = ffi.new("hs_evolution *")
        found.contact_modulus, found.goal_fraction = self.pair.contact_modulus, 1.0
        if goal is not None:
            kept.append(pointer(goal.coefficients))
            found.goal, found.goal_fraction = kept[-1], goal.fraction
        if self.law is not None:
            kept.append(fill(found.law, self.law.core()))
            if not found.law.kind:
                found.law.kind = ffi.integer_const("HS_CALLERS_LAW")
                kept.append(_callback("hs_law_function", self._coefficients(self.law), raised))
                found.law.function = kept[-1]
        if self.wear is not None:
            kept.append(fill(found.wear, self.wear.core()))
            if not found.wear.kind:
                found.wear.kind = ffi.integer_const("HS_CALLERS_WEAR")
                kept.append(_callback("hs_wear_function", _volumes(self.wear), raised))
                found.wear.function = kept[-1]
        if self.yielding is not None:
            law = self.yielding
            kept.append(fill(found.yielding, law.core(self.pair)))
            onset = np.ascontiguousarray(law.critical_approach(virgin_radius, self.pair), dtype=np.float64)
            kept += [onset, pointer(onset)]
            found.yielding.critical_approach = kept[-1]
            found.follow_sliding = self.follow_sliding
            if not found.yielding.kind:
                found.yielding.kind = ffi.integer_const("HS_CALLERS_YIELDING")
                kept.append(_callback("hs_yielding_function", self._first_loading(law), raised))
                found.yielding.function = kept[-1]
        try:
            yield found
        finally:
            if raised:
                raise raised[0]

    def _coefficients(self, law: FrictionLaw) -> Callable[..., int]:
        def fill(_user: Any, loaded: Any, friction: Any) -> int:
            count = loaded.count
            view(friction, count)[:] = law.coefficients(
                Loaded(
                    pair=self.pair,
                    normal_load=view(loaded.normal_load, count),
                    total_normal_load=loaded.total_normal_load,
                    summit_radius=view(loaded.summit_radius, count),
                    slid_distance=view(loaded.slid_distance, count),
                )
            )
            return 0

        return fill

    def _first_loading(self, law: YieldingLaw) -> Callable[..., int]:
        def fill(_user: Any, count: int, approach: Any, radius: Any, load: Any, contact_radius: Any) -> int:
            found = law.first_loading(view(approach, count), view(radius, count), self.pair)
            view(load, count)[:], view(contact_radius, count)[:] = found
            return 0

        return fill


def _volumes(wear: WearLaw) -> Callable[..., int]:
    def fill(_user: Any, count: int, load: Any, slid: Any, energy: Any, volume: Any) -> int:
        view(volume, count)[:] = wear.volume(view(load, count), view(slid, count), view(energy, count))
        return 0

    return fill


def _callback(kind: str, function: Callable[..., int], raised: list[BaseException]) -> Any:
    def failed(_kind: Any, error: BaseException, _trace: Any) -> None:
        raised.append(error)

    return ffi.callback(kind, function, error=1, onerror=failed)
