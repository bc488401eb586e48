"""One self-contained HTML page: sections of text, tables and pictures, and embedded scripts."""

import base64
import functools
import io
import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from historysim._version import __version__
from historysim.basics.wording import escape_html, html_table
from historysim.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image as PILImage

DOTS_PER_INCH = 160
THUMBNAIL = 150  # height of a thumbnail [pixels]
WIDEST_COLUMN = 4.0  # width of a figure up to which two fit side by side [inch]

STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")


@attrs.frozen
class Section:
    """A part of a page."""

    title: str
    parts: tuple[str, ...]  #: HTML, in sequence
    anchor: str = ""  #: the target of links in the page


def page(title: str, sections: Iterable[Section], *, head: str = "") -> str:
    """Return a whole page; ``head`` is HTML that its scripts need."""
    body = "\n".join(
        f"<section{_anchor_attribute(section)}><h2>{escape_html(section.title)}</h2>\n{chr(10).join(section.parts)}</section>"
        for section in sections
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="generator" content="historysim {__version__}">\n<title>{escape_html(title)}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # without this link browsers request an icon
        f'<link rel="icon" href="data:,">\n<style>\n{STYLE}</style>\n{head}\n</head>\n'
        f"<body>\n<h1>{escape_html(title)}</h1>\n{body}\n</body>\n</html>\n"
    )


EXPECTED = (
    "expected a result of historysim run, a sweep, friction loops, friction over time or distance, a fit, a reduced "
    "model (JSON), or a scenario with a measured loading"
)


@functools.singledispatch
def render_page(subject: Any) -> str:
    """Render the report of an object as HTML; a type registers a function with `render_page.register`."""
    raise InputError(f"this {type(subject).__name__} has no report; {EXPECTED}")


def _anchor_attribute(section: Section) -> str:
    return f' id="{escape_html(section.anchor)}"' if section.anchor else ""


def contents(groups: Mapping[str, Sequence[Section]]) -> Section:
    """Return a section of links to other sections in groups, each with a thumbnail of its first picture."""
    blocks = []
    for name, sections in groups.items():
        links = (
            f'<li><a href="#{escape_html(section.anchor)}">{thumbnail(section.parts, "")}<br>'
            f"{escape_html(section.title)}</a></li>"
            for section in sections
        )
        blocks += [f"<h3>{escape_html(name)}</h3>", f'<ul class="thumbnails">{"".join(links)}</ul>']
    return Section("Contents", tuple(blocks))


def table(rows: Iterable[Sequence[str]], heading: Sequence[str] = ()) -> str:
    """Return a table of strings; the first of each row is its label."""
    return f'<div class="wide">{html_table(rows, heading)}</div>'


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph; of the kind "warning" or "note" it looks like one."""
    return f'<p class="{kind}">{escape_html(text)}</p>' if kind else f"<p>{escape_html(text)}</p>"


def code(text: str) -> str:
    """Return lines of commands or of a file."""
    return f"<pre>{escape_html(textwrap.dedent(text).strip())}</pre>"


def collapsible(label: str, text: str) -> str:
    """Return lines of a file that appear when their label is clicked."""
    return f"<details><summary>{escape_html(label)}</summary>{code(text)}</details>"


def picture(figure: "Figure", caption: str) -> str:
    """Return a figure, embedded without loss, with a caption below it."""
    kind = ' class="column"' if figure.get_figwidth() <= WIDEST_COLUMN else ""
    # remarks on a picture are part of its caption
    below = " ".join([caption, *(f"Note: {text}." for text in getattr(figure, "notices", ()))])
    return f"<figure{kind}>{image(figure, caption)}<figcaption>{escape_html(below)}</figcaption></figure>"


def add_values(caption: str, lines: Iterable[tuple[str, str]], labels: Sequence[str]) -> str:
    """Return a caption with selected lines (label, value) of a summary."""
    values = [f"{label.strip()} {text}" for label, text in lines if label.strip() in labels]
    return f"{caption.removesuffix('.')}: {'; '.join(values)}." if values else caption


def image(figure: "Figure", text: str) -> str:
    """Return a figure as an image with an alternative text: WebP without loss, about half the size of PNG."""
    from PIL import Image

    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS_PER_INCH)
    with Image.open(stream) as opened:
        # without loss quality is effort: more of it makes no smaller file
        return _embed_image(opened.convert("RGB"), text, lossless=True, quality=50)


def thumbnail(blocks: Iterable[str], text: str) -> str:
    """Return the first picture in blocks of a page as a thumbnail; empty if there is none."""
    from PIL import Image

    for block in blocks:
        if match := re.search(r'src="data:image/webp;base64,([^"]+)"', block):
            with Image.open(io.BytesIO(base64.b64decode(match[1]))) as opened:
                small = opened.convert("RGB")
            small.thumbnail((10 * THUMBNAIL, THUMBNAIL), Image.Resampling.LANCZOS)
            return _embed_image(small, text, lossless=False, quality=60)
    return ""


def _embed_image(image: "PILImage", text: str, **options: Any) -> str:
    stream = io.BytesIO()
    image.save(stream, "WEBP", **options)
    data = base64.b64encode(stream.getvalue()).decode("ascii")
    size = f'width="{image.width}" height="{image.height}"'
    return f'<img alt="{escape_html(text)}" {size} src="data:image/webp;base64,{data}">'
