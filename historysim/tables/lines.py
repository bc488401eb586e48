"""Lines of a text: what stands in them, and which number that is."""

import csv
import math
import re
from collections.abc import Sequence

# what stands for a value that is missing, in any case of letters
MISSING = {"", "nan", "+nan", "-nan", "na", "null", "-"}

AT_ONCE = 2000
"""Lines that are held as texts at once: few enough for the cache."""

_QUOTED = re.compile(r'"([^"]*)"|(\S+)')


def split(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Return the values of lines that are not blank; the delimiter ``" "`` is any white space.

    There are fewer rows than lines if a value in quotes runs over several. Quotes that do not end, or a value that is
    far too long, are a csv.Error.
    """
    if delimiter == " ":
        return [
            [quoted or bare for quoted, bare in _QUOTED.findall(line)] if '"' in line else line.split()
            for line in lines
        ]
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True))


def fields(line: str, delimiter: str) -> list[str]:
    """Return the values of one line, without blanks around them; none if quotes in it do not end."""
    try:
        rows = split([line], delimiter)
    except csv.Error:
        return []
    return [field.strip() for field in rows[0]] if len(rows) == 1 else []


def number(text: str, decimal: str) -> float | None:
    """Return a finite number, NaN where it is missing, or None where there is something else."""
    text = text.strip()
    if text.lower() in MISSING:
        return math.nan
    if not is_plain(text, decimal):
        return None
    try:
        value = float(text.replace(decimal, "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def is_plain(text: str, decimal: str) -> bool:
    """Return whether a text is free of what Python reads as part of a number and other programs do not."""
    return "_" not in text and text.isascii() and (decimal == "." or "." not in text)


def brief(text: str) -> str:
    """Return a value as a message quotes it."""
    return repr(text if len(text) <= 40 else text[:40] + "…")


def decimal_hint(text: str, decimal: str) -> str:
    """Return what to say of a text that is no number only because of its decimal sign; nothing of any other."""
    if decimal == "." and "," in text and number(text, ",") is not None:
        return '; if it has a decimal comma, say decimal = ","'
    if decimal == "," and "." in text and number(text, ".") is not None:
        return '; it has a decimal point, although decimal = "," was said'
    return ""
