"""Contents of the pictures of a swept quantity; their looks are covered by the reference pictures."""

import numpy as np
import xarray as xr
from golden import refused
from pytest import approx, mark

import historysim as hs
from historysim.results.plots.chart import MOVED

VALUES = np.random.default_rng(1).normal(10e-9, 2e-9, (3, 2, 5))
VALUES[1, 0, 2] = np.nan
SWEEP = xr.Dataset(
    {
        "drift": (("rms_height", "friction", "seed"), VALUES, {"units": "m"}),
        "count": (("rms_height",), [1, 2, 3]),
        "name": (("rms_height",), ["a", "b", "c"]),
    },
    {
        "rms_height": ("rms_height", [1e-7, 2e-7, 4e-7], {"units": "m"}),
        "friction": ("friction", [0.1, 0.2], {"units": "1"}),
        "seed": ("seed", range(5)),
    },
    {"content": "sweep"},
)


def test_means_and_deviations_over_seeds():
    figure = hs.plots.curve(SWEEP, quantity="drift")
    (axes,) = figure.axes
    assert axes.get_xlabel() == "rms roughness $R_q$ (nm)"
    assert axes.get_ylabel() == "drift (nm)"
    (other,) = hs.plots.curve(SWEEP, quantity="drift", unit="µm", from_zero=True).axes
    assert other.get_ylabel() == "drift (µm)"
    assert other.get_ylim()[0] == 0
    for options in ({"unit": "MPa"}, {"from_zero": True, "logarithmic": True}):
        with refused(rf"^{next(iter(options))}: "):
            hs.plots.curve(SWEEP, quantity="drift", **options)
    assert figure.legends[0].get_title().get_text() == r"friction coefficient $\mu$"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["0.1", "0.2", MOVED]
    for number, bars in enumerate(axes.containers):
        line, _, (stems,) = bars.lines
        assert line.get_xdata() == approx([1e-7, 2e-7, 4e-7])
        own = [row[np.isfinite(row)] for row in VALUES[:, number]]
        assert line.get_ydata() == approx([row.mean() for row in own])
        halves = [np.ptp(segment[:, 1]) / 2 for segment in stems.get_segments()]
        assert halves == approx([row.std(ddof=1) for row in own])
    assert "of 5 surfaces" in figure.get_suptitle()


def test_a_band_of_quantiles():
    (axes,) = hs.plots.curve(
        SWEEP, quantity="drift", over="friction", each="rms_height", spread="quantiles"
    ).axes
    line, band = axes.get_lines()[0], axes.collections[0]
    assert line.get_ydata() == approx(np.median(VALUES[0], axis=1))
    low, high = np.quantile(VALUES[0, 0], [0.1, 0.9])
    heights = band.get_paths()[0].vertices[:, 1]
    assert (heights.min() <= low) & (heights.max() >= high)
    assert any(np.isclose(heights, low)) & any(np.isclose(heights, high))


@mark.parametrize(
    "over, along, drawn, line",
    [
        ("radius", [3.0, 1.0, 2.0], [5.0, 6.0, 4.0], "-"),
        ("radius", [3.0, 1.0, 3.0], [5.0, 4.0, 6.0], "None"),
        ("surface_seed", [1, 2, 3], [4.0, 5.0, 6.0], "None"),
    ],
)
def test_points_are_joined_in_their_order_or_not_at_all(over, along, drawn, line):
    values = xr.Dataset({"drift": (over, [4.0, 5.0, 6.0])}, {over: (over, along)})
    (found, *_) = hs.plots.curve(values, quantity="drift", over=over).axes[0].get_lines()
    assert found.get_xdata().tolist() == sorted(along)
    assert found.get_ydata().tolist() == drawn
    assert found.get_linestyle() == line


def test_a_sweep_is_drawn_by_the_name_of_its_number():
    assert hs.plot(SWEEP, picture="drift").axes[0].get_ylabel() == "drift (nm)"
    assert hs.plot(SWEEP, picture="count").axes[0].get_lines()[0].get_ydata().tolist() == [1, 2, 3]
    with refused("quantity is 'height'"):
        hs.plot(SWEEP, picture="height")
    # without a name, the first one
    assert hs.plot(SWEEP).axes[0].get_ylabel() == "drift (nm)"


POWER = xr.Dataset(
    {
        "drift": (
            ("load", "seed"),
            np.outer(np.array([1.0, 2.0, 4.0, 8.0]) ** 0.5, [0.9, 1.1]) * 1e-9,
            {"units": "m"},
        ),
        "pressure": (
            ("load", "seed"),
            np.outer([1.0, 2.0, 4.0, 8.0], [1.0, 1.0]) * 1e6,
            {"units": "Pa"},
        ),
        "low": (("load", "seed"), np.full((4, 2), 0.5e-9), {"units": "m"}),
        "high": (("load", "seed"), np.full((4, 2), 4e-9), {"units": "m"}),
    },
    {
        "load": (
            "load",
            [1e-3, 2e-3, 4e-3, 8e-3],
            {"units": "N", "long_name": "load of the piece"},
        ),
        "seed": [1, 2],
    },
)


def test_one_number_over_another_with_a_fit():
    (axes,) = hs.plots.curve(
        POWER, quantity="drift", over="pressure", fit="power", logarithmic=True
    ).axes
    assert axes.get_xlabel() == "pressure (MPa)"
    assert axes.containers[0].lines[0].get_xdata() == approx([1e6, 2e6, 4e6, 8e6])
    assert "exponent 0.50" in {line.get_label() for line in axes.get_lines()}
    assert axes.get_yscale() == "log"
    axes.figure.draw_without_rendering()
    assert {"1", "2"} <= {label.get_text() for label in axes.get_xticklabels()}
    (straight,) = hs.plots.curve(POWER, quantity="drift", fit="straight").axes
    share = np.corrcoef([1, 2, 4, 8], np.array([1.0, 2.0, 4.0, 8.0]) ** 0.5)[0, 1] ** 2
    assert f"straight line, $R^2$ = {share:.3f}" in {
        line.get_label() for line in straight.get_lines()
    }
    assert straight.get_xlabel() == "load of the piece (mN)"
