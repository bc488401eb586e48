"""The contact in a page, as a browser without a network computes and shows it."""

import hashlib
import re

import numpy as np
from golden import refused
from pairs import COMPLIANT as PAIR
from pytest import approx, fixture, mark

import historysim as hs
from historysim.memory.paths import Goals, blank_rows, straight_paths
from historysim.results.report import browser

pytestmark = mark.ci

HEIGHTS = np.array([0.0, -20e-9, -35e-9, -60e-9])
PLACES = {"x": np.array([0.0, 4e-6, 8e-6, 2e-6]), "y": np.array([0.0, 6e-6, 3e-6, 9e-6])}
ENSEMBLE = hs.Ensemble(PAIR, HEIGHTS, [10e-6, 30e-6, 15e-6, 40e-6], [0.2, 0.12, 0.2, 0.2], **PLACES)
EVENTS = [hs.NormalLoad(0.0, 4e-3)]
EVENTS += [
    hs.TangentialDisplacement(float(time), sign * 30e-9) for time, sign in ((1, 1), (2, -1), (3, 1))
]
IN_PLANE = [hs.NormalLoad(0.0, 4e-3)]
IN_PLANE += [
    hs.TangentialDisplacement(float(time), (x * 1e-8, y * 1e-8))
    for time, x, y in ((1, 1, 0), (2, 1, 1), (3, -1, 1), (4, -1, -1))
]

COLOUR = """([selector, name]) => {
  let element = document.querySelector(selector);
  const value = () => getComputedStyle(element)[name].match(/[0-9.]+/g).map(Number);
  // elements without colour inherit the background of their parent
  while (value().length === 4 && value()[3] === 0) element = element.parentElement;
  return value().slice(0, 3);
}"""
READY = "() => document.getElementById('explorer')?.dataset.ready"
SHOWN = """() => {
  const { explorer } = document.getElementById("explorer");
  const { model, shown, index, cells, own, profile, axis } = explorer;
  const text = (name) => document.querySelector(`[data-part=${name}]`).textContent;
  return {
    row: shown, asperity: explorer.setup.labels[index], difference: explorer.difference,
    load: model.total("tangential_load", axis)[shown], displacement: model.total("displacement", axis)[shown],
    slip: Array.from(cells.slip), normal: Array.from(cells.normal), radius: Array.from(cells.radius),
    stick: Array.from(cells.stick), tangential: Array.from(cells.tangential), own: Array.from(own.tangential[axis]),
    distance: Array.from(profile.distance), traction: Array.from(profile.traction), limit: Array.from(profile.limit),
    text: text("shown"), clicked: text("clicked"), refused: text("refused"),
    colours: Object.fromEntries(Array.from(document.querySelectorAll("[data-asperity]"), (mark) =>
      [mark.dataset.asperity, mark.getAttribute("class").match(/state(\\d)/)[1]])),
    spoken: document.getElementById("time").getAttribute("aria-valuetext"),
    chosen: document.querySelector(".chosen").dataset.asperity,
  };
}"""
SETTLED = """async () => { const { explorer } = document.getElementById("explorer"); await explorer.busy;
  await new Promise(requestAnimationFrame); await new Promise(requestAnimationFrame); }"""


@fixture(scope="module")
def history():
    return hs.replay(ENSEMBLE, EVENTS, substeps=10, record="all")


@fixture(scope="module")
def report(history, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "r.html"
    assert len(hs.report(history, path)) < 1e6
    return path


@fixture(scope="module")
def explored(history, tmp_path_factory):
    path = tmp_path_factory.mktemp("explored") / "e.html"
    path.write_text(hs.explore(history).page, encoding="utf-8")
    return path


def check(shown, history, row, label, axis=None):
    """What is shown belongs to one step and one asperity of the history."""
    step, place = history.isel(step=row), {} if axis is None else {"direction": axis}
    assert (shown["row"], shown["asperity"], shown["chosen"]) == (row, label, str(label))
    assert f"step {row}:" in shown["text"]
    assert shown["spoken"].endswith(f"step {row}")
    largest = float(abs(history.total_tangential_load).max())
    assert shown["load"] == approx(
        float(step.total_tangential_load.isel(place)), rel=1e-9, abs=1e-9 * largest
    )
    assert shown["displacement"] == approx(
        float(step.tangential_displacement.isel(place)), rel=1e-9, abs=1e-20
    )
    assert shown["slip"] == step.slip_state.values.tolist()
    assert shown["colours"] == {
        str(asperity): str(state) for asperity, state in enumerate(shown["slip"])
    }
    for name, variable in (
        ("normal", "normal_load"),
        ("radius", "contact_radius"),
        ("stick", "stick_radius"),
    ):
        assert shown[name] == approx(step[variable].values.tolist(), rel=1e-9, abs=1e-15), name
    own = history.sel(asperity=label)
    assert f"asperity {label}," in shown["clicked"]
    recorded = own.tangential_load.isel(place).values
    assert shown["own"] == approx(recorded.tolist(), rel=1e-9, abs=1e-9 * largest)
    expected = history.contact.asperity(label, row)
    distance = np.array(shown["distance"])
    traction = expected.traction(distance)
    traction = traction if axis is None else traction[:, axis]
    # the square root is steep at a front, where rounding of its radius shows
    assert np.abs(np.array(shown["traction"]) - traction).max() < 1e-6 * expected.pressure(0.0)
    assert shown["limit"] == approx(
        expected.friction * expected.pressure(distance), rel=1e-6, abs=1.0
    )


def test_the_slider_moves_loop_and_map_and_a_click_chooses_an_asperity(history, explored, opened):
    with opened(explored) as page:
        page.wait_for_function(READY)
        first = page.evaluate(SHOWN)
        # the page opens where half of the area slips, at the asperity that carries most
        row = history.contact.representative_step()
        heaviest = int(history.asperity[history.normal_load.values[row].argmax()])
        check(first, history, row, heaviest)
        assert first["difference"] < 1e-6

        slider = page.get_by_label("time", exact=True)
        for _ in range(8):
            slider.press("ArrowRight")
        page.evaluate(SETTLED)
        second = page.evaluate(SHOWN)
        assert second["slip"] != first["slip"]
        check(second, history, row + 8, heaviest)

        other = next(label for label in range(4) if second["slip"][label] and label != heaviest)
        page.locator(f"[data-asperity='{other}']").click()
        page.evaluate(SETTLED)
        check(page.evaluate(SHOWN), history, row + 8, other)

        # by keyboard, too; a number that no asperity has changes nothing
        field = page.get_by_label("asperity", exact=True)
        for text, label in ((str(heaviest), heaviest), ("77", heaviest)):
            field.fill(text)
            field.press("Enter")
            page.evaluate(SETTLED)
            check(page.evaluate(SHOWN), history, row + 8, label)
        assert field.input_value() == str(heaviest)


def test_other_friction_and_moduli_move_the_loop_beside_the_recorded_one(explored, opened):
    factor = 2**-0.5
    friction = ENSEMBLE.friction * factor
    other = hs.Ensemble(PAIR, HEIGHTS, ENSEMBLE.summit_radius, friction)
    softer = hs.MaterialPair.from_moduli(contact_modulus=40e9 * factor, shear_modulus=8e9 * factor)
    with opened(explored) as page:
        page.wait_for_function(READY)
        loop = "document.querySelectorAll('[data-part=loop] .line').length"
        assert page.evaluate(loop) == 1
        move = """([name, value]) => { const slider = document.getElementById(name);
          slider.value = value; slider.dispatchEvent(new Event("input")); }"""
        for name, value, ensemble in (
            ("friction", -0.5, other),
            ("modulus", -0.5, hs.Ensemble(softer, HEIGHTS, ENSEMBLE.summit_radius, friction)),
        ):
            page.evaluate(move, [name, value])
            page.evaluate(SETTLED)
            computed = page.evaluate(
                "Array.from(document.getElementById('explorer').explorer.model.total('tangential_load'))"
            )
            expected = hs.replay(ensemble, EVENTS, substeps=10).total_tangential_load.values
            assert computed == approx(expected.tolist(), rel=1e-9, abs=1e-12)
            assert page.evaluate(loop) == 2
        page.get_by_role("button", name="as recorded").click()
        page.evaluate(SETTLED)
        assert page.evaluate(loop) == 1


def test_a_load_that_less_friction_cannot_hold_ends_the_loop_and_the_page_says_where(
    tmp_path, opened
):
    events = [hs.NormalLoad(0.0, 4e-3), hs.TangentialLoad(1.0, 5e-4), hs.TangentialLoad(2.0, 0.0)]
    path = tmp_path / "t.html"
    path.write_text(hs.explore(hs.replay(ENSEMBLE, events, substeps=10)).page, encoding="utf-8")
    with opened(path) as page:
        page.wait_for_function(READY)
        slider = page.get_by_label("friction", exact=True)
        slider.press("Home")
        page.evaluate(SETTLED)
        shown = page.evaluate(SHOWN)
        assert re.search(
            r"friction holds .* where the loads ask for .*: the replay ends at", shown["refused"]
        )
        slider.press("End")
        page.evaluate(SETTLED)
        assert page.evaluate(SHOWN)["refused"] == ""


def test_both_directions_are_shown(tmp_path, opened):
    history = hs.replay(ENSEMBLE, IN_PLANE, substeps=3, record="all")
    path = tmp_path / "p.html"
    path.write_text(hs.explore(history).page, encoding="utf-8")
    with opened(path) as page:
        page.wait_for_function(READY)
        page.get_by_label("time", exact=True).press("End")
        for axis, name in enumerate("xy"):
            page.get_by_label("direction", exact=True).select_option(name)
            page.evaluate(SETTLED)
            check(
                page.evaluate(SHOWN),
                history,
                history.sizes["step"] - 1,
                page.evaluate(SHOWN)["asperity"],
                axis,
            )


def random_setup(rng, count, *, planar):
    """Random paths of mixed control over 12 asperities of two coefficients."""
    height, radius = -rng.exponential(3e-8, 12), rng.uniform(5e-6, 3e-5, 12)
    ensemble = hs.Ensemble(PAIR, height, radius, np.where(np.arange(12) % 3, 0.3, 0.15))
    by_load = rng.random(count) < 0.5
    normal = Goals(
        np.where(by_load, 0, 1),
        np.where(by_load, rng.uniform(0, 0.02, count), rng.uniform(-1e-8, 2e-7, count)),
    )
    pushed = rng.random(count) < 0.3
    target = np.where(pushed, rng.uniform(-2e-3, 2e-3, count), rng.uniform(-1e-7, 1e-7, count))
    if planar:
        pushed, target = np.zeros(count), rng.uniform(-1e-7, 1e-7, (count, 2))
    return ensemble, straight_paths(normal, Goals(np.where(pushed, 0, 1), target))


@mark.parametrize("count, planar", [(3000, False), (12, True)])
def test_the_library_of_browsers_has_the_bits_of_the_native_one(tmp_path, count, planar, opened):
    """It needs the script's `Model` alone, no page."""
    ensemble, paths = random_setup(np.random.default_rng(5), count, planar=planar)
    rows = blank_rows(count, None, planar=planar)
    ensemble.advance_along(ensemble.initial_state(), paths, rows=rows, saturate=True)
    rings = ensemble.rings
    setup = {
        "modulus": PAIR.contact_modulus,
        "ratio": PAIR.displacement_ratio,
        "directions": 2 if planar else 1,
        "rings": [rings.height_classes, rings.rings, rings.tolerance],
        "drive": [ensemble.tolerance, 0, 0, 1],
        "rows": count,
    }
    arrays = {
        name: getattr(ensemble, name).tolist()
        for name in ("summit_height", "summit_radius", "friction")
    }
    path = tmp_path / "b.html"
    script = browser.SCRIPT.read_text(encoding="utf-8")
    path.write_text(
        f"<!DOCTYPE html><link rel='icon' href='data:,'><script>{script}</script>", encoding="utf-8"
    )
    with opened(path) as page:
        digest = page.evaluate(
            """async ([library, setup, arrays, paths]) => {
              setup.height = Float64Array.from(arrays.summit_height);
              setup.radius = Float64Array.from(arrays.summit_radius);
              setup.friction = Float64Array.from(arrays.friction);
              setup.paths = await unpack(paths);
              const model = await new Model(await loadLibrary(library), setup).replay();
              if (model.refusal) throw new Error(JSON.stringify(model.refusal));
              const totals = model.memory.numbers(model.totals, TOTALS.length * setup.rows);
              const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", totals.slice()));
              return Array.from(hash, (byte) => byte.toString(16).padStart(2, "0")).join("");
            }""",
            [
                browser.encode(browser.LIBRARY.read_bytes()),
                setup,
                arrays,
                browser.encode(paths.tobytes()),
            ],
        )
    assert digest == hashlib.sha256(rows.totals.tobytes()).hexdigest()


def test_the_page_fits_a_small_dark_screen(report, opened):
    with opened(report, width=420, dark=True) as page:
        page.wait_for_function(READY)
        root = "document.documentElement"
        # only what scrolls by itself is wider
        assert page.evaluate(f"{root}.scrollWidth <= {root}.clientWidth")
        for selector in ("body", "figcaption", "th"):
            ink, paper = (
                page.evaluate(COLOUR, [selector, name]) for name in ("color", "backgroundColor")
            )
            assert contrast(ink, paper) >= 4.5, selector
        paper = page.evaluate(COLOUR, ["body", "backgroundColor"])
        assert contrast(page.evaluate(COLOUR, ["svg text", "fill"]), paper) >= 4.5
        for line in (".line.recorded", ".line.computed", ".line.limit", ".mark"):
            assert contrast(page.evaluate(COLOUR, [f"svg {line}", "stroke"]), paper) >= 3, line
        labels = ("time", "asperity", "friction", "moduli")
        boxes = [page.get_by_label(name, exact=True).bounding_box() for name in labels]
        boxes += [page.locator(f"[data-part={name}]").bounding_box() for name in browser.PANELS]
        assert all(box["x"] >= 0 and box["x"] + box["width"] <= 420 for box in boxes)
        assert sum(paper) < 200


def contrast(ink, paper):
    """Return the contrast of two colours after WCAG 2."""

    def luminance(colour):
        linear = [
            c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
            for c in np.array(colour) / 255
        ]
        return np.dot([0.2126, 0.7152, 0.0722], linear)

    dark, light = sorted(map(luminance, (ink, paper)))
    return (light + 0.05) / (dark + 0.05)


def test_a_notebook_embeds_the_page_and_other_objects_are_refused(history):
    assert "<iframe" in hs.explore(history)._repr_html_()
    totals = hs.replay(ENSEMBLE, EVENTS, record="totals")
    for wrong, message in (
        (totals, "of totals alone"),
        (history[["slip_state"]], "explore: Dataset; expected a history"),
    ):
        with refused(message):
            hs.explore(wrong)


def without_origin(history):
    """A history of unknown origin."""
    found = history.copy()
    found.encoding = {}
    return found


def test_a_history_without_events_is_computed_from_its_steps_or_the_page_says_why_not(history):
    trajectory = browser.find_trajectory(without_origin(history))
    assert "straight between its recorded steps" in trajectory.note
    at_once = [*EVENTS, hs.TangentialDisplacement(3.0, 20e-9)]
    reversed_within = without_origin(hs.replay(ENSEMBLE, at_once, substeps=10))
    with refused("recorded steps leave out part of the load path"):
        browser.find_trajectory(reversed_within)
    with refused("in two directions the path between steps is unknown"):
        browser.find_trajectory(without_origin(hs.replay(ENSEMBLE, IN_PLANE)))


def test_of_a_part_of_a_history_its_own_steps_are_replayed(history):
    part = history.isel(step=slice(0, 15))
    trajectory = browser.find_trajectory(part)
    settings, _ = browser.embedded_data(part, trajectory)
    assert settings["rows"] == trajectory.paths.size == 15


def test_of_a_large_ensemble_the_recorded_asperities_are_embedded(monkeypatch):
    monkeypatch.setattr(browser, "MOST_EMBEDDED", 3)
    history = hs.replay(ENSEMBLE, EVENTS, substeps=10)
    trajectory = browser.find_trajectory(history)
    assert trajectory.labels.tolist() == history.asperity.values.tolist() == [0, 1, 2]
    assert trajectory.note == "Of 4 asperities, the page has the 3 that were recorded."


def test_a_history_of_too_many_steps_is_refused_with_what_is_possible(history, monkeypatch):
    monkeypatch.setattr(browser, "MOST_STEPS", 20)
    with refused(r"20 steps at most, and the history has 31; .* history.isel\(step=slice\(20\)\)"):
        browser.find_trajectory(history)


UNSUPPORTED = {
    "friction or summits that events change": (ENSEMBLE, [*EVENTS, hs.FrictionChange(4.0, 0.1)]),
    "asperities that evolve": (
        hs.Ensemble(PAIR, HEIGHTS, 1e-5, hs.laws.ShearStrength(3e8)),
        EVENTS,
    ),
}


@mark.parametrize("text", UNSUPPORTED)
def test_histories_that_a_page_cannot_compute_are_refused(text):
    history = hs.replay(*UNSUPPORTED[text], substeps=4)
    with refused(f"pages cannot compute {text}"):
        hs.explore(history)


@mark.ci
def test_a_page_of_1000_asperities_and_2000_steps_is_below_1_megabyte():
    rng = np.random.default_rng(1)
    places = {"x": rng.uniform(0, 1e-4, 1000), "y": rng.uniform(0, 1e-4, 1000)}
    ensemble = hs.Ensemble(
        PAIR, rng.normal(0, 1e-7, 1000), rng.uniform(5e-6, 2e-5, 1000), 0.2, **places
    )
    events = [hs.NormalLoad(0.0, 0.1)]
    for time in range(1, 2000):
        events += [hs.NormalLoad(float(time), 0.1 + 0.02 * np.sin(time / 50))]
        events += [hs.TangentialDisplacement(float(time), 1e-7 * np.sin(time / 37))]
    assert len(hs.report(hs.replay(ensemble, events, record="all")).encode()) < 1e6
