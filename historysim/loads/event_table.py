"""Events as a table (CSV): what ``historysim append`` reads and ``historysim log --csv`` writes."""

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TextIO

from historysim.basics.units import quantity
from historysim.errors import InputError
from historysim.loads.events import EVENT_KINDS, Event, FrictionChange


def read_events(path: Path) -> list[Event]:
    """Read events from a table with a header line: ``time`` and one or more of the columns in `EVENT_KINDS`.

    Each cell that is not empty is an event at the time of its line. Numbers are SI; a cell may carry a unit, as in
    ``50 mN``. Several coefficients of friction stand in one cell, with spaces between them.

    Raises
    ------
    InputError
        A file that cannot be read; the message names line and column.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            return list(_events(path, stream))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; expected a table of events (CSV)") from None
    except (UnicodeDecodeError, csv.Error, IsADirectoryError) as error:
        raise InputError(f"{path}: is not a CSV table in UTF-8 ({error})") from error


def _events(path: Path, stream: TextIO) -> Iterator[Event]:
    reader = csv.reader(stream)
    header = [name.strip() for name in next(reader, [])]
    unknown = [name for name in header if name not in {"time", *EVENT_KINDS}]
    if unknown or "time" not in header or len(header) < 2 or len(set(header)) < len(header):
        raise InputError(
            f"{path}: line 1: has the columns {', '.join(header) or 'none'}; expected time and one or more of "
            f"{', '.join(EVENT_KINDS)}, each once"
        )
    at = header.index("time")
    for cells in reader:
        if not any(cell.strip() for cell in cells):
            continue
        where = f"{path}: line {reader.line_num}"
        if len(cells) != len(header):
            raise InputError(f"{where}: has {len(cells)} cells; expected {len(header)}, as in the header")
        time = _number(cells[at], "s", f"{where}, column time")
        for name, cell in zip(header, cells, strict=True):
            if name == "time" or not cell.strip():
                continue
            kind = EVENT_KINDS[name]
            place = f"{where}, column {name}"
            several = [_number(part, kind.unit, place) for part in cell.split()] if name == "friction" else []
            value = (several if len(several) > 1 else several[0]) if several else _number(cell, kind.unit, place)
            try:
                yield kind(time, value)
            except InputError as error:
                raise InputError(f"{place}: {error}") from error


def _number(cell: str, unit: str, place: str) -> float:
    try:
        return float(cell)
    except ValueError:
        pass
    try:
        return quantity(cell.strip(), unit)
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def value_text(event: Event, number_text: str = "") -> str:
    """Write what an event says, with as many digits as tell it from any other, or in a format."""
    value = event.friction if isinstance(event, FrictionChange) else event.value
    each: Iterable[float] = value if isinstance(value, tuple) else (value,)
    return " ".join(format(number, number_text) if number_text else repr(number) for number in each)
