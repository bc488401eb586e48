"""What messages have in common: what was given, what was meant, and how many."""

import itertools
from collections.abc import Collection


def nearest(word: str, known: Collection[str]) -> str:
    """Return what to write in place of an unknown word: the nearest known one, else all of them."""
    import difflib

    plain = {each.lower(): each for each in reversed([*known])}
    match = difflib.get_close_matches(word.lower(), plain, n=1) if len(word) > 1 else []
    # a word of a name of several, such as "stiffness" of "tangential-stiffness"
    match = match or [each for each in plain if len(word) > 3 and word.lower() in each]
    if match:
        return f"did you mean {' or '.join(repr(plain[each]) for each in match[:2])}?"
    return f"expected one of {listed(known)}" if known else "none is expected here"


MOST_NAMED = 100
"""Words that a message names."""


def listed(words: Collection[str]) -> str:
    """Return words with commas between them, of very many the first ones and how many more there are."""
    first = ", ".join(itertools.islice(words, MOST_NAMED))
    return f"{first}, and {len(words) - MOST_NAMED:,} more" if len(words) > MOST_NAMED else first


def shown(value: object) -> str:
    """Return a given value in brief and in the words of TOML and JSON."""
    if isinstance(value, bool):
        return str(value).lower()
    # Python refuses to print integers of some thousand digits
    if isinstance(value, int) and value.bit_length() > 64:
        return f"an integer of {value.bit_length()} bits"
    if isinstance(value, str):
        return repr(value) if len(value) <= 40 else f"{value[:40]!r}…"
    if isinstance(value, dict):
        return "a table"
    return "an array" if isinstance(value, list) else str(value)


def brief(value: object) -> str:
    """Return a value of Python in one line: as it is written where that is short, else its type."""
    text = repr(value)
    return text if len(text) <= 120 and "\n" not in text else f"of the type {type(value).__name__}"


def counted(count: int, one: str, several: str) -> str:
    """Return a number and what it counts: ``"1 asperity"``, ``"40,000 asperities"``."""
    return f"{count:,} {one if count == 1 else several}"
