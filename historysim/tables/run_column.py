"""Find the column that numbers the runs of a file, such as the cycles that a fretting rig stores."""

import re
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from historysim.errors import InputError
from historysim.tables import Column, Format, column_names, read_table
from historysim.tables.columns import split_unit

FEWEST_ROWS = 8  # least number of rows of a run
MOST_LISTED = 6  # largest number of runs in a message
_NUMBER = r"[\W_]*(?:(?:no|nr|num|number|nummer|index|idx|id|count)[\W_]*)?$"
# Consecutive numbers of cycles or loops mean a continuous record; runs and tests are always
# separate.
_CYCLE = re.compile(
    rf"(?i)^[\W_]*(?:cycles?|cyc|zykl(?:us|en)|loops?|schleifen?|サイクル|循环|周期|循環){_NUMBER}"
)
_RUN = re.compile(
    rf"(?i)^[\W_]*(?:runs?|tests?|l[aä]uf(?:e)?|versuche?|messung|essais?|試験|试验){_NUMBER}"
)


@attrs.frozen
class RunColumn:
    """A column that numbers the runs of a file."""

    name: str
    numbers: tuple[int, ...]  #: number of each run, in the order of the file

    @property
    def runs_text(self) -> str:
        """Text of the numbers, shortened if there are many."""
        text = ", ".join(map(str, self.numbers[:MOST_LISTED]))
        return text if len(self.numbers) <= MOST_LISTED else f"{text}, … {self.numbers[-1]}"


def find_run_column(path: Path, layout: Format, columns: Sequence[Column] = ()) -> RunColumn | None:
    """Find the column that numbers consecutive runs in the table with ``columns``; None if there is no such column."""
    try:
        names = column_names(path, layout, columns)
    except InputError:
        return None
    for pattern in (_CYCLE, _RUN):
        matching = [name for name in names if pattern.match(split_unit(name)[0])]
        if len(matching) == 1 and (numbers := _run_numbers(path, matching[0], layout)):
            follow_each_other = pattern is _CYCLE and set(np.diff(numbers)) == {1}
            return None if follow_each_other else RunColumn(matching[0], tuple(numbers))
    return None


def _run_numbers(path: Path, name: str, layout: Format) -> Sequence[int]:
    """Return the number of each run; empty if the column does not hold one whole number per block of rows."""
    try:
        values = read_table(path, {"run": Column(name, unit="1")}, {"run": "1"}, layout).columns[
            "run"
        ]
    except InputError:
        return []
    starts = np.append(0, 1 + np.flatnonzero(np.diff(values)))
    numbers = values[starts]
    rows = np.diff(starts, append=values.size)
    is_counter = bool((numbers % 1 == 0).all()) and np.unique(numbers).size == numbers.size
    return (
        numbers.astype(int).tolist()
        if is_counter and numbers.size > 1 and rows.min() >= FEWEST_ROWS
        else []
    )
