"""Load, area and stiffness over the approach: by Hertz in closed form, and by sums over summits; long tables."""

import numpy as np
import pandas as pd
from click.testing import CliRunner
from golden import refused
from numpy.testing import assert_allclose
from pairs import GLASS as PAIR
from pytest import approx

import historysim as hs
from historysim.cli import main

LOADS = [hs.NormalLoad(0.0, 20e-3), hs.NormalLoad(1.0, 5e-3)]


def test_one_ball_agrees_with_hertz():
    curve = hs.replay(hs.Ensemble(PAIR, 0.0, 1e-3, friction=0.2), LOADS).contact.load_curve(
        points=21
    )
    depth, modulus = curve["approach"].to_numpy(), PAIR.contact_modulus
    assert_allclose(curve["normal_load"], 4 / 3 * modulus * np.sqrt(1e-3) * depth**1.5, rtol=1e-12)
    assert_allclose(curve["contact_area"], np.pi * 1e-3 * depth, rtol=1e-12)
    assert_allclose(curve["normal_stiffness"], 2 * modulus * np.sqrt(1e-3 * depth), rtol=1e-12)
    for name in ("normal_load", "contact_area", "normal_stiffness"):
        assert_allclose(curve[f"theory_{name}"], curve[name], rtol=1e-12)
    assert curve.attrs["theory"] == "Hertz"
    assert curve["normal_load"].to_numpy()[-1] == approx(20e-3, rel=1e-12)


def test_the_approach_of_a_cylinder_is_not_that_of_a_summit():
    line = hs.LineContact(PAIR, radius=0.01, length=0.005, friction=0.5, reference_depth=0.01)
    curve = hs.replay(line, LOADS).contact.load_curve(points=3)
    assert curve["approach"].attrs["long_name"] == "approach of the cylinder from first touch"


def test_many_summits_are_near_greenwood_and_williamson():
    heights = np.random.default_rng(1).normal(0, 50e-9, 20_000)
    history = hs.replay(hs.Ensemble(PAIR, heights, 5e-6, friction=0.2), [hs.NormalLoad(0.0, 5.0)])
    curve = history.contact.load_curve(points=5)
    depth = heights - (heights.max() - curve["approach"].to_numpy()[-1])
    area = np.pi * 5e-6 * depth[depth > 0].sum()
    assert curve["contact_area"].to_numpy()[-1] == approx(area, rel=1e-12)
    # the sum over n of n summits scatters by 1/√n
    for name in ("normal_load", "contact_area", "normal_stiffness"):
        assert curve[f"theory_{name}"].to_numpy()[-1] == approx(
            curve[name].to_numpy()[-1], rel=0.05
        )
    axes = hs.plot(history, picture="load-curve").axes
    assert [len(each.lines) for each in axes] == [2, 2, 2]
    assert len(hs.plot(history, picture="load-curve", size=(90, 70)).axes) == 1
    with refused("no normal load"):
        hs.replay(
            hs.Ensemble(PAIR, 0.0, 1e-3, friction=0.2), [hs.NormalLoad(0.0, 0.0)]
        ).contact.load_curve()


def test_tables_over_time_have_totals_or_long_rows(tmp_path):
    history = hs.run("scenarios/08_mixed_control.toml", tmp_path / "h.nc")
    for options, rows in (
        ((), history.sizes["step"]),
        (("--with", "form=long"), history["slip_state"].size),
    ):
        path = tmp_path / "time.csv"
        done = CliRunner().invoke(
            main, ["table", str(tmp_path / "h.nc"), "time-series", "-o", str(path), *options]
        )
        assert done.exit_code == 0, done.output
        table = pd.read_csv(path)
        assert len(table) == rows
        assert ("asperity" in table) == bool(options)
    for (time, label), row in (
        table.set_index(["elapsed_time [s]", "asperity"]).iloc[::7].iterrows()
    ):
        at = history.isel(step=np.flatnonzero(history["time"].to_numpy() == time)[0])
        assert row["total_normal_load [N]"] == at["total_normal_load"]
        assert row["contact_radius [m]"] == at["contact_radius"].sel(asperity=label)
    with refused("form is 'short'"):
        history.contact.time_series(form="short")
