"""Events as a table: what ``historysim append`` reads, and ``historysim log --csv`` writes."""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from functools import partial
from pathlib import Path

import attrs

from historysim.basics.files import is_log, kind_text, replacing
from historysim.basics.units import quantity
from historysim.basics.wording import nearest
from historysim.errors import InputError
from historysim.loads.events import EVENTS, Event
from historysim.tables import Format, opened_rows
from historysim.tables.columns import settled, split_unit
from historysim.tables.head import Heading
from historysim.tables.lines import brief, decimal_hint, number

_NAMES = ("time", *EVENTS.own())
_EXPECTED = (
    f"a table of events: a text with a header line that names time, and one or more of {', '.join(EVENTS.own())}"
)


def read_events(path: Path, layout: Format | None = None) -> list[Event]:
    """Read events from a table, in the order of the table, which need not be that of time.

    The header names ``time`` and one or more kinds of events. Each value that is not empty is an event at the time of
    its line; those of one line follow in the order of the columns. Numbers are SI, or in the unit that the header has
    beside the name, as in ``normal_load [mN]``; a value may also carry its own, as in ``50 mN``. Several coefficients
    of friction, one for each asperity, have spaces between them; a list of only one stands in brackets, ``[0.2]``.
    Indices of chosen asperities stand in front, with a colon: ``0 2: 0.3 0.4``. A change of geometry has heights, a
    bar, and radii: ``0 2: 1e-9 2e-9 | 1e-6 1e-6``; either may be left out.

    Raises InputError: another file, or a value that is no event; the message names line and column.
    """
    if kind := kind_text(path):
        hint = f"; historysim log {path} --csv TABLE writes its events to one" if is_log(path) else ""
        raise InputError(f"{path}: {kind}{hint}; expected {_EXPECTED}")
    layout = layout or Format()
    with opened_rows(path, _NAMES, layout) as (heading, rows):
        columns = _columns(heading)
        return [event for line, texts in rows for event in _events(line, texts, columns, layout.decimal)]


@attrs.frozen
class _EventColumn:
    """A column: where it stands, its SI unit, and the factor that takes its numbers there."""

    name: str
    place: int
    unit: str
    factor: float

    def value(self, text: str, decimal: str) -> float:
        value = number(text, decimal)
        if value is not None and math.isfinite(value):
            if self.factor == 1:
                return value
            # the product of the decimals, rounded once, is what the number says with its unit beside it
            return float(Decimal(text.replace(decimal, ".")) * Decimal(repr(self.factor)))
        hint = decimal_hint(text.partition(" ")[0], decimal)
        if hint or value is not None or text[-1].isdecimal():
            raise InputError(f"{brief(text)}; expected a finite number{hint}")
        if self.unit == "1":
            raise InputError(f"{brief(text)}; expected a plain number, such as 0.2")
        return quantity(text.replace(decimal, ".", 1), self.unit)


def _columns(heading: Heading) -> list[_EventColumn]:
    """Return the columns of a table, that of the time first, which the others need."""
    names = [split_unit(name)[0] for name in heading.names]
    columns = []
    for place, name in enumerate(names):
        if name != "time" and name not in EVENTS:
            known = dict.fromkeys(("time", *EVENTS.own(), *EVENTS))
            raise InputError(f"column {name!r} is no kind of event; {nearest(name, known)}")
        if names.count(name) > 1:
            raise InputError(f"the header names {name!r} {names.count(name)} times; expected it once")
        unit = "s" if name == "time" else EVENTS[name].unit
        _, factor, *_ = settled(None, heading.units(place), (unit,), f"column {name}")
        columns.append(_EventColumn(name, place, unit, factor))
    if "time" not in names or len(names) < 2:
        raise InputError(f"the header names {', '.join(names)} alone; expected {_EXPECTED}")
    return sorted(columns, key=lambda column: column.name != "time")


def _events(line: int, texts: Sequence[str], columns: Sequence[_EventColumn], decimal: str) -> Iterator[Event]:
    time = 0.0
    for column in columns if any(map(str.strip, texts)) else ():
        text = texts[column.place].strip()
        try:
            if column.name == "time":
                time = column.value(text, decimal)
            elif text:
                yield EVENTS[column.name].from_cell(time, text, partial(column.value, decimal=decimal))
        except InputError as error:
            raise InputError(f"line {line}, column {column.name}: {error}") from error


def write_events(path: Path, events: Iterable[Event]) -> None:
    """Write events to a table (CSV, in SI), one on each line, which `read_events` reads bit for bit."""
    events = list(events)
    own = EVENTS.own()
    present = {event.name for event in events} or set(own)
    names = [*(name for name in own if name in present), *sorted(present - set(own))]
    with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["time", *names])
        writer.writerows(
            [repr(event.time), *(event.cell if event.name == name else "" for name in names)] for event in events
        )
