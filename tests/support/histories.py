"""Random load histories within the friction limit: mixed control that switches midway, lift-off, friction changes."""

import copy
import math
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from scipy.optimize import brentq
from springs import Contact, SpringRow

import historysim as hs
from historysim.loads.events import (
    FrictionChange,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)

# how much of the friction limit a history asks for: one coefficient, and several
SINGLE_MARGIN = 0.95
MIXED_MARGIN = 0.9

# the worked numbers of the theory: E* = R = 1, G* = 0.25, μ = 0.5, straight ramps from N = 0.01, T
# = 0; each to N, T, then the displacement there, and the energy dissipated so far, its last digit
# cut off
TABLE = [
    (0.01, 0.003, 8.757317e-3, 1.310944e-6),
    (0.01, -0.002, -5.420920e-3, 2.660305e-6),
    (0.02, -0.002, -5.420920e-3, 2.660305e-6),
    (0.02, 0.004, 8.431302e-3, 6.551350e-6),
    (0.012, 0.004, 1.1233324e-2, 1.392732e-5),
    (0.012, -0.001, -1.827260e-3, 1.489826e-5),
    (0.005, -0.001, -3.483260e-3, 1.640487e-5),
]


class Move(NamedTuple):
    """One joint path of both channels to their targets; `friction` then replaces the coefficients.

    The kinds are "load" [N] and "displacement" [m]; a friction change acts after the arrival, with
    both channels held.
    """

    normal_kind: str
    normal_value: float
    tangential_kind: str
    tangential_value: float
    friction: tuple[float, ...] | None = None

    @property
    def targets(self):
        """Arguments of `advance`."""
        return {
            f"normal_{self.normal_kind}": self.normal_value,
            f"tangential_{self.tangential_kind}": self.tangential_value,
        }

    def straight(self, contact):
        """Return the move to the same place, straight in (approach, U)."""
        if self.normal_kind == "displacement":
            return self
        return self._replace(
            normal_kind="displacement", normal_value=float(contact.approach(self.normal_value))
        )

    @property
    def ramps(self):
        """True if both loads are prescribed."""
        return self.normal_kind == self.tangential_kind == "load"


def build_ensemble(contact):
    """Return the ensemble of a contact of the springs."""
    pair = hs.MaterialPair.from_moduli(
        contact_modulus=contact.contact_modulus, shear_modulus=contact.shear_modulus
    )
    return hs.Ensemble(pair, contact.summit_height, contact.summit_radius, contact.friction)


class History(NamedTuple):
    """Moves of a contact below a largest normal load [N], behind an instrument of a lateral stiffness [N/m]."""

    contact: Contact
    moves: list[Move]
    largest_load: float
    stiffness: float = math.inf

    @property
    def ensemble(self):
        return build_ensemble(self.contact)

    @property
    def instrument(self):
        return hs.Instrument(self.stiffness)

    @property
    def limit(self):
        """Friction limit under the largest normal load [N], with the largest coefficients of the history."""
        return self._strongest * self.contact.limit(self.contact.approach(self.largest_load))

    @property
    def slide(self):
        """Largest displacement at which the last asperity slides [m]."""
        contact = self.contact
        approach = contact.approach(self.largest_load)
        return self._strongest * contact.compliance_ratio * contact.friction.max() * approach

    @property
    def _strongest(self):
        return max(
            [
                1.0,
                *(
                    float(np.max(move.friction / self.contact.friction))
                    for move in self.moves
                    if move.friction
                ),
            ]
        )

    def replay(self, **options):
        """Replay the moves as events; every asperity is recorded."""
        options = {"record": "all", "instrument": self.instrument, **options}
        return hs.replay(self.ensemble, to_events(self.moves), **options)

    def states(self, state=None):
        """Yield the state after each move."""
        ensemble = self.ensemble
        state = ensemble.initial_state() if state is None else state
        for move in self.moves:
            state = ensemble.advance(
                state, **move.targets, friction=move.friction, instrument=self.instrument
            )
            yield state

    def straight(self):
        """Return the history with every path straight in (approach, U): none then depends on how it is cut."""
        return self._replace(moves=[move.straight(self.contact) for move in self.moves])

    def behind(self, stiffness):
        """Return the history behind an instrument [N/m], whose drive varies as much farther as the instrument bends."""
        ratio = self.limit / self.slide
        stretch = (1 + ratio / stiffness) / (1 + ratio / self.stiffness)
        moves = [
            move._replace(tangential_value=move.tangential_value * stretch)
            if move.tangential_kind == "displacement"
            else move
            for move in self.moves
        ]
        return self._replace(moves=moves, stiffness=stiffness)


class _RandomSource:
    def __init__(self, rng):
        self._rng = rng

    def between(self, low, high):
        return float(self._rng.uniform(low, high))

    def pick(self, options):
        return options[self._rng.integers(len(options))]


class _DrawnSource:
    def __init__(self, draw):
        self._draw = draw

    def between(self, low, high):
        return self._draw(st.floats(low, high))

    def pick(self, options):
        return self._draw(st.sampled_from(options))


class _Writer:
    """Writes moves one after another and knows the loads that they lead to.

    The tangential load is unknown (None) after a displacement: it is then only known to be within
    the limit.
    """

    def __init__(self, source, contact, largest_load):
        self.source = source
        self.contact = contact
        self.largest_load = largest_load
        self.largest_approach = contact.approach(largest_load)
        self.slide = contact.compliance_ratio * contact.friction.max() * self.largest_approach
        self.normal_load = 0.0
        self.tangential_load = 0.0

    def move(self):
        action = self.source.pick(
            ("reload", "reload", "reload", "reload", "hold", "hold", "hold", "lift")
        )
        normal_kind = self.source.pick(("load", "displacement"))
        tangential_kind = self.source.pick(("load", "displacement"))
        if action == "lift" and self.normal_load > 0:
            return self._lift(normal_kind)
        held = action == "hold" and self.normal_load > 0
        # a wide range of loads, so that low asperities come and go
        normal_load = (
            self.normal_load if held else self.largest_load * self.source.between(0.15, 1.0) ** 2
        )
        return self._touch(normal_kind, normal_load, tangential_kind)

    def friction(self):
        """Return new coefficients that hold the present tangential load."""
        lowest = 0.6
        if self.tangential_load is not None:
            held = MIXED_MARGIN * self.contact.limit(self.contact.approach(self.normal_load))
            lowest = max(lowest, min(abs(self.tangential_load) / held, 1.0)) if held > 0 else lowest
        if np.ptp(self.contact.friction) == 0:
            factors = np.full(self.contact.friction.shape, self.source.between(lowest, 1.4))
        else:
            factors = np.array([self.source.between(lowest, 1.4) for _ in self.contact.friction])
        self.contact = self.contact._replace(friction=self.contact.friction * factors)
        return tuple(self.contact.friction.tolist())

    def _lift(self, normal_kind):
        # U under a tangential load is not determined once nothing touches
        gap = self.source.between(0.01, 0.5) * self.largest_approach
        self.normal_load = self.tangential_load = 0.0
        return Move(
            normal_kind,
            0.0 if normal_kind == "load" else -gap,
            "displacement",
            self._displacement(),
        )

    def _touch(self, normal_kind, normal_load, tangential_kind):
        approach = self.contact.approach(normal_load)
        if tangential_kind == "displacement":
            value, tangential_load = self._displacement(), None
        else:
            margin = SINGLE_MARGIN if np.ptp(self.contact.friction) == 0 else MIXED_MARGIN
            value = tangential_load = (
                margin * self.source.between(-1.0, 1.0) * self.contact.limit(approach)
            )
            if not self._ramp_is_safe(normal_load, tangential_load):
                # straight in (approach, U) instead: such a path asks for nothing on its way
                normal_kind = "displacement"
        self.normal_load, self.tangential_load = normal_load, tangential_load
        normal_value = normal_load if normal_kind == "load" else approach
        return Move(normal_kind, float(normal_value), tangential_kind, float(value))

    def _ramp_is_safe(self, normal_load, tangential_load):
        """With one coefficient the limit is straight in N, and a ramp whose ends are within it stays within."""
        if np.ptp(self.contact.friction) == 0:
            return True
        if self.tangential_load is None:
            return False
        share = np.linspace(0, 1, 65)
        approaches = self.contact.approach(
            self.normal_load + share * (normal_load - self.normal_load)
        )
        loads = self.tangential_load + share * (tangential_load - self.tangential_load)
        return np.all(np.abs(loads) <= (MIXED_MARGIN + 0.05) * self.contact.limit(approaches))

    def _displacement(self):
        return self.source.between(-1.3, 1.3) * self.slide


def random_moves(
    rng, contact, largest_load, count=10, friction_changes=False, source=_RandomSource
):
    """Return moves drawn from a numpy Generator; their normal load stays below `largest_load` [N]."""
    source = source(rng)
    writer = _Writer(source, contact, largest_load)
    moves = []
    for _ in range(count):
        move = writer.move()
        if friction_changes and source.pick((False, False, True)):
            move = move._replace(friction=writer.friction())
        moves.append(move)
    return moves


def random_contact(rng, count, several_coefficients=False):
    """Return asperities with heights and radii that scatter about an approach and a radius of order one."""
    friction = rng.uniform(0.2, 0.6, count if several_coefficients else 1)
    height = rng.normal(0.0, 0.01, count)
    return Contact.build(1.0, 0.25, height, rng.lognormal(0.0, 0.3, count), friction)


@st.composite
def contacts(draw, counts=(1, 3, 8), groups=(1, 3)):
    """Draw asperities of unequal height and radius with one coefficient or three.

    θ and the largest radius differ from 1, so that a forgotten factor shows.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count, several = draw(st.sampled_from(counts)), draw(st.sampled_from(groups)) > 1
    contact = random_contact(rng, count)._replace(contact_modulus=2.0, shear_modulus=0.3)
    friction = rng.choice([0.25, 0.4, 0.55], count) if several else contact.friction
    return contact._replace(friction=friction)


@st.composite
def histories(
    draw,
    counts=(1, 3, 8),
    groups=(1, 3),
    steep=(False, True),
    compliance=False,
    extremes=False,
    longest=10,
):
    """Draw a History.

    Parameters
    ----------
    counts, groups : sequence of int
        Numbers of asperities and of friction coefficients to choose from.
    steep : sequence of bool
        Whether friction changes, which leaves polylines steeper than the limit.
    compliance : bool
        Whether an instrument is in series, of a thirtieth to thirty times the lateral stiffness of
        the contact.
    extremes : bool
        Draw every number by itself, with a preference for 0 and for the ends of its range.
    longest : int
        Most moves.
    """
    contact = draw(contacts(counts, groups))
    rng, source = np.random.default_rng(draw(st.integers(0, 2**32 - 1))), _RandomSource
    if extremes:
        rng, source = draw, _DrawnSource
    largest_load = 0.02 * contact.friction.size
    count = draw(st.integers(1, longest)) if extremes else longest
    moves = random_moves(rng, contact, largest_load, count, draw(st.sampled_from(steep)), source)
    history = History(contact, _touch_straight(contact, moves), largest_load)
    if not compliance:
        return history
    if np.ptp(contact.friction) > 0:
        # the limit of a ramp of both loads bends
        straight = [move.straight(contact) if move.ramps else move for move in history.moves]
        history = history._replace(moves=straight)
    return history.behind(10 ** draw(st.floats(-1.5, 1.5)) * history.limit / history.slide)


def _touch_straight(contact, moves):
    """With several coefficients the limit of a ramp of loads from nothing bends: touch along (approach, U) instead."""
    written, loaded = [], False
    for move in moves:
        bends = move.ramps and not loaded and np.ptp(contact.friction) > 0
        written.append(move.straight(contact) if bends else move)
        loaded = move.normal_value > 0
    return written


class DrivenRow(SpringRow):
    """Springs behind one more: a prescribed displacement is that of the drive, and U is sought by bisection.

    They take sub-steps only where these matter: on ramps of both loads.
    """

    def __init__(self, *arguments, stiffness=math.inf):
        super().__init__(*arguments)
        self.stiffness = stiffness
        self.drive = None

    def apply(self, normal, tangential, substeps=400):
        self.drive = None
        if tangential[0] == "load" or math.isinf(self.stiffness):
            super().apply(
                normal, tangential, substeps if normal[0] == tangential[0] == "load" else 1
            )
            return
        self.drive = tangential[1]
        end = normal[1] if normal[0] == "displacement" else self._approach_at(normal[1])

        def excess(displacement):
            trial = copy.deepcopy(self)
            SpringRow.apply(trial, ("displacement", end), ("displacement", displacement), 1)
            return displacement + trial.total_tangential_load / self.stiffness - self.drive

        bent = 1.01 * self.contact.limit(max(end, 0.0)) / self.stiffness
        displacement = self.drive
        if bent > 0:
            displacement = brentq(
                excess, self.drive - bent, self.drive + bent, xtol=1e-15 * bent, rtol=1e-15
            )
        super().apply(("displacement", end), ("displacement", displacement), 1)

    def friction_change(self, friction, missing=None):
        if self.drive is not None:

            def missing(displacement, load):
                return displacement + load / self.stiffness - self.drive

        super().friction_change(friction, missing)


def to_events(moves):
    """Return the events of a history: a move arrives per unit of time; a friction change takes a unit of hold."""
    normal = {"load": NormalLoad, "displacement": NormalDisplacement}
    tangential = {"load": TangentialLoad, "displacement": TangentialDisplacement}
    events = []
    time = 0.0
    for move in moves:
        channels = (
            (normal[move.normal_kind], move.normal_value),
            (tangential[move.tangential_kind], move.tangential_value),
        )
        events += [channel(time, value) for channel, value in channels]
        time += 1.0
        if move.friction is not None:
            events += [channel(time, value) for channel, value in channels]
            events.append(FrictionChange(time, move.friction))
            time += 1.0
    return events


def follow(row, moves, substeps=400):
    """Carry a SpringRow through the moves; yield it after each distinct time of `to_events`."""
    for move in moves:
        row.apply(
            (move.normal_kind, move.normal_value),
            (move.tangential_kind, move.tangential_value),
            substeps,
        )
        yield row
        if move.friction is not None:
            # the coefficients are new, the loads are not: U follows at a fixed approach
            held = move.tangential_value if move.tangential_kind == "load" else None
            row.friction_change(
                move.friction, None if held is None else lambda _, load, held=held: load - held
            )
            yield row
