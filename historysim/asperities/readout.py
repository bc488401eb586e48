"""`Readout`: recorded values of asperities in one state; `Step`: the end of one step of a single asperity."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from historysim.asperities.state import State
from historysim.basics.library import lib
from historysim.memory.binding import check
from historysim.memory.paths import blank_rows


class Readout:
    """Recorded values of some asperities of an ensemble in one state, read in one batch when first needed."""

    def __init__(self, ensemble: Any, state: State, positions: Sequence[int]) -> None:
        self.ensemble, self.state, self.positions = ensemble, state, positions

    @cached_property
    def recorded_values(self) -> dict[str, list[Any]]:
        """Recorded values by name, in SI: a number or a vector for each asperity."""
        rows = blank_rows(1, len(self.positions), planar=self.state.directions == 2)
        check(lib.hs_read(self.state.memory, rows.as_struct(np.array(self.positions)), 0))
        return {name: values[0].tolist() for name, values in rows.each.items()}

    @cached_property
    def parameters(self) -> dict[str, list[float]]:
        """Present height [m], radius [m] and friction coefficient of each asperity, by name."""
        shapes = getattr(self.state, "evolved", None) or self.ensemble
        arrays = {"summit_height": shapes.summit_height, "summit_radius": shapes.summit_radius}
        arrays["friction"] = self.state.friction
        return {name: values[self.positions].tolist() for name, values in arrays.items()}


class Step(NamedTuple):
    """End of one step of a single asperity."""

    normal_load: float  #: [N]
    tangential_load: Any  #: [N], a vector in two directions
    approach: float  #: [m]
    tangential_displacement: Any  #: [m], a vector in two directions
    label: float  #: dimensionless approach
    mark: float  #: dimensionless displacement along the line of motion
    pressed: bool  #: whether the step changed the approach

    @classmethod
    def between(cls, previous: State, current: State) -> Self:
        """Return the step from one state to the next."""
        line = current.memory.line
        pressed = line.approach != previous.memory.line.approach
        loads = current.normal_load, current.tangential_load
        return cls(
            *loads,
            current.approach,
            current.tangential_displacement,
            line.approach,
            line.displacement,
            pressed,
        )
