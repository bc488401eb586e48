"""Figures with the output format of this program."""

import io
import re
import warnings
from os import PathLike
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from historysim._version import __version__

# journals reject Type 3 fonts; 42 embeds TrueType
PRINT: dict[Any, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "path"}
# Agg rejects long noisy lines in one piece
PRINT |= {"agg.path.chunksize": 20_000}
# a figure that is laid out already is drawn once
PRINT |= {"figure.autolayout": False, "figure.constrained_layout.use": False}
NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
DOTS_PER_INCH, NOTEBOOK = 200, 110
# Metadata key of the program that made a picture.
MAKER = {"png": "Software", "pdf": "Creator", "svg": "Creator"}
MADE_BY = f"historysim {__version__}, matplotlib {mpl.__version__}"


class PrintedFigure(Figure):
    """A figure whose files contain their fonts, with 200 dots per inch by default."""

    #: remarks on the picture, such as panels that do not fit its size
    notices: tuple[str, ...] = ()

    def _repr_png_(self) -> bytes:
        """Return the picture as a notebook shows it, with or without IPython's support of matplotlib."""
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=NOTEBOOK)
        return stream.getvalue()

    def savefig(self, fname: Any, **options: Any) -> None:
        """Save the figure; parameters as for matplotlib's figures."""
        named = isinstance(fname, str | PathLike)
        kind = (
            options.get("format") or (Path(fname).suffix.removeprefix(".") if named else "")
        ).lower()
        arguments = {"dpi": DOTS_PER_INCH, **options}
        if kind in MAKER:
            # the program replaces its own pictures only
            arguments["metadata"] = {MAKER[kind]: MADE_BY} | (options.get("metadata") or {})
        with mpl.rc_context(PRINT), warnings.catch_warnings():
            # a missing glyph is drawn as a box
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            layout = self.get_layout_engine()
            if not self.stale:
                # laid out already, and not changed since
                self.set_layout_engine(None)
            stream = io.StringIO() if kind == "svg" else fname
            try:
                super().savefig(stream, **arguments | ({"format": "svg"} if kind == "svg" else {}))
            finally:
                self.set_layout_engine(layout)
        if kind != "svg":
            return
        # comments hold the raw strings, with characters that XML forbids
        text = NO_XML.sub("\ufffd", stream.getvalue())
        if named:
            Path(fname).write_text(text, encoding="utf-8")
        else:
            fname.write(text if isinstance(fname, io.TextIOBase) else text.encode())
