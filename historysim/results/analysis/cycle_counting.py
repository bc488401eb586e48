"""Cycles: each reversal with the moment at which it is forgotten, closed loops and residue with their energies."""

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.patches import Patches
from historysim.asperities.state import State
from historysim.basics.arguments import Array
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.loads.event_sequence import is_planar
from historysim.memory.binding import LOAD, view
from historysim.memory.paths import Paths, blank_rows
from historysim.replaying import Replay
from historysim.results.analysis.recorded import describe
from historysim.results.queries import query
from historysim.results.source import query_source

TIE = 1e-12  # of labels and displacements, relative to their size
CROSSED = 2e-15  # of the quantity that becomes zero at a moment, relative to its size
MOST_ITERATIONS = 60
TURNS = {"start": "start of the cycle", "reversal": "reversal of the cycle"}
LOADS = {
    "tangential_displacement": ("tangential displacement U", "m"),
    "tangential_load": ("tangential load T", "N"),
    "normal_load": ("normal load N", "N"),
}


@query(table="cycle,start_time", planar=True)
def cycles(history: xr.Dataset, asperity: int | None = None) -> xr.Dataset:
    """Return the closed loops of the tangential load and the residue, with their energies.

    Each row is an excursion from a start, where slip began in one direction, to a reversal. It is
    closed if the contact later slips on from its start, in the other direction: then it remembers
    what it would remember without the excursion. All other rows are residue: half cycles. A row
    that has not ended yet is still remembered. The energy of a closed loop is that dissipated from
    its start to its end, without the rows that ended within this time; the sum of all rows is the
    total dissipated energy. At a constant normal load the closed rows are the full cycles of the
    rainflow count of U (ASTM E1049), and the residue its half cycles; the first loading of a
    contact, which is half a loop around zero, ends as such. At other loads no rainflow count
    exists.

    Parameters
    ----------
    history : xarray.Dataset
        With its events: from `historysim.replay`, or the result of a run with its log or embedded
        events.
    asperity : int, optional
        Label of an asperity. By default the contact as a whole, which has one friction coefficient.

    Returns
    -------
    xarray.Dataset
        Along ``cycle``, in the order of their starts: ``start_time``, ``reversal_time`` and
        ``end_time`` [s], which is NaN while the cycle is remembered; ``start_`` and ``reversal_``
        of ``tangential_displacement`` [m], ``tangential_load`` and ``normal_load`` [N]; ``_mean``
        and ``_range`` of the first two; ``dissipated_energy`` [J] and ``closed``.

    Raises
    ------
    InputError
        A history without its events, two tangential directions, several coefficients without
        ``asperity``, friction or geometry that change, inclined asperities, or an asperity that
        does not exist.
    """

    def count(job: Replay) -> xr.Dataset | InputError:
        try:
            return count_cycles(job, asperity)
        except InputError as error:
            # the search for a source passes over errors
            return error

    result = query_source(history, lambda source: count(source.job))
    if result is None:
        raise InputError(
            "cycles need the load events, and the history does not come from a file that holds them; expected the "
            "result of hs.replay, or the file of historysim run with NAME.history next to it"
        )
    if isinstance(result, InputError):
        raise result
    return result


@attrs.frozen(eq=False)
class Polyline:
    """Anchors of the springs of an asperity over their labels: vertices beyond its gap, the deepest first."""

    vertices: Array
    label: Array
    slope: Array

    def find_first(self, label: float) -> int:
        """Return the index of the first vertex at a label or beyond."""
        return int(np.searchsorted(self.label, label))


@attrs.frozen(eq=False)
class Instant:
    """A moment of the replay: position of the contact, its polyline and loads; dimensionless if no unit is named."""

    share: float  #: of the path
    time: float  #: [s]
    state: State
    approach: float
    displacement: float
    load: float  #: normal load of all asperities
    force: float  #: tangential load of all asperities
    polyline: Polyline | None  #: None where there is no contact
    values: dict[str, float]  #: `LOADS`, in SI
    energy: float  #: dissipated since the start [J]


@attrs.define(eq=False)
class Excursion:
    """A slip front: its direction, its label, and the moments at which it started and last moved."""

    number: int
    sign: float
    start: Instant
    label: float
    turn: Instant
    #: the one from whose slip it turned back; None if nothing slipped before
    reverses: "Excursion | None"
    energy: float = 0.0  #: dissipated while it was the active one [J]


@attrs.frozen(eq=False)
class Ended:
    """A row of the result."""

    excursion: Excursion
    energy: float
    closed: bool
    time: float


def count_cycles(job: Replay, asperity: int | None = None) -> xr.Dataset:
    """Return the cycles of a replay; parameters, result and errors as for `cycles`."""
    counter = CycleCounter(job, asperity)
    for block in schedule.paths(job.events):
        for number in range(block.paths.size):
            counter.follow(block.paths[number : number + 1].copy())
    return counter.dataset()


class CycleCounter:
    """Follows the slip fronts of an asperity, or of a contact with one coefficient, along the paths of a replay."""

    def __init__(self, job: Replay, asperity: int | None) -> None:
        _check(job, asperity)
        self.job, self.asperity = job, asperity
        state = job.ensemble.initial_state()
        line = state.memory.line
        contact = line.contact
        self.group = 0
        self.base = float(view(contact.gap, contact.count)[0])
        if asperity is not None:
            self.group = int(state.group[asperity])
            position = np.flatnonzero(view(contact.order, contact.count) == asperity)[0]
            self.base = float(view(contact.gap, contact.count)[position])
        self.is_single_group = contact.groups == 1
        self.friction = float(view(line.friction, contact.groups)[self.group])
        self.compliance = contact.units.stiffness / job.instrument.stiffness
        self.path: Paths | None = None
        self.excursions: list[Excursion] = []  # the deepest first
        self.ended: list[Ended] = []
        self.started, self.counted_energy = 0, 0.0
        self.here = self._instant(state, 0.0, np.nan, {}, 0.0)

    # ---- moments of a path

    def _replay_share(self, share: float) -> Instant:
        """Replay a share of the present path from its beginning."""
        path: Any = self.path
        columns = () if self.asperity is None else (self.asperity,)
        rows = blank_rows(1, len(columns) or None)
        options: dict[str, Any] = {"saturate": self.job.saturate, "instrument": self.job.instrument}
        state = self.job.ensemble.advance_along(
            self.here.state, path, rows=rows, asperities=columns, until=share, **options
        )
        if self.asperity is None:
            loads = state.normal_load, state.tangential_load
            energy = state.dissipated_energy
        else:
            loads = float(rows.normal_load[0, 0]), float(rows.tangential_load[0, 0])
            energy = float(rows.dissipated_energy[0, 0])
        values = {
            "tangential_displacement": state.tangential_displacement,
            "tangential_load": loads[1],
            "normal_load": loads[0],
        }
        begin = float(path["begin"][0])
        end = float(path["end"][0])
        return self._instant(state, share, begin + share * (end - begin), values, energy)

    def _instant(
        self, state: State, share: float, time: float, values: dict[str, float], energy: float
    ) -> Instant:
        line = state.memory.line
        approach = float(line.approach)
        polyline = None
        if approach > self.base + TIE * abs(approach):
            vertices = state.vertices(self.group)
            vertices = vertices[np.searchsorted(vertices["label"], self.base, side="right") :]
            polyline = Polyline(vertices, vertices["label"], vertices["slope"])
        position = (
            approach,
            float(line.displacement),
            float(line.normal_load),
            float(line.tangential_load),
        )
        return Instant(share, time, state, *position, polyline, values, energy)

    def _crossing(
        self, measure: Callable[[Instant], float], lower: Instant, upper: Instant, scale: float
    ) -> Instant:
        """Return the moment at which a growing measure becomes zero, by the Illinois method."""
        below = measure(lower)
        above = measure(upper)
        if above <= 0.0:
            return upper
        if below >= 0.0:
            return lower
        low = lower.share
        high = upper.share
        side = 0
        there = upper
        for _ in range(MOST_ITERATIONS):
            share = low - below * (high - low) / (above - below)
            if not low < share < high:
                break
            there = self._replay_share(share)
            value = measure(there)
            if abs(value) <= CROSSED * scale:
                break
            if value < 0.0:
                low, below = share, value
                above *= 0.5 if side < 0 else 1.0
                side = -1
            else:
                high, above = share, value
                below *= 0.5 if side > 0 else 1.0
                side = 1
        return there

    def _find_edge(self, label: float, lower: Instant, upper: Instant) -> Instant:
        """Return the moment at which the contact edge is at a label."""
        sign = 1.0 if upper.approach > lower.approach else -1.0
        return self._crossing(
            lambda there: sign * (there.approach - label), lower, upper, abs(lower.approach)
        )

    def _find_front(self, vertex: Any, sign: float, lower: Instant, upper: Instant) -> Instant:
        """Return the moment at which a slip front reaches a vertex, or sliding the start of an excursion."""
        path: Any = self.path
        rigid, compliance = 1.0, 0.0
        if not isinstance(vertex, Instant) and self.is_single_group:
            # what is controlled goes straight, and so does the measure
            rigid = 0.0 if path["tangential_control"][0, 0] == LOAD else 1.0
            compliance = self.compliance if rigid else 1.0
        if isinstance(vertex, Instant):
            label = vertex.approach
            anchor = vertex.displacement
            normal = 0.0
            tangential = 0.0
        else:
            label = float(vertex["label"])
            anchor = float(vertex["anchor"])
            normal = float(vertex["normal"])
            tangential = float(vertex["tangential"])

        def measure(there: Instant) -> float:
            slip = sign * (there.displacement - anchor) - self.friction * (there.approach - label)
            excess = sign * (there.force - tangential) - self.friction * (there.load - normal)
            return rigid * slip + compliance * excess

        reach = abs(upper.displacement) + self.friction * upper.approach
        limit = abs(upper.force) + self.friction * upper.load
        return self._crossing(measure, lower, upper, rigid * reach + compliance * limit)

    # ---- fronts along a path

    def follow(self, path: Paths) -> None:
        """Follow the fronts along one straight path."""
        path["parts"], path["recorded"], path["first_row"] = 1, 1, 0
        self.path = path
        end = self._replay_share(1.0)
        here = attrs.evolve(
            self.here,
            share=0.0,
            time=float(path["begin"][0]),
            values=self.here.values or end.values,
        )
        while here.share < 1.0:
            there = self._next_cut(here, end)
            self._move(here, there)
            here = there
        self.here = end

    def _next_cut(self, here: Instant, end: Instant) -> Instant:
        """Return the end of the path, or the moment before at which the edge meets a vertex, or the asperity."""
        if here.polyline is None:
            begins_apart = here.approach < self.base - TIE * abs(self.base + end.approach)
            return (
                self._find_edge(self.base, here, end)
                if begins_apart and end.polyline is not None
                else end
            )
        if end.approach >= here.approach:
            return end
        tie = TIE * here.approach
        inner = here.polyline.find_first(here.approach - tie) - 1
        label = float(here.polyline.label[inner]) if inner >= 0 else self.base
        return self._find_edge(label, here, end) if end.approach < label - tie else end

    def _move(self, here: Instant, there: Instant) -> None:
        """Follow the fronts while the edge stays on the last segment of the polyline."""
        sign = self._slip_direction(here, there)
        polyline = here.polyline
        if sign == 0.0 and not self.excursions and there.energy > self.counted_energy:
            # on a path that is curved in the displacements springs may slip and stick again
            sign = 1.0 if there.displacement >= here.displacement else -1.0
        if sign == 0.0:
            self._count_energy(there)
        else:
            active = self.excursions[-1] if self.excursions else None
            slope = sign * self.friction
            edge_slope = 0.0 if polyline is None else polyline.slope[-1]
            goes_on = active is not None and active.sign == sign and edge_slope == slope
            if not goes_on:
                turns_back = active is not None and active.sign == -sign and edge_slope == -slope
                reverses = active if turns_back else None
                self.excursions.append(
                    Excursion(self.started, sign, here, here.approach, here, reverses)
                )
                self.started += 1
            front = self._front(there, slope)
            if polyline is not None:
                self._pass_older_fronts(here, there, polyline, front)
            self._count_energy(there)
            self.excursions[-1].label = front
            self.excursions[-1].turn = there
        if polyline is not None:
            self._withdraw(polyline, there)

    def _slip_direction(self, here: Instant, there: Instant) -> float:
        """Return the direction in which springs slip, 1 or -1; 0 if all stick."""
        rise = there.approach - max(here.approach, self.base)
        if there.polyline is None and (here.polyline is None or rise >= 0.0):
            return 0.0
        moved = there.displacement - here.displacement
        beyond = abs(moved) - self.friction * rise
        if rise < 0.0 and here.polyline is not None:
            edge = here.polyline.vertices[-1]
            moved = there.displacement - (edge["anchor"] + edge["slope"] * rise)
            beyond = abs(moved)
        reach = abs(here.displacement) + abs(there.displacement) + self.friction * there.approach
        return float(np.sign(moved)) if beyond > 1e-3 * TIE * reach else 0.0

    def _front(self, there: Instant, slope: float) -> float:
        """Return the label of the slip front at the end of a move."""
        polyline = there.polyline
        if polyline is None:
            return self.base
        if polyline.slope[-1] != slope:
            return there.approach
        return float(polyline.label[-2]) if polyline.label.size > 1 else self.base

    def _pass_older_fronts(
        self, here: Instant, there: Instant, polyline: Polyline, front: float
    ) -> None:
        """End the excursions whose vertices the active front passes, in this order."""
        tie = TIE * max(here.approach, there.approach)
        moment = here
        while len(self.excursions) > 1:
            active = self.excursions[-1]
            older = self.excursions[-2]
            sign = active.sign
            is_deep = older.label <= self.base + tie
            if front > older.label + tie:
                return
            follows = len(self.excursions) > 2 and self.excursions[-3] is older.reverses
            if older.sign == sign:
                # the front arrives at a zone that slipped in its direction
                outer = polyline.find_first(older.label + tie)
                if outer < polyline.label.size:
                    moment = self._find_front(polyline.vertices[outer], sign, moment, there)
                self._count_energy(moment)
                active.turn = moment
                self._end(active, closed=False, time=moment.time)
                self.excursions.pop()
                continue
            if is_deep:
                # all springs slide: a loop closes where the contact would be without it
                start = older.start
                beyond = sign * (there.displacement - start.displacement)
                beyond -= self.friction * (there.approach - start.approach)
                reach = (
                    abs(there.displacement)
                    + abs(start.displacement)
                    + self.friction * there.approach
                )
                if beyond < -TIE * reach:
                    return
                moment = self._find_front(start, sign, moment, there)
                closed = follows
            else:
                index = polyline.find_first(older.label - tie)
                moment = self._find_front(polyline.vertices[index], sign, moment, there)
                closed = follows and polyline.slope[index] == sign * self.friction
            if not closed:
                self._end(older, closed=False, time=moment.time)
                del self.excursions[-2]
                continue
            self._count_energy(moment)
            older.energy += active.energy
            self._end(older, closed=True, time=moment.time)
            del self.excursions[-2:]

    def _withdraw(self, polyline: Polyline, there: Instant) -> None:
        """End the excursions whose fronts the contact edge has passed."""
        tie = TIE * max(there.approach, float(polyline.label[-1]))
        while self.excursions:
            outer = self.excursions[-1]
            if there.polyline is not None and outer.label < there.approach - tie:
                return
            index = min(polyline.find_first(outer.label - tie), polyline.label.size - 1)
            lies_on_slope = (
                outer.label > self.base + tie
                and polyline.slope[index] == -outer.sign * self.friction
            )
            follows = len(self.excursions) > 1 and self.excursions[-2] is outer.reverses
            self._end(outer, closed=lies_on_slope and follows, time=there.time)
            self.excursions.pop()

    def _count_energy(self, there: Instant) -> None:
        """Add what was dissipated up to a moment to the active excursion."""
        if self.excursions:
            self.excursions[-1].energy += there.energy - self.counted_energy
            self.counted_energy = there.energy

    def _end(self, excursion: Excursion, *, closed: bool, time: float) -> None:
        self.ended.append(Ended(excursion, excursion.energy, closed, time))

    # ---- result

    def dataset(self) -> xr.Dataset:
        """Return the rows so far in the order of their starts."""
        remembered = [
            Ended(excursion, excursion.energy, False, np.nan) for excursion in self.excursions
        ]
        rows = sorted([*self.ended, *remembered], key=lambda row: row.excursion.number)
        instants = {
            "start": [row.excursion.start for row in rows],
            "reversal": [row.excursion.turn for row in rows],
        }
        data: dict[str, Any] = {}
        for turn, text in TURNS.items():
            times = np.array([instant.time for instant in instants[turn]], dtype=float)
            data[f"{turn}_time"] = describe("cycle", times, f"time at the {text}", "s")
        end_time = np.array([row.time for row in rows], dtype=float)
        data["end_time"] = describe(
            "cycle", end_time, "time at which it is forgotten, NaN while remembered", "s"
        )
        for name, (quantity, unit) in LOADS.items():
            first, second = (
                np.array([instant.values[name] for instant in instants[turn]], dtype=float)
                for turn in TURNS
            )
            data[f"start_{name}"] = describe(
                "cycle", first, f"{quantity} at the start of the cycle", unit
            )
            data[f"reversal_{name}"] = describe(
                "cycle", second, f"{quantity} at the reversal of the cycle", unit
            )
            if name != "normal_load":
                data[f"{name}_mean"] = describe(
                    "cycle", (first + second) / 2, f"mean of the {quantity}", unit
                )
                data[f"{name}_range"] = describe(
                    "cycle", abs(second - first), f"range of the {quantity}", unit
                )
        energy = np.array([row.energy for row in rows], dtype=float)
        # springs may slip while no excursion is active, on a path that is curved in the
        # displacements
        energy[-1:] += self.here.energy - self.counted_energy
        data["dissipated_energy"] = describe(
            "cycle", energy, "energy dissipated by the cycle alone", "J"
        )
        closed = np.array([row.closed for row in rows], dtype=bool)
        data["closed"] = describe("cycle", closed, "closed loop (1), or residue: half a cycle (0)")
        subject = "the contact as a whole" if self.asperity is None else f"asperity {self.asperity}"
        coords = {
            "cycle": describe("cycle", np.arange(len(rows)), "cycle, in the order of the starts")
        }
        return xr.Dataset(data, coords, {"title": f"Cycles of {subject}"})


def _check(job: Replay, asperity: int | None) -> None:
    """Check that cycles of a replay are defined; InputError with the reason and the remedy otherwise."""
    ensemble: Any = job.ensemble
    if is_planar(job.events):
        raise InputError(
            "cycles are defined along one line, and the loads have two tangential directions, where the memory is a "
            "field and no reversal closes a loop; expected one number for each tangential load or displacement"
        )
    if not isinstance(ensemble, Ensemble | Patches):
        raise InputError(
            "cycles need level asperities, and these are inclined; expected hs.Ensemble, without slopes"
        )
    if ensemble.attracts:
        raise InputError(
            "cycles need a normal load that rises with the approach, and with attraction the contact jumps at some "
            "loads; expected a contact without attraction. `energy_per_cycle` gives the energy of each friction loop"
        )
    laws = getattr(ensemble, "laws", {})
    if laws or getattr(ensemble, "follow_sliding", False):
        cause = " and ".join(laws) or "follow_sliding"
        raise InputError(
            f"cycles need contacts that do not evolve, and these have a law of {cause}, with which no loop closes; "
            "expected an ensemble with constant coefficients, without wear and yielding. `energy_per_cycle` gives the "
            "energy of each friction loop"
        )
    if schedule.friction_changes(job.events) or schedule.changes_geometry(job.events):
        raise InputError(
            "cycles need constant friction and geometry, and an event changes them, so that no loop closes; expected "
            "events without such a change. `energy_per_cycle` gives the energy of each friction loop"
        )
    if asperity is None:
        groups = ensemble.initial_state().memory.line.contact.groups
        if groups > 1:
            raise InputError(
                f"the asperities have {groups:,} different friction coefficients, and so no common cycles; expected "
                "asperity=, the label of one of them (--asperity)"
            )
        return
    if isinstance(ensemble, Patches):
        raise InputError(
            "asperity: patches of normal curves share one memory; expected cycles() of the whole contact"
        )
    count = len(ensemble)
    is_label = isinstance(asperity, int | np.integer) and not isinstance(asperity, bool)
    if not is_label or not 0 <= asperity < count:
        raise InputError(
            f"asperity {asperity!r} does not exist; expected a label from 0 to {count - 1:,}"
        )
