"""Figures of a size on paper, with files that have fonts that a journal takes."""

import io
import re
import zlib
from xml.etree import ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError
from historysim.results.plots.canvas import new_figure


def test_a_figure_has_its_size_in_millimetres():
    with new_figure((90, 60), (180.0, 100.0)) as figure:
        assert figure.get_size_inches() * 25.4 == pytest.approx([90, 60])
    with new_figure(None, (180.0, 100.0)) as figure:
        assert figure.get_size_inches() * 25.4 == pytest.approx([180, 100])


@pytest.mark.parametrize("size", [(90, 5), (90,), (90, -1), (np.nan, 60), (3000, 60)])
def test_what_is_no_size_is_refused(size):
    with pytest.raises(InputError, match="size"), new_figure(size, (180.0, 100.0)):
        pass


def test_files_have_truetype_fonts_whoever_saves_them(tmp_path):
    pair = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
    history = hs.replay(hs.Ensemble(pair, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), hs.TangentialLoad(1.0, 0.01)])
    settings, figure = dict(mpl.rcParams), hs.plot(history)
    figure.savefig(tmp_path / "h.pdf")
    figure.savefig(tmp_path / "h.png")
    assert dict(mpl.rcParams) == settings
    content = (tmp_path / "h.pdf").read_bytes()
    parts = [
        content,
        *(zlib.decompress(part) for part in re.findall(rb"stream\r?\n(x.*?)\r?\nendstream", content, re.DOTALL)),
    ]
    kinds = set(re.findall(rb"/Subtype\s*/(Type3|TrueType|Type1|CIDFontType2|Type0)", b"\n".join(parts)))
    assert kinds
    assert b"Type3" not in kinds
    width = int.from_bytes((tmp_path / "h.png").read_bytes()[16:20], "big")
    assert width == pytest.approx(180 / 25.4 * 200, abs=1)


def test_an_svg_needs_no_font_and_is_xml_whatever_is_drawn(tmp_path):
    with new_figure(None, (90.0, 60.0)) as figure:
        figure.add_subplot(title="Überlast µ \x0b", xlabel=r"traction $\tau$ & load")
    figure.savefig(tmp_path / "f.svg")
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    for written in ((tmp_path / "f.svg").read_bytes(), stream.getvalue()):
        assert not [each for each in ET.fromstring(written).iter() if each.tag.endswith("}text")]  # noqa: S314 - ours
    assert len(stream.getvalue()) < 100_000
