"""Contents of the pictures of surfaces; their looks are covered by the reference pictures."""

import matplotlib as mpl
import numpy as np
import xarray as xr
from pairs import COMPLIANT as PAIR
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.errors import InputError
from historysim.recording import surface_group
from historysim.results.plots import style
from historysim.results.plots import surfaces as plots
from historysim.results.plots.canvas import draw_on_target as drawn_at
from historysim.results.plots.surfaces import load_surface, read_contact, step_number, surface_sheet
from historysim.surfaces.distribution import textured_summits
from historysim.surfaces.heights import Surface
from historysim.surfaces.random import random_surface
from historysim.surfaces.summits import Summits

pytestmark = mark.ci

MAP, DISTRIBUTION = "Surface and summits", "Asperity distribution"


def history_of(summits, loads=(3e-2, 6e-2, 2e-2), *, swing=10e-9, record="all", friction=0.2):
    events = []
    for time, load in enumerate(loads):
        events += [hs.NormalLoad(time, load), hs.TangentialDisplacement(time, swing * (-1) ** time)]
    return hs.replay(
        hs.Ensemble.from_summits(PAIR, summits, friction), events, substeps=3, record=record
    )


def plot_surface(surface, history=None, step="partial"):
    contact = read_contact(surface, history, 0 if history is None else step_number(step, history))
    title = str((surface if history is None else history).attrs.get("title", ""))

    def draw(canvas):
        canvas.draw(surface_sheet(surface, contact))
        canvas.heading(title, canvas.caption)

    return drawn_at({}, (180.0, 97.0), draw)


def drawn(surface, history=None, step=-1):
    figure = plot_surface(surface, history, step)
    return figure, {axes.get_title(loc="left"): axes for axes in figure.axes}


def rendered(surface, history=None, step=-1):
    figure, panels = drawn(surface, history, step)
    figure.draw_without_rendering()
    return figure, panels


def marks(axes):
    """Positions [m] of what is marked, by its state: 0 to 3, and -1 for what was not recorded."""
    colours = {
        mpl.colors.to_rgba(colour): state for state, colour in enumerate(style.STATE_COLOURS)
    }
    (dots,) = [line for line in axes.get_lines() if line.get_marker() == "."]
    found = {0: np.column_stack([dots.get_xdata(), dots.get_ydata()])}
    for collection in (each for each in axes.collections if each.get_label() != "missing height"):
        faces = collection.get_facecolors()
        state = colours[tuple(faces[0])] if len(faces) else -1
        found[state] = np.asarray(collection.get_offsets())
    return found


def check_marks(axes, x, y, state):
    found = marks(axes)
    for value in range(-1, 4):
        here = state == value
        expected = np.column_stack([x[here], y[here]])
        np.testing.assert_allclose(
            found.get(value, np.empty((0, 2))), expected, rtol=1e-12, atol=1e-30
        )


def flat(axes):
    """Position of the line of the rigid flat [m]: on the x axis of a distribution, on the y axis of a profile."""
    (line,) = [
        line
        for line in axes.get_lines()
        if line.get_marker() != "." and line.get_linestyle() == "--"
    ]
    upright = np.ptp(line.get_xdata()) == 0
    return line.get_xdata()[0] if upright else line.get_ydata()[0]


def legend(figure):
    return [text.get_text() for one in figure.legends for text in one.get_texts()]


@fixture(scope="module")
def rough():
    surface = random_surface((60, 40), (1e-6, 2e-6), 50e-9, 8e-6, seed=2)
    summits = surface.summits()
    return surface_group.dataset(summits, surface), summits, history_of(summits)


# -- what is drawn is what was asked
# ----------------------------------------------------------------


@mark.parametrize("step", [0, 3])
def test_summits_are_drawn_at_their_positions_in_the_colour_of_their_state(rough, step):
    surface, summits, history = rough
    _, panels = drawn(surface, history, step)
    state = history["slip_state"].values[step]
    check_marks(panels[MAP], summits.x, summits.y, state)
    check_marks(panels[DISTRIBUTION], summits.height, summits.radius, state)
    assert flat(panels[DISTRIBUTION]) == approx(
        float(history["separation"][step]), rel=1e-12, abs=1e-30
    )
    assert set(np.unique(history["slip_state"])) == {0, 1, 2, 3}


@mark.parametrize("record", ["totals", [0, 7, 30]])
def test_touching_summits_are_marked_for_any_selection_of_recorded_asperities(rough, record):
    surface, summits, whole = rough
    history = history_of(summits, record=record)
    for step in (0, 6):
        truth = whole["slip_state"].values[step]
        known = history["asperity"].values if "asperity" in history.coords else []
        expected = np.where((truth > 0) & ~np.isin(np.arange(truth.size), known), -1, truth)
        figure, panels = drawn(surface, history, step)
        check_marks(panels[MAP], summits.x, summits.y, expected)
        check_marks(panels[DISTRIBUTION], summits.height, summits.radius, expected)
        assert ("touching, not recorded" in legend(figure)) == bool((expected == -1).any())


def test_missing_heights_have_a_separate_colour():
    heights = np.random.default_rng(0).normal(size=(30, 20)) * 1e-9
    heights[np.random.default_rng(1).random(heights.shape) < 0.31] = np.nan
    surface = Surface(heights, 1e-6)
    figure, panels = rendered(surface_group.dataset(surface.summits(), surface))
    (image,) = panels[MAP].get_images()
    assert panels[MAP].child_axes[0].get_ylabel() == "height $z$ (nm)"
    assert np.nanmax(np.ma.filled(image.get_array(), np.nan)) == approx(np.nanmax(heights))
    shown = image.to_rgba(image.get_array())
    missing = np.isnan(heights.T)
    assert (shown[missing] == mpl.colors.to_rgba(plots.MISSING)).all()
    assert not (shown[~missing] == mpl.colors.to_rgba(plots.MISSING)).all(axis=-1).any()
    assert legend(figure) == ["missing height"]


# -- one, many and none
# ------------------------------------------------------------------------------


@mark.hides_data  # one summit is a point of its surroundings
@mark.parametrize("positions", [{}, {"x": 3e-6, "y": -1e-6}])
def test_a_single_summit_and_the_flat_below_it(positions):
    summits = Summits(0.0, 1e-5, **positions)
    history = history_of(summits)
    figure, panels = rendered(surface_group.dataset(summits), history)
    assert figure.get_suptitle().endswith(", 1 asperity in contact")
    if not positions:
        axes = panels[DISTRIBUTION]
        separation = float(history["separation"][-1])
        assert flat(axes) == approx(separation)
        assert axes.get_xlabel() == "summit height $z$ (nm)"
        left, right = axes.get_xlim()
        assert left < separation < 0 < right
        assert axes.get_ylim() == (0, 20e-6)
    else:
        # one point is no distribution
        assert DISTRIBUTION not in panels
        assert "no asperity distribution: 1 summit" in figure.notices
        x, y = positions["x"], positions["y"]
        assert panels[MAP].get_xlabel() == "$x$ (µm)"
        assert panels[MAP].get_xlim() == approx((x - 10e-6, x + 10e-6))
        assert panels[MAP].get_ylim() == approx((y - 10e-6, y + 10e-6))


def test_of_many_separated_summits_some_are_drawn_by_lot_and_all_that_touch(monkeypatch):
    monkeypatch.setattr(plots, "MOST_MARKS", 200)
    summits = textured_summits((40, 25), 1e-6, 1e-6, height_scatter=1e-8, seed=1)
    history = history_of(summits, (1e-3,), record="touching")
    figure, panels = drawn(surface_group.dataset(summits), history)
    count = int(history["contact_count"][-1])
    found = marks(panels[MAP])
    apart = found.pop(0)
    assert sum(map(len, found.values())) == count > 10
    assert legend(figure)[0] == f"separated (200 of {1000 - count:,} drawn)"
    assert len(np.unique(np.rint(apart * 1e6), axis=0)) == 200
    assert (marks(drawn(surface_group.dataset(summits), history)[1][MAP])[0] == apart).all()


def test_a_history_in_which_nothing_touches():
    summits = Summits([0.0, -1e-8], 1e-6, [0.0, 1e-5], [0.0, 1e-5])
    ensemble = hs.Ensemble.from_summits(PAIR, summits, 0.2)
    history = hs.replay(ensemble, [hs.NormalDisplacement(0.0, -5e-9)])
    figure, panels = rendered(surface_group.dataset(summits), history)
    check_marks(panels[MAP], summits.x, summits.y, np.zeros(2))
    assert flat(panels[DISTRIBUTION]) == approx(5e-9)
    assert figure.get_suptitle().endswith(", 0 asperities in contact")
    _, panels = drawn(load_surface(history), history)
    assert [text.get_text() for text in panels[DISTRIBUTION].texts] == ["no summits"]


def test_a_summit_at_the_height_of_the_flat_agrees_with_the_contact_count():
    # heights of which the difference to the approach rounds either way
    depths = np.arange(200) * 0.1e-9
    summits = Summits(3e-6 - depths, 1e-6, *np.zeros((2, 200)))
    ensemble = hs.Ensemble.from_summits(PAIR, summits, 0.2)
    events = [hs.NormalDisplacement(time, depth) for time, depth in enumerate(depths)]
    history = hs.replay(ensemble, events, record="totals")
    for step in range(0, 200, 97):
        found = marks(drawn(surface_group.dataset(summits), history, step)[1][DISTRIBUTION])
        assert len(found.get(-1, ())) == int(history["contact_count"][step])


# -- kinds, files and histories
# -----------------------------------------------------------------------


def test_a_history_without_its_surface_has_the_summits_that_it_holds(rough, tmp_path):
    _, summits, _ = rough
    history_of(summits, record=[4, 0, 30]).to_netcdf(tmp_path / "written.nc")
    with xr.open_dataset(tmp_path / "written.nc") as opened:
        _, panels = drawn(load_surface(opened), opened, 4)
        labels = opened["asperity"].values
        state = opened["slip_state"].values[4]
        check_marks(panels[MAP], summits.x[labels], summits.y[labels], state)
        check_marks(panels[DISTRIBUTION], summits.height[labels], summits.radius[labels], state)


def test_the_surface_of_another_history_is_refused(rough):
    other = Summits([0.0, -1e-9], 1e-6)
    with raises(InputError, match="other summits"):
        plot_surface(surface_group.dataset(other), rough[2])


def test_the_distribution_has_the_heights_and_radii_of_the_step():
    heights, radii = np.array([0.0, -4e-9, -9e-9, -30e-9]), 10e-6
    later = np.array([-2e-9, -4e-9, -1e-9, -30e-9])
    change = hs.GeometryChange(1.0, later, np.array([10e-6, 10e-6, 20e-6, 10e-6]))
    ensemble = hs.Ensemble(PAIR, heights, radii, 0.2)
    history = hs.replay(
        ensemble, [hs.NormalLoad(0.0, 5e-4), change, hs.NormalLoad(2.0, 5e-4)], record="all"
    )
    for step, height, radius in (
        (0, heights, np.full(4, radii)),
        (-1, later, [10e-6, 10e-6, 20e-6, 10e-6]),
    ):
        _, panels = drawn(load_surface(history), history, step)
        check_marks(
            panels[DISTRIBUTION], height, np.asarray(radius), history["slip_state"].values[step]
        )
        touching = height > history["separation"].values[step]
        assert touching.sum() == history["contact_count"].values[step]
        assert flat(panels[DISTRIBUTION]) == approx(float(history["separation"][step]))


# -- several surfaces, and a map in colours


def test_a_flat_map_is_grey_and_has_no_summits():
    surface = Surface(np.zeros((6, 5)), 1e-6)
    figure, panels = rendered(surface_group.dataset(surface.summits(), surface))
    (image,) = panels[MAP].get_images()
    assert image.norm(0.0) == 0.5
    assert panels[MAP].child_axes == []
    assert DISTRIBUTION not in panels
    assert figure.notices == ("no asperity distribution: 0 summits",)
