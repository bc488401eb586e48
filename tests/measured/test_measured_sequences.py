"""From a measured sequence to loops, a comparison and a fit on the command line; and real records."""

import re
from pathlib import Path

import netCDF4
import synthetic
from click.testing import CliRunner
from pytest import approx, fixture, mark
from records import write_columns
from records_shared import DAMPER, DAMPER_SCENARIO

from historysim.cli import main
from historysim.scenario import scenario

pytestmark = mark.ci

SCENARIO = """
title = "a silicon ball on glass"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.26  # a guess
[loading]
file = "measured.csv"
[loading.columns]
time = "t"
normal_load = { column = "N", unit = "mN" }
tangential_displacement = { column = "u", unit = "nm" }
[loading.response]
tangential_load = { column = "T", unit = "mN" }
[loading.dead_band]
tangential_displacement = "20 nm"
[instrument]
lateral_stiffness = "400 mN/µm"
[fit]
parameters = ["friction", "lateral_stiffness"]
"""


def write_record(folder):
    record = synthetic.measured("ball", 7)
    write_columns(
        folder / "measured.csv",
        t=record.time,
        N=1e3 * record["normal_load"],
        u=1e9 * record["tangential_displacement"],
        T=1e3 * record["tangential_load"],
    )


@fixture
def folder(tmp_path, monkeypatch):
    write_record(tmp_path)
    (tmp_path / "s.toml").write_text(SCENARIO, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def number(text, label):
    """Give the number behind a label at the start of a line."""
    return float(re.search(rf"^{re.escape(label)} +([-+0-9.e]+)", text, re.MULTILINE)[1])


GIVEN = ["measured.csv", "s.toml"]


# -- what the commands do --------------------------------------------------------------------------


def test_loops_of_a_record(folder):
    done = call("loops", "s.toml")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    labelled = dict(
        re.split(r" {2,}", line, maxsplit=1) for line in lines if re.match(r"\S.*?\S {2,}\S", line)
    )
    assert labelled["dead band"].startswith("20 nm, ")
    assert labelled["friction over load"].startswith("F = 0.2 × load ")
    heading = next(
        place for place, line in enumerate(lines) if line.split() == ["friction", "coefficient"]
    )
    assert [line.split()[:4] for line in lines[heading + 1 : heading + 3]] == [
        ["50", "mN", "2", "0.2"],
        ["90", "mN", "2", "0.2"],
    ]
    assert lines[-1].split() == ["loops", "4"]
    assert files(folder) == GIVEN
    assert call("loops", "s.toml", "--skip", "1").output.splitlines()[-1].split()[:2] == [
        "loops",
        "3,",
    ]
    assert call("loops", "s.toml", "--skip-per-level", "1").output.splitlines()[-1].split()[:2] == [
        "loops",
        "2,",
    ]
    # with the step let through the loops are those of the reversals
    assert call("loops", "s.toml", "--load-share", ".5").output.splitlines()[-1].split() == [
        "loops",
        "3",
    ]


def test_compare_prints_and_draws(folder):
    done = call("compare", "s.toml")
    assert done.exit_code == 0, done.output
    assert number(done.output, "samples compared") == 1
    assert "samples compared  1,281\n" in done.output
    assert re.search(
        r"^friction coefficient +0\.2\S* ± \S+ \(of 2\) +0\.26", done.output, re.MULTILINE
    )
    assert re.search(r"^energy per loop .* nJ \(of 2\) +.* nJ \(of 2\)$", done.output, re.MULTILINE)
    assert done.output.endswith("s_comparison.png\n")
    assert (folder / "s_comparison.png").read_bytes().startswith(b"\x89PNG")
    assert files(folder) == ["measured.csv", "s.toml", "s_comparison.png"]


def test_fit_finds_the_parameters_and_writes_them(folder):
    (folder / "out").mkdir()
    done = call("fit", "s.toml", "-o", "out/found.toml")
    assert done.exit_code == 0, done.output
    assert files(folder) == ["measured.csv", "out", "s.toml"]
    assert files(folder / "out") == ["found.png", "found.toml"]
    assert number(done.output, "friction ") == approx(0.2, rel=1e-3)
    # in kN/m
    assert number(done.output, "lateral_stiffness") == approx(synthetic.STIFFNESS / 1e3, rel=0.02)
    assert number(done.output, "misfit over noise") == approx(1, abs=0.15)
    assert "note" not in done.output
    fitted = scenario.load(folder / "out" / "found.toml")
    assert f"{fitted.instrument.lateral_stiffness / 1e3:.6g} kN/m" in done.output
    assert "# fitted, 95 %: " in fitted.text
    assert "; a guess" in fitted.text
    # the fitted scenario is compared where it is
    again = call("compare", "out/found.toml", "-o", "c.png")
    assert again.exit_code == 0, again.output
    # as printed by the fit, to what the places of the turning points are within the noise
    for line in ("friction coefficient", "energy per loop", "stiffness at reversal"):
        assert number(again.output, line) == number(done.output, line)


# -- what they refuse ------------------------------------------------------------------------------


# -- real records ----------------------------------------------------------------------------------


@mark.skipif(not DAMPER.is_file(), reason="the measured record of a friction damper is not there")
def test_a_friction_damper(tmp_path, monkeypatch):
    """14 s at 0.5 Hz, swelling and dying away: 14 reversals, 13 half cycles, 6 whole loops."""
    monkeypatch.chdir(tmp_path)
    Path("d.toml").write_text(DAMPER_SCENARIO, encoding="utf-8")
    assert call("run", "d.toml", "-q").exit_code == 0
    with netCDF4.Dataset("d.nc") as result:
        # the reversals, the two ends of the record, and an extreme near each of them
        assert len(result.dimensions["step"]) == 18
    done = call("loops", "d.toml")
    assert done.exit_code == 0, done.output
    assert done.output.splitlines()[-1].split() == ["loops", "6"]
    # means are of the loops of full amplitude, and the small ones have a row of their own
    assert "those of 0.5 of the largest amplitude or more: 5 of 6 loops" in done.output
    assert re.search(
        r"^friction force\n  9\.84 mm +1 .*\n  22\.72 mm +5 ", done.output, re.MULTILINE
    )


def test_loops_are_drawn_with_model_loops(folder):
    done = call("loops", "s.toml", "-o", "l.svg", "--model")
    assert done.exit_code == 0, done.output
    assert "model, from loop to loop" in (folder / "l.svg").read_text(encoding="utf-8")
    (folder / "r.nc").write_bytes(b"")
    done = call("loops", "r.nc", "--model")
    assert done.exit_code == 2
