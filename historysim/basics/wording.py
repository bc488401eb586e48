"""User-facing text: words of messages, notices and progress, findings, and lines and tables of a terminal."""

import itertools
import json
import sys
import textwrap
import threading
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from unicodedata import category

import attrs

TERMINAL = 120  # characters of a line of a wide terminal
NARROWEST_COLUMN = 24  # characters to which a column of prose is wrapped


def nearest(word: str, candidates: Collection[str], *, in_file: bool = False) -> str:
    """Suggest a replacement of an unknown word: the nearest known word, otherwise all known words.

    Words that a file holds (`in_file`) are cut to the length of a quotation.
    """
    import difflib

    plain = {candidate.lower(): candidate for candidate in reversed([*candidates])}
    match = difflib.get_close_matches(word.lower(), plain, n=1) if len(word) > 1 else []
    # part of a compound name, such as "stiffness" of "tangential-stiffness"
    match = match or [
        candidate for candidate in plain if len(word) > 3 and word.lower() in candidate
    ]
    if match:
        most = 1 if in_file else 2
        return f"did you mean {' or '.join(quote(plain[candidate]) for candidate in match[:most])}?"
    listed = list_names(candidates) if in_file else join_words(candidates)
    return f"expected one of {listed}" if candidates else "none is expected here"


def shell_word(path: object) -> str:
    """Return a file name as one argument of a shell command, quoted if necessary, and never an option."""
    import shlex

    name = str(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)


MOST_NAMED = 100  # largest number of words listed in a message


def join_words(words: Collection[str]) -> str:
    """Join words by commas; a long list is cut, with the number of remaining words."""
    text = ", ".join(itertools.islice(words, MOST_NAMED))
    return f"{text}, and {len(words) - MOST_NAMED:,} more" if len(words) > MOST_NAMED else text


def format_value(value: object) -> str:
    """Return a short form of a value in the notation of TOML and JSON."""
    if isinstance(value, bool):
        return str(value).lower()
    # Python does not convert integers of several thousand digits
    if isinstance(value, int) and value.bit_length() > 64:
        return f"an integer of {value.bit_length()} bits"
    if isinstance(value, str):
        return quote(value)
    if isinstance(value, dict):
        return "a table"
    return "an array" if isinstance(value, list) else str(value)


MOST_QUOTED = 40  # characters of the content of a file in a message


def quote(content: object) -> str:
    """Quote a value from a file in a message: at most 40 characters, control and bidirectional ones escaped.

    Texts are in quotes, other values are not.
    """
    if isinstance(content, str):
        return repr(content) if len(content) <= MOST_QUOTED else f"{content[:MOST_QUOTED]!r}…"
    text = repr(content)
    return text if len(text) <= MOST_QUOTED else f"{text[:MOST_QUOTED]}…"


def list_names(names: Collection[str]) -> str:
    """List names that a file holds: at most 40 characters of them, escaped, and the number of remaining ones."""
    listed, room = list[str](), MOST_QUOTED
    for name in names:
        if listed and len(name) > room:
            break
        text = repr(name[:room])[1:-1] + ("…" if len(name) > room else "")
        listed.append(text)
        room -= len(name)
        if room <= 0:
            break
    more = len(names) - len(listed)
    return ", ".join(listed) + (f", and {more:,} more" if more else "")


def brief(value: object) -> str:
    """Return a Python value in one line: its repr if that is short, otherwise its type."""
    text = repr(value)
    return text if len(text) <= 120 and "\n" not in text else f"of the type {type(value).__name__}"


def count_text(count: int, singular: str, plural: str) -> str:
    """Return a number with its noun: ``"1 asperity"``, ``"40,000 asperities"``."""
    return f"{count:,} {singular if count == 1 else plural}"


def printable(text: str) -> str:
    """Escape control and bidirectional characters of a text, as Python writes them."""
    if text.isprintable():
        return text
    return "".join(
        character if _is_plain(character) else character.encode("unicode_escape").decode()
        for character in text
    )


def _is_plain(character: str) -> bool:
    return character in "\n\t" or category(character) == "Zs" or character.isprintable()


def columns(rows: Sequence[Sequence[str]], width: int = 0) -> str:
    """Format a table with aligned columns.

    A table that is wider than ``width`` characters has its last column wrapped, or is split into
    blocks that repeat its first column.
    """
    rows = [[printable(text) for text in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    before_last = sum(widths[:-1]) + 2 * len(widths[:-1])
    if 0 < width < before_last + sum(widths[-1:]):
        if width - before_last >= NARROWEST_COLUMN:
            return columns([line for row in rows for line in _wrap_last(row, width - before_last)])
        if len(widths) > 2:
            blocks = _fitting_blocks(widths, width)
            return "\n\n".join(columns([[row[0], *row[block]] for row in rows]) for block in blocks)
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _wrap_last(row: Sequence[str], width: int) -> Iterator[list[str]]:
    """Yield a row of a table with its last cell wrapped: one row for each line."""
    first, *further = textwrap.wrap(row[-1], width) or [""]
    yield [*row[:-1], first]
    yield from ([*[""] * (len(row) - 1), line] for line in further)


def _fitting_blocks(widths: Sequence[int], width: int) -> Iterator[slice]:
    """Yield slices of the columns after the first, so that each fits a width together with the first."""
    start, used = 1, widths[0]
    for index, own in enumerate(widths[1:], start=1):
        if used + 2 + own > width and index > start:
            yield slice(start, index)
            start, used = index, widths[0]
        used += 2 + own
    yield slice(start, len(widths))


def html_table(rows: Iterable[Sequence[str]], heading: Sequence[str] = ()) -> str:
    """Format a table as HTML; the first cell of each row is its label."""
    head = f"<thead><tr>{_cells('th', heading)}</tr></thead>" if heading else ""
    body = "".join(f"<tr>{_cells('th', row[:1])}{_cells('td', row[1:])}</tr>" for row in rows)
    return f"<table>{head}<tbody>{body}</tbody></table>"


def html_of_fields(instance: Any) -> str:
    """Format the fields of an attrs object as an HTML table, those that its repr has."""
    fields = [field for field in attrs.fields(type(instance)) if field.repr]
    values = (getattr(instance, field.name) for field in fields)
    texts = (
        field.repr(value) if callable(field.repr) else repr(value)
        for field, value in zip(fields, values, strict=True)
    )
    return html_table(
        (field.name.replace("_", " "), text) for field, text in zip(fields, texts, strict=True)
    )


def _cells(tag: str, texts: Iterable[str]) -> str:
    return "".join(f'<{tag} style="text-align: left">{escape_html(text)}</{tag}>' for text in texts)


def escape_html(text: str) -> str:
    """Escape a text for HTML, and its control and bidirectional characters."""
    from html import escape

    return escape(printable(text))


class Lines(tuple[tuple[str, str], ...]):
    """Lines of label and text, which print and display as two columns."""

    __slots__ = ()

    def __repr__(self) -> str:
        return columns(self)

    def _repr_html_(self) -> str:
        return html_table(self)


@attrs.frozen
class Finding:
    """Assumption of the model that does not hold."""

    name: str  #: short name of the assumption
    value: float
    limit: float  #: value beyond which it is not assumed to hold
    text: str  #: message with value, limit and remedy


def written_findings(findings: Iterable[Finding]) -> str:
    """Format findings as JSON, one per line."""
    lines = (json.dumps(attrs.asdict(finding), ensure_ascii=False) for finding in findings)
    return "[\n" + ",\n".join(lines) + "\n]"


def read_findings(text: str) -> tuple[Finding, ...]:
    """Parse findings from the output of `written_findings`."""
    return tuple(Finding(**entry) for entry in json.loads(text))


Notify = Callable[[str], None]  # receives a notice, a sentence for the user


def silent(_: str) -> None:
    """Drop a notice."""


def warn(notice: str) -> None:
    """Give a notice as a UserWarning, as Python's own."""
    warnings.warn(notice, stacklevel=2)


@contextmanager
def progress_bar(
    shown: bool, unit: str, total: int | None = None, **options: Any
) -> Iterator[Callable[..., object]]:
    """Show a tqdm progress bar if standard error is a terminal; yield a function of completed units and their total."""
    if not (shown and sys.stderr is not None and sys.stderr.isatty()):
        yield lambda *_: None
        return
    from tqdm import tqdm

    # the default lock of tqdm is shared with forked processes, which deadlock if its holder is
    # killed
    tqdm.set_lock(threading.RLock())
    tqdm.monitor_interval = 0
    with tqdm(unit=unit, total=total, **options) as bar:

        def done(units: int = 1, of: int | None = None) -> None:
            bar.total = bar.total if of is None else of
            bar.update(units)

        yield done
