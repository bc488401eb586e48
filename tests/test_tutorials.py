"""The tutorials are typed verbatim: files are saved, commands run, and Python prints the output shown."""

import random
import re
import runpy
import shutil
from pathlib import Path

import numpy as np
import pages
from pytest import approx, fixture, importorskip, mark
from scipy import optimize

import historysim as hs

ROOT = Path(__file__).parents[1]
TUTORIALS = ROOT / "scenarios" / "tutorials"


@fixture
def typed(tmp_path, monkeypatch):
    """Return what types a tutorial, and returns its names and the outputs of its commands, by command."""
    (tmp_path / "data").mkdir()
    for name in ("unat_loops.csv", "fresh_256.txt", "worn_256.txt"):
        shutil.copy(ROOT / "data" / name, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    # one process is enough for what is so small
    monkeypatch.setattr("historysim.basics.system.processors", lambda: 1)

    def same(printed, shown):
        assert printed.strip() == shown.strip()

    return lambda name: pages.type_in((TUTORIALS / name).read_text(encoding="utf-8"), same)


def test_0_one_asperity_has_the_stick_radii_of_cattaneo_and_mindlin(typed):
    """c/a = (1 - ΔT/(2 μN))^(1/3) on a branch, with T in place of ΔT/2 on first loading."""
    names, outputs = typed("0_one_asperity.md")
    limit = 0.2 * 50.0
    changes = {"loaded": 8.0, "unloaded": 11.0 / 2, "reloaded": 7.0 / 2}
    for name, change in changes.items():
        ball = names["cases"][name]
        assert ball.stick_radius / ball.contact_radius == approx(
            (1 - change / limit) ** (1 / 3), rel=1e-9
        )
    assert names["harder"].slip_state == hs.SlipState.FULL_STICK
    assert "reversal point" in outputs["state ball.history --asperity 0 -o ball.png"]
    assert Path("one_asperity.png").is_file()
    assert Path("ball.png").is_file()


@mark.slow
def test_1_from_a_measured_loop_to_each_asperity(typed):
    """The record is of a ball with μ = 0.2 behind 334 mN/µm."""
    names, outputs = typed("1_measured_loop.md")
    fitted = dict(
        re.findall(
            r"^(friction|lateral_stiffness) +([0-9.]+) ", outputs["fit ball.toml"], re.MULTILINE
        )
    )
    assert float(fitted["friction"]) == approx(0.2, rel=1e-3)
    assert float(fitted["lateral_stiffness"]) == approx(334, rel=0.02)
    assert Path("ball_fitted.toml").is_file()
    assert Path("contact.png").is_file()
    assert 0.4 < float(names["shares"].slipping_area[names["step"]]) < 0.6
    assert len(hs.load("rough.toml").events()) == 2 * 26


def test_2_the_stage_creeps_with_the_time_constant_of_the_spring(typed):
    """Of the slowest root of m s³ + c s² + (P + k_t) s + I = 0."""
    names, _ = typed("2_stage_on_a_rough_contact.md")
    roots = np.roots(
        [
            names["MASS"],
            names["DAMPING"],
            names["PROPORTIONAL"] + names["stiffness"],
            names["INTEGRAL"],
        ]
    )
    slowest = roots[np.abs(roots).argmin()]
    assert slowest.imag == 0
    # the contact softens by some per cent on the way
    assert names["constant"] == approx(-1 / slowest.real, rel=0.03)
    assert names["errors"][-1] < 0.01 * names["SET_POINT"]


def test_3_a_texture_is_chosen(typed):
    """One ball drifts by θ μ (δ2 - δ1), n by n^(-1/2) or n^(-2/3) of it."""
    names, _ = typed("3_choosing_a_texture.md")
    pair = hs.MaterialPair(hs.material("alumina"), hs.material("zirconia"))
    first, second = (
        (9 * load**2 / (16 * 1e-3 * pair.contact_modulus**2)) ** (1 / 3) for load in (1.0, 1.4)
    )
    one = pair.displacement_ratio * 0.3 * (second - first)
    found = hs.sweep(
        "texture.toml",
        {"surface.count": [[4, 4]], "surface.scaling": ["self-similar", "curvature-invariant"]},
    )
    assert found.drift.values[0] == approx([one / 4, one / 16 ** (2 / 3)], rel=1e-9)
    assert (names["worst"].sel(surface_count="[8, 8]") < 5).all()


def test_4_a_surface_that_was_run_in_is_elastic_up_to_its_largest_load(typed):
    names, _ = typed("4_running_in.md")
    energy = (
        names["history"].total_yielding_energy.values
        if "total_yielding_energy" in names["history"]
        else []
    )
    # the last run falls from 90 mN: all of it is spent there
    assert (np.diff(energy) == 0).all()
    assert energy[0] > 0
    assert (names["grown"] > 1).all()


@mark.slow
def test_5_a_stage_drifts_once_and_its_unit_moves_as_in_python(typed):
    """The unit's force is that of the same places in one replay."""
    importorskip("fmpy", reason="needs FMPy: pip install historysim[exchange]")
    names, _ = typed("5_drift_of_a_stage.md")
    times = names["STEP"] * np.arange(1, len(names["positions"]) + 1)
    columns = zip(times.tolist(), names["normal_loads"], names["positions"], strict=True)
    events = [
        event
        for time, load, place in columns
        for event in (hs.NormalLoad(time, load), hs.TangentialDisplacement(time, place))
    ]
    again = hs.replay(names["ensemble"], events, record="totals").total_tangential_load.to_numpy()
    np.testing.assert_allclose(names["forces"], again[-times.size :], rtol=1e-9, atol=1e-12)


def test_6_a_load_along_y_lets_x_creep(typed):
    """The page has the positions to .01 nm; `test_6_the_creep_agrees_with_finer_rings` says that they are right."""
    names, _ = typed("6_two_directions.md")
    assert (np.diff(names["x"][1::3]) > 0).all()


@mark.slow
def test_6_the_creep_agrees_with_finer_rings(typed):
    """Twice the rings and classes, at a tenth of the tolerance."""
    names, _ = typed("6_two_directions.md")
    scenario = hs.load("plane.toml")
    summits = scenario.ensemble()
    fine = hs.Ensemble(
        summits.pair,
        summits.summit_height,
        summits.summit_radius,
        0.2,
        rings=hs.Rings(16, 60, tolerance=1e-4),
    )
    x = (
        hs.replay(fine, scenario.events(), record="totals")
        .tangential_displacement.sel(direction="x")
        .values
    )
    # 1e-3 of μN over a stiffness of some 1 mN/nm
    assert names["x"] == approx(x * 1e9, abs=0.05)


def _noise_free_pair():
    """Heights of the fresh and the worn surface on the points of the fresh map [nm], by the formula of the data."""
    formula = runpy.run_path(str(ROOT / "data" / "make_heights.py"))
    source = random.Random(54)  # noqa: S311 - that of the data
    roughness = formula["waves"](source, 150, 60.0, 4.0, 100.0)
    x, y = np.meshgrid(*[0.5 * np.arange(256)] * 2, indexing="ij")
    fresh = sum(
        amplitude * np.cos(kx * x + ky * y + phase) for kx, ky, amplitude, phase in roughness
    )
    above = np.maximum(fresh - 100.0, 0.0)
    shown = (x >= 3.2) & (y <= 0.5 * 255 - 1.85)  # by the second map
    return np.where(shown, fresh, np.nan), np.where(
        shown, fresh - above + 80.0 * (1 - np.exp(-above / 80.0)), np.nan
    )


def test_7_the_worn_volume_and_the_displacements_agree_with_the_formula(typed):
    """Noise-free: the volume by summation, δ = θ μ (z_max - d) with d from Hertz by bisection."""
    importorskip("skimage", reason="needs scikit-image: pip install historysim[surfaces]")
    names, outputs = typed("7_wear_and_drift.md")
    exact = _noise_free_pair()
    lost = np.nansum(exact[0] - exact[1]) * 1e-9 * (0.5e-6) ** 2
    wear = names["wear"]
    assert lost == approx(76.505e-18, rel=1e-5)
    assert abs(wear.worn_volume - lost) < 2 * wear.worn_volume_error < 0.002 * lost
    assert wear.shift == approx((3.2e-6, -1.85e-6), abs=4 * wear.shift_error)
    pair, displacements = names["pair"], []
    for heights in exact:
        summits = hs.Surface(heights * 1e-9, 0.5e-6).summits()
        stiffness = 4 / 3 * pair.contact_modulus * np.sqrt(summits.radius)

        def excess(approach, summits=summits, stiffness=stiffness):
            depth = np.maximum(summits.height - summits.height.max() + approach, 0.0)
            return float((stiffness * depth**1.5).sum()) - 50e-3

        displacements.append(pair.displacement_ratio * 0.2 * optimize.brentq(excess, 0.0, 1e-6))
    assert displacements == approx([23.17e-9, 5.29e-9], abs=0.01e-9)  # as the page states
    typed_in = [
        names["histories"][name].contact.preliminary_displacement().values[0]
        for name in ("fresh", "worn")
    ]
    assert typed_in == approx(displacements, abs=1e-9)
    assert names["drift"][0] * 1e-9 == approx(displacements[0] - displacements[1], abs=1e-9)
    assert "worn volume              76.5 ± 0.041 µm³" in next(iter(outputs.values()))
    assert Path("lost.png").is_file()
    assert Path("wear.png").is_file()


@mark.slow
def test_8_a_fretting_record_gives_cycles_energy_and_stress(typed):
    """A loop beyond sliding at 50 N has 4 μN (3 µm - u) + 0.8 μN u, with u = θ μ δ; the load varies by a fifth."""
    names, outputs = typed("8_fretting_record.md")
    assert "samples before are not compared" in outputs["fit rig.toml"]
    ball, limit = names["ball"], 0.6 * 50.0
    slip = ball.pair.displacement_ratio * 0.6 * ball.approach_at(50.0)
    large = names["closed"].dissipated_energy.values[names["size"] > 4e-6]
    expected = 4 * limit * (3e-6 - slip) + 0.8 * limit * slip
    assert large == approx(expected, rel=0.1)
    cycles = names["cycles"].dissipated_energy.sum()
    assert float(cycles) == approx(float(names["history"].total_dissipated_energy[-1]), rel=1e-12)
    assert float(names["peak"].tensile_x) == approx(
        float(names["some"].contact_radius.max()), rel=0.1
    )
    assert "*AMPLITUDE" in Path("rig.inp").read_text(encoding="utf-8")
    for name in ("loop", "cycles", "stress"):
        assert Path(f"{name}.png").is_file()
