"""What users read: words of messages, notices and progress, findings, and lines and tables of a terminal."""

import itertools
import json
import sys
import threading
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from unicodedata import category

import attrs


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


def shell_word(path: object) -> str:
    """Return a file name as one word of a shell command, quoted where that is needed; never an option."""
    import shlex

    name = str(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)


MOST_NAMED = 100  # words that a message names


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


def printable(text: str) -> str:
    """Return a text with what would steer a terminal, or turn a line round, as Python writes it in a text."""
    if text.isprintable():
        return text
    return "".join(each if _is_plain(each) else each.encode("unicode_escape").decode() for each in text)


def _is_plain(character: str) -> bool:
    return character in "\n\t" or category(character) == "Zs" or character.isprintable()


def columns(rows: Sequence[Sequence[str]]) -> str:
    """Return a table, column under column."""
    rows = [[printable(text) for text in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def html_table(rows: Iterable[Sequence[str]], heading: Sequence[str] = ()) -> str:
    """Return a table as HTML; the first text of each row is its label."""
    head = f"<thead><tr>{_cells('th', heading)}</tr></thead>" if heading else ""
    body = "".join(f"<tr>{_cells('th', row[:1])}{_cells('td', row[1:])}</tr>" for row in rows)
    return f"<table>{head}<tbody>{body}</tbody></table>"


def _cells(tag: str, texts: Iterable[str]) -> str:
    from html import escape

    return "".join(f'<{tag} style="text-align: left">{escape(text)}</{tag}>' for text in texts)


class Lines(tuple[tuple[str, str], ...]):
    """Labels and what belongs to them, which print and show themselves in two columns."""

    __slots__ = ()

    def __repr__(self) -> str:
        return columns(self)

    def _repr_html_(self) -> str:
        return html_table(self)


@attrs.frozen
class Finding:
    """An assumption of the model that does not hold."""

    name: str  #: which one, in a word
    value: float
    limit: float  #: the value at which it is no longer assumed to hold
    text: str  #: both in a line, with a remedy


def written_findings(findings: Iterable[Finding]) -> str:
    """Return findings as JSON, one on each line."""
    lines = (json.dumps(attrs.asdict(finding), ensure_ascii=False) for finding in findings)
    return "[\n" + ",\n".join(lines) + "\n]"


def read_findings(text: str) -> tuple[Finding, ...]:
    """Return the findings of what `written_findings` gives."""
    return tuple(Finding(**entry) for entry in json.loads(text))


Notify = Callable[[str], None]  # takes a notice, a sentence for the user


def silent(_: str) -> None:
    """Drop a notice."""


def warn(notice: str) -> None:
    """Give a notice as a UserWarning, as Python's own."""
    warnings.warn(notice, stacklevel=2)


@contextmanager
def progress_bar(shown: bool, unit: str, total: int | None = None, **options: Any) -> Iterator[Callable[..., object]]:
    """Show a bar of tqdm where standard error is a terminal; yield a function of units done, and of how many."""
    if not (shown and sys.stderr is not None and sys.stderr.isatty()):
        yield lambda *_: None
        return
    from tqdm import tqdm

    # tqdm's own lock is shared with forked processes: if one is killed while it has it, all others wait for ever
    tqdm.set_lock(threading.RLock())
    tqdm.monitor_interval = 0
    with tqdm(unit=unit, total=total, **options) as bar:

        def done(units: int = 1, of: int | None = None) -> None:
            bar.total = bar.total if of is None else of
            bar.update(units)

        yield done
