"""Texts of heights: each line runs along x, and the next line is the next y."""

import csv
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.tables.from_text import plain_numbers
from historysim.tables.lines import brief, decimal_hint, number, split

COORDINATES = "name it .xyz if its columns are x and z, or x, y and z; save it as .npy if it is a narrow map"

_DELIMITERS = ";\t,"
# what instruments write beside what any file of numbers may have in place of a missing value
_MISSING = re.compile(r"n/a|bad|[+-]?1\.#(?:qnan|snan|ind)|\*+|-+", re.IGNORECASE)
# only after white space, since 1.#QNAN is how some programs write NaN
_COMMENT = re.compile(r"(?:^|(?<=\s))[#%]")
# a comment that states a length or a unit, as "# Width: 10 µm" in any language, or of a program with its own units
_STATES_UNIT = re.compile(
    r"[:=：]\s*(?:[+-]?[\d.]+(?:e[+-]?\d+)?\s*)?(?:[pnuµμmck]?m|Å)\s*$|\bFile Format\b|\bBit2nm\b|\b[xy]-length\b"
)


def foreign_header(path: Path) -> str:
    """Return the line before the first heights that only a reader of its format understands, or nothing."""
    with path.open(encoding="utf-8-sig", errors="replace") as stream:
        for line_number, line in enumerate(stream, 1):
            shown = f"line {line_number}: {line.strip()[:60]!r}"
            values, comment = _split_comment(line)
            if _STATES_UNIT.search(comment):
                return shown
            if values.strip():
                return "" if mostly_heights(re.findall(r'[^\s,;"]+', values)) else shown
    return ""


def mostly_heights(cells: list[str]) -> bool:
    """Return whether half of some texts, or more, are numbers or stand for a missing height."""
    return 2 * sum(_height(cell, ".") is not None for cell in cells) >= len(cells)


def read_matrix(lines: Iterable[str], check_size: Callable[[tuple[int, int]], None]) -> Floats:
    """Return the heights in a text.

    Parameters
    ----------
    lines : iterable of str
        The lines of a text.
    check_size : callable
        Raises an error at a shape that is too large; called with each line.

    Returns
    -------
    numpy.ndarray (nx, ny) or (n,)
        The heights, NaN where missing; a text of one column is a profile.

    Raises
    ------
    InputError
        Something that is no number, lines of different lengths, or a text that may hold positions, too.
    """
    rows: list[Floats] = []
    first, delimiter, decimal, blank_corner, ends_blank = 0, " ", "", False, True
    for line_number, whole in enumerate(lines, 1):
        line = _split_comment(whole)[0].strip("\r\n ")
        if not line or not (line.strip() or delimiter == "\t"):
            continue
        if not rows:
            first, delimiter = line_number, next((mark for mark in _DELIMITERS if mark in line), " ")
            blank_corner = line[0] == delimiter
        if delimiter == ";":
            marks = decimal + "".join(mark for mark in ".," if mark in line)
            if len(set(marks)) > 1:
                raise InputError(
                    f"line {line_number}: a decimal point where another value has a comma; write them alike"
                )
            decimal = marks[:1]
        row = _row(line, delimiter, decimal or ".", line_number)
        if rows and row.size != rows[0].size:
            raise InputError(
                f"line {line_number}: {row.size} values where line {first} has {rows[0].size}; expected as many in "
                "each line"
            )
        rows.append(row)
        check_size((len(rows), row.size))
        ends_blank = ends_blank and line[-1] == delimiter
    if not rows:
        raise InputError("has no line with heights")
    # what stands behind the last delimiter of every line is no column
    matrix = np.array(rows)[:, : -1 if ends_blank else None]
    if blank_corner and _is_scale(matrix[0, 1:]) and _is_scale(matrix[1:, 0]):
        raise InputError("has positions in its first line and first column; expected heights only: take them out")
    return _oriented(matrix)


def _split_comment(line: str) -> tuple[str, str]:
    mark = _COMMENT.search(line) if "#" in line or "%" in line else None
    return (line[: mark.start()], line[mark.start() :]) if mark else (line, "")


def _row(line: str, delimiter: str, decimal: str, line_number: int) -> Floats:
    try:
        cells = split([line], delimiter)[0]
    except csv.Error as error:
        raise InputError(f"line {line_number}: {error}; expected numbers without quotes") from error
    plain = plain_numbers(cells, decimal)
    if plain is not None:
        return plain
    heights = [_height(cell, decimal) for cell in cells]
    if None in heights:
        column = heights.index(None)
        cell = cells[column].strip()
        raise InputError(
            f"line {line_number}, column {column + 1}: {brief(cell)}; expected a finite number, or nan where the "
            f"height is missing{'; write the decimal comma as a point' if decimal_hint(cell, decimal) else ''}"
        )
    return np.array(heights, dtype=np.float64)


def _height(cell: str, decimal: str) -> float | None:
    """Return a height, NaN where it is missing, or None where there is something else."""
    value = number(cell, decimal)
    return math.nan if value is None and _MISSING.fullmatch(cell.strip()) else value


def _is_scale(values: Floats) -> bool:
    steps = np.diff(values)
    return steps.size > 1 and steps[0] != 0 and bool(np.allclose(steps, steps[0], rtol=1e-6, atol=0))


def _oriented(matrix: Floats) -> Floats:
    lines, columns = matrix.shape
    if 1 < columns <= 3 < lines:
        raise InputError(f"has {columns} columns in {lines:,} lines, which may be coordinates; {COORDINATES}")
    return matrix[:, 0] if columns == 1 else np.ascontiguousarray(matrix.T)
