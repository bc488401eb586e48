"""Figures that are saved in one way, whoever saves them."""

import io
import re
import warnings
from os import PathLike
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from historysim._version import __version__
from historysim.results.plots.embedded_fonts import with_fonts

# journals reject Type 3 fonts; 42 embeds TrueType
PRINT: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42}
SVG: dict[Any, Any] = {"svg.fonttype": "none"}
NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
DOTS_PER_INCH, NOTEBOOK = 200, 110
MAKER = {"png": "Software", "pdf": "Creator", "svg": "Creator"}
"""What the formats call the program that has made a picture."""
MADE_BY = f"historysim {__version__}, matplotlib {mpl.__version__}"


class PrintedFigure(Figure):
    """A figure whose files have TrueType fonts in them, and 200 dots per inch where nothing else is said."""

    def _repr_png_(self) -> bytes:
        """Return the picture as a notebook shows it, whether or not it knows of matplotlib."""
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=NOTEBOOK)
        return stream.getvalue()

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure; parameters as for matplotlib's figures."""
        with mpl.rc_context(PRINT), warnings.catch_warnings():
            # a sign that the font does not have is drawn as a box
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            named = isinstance(fname, str | PathLike)
            kind = options.get("format") or (Path(fname).suffix.removeprefix(".") if named else "")
            given = {"dpi": DOTS_PER_INCH, **options}
            if kind.lower() in MAKER:
                # by which the program knows its own pictures again, and replaces no others
                given["metadata"] = {MAKER[kind.lower()]: MADE_BY} | (options.get("metadata") or {})
            if kind.lower() != "svg":
                super().savefig(fname, **given)
                return
            stream = io.StringIO()
            with mpl.rc_context(SVG):
                super().savefig(stream, **given | {"format": "svg"})
            # what no XML may hold
            text = with_fonts(NO_XML.sub("\ufffd", stream.getvalue()))
        if named:
            Path(fname).write_text(text, encoding="utf-8")
        else:
            fname.write(text if isinstance(fname, io.TextIOBase) else text.encode())
