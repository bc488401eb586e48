"""Fretting reports against the closed loop of Cattaneo and Mindlin, and against parallelograms made by hand."""

import csv
import re

import numpy as np
from click.testing import CliRunner
from numpy.testing import assert_allclose
from pytest import approx, fixture, mark

import historysim as hs
from historysim.cli import main
from historysim.measured.fretting import QUANTITIES, by_load
from historysim.measured.loops import loops_of_channels
from historysim.studies.record_search import each_run, fretting_of_runs, fretting_rows

MU, LOAD = 0.5, 0.01  # [1], [N]
RADIUS_OF_CONTACT, SHEAR_MODULUS = 0.2, 0.25  # [m], [Pa]: scaled units of the closed form
CONTACT_COMPLIANCE = 1 / (8 * SHEAR_MODULUS * RADIUS_OF_CONTACT)
# Fouvry, Kapsa and Vincent, 1995
PUBLISHED = {"energy_ratio": 0.2, "system_free_ratio": 0.77, "sliding_ratio": 0.26}


def mindlin_loops(share, *, slide=0.0, system=0.0, samples=2000):
    """Two closed loops of a sphere between loads ± share μN, that slide on, in series with a compliance [m/N]."""
    length = 3 * MU * LOAD / (16 * RADIUS_OF_CONTACT * SHEAR_MODULUS)
    falling = np.linspace(share, -share, samples)
    way = length * (2 * (1 - (share - falling) / 2) ** (2 / 3) - (1 - share) ** (2 / 3) - 1)
    falling, way = np.append(falling, -share), np.append(way, way[-1] - slide)
    u = np.concatenate([way, way[-1] + way[0] - way[1:]])
    t = np.concatenate([falling, -falling[1:]]) * MU * LOAD
    u, t = np.append(u, u[1:]), np.append(t, t[1:])
    return loops_of_channels(
        np.arange(float(u.size)), u + system * t, t, np.full(u.size, LOAD), displacement_noise=0.0
    )


def test_transition_from_partial_slip_has_the_published_ratios():
    report = mindlin_loops(1.0).fretting
    for name, published in PUBLISHED.items():
        assert_allclose(report.values[name], published, atol=0.0051)
    # of the closed form to more digits
    assert_allclose(report.values["energy_ratio"], 0.2, rtol=1e-4)
    assert_allclose(report.values["sliding_ratio"], 2 ** (1 / 3) - 1, rtol=1e-3)
    assert_allclose(report.values["energy_friction_coefficient"], MU / 5, rtol=1e-4)


@mark.parametrize(
    "share, slide, regime",
    [
        (0.05, 0.0, "stick"),
        (0.5, 0.0, "partial slip"),
        (0.99, 0.0, "partial slip"),
        (1.0, 1e-3, "gross slip"),
    ],
)
def test_regimes(share, slide, regime):
    assert mindlin_loops(share, slide=slide).fretting.regime_text() == regime
    # a compliance in series lowers A and D, and leaves the regime of B
    soft = mindlin_loops(share, slide=slide, system=0.5 * CONTACT_COMPLIANCE).fretting
    assert regime == "stick" or soft.regime_text() == regime


def test_ratio_b_and_slip_amplitude_are_free_of_the_system():
    alone, soft = (mindlin_loops(1.0, slide=0.02, system=system).fretting for system in (0.0, 3.0))
    for name in (
        "slip_amplitude",
        "system_free_ratio",
        "slip_friction_coefficient",
        "load_amplitude",
    ):
        assert_allclose(soft.values[name], alone.values[name], rtol=1e-3)
    assert (soft.values["energy_ratio"] < 0.9 * alone.values["energy_ratio"]).all()


def test_compliance_is_split_into_contact_and_system():
    report = mindlin_loops(1.0, slide=0.02, system=1.75).fretting
    assert_allclose(report.values["contact_compliance"], CONTACT_COMPLIANCE, rtol=1e-6)
    assert_allclose(report.values["system_compliance"], 1.75, rtol=1e-6)
    assert (report.values["total_compliance"] > CONTACT_COMPLIANCE + 1.75).all()


def parallelograms(count=12, scatter=0.0, seed=1):
    """Loops of Coulomb friction of 10 N behind a spring of 5 N/µm, with a stroke of ±50 µm; load of 50 N."""
    random = np.random.default_rng(seed)
    u, t = [], []
    for _ in range(count):
        force = 10 * (1 + scatter * random.normal())
        elastic = 2 * force / 5
        u += [
            np.linspace(-50, -50 + elastic, 20, endpoint=False),
            np.linspace(-50 + elastic, 50, 40, endpoint=False),
        ]
        u += [
            np.linspace(50, 50 - elastic, 20, endpoint=False),
            np.linspace(50 - elastic, -50, 40, endpoint=False),
        ]
        t += [np.linspace(-force, force, 20, endpoint=False), np.full(40, force)]
        t += [np.linspace(force, -force, 20, endpoint=False), np.full(40, -force)]
    u, t = np.append(np.concatenate(u), -50) * 1e-6, np.append(np.concatenate(t), t[0][0])
    return loops_of_channels(
        np.arange(float(u.size)), u, t, np.full(u.size, 50.0), displacement_noise=0.0
    )


def test_quantities_of_a_parallelogram():
    expected = {
        "displacement_amplitude": 50e-6,
        "load_amplitude": 10,
        "slip_amplitude": 48e-6,
        "energy_friction_coefficient": 0.192,
        "slip_friction_coefficient": 0.2,
        "sliding_ratio": 0.96,
        "energy_ratio": 0.96,
        "system_free_ratio": 1,
        "total_compliance": 0.2e-6,
        "contact_compliance": 0,
        "system_compliance": 0.2e-6,
    }
    report = parallelograms(1).fretting
    assert expected.keys() == QUANTITIES.keys()
    for name, value in expected.items():
        assert_allclose(report.values[name], value, rtol=1e-9, atol=1e-15, err_msg=name)


def test_means_have_intervals_and_the_dataset_holds_all():
    loops = parallelograms(scatter=0.02)
    report = loops.fretting
    values = report.values["energy_friction_coefficient"]
    low, high = report.interval("energy_friction_coefficient")
    assert low < values.mean() < high
    # of independent loops it is near Student's
    assert (high - low) / 2 == approx(2.2 * values.std(ddof=1) / np.sqrt(values.size), rel=0.6)
    assert report.text("energy_friction_coefficient").endswith(f"(95 %: {low:.4g} to {high:.4g})")
    data = loops.to_dataset()
    for name, each in QUANTITIES.items():
        assert_allclose(data[name], report.values[name])
        assert data[name].attrs == {
            "long_name": each.label,
            "units": each.unit,
            "comment": each.definition,
        }
    assert data.regime.attrs["flag_meanings"].split()[1:] == ["stick", "partial_slip", "gross_slip"]
    assert (data.regime == 2).all()
    assert by_load(loops).rows()[1:3] == [
        ("displacement amplitude δ*", "", "", "", ""),
        (
            "  50 N",
            "12",
            "",
            "",
            by_load(loops).statistics("displacement_amplitude")[0].text("m", 12),
        ),
    ]


SCENARIO = """
[materials]
contact_modulus = "100 GPa"
shear_modulus = "40 GPa"
[surface]
kind = "sphere"
radius = "5 mm"
[friction]
coefficient = 0.3
[loading]
runs_by = "Cycle"
run = "each"
file = "log.csv"
[loading.columns]
normal_load = "N"
tangential_displacement = "u"
[loading.response]
tangential_load = "T"
"""


@fixture(scope="module")
def log(tmp_path_factory):
    """A fretting log with one stored cycle of 400 points at cycles 1, 10, 100; friction of 0.2, 0.3, 0.5 at 50 N."""
    folder = tmp_path_factory.mktemp("fretting")
    rows = ["Cycle,u,T,N"]
    for cycle, force in ((1, 10), (10, 15), (100, 25)):
        u, load = 50 * np.sin(np.arange(800) / 400 * 2 * np.pi), np.zeros(800)
        for sample in range(1, 800):
            load[sample] = np.clip(
                load[sample - 1] + 5 * (u[sample] - u[sample - 1]), -force, force
            )
        rows += [f"{cycle},{x:.6f}e-6,{y:.6f},50" for x, y in zip(u[400:], load[400:], strict=True)]
    (folder / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    (folder / "log.toml").write_text(SCENARIO, encoding="utf-8")
    return folder


def test_stored_cycles_are_evaluated_one_by_one(log):
    runs = each_run(hs.load(log / "log.toml"), hs.loops)
    report = fretting_of_runs(runs)
    assert report.number.tolist() == [1, 10, 100]
    slip = np.array([48, 47, 45])
    assert_allclose(report.values["slip_amplitude"], 1e-6 * slip, rtol=1e-3)
    assert_allclose(report.values["slip_friction_coefficient"], [0.2, 0.3, 0.5], rtol=1e-3)
    assert_allclose(
        report.values["energy_friction_coefficient"],
        np.array([0.2, 0.3, 0.5]) * slip / 50,
        rtol=2e-3,
    )
    # Student's t of three values, 4.303 standard errors
    low, high = report.interval("slip_amplitude")
    assert (high - low) / 2 == approx(4.3027 * slip.std(ddof=1) / np.sqrt(3) * 1e-6, rel=5e-3)
    heading, *rows, mean = fretting_rows(runs)
    assert heading[:4] == ("run", "loops", "regime", "displacement amplitude δ*")
    assert [row[:3] for row in rows] == [(str(cycle), "1", "gross slip") for cycle in (1, 10, 100)]
    assert mean[0] == "mean"


def test_the_command_prints_and_writes_the_report(log):
    def called(*arguments):
        return CliRunner().invoke(main, ["loops", str(log / "log.toml"), "--fretting", *arguments])

    written = called("-o", str(log / "log.nc"))
    assert written.exit_code == 0, written.output
    assert "energy friction coefficient μ_e" in written.output
    shown = CliRunner().invoke(main, ["show", str(log / "log.nc")])
    assert "slip_amplitude" in shown.output
    assert "μ_e" in called("--set", "loading.run=10").output
    # both tables, of runs and of one run, fit a wide terminal, and have every quantity
    for arguments in ((), ("--set", "loading.run=10")):
        table = called(*arguments).output.splitlines()
        table = table[
            next(n for n, line in enumerate(table) if re.match("run +loops|fretting +mean", line)) :
        ]
        assert max(map(len, table)) <= 120
        assert all(description.label in "\n".join(table) for description in QUANTITIES.values())
    # regimes are words in CSV
    assert called("-o", str(log / "report.csv")).exit_code == 0
    rows = list(csv.DictReader((log / "report.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["regime"] for row in rows] == ["gross_slip"] * 3
    refused = called("--levels", str(log / "levels.csv"))
    assert refused.exit_code != 0
    assert "does not apply to --fretting; expected -o FILE" in refused.output
