"""One self-contained HTML page: sections of text, tables and pictures, and scripts that stand in the page itself."""

import base64
import functools
import io
import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from html import escape
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

STYLE = """
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --faint: #555; --line: #ccc; --code: #f5f5f2;
  --link: #1b5fa8; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e4e0; --paper: #191b1e; --faint: #a9a9a4; --line: #4a4d52; --code: #26292d; --link: #8fc1f5; }
}
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 1080px;
  margin: 2rem auto; padding: 0 1rem; overflow-wrap: break-word; }
a { color: var(--link); }
h1 { font-size: 1.5rem; line-height: 1.25; }
h2 { font-size: 1.15rem; margin-top: 2.2rem; border-bottom: 1px solid var(--line); break-after: avoid; }
h3 { font-size: 1rem; margin: 1.2rem 0 .4rem; break-after: avoid; }
table { border-collapse: collapse; font-size: 14px; }
th, td { padding: .15rem 1.2rem .15rem 0; vertical-align: top; }
th { font-weight: 600; text-align: left; } td { min-width: 4rem; overflow-wrap: anywhere; }
img { max-width: 100%; height: auto; background: #fff; border-radius: 3px; }
figure { margin: 1rem 0; break-inside: avoid; } figcaption { color: var(--faint); font-size: 13px; }
pre { background: var(--code); padding: .8rem; overflow-x: auto; font-size: 13px; }
summary { cursor: pointer; }
:focus-visible { outline: 2px solid var(--link); outline-offset: 2px; }
figure.column { display: inline-block; width: 48%; margin: 1rem 1% 1rem 0; vertical-align: top; }
@media screen and (max-width: 46rem) {
  figure.column { width: 100%; margin-right: 0; }
}
.thumbnails { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(46%, 11rem), 1fr)); gap: .8rem;
  padding: 0; list-style: none; font-size: 13px; }
.thumbnails img { width: 100%; height: 7rem; object-fit: contain; border: 1px solid var(--line); }
.wide { overflow-x: auto; }
.warning { border-left: 4px solid #d1603d; padding-left: .8rem; } .note { color: var(--faint); }
.explorer { background: #fff; color: #222; border-radius: 3px; padding: .1rem .6rem; color-scheme: light; }
.explorer p { margin: .4rem 0; min-height: 1.4em; }
.controls { display: flex; flex-wrap: wrap; align-items: center; gap: .4rem .8rem; }
.control { display: flex; align-items: center; gap: .6rem; } .control:first-child { flex: 1 1 16rem; }
.controls input { flex: 1; min-width: 8rem; min-height: 1.8rem; } .controls select { min-height: 1.8rem; }
.key { display: flex; flex-wrap: wrap; gap: 0 1rem; list-style: none; padding: 0; margin: .4rem 0; font-size: 14px; }
.dot { display: inline-block; width: 10px; height: 10px; border: 1px solid #222; border-radius: 50%;
  margin-right: 5px; }
@media print {
  :root { --ink: #000; --paper: #fff; --faint: #444; --line: #999; --code: #f5f5f2; --link: #000;
    color-scheme: light; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  body { margin: 0; max-width: none; font-size: 10.5pt; }
  .controls { display: none; } .explorer > div { zoom: .65; } pre { white-space: pre-wrap; }
  figure:not(.column) img { max-width: 88%; }
  p { orphans: 3; widows: 3; } .note { break-after: avoid; }
  tr, .warning, .explorer { break-inside: avoid; }
}
"""


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
        f'<link rel="icon" href="data:,">\n<style>{STYLE}</style>\n{head}\n</head>\n'
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
