"""Figures that are saved in one way, whoever saves them."""

import warnings
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

# journals reject Type 3 fonts; 42 embeds TrueType. An SVG has its letters as outlines, which look the same anywhere
PRINT: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "path"}
DOTS_PER_INCH = 200


class PrintedFigure(Figure):
    """A figure whose files have TrueType fonts, and 200 dots per inch where nothing else is said."""

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure; parameters as for matplotlib's figures."""
        with mpl.rc_context(PRINT), warnings.catch_warnings():
            # a sign that the font does not have is drawn as a box
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            super().savefig(fname, **{"dpi": DOTS_PER_INCH, **options})
