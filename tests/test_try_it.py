"""The page *Try it* of the site, as a browser without a network computes it."""

import importlib.util
from pathlib import Path

import numpy as np
from pytest import approx, fixture, mark

import historysim as hs

pytestmark = mark.ci

ROOT = Path(hs.__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("try_it", ROOT / ".site" / "try_it.py")
try_it = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(try_it)

TRIAL = "document.getElementById('trial')"
COMPUTED = f"""async () => {{ const {{ trial }} = {TRIAL};
  for (let k = 0; k < 4; k++) await new Promise(requestAnimationFrame);
  return {{ message: trial.part("message").textContent, shown: trial.part("shown").textContent,
    load: Array.from(trial.model.total("tangential_load")), displacement: Array.from(trial.model.total("displacement")),
    normal: Array.from(trial.model.total("normal_load")), time: trial.path.time, scenario: trial.scenario() }}; }}"""
ENGLISH = "time (s),N (mN),U (nm)\n0,50,0\n1,50,10\n2,60,-4.5\n3,40,8\n"
GERMAN = "Zeit [s];Normalkraft [mN];Verschiebung [nm]\r\n0;50,0;0\r\n1;50,0;10\r\n2;60;-4,5\r\n3;40;8\r\n"
UNDERSCORES = "time_s\tnormal_load_mN\ttangential_displacement_nm\n0\t50\t0\n1\t50\t10\n2\t60\t-4.5\n3\t40\t8\n"
BY_LOAD = "# a comment\nt,F_N,T\n0,0.05,0\n1,0.05,0.004\n2,0.06,-0.002\n3,0.04,0.001\n"
BY_APPROACH = "time approach_nm U_nm\n0 60 0\n1 60 10\n2 70 -4.5\n3 -5 8\n"
BROKEN = {
    "": "The file is empty; expected a table with columns of time, N or approach, U or T.",
    "a\0\1\2b": "The file is not text; expected a table in CSV.",
    "0,1,2\n1,2,3\n": (
        "The first line has numbers; expected the names of the columns, such as time (s), N (mN), U (nm)."
    ),
    "time,N\n0,1\n": (
        "No column holds the tangential displacement or the tangential load; expected one, such as U (nm)."
    ),
    "time,U\n0,1\n": "No column holds the normal load or the approach; expected one, such as N (mN).",
    "time,N (kg),U\n0,1,2\n": "Column N (kg) has the unit kg; expected one of N, kN, mN, µN, uN, nN.",
    "time,N,U\n": "The file has no rows below the names of its columns.",
    "time,N,U\n0,1,0\n1,x,0\n": 'Line 3: "x" in column N is not a number.',
    "time,N,U\n0,1\n": 'Line 2: "" in column U is not a number.',
    "time,N,U\n1,1,0\n0,1,0\n": "Line 3: the time 0 s comes after 1 s; expected ascending times.",
    "time,N,U\n0,-1,0\n": "Line 2: the normal load is \u22121\u00a0N; expected 0 or more.",
}


@fixture(scope="module")
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("site") / "try_it.html"
    path.write_text(try_it.render(), encoding="utf-8")
    return path


def choose(page, name, text, encoding="utf-8"):
    page.get_by_label("CSV file").set_input_files(
        {"name": name, "mimeType": "text/csv", "buffer": text.encode(encoding)}
    )
    page.wait_for_timeout(100)
    return page.evaluate(COMPUTED)


def recomputed(shown, folder):
    """Run the scenario of the page."""
    (folder / "scenario.toml").write_text(shown["scenario"], encoding="utf-8")
    return hs.run(folder / "scenario.toml")


def test_dropped_files_are_computed_as_their_scenario_is(page_file, tmp_path, opened):
    with opened(page_file) as page:
        page.wait_for_function(f"() => {TRIAL}.dataset.ready")
        expected = choose(page, "english.csv", ENGLISH)
        assert expected["message"] == ""
        assert expected["time"] == [0, 1, 2, 3]
        assert expected["normal"] == approx([0.05, 0.05, 0.06, 0.04])
        assert expected["displacement"] == approx([0, 1e-8, -4.5e-9, 8e-9])
        history = recomputed(expected, tmp_path)
        assert history.total_tangential_load.values.tolist() == expected["load"]
        for name, text, encoding in (
            ("german.csv", GERMAN, "windows-1252"),
            ("german.csv", "\ufeff" + GERMAN, "utf-8"),
            ("underscores.tsv", UNDERSCORES, "utf-8"),
        ):
            shown = choose(page, name, text, encoding)
            assert (shown["message"], shown["load"]) == ("", expected["load"]), name
        for text in (BY_LOAD, BY_APPROACH):
            shown = choose(page, "other.csv", text)
            assert shown["message"] == ""
            history = recomputed(shown, tmp_path)
            assert history.total_tangential_load.values.tolist() == shown["load"]
            assert history.total_normal_load.values.tolist() == shown["normal"]


def test_a_bad_file_has_one_plain_sentence_and_changes_nothing(page_file, opened):
    with opened(page_file) as page:
        page.wait_for_function(f"() => {TRIAL}.dataset.ready")
        before = page.evaluate(COMPUTED)
        for text, sentence in BROKEN.items():
            shown = choose(page, "broken.csv", text)
            assert shown["message"] == f"broken.csv: {sentence}"
            assert shown["load"] == before["load"]
        beyond = choose(page, "beyond.csv", "t,N,T\n0,0.05,0\n1,0.05,0.02\n2,0.05,0\n")
        assert beyond["message"].startswith(
            "At t = 1 s the tangential load is 20\u00a0mN, more than the friction limit of 10"
        )
        assert len(beyond["load"]) == 1


def test_a_path_is_drawn_by_mouse_and_by_keyboard_and_downloaded(page_file, tmp_path, opened):
    with opened(page_file, width=420) as page:
        page.wait_for_function(f"() => {TRIAL}.dataset.ready")
        root = "document.documentElement"
        assert page.evaluate(f"{root}.scrollWidth <= {root}.clientWidth")
        plane = page.locator("[data-part=plane]")
        plane.scroll_into_view_if_needed()
        box = plane.bounding_box()
        place = [(0.5, 0.5), (0.7, 0.4), (0.4, 0.6)]
        for number, (x, y) in enumerate(place):
            page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
            if not number:
                page.mouse.down()
        page.mouse.up()
        drawn = page.evaluate(COMPUTED)
        assert len(drawn["time"]) == 3
        # where the chart shows the point is where the pointer was
        mark = page.locator("[data-part=plane] .now").bounding_box()
        middle = np.array([mark["x"] + mark["width"] / 2, mark["y"] + mark["height"] / 2])
        assert middle == approx(
            [box["x"] + 0.4 * box["width"], box["y"] + 0.6 * box["height"]], abs=2
        )
        plane.press("ArrowRight")
        plane.press("ArrowUp")
        typed = page.evaluate(COMPUTED)
        assert typed["displacement"][-1] == approx(drawn["displacement"][-1] + 6e-9)
        assert typed["normal"][-1] == approx(drawn["normal"][-1] + 0.01)

        page.get_by_label("contact", exact=True).select_option("drawn")
        page.get_by_label("radius (µm)").fill("10")
        shown = page.evaluate(COMPUTED)
        assert "of 50 in contact" in shown["shown"]
        with page.expect_download() as download:
            page.get_by_role("button", name="download as scenario").click()
        assert download.value.suggested_filename == "scenario.toml"
        text = Path(download.value.path()).read_text(encoding="utf-8")
        history = recomputed({"scenario": text}, tmp_path)
        assert history.total_tangential_load.values.tolist() == shown["load"]

        page.get_by_label("friction", exact=True).fill("-1")
        page.get_by_text('friction: "-1"; expected a number from 0 to 10.').wait_for()
