"""Contents of the adhesion map; its looks are covered by the reference pictures."""

import itertools

import numpy as np
import pytest

import historysim as hs
from historysim.contact.adhesion import Regime, regime


def drawn(figure):
    (axes,) = figure.axes
    return axes


def zones(axes):
    return {Regime(fill.get_label()[1:]): fill for fill in axes.collections}


def marks(axes, markers="osv"):
    return [line for line in axes.get_lines() if line.get_marker() in tuple(markers)]


@pytest.mark.parametrize("contacts", [{"far": (1e-5, 1e7)}])
def test_zones_agree_with_regime(contacts):
    axes = drawn(hs.plots.adhesion_map(contacts))
    fills = zones(axes)
    assert set(fills) == set(Regime)
    rng = np.random.default_rng(3)
    x, y = (
        np.exp(rng.uniform(*np.log(limits), 1000)) for limits in (axes.get_xlim(), axes.get_ylim())
    )
    # the zones are polygons of fine steps: points within 1 % of a border are left out
    near = [regime(x * dx, y * dy) for dx, dy in itertools.product((0.99, 1.01), repeat=2)]
    clear = np.all([zone == near[0] for zone in near], axis=0)
    assert clear.mean() > 0.95
    found = {
        zone: np.any(
            [path.contains_points(np.column_stack([x, y])) for path in fill.get_paths()], axis=0
        )
        for zone, fill in fills.items()
    }
    assert (np.sum(list(found.values()), axis=0) == 1)[clear].all()
    for zone, inside in found.items():
        assert (inside == (near[0] == zone))[clear].all()


def names(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_map_grows_to_hold_all_contacts():
    axes = drawn(
        hs.plots.adhesion_map({"left": (1e-5, 1.0), "top": (1.0, 1e6), "right": (1e4, 1e-4)})
    )
    assert axes.get_xlim()[0] < 1e-5
    assert axes.get_xlim()[1] > 1e4
    assert axes.get_ylim()[0] < 1e-4
    assert axes.get_ylim()[1] > 1e6
    axes = drawn(hs.plots.adhesion_map({}))
    assert axes.get_xlim() == (1e-3, 1e2)
    assert axes.get_ylim() == (1e-2, 1e4)


def test_unloaded_and_pulled_contacts_are_marked_at_the_lower_edge():
    figure = hs.plots.adhesion_map(
        {"unloaded": (0.5, 0.0), "pulled": (10.0, -1.2), "pressed": (1.0, 1.0)}
    )
    axes = drawn(figure)
    arrows = {float(mark.get_xdata()[0]): float(mark.get_ydata()[0]) for mark in marks(axes, "v")}
    assert set(arrows) == {0.5, 10.0}
    assert all(axes.get_ylim()[0] < y < 1.5 * axes.get_ylim()[0] for y in arrows.values())
    assert names(figure) == ["unloaded ($N$ ≤ 0)", "pulled ($N$ ≤ 0)", "pressed"]
