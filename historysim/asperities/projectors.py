"""Threads that project the asperities of rows while the next rows are walked.

The walk itself is one thread: each step goes on from the one before. What it passes on are copies, rows do not depend
on one another, and no sum runs over more than one of them; so the bits are the same whatever the number of threads.
"""

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np

from historysim.memory.layout import Contact, Memory, Units
from historysim.memory.paths import Paths
from historysim.memory.pending import NO_ROOM, Pending, room_for
from historysim.memory.projection import record_pending
from historysim.memory.rows import Columns, Rows, Scratch, scratch_for
from historysim.memory.walk import walk_paths

CELLS_PASSED_ON = 1 << 17
"""Rows times asperities that are passed on at once: about a millisecond of projecting."""
LEAST_TASKS = 4
"""Passing on less than this many times as much is not worth starting threads."""
TASKS_AHEAD = 2
"""How many times they may wait for each thread."""


class _Task(NamedTuple):
    """Rows to be projected."""

    contact: Contact
    pending: Pending
    rows: Rows
    columns: Columns
    units: Units


class Projectors:
    """Threads that project rows; with one, rows are projected as they are walked.

    Parameters
    ----------
    threads : int
        Of all, with that which walks.
    """

    def __init__(self, threads: int = 1) -> None:
        self._threads = threads
        self._pool: ThreadPoolExecutor | None = None
        self._running: list[tuple[Future[None], _Task]] = []
        # what no thread has in use: memory that was touched before is twice as fast
        self._scratch: list[Scratch] = []
        self._rooms: list[Pending] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def walk(
        self,
        contact: Contact,
        memory: Memory,
        paths: Paths,
        rows: Rows,
        columns: Columns,
        units: Units,
        *options: Any,
    ) -> tuple[Memory, int, float, float]:
        """Walk paths as `walk_paths` does, with ``options`` that follow its scratch; all rows are there in the end."""
        work = self._some_scratch(contact, columns)
        found = memory, -1, 0.0, 0.0
        try:
            for first, part, its_rows, pending in self._parts(contact, paths, rows, columns.place.size):
                found = walk_paths(contact, found[0], part, its_rows, pending, columns, units, work, *options)
                if found[1] >= 0:
                    return found[0], first + found[1], *found[2:]
                if pending.waits.any():
                    self._pass_on(_Task(contact, pending, its_rows, columns, units), work)
        finally:
            self._finish(work)
        return found

    def _parts(
        self, contact: Contact, paths: Paths, rows: Rows, columns: int
    ) -> Iterator[tuple[int, Paths, Rows, Pending]]:
        """Cut paths that record much, where they record a row; yield the first of each part, with room to pass on."""
        at_once = max(1, CELLS_PASSED_ON // max(columns, 1))
        if self._threads == 1 or len(rows.totals) * columns < LEAST_TASKS * CELLS_PASSED_ON:
            yield 0, paths, rows, NO_ROOM
            return
        end = paths.first_row + paths.parts - 1 + paths.recorded
        cuts = np.flatnonzero(paths.recorded) + 1
        rows_then = end[cuts - 1]
        first = 0
        while first < end.size:
            row = int(paths.first_row[first])
            # the last cut before too many rows, or else the next one
            few = np.searchsorted(rows_then, row + at_once, side="right") - 1
            place = max(few, np.searchsorted(cuts, first, side="right"))
            last = int(cuts[place]) if place < cuts.size else end.size
            part = Paths._make(array[first:last] for array in paths)
            some = Rows._make(array[row : int(end[last - 1])] for array in rows)
            room = self._room(contact, len(some.totals), columns)
            yield first, part._replace(first_row=part.first_row - row), some, room
            first = last

    def _pass_on(self, task: _Task, work: Scratch) -> None:
        """Have rows projected: by another thread, or if enough of them wait, by this one."""
        if self._pool is None:
            # whoever compiles first decides on last bits: always this thread
            record_pending(task.contact, NO_ROOM, task.rows, task.columns, task.units, work)
            self._pool = ThreadPoolExecutor(self._threads - 1, thread_name_prefix="projector")
        if sum(not future.done() for future, _ in self._running) < TASKS_AHEAD * self._threads:
            self._running.append((self._pool.submit(self._project, task), task))
        else:
            record_pending(*task, work)
            self._rooms.append(task.pending)

    def _project(self, task: _Task) -> None:
        work = self._some_scratch(task.contact, task.columns)
        record_pending(*task, work)
        self._scratch.append(work)
        self._rooms.append(task.pending)

    def _finish(self, work: Scratch) -> None:
        """Project what nobody has begun with, and wait for the rest."""
        running, self._running = self._running, []
        for future, task in reversed(running):
            if future.cancel():
                record_pending(*task, work)
        for future, _ in running:
            if not future.cancelled():
                future.result()
        self._scratch.append(work)

    def _room(self, contact: Contact, rows: int, columns: int) -> Pending:
        new = partial(room_for, rows, contact.friction.size, columns)
        try:
            room = self._rooms.pop()
        except IndexError:
            return new()
        if room.depth.shape[1] != contact.friction.size or room.waits.size < rows:
            return new()
        room.waits[:] = False
        return room

    def _some_scratch(self, contact: Contact, columns: Columns) -> Scratch:
        size = contact.gap.size if columns.place.size else 0
        try:
            spare = self._scratch.pop()
        except IndexError:
            return scratch_for(size)
        return spare if spare.state.size == size else scratch_for(size)
