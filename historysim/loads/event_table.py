"""Events as a table: what ``historysim append`` reads, and ``historysim log --csv`` writes."""

import csv
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import attrs

from historysim.basics.files import is_log, kind_text, replacing
from historysim.basics.units import quantity
from historysim.basics.wording import nearest, shell_word
from historysim.errors import InputError
from historysim.loads.events import EVENTS, Event, TangentialEvent
from historysim.tables import Format, opened_rows
from historysim.tables.columns import settled, split_unit
from historysim.tables.head import Heading
from historysim.tables.lines import brief, decimal_hint, number

_ALONG_X, _ALONG_Y = " x", " y"  # end the names of columns of a pair, as in tables of results
_PAIRS = [
    name + along
    for name, kind in EVENTS.own().items()
    if issubclass(kind, TangentialEvent)
    for along in (_ALONG_X, _ALONG_Y)
]
_NAMES = ("time", *EVENTS.own(), *_PAIRS)
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
    bar, and radii: ``0 2: 1e-9 2e-9 | 1e-6 1e-6``; either may be left out. In two tangential directions a load or
    displacement has two columns, ``tangential_load x`` and ``tangential_load y``, as tables of results have them; an
    empty field, or a column that is not there, leaves that component to other events.

    Raises InputError: another file, or a value that is no event; the message names line and column.
    """
    if kind := kind_text(path):
        hint = f"; historysim log {shell_word(path)} --csv TABLE writes its events to one" if is_log(path) else ""
        raise InputError(f"{path}: {kind}{hint}; expected {_EXPECTED}")
    layout = layout or Format()
    with opened_rows(path, _NAMES, layout) as (heading, rows):
        columns = _columns(heading)
        return [event for line, texts in rows for event in _events(line, texts, columns, layout.decimal)]


@attrs.frozen
class _EventColumn:
    """A column: where it stands, its SI unit, and the factor that takes its numbers there."""

    name: str  #: of the kind of event, or "time"
    place: int
    unit: str
    factor: float
    #: The columns of x and y, of a pair; None for a component that has no column.
    components: "tuple[_EventColumn | None, ...]" = ()

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
    occurrences = Counter(names)
    columns = []
    for place, name in enumerate(names):
        kind = _kind_of(name)
        if kind != "time" and kind not in EVENTS:
            known = dict.fromkeys(("time", *EVENTS.own(), *EVENTS))
            raise InputError(f"column {name!r} is no kind of event; {nearest(name, known)}")
        if occurrences[name] > 1:
            raise InputError(f"the header names {name!r} {occurrences[name]} times; expected it once")
        unit = "s" if kind == "time" else EVENTS[kind].unit
        _, factor, *_ = settled(None, heading.units(place), (unit,), f"column {name}")
        columns.append(_EventColumn(name, place, unit, factor))
    columns = _paired(columns)
    if "time" not in names or len(names) < 2:
        raise InputError(f"the header names {', '.join(names)} alone; expected {_EXPECTED}")
    return sorted(columns, key=lambda column: column.name != "time")


def _kind_of(name: str) -> str:
    """Return the kind of event that a column has, without the component of a pair."""
    stem = name.removesuffix(_ALONG_X).removesuffix(_ALONG_Y)
    return stem if stem in EVENTS and issubclass(EVENTS[stem], TangentialEvent) else name


def _paired(columns: Sequence[_EventColumn]) -> list[_EventColumn]:
    """Join the columns of x and y; one without the other, or beside a column of both, is an InputError."""
    by_name = {column.name: column for column in columns}
    found = []
    for column in columns:
        kind = _kind_of(column.name)
        if column.name == kind:
            found.append(column)
            continue
        along_x, along_y = f"{kind}{_ALONG_X}", f"{kind}{_ALONG_Y}"
        if kind in by_name:
            raise InputError(f"columns {kind!r} and {column.name!r}; expected {along_x!r} and {along_y!r} alone")
        if column.name == along_x or along_x not in by_name:
            components = by_name.get(along_x), by_name.get(along_y)
            found.append(attrs.evolve(column, name=kind, components=components))
    return found


def _events(line: int, texts: Sequence[str], columns: Sequence[_EventColumn], decimal: str) -> Iterator[Event]:
    time = 0.0
    for column in columns if any(map(str.strip, texts)) else ():
        text = texts[column.place].strip()
        try:
            if column.name == "time":
                time = column.value(text, decimal)
            elif column.components:
                yield from _pair(time, texts, column, decimal)
            elif text:
                yield EVENTS[column.name].from_cell(time, text, partial(column.value, decimal=decimal))
        except InputError as error:
            raise InputError(f"line {line}, column {column.name}: {error}") from error


def _pair(time: float, texts: Sequence[str], of: _EventColumn, decimal: str) -> Iterator[Event]:
    """Yield the event of two components, of which an empty field leaves one open; none where both are empty."""
    given = [(column, texts[column.place].strip() if column else "") for column in of.components]
    pair = tuple(column.value(text, decimal) if column and text else None for column, text in given)
    kind: Any = EVENTS[of.name]
    if pair != (None, None):
        yield kind(time, pair)


def write_events(path: Path, events: Iterable[Event]) -> None:
    """Write events to a table (CSV, in SI), one on each line, which `read_events` reads bit for bit."""
    events = list(events)
    own = EVENTS.own()
    present = {event.name for event in events} or set(own)
    pairs = {event.name for event in events if isinstance(event, TangentialEvent) and event.planar}
    kinds = [*(name for name in own if name in present), *sorted(present - set(own))]
    names = [name for kind in kinds for name in ([kind + _ALONG_X, kind + _ALONG_Y] if kind in pairs else [kind])]
    with replacing(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["time", *names])
        for event in events:
            cells = {event.name: event.cell}
            if event.name in pairs and isinstance(event, TangentialEvent):
                texts = ("" if each is None else repr(each) for each in event.value)
                cells = dict(zip((event.name + _ALONG_X, event.name + _ALONG_Y), texts, strict=True))
            writer.writerow([repr(event.time), *(cells.get(name, "") for name in names)])
