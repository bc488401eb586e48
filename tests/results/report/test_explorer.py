"""The interactive part of a report, as a browser without a network shows it."""

import numpy as np
import pytest
from browser import opened

import historysim as hs
from historysim.errors import InputError
from historysim.results.plots.style import FAINT, STATE_COLOURS
from historysim.results.report import explorer

pytest.importorskip("bokeh", reason="the interactive part of a report needs Bokeh")

PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
HEIGHTS = np.array([0.0, -20e-9, -35e-9, -60e-9])
PLACES = {"x": np.array([0.0, 4e-6, 8e-6, 2e-6]), "y": np.array([0.0, 6e-6, 3e-6, 9e-6])}
ENSEMBLE = hs.Ensemble(PAIR, HEIGHTS, [10e-6, 30e-6, 15e-6, 40e-6], [0.2, 0.12, 0.2, 0.2], **PLACES)
EVENTS = [hs.NormalLoad(0.0, 4e-3)]
EVENTS += [hs.TangentialDisplacement(float(time), sign * 30e-9) for time, sign in ((1, 1), (2, -1), (3, 1))]

SHOWN = """() => {
  const document = Bokeh.documents[0];
  const entries = (name) => Object.entries(document.get_model_by_name(name).data);
  const columns = (name) => Object.fromEntries(entries(name).map(([key, list]) => [key, Array.from(list)]));
  return {
    value: document.get_model_by_name("clock").data.now[0],
    shown: window.document.getElementById("explorer-time").value,
    marker: columns("marker"), fill: columns("map").fill, moment: columns("moment"), profile: columns("profile"),
    curve: columns("curve"), message: window.document.getElementById("explorer-shown").innerHTML,
    clicked: window.document.getElementById("explorer-clicked").innerHTML,
    asperity: window.document.getElementById("explorer-asperity").selectedOptions[0].text,
    spoken: window.document.getElementById("explorer-time").getAttribute("aria-valuetext"),
  };
}"""
COLOUR = """([selector, name]) => {
  let element = document.querySelector(selector);
  const value = () => getComputedStyle(element)[name].match(/[0-9.]+/g).map(Number);
  // what has no colour of its own stands on that of what is around it
  while (value().length === 4 && value()[3] === 0) element = element.parentElement;
  return value().slice(0, 3);
}"""
READY = "() => window.Bokeh && Bokeh.documents.length && Bokeh.documents[0].is_idle"
WHERE = """(label) => {
  const document = Bokeh.documents[0];
  const figure = document.get_model_by_name("contacts_figure");
  const find = (views) => {
    for (const view of views) {
      if (view.model === figure) return view;
      const found = find(view.child_views ?? []);
      if (found) return found;
    }
  };
  const view = find(Bokeh.index.roots);
  const data = document.get_model_by_name("map").data;
  const i = Array.from(data.asperity).indexOf(label);
  const box = view.canvas_view.el.getBoundingClientRect();
  return [box.x + view.frame.x_scale.compute(data.x[i]), box.y + view.frame.y_scale.compute(data.y[i])];
}"""


@pytest.fixture(scope="module")
def history():
    return hs.replay(ENSEMBLE, EVENTS, substeps=10)


@pytest.fixture(scope="module")
def report(history, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "r.html"
    assert len(hs.report(history, path)) < 3e6
    return path


def check(shown, history, label):
    """What is shown belongs to one step and one asperity of the history."""
    row = history.isel(step=shown["value"])
    assert f"step {shown['value']}<" in shown["message"]
    assert shown["shown"] == str(shown["value"])
    assert shown["spoken"] == f"t = {float(row.time):#.4g} s, step {shown['value']}"
    assert shown["asperity"] == str(label)
    assert shown["marker"]["x"] == pytest.approx([float(row.tangential_displacement) * 1e9], rel=1e-9, abs=1e-9)
    assert shown["marker"]["y"] == pytest.approx([float(row.total_tangential_load) * 1e6], rel=1e-9, abs=1e-9)
    assert shown["fill"] == [STATE_COLOURS[state] for state in row.slip_state.values]
    own = history.sel(asperity=label)
    assert f"asperity {label}<" in shown["clicked"]
    assert shown["curve"]["load"] == pytest.approx((own.tangential_load.values * 1e3).tolist(), rel=1e-6, abs=1e-9)
    limit = own.normal_load.values * float(own.friction)
    assert shown["curve"]["limit"] == pytest.approx((limit * 1e3).tolist(), rel=1e-6)
    assert shown["moment"]["x"] == [float(row.time)]
    expected = history.contact.asperity(label, shown["value"])
    radius = np.array(shown["profile"]["radius"]) * 1e-9
    traction = expected.traction(radius) * 1e-6
    # the square root is steep at a front, where rounding of its radius shows
    assert np.abs(np.array(shown["profile"]["traction"]) - traction).max() < 1e-4 * expected.pressure(0.0) * 1e-6
    assert shown["profile"]["limit"] == pytest.approx(
        expected.friction * expected.pressure(radius) * 1e-6, rel=1e-5, abs=1.0
    )


def test_the_slider_moves_loop_and_map_and_a_click_shows_an_asperity(history, report):
    with opened(report) as page:
        page.wait_for_function(READY)
        first = page.evaluate(SHOWN)
        # the page opens where half of the area slips, at the asperity that carries most
        assert first["value"] == history.contact.representative_step()
        heaviest = int(history.asperity[history.normal_load.values[first["value"]].argmax()])
        check(first, history, heaviest)

        slider = page.get_by_label("time", exact=True)
        for _ in range(8):
            slider.press("ArrowRight")
        second = page.evaluate(SHOWN)
        assert second["value"] == first["value"] + 8
        assert second["fill"] != first["fill"]
        check(second, history, heaviest)

        other = next(label for label in history.asperity.values.tolist() if label != heaviest)
        page.mouse.click(*page.evaluate(WHERE, other))
        page.wait_for_function(f"() => ({SHOWN})().clicked.includes('asperity {other}<')")
        check(page.evaluate(SHOWN), history, other)

        # by keyboard, too
        page.get_by_label("asperity", exact=True).select_option(str(heaviest))
        check(page.evaluate(SHOWN), history, heaviest)


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [420, 1400])
def test_the_page_fits_the_screen_light_and_dark(report, width, dark):
    with opened(report, width=width, dark=dark) as page:
        page.wait_for_function(READY)
        root = "document.documentElement"
        # only what scrolls by itself is wider
        assert page.evaluate(f"{root}.scrollWidth <= {root}.clientWidth")
        for selector in ("body", "figcaption", "th"):
            ink, paper = (page.evaluate(COLOUR, [selector, name]) for name in ("color", "backgroundColor"))
            assert contrast(ink, paper) >= 4.5, selector
        boxes = [page.get_by_label(name, exact=True).bounding_box() for name in ("time", "asperity")]
        assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in boxes)
        brightness = sum(page.evaluate(COLOUR, ["body", "backgroundColor"]))
        assert brightness < 200 if dark else brightness > 700


def contrast(ink, paper):
    """Return the contrast of two colours after WCAG 2."""

    def luminance(colour):
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.array(colour) / 255]
        return np.dot([0.2126, 0.7152, 0.0722], linear)

    dark, light = sorted(map(luminance, (ink, paper)))
    return (light + 0.05) / (dark + 0.05)


def test_notes_can_be_read_on_white():
    grey = [int(FAINT[place : place + 2], 16) for place in (1, 3, 5)]
    assert contrast(grey, [255, 255, 255]) >= 4.5


def test_a_notebook_shows_it_and_what_cannot_be_explored_is_told(history, tmp_path):
    shown = hs.explore(history)
    frame = shown._repr_html_()
    path = tmp_path / "n.html"
    path.write_text(f"<!DOCTYPE html><link rel='icon' href='data:,'><body>{frame}</body>", encoding="utf-8")
    with opened(path) as page:
        inside = page.frame_locator("iframe")
        inside.get_by_label("time", exact=True).press("ArrowRight")
        inside.get_by_text(f"step {history.contact.representative_step() + 1}").wait_for()
    totals = hs.replay(ENSEMBLE, EVENTS, record="totals")
    for wrong, message in (
        (totals, "of totals alone"),
        (history[["slip_state"]], "explore: Dataset; expected a history"),
    ):
        with pytest.raises(InputError, match=message):
            hs.explore(wrong)


def test_of_a_large_history_a_part_is_embedded_and_the_page_says_which(history, monkeypatch):
    monkeypatch.setattr(explorer, "MOST_STEPS", 5)
    monkeypatch.setattr(explorer, "MOST_ASPERITIES", 2)
    part = explorer.excerpt(history)
    telling = history.contact.representative_step()
    assert part.steps.tolist() == sorted({0, 8, 15, 22, 30, telling})
    assert part.steps[part.first_shown] == telling
    loads = history.normal_load.values[0]
    assert set(part.columns) == set(np.argsort(-loads)[:2])
    carried = 100 * loads[part.columns].sum() / loads.sum()
    (message,) = part.notes
    kept = f"{part.steps.size} of 31 steps; 2 of 3 recorded asperities, which carry {carried:.3g} % of the peak normal"
    assert message == f"To keep the page small, it holds {kept} load."
    assert explorer.explorer(history)[2] == part.notes


def alone(history):
    """A history of unknown origin."""
    found = history.copy()
    found.encoding = {}
    return found


def test_tractions_that_cannot_be_told_are_left_out_and_the_page_says_so(history, monkeypatch):
    at_once = [*EVENTS, hs.TangentialDisplacement(3.0, 20e-9)]
    (message,) = explorer.excerpt(alone(hs.replay(ENSEMBLE, at_once, substeps=10))).notes
    assert message.startswith("There are no traction profiles: asperity")
    changed = [*EVENTS, hs.FrictionChange(4.0, 0.1)]
    (message,) = explorer.excerpt(alone(hs.replay(ENSEMBLE, changed, substeps=10))).notes
    assert message == "There are no traction profiles: friction or heights change in the history."
    monkeypatch.setattr(explorer, "MOST_GROUPS", 1)
    (message,) = explorer.excerpt(alone(history)).notes
    assert message.startswith("There are no traction profiles: there are 2 friction coefficients")


def test_without_tractions_no_empty_picture_stands_in_the_page(history):
    # Bokeh complains of axes without numbers
    changed = [*EVENTS, hs.FrictionChange(4.0, 0.1)]
    for shown, there in ((history, True), (hs.replay(ENSEMBLE, changed, substeps=10), False)):
        _, body, _ = explorer.explorer(shown)
        assert "history_figure" in body
        assert ("profile_figure" in body) is there
