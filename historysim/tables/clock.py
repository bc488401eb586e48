"""One clock out of those of several tables, each of which may start again."""

from collections.abc import Sequence

import numpy as np

from historysim.basics.array_types import Floats
from historysim.tables.columns import Part


def one_clock(time: Floats, parts: Sequence[Part]) -> tuple[Floats, list[str]]:
    """Return the times of joined tables [s] on the clock of the first, and what a user has to know of it.

    A table whose clock goes on stays as it is. One whose clock starts again begins when the file says that it was
    started, or else one sample after the end of the table before it. NaN where a time is missing.
    """
    joined = time.copy()
    begin, offset = 0, 0.0
    end = raw_end = None
    step = first_time = 0.0
    by_start: list[str] = []
    after: list[str] = []
    for part in parts:
        rows = slice(begin, begin + part.rows)
        begin += part.rows
        known = time[rows][~np.isnan(time[rows])]
        if not known.size:
            continue
        step = float(np.median(np.diff(known))) if known.size > 1 else step
        first_time = float(known[0]) if end is None else first_time
        if end is not None and raw_end is not None and known[0] < raw_end:
            started = _started(part, parts[0], first_time, float(known[0]), end - step / 2)
            if started is not None:
                # the last digit of a start time may be before the end
                offset = max(started, end - float(known[0]))
                by_start.append(part.label)
            else:
                offset = end + max(step, 0.0) - float(known[0])
                after.append(part.label)
        joined[rows] = time[rows] + offset if offset else time[rows]
        raw_end, end = float(known[-1]), float(known[-1]) + offset
    notices = []
    if by_start:
        notices.append(f"the clock starts again: {_few(by_start)} put at the start times of the file")
    if after:
        notices.append(
            f"the clock starts again, without a start time that fits: {_few(after)} put one sample after the end before"
        )
    return joined, notices


def _started(part: Part, first: Part, first_time: float, begins: float, least: float) -> float | None:
    """Return when a table was started, on the clock of the first: from its start on, or as the file's clock has it."""
    if part.start is None or first.start is None:
        return None
    of_file = abs(first_time - first.start) < abs(first_time)
    start = part.start if of_file else part.start - first.start
    return start if start + begins >= least else None


def _few(labels: Sequence[str]) -> str:
    return ", ".join(labels[:5]) + (", …" if len(labels) > 5 else "")
