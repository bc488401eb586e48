"""JSON: arrays by the path of their keys, matrices as lists of lists, and lists of records."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from historysim.errors import InputError
from historysim.tables.arrays import Array, Contents, Selection, readable
from historysim.tables.columns import Format
from historysim.tables.from_text import decoded
from historysim.tables.readers import READERS, TableReader


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise InputError(f"the key {twice!r} stands twice in one object; rename one of them")
    return table


def _gather(contents: Contents, name: str, value: object) -> None:
    """Add the arrays and texts below a name to the contents."""
    if isinstance(value, dict):
        for key, item in value.items():
            _gather(contents, f"{name}.{key}" if name else key, item)
    elif isinstance(value, str):
        contents.texts[name] = value
    elif not isinstance(value, list):
        contents.arrays.append(Array(name, (), lambda _: [value]))
    elif value and all(isinstance(item, dict) for item in value):
        for key, values in _by_key(value).items():
            contents.arrays.append(_of_records(f"{name}.{key}" if name else key, values, len(value)))
    else:
        contents.arrays.append(_array(name, value))


def _by_key(records: list[dict[str, Any]]) -> dict[str, dict[int, Any]]:
    """Return the values of each key by the number of their record, in a time that grows with the values alone."""
    by_key: dict[str, dict[int, Any]] = {}
    for number, record in enumerate(records):
        for key, value in record.items():
            by_key.setdefault(key, {})[number] = value
    return by_key


def _of_records(name: str, values: dict[int, Any], count: int) -> Array:
    """Return the values of one key; a record that has none misses it."""
    if len(values) == count:
        return _array(name, [*values.values()])

    def read(selection: Selection) -> list[Any]:
        rows: Any = selection[0]
        # of a part, as long as the part alone takes
        chosen: list[Any] = [values.get(number) for number in range(count)[rows]]
        return chosen

    return Array(name, (count,), read)


def _array(name: str, values: list[Any]) -> Array:
    kinds = set(map(type, values))
    if kinds != {list}:
        return Array(name, (len(values),), lambda selection: values[selection[0]])
    width = len(values[0])
    if set(map(len, values)) != {width}:
        return Array(name, (len(values),), lambda _: _refuse(name, values))

    def read(selection: Selection) -> list[Any]:
        rows, columns = selection
        if isinstance(rows, int):
            chosen: list[Any] = values[rows][columns]
            return chosen
        if isinstance(columns, int):
            return [row[columns] for row in values[rows]]
        return [item for row in values[rows] for item in row[columns]]

    return Array(name, (len(values), width), read)


def _refuse(name: str, rows: list[list[Any]]) -> None:
    row = next(row for row, values in enumerate(rows) if len(values) != len(rows[0]))
    raise InputError(
        f"column {name!r}: its lists have different lengths: {len(rows[0])} in the first, {len(rows[row])} in number "
        f"{row + 1}; expected a matrix"
    )


@READERS.register
class JsonReader(TableReader):
    """JSON."""

    kind, endings = "json", (".json",)

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Contents]:
        """Yield what a JSON file holds; no JSON, another encoding, or one key twice is an InputError."""
        text = decoded(path, layout.encoding or "utf-8")
        with readable("JSON"):
            try:
                document = json.loads(text, object_pairs_hook=_object)
            except RecursionError:
                raise InputError("is nested too deeply; expected arrays by their keys") from None
        contents = Contents([])
        _gather(contents, "", document)
        yield contents
