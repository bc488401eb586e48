"""One self-contained HTML page: sections of text, tables and pictures, and scripts that stand in the page itself."""

import base64
import functools
import io
import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim._version import __version__
from historysim.basics.wording import html_table
from historysim.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image as PILImage

DOTS_PER_INCH = 160
THUMBNAIL = 150  # height of a thumbnail [pixels]
WIDEST_COLUMN = 4.0  # width of a figure up to which two stand side by side [inch]

STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")


@attrs.frozen
class Section:
    """A part of a page."""

    title: str
    parts: tuple[str, ...]  #: HTML, one after the other
    anchor: str = ""  #: the target of links in the page


def page(title: str, sections: Iterable[Section], *, head: str = "") -> str:
    """Return a whole page; ``head`` is HTML that its scripts need."""
    body = "\n".join(
        f"<section{_named(each)}><h2>{escape(each.title)}</h2>\n{chr(10).join(each.parts)}</section>"
        for each in sections
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="generator" content="historysim {__version__}">\n<title>{escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # a browser that is asked for no icon looks for none
        f'<link rel="icon" href="data:,">\n<style>\n{STYLE}</style>\n{head}\n</head>\n'
        f"<body>\n<h1>{escape(title)}</h1>\n{body}\n</body>\n</html>\n"
    )


EXPECTED = (
    "expected a result of historysim run, a sweep, friction loops, friction over time or distance, a fit, a reduced "
    "model (JSON), or a scenario with a measured loading"
)


@functools.singledispatch
def page_of(what: Any) -> str:
    """Return the report of an object as HTML; a type registers its own with `page_of.register`."""
    raise InputError(f"this {type(what).__name__} has no report; {EXPECTED}")


def _named(section: Section) -> str:
    return f' id="{escape(section.anchor)}"' if section.anchor else ""


def contents(groups: Mapping[str, Sequence[Section]]) -> Section:
    """Return a section of links to others in groups, each with its first picture, small."""
    parts = []
    for name, sections in groups.items():
        links = (
            f'<li><a href="#{escape(each.anchor)}">{thumbnail(each.parts, "")}<br>{escape(each.title)}</a></li>'
            for each in sections
        )
        parts += [f"<h3>{escape(name)}</h3>", f'<ul class="thumbnails">{"".join(links)}</ul>']
    return Section("Contents", tuple(parts))


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
    """Return a figure, embedded without loss, with a caption below it."""
    kind = ' class="column"' if figure.get_figwidth() <= WIDEST_COLUMN else ""
    # what is to be known of a picture stands beside it
    below = " ".join([caption, *(f"Note: {text}." for text in getattr(figure, "notices", ()))])
    return f"<figure{kind}>{image(figure, caption)}<figcaption>{escape(below)}</figcaption></figure>"


def numbered(caption: str, lines: Iterable[tuple[str, str]], labels: Sequence[str]) -> str:
    """Return a caption with some lines (label, value) of a summary, the numbers that were found."""
    found = [f"{label.strip()} {text}" for label, text in lines if label.strip() in labels]
    return f"{caption.removesuffix('.')}: {'; '.join(found)}." if found else caption


def image(figure: "Figure", text: str) -> str:
    """Return a figure as an image with an alternative text: WebP without loss, about half the size of PNG."""
    from PIL import Image

    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS_PER_INCH)
    with Image.open(stream) as opened:
        return _embedded(opened.convert("RGB"), text, lossless=True)


def thumbnail(parts: Iterable[str], text: str) -> str:
    """Return the first picture in parts of a page, small; nothing where there is none."""
    from PIL import Image

    for part in parts:
        if found := re.search(r'src="data:image/webp;base64,([^"]+)"', part):
            with Image.open(io.BytesIO(base64.b64decode(found[1]))) as opened:
                small = opened.convert("RGB")
            small.thumbnail((10 * THUMBNAIL, THUMBNAIL), Image.Resampling.LANCZOS)
            return _embedded(small, text, lossless=False, quality=60)
    return ""


def _embedded(image: "PILImage", text: str, **options: Any) -> str:
    stream = io.BytesIO()
    image.save(stream, "WEBP", **options)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    size = f'width="{image.width}" height="{image.height}"'
    return f'<img alt="{escape(text)}" {size} src="data:image/webp;base64,{data}">'
