"""Friction loops of several histories or cells in one picture, and what is marked on them."""

import numpy as np
from golden import refused
from pytest import approx, fixture

import historysim as hs
from historysim.results.plots.friction_loops import LOOP
from historysim.results.plots.swept import select_cells

BALL = """
title = "A ball"

[materials]
contact_modulus = 40e9
shear_modulus = 10e9

[surface]
kind = "sphere"
radius = "1 mm"

[friction]
coefficient = 0.2

[loading]
hold = true
substeps = 40
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { after = "1 s", tangential_displacement = "60 nm", name = "A" },
    { after = "1 s", tangential_displacement = "-60 nm", name = "B" },
    { after = "1 s", tangential_displacement = "60 nm" },
]

[sweep]
outputs = ["total_tangential_load", "tangential_displacement", "preliminary_displacement", "presliding_work"]

[sweep.over]
friction.coefficient = [0.1, 0.2]
"loading.waypoints[0].normal_load" = ["20 mN", "50 mN"]
"""
# θ δ of the ball at 50 mN [m]
DELTA = 40e9 / (4 * 10e9) * (9 * 0.05**2 / (16 * 1e-3 * 40e9**2)) ** (1 / 3)


@fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("ball") / "ball.toml"
    path.write_text(BALL, encoding="utf-8")
    return path


@fixture(scope="module")
def swept(ball):
    return hs.sweep(ball)


def drawn(figure):
    return {str(line.get_label()): line for line in figure.axes[0].get_lines()}


def test_each_cell_is_a_line_labelled_by_its_swept_values(swept):
    found = swept
    figure = hs.plots.loops(found)
    lines = drawn(figure)
    names = [f"$\\mu$ = {mu}, $N$ = {load} mN" for mu in (0.1, 0.2) for load in (20, 50)]
    assert list(lines)[-4:] == names
    assert lines[names[3]].get_ydata().max() == approx(0.2 * 50e-3)
    assert lines[names[0]].get_xdata().max() == approx(60e-9)
    few = hs.plots.loops(found, labels=("less", "more"), where={"friction.coefficient": 0.1})
    assert list(drawn(few))[-2:] == ["less", "more"]
    # without a picture that is asked for, loops alone are drawn so
    alone = found[list(LOOP)]
    assert len(drawn(hs.plot(alone))) == len(drawn(hs.plot(found, picture="loops")))


def test_several_results_are_drawn_with_their_titles(ball, tmp_path):
    for number, load in ((1, "20 mN"), (2, "50 mN")):
        values = {"loading.waypoints[0].normal_load": load, "title": f"Run {number}"}
        hs.run(hs.load(ball, values), tmp_path / f"{number}.nc").close()
    figure = hs.plot([tmp_path / "1.nc", str(tmp_path / "2.nc")])
    lines = drawn(figure)
    assert {"Run 1", "Run 2"} <= set(lines)
    assert lines["Run 2"].get_ydata().max() == approx(10e-3)
    hs.run(hs.load(ball, {"title": "Run 1"}), tmp_path / "3.nc").close()
    assert {"1.nc", "3.nc"} <= set(drawn(hs.plot([tmp_path / "1.nc", tmp_path / "3.nc"])))
    assert "less" in drawn(hs.plot([tmp_path / "1.nc", tmp_path / "2.nc"], labels=["less", "more"]))


def test_a_run_of_few_steps_is_smooth_if_its_events_are_known(ball, tmp_path):
    coarse = hs.load(ball, {"loading.substeps": 1})
    with hs.run(coarse, tmp_path / "coarse.nc") as history:
        assert history.sizes["step"] == 4
        lines = [
            line
            for line in hs.plots.loops(history).axes[0].get_lines()
            if np.size(line.get_xdata()) > 10
        ]
        assert lines[0].get_xdata().size > 200
        # on the way out it is first loading (Mindlin)
        u, t = lines[0].get_xdata()[:80], lines[0].get_ydata()[:80]
        expected = 0.01 * (1 - (1 - np.minimum(u / (0.2 * DELTA), 1)) ** 1.5)
        assert t == approx(expected, abs=1e-9)
        part = hs.plots.loops(history.isel(step=slice(2))).axes[0].get_lines()
        assert max(np.size(line.get_xdata()) for line in part) == 2
    in_memory = hs.run(coarse)
    assert (
        max(np.size(line.get_xdata()) for line in hs.plots.loops(in_memory).axes[0].get_lines())
        > 200
    )
    in_memory.encoding.clear()
    assert (
        max(np.size(line.get_xdata()) for line in hs.plots.loops(in_memory).axes[0].get_lines())
        == 4
    )


def test_named_states_are_marked_and_chosen(ball):
    history = hs.run(ball)
    assert {text.get_text() for text in hs.plots.loops(history).axes[0].texts} == {"A", "B"}
    one = hs.plot(history, picture="loops", steps=["B", "20"])
    assert {text.get_text() for text in one.axes[0].texts} == {"B", "step 20, 0.5 s"}
    with refused(r"'C' is not a named state of the history; .*A"):
        hs.plot(history, picture="loops", steps=["C"])
    with refused("step 500: the history has 121 steps"):
        hs.plot(history, picture="loops", steps=[500])


def test_the_work_is_the_closed_loop_and_drift_the_difference(swept):
    found = swept
    figure = hs.plots.loops(found, where={"friction.coefficient": 0.2}, work=True, drift=True)
    axes = figure.axes[0]
    x, y = axes.patches[1].get_xy().T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    reach = 0.2 * DELTA
    assert area == approx(0.8 * 0.01 * reach, rel=0.01)
    assert np.abs(x).max() == approx(reach, rel=1e-9)
    drift = reach * (1 - 0.4 ** (2 / 3)) * 1e9
    assert f"drift {drift:.3g} nm" in {text.get_text() for text in axes.texts}
    bare = found[list(LOOP)]
    with refused("preliminary displacement of the loops is not known"):
        hs.plots.loops(bare, work=True)
    with refused("drift: expected two loops"):
        hs.plots.loops(bare, drift=True)


def test_unsuitable_results_and_selections_are_refused(swept):
    found = swept
    with refused("there is no total_tangential_load along step"):
        hs.plots.loops(found[["preliminary_displacement"]])
    with refused("labels has 1"):
        hs.plots.loops(found, labels=["one"])
    with refused(r"where: 'friction' was not swept; .*friction\.coefficient"):
        select_cells(found, {"friction": 0.1})
    with refused(r"has no value 0\.3"):
        select_cells(found, {"friction.coefficient": 0.3})
    assert select_cells(found, {"loading.waypoints[0].normal_load": ["20 mN", "50 mN"]}).equals(
        found
    )
