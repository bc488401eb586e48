"""Stepping by hand: one straight path of a state (`stepped`), and many in a tight loop (`Stepper`)."""

import math
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from historysim.asperities.curves import NormalCurves
from historysim.asperities.state import BLOCK, EnsembleState, joined
from historysim.basics.arguments import checked
from historysim.errors import FrictionLimitError, InputError
from historysim.memory.layout import APPROACH, DISPLACEMENT, DISSIPATED, NORMAL_LOAD, TANGENTIAL_LOAD, Memory
from historysim.memory.paths import DISPLACED, LOAD, STILL, Goals, paths_to
from historysim.memory.rows import (
    ROW_APPROACH,
    ROW_COUNT,
    ROW_DISPLACEMENT,
    ROW_DISSIPATED,
    ROW_NORMAL,
    ROW_STIFFNESS,
    ROW_TANGENTIAL,
)
from historysim.memory.slopes import Slopes
from historysim.memory.stepping import Arrays, Body, slopes_of_arrays, step_arrays

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

HELD = math.nan
"""Target of a channel that is held as it was controlled last."""

A_STEP_ADDS, SPARE, ENOUGH = 2, 4, 4
"""Vertices that a step mostly adds at most, for how many there is room, and how many are left when it has not asked for
deeper ones."""


def channel(
    name: str, load: float | None, displacement: float | None, control: int, least: float = -math.inf
) -> tuple[int, float]:
    """Return how one channel of a path is controlled, and its target in N or m.

    Raises
    ------
    InputError
        A value that is not finite or too small, or both a load and a displacement.
    """
    if load is None:
        if displacement is None:
            return control, HELD
        kind, value, least = DISPLACED, displacement, -math.inf
    elif displacement is None:
        kind, value = LOAD, load
    else:
        raise InputError(f"both {name}_load and {name}_displacement came; expected one of them")
    # comparisons with what is no number are false
    if isinstance(value, float) and least <= value < math.inf and value > -math.inf:
        return kind, value
    kind_name = "load" if kind == LOAD else "displacement"
    return kind, float(checked(f"{name}_{kind_name}", value, least=least))


def stepped(
    state: EnsembleState,
    normal: tuple[int, float],
    tangential: tuple[int, float],
    saturate: bool,
    tolerance: float,
    compliance: float,
) -> EnsembleState:
    """Return the state after one straight path to targets in N and m.

    The outer end of a deep memory is copied and stepped alone. Where fewer than four of its vertices are left the step
    may have asked for what is deeper, and is done again with more; so it is where the path is refused.

    Raises
    ------
    FrictionLimitError
        |T| > Σ μ N.
    """
    arrays, deeper = state.outer
    units = state.units
    if deeper is not None and _sweeps(normal, tangential, float(arrays[4][NORMAL_LOAD]) * units.load):
        arrays, deeper = joined(arrays, deeper, math.inf)
    contact, scale, least = state.contact[:], units[:], BLOCK
    while True:
        given = _copied(arrays)
        refused, asked, limit, larger = step_arrays(
            contact, given, scale, *normal, *tangential, saturate, tolerance, compliance
        )
        after = larger or given
        if deeper is None or not (refused or after[1][0] < ENOUGH):
            break
        arrays, deeper = joined(arrays, deeper, least)
        least *= 2
    if refused:
        raise FrictionLimitError(asked * units.load, limit * units.load)
    return EnsembleState(state.contact, state.order, after, units, normal[0], tangential[0], deeper)


def _sweeps(normal: tuple[int, float], tangential: tuple[int, float], load: float) -> bool:
    """Whether a path is a ramp of both loads with a normal load that moves: it may look at points beside its way."""
    return normal[0] == tangential[0] == LOAD and not math.isnan(normal[1]) and normal[1] != load


def _copied(arrays: Arrays) -> Arrays:
    vertices, depth, steep, dissipated, now = arrays
    deepest = int(depth[0]) if depth.size == 1 else int(depth.max())
    spare = vertices.shape[1] - deepest
    if A_STEP_ADDS <= spare <= 2 * SPARE:
        # to copy all takes half the time of making another room
        room = vertices.copy()
    else:
        room = np.empty((depth.size, deepest + SPARE, vertices.shape[2]))
        room[:, :deepest] = vertices[:, :deepest]
    return room, depth.copy(), steep.copy(), dissipated.copy(), now.copy()


class Totals(NamedTuple):
    """What the whole contact does at the end of each of several paths; all arrays are (path), in SI units."""

    normal_load: Floats
    tangential_load: Floats
    approach: Floats
    tangential_displacement: Floats
    contact_count: Integers
    tangential_stiffness: Floats
    dissipated_energy: Floats

    @classmethod
    def of(cls, rows: Floats) -> Self:
        """Take them from recorded rows of totals."""
        told = (ROW_NORMAL, ROW_TANGENTIAL, ROW_APPROACH, ROW_DISPLACEMENT, ROW_COUNT, ROW_STIFFNESS, ROW_DISSIPATED)
        columns = dict(zip(cls._fields, rows[:, told].T.copy(), strict=True))
        return cls(**columns | {"contact_count": columns["contact_count"].astype(np.int64)})


class Stepper:
    """A state that is stepped in place, for tight loops: of a controller, or of an integrator.

    `Ensemble.stepper` makes one. It gives the bits that `Ensemble.advance` and a replay give, at a cost that does not
    grow with the depth of the memory. It can be pickled. What it was is lost with each step: `save` first where a step
    may be undone, such as a trial inside an integrator's stages.

    Attributes
    ----------
    body : Body
        What compiled code steps, of the same arrays (`historysim.memory.stepping.step`). Set it to what `step` has
        returned in the end.
    """

    def __init__(
        self,
        state: EnsembleState,
        *,
        saturate: bool,
        tolerance: float,
        compliance: float,
        curves: NormalCurves | None,
    ) -> None:
        self._options = saturate, tolerance, compliance
        self._curves = curves
        self.restore(state)

    def restore(self, state: EnsembleState) -> None:
        """Go on from a state of the same ensemble, such as one that `save` has returned."""
        self._contact, self._order, self._units = state.contact, state.order, state.units
        # named tuples are handed to compiled code ten times slower
        self._geometry, self._scale = tuple(state.contact), tuple(state.units)
        self._arrays = _copied(tuple(state.memory))
        self._normal, self._tangential = state.normal_control, state.tangential_control
        self._start = state.memory.now[APPROACH]

    def save(self) -> EnsembleState:
        """Return the present state, which later steps do not change."""
        arrays = _copied(self._arrays)
        return EnsembleState(self._contact, self._order, arrays, self._units, self._normal, self._tangential)

    def step(
        self,
        *,
        normal_load: float | None = None,
        normal_displacement: float | None = None,
        tangential_load: float | None = None,
        tangential_displacement: float | None = None,
    ) -> None:
        """Go along one joint straight path; parameters as in `Ensemble.advance`.

        Raises
        ------
        FrictionLimitError, CurveEndError
            A load beyond the friction limit, or beyond the end of a normal curve; nothing is changed.
        InputError
            As for `Ensemble.advance`; nothing is changed.
        """
        normal = channel("normal", normal_load, normal_displacement, self._normal, 0.0)
        tangential = channel("tangential", tangential_load, tangential_displacement, self._tangential)
        if self._curves is not None:
            self._curves.check_reach(paths_to(goals(normal), goals(tangential)))
        saturate, tolerance, compliance = self._options
        start = self._arrays[4][APPROACH]
        refused, asked, limit, larger = step_arrays(
            self._geometry, self._arrays, self._scale, *normal, *tangential, saturate, tolerance, compliance
        )
        if refused:
            raise FrictionLimitError(asked * self._units.load, limit * self._units.load)
        if larger is not None:
            self._arrays = larger
        self._normal, self._tangential = normal[0], tangential[0]
        # a ramp of both loads begins where the contact touches
        self._start = max(start, 0.0) if self._normal == self._tangential == LOAD else start

    def slopes(self) -> Slopes:
        """Return the derivatives of the loads in where the last step ended, on its side.

        They are exact where there is one friction coefficient or a displacement is controlled; of several coefficients
        under two controlled loads, they are those of the straight path in (d, U) to the same end.
        """
        return Slopes(*slopes_of_arrays(self._geometry, self._arrays, self._scale, self._start))

    @property
    def body(self) -> Body:
        """See above."""
        saturate, tolerance, compliance = self._options
        memory = Memory(*self._arrays)
        control = np.array([self._normal, self._tangential])
        return Body(self._contact, memory, self._units, control, tolerance, compliance, saturate)

    @body.setter
    def body(self, body: Body) -> None:
        self._arrays = tuple(body.memory)
        self._normal, self._tangential = map(int, body.control)
        self._start = body.memory.now[APPROACH]

    @property
    def normal_load(self) -> float:
        """Total normal load [N]."""
        return float(self._arrays[4][NORMAL_LOAD]) * self._units.load

    @property
    def tangential_load(self) -> float:
        """Total tangential load [N]."""
        return float(self._arrays[4][TANGENTIAL_LOAD]) * self._units.load

    @property
    def approach(self) -> float:
        """Approach of the highest summit from first touch [m]; negative where nothing touches."""
        return float(self._arrays[4][APPROACH]) * self._units.length

    @property
    def tangential_displacement(self) -> float:
        """Rigid tangential displacement U [m]."""
        return float(self._arrays[4][DISPLACEMENT]) * self._units.displacement

    @property
    def dissipated_energy(self) -> float:
        """Energy that friction has taken since the start, all asperities [J]."""
        return float(self._arrays[4][DISSIPATED]) * self._units.energy


def goals(target: tuple[int, float]) -> Goals:
    """Return where a channel goes that `channel` has told of."""
    return Goals(target[0], *STILL) if math.isnan(target[1]) else Goals(*target)
