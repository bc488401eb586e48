"""The friction limit: where a tangential load meets it on its way, and how the contact slides along it.

A request beyond the limit is held at the limit, and the contact slides. At every moment of a path the tangential load
is the request, or the limit where that is less; the displacement takes the value nearest to its present one at which it
is. So with the normal load falling while everything slides the displacement stays, and with the normal load rising it
goes just so far that the new springs slide, too. That does not depend on how finely the path is divided.

Requests go straight with the share s of a path: with both loads prescribed the normal load does, too, otherwise
the approach. The limit Σ μ P(a) of several groups is straight in neither, so a request may meet it more than once.
"""

from typing import NamedTuple

import numpy as np

from historysim.memory.compiled import compiled, inlined, short
from historysim.memory.groups import (
    approach_for,
    friction_limit,
    group_loads,
    largest_friction,
    least_friction,
    limit_and_slopes,
)
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Floats,
    Integers,
    Memory,
)
from historysim.memory.lean import empty
from historysim.memory.move import move
from historysim.memory.normal import approach_at, load_at
from historysim.memory.polyline import to_displacement, to_load
from historysim.memory.ramp import ramp, toward
from historysim.memory.search import displacement_at
from historysim.memory.tolerances import LIMIT_SLACK, TIE

MOST_PIECES = 64
# shares of a path below which a request that touches the limit does not meet it
NARROWEST = 1e-12
# of a path, one after the other, that lead to less than that
MOST_HALVINGS = 64


class Course(NamedTuple):
    """What is asked of the contact along one path: the values of both channels at its ends.

    Where ``both`` are loads the normal load is straight in the share, otherwise the approach is. ``forces`` are
    those asked for, whether friction can hold them or not.
    """

    both: bool
    approaches: tuple[float, float]
    loads: tuple[float, float]
    forces: tuple[float, float]


class Station(NamedTuple):
    """A point of a course: its share, the friction limit, and the slopes in the approach of limit and normal load."""

    share: float
    limit: float
    limit_slope: float
    load_slope: float


@inlined
def put_station(places: Floats, index: int, place: Station) -> None:
    """Write a point of a course to a row of an array."""
    for column, value in enumerate(place):
        places[index, column] = value


@inlined
def station_of(places: Floats, index: int) -> Station:
    """Return the point of a course that stands in a row of an array."""
    return Station(places[index, 0], places[index, 1], places[index, 2], places[index, 3])


@short
def approach_on(contact: Contact, course: Course, share: float) -> float:
    """Approach at a share of a course."""
    d0, d1 = course.approaches
    if not course.both:
        return toward(d0, d1, share)
    load = toward(course.loads[0], course.loads[1], share)
    return approach_at(contact.sorted_gap, contact.sorted_weight, load, toward(d0, d1, share))


@short
def station(contact: Contact, course: Course, share: float) -> Station:
    """Return the point at a share of a course."""
    limit, limit_slope, load_slope = limit_and_slopes(contact, approach_on(contact, course, share))
    return Station(share, limit, limit_slope, load_slope)


@short
def excess(course: Course, place: Station, side: float) -> float:
    """How far a request is beyond the limit on one side; 0 within rounding counts as beyond."""
    request = toward(course.forces[0], course.forces[1], place.share)
    return side * request - (1.0 - TIE) * place.limit


@short
def slopes_of_limit(contact: Contact, course: Course, low: Station, high: Station) -> tuple[float, float]:
    """Bounds of the limit's slope in the share between two places.

    The slopes of limit and load in the approach rise with the approach.
    """
    limit_least, limit_most = min(low.limit_slope, high.limit_slope), max(low.limit_slope, high.limit_slope)
    if not course.both:
        rate = course.approaches[1] - course.approaches[0]
        return min(rate * limit_least, rate * limit_most), max(rate * limit_least, rate * limit_most)
    load_least, load_most = min(low.load_slope, high.load_slope), max(low.load_slope, high.load_slope)
    least, most = least_friction(contact), largest_friction(contact)
    if load_most > 0.0:
        least = max(least, limit_least / load_most)
    if load_least > 0.0:
        most = min(most, limit_most / load_least)
    rate = course.loads[1] - course.loads[0]
    return min(rate * least, rate * most), max(rate * least, rate * most)


@compiled
def crossing_between(contact: Contact, course: Course, side: float, start: Station, end: Station) -> float:
    """Share at which the one change of sign of `excess` between two places is, by false position (Illinois)."""
    low, high = start.share, end.share
    at_low, at_high = excess(course, start, side), excess(course, end, side)
    kept = 0
    for _ in range(200):
        share = low + (high - low) * at_low / (at_low - at_high)
        if not low < share < high:
            share = 0.5 * (low + high)
        if share in (low, high) or high - low <= 1e-15:
            break
        place = station(contact, course, share)
        here = excess(course, place, side)
        if here == 0.0:
            return share
        if (here > 0.0) == (at_high > 0.0):
            high, at_high = share, here
            at_low = 0.5 * at_low if kept == 1 else at_low
            kept = 1
        else:
            low, at_low = share, here
            at_high = 0.5 * at_high if kept == -1 else at_high
            kept = -1
    return high


@compiled
def first_change(contact: Contact, course: Course, side: float, start: Station, end: Station, beyond: bool) -> float:
    """Share between two places at which the request first comes to be beyond the limit on one side, or within it.

    Infinity where it does not; at the start it is not. Intervals are halved until bounds of the slopes
    say that the excess is monotone or has no sign to change to.
    """
    # the right ends of the intervals that are still to be looked at, the nearest last
    waiting, count = empty((MOST_HALVINGS, len(end)), np.float64), 1
    put_station(waiting, 0, end)
    low = start
    rate = side * (course.forces[1] - course.forces[0])
    wanted = 1.0 if beyond else -1.0
    while count > 0:
        high = station_of(waiting, count - 1)
        at_low, at_high = wanted * excess(course, low, side), wanted * excess(course, high, side)
        least, most = slopes_of_limit(contact, course, low, high)
        fastest = rate - least if beyond else most - rate
        slowest = rate - most if beyond else least - rate
        width = high.share - low.share
        monotone = slowest >= 0.0 or fastest <= 0.0
        if monotone and at_high > 0.0:
            return crossing_between(contact, course, side, low, high) if at_low < 0.0 else low.share
        hopeless = monotone or min(at_low + fastest * width, at_high - slowest * width) <= 0.0
        if at_high <= 0.0 and (hopeless or width <= NARROWEST):
            count -= 1
            low = high
        elif width <= NARROWEST:
            return high.share
        else:
            put_station(waiting, count, station(contact, course, 0.5 * (low.share + high.share)))
            count += 1
    return np.inf


@compiled
def meets_limit(contact: Contact, course: Course) -> bool:
    """Return whether a course has to be cut: its request is at a limit or beyond it somewhere."""
    held = 1.0 - TIE
    if abs(course.forces[1]) > held * friction_limit(contact, course.approaches[1], course.loads[1]):
        return True
    # a straight path to an end within the limit prescribes no load before it
    start = held * friction_limit(contact, course.approaches[0], course.loads[0])
    if not course.both:
        return abs(course.forces[0]) > (1.0 + LIMIT_SLACK) * start
    if abs(course.forces[0]) > start:
        return True
    if contact.friction.size == 1 or course.approaches[0] == course.approaches[1]:
        return False
    low, high = station(contact, course, 0.0), station(contact, course, 1.0)
    above = first_change(contact, course, 1.0, low, high, True)
    return min(above, first_change(contact, course, -1.0, low, high, True)) < 1.0


@compiled
def cut(contact: Contact, course: Course, ends: Floats, sides: Integers) -> int:
    """Cut a course into pieces where its request meets the limit, or comes back from it; return their number.

    Each piece ends at a share, and ``sides`` tells which limit it follows; 0 is within the limits.
    """
    low, end = station(contact, course, 0.0), station(contact, course, 1.0)
    side = 1 if excess(course, low, 1.0) > 0.0 else -1 if excess(course, low, -1.0) > 0.0 else 0
    for count in range(ends.size):
        sides[count], ends[count] = side, 1.0
        if side != 0:
            share, following = first_change(contact, course, 1.0 * side, low, end, False), 0
        else:
            above = first_change(contact, course, 1.0, low, end, True)
            below = first_change(contact, course, -1.0, low, end, True)
            share, following = min(above, below), 1 if above < below else -1
        if share >= 1.0:
            return count + 1
        ends[count] = share
        side, low = following, station(contact, course, share)
    ends[ends.size - 1] = 1.0
    return ends.size


@compiled
def overload(contact: Contact, course: Course, ends: Floats, sides: Integers) -> tuple[float, float]:
    """Return a request and the limit there: at the end of a course, or amid the piece that exceeds the limit most."""
    asked, limit = course.forces[1], friction_limit(contact, course.approaches[1], course.loads[1])
    begin = 0.0
    for k in range(ends.size):
        if sides[k] != 0 and abs(asked) <= limit * (1.0 + LIMIT_SLACK):
            share = 0.5 * (begin + ends[k])
            asked = toward(course.forces[0], course.forces[1], share)
            limit = limit_and_slopes(contact, approach_on(contact, course, share))[0]
        begin = ends[k]
    return asked, limit


@compiled
def follow(
    contact: Contact,
    memory: Memory,
    course: Course,
    ends: Floats,
    sides: Integers,
    before: float,
    share: float,
    tolerance: float,
) -> tuple[Memory, int]:
    """Walk a course, cut into pieces, from one share to another; return also which limit it follows there."""
    side = 0
    for k in range(ends.size):
        if ends[k] <= before and k < ends.size - 1:
            continue
        side, stop = sides[k], min(ends[k], share)
        d, load = place_on(contact, memory, course, stop)
        if side != 0:
            memory = slide(contact, memory, d, load, 1.0 * side)
        elif course.both:
            memory = ramp(contact, memory, load, request_at(contact, course, ends, sides, k, stop, d, load), tolerance)
        else:
            d_end, load_end = place_on(contact, memory, course, ends[k])
            aim = to_load(request_at(contact, course, ends, sides, k, ends[k], d_end, load_end))
            if stop < ends[k]:
                reached = displacement_at(contact, memory, group_loads(contact, d_end), d_end, aim)
                part = (stop - before) / (ends[k] - before)
                aim = to_displacement(toward(memory.now[DISPLACEMENT], reached, part))
            memory = move(contact, memory, d, load, aim)
        before = stop
        if stop == share:
            break
    return memory, side


@short
def place_on(contact: Contact, memory: Memory, course: Course, share: float) -> tuple[float, float]:
    """Return approach and normal load at a share of a course."""
    if share == 1.0:
        return course.approaches[1], course.loads[1]
    if course.both:
        load = toward(course.loads[0], course.loads[1], share)
        return approach_for(contact, memory, load), load
    d = toward(course.approaches[0], course.approaches[1], share)
    return d, load_at(contact.sorted_gap, contact.sorted_weight, d)[0]


@short
def request_at(
    contact: Contact, course: Course, ends: Floats, sides: Integers, piece: int, share: float, d: float, load: float
) -> float:
    """Return the tangential load at a share within the limits: where the piece ends at a limit, that limit."""
    limit = friction_limit(contact, d, load)
    if share == ends[piece] and piece + 1 < ends.size:
        return sides[piece + 1] * limit
    return min(max(toward(course.forces[0], course.forces[1], share), -limit), limit)


@compiled
def slide(contact: Contact, memory: Memory, d1: float, load: float, side: float) -> Memory:
    """Carry the contact along the friction limit to approach d1, where it carries ``load``.

    With the approach falling the displacement stays. With the approach rising it keeps pace with the springs
    that need most to slide as soon as they touch.
    """
    now = memory.now
    limit = friction_limit(contact, now[APPROACH], now[NORMAL_LOAD])
    if side * now[TANGENTIAL_LOAD] < (1.0 - TIE) * limit:
        memory = move(contact, memory, now[APPROACH], now[NORMAL_LOAD], to_load(side * limit))
    if d1 <= now[APPROACH]:
        return move(contact, memory, d1, load, to_displacement(now[DISPLACEMENT]))
    steepest = 0.0
    for index in range(contact.friction.size):
        touch = contact.gap[contact.first[index]]
        if touch >= d1:
            break
        if contact.friction[index] <= steepest:
            continue
        if touch > now[APPROACH]:
            reached = now[DISPLACEMENT] + side * steepest * (touch - now[APPROACH])
            touch_load = load_at(contact.sorted_gap, contact.sorted_weight, touch)[0]
            memory = move(contact, memory, touch, touch_load, to_displacement(reached))
            now = memory.now
        steepest = contact.friction[index]
    reached = now[DISPLACEMENT] + side * steepest * (d1 - now[APPROACH])
    return move(contact, memory, d1, load, to_displacement(reached))
