"""What messages have in common: what was given, what was meant, and how many."""

import itertools
from collections.abc import Collection


def nearest(word: str, known: Collection[str]) -> str:
    """Return what to write in place of an unknown word: the nearest known one, else all of them."""
    import difflib

    match = difflib.get_close_matches(word, known, n=1)
    if match:
        return f"did you mean {match[0]!r}?"
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
        return f"the text {value!r}" if len(value) <= 40 else f"the text {value[:40]!r}…"
    if isinstance(value, dict):
        return "a table"
    return "an array" if isinstance(value, list) else str(value)


def counted(count: int, one: str, several: str) -> str:
    """Return a number and what it counts: ``"1 asperity"``, ``"40,000 asperities"``."""
    return f"{count:,} {one if count == 1 else several}"
