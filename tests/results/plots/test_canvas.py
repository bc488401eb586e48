"""Figures of a size on paper, with files that have fonts that a journal takes."""

import io
import re
import zlib
from xml.etree import ElementTree as ET

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from click.testing import CliRunner
from drawn_data import hidden_data
from pairs import GLASS as PAIR
from pairs import STIFF
from pytest import approx, fixture, mark
from swept import BALL

import historysim as hs
from historysim.cli import main
from historysim.results.plots import ticks
from historysim.results.plots.canvas import draw_on_target, new_figure


def test_files_have_truetype_fonts_whoever_saves_them(tmp_path):
    history = hs.replay(
        hs.Ensemble(STIFF, 0.0, 1e-3, 0.2), [hs.NormalLoad(0.0, 0.1), hs.TangentialLoad(1.0, 0.01)]
    )
    settings, figure = dict(mpl.rcParams), hs.plot(history, picture="loop")
    figure.savefig(tmp_path / "h.pdf")
    figure.savefig(tmp_path / "h.png")
    assert dict(mpl.rcParams) == settings
    content = (tmp_path / "h.pdf").read_bytes()
    parts = [
        content,
        *(
            zlib.decompress(part)
            for part in re.findall(rb"stream\r?\n(x.*?)\r?\nendstream", content, re.DOTALL)
        ),
    ]
    kinds = set(
        re.findall(rb"/Subtype\s*/(Type3|TrueType|Type1|CIDFontType2|Type0)", b"\n".join(parts))
    )
    assert kinds
    assert b"Type3" not in kinds
    width = int.from_bytes((tmp_path / "h.png").read_bytes()[16:20], "big")
    assert width == approx(figure.get_size_inches()[0] * 200, abs=1)


def test_an_svg_needs_no_font_and_is_valid_xml(tmp_path):
    with new_figure(None, (90.0, 60.0)) as figure:
        figure.add_subplot(title="Überlast µ \x0b", xlabel=r"traction $\tau$ & load")
    figure.savefig(tmp_path / "f.svg")
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    for written in ((tmp_path / "f.svg").read_bytes(), stream.getvalue()):
        assert not [each for each in ET.fromstring(written).iter() if each.tag.endswith("}text")]  # noqa: S314 - ours
    assert len(stream.getvalue()) < 100_000


def test_panels_without_room_are_listed_in_the_notices(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(BALL, encoding="utf-8")
    history = hs.run("s.toml")
    shown, whole = (hs.plots.history(history, size=size) for size in ((90, 70), None))
    assert "no room" not in "".join(text.get_text() for text in shown.findobj(mpl.text.Text))
    assert len(shown.axes) < len(whole.axes)
    assert "at 90 × 70 mm there is no room for loads, slip states" in shown.notices
    assert not any("no room" in text for text in whole.notices)
    for wrong, message in (
        (["--size", "90"], "expected width and height in millimetres"),
        ([], "no picture is written"),
    ):
        ran = CliRunner().invoke(main, ["loops", "s.toml", *(wrong or ["--size", "90x70"])])
        assert ran.exit_code == 2
        assert message in ran.stderr


def test_labels_have_prefixes_and_the_common_part_of_the_ticks():
    near, far = np.linspace(0.0, 40e-9, 9), np.linspace(0.0, 40e-9, 9) + 0.0123

    def draw(canvas):
        power = canvas.figure.subplots(1, 2)
        for axes, values in zip(power, (near, far), strict=True):
            axes.plot(values, 1e-12 * np.arange(9))
            axes.set(xlabel="U (m)", ylabel="area (m²)")

    figure = draw_on_target({}, (120.0, 60.0), draw)
    figure.draw_without_rendering()
    labels = "U (nm)", "U (nm), from 12.3 mm"
    for axes, label in zip(figure.axes, labels, strict=False):
        assert axes.get_xlabel().startswith(label)
        assert axes.get_ylabel() == "area (µm²)"
        numbers = [float(text.get_text().replace("−", "-")) for text in axes.get_xticklabels()]
        offset = (
            float(found[1]) if (found := re.search(r"from ([\d.]+)", axes.get_xlabel())) else 0.0
        )
        offset *= 1e-3 if "mm" in axes.get_xlabel() else 1.0
        # the tick and what the label says are the place
        assert [offset + 1e-9 * number for number in numbers] == approx(
            axes.get_xticks(), rel=1e-12, abs=1e-24
        )
        assert not axes.xaxis.offsetText.get_text()


@fixture
def ball_loops():
    """Loops of one ball under 50 mN and under 5 N: mN and nm by themselves, N and µm next to the larger."""

    def loop(load, amplitude):
        moves = [hs.TangentialDisplacement(1.0 + i, amplitude * (-1) ** i) for i in range(3)]
        return hs.replay(
            hs.Ensemble(PAIR, 0.0, 2.5e-3, 0.2), [hs.NormalLoad(0.0, load), *moves], substeps=20
        )

    return loop(50e-3, 20e-9), loop(5.0, 3e-6)


def labels_of(axes):
    """The units in the labels of axes, and the largest tick of each in SI units."""
    axes[0].figure.canvas.draw()
    units = [
        [re.search(r"\((.*)\)", label)[1] for label in (one.get_xlabel(), one.get_ylabel())]
        for one in axes
    ]
    factors = {"m": 1.0, "µm": 1e-6, "nm": 1e-9, "N": 1.0, "mN": 1e-3}
    for one, pair in zip(axes, units, strict=True):
        for axis, unit in zip((one.xaxis, one.yaxis), pair, strict=True):
            place = axis.get_majorticklocs()[-1]
            text = axis.get_major_formatter().format_ticks(axis.get_majorticklocs())[-1]
            assert float(text.replace("−", "-")) * factors[unit] == approx(place, rel=1e-6)
    return units


@mark.parametrize("shared", ["x", "xy", "afterwards", "neither"])
def test_axes_that_share_limits_share_a_prefix(ball_loops, shared):
    if shared == "afterwards":
        axes = plt.figure().subplots(1, 2)
        axes[1].sharex(axes[0])
        axes[1].sharey(axes[0])
    else:
        axes = plt.figure().subplots(1, 2, sharex="x" in shared, sharey="y" in shared)
    for one, loops in zip(axes, ball_loops, strict=True):
        hs.plot(loops, picture="loop", ax=one)
    x, y = ("nm" if shared == "neither" else "µm", "mN" if shared in {"neither", "x"} else "N")
    assert labels_of(axes) == [[x, y], ["µm", "N"]]
    plt.close("all")


def test_logarithmic_axes_and_common_parts_of_ticks_are_shared():
    low, high = plt.figure().subplots(1, 2, sharey=True)
    for axes, top in ((low, 5e-3), (high, 5.0)):
        axes.plot([1, 2], [1e-3, top])
        axes.set_ylabel("load (N)")
        ticks.set_log_scale(axes.yaxis)
        ticks.set_prefix(axes.yaxis)
    assert [axes.get_ylabel() for axes in (low, high)] == ["load (N)"] * 2
    above, below = plt.figure().subplots(2, 1, sharex=True)
    for axes, top in ((above, 5e-9), (below, 5e-6)):
        axes.plot([1 + 1e-9, 1 + top], [1, 2])
        axes.set_xlabel("stage (m)")
        ticks.set_prefix(axes.xaxis)
    assert [axes.get_xlabel() for axes in (above, below)] == ["stage (µm), from 1 m"] * 2
    plt.close("all")


@mark.hides_data
@mark.parametrize(
    "limits, fault",
    [
        ((0, 1e-6), "leaves the axes"),
        ((0, 1e6), "cover"),
        ((2, 3), "leaves the axes"),
        ((0, 1), None),
    ],
)
def test_data_that_a_figure_does_not_show_are_found(limits, fault):
    """A scale that is wrong by six orders of magnitude leaves a panel blank."""
    axes = plt.figure().subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0])
    axes.set_ylim(*limits)
    found = hidden_data(axes.figure)
    assert found == [] if fault is None else all(fault in each for each in found[:1]) and found
    plt.close("all")
