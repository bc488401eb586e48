"""The instant at which each asperity first slides, between recorded steps, and the order that follows.

The last spring of an asperity to slip is the one in its middle, which has stuck since the asperity touched. It is still
anchored at the displacement V_t of that moment, whatever has happened since, so that the asperity slides as soon as

    |V - V_t| = θ μ (d - h),    θ = E*/(4 G*),

with the tangential displacement V, the approach d of the contact, and h, that at which the asperity touches (the slip
front of Mindlin and Jäger has come to its middle). Paths are straight in d and V, where this is one division; where
both loads are controlled they are straight in the loads, and the share of the path is searched for.

That holds as long as springs further out give way first. After a fall of friction what slipped before is steeper than
the new coefficient, and the slip front reaches the middle later than the spring there meets its limit: of asperities
that were in contact then, the state itself is asked.
"""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.asperity import SlipState
from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.loads import schedule
from historysim.loads.events import FrictionChange, LoadEvent
from historysim.loads.samples import SampledLoads
from historysim.memory.binding import LOAD
from historysim.memory.paths import Goals, Paths, paths_to, unrecorded
from historysim.memory.rows import Rows, blank_rows
from historysim.results.analysis import history_summary, slips
from historysim.results.analysis.recorded import check_recorded
from historysim.results.origin import ask_origin

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from historysim.asperities.state import EnsembleState
    from historysim.replaying import Replay
    from historysim.results.origin import Traceable

PIECES, PIECES_HELD = 8, 64
"""Pieces of a path of a tangential load, in each of which the displacement goes one way; and where the load may be held
at the limit on the way. One in which the contact slides, holds, and turns round tells the instant to its length."""
NEAR = 1e-8
"""Share of the preliminary displacement below which the state itself says whether an asperity slides: at the friction
limit a load that is known to rounding gives the displacement to the power of 2/3 of that."""
SOON = 1e-6
"""Share of a piece after which it is seen whether an asperity that has just touched slides at once."""
CLOSEST = 4 * float(np.finfo(np.float64).eps)
"""Relative width of an interval in which a root is known."""
SECTIONS, LATEST = 16, 1e-9
"""Sections of an interval at which a state is asked whether asperities slide; the share of a path to which it is."""
LOST = SlipState.GROSS_SLIP, SlipState.SEPARATED
MOST_TRIALS = 150
ROWS_AT_ONCE = 4096


def slide_times(history: "Traceable") -> Floats | None:
    """Return the instants at which asperities first slide (asperity) [s]; NaN for never.

    Parameters
    ----------
    history : xarray.Dataset, or a result in its file
        A whole history with asperities.

    Returns
    -------
    array (asperity), or None
        None where the history does not say what it was made from, begins later, or is of patches, of asperities that
        evolve, or of events that are neither loads nor changes of friction at once: then steps are all that is known.

    Raises
    ------
    InputError
        A history without asperities.
    """
    check_recorded(history, "slip_state")
    labels, time = history["asperity"].values, history["time"].values
    found = ask_origin(history, lambda origin: _instants(origin.replay(), labels, float(time[0])))
    return None if found is None else np.where(found > time[-1], np.nan, found)


def first_slips(history: "xr.Dataset") -> "xr.Dataset":
    """Return when each asperity first slips, in part or whole, when it first slides, and its rank among the others.

    A *slip* is any, also of a thin annulus at the edge of the contact, which begins with the first tangential load; a
    contact *slides* when nothing of it sticks. The instant at which it slides is exact, also between recorded steps and
    where the contact is lost before the next one. Where it is not known (see `slide_times`), and for slips, what
    happens between two recorded steps counts at the second one.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities or patches.

    Returns
    -------
    xarray.Dataset
        Along ``asperity``: ``slip_step`` and ``slide_step``, the positions of the first steps at or after that, -1 for
        never; ``slip_time`` and ``slide_time`` [s], NaN for never; ``slip_rank`` and ``slide_rank``, 0 for those that
        come first, 1 more for every asperity before, -1 for never. The attribute ``instants`` of ``slide_time`` says
        whether it is "exact" or that of a "recorded step".

    Raises
    ------
    InputError
        A history without asperities.
    """
    return slips.first_slips(history, slide_times(history))


def slides_first(history: "xr.Dataset") -> Integers:
    """Return the labels of the asperities that slide, in the order in which they begin to.

    The order is that of the instants at which they slide, between recorded steps, too. Where these are not known (see
    `slide_times`), it is that of `historysim.results.analysis.slides_first`.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.

    Returns
    -------
    array (asperity that slides) of int
        Labels; the first is that of the asperity that slides first. Empty where none slides.

    Raises
    ------
    InputError
        A history without asperities, or of a version that did not record changes of friction.
    """
    return slips.slides_first(history, slide_times(history))


def summary(history: "Traceable") -> list[tuple[str, str]]:
    """Return in a few lines what happened, as `historysim.results.analysis.summary` does, with the instants of sliding.

    Parameters
    ----------
    history : xarray.Dataset, or a result in its file

    Returns
    -------
    list of (label, text)
    """
    times = slide_times(history) if "slip_state" in history else None
    return history_summary.summary(history, times)


@attrs.frozen(eq=False)
class _Piece:
    """A piece of a path, from one pair of approach and displacement to the next.

    Attributes
    ----------
    path : int
        The path that it is of.
    start, end : float
        Shares of the path.
    approach, displacement : array (2)
        At its two ends [m].
    straight : bool
        Whether it is straight in both.
    """

    path: int
    start: float
    end: float
    approach: Floats
    displacement: Floats
    straight: bool

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """Approach and displacement at its two ends [m]."""
        return self.approach, self.displacement


def _instants(job: "Replay", labels: Integers, begin: float) -> Floats | None:
    """Return the instants at which asperities of a replay first slide; None where they are not known to be exact."""
    ensemble, events = job.ensemble, job.events
    if ensemble.curves is not None or ensemble.evolves or events[0].time != begin:
        return None
    # what else happens may erase a memory, or change friction on the way
    if not isinstance(events, SampledLoads) and not all(isinstance(one, LoadEvent | FrictionChange) for one in events):
        return None
    seen = _Sliding(job, labels)
    state, now = ensemble.initial_state(), begin
    for segment in schedule.segments(events, 1, ROWS_AT_ONCE):
        ends = np.array([events[number].time for number in segment.event])
        state = seen.follow(state, segment.paths, np.append(now, ends))
        now = float(ends[-1])
        if segment.change is not None:
            state = segment.change.act(ensemble, state, saturate=job.saturate, instrument=job.instrument)
            seen.settle(state, now)
        if not np.isnan(seen.time).any():
            break
    return seen.time


class _Sliding:
    """Which asperities have slid so far, and where the others are anchored.

    Attributes
    ----------
    time : array (asperity)
        When each has first slid [s]; not a number as long as it has not.
    """

    def __init__(self, job: "Replay", labels: Integers) -> None:
        self.job, self.labels = job, labels
        self.touch = job.ensemble.first_touch[labels]
        self.friction = job.ensemble.friction[labels]
        # the displacement at which each touched; not a number where it does not touch
        self.anchor = np.full(labels.size, np.nan)
        self.time = np.full(labels.size, np.nan)
        # friction has fallen since they touched, after tangential loads
        self.steep = np.zeros(labels.size, dtype=np.bool_)
        self.still = True

    def follow(self, state: "EnsembleState", paths: Paths, times: Floats) -> "EnsembleState":
        """Go along paths that begin and end at times (path + 1), and return the state at their end."""
        pieces, after = _walked(self.job, state, paths)
        way = _Way(self.job, state, paths)
        for piece in pieces:
            self.still &= not piece.displacement.any()
            slid, share = self._slid(way, piece)
            self.time[slid] = times[piece.path] + share * (times[piece.path + 1] - times[piece.path])
        return after

    def settle(self, state: "EnsembleState", now: float) -> None:
        """Look which asperities a change of friction has made slide."""
        before, self.friction = self.friction, state.friction[self.labels]
        if not self.still:
            self.steep |= (self.friction < before) & ~np.isnan(self.anchor)
        inside = self._inside()
        slides, _ = self._slides(inside, state.approach, state.tangential_displacement, lambda: state)
        self.time[inside[slides]] = now
        steep = self._inside(steep=True)
        self.time[steep[_slid(self.job, state, self.labels[steep])]] = now

    def _slid(self, way: "_Way", piece: _Piece) -> tuple[Integers, Floats]:
        """Return which asperities slide in a piece, and at which share of its path."""
        begin = np.full(self.labels.size, piece.start)
        arriving = np.flatnonzero(np.isnan(self.time) & np.isnan(self.anchor) & (self.touch < piece.approach[1]))
        if arriving.size:
            begin[arriving], self.anchor[arriving] = way.touched(piece, self.touch[arriving])
        inside = self._inside()
        slides, near = self._slides(
            inside, piece.approach[1], piece.displacement[1], lambda: way.state(piece.path, piece.end)
        )
        slid = inside[slides]
        share = np.empty(0)
        if slid.size:
            reach = np.where(near[slides], 1.0 - NEAR, 1.0) * self._reach(slid)
            share = way.reached(piece, begin[slid], self.touch[slid], self.anchor[slid], reach)
            slid, share = self._not_lifted(way, piece, slid, share)
        late, when = self._late(way, piece)
        left = self.touch >= piece.approach[1]
        self.anchor[left], self.steep[left] = np.nan, False
        return np.append(slid, late), np.append(share, when)

    def _late(self, way: "_Way", piece: _Piece) -> tuple[Integers, Floats]:
        """Return which of those that the state tells slide in a piece, and at which share of its path.

        The slip front goes inward along a piece, so that what has slid once slides until the contact is lost.
        """
        steep = self._inside(steep=True)
        if not steep.size:
            return steep, np.empty(0)
        waiting = [(steep[way.slid(piece, np.array([piece.end]), self.labels[steep])[0]], piece.start, piece.end)]
        found: list[tuple[int, float]] = []
        while waiting:
            which, start, end = waiting.pop()
            shares = np.linspace(start, end, SECTIONS + 1)
            if not which.size or end - start <= LATEST or not (np.diff(shares) > 0).all():
                found += [(int(one), end) for one in which]
                continue
            first = np.append(way.slid(piece, shares[1:-1], self.labels[which]), np.ones((1, which.size)), axis=0)
            section = first.argmax(axis=0)
            waiting += [(which[section == one], shares[one], shares[one + 1]) for one in np.unique(section)]
        if not found:
            return np.empty(0, dtype=np.int64), np.empty(0)
        late, share = (np.array(values) for values in zip(*found, strict=True))
        return self._not_lifted(way, piece, late, share)

    def _not_lifted(self, way: "_Way", piece: _Piece, which: Integers, share: Floats) -> tuple[Integers, Floats]:
        """Return those that slide, with their shares, without what was never strained and is lifted off as it stuck."""
        touch = self.touch[which]
        depth = way.at(piece, share)[0] - touch
        whole = np.maximum(piece.approach.max() - touch, 0.0)
        slides = (touch < piece.approach[1]) | (depth > NEAR * whole)
        return which[slides], share[slides]

    def _inside(self, *, steep: bool = False) -> Integers:
        """Return which asperities are in contact and have not yet slid: those that are steep, or the others."""
        return np.flatnonzero(np.isnan(self.time) & ~np.isnan(self.anchor) & (self.steep == steep))

    def _reach(self, which: Integers) -> Floats:
        """Return the preliminary displacement over the approach of each, θμ."""
        reach: Floats = self.job.ensemble.pair.displacement_ratio * self.friction[which]
        return reach

    def _slides(
        self, which: Integers, approach: float, displacement: float, state: "Callable[[], EnsembleState]"
    ) -> tuple[Booleans, Booleans]:
        """Return which of those in contact slide where a piece ends, and of which the state there has to say so."""
        moved = np.abs(displacement - self.anchor[which])
        held = self._reach(which) * (approach - self.touch[which])
        near = np.abs(moved - held) <= NEAR * np.maximum(moved, np.abs(held))
        slides = (moved > held) & ~near
        if near.any():
            there = state()
            for one in np.flatnonzero(near):
                asperity = self.job.ensemble.asperity(int(self.labels[which[one]]), there)
                slides[one] = asperity.slip_state == SlipState.GROSS_SLIP
        return slides, near


@attrs.define(eq=False)
class _Way:
    """Paths whose states are asked for in their order."""

    job: "Replay"
    here: "EnsembleState"
    paths: Paths
    done: int = 0

    def state(self, path: int, share: float) -> "EnsembleState":
        """Return the state at a share of a path, which is no earlier one than before."""
        self._begin(path)
        return self._walk(unrecorded(self.paths[path : path + 1]), until=share)

    def touched(self, piece: _Piece, touch: Floats) -> tuple[Floats, Floats]:
        """Return the shares of the path at which asperities touch in a piece, and the displacements there."""
        (d0, d1), (v0, v1) = piece.approach, piece.displacement
        if piece.straight:
            part = (touch - d0) / (d1 - d0)
            return piece.start + part * (piece.end - piece.start), v0 + part * (v1 - v0)
        start = np.full(touch.size, piece.start)
        share = _root(lambda share, h: self.at(piece, share)[0] - h, start, piece.end, touch)
        return share, self.at(piece, share)[1]

    def slid(self, piece: _Piece, shares: Floats, labels: Integers) -> Booleans:
        """Return which asperities slide, or are lost, at ascending shares of the path of a piece (share, asperity)."""
        whole = self.paths[piece.path : piece.path + 1]
        if whole["normal_control"][0] != LOAD or piece.straight:
            states = (self.state(piece.path, float(share)) for share in shares)
            return np.array([_slid(self.job, state, labels) for state in states])
        self._begin(piece.path)
        rows = blank_rows(shares.size, labels.size)
        self._walk(_parts(whole, shares), rows, labels=labels)
        return np.isin(rows.each["slip_state"], LOST)

    def reached(self, piece: _Piece, begin: Floats, touch: Floats, anchor: Floats, reach: Floats) -> Floats:
        """Return the shares of the path at which asperities slide that do so in a piece.

        Parameters
        ----------
        begin : array (asperity)
            Shares at which each is in contact.
        touch, anchor, reach : array (asperity)
            Approach and displacement at which each touched [m], and θμ.
        """

        def beyond(share: Floats, touch: Floats, anchor: Floats, reach: Floats) -> Floats:
            approach, displacement = self.at(piece, share)
            left: Floats = np.abs(displacement - anchor) - reach * (approach - touch)
            return left

        each = touch, anchor, reach
        if piece.straight:
            d, v = self.at(piece, begin)
            roots = np.full((2, begin.size), 1.0)
            for root, sign in zip(roots, (1.0, -1.0), strict=True):
                first = np.minimum(sign * (v - anchor) - reach * (d - touch), 0.0)
                last = sign * (piece.displacement[1] - anchor) - reach * (piece.approach[1] - touch)
                np.divide(first, first - last, out=root, where=last > 0.0)
            straight: Floats = begin + roots.min(axis=0) * (piece.end - begin)
            return straight
        # an asperity that has just touched is at its limit, which is 0
        inner = begin + SOON * (piece.end - begin)
        share = np.where(beyond(inner, *each) >= 0.0, begin, piece.end)
        later = (share > begin) & (beyond(share, *each) > 0.0)
        if later.any():
            share[later] = _root(beyond, inner[later], piece.end, *(one[later] for one in each))
        return share

    def at(self, piece: _Piece, share: Floats) -> tuple[Floats, Floats]:
        """Return approach and displacement at shares of the path of a piece [m]."""
        if piece.straight:
            part = (share - piece.start) / (piece.end - piece.start)
            approach, displacement = (ends[0] + part * (ends[1] - ends[0]) for ends in piece.ends)
            return approach, displacement
        whole = self.paths[piece.path : piece.path + 1]
        values, back = np.unique(share, return_inverse=True)
        self._begin(piece.path)
        if whole["normal_control"][0] == LOAD:
            rows = blank_rows(values.size, None)
            self._walk(_parts(whole, values), rows)
            return rows.totals["approach"][back], rows.totals["displacement"][back]
        found = [self._walk(unrecorded(whole), until=float(one)) for one in values]
        told = np.array([(one.approach, one.tangential_displacement) for one in found]).T
        return told[0][back], told[1][back]

    def _begin(self, path: int) -> None:
        if path > self.done:
            self.here = self._walk(unrecorded(self.paths[self.done : path]))
            self.done = path

    def _walk(
        self, paths: Paths, rows: Rows | None = None, until: float = 1.0, labels: "npt.ArrayLike" = ()
    ) -> "EnsembleState":
        job = self.job
        given: dict[str, Any] = {"rows": rows, "asperities": labels, "until": until}
        return job.ensemble.walk(self.here, paths, saturate=job.saturate, instrument=job.instrument, **given)


def _slid(job: "Replay", state: "EnsembleState", labels: Integers) -> Booleans:
    """Return which asperities slide in a state, or are lost."""
    asperities = (job.ensemble.asperity(int(label), state) for label in labels)
    return np.array([asperity.slip_state in LOST for asperity in asperities], dtype=np.bool_)


def _walked(job: "Replay", state: "EnsembleState", paths: Paths) -> tuple[list[_Piece], "EnsembleState"]:
    """Return the pieces of paths, and the state at their end."""
    # where the tangential load is controlled it may be held at the limit on the way
    straight = paths["tangential_control"] != LOAD
    parts = np.where(straight, 1, PIECES_HELD if job.saturate else PIECES)
    goals = (Goals(*(paths[f"{name}_{field}"] for field in Goals._fields)) for name in ("normal", "tangential"))
    rows = blank_rows(int(parts.sum()), None)
    recorded = paths_to(*goals, parts=parts)
    after = job.ensemble.walk(state, recorded, rows=rows, saturate=job.saturate, instrument=job.instrument)
    approach = np.append(state.approach, rows.totals["approach"])
    displacement = np.append(state.tangential_displacement, rows.totals["displacement"])
    each = ((path, part, count) for path, count in enumerate(parts.tolist()) for part in range(count))
    pieces = [
        _Piece(
            path=path,
            start=part / count,
            end=(part + 1) / count,
            approach=approach[number : number + 2],
            displacement=displacement[number : number + 2],
            straight=bool(straight[path]),
        )
        for number, (path, part, count) in enumerate(each)
    ]
    return pieces, after


def _parts(path: Paths, shares: Floats) -> Paths:
    """Return one path of two loads as several, which end at ascending shares of it."""
    before = np.append(0.0, shares[:-1])
    goals = []
    for name in ("normal", "tangential"):
        fraction = path[f"{name}_fraction"][0]
        left = 1.0 - fraction * before
        part = np.divide(fraction * (shares - before), left, out=np.zeros(shares.size), where=left > 0.0)
        goals.append(Goals(path[f"{name}_control"][0], path[f"{name}_target"][0], part))
    return paths_to(*goals)


def _root(function: "Callable[..., Floats]", low: Floats, high: float, *each: Floats) -> Floats:
    """Return where functions of a share, one of each asperity, rise through 0 (regula falsi, Illinois, and halving).

    scipy.optimize has such a method, but takes longer to import than a small run takes.
    """
    below, above = low.copy(), np.full(low.size, high)
    first, last = function(below, *each), function(above, *each)
    above = np.where(first >= 0.0, below, above)
    for count in range(MOST_TRIALS):
        if (above - below <= CLOSEST * above).all():
            break
        rise = last - first
        part = np.divide(-first, rise, out=np.full(low.size, 0.5), where=rise > 0.0)
        # a side that stays for long makes the secant slow
        share = below + (0.5 if count % 3 == 2 else np.clip(part, 0.0, 1.0)) * (above - below)
        value = function(share, *each)
        left = value < 0.0
        below, above = np.where(left, share, below), np.where(left, above, share)
        first, last = np.where(left, value, 0.5 * first), np.where(left, 0.5 * last, value)
    return above
