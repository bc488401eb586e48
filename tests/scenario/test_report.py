"""Whatever has a report, and what has none."""

import re
from pathlib import Path

from click.testing import CliRunner
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.basics.units import quantity_text
from historysim.cli import main

BALL = """
title = "a ball"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
substeps = 10
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { after = 1, tangential_displacement = "40 nm" },
    { after = 1, tangential_displacement = "-40 nm" },
    { after = 1, tangential_displacement = "40 nm" },
]
"""
MEASURED = """
[loading]
file = "measured.csv"
[loading.columns]
time = "t"
normal_load = { column = "Fn", unit = "N" }
tangential_displacement = { column = "x", unit = "m" }
[loading.response]
tangential_load = { column = "Ft", unit = "N" }
"""


@fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ball.toml").write_text(BALL, encoding="utf-8")
    return tmp_path


@fixture
def measured(folder):
    history = hs.run("ball.toml")
    names = ("time", "total_normal_load", "tangential_displacement", "total_tangential_load")
    rows = zip(*(history[name].values.tolist() for name in names), strict=True)
    lines = ["t,Fn,x,Ft", *(",".join(map(repr, row)) for row in rows)]
    (folder / "measured.csv").write_text("\n".join(lines), encoding="utf-8")
    text = BALL[: BALL.index("[loading]")] + MEASURED
    (folder / "measured.toml").write_text(text, encoding="utf-8")
    (folder / "fit.toml").write_text(
        text + '\n[fit]\nparameters = ["friction"]\n', encoding="utf-8"
    )
    return folder


def call(*arguments):
    return CliRunner().invoke(main, list(arguments))


@mark.usefixtures("folder")
def test_loops_by_their_loads_have_a_report_with_a_column_for_each_load():
    again = "".join(
        f'    {{ after = 1, tangential_displacement = "{way} nm" }},\n'
        for way in (-40, 40, -40, 40, -40)
    )
    end = BALL.rindex("]")
    step = '    { after = 1, normal_load = "70 mN" },\n'
    Path("two.toml").write_text(BALL[:end] + again + step + again + BALL[end:], encoding="utf-8")
    assert call("run", "two.toml", "-q").exit_code == 0
    assert call("loops", "two.nc", "--levels", "n.nc").exit_code == 0
    table = hs.loops("two.nc").by_load()
    assert len(table) == 2
    assert call("report", "n.nc").output == "n_report.html\n"
    page = Path("n_report.html").read_text(encoding="utf-8")
    for load, members in zip(table.value, table.members, strict=True):
        assert f">{quantity_text(load, 'N')}, {members.size:,} loops</th>" in page
    found = zip(table.statistics("friction_force"), table.members, strict=True)
    forces = [one.text("N", members.size) for one, members in found]
    (row,) = re.findall("<tr><t[hd][^>]*>friction force</t[hd]>(.*?)</tr>", page)
    assert re.findall("<td[^>]*>(.*?)</td>", row) == forces


def test_a_sweep_has_a_report(folder):
    sweep = hs.sweep("ball.toml", {"friction.coefficient": [0.1, 0.2]})
    text = hs.report(sweep, folder / "s.html")
    assert "friction.coefficient of the scenario" in text
    for value in sweep["preliminary_displacement"].values:
        assert f'<td style="text-align: left">{value:.6g}</td>' in text
    assert "historysim sweep scenario.toml" in text


@mark.usefixtures("measured")
def test_a_scenario_is_compared_with_its_record():
    text = hs.report("measured.toml")
    assert "rms difference" in text
    assert "What was fitted" not in text
    assert "historysim compare scenario.toml" in text


@mark.usefixtures("measured")
def test_a_fit_has_a_report():
    assert call("report", "fit.toml", "-o", "f.html").exit_code == 0
    text = Path("f.html").read_text(encoding="utf-8")
    fit = hs.fit("fit.toml")
    assert fit.values["friction"] == approx(0.2, rel=1e-3)
    for _, told in fit.estimates.summary():
        assert told.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") in text
    assert "the scenario with the fitted values" in text


@mark.usefixtures("folder")
def test_objects_without_a_report_are_refused():
    for file, told in (
        ("ball.toml", "ball.toml: loading: has no measured record; expected loading.file"),
    ):
        done = call("report", file)
        assert done.exit_code == 2
        assert told in done.output
    with raises(hs.InputError, match="this Asperity: has no report; expected a result"):
        hs.report(hs.run("ball.toml").contact.asperity(0, 5))
    assert not list(Path().glob("*.html"))
