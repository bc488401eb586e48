"""How asperities evolve along a path: friction that depends on the load, slid distance, wear.

What evolves is followed in chords: on each, approach, displacement and friction coefficients go straight to where they
are at its end, which is one exact update of the memory. There are twice as many of them each time, until the state at
the end and the energy settle. A path on which nothing evolves is walked as ever, exactly.
"""

import math

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.course import Course, Present, toward
from historysim.asperities.evolved import Evolved
from historysim.asperities.friction import FrictionGoal
from historysim.asperities.laws.base import FrictionLaw, Loaded
from historysim.asperities.rearrangement import rearranged
from historysim.asperities.wear import WearLaw
from historysim.contact.materials import MaterialPair
from historysim.errors import FrictionLimitError
from historysim.memory.carrying import carry, innermost_anchors
from historysim.memory.energy import stored_energy
from historysim.memory.groups import approach_for, friction_limit
from historysim.memory.layout import (
    APPROACH,
    DISPLACEMENT,
    DISSIPATED,
    EXCESS,
    NORMAL_LOAD,
    TANGENTIAL_LOAD,
    Contact,
    Integers,
    Memory,
    Units,
)
from historysim.memory.move import move
from historysim.memory.normal import load_at
from historysim.memory.paths import LOAD, Paths
from historysim.memory.pending import NO_ROOM
from historysim.memory.polyline import Aim
from historysim.memory.projection import record_row
from historysim.memory.rows import (
    ERASED_ENERGY,
    ERASED_MEMORIES,
    SLID_TOGETHER,
    TOGETHER,
    Rows,
    blank_rows,
    columns_of,
    scratch_for,
)
from historysim.memory.stacks import copied
from historysim.memory.tolerances import LIMIT_SLACK
from historysim.memory.walk import walk_paths

Floats = npt.NDArray[np.float64]

FEWEST_CHORDS, MOST_CHORDS = 4, 1 << 12
COARSER, COARSEST = 100.0, 1000.0
"""Tolerances over that of ramps of both loads, since these chords are walked one by one: of loads and displacements, as
parts of limit, preliminary displacement and approach; and of what is dissipated, slid and worn, as parts of itself."""


@attrs.frozen(eq=False)
class Evolution:
    """What makes asperities evolve.

    Parameters
    ----------
    pair : MaterialPair
    law : FrictionLaw, optional
        Of asperities whose friction no event has given.
    wear : WearLaw, optional
    units : Units
    highest_summit : float
        Datum of the gaps: the highest summit at the start [m].
    tolerance : float
        That of the ensemble.
    """

    pair: MaterialPair
    law: FrictionLaw | None
    wear: WearLaw | None
    units: Units
    highest_summit: float
    tolerance: float

    def walk(
        self,
        present: Present,
        paths: Paths,
        rows: Rows,
        chosen: Integers,
        *,
        saturate: bool,
        compliance: float,
        until: float,
        goal: FrictionGoal | None,
    ) -> Present:
        """Return the contact after straight paths, of which it records the rows; parameters as for `Ensemble.walk`.

        Targets are dimensionless. Only the last path may have a goal for friction.

        Raises
        ------
        FrictionLimitError
            With the position of the path that cannot be walked.
        """
        flag = False
        for p in range(paths.parts.size):
            path = Paths._make(column[p : p + 1] for column in paths)
            course = self._course(present, path, saturate, compliance, goal)
            still, start, before = self._still(course), present, 0.0
            for part in range(1, int(paths.parts[p]) + 1):
                share = until * (part / int(paths.parts[p]))
                try:
                    if still:
                        moved = self._as_ever(start, path, share, saturate, compliance)
                        evolved = self._settled_slides(course, present, before, share, saturate)
                        present = attrs.evolve(moved, evolved=evolved)
                    else:
                        present = self._settled(course, present, before, share, saturate)
                except FrictionLimitError as error:
                    raise FrictionLimitError(error.request, error.limit, p) from None
                before, flag = share, flag or present.memory.now[EXCESS] != 0.0
                if part < paths.parts[p] or paths.recorded[p]:
                    self._record(present, rows, int(paths.first_row[p]) + part - 1, chosen, flag)
                    flag = False
        return present

    def _course(
        self, present: Present, path: Paths, saturate: bool, compliance: float, goal: FrictionGoal | None
    ) -> Course:
        contact, memory = present.contact, present.memory
        now = memory.now
        by_load, by_force = bool(path.normal_control[0] == LOAD), bool(path.tangential_control[0] == LOAD)
        if by_load:
            load = toward((now[NORMAL_LOAD], path.normal_target[0]), path.normal_fraction[0])
            approach = approach_for(contact, memory, load)
        else:
            approach = toward((now[APPROACH], path.normal_target[0]), path.normal_fraction[0])
            load = load_at(contact.sorted_gap, contact.sorted_weight, approach)[0]
        if by_force:
            first = now[TANGENTIAL_LOAD] + (now[EXCESS] if saturate else 0.0)
        else:
            first = now[DISPLACEMENT] + compliance * now[TANGENTIAL_LOAD]
        friction = None
        if goal is not None:
            last = present.friction + goal.fraction * (goal.coefficients - present.friction)
            friction = (present.friction, goal.coefficients if goal.fraction == 1.0 else last)
        return Course(
            start=present,
            by_load=by_load,
            by_force=by_force,
            approach=(now[APPROACH], approach),
            normal_load=(now[NORMAL_LOAD], load),
            tangential=(first, toward((first, path.tangential_target[0]), path.tangential_fraction[0])),
            compliance=compliance,
            friction=friction,
        )

    def _still(self, course: Course) -> bool:
        """Whether neither friction nor geometry evolves on a path."""
        if self.wear is not None:
            return False
        if course.friction is not None:
            return np.array_equal(*course.friction)
        if self.law is None or self.law.depends_on == "nothing" or course.start.evolved.given.all():
            return True
        return self.law.depends_on != "slid" and course.approach[0] == course.approach[1]

    # -- paths on which nothing evolves ------------------------------------------------------------

    def _as_ever(self, start: Present, path: Paths, share: float, saturate: bool, compliance: float) -> Present:
        """Return the contact at a share of a path on which nothing evolves, exactly."""
        alone = path._replace(
            parts=np.ones_like(path.parts),
            recorded=np.zeros_like(path.recorded),
            first_row=np.zeros_like(path.first_row),
        )
        memory, refused, request, limit = walk_paths(
            start.contact,
            copied(start.memory),
            alone,
            blank_rows(0, 0),
            NO_ROOM,
            columns_of(start.contact, np.empty(0, dtype=np.int64)),
            self.units,
            scratch_for(0),
            saturate,
            self.tolerance,
            compliance,
            share,
        )
        if refused >= 0:
            raise FrictionLimitError(request * self.units.load, limit * self.units.load, 0)
        return attrs.evolve(start, memory=memory)

    def _settled_slides(self, course: Course, present: Present, before: float, share: float, saturate: bool) -> Evolved:
        """Return what has become of asperities that slide between two shares of a path on which nothing else evolves.

        Where the normal load changes under two controlled loads the way is bent, and followed in chords.
        """
        bent = course.by_load and course.by_force and course.normal_load[0] != course.normal_load[1]
        if not bent:
            return self._in_chords(course, present, before, share, 1, saturate).evolved
        return self._settled(course, present, before, share, saturate).evolved

    # -- chords ------------------------------------------------------------------------------------

    def _settled(self, course: Course, present: Present, before: float, share: float, saturate: bool) -> Present:
        """Return the contact at a share of a path, from another, in as many chords as it takes."""
        if course.approach[0] < present.contact.sorted_gap[0] and course.by_load and course.by_force:
            # a gap is crossed without load, before the ramp begins
            now = present.memory.now.copy()
            now[APPROACH] = max(now[APPROACH], min(present.contact.sorted_gap[0], course.approach[1]))
            present = attrs.evolve(present, memory=present.memory._replace(now=now))
        chords = FEWEST_CHORDS
        coarse = self._in_chords(course, present, before, share, chords, saturate)
        while True:
            chords *= 2
            fine = self._in_chords(course, present, before, share, chords, saturate)
            if chords >= MOST_CHORDS or self._agree(present, coarse, fine):
                return self._extrapolated(present, coarse, fine)
            coarse = fine

    def _agree(self, start: Present, coarse: Present, fine: Present) -> bool:
        """Whether state, energy and wear no longer depend on the chords."""
        first, last, now = coarse.memory.now, fine.memory.now, start.memory.now
        contact = fine.contact
        top = max(first[APPROACH], now[APPROACH]) - contact.sorted_gap[0]
        reach = max(float(contact.friction.max()), 1e-300) * max(top, 0.0)
        limit = friction_limit(contact, last[APPROACH], last[NORMAL_LOAD])
        lost = last[DISSIPATED] - now[DISSIPATED]
        held = stored_energy(contact, fine.memory, np.zeros(contact.gap.size))
        worn = fine.evolved.worn_volume - start.evolved.worn_volume
        slid = fine.evolved.slid_distance - start.evolved.slid_distance
        near = (
            (last[DISPLACEMENT] - first[DISPLACEMENT], reach),
            (last[TANGENTIAL_LOAD] - first[TANGENTIAL_LOAD], limit),
            (last[APPROACH] - first[APPROACH], top),
            # what is lost is told to a part of itself, or of what is stored
            (last[DISSIPATED] - first[DISSIPATED], COARSEST / COARSER * max(lost, held)),
            (np.abs(fine.evolved.worn_volume - coarse.evolved.worn_volume).max(), COARSEST / COARSER * worn.max()),
            (np.abs(fine.evolved.slid_distance - coarse.evolved.slid_distance).max(), COARSEST / COARSER * slid.max()),
        )
        return all(abs(change) <= COARSER * self.tolerance * scale for change, scale in near)

    def _extrapolated(self, start: Present, coarse: Present, fine: Present) -> Present:
        """Return the finer contact with the energy extrapolated: its error falls with the square of the chords."""
        if not np.array_equal(coarse.order, fine.order):
            return fine
        memory = fine.memory
        each = memory.dissipated + (memory.dissipated - coarse.memory.dissipated) / 3.0
        total = memory.now[DISSIPATED] + (memory.now[DISSIPATED] - coarse.memory.now[DISSIPATED]) / 3.0
        now, least = memory.now.copy(), start.memory.dissipated[np.argsort(start.order)][fine.order]
        now[DISSIPATED] = max(total, start.memory.now[DISSIPATED])
        return attrs.evolve(fine, memory=memory._replace(dissipated=np.maximum(each, least), now=now))

    def _in_chords(
        self, course: Course, present: Present, before: float, share: float, chords: int, saturate: bool
    ) -> Present:
        """Return the contact at a share of a path, from another, in so many chords."""
        for k in range(1, chords + 1):
            there = share if k == chords else before + (share - before) * (k / chords)
            present = self._chord(course, present, there, saturate)
        return present

    def _chord(self, course: Course, present: Present, share: float, saturate: bool) -> Present:
        """Return the contact at the end of one chord."""
        moved, slid = self._moved(course, present, share, saturate)
        if self.law is not None and self.law.depends_on == "slid" and slid.any():
            # with the friction that the asperities have when they have slid so far
            moved, slid = self._moved(course, present, share, saturate, slid)
        wear = self.wear
        if wear is None:
            return self._with_slides(moved, slid)
        lost = self._lost(wear, present, moved, slid)
        shaping = np.where(slid > 0, present.evolved.waiting_volume + lost, 0.0)
        if shaping.any():
            # the shape at the end of the chord, from its beginning on
            present = self._shaped(wear, present, moved, shaping)
            moved, slid = self._moved(course, present, share, saturate, slid)
            lost = self._lost(wear, present, moved, slid)
        evolved = moved.evolved
        worn, waiting = evolved.worn_volume + lost, evolved.waiting_volume + lost
        evolved = attrs.evolve(evolved, worn_volume=worn, waiting_volume=waiting)
        return self._with_slides(attrs.evolve(moved, evolved=evolved), slid)

    def _moved(
        self, course: Course, present: Present, share: float, saturate: bool, ahead: Floats | float = 0.0
    ) -> tuple[Present, Floats]:
        """Return the contact after one straight update, and how far each asperity slid (asperity) [m].

        ``ahead`` is how far they will probably slide.
        """
        approach, load = course.normal(present, share)
        contact, memory = present.contact, copied(present.memory)
        friction = self._friction(course, present, approach, load, share, ahead)
        after, aim = contact._replace(friction=friction), course.aim(share)
        excess = 0.0
        if course.by_force:
            limit = friction_limit(after, approach, load)
            beyond = abs(aim.value) - limit
            if beyond > LIMIT_SLACK * limit:
                if not saturate:
                    raise FrictionLimitError(aim.value * self.units.load, limit * self.units.load, 0)
                held = math.copysign(limit, aim.value)
                excess, aim = aim.value - held, Aim(held, 0.0, 1.0)
        anchors, start = innermost_anchors(contact, memory), present.memory.now
        if np.array_equal(friction, contact.friction):
            memory = move(contact, memory, approach, load, aim)
        else:
            memory = carry(contact, memory, approach, load, friction, aim)
        memory.now[EXCESS] = excess
        slid = np.empty(contact.gap.size)
        slid[present.order] = _slid(contact, after, start, memory, anchors) * self.units.displacement
        return attrs.evolve(present, contact=after, memory=memory), slid

    def _friction(
        self,
        course: Course,
        present: Present,
        approach: float,
        load: float,
        share: float,
        ahead: Floats | float = 0.0,
    ) -> Floats:
        """Return the coefficient of each group at the end of a chord."""
        contact, leader = present.contact, present.contact.first[:-1]
        friction, whose = contact.friction.copy(), present.order[leader]
        if course.friction is not None:
            first, last = course.friction
            return last[whose] if share == 1.0 else first[whose] + share * (last[whose] - first[whose])
        if self.law is None or self.law.depends_on == "nothing":
            return friction
        own = np.maximum(approach - contact.gap[leader], 0.0)
        normal = contact.weight[leader] * own**1.5 * self.units.load
        free = ~present.evolved.given[whose]
        ruled = free & (normal > 0)
        # separated asperities hold no friction
        friction[free & (normal == 0)] = 0.0
        friction[ruled] = self.law.coefficients(
            Loaded(
                pair=self.pair,
                normal_load=normal[ruled],
                total_normal_load=load * self.units.load,
                summit_radius=contact.weight[leader][ruled] ** 2 * self.units.radius,
                slid_distance=(present.evolved.slid_distance + ahead)[whose[ruled]],
            )
        )
        return friction

    @staticmethod
    def _with_slides(present: Present, slid: Floats) -> Present:
        if not slid.any():
            return present
        evolved = present.evolved
        touching = np.zeros(slid.size, dtype=bool)
        touching[present.order] = present.contact.gap < present.memory.now[APPROACH]
        together = evolved.slid_together + float(slid[touching].min(initial=np.inf) if touching.any() else 0.0)
        evolved = attrs.evolve(evolved, slid_distance=evolved.slid_distance + slid, slid_together=together)
        return attrs.evolve(present, evolved=evolved)

    # -- wear --------------------------------------------------------------------------------------

    def _lost(self, wear: WearLaw, before: Present, after: Present, slid: Floats) -> Floats:
        """Volume that each asperity loses on a chord (asperity) [m³]."""
        mean = (self._normal_loads(before) + self._normal_loads(after)) / 2
        energy = np.empty(slid.size)
        energy[after.order] = (after.memory.dissipated - before.memory.dissipated) * self.units.energy
        return wear.volume(mean, slid, energy)

    def _normal_loads(self, present: Present) -> Floats:
        own = np.maximum(present.memory.now[APPROACH] - present.contact.gap, 0.0)
        found = np.empty(own.size)
        found[present.order] = present.contact.weight * own**1.5 * self.units.load
        return found

    def _shaped(self, wear: WearLaw, present: Present, moved: Present, volume: Floats) -> Present:
        """Return the contact whose asperities have lost a volume (asperity) in shape, too.

        ``moved`` says how they touch.
        """
        evolved, order = present.evolved, present.order
        contact_radius = np.zeros(volume.size)
        own = np.maximum(moved.memory.now[APPROACH] - moved.contact.gap, 0.0)
        contact_radius[moved.order] = moved.contact.weight * np.sqrt(own) * self.units.radius
        height, radius = evolved.summit_height.copy(), evolved.summit_radius.copy()
        some = (volume != 0) & (contact_radius > 0)
        shaped = np.maximum(evolved.shaped_volume[some] + volume[some], 0.0) - evolved.shaped_volume[some]
        height[some], radius[some] = wear.left(
            height[some], radius[some], contact_radius[some], evolved.shaped_volume[some], shaped
        )
        taken = np.zeros(volume.size)
        taken[some] = shaped
        evolved = attrs.evolve(
            evolved,
            summit_height=height,
            summit_radius=radius,
            waiting_volume=evolved.waiting_volume - taken,
            shaped_volume=evolved.shaped_volume + taken,
        )
        return self.reshaped(attrs.evolve(present, evolved=evolved), np.zeros(order.size, dtype=bool))

    def ruled(self, present: Present) -> Present:
        """Return the contact with the friction that the law gives asperities, of which only fresh ones may differ."""
        now = present.memory.now
        course = Course(present, False, False, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), 0.0, None)
        friction = self._friction(course, present, now[APPROACH], now[NORMAL_LOAD], 1.0)
        return attrs.evolve(present, contact=present.contact._replace(friction=friction))

    def reshaped(self, present: Present, fresh: npt.NDArray[np.bool_]) -> Present:
        """Return the contact with the geometry that its asperities have now, at its approach and displacement.

        The memory of those that are fresh (asperity) is erased. The elastic energy that goes with it is told.
        """
        contact, order, memory, evolved = present.contact, present.order, present.memory, present.evolved
        gap = (self.highest_summit - evolved.summit_height[order]) / self.units.length
        weight = np.sqrt(evolved.summit_radius[order] / self.units.length)
        new = rearranged(contact, order, memory, gap, weight, fresh[order])
        erased = stored_energy(contact, memory, np.zeros(order.size)) - stored_energy(
            new.contact, new.memory, np.zeros(order.size)
        )
        count = int((fresh[order] & (contact.gap < memory.now[APPROACH])).sum())
        evolved = attrs.evolve(
            evolved,
            erased_memories=evolved.erased_memories + count,
            erased_energy=evolved.erased_energy + erased * self.units.energy,
        )
        return Present(new.contact, new.order, new.memory, evolved)

    # -- rows --------------------------------------------------------------------------------------

    def _record(self, present: Present, rows: Rows, row: int, chosen: Integers, flag: bool) -> None:
        contact, order, evolved = present.contact, present.order, present.evolved
        position = np.empty(order.size, dtype=np.int64)
        position[order] = np.arange(order.size)
        columns, work = columns_of(contact, position[chosen]), scratch_for(order.size if chosen.size else 0)
        record_row(contact, present.memory, rows, row, NO_ROOM, columns, self.units, bool(flag), work)
        if rows.friction.size:
            friction = present.friction
            rows.friction[row] = friction[chosen if rows.friction.shape[1] == chosen.size else [0]]
        if rows.evolved.size:
            rows.evolved[row, [SLID_TOGETHER, ERASED_MEMORIES, ERASED_ENERGY]] = (
                evolved.slid_together,
                evolved.erased_memories,
                evolved.erased_energy,
            )
            each = (evolved.slid_distance, evolved.worn_volume, evolved.summit_height, evolved.summit_radius)
            rows.evolved[row, TOGETHER:] = np.stack([values[chosen] for values in each]).ravel()


def _slid(contact: Contact, after: Contact, start: Floats, memory: Memory, before: Floats) -> Floats:
    """How far asperities slid on a straight path, in the order of the contact: ∫|dV| while they slide as a whole.

    An asperity slides while its innermost spring does, from some moment on: what that spring slips, as a part of what
    it would slip all the way, is the part of the way on which it slides.
    """
    now = memory.now
    d0, v0, d1, v1 = start[APPROACH], start[DISPLACEMENT], now[APPROACH], now[DISPLACEMENT]
    moved = v1 - v0
    last = innermost_anchors(contact, memory)
    if moved == 0.0:
        return np.zeros(last.size)
    gap, members = contact.gap, np.diff(contact.first)
    first_friction, last_friction = np.repeat(contact.friction, members), np.repeat(after.friction, members)
    # springs that touch, or leave, on the way do so without strain
    on_edge = v0 + moved * np.clip((gap - d0) / (d1 - d0), 0.0, 1.0) if d1 != d0 else np.full(gap.size, np.nan)
    was, now_touches = ~np.isnan(before), ~np.isnan(last)
    anchor0, anchor1 = np.where(was, before, on_edge), np.where(now_touches, last, on_edge)
    slip = anchor1 - anchor0
    # the limit of an asperity that comes or goes is that of the side on which it touches
    limit0 = np.where(was, first_friction * np.maximum(d0 - gap, 0.0), last_friction * (d0 - gap))
    limit1 = np.where(now_touches, last_friction * np.maximum(d1 - gap, 0.0), first_friction * (d1 - gap))
    side = np.sign(slip)
    whole = side * moved - (limit1 - limit0)
    tie = 1e-12 * (abs(v0) + abs(v1))
    slides = (was | now_touches) & (np.abs(slip) > tie) & (whole > 0)
    part = np.divide(np.abs(slip), whole, out=np.zeros_like(slip), where=slides)
    found: Floats = abs(moved) * np.minimum(part, 1.0)
    return found
