"""One self-contained HTML page: sections of text, tables and pictures, and scripts that stand in the page itself."""

import base64
import functools
import io
import textwrap
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import attrs

from historysim._version import __version__
from historysim.basics.display import html_table
from historysim.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 160
WIDEST_COLUMN = 4.0
"""Width of a figure up to which two stand side by side [inch]."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1080px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; line-height: 1.25; }
h2 { font-size: 1.15rem; margin-top: 2.2rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; font-size: 14px; }
th, td { padding: .15rem 1.2rem .15rem 0; vertical-align: top; } th { font-weight: 600; }
img { max-width: 100%; height: auto; } figure { margin: 1rem 0; } figcaption { color: #555; font-size: 13px; }
pre { background: #f5f5f2; padding: .8rem; overflow-x: auto; font-size: 13px; }
figure.column { display: inline-block; width: 48%; min-width: 340px; margin: 1rem 1% 1rem 0; vertical-align: top; }
.wide { overflow-x: auto; }
.warning { border-left: 4px solid #d1603d; padding-left: .8rem; } .note { color: #555; }
"""


@attrs.frozen
class Section:
    """A part of a page.

    Attributes
    ----------
    title : str
    parts : tuple of str
        HTML, one after the other.
    anchor : str
        The name by which links of the page reach it; none where it is empty.
    """

    title: str
    parts: tuple[str, ...]
    anchor: str = ""


def page(title: str, sections: Iterable[Section], *, head: str = "") -> str:
    """Return a whole page; ``head`` is HTML that its scripts need."""
    body = "\n".join(
        f"<section{_named(each)}><h2>{escape(each.title)}</h2>\n{chr(10).join(each.parts)}</section>"
        for each in sections
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="generator" content="historysim {__version__}">\n<title>{escape(title)}</title>\n'
        # a browser that is asked for no icon looks for none
        f'<link rel="icon" href="data:,">\n<style>{STYLE}</style>\n{head}\n</head>\n'
        f"<body>\n<h1>{escape(title)}</h1>\n{body}\n</body>\n</html>\n"
    )


EXPECTED = (
    "expected a result of historysim run, a sweep, friction loops, friction over time or distance, a fit, or a "
    "scenario whose loading is measured"
)


@functools.singledispatch
def page_of(what: Any) -> str:
    """Return the page of a thing that has a report; what writes that of a type says so with `page_of.register`.

    Raises
    ------
    InputError
        It has none.
    """
    raise InputError(f"this {type(what).__name__} has no report; {EXPECTED}")


def _named(section: Section) -> str:
    return f' id="{escape(section.anchor)}"' if section.anchor else ""


def contents(sections: Iterable[Section]) -> Section:
    """Return a section of links to others."""
    links = (f'<li><a href="#{escape(each.anchor)}">{escape(each.title)}</a></li>' for each in sections)
    return Section("Contents", (f"<ul>{''.join(links)}</ul>",))


def table(rows: Iterable[Sequence[str]], heading: Sequence[str] = ()) -> str:
    """Return a table of texts; the first of each row is its label."""
    return f'<div class="wide">{html_table(rows, heading)}</div>'


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph; of the kind "warning" or "note" it looks like one."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def code(text: str) -> str:
    """Return lines to be typed, or of a file."""
    return f"<pre>{escape(textwrap.dedent(text).strip())}</pre>"


def folded(label: str, text: str) -> str:
    """Return lines of a file that show when their label is clicked."""
    return f"<details><summary>{escape(label)}</summary>{code(text)}</details>"


def picture(figure: "Figure", caption: str) -> str:
    """Return a figure, embedded as PNG, with a caption below it."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS_PER_INCH)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    kind = ' class="column"' if figure.get_figwidth() <= WIDEST_COLUMN else ""
    return (
        f'<figure{kind}><img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
