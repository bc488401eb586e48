"""Radius over height of the summits of several surfaces, and a map in colours."""

import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError

SUMMITS = [hs.Summits([0.0, 2e-6, 4e-6], [1e-6, 2e-6, 3e-6]), hs.Summits([1e-6, 3e-6], [2e-6, 2e-6])]


def test_clouds_with_mean_and_deviation():
    figure = hs.plots.summits(SUMMITS, labels=["fine", "rough"], title="Two")
    (axes,) = figure.axes
    cloud = axes.get_lines()[0]
    assert cloud.get_xdata() == pytest.approx([0, 2, 4])
    assert cloud.get_ydata() == pytest.approx([1, 2, 3])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[0] == "fine: $R$ 2.00 ± 1.00 µm, $z$ 2.00 ± 2.00 µm (3)"
    assert texts[1] == "rough: $R$ 2.00 ± 0.00 µm, $z$ 2.00 ± 1.41 µm (2)"
    assert axes.get_xlabel() == "summit height $z$ (µm)"
    apart = hs.plots.summits(SUMMITS, labels=["fine", "rough"], apart=True)
    assert [each.get_title(loc="left") for each in apart.axes] == ["fine", "rough"]
    assert apart.axes[0].get_ylim() == apart.axes[1].get_ylim()


def test_one_summit_has_no_deviation():
    figure = hs.plots.summits({"ball": hs.Summits(0.0, 1e-3)})
    figure.draw_without_rendering()
    assert "R$ 1.00 mm" in figure.legends[0].get_texts()[0].get_text()


def test_what_cannot_be_told_apart_is_refused():
    with pytest.raises(InputError, match="2 surfaces and 1 label; expected 1 to 8 surfaces, with a label each"):
        hs.plots.summits(SUMMITS, labels=["one"])
    with pytest.raises(InputError, match="0 surfaces"):
        hs.plots.summits([])


def test_a_map_lies_as_it_is():
    heights = np.arange(12.0).reshape(4, 3) * 1e-9
    figure = hs.plots.map(hs.Surface(heights, 1e-6), title="Map")
    (image,) = figure.axes[0].images
    # x to the right, y upwards
    assert np.asarray(image.get_array()) == pytest.approx(heights.T * 1e9)
    assert image.get_extent() == pytest.approx([0, 4, 0, 3])
    assert figure.axes[0].get_ylabel() == "$y$ (µm)"
