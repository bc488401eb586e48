"""The fonts of an SVG, put into the file itself: its texts stay texts, and look the same where a font is not installed.

Of each font those letters are embedded that the picture has (TrueType, as ``@font-face`` of CSS).
"""

import base64
import io
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree import ElementTree as ET

Face = tuple[str, str, str]
"""Family, weight and style of a font, as CSS writes them."""

END_OF_STYLE = "</style>"


def with_fonts(svg: str) -> str:
    """Return an SVG, as matplotlib writes it with texts as texts, with the fonts of its texts.

    Parameters
    ----------
    svg : str

    Returns
    -------
    str
        The same with an ``@font-face`` for each font that it names.
    """
    letters: dict[Face, set[str]] = defaultdict(set)
    # what matplotlib has written itself is safe to parse
    for face, text in _texts(ET.fromstring(svg), {}):  # noqa: S314 - see above
        letters[face].update(text)
    faces = "".join(_font_face(face, used) for face, used in sorted(letters.items()))
    return svg.replace(END_OF_STYLE, f"{faces}{END_OF_STYLE}", 1)


def _texts(element: ET.Element, inherited: Mapping[str, str]) -> Iterator[tuple[Face, str]]:
    """Yield each text with its font; what an element does not say, it has from the one around it."""
    own = dict(part.strip().split(": ", 1) for part in element.get("style", "").split(";") if ": " in part)
    style = {**inherited, **{name: value for name, value in own.items() if name.startswith("font-")}}
    if element.text and element.text.strip() and "font-family" in style:
        family = style["font-family"].split(",")[0].strip("'\" ")
        yield (family, style.get("font-weight", "400"), style.get("font-style", "normal")), element.text
    for child in element:
        yield from _texts(child, style)


def _font_face(face: Face, letters: set[str]) -> str:
    """Return the rule of CSS that brings a font with so many of its letters."""
    from fontTools.subset import Options, Subsetter
    from fontTools.ttLib import TTFont
    from matplotlib.font_manager import FontProperties, findfont

    family, weight, style = face
    said: dict[str, Any] = {"weight": int(weight) if weight.isdecimal() else weight, "style": style}
    # the time of writing would make each file another one
    font = TTFont(findfont(FontProperties(family=family, **said)), fontNumber=0, recalcTimestamp=False)
    options = Options(notdef_outline=True)
    # a table of the editor that the font was made with
    options.drop_tables += ["FFTM"]
    subsetter = Subsetter(options)
    subsetter.populate(text="".join({" ", *letters}))
    subsetter.subset(font)
    stream = io.BytesIO()
    font.save(stream)
    content = base64.b64encode(stream.getvalue()).decode("ascii")
    return (
        f"\n@font-face{{font-family:'{family}';font-weight:{weight};font-style:{style};"
        f"src:url(data:font/ttf;base64,{content}) format('truetype')}}"
    )
