"""Lines of a text: what stands in them, and which number that is."""

import csv
import math
import re
from collections.abc import Sequence

# what stands for a value that is missing, in any case of letters
MISSING = {"", "nan", "+nan", "-nan", "na", "null", "-"}

_QUOTED = re.compile(r'"([^"]*)"|(\S+)')


def split(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Return the values in lines.

    Parameters
    ----------
    lines : sequence of str
        Lines that are not blank.
    delimiter : str
        What stands between two values; ``" "`` is any white space.

    Returns
    -------
    list of list of str
        The values of each line. There are fewer rows than lines if a value in quotes runs over several.

    Raises
    ------
    csv.Error
        Quotes that do not end, or a value that is far too long.
    """
    if delimiter == " ":
        return [
            [quoted or bare for quoted, bare in _QUOTED.findall(line)] if '"' in line else line.split()
            for line in lines
        ]
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True))


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
