"""[picture] of a scenario: its keys, what they draw of a result, a sweep or a surface, and the command."""

import numpy as np
import pytest
from click.testing import CliRunner
from golden import refused

import historysim as hs
from historysim.cli import main
from historysim.results.steps import named_states
from historysim.scenario.figure import draw_scenario_figure, drawable

BALL = """
title = "Fig. 1: a ball"

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
substeps = 10
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { after = "1 s", tangential_load = "5 mN", name = "K" },
    { after = "1 s", tangential_load = "-5 mN", name = "L" },
]
"""
TWO = """
[[picture]]
kind = "loops"
title = "a"

[[picture]]
kind = "traction"
title = "b"
across = "diameter"
"""
SWEPT = """
[sweep]
outputs = ["preliminary_displacement", "total_tangential_load", "tangential_displacement"]

[sweep.over]
friction.coefficient = [0.1, 0.2, 0.4]

[[picture]]
kind = "curve"
quantity = "preliminary_displacement"
fit = "power"
logarithmic = true

[[picture]]
kind = "bars"
quantity = "preliminary_displacement"
groups = { low = ["0.1"], high = ["0.2", "0.4"] }

[[picture]]
kind = "loops"
where = { "friction.coefficient" = [0.1, 0.4] }
"""
ROUGH = """
[[picture]]
kind = "map"

[[picture]]
kind = "summits"

[sweep]
[sweep.over]
surface.seed = [1, 2]
"""


@pytest.fixture
def write(tmp_path):
    def written(text):
        path = tmp_path / "s.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_a_run_has_its_panels_side_by_side(write, tmp_path):
    path = write(BALL + TWO)
    with hs.run(path, tmp_path / "s.nc") as history:
        assert named_states(history) == {"K": 10, "L": 20}
        figure = hs.plot(history)
        assert [part.get_suptitle() for part in figure.subfigs] == ["a", "b"]
        assert figure.get_suptitle() == "Fig. 1: a ball"
        x = figure.axes[1].get_lines()[-1].get_xdata()
        assert x[0] == -x[-1]
        # a picture that is asked for is drawn in its place
        assert len(hs.plot(history, picture="stiffness").axes) >= 1
        assert (
            hs.plot(history, picture="traction", steps=["K"]).axes[0].get_lines()[-1].get_label()
            == "K"
        )
    again = hs.plot(tmp_path / "s.nc", size=(150, 80))
    assert again.get_size_inches() * 25.4 == pytest.approx([150, 80])
    (loops,) = (picture for picture in drawable(hs.run(path)) if picture.title == "a")
    assert len(draw_scenario_figure(hs.run(path), (loops,)).axes) == 1


def test_a_sweep_has_curves_bars_and_loops(write):
    found = hs.sweep(write(BALL + SWEPT))
    curve, bars, loops = hs.plot(found).axes
    # δ ∝ μ
    assert any(str(line.get_label()) == "exponent 1.00" for line in curve.get_lines())
    assert curve.get_xlabel() == r"friction coefficient $\mu$"
    assert [tick.get_text() for tick in bars.get_xticklabels()] == ["low", "high"]
    difference = float(found.preliminary_displacement[2] - found.preliminary_displacement[1]) * 1e9
    assert any(text.get_text() == f"high: drift {difference:.3g} nm" for text in bars.texts)
    assert [str(line.get_label()) for line in loops.get_lines()][-2:] == [
        r"$\mu$ = 0.1",
        r"$\mu$ = 0.4",
    ]
    # one run of it has none of these but its loop
    assert len(hs.plot(hs.run(hs.load(write(BALL + SWEPT.replace("[0.1, 0.4]", "0.1"))))).axes) == 1


def _written(history, folder):
    history.to_netcdf(folder / "written.nc")
    return folder / "written.nc"


def test_a_result_names_the_command_where_the_files_of_its_scenario_are_elsewhere(
    write, tmp_path, monkeypatch
):
    np.savetxt(tmp_path / "map.txt", np.outer(np.hanning(9), np.hanning(9)))
    measured = 'kind = "measured"\nfile = "map.txt"\npixel_size = "1 µm"\nheight_unit = "nm"\nform = "mean"'
    path = write(
        BALL.replace('kind = "sphere"\nradius = "1 mm"', measured) + '[picture]\nkind = "map"\n'
    )
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    # the command knows the folder of the scenario, and so does a result next to it
    for output in ("results/s.nc", "s.nc"):
        done = CliRunner().invoke(main, ["run", path.name, "-o", output, "-q", "--plot"])
        assert done.exit_code == 0, done.output
    assert len(hs.plot("s.nc").axes) >= 1
    with refused(r"picture map: .*results.map.txt is not there; .* plot SCENARIO.toml"):
        hs.plot("results/s.nc")


def test_surfaces_need_no_run(write, tmp_path):
    text = BALL.replace(
        'kind = "sphere"\nradius = "1 mm"',
        """kind = "random"
shape = [32, 32]
pixel_size = "1 µm"
rms_height = "0.1 µm"
autocorrelation_length = "5 µm"
seed = 1""",
    )
    figure = hs.plot(hs.load(write(text + ROUGH)))
    names = [
        text.get_text()
        for part in figure.subfigs
        for legend in part.legends
        for text in legend.get_texts()
    ]
    assert names[0].startswith("surface 1: ")
    assert names[1].startswith("surface 2: ")
    # a result draws them from the text of its scenario, next to pictures of its own
    own = '\n[[picture]]\nkind = "loops"\n'
    history = hs.run(write(text + ROUGH.split("[sweep]", maxsplit=1)[0] + own))
    for subject in (history, _written(history, tmp_path)):
        figure = hs.plot(subject)
        labels = [axes.get_xlabel() for axes in figure.axes]
        assert len(figure.subfigs) == 3
        assert {"$x$ (µm)", "tangential displacement $U$ (nm)"} <= set(labels)
    with refused("picture: the surface is not a height map"):
        hs.plot(hs.load(write(BALL + '[picture]\nkind = "map"\n')))
