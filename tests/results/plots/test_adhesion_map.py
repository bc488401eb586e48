"""The adhesion map: what stands in it. That it looks well was seen by eye."""

import io
import itertools

import matplotlib as mpl
import numpy as np
import pytest

import historysim as hs
from historysim.contact.adhesion import Regime, regime
from historysim.errors import InputError, LoadError

CONTACTS = {
    "ball on glass, 10 mN": (20.0, 1e4),
    "AFM tip": (0.05, 3.0),
    "another AFM tip": (0.052, 3.3),
    "blunt AFM tip": (0.049, 3.6),
    "a nanoparticle of silica": (2e-3, 1.0),
    "rubber": (80.0, 20.0),
    "on the border": (0.1, 10.0),
}


def drawn(figure):
    picture = io.BytesIO()
    figure.savefig(picture, dpi=50)
    assert picture.getvalue().startswith(b"\x89PNG")
    (axes,) = figure.axes
    return axes


def zones(axes):
    return {Regime(fill.get_label()): fill for fill in axes.collections}


def marks(axes, markers="osv"):
    return [line for line in axes.get_lines() if line.get_marker() in tuple(markers)]


@pytest.mark.parametrize("contacts", [None, {"far": (1e-5, 1e7)}])
def test_zones_are_those_of_regime(contacts):
    axes = drawn(hs.plots.adhesion_map(contacts))
    fills = zones(axes)
    assert set(fills) == set(Regime)
    rng = np.random.default_rng(3)
    x, y = (np.exp(rng.uniform(*np.log(limits), 3000)) for limits in (axes.get_xlim(), axes.get_ylim()))
    # the zones are polygons of fine steps: points within 1 % of a border are left out
    near = [regime(x * dx, y * dy) for dx, dy in itertools.product((0.99, 1.01), repeat=2)]
    clear = np.all([zone == near[0] for zone in near], axis=0)
    assert clear.mean() > 0.95
    found = {
        zone: np.any([path.contains_points(np.column_stack([x, y])) for path in fill.get_paths()], axis=0)
        for zone, fill in fills.items()
    }
    assert (np.sum(list(found.values()), axis=0) == 1)[clear].all()
    for zone, inside in found.items():
        assert (inside == (near[0] == zone))[clear].all()


def test_contacts_are_marked_and_labelled():
    axes = drawn(hs.plots.adhesion_map(CONTACTS))
    places = {(float(mark.get_xdata()[0]), float(mark.get_ydata()[0])) for mark in marks(axes)}
    assert places == set(CONTACTS.values())
    texts = [text.get_text() for text in axes.texts if text.get_text()]
    assert sorted(texts) == sorted([*CONTACTS, "Hertz", "DMT", "Maugis", "JKR", "rigid\n(Bradley)"])
    assert axes.get_xlabel() == r"Maugis parameter $\lambda$"
    assert axes.get_ylabel() == r"load parameter $N/(\pi W R)$"
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_no_text_covers_another_or_a_mark():
    figure = hs.plots.adhesion_map(CONTACTS)
    axes = drawn(figure)
    figure.draw_without_rendering()
    frame = axes.get_window_extent()
    rooms = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_text()}
    for (first, room), (second, other) in itertools.combinations(rooms.items(), 2):
        assert not room.overlaps(other), f"{first} covers {second}"
    points = [axes.transData.transform(place) for place in CONTACTS.values()]
    for name, room in rooms.items():
        assert not any(room.contains(*point) for point in points), f"{name} covers a mark"
        assert all(frame.contains(*corner) for corner in room.corners()), f"{name} leaves the frame"


@pytest.mark.parametrize("contacts", [CONTACTS, {f"{load}": (0.033, load) for load in (0.3, 0.7, 1.5, 3.0, 7.0)}])
def test_zone_names_stand_in_their_zones(contacts):
    axes = drawn(hs.plots.adhesion_map(contacts))
    named = 0
    for text in axes.texts:
        name = text.get_text().split("\n")[0].lower()
        if name in set(Regime):
            corners = axes.transData.inverted().transform(text.get_window_extent().corners())
            assert (regime(*corners.T) == name).all()
            named += 1
    assert named == 5


def test_labels_keep_off_the_borders():
    contacts = {"left of it": (0.085, 1.0), "right of it": (0.12, 0.1), "below": (50.0, 2.2e3), "above": (10.0, 2.8e3)}
    axes = drawn(hs.plots.adhesion_map(contacts))
    for text in axes.texts:
        if text.get_text() in contacts:
            corners = axes.transData.inverted().transform(text.get_window_extent().corners())
            assert len(set(regime(*corners.T))) == 1


def test_the_map_grows_to_hold_all_contacts():
    axes = drawn(hs.plots.adhesion_map({"left": (1e-5, 1.0), "top": (1.0, 1e6), "right": (1e4, 1e-4)}))
    assert axes.get_xlim()[0] < 1e-5
    assert axes.get_xlim()[1] > 1e4
    assert axes.get_ylim()[0] < 1e-4
    assert axes.get_ylim()[1] > 1e6
    axes = drawn(hs.plots.adhesion_map({}))
    assert axes.get_xlim() == (1e-3, 1e2)
    assert axes.get_ylim() == (1e-2, 1e4)


def test_unloaded_and_pulled_contacts_are_marked_at_the_lower_edge():
    axes = drawn(hs.plots.adhesion_map({"unloaded": (0.5, 0.0), "pulled": (10.0, -1.2), "pressed": (1.0, 1.0)}))
    arrows = {float(mark.get_xdata()[0]): float(mark.get_ydata()[0]) for mark in marks(axes, "v")}
    assert set(arrows) == {0.5, 10.0}
    assert all(axes.get_ylim()[0] < y < 1.5 * axes.get_ylim()[0] for y in arrows.values())
    assert len(marks(axes, "o")) == 1
    assert axes.get_title(loc="right") == "▼ unloaded or pulled"
    assert drawn(hs.plots.adhesion_map({"unloaded": (0.5, 0.0)})).get_title(loc="right") == "▼ unloaded or pulled"
    assert drawn(hs.plots.adhesion_map(CONTACTS)).get_title(loc="right") == ""


def test_a_label_is_text_and_not_mathematics():
    axes = drawn(hs.plots.adhesion_map({"costs $5 or $\\frac{": (1.0, 1.0)}))
    assert "costs \\$5 or \\$\\frac{" in [text.get_text() for text in axes.texts]


@pytest.mark.parametrize(
    ("contact", "error", "message"),
    [
        ((1.0,), InputError, r"contact 'tip' is \(1.0,\); expected its Maugis parameter and its load parameter"),
        (3.0, InputError, "contact 'tip' is 3.0; expected"),
        (("a", 1.0), InputError, "contact 'tip' is .*; expected"),
        ((-1.0, 1.0), InputError, "contact 'tip': maugis_parameter is -1; expected"),
        ((1.0, -1.7), LoadError, "contact 'tip': load_parameter of -1.7 πWR pulls harder"),
    ],
)
def test_contacts_that_cannot_be_marked(contact, error, message):
    with pytest.raises(error, match=message):
        hs.plots.adhesion_map({"tip": contact})


def test_drawing_does_not_change_the_settings():
    settings = dict(mpl.rcParams)
    hs.plots.adhesion_map(CONTACTS)
    assert dict(mpl.rcParams) == settings
