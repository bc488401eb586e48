"""Lines and tables of texts: in columns for a terminal, as HTML for a notebook."""

from collections.abc import Iterable, Sequence
from typing import Any
from unicodedata import category


def printable(text: str) -> str:
    """Return a text with what would steer a terminal, or turn a line round, as Python writes it in a text."""
    if text.isprintable():
        return text
    return "".join(
        each if each in "\n\t" or category(each) == "Zs" or each.isprintable() else _escaped(each) for each in text
    )


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode()


def two_columns(lines: Iterable[tuple[str, str]]) -> str:
    """Return labels and what belongs to them, one below the other."""
    lines = [(printable(label), printable(text)) for label, text in lines]
    width = max((len(label) for label, _ in lines), default=0) + 2
    return "\n".join(f"{label:<{width}}{text}".rstrip() for label, text in lines)


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
        return two_columns(self)

    def _repr_html_(self) -> str:
        return html_table(self)


class FieldsAsHtml:
    """Shows the fields of an attrs class, as its repr does, as a table in a notebook."""

    def _repr_html_(self) -> str:
        import attrs

        shown: Any = type(self)
        rows = []
        for field in attrs.fields(shown):
            if field.repr:
                value = getattr(self, field.name)
                rows.append((field.name.replace("_", " "), field.repr(value) if callable(field.repr) else repr(value)))
        return html_table(rows)
