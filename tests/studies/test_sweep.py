"""Sweeps: contents, what is kept, and that nothing but the scenario decides what comes out."""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import dying
import numpy as np
import xarray as xr
from golden import refused
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, fixture, importorskip, mark
from swept import BALL, ROUGH, displacement

import historysim as hs
from historysim.results import analysis
from historysim.scenario.grid import build_grid
from historysim.studies import sweep as sweeping
from historysim.studies.cell import SUMMARIES

# -- what comes out --------------------------------------------------------------------------------


def test_a_ball_follows_hertz_and_mindlin_over_load_friction_and_radius(ball):
    load, friction, radius = (
        ["30 mN", "50 mN"],
        [0.1, 0.3],
        {"from": "1 mm", "to": "2 mm", "count": 3},
    )
    swept = {
        "loading.waypoints[2].normal_load": load,
        "friction.coefficient": friction,
        "surface.radius": radius,
    }
    found = hs.sweep(ball, swept)
    N, mu, R = np.meshgrid([30e-3, 50e-3], friction, [1e-3, 1.5e-3, 2e-3], indexing="ij")
    assert dict(found.sizes) == {
        "loading_waypoints_2_normal_load": 2,
        "friction_coefficient": 2,
        "surface_radius": 3,
    }
    assert_allclose(found.preliminary_displacement, displacement(50e-3, mu, R), rtol=1e-12)
    expected = displacement(50e-3, mu, R) - displacement(N, mu, R)
    assert_allclose(found.drift, expected, rtol=1e-9, atol=1e-20)
    # N2 < N1 at a fixed displacement: it takes 2 δ2, and should take 2 δ1
    assert_allclose(found.branch_drift, 2 * expected, rtol=1e-9, atol=1e-20)
    assert (found.surface_radius.values == [1e-3, 1.5e-3, 2e-3]).all()
    assert found.surface_radius.attrs == {
        "units": "m",
        "long_name": "surface.radius of the scenario",
    }
    assert found.loading_waypoints_2_normal_load.attrs["units"] == "N"
    assert found.preliminary_displacement.attrs["units"] == "m"


def test_each_cell_equals_a_run_of_its_scenario(rough):
    found = hs.sweep(rough, {"surface.seed": range(3), "friction.coefficient": [0.1, 0.2]})
    for seed in range(3):
        for friction in (0.1, 0.2):
            history = hs.run(
                hs.load(rough, {"surface.seed": seed, "friction.coefficient": friction})
            )
            cell = found.sel(surface_seed=seed, friction_coefficient=friction)
            peak = int(history.total_normal_load.values.argmax())
            assert cell.preliminary_displacement == analysis.preliminary_displacement(history)[peak]
            assert cell.critical_asperity == analysis.critical_asperity(history)[peak]
            assert cell.drift == analysis.drift(history, 0, -1)
            assert cell.peak_contact_count == history.contact_count.max()
            assert cell.peak_contact_area == history.real_contact_area.max()
            assert cell.peak_normal_load == history.total_normal_load.max()
            assert cell.peak_tangential_load == np.abs(history.total_tangential_load).max()
            assert cell.final_dissipated_energy == history.total_dissipated_energy[-1]
            depth = history.summit_height.max() - history.separation.min()
            assert cell.peak_approach == approx(depth.item(), rel=1e-9)


def test_rows_and_asperities_stand_under_their_own_numbers(rough):
    over = {"surface.seed": [1, 2], "loading.substeps": [2, 3]}
    found = hs.sweep(rough, over, outputs=["normal_load", "slip_state", "total_normal_load"])
    longest = 0
    for seed in (1, 2):
        for substeps in (2, 3):
            history = hs.run(hs.load(rough, {"surface.seed": seed, "loading.substeps": substeps}))
            cell = found.sel(surface_seed=seed, loading_substeps=substeps)
            own = cell.sel(asperity=history.asperity).isel(step=slice(history.sizes["step"]))
            for name in ("normal_load", "slip_state", "total_normal_load", "summit_height", "time"):
                assert_array_equal(own[name], history[name])
            others = np.setdiff1d(found.asperity, history.asperity)
            assert others.size > 0
            assert cell.sel(asperity=others).normal_load.isnull().all()
            assert cell.isel(step=slice(history.sizes["step"], None)).normal_load.isnull().all()
            longest = max(longest, history.sizes["step"])
    assert found.sizes["step"] == longest
    # values equal in all cells are stored once
    same = hs.sweep(rough, {"friction.coefficient": [0.1, 0.2]}, outputs=["total_normal_load"])
    assert (same.time.dims, same.total_normal_load.dims) == (
        ("step",),
        ("friction_coefficient", "step"),
    )


SUMMITS = BALL.replace(
    'kind = "sphere"\nradius = "2.5 mm"', 'kind = "summits"\nheight = [0, -3e-9]\nradius = "10 µm"'
)
SLIDING = SUMMITS.replace("5 nm", "90 nm").replace("50 mN", "2 mN").replace("70 mN", "3 mN")
FRICTION, WEAR = (
    "coefficient = 0.2\n",
    '[wear]\nlaw = "archard"\ncoefficient = 1e-3\nhardness = "12 GPa"\n',
)
SLID = 'law = "slid distance"\ndistance = [0, 3e-8]\ncoefficient = [0.3, 0.2]\n'
JKR = 'law = "shear strength"\nshear_strength = "300 MPa"\narea = "jkr"\nwork_of_adhesion = 0.05\n'
NEW_SUMMIT = (
    '    { time = 1.5, geometry = { summit_radius = "5 µm", asperities = [0] } },\n    { time = 2'
)
LAWS = [
    {"coefficient": 0.3},
    {"law": "power", "coefficient": 0.3, "reference_load": "1 mN", "exponent": -0.1},
    {"law": "shear strength", "shear_strength": "300 MPa"},
]
EVOLVING = {
    "wear": (SLIDING + WEAR, {"wear.coefficient": [0, 5e-3], "wear.hardness": ["12 GPa", "6 GPa"]}),
    "laws": (SLIDING, {"friction": LAWS}),
    "adhesion": (SLIDING.replace(FRICTION, JKR), {"friction.work_of_adhesion": [0, "50 mJ/m2"]}),
    "slid distance": (SLIDING.replace(FRICTION, SLID), {"friction.coefficient[1]": [0.1, 0.3]}),
    "geometry": (
        SLIDING.replace("    { time = 2", NEW_SUMMIT),
        {"loading.waypoints[2].geometry.summit_radius": ["5 µm", "20 µm"]},
    ),
}


@mark.parametrize("name", EVOLVING)
def test_evolving_cells_equal_runs_of_their_scenarios(ball, name):
    """Every number of every cell is that of a separate run, and what is swept changes some."""
    text, over = EVOLVING[name]
    ball.write_text(text, encoding="utf-8")
    # a ball alone has no nominal area
    outputs = tuple(name for name in SUMMARIES if name != "peak_nominal_pressure")
    found = hs.sweep(ball, over, outputs=outputs)
    assert "failure" not in found
    for index, point in enumerate(build_grid(over).points()):
        history = hs.run(hs.load(ball, point))
        where = np.unravel_index(index, tuple(found.sizes.values()))
        for output in outputs:
            expected = SUMMARIES[output].of(history)
            assert np.array_equal(found[output].values[where], expected, equal_nan=True), output
    for dim in found.sizes:
        assert any((found[output].diff(dim) != 0).any() for output in outputs)


def test_cells_whose_rows_go_over_something_else_are_left_out(ball):
    law = 'law = "power"\ncoefficient = 0.3\nreference_load = "1 mN"\nexponent = -0.1\n'
    ball.write_text(SLIDING.replace(FRICTION, law), encoding="utf-8")
    notices = []
    over = {"friction.load": ["own", "total"]}
    found = hs.sweep(ball, over, outputs=["present_friction", "drift"], notify=notices.append)
    why = "present_friction has the dimensions step, and in cells before step and asperity; sweep them separately"
    assert notices == [f"cell 1 (friction.load = total) failed: {why}"]
    assert found.drift.isnull().values.tolist() == [False, True]
    assert found.present_friction.dims == ("friction_load", "step", "asperity")
    with refused(
        r"slid_distance: is not in the history of this scenario; expected record\.sliding = true"
    ):
        hs.sweep(ball, {"friction.exponent": [0]}, outputs=["slid_distance"])


def test_a_scenario_defines_its_sweep(ball):
    sweep = (
        '[sweep]\noutputs = ["preliminary_displacement"]\ntogether = [["materials.first", "friction.coefficient"]]\n'
        '[sweep.over]\nmaterials.first = ["silicon", "silica"]\nfriction.coefficient = [0.1, 0.2]\n'
        'surface.radius = ["1 mm", "2 mm"]\n'
    )
    ball.write_text(BALL + sweep, encoding="utf-8")
    found = hs.sweep(ball)
    assert dict(found.sizes) == {"materials_first": 2, "surface_radius": 2}
    assert list(found.data_vars) == ["preliminary_displacement"]
    assert found.materials_first.values.tolist() == ["silicon", "silica"]
    assert found.friction_coefficient.dims == ("materials_first",)
    alone = hs.sweep(
        ball,
        {"materials.first": ["silica"], "friction.coefficient": [0.2], "surface.radius": ["2 mm"]},
    )
    assert alone.preliminary_displacement.item() == found.preliminary_displacement[1, 1]
    notices = []
    hs.run(ball, notify=notices.append)
    assert notices == ["ball.toml: ignoring [sweep]; use `historysim sweep` to run it"]


def test_a_sweep_is_written_and_read_again(ball, tmp_path):
    over = {"friction.coefficient": [0.1, -0.2], "materials.first": ["silicon", "silica"]}
    found = hs.sweep(ball, over, outputs=["preliminary_displacement", "slip_state"])
    found.to_netcdf(tmp_path / "sweep.nc")
    with xr.open_dataset(tmp_path / "sweep.nc", decode_times=False) as read:
        xr.testing.assert_identical(read.load().astype(found.dtypes), found)
    lines = dict(hs.show(tmp_path / "sweep.nc"))
    assert lines["cells"] == "4"
    assert lines["friction.coefficient of the scenario"] == "-0.2 to 0.1"
    assert lines["materials.first of the scenario"] == "silicon, silica"
    assert lines["failed"].startswith(
        "2 cells; the first: ball.toml: friction.coefficient: -0.2; expected 0 or more"
    )


# -- what fails ------------------------------------------------------------------------------------


def test_a_cell_that_fails_says_why_and_the_others_stay(ball):
    notices = []
    # a load that friction does not hold, and a coefficient that is none
    ball.write_text(
        BALL.replace('tangential_displacement = "5 nm"', 'tangential_load = "8 mN"'),
        encoding="utf-8",
    )
    found = hs.sweep(ball, {"friction.coefficient": [0.1, -0.2, 0.2]}, notify=notices.append)
    assert found.preliminary_displacement.isnull().values.tolist() == [True, True, False]
    assert found.preliminary_displacement[2] == approx(displacement(70e-3, 0.2, 2.5e-3), rel=1e-12)
    assert "beyond the friction limit" in str(found.failure[0].values)
    assert "friction.coefficient: -0.2; expected 0 or more" in str(found.failure[1].values)
    assert found.failure[2] == ""
    assert len(notices) == 2
    assert notices[0].startswith("cell 0 (friction.coefficient = 0.1) failed: ")


def test_invalid_sweeps_are_refused_before_anything_is_computed(ball, tmp_path):
    for over, message in (
        (None, r"ball.toml: has no \[sweep\]"),
        (
            {"friction.coefficent": [0.1]},
            "ball.toml: friction.coefficent: unknown key; did you mean 'coefficient'",
        ),
        ({"friction.coefficient": []}, "sweep.over.friction.coefficient: no values"),
    ):
        with refused(message):
            hs.sweep(ball, over, store=tmp_path / "cells")
    one = {"friction.coefficient": [0.1]}
    with refused(r"sweep.outputs\[0\]: 'drfit'; did you mean 'drift'"):
        hs.sweep(ball, one, outputs=["drfit"])
    with refused(r"ball.toml: friction.coefficient: -0\.1; expected 0 or more"):
        hs.sweep(ball, {"friction.coefficient": [-0.1]})
    assert not (tmp_path / "cells").exists()


def test_an_output_that_the_scenario_has_not(ball):
    found = hs.sweep(ball, {"record.asperities": ["all", "totals"]}, outputs=["slip_state"])
    assert '"totals"; expected others' in str(found.failure[1].values)
    with refused("drive_displacement: is not in the history of this scenario"):
        hs.sweep(ball, {"friction.coefficient": [0.1]}, outputs=["drive_displacement"])


# -- what is kept ----------------------------------------------------------------------------------


@fixture
def counted(monkeypatch):
    """Count the cells that are computed."""
    points, cell = [], sweeping.cell

    def counting(scenario, point, outputs):
        points.append(point)
        return cell(scenario, point, outputs)

    monkeypatch.setattr(sweeping, "cell", counting)
    return points


OVER = {"surface.seed": range(4), "friction.coefficient": [0.1, 0.2]}


def test_stored_cells_are_not_recomputed(rough, tmp_path, counted):
    first = hs.sweep(rough, OVER, store=tmp_path / "cells")
    assert len(counted) == 8
    assert first.identical(hs.sweep(rough, OVER, store=tmp_path / "cells"))
    assert len(counted) == 8
    # a larger sweep uses the existing cells, and a comment or a title changes no number
    rough.write_text("# rough\n" + ROUGH.replace("a ball", "another"), encoding="utf-8")
    hs.sweep(rough, OVER | {"surface.seed": range(5)}, store=tmp_path / "cells")
    assert counted[8:] == [
        {"surface.seed": 4, "friction.coefficient": value} for value in (0.1, 0.2)
    ]
    # another load, or another output, changes all
    hs.sweep(
        hs.load(rough, {"loading.waypoints[0].normal_load": "40 mN"}),
        OVER,
        store=tmp_path / "cells",
    )
    hs.sweep(rough, OVER, outputs=["drift"], store=tmp_path / "cells")
    assert len(counted) == 26


def test_a_file_that_the_scenario_reads_counts(tmp_path, counted):
    (tmp_path / "summits.csv").write_text("height,radius\n0,1e-6\n-1e-9,2e-6\n", encoding="utf-8")
    table = 'kind = "summits"\nfile = "summits.csv"\n[surface.columns]\nheight = "height"\nradius = "radius"'
    path = tmp_path / "summits.toml"
    path.write_text(BALL.replace('kind = "sphere"\nradius = "2.5 mm"', table), encoding="utf-8")
    over = {"friction.coefficient": [0.1, 0.2]}
    first = hs.sweep(path, over, store=tmp_path / "cells")
    hs.sweep(path, over, store=tmp_path / "cells")
    assert len(counted) == 2
    (tmp_path / "summits.csv").write_text("height,radius\n0,1e-6\n-1e-9,2.5e-6\n", encoding="utf-8")
    second = hs.sweep(path, over, store=tmp_path / "cells")
    assert len(counted) == 4
    assert (first.preliminary_displacement != second.preliminary_displacement).all()
    # the file itself may be swept
    (tmp_path / "others.csv").write_text("height,radius\n0,1e-6\n-1e-9,3e-6\n", encoding="utf-8")
    files = {"surface.file": ["summits.csv", "others.csv"]}
    hs.sweep(path, files, store=tmp_path / "cells")
    (tmp_path / "others.csv").write_text("height,radius\n0,1e-6\n-1e-9,4e-6\n", encoding="utf-8")
    found = hs.sweep(path, files, store=tmp_path / "cells")
    # with the first one it is an existing cell: friction is 0.2 in the scenario
    assert counted[4:] == [{"surface.file": "others.csv"}] * 2
    assert found.preliminary_displacement[0] != found.preliminary_displacement[1]


def test_a_damaged_cell_is_computed_again_and_leftovers_go(rough, tmp_path, counted):
    first = hs.sweep(rough, OVER, store=tmp_path / "cells")
    cells = sorted((tmp_path / "cells").glob("*.cell"))
    content = cells[0].read_bytes()
    cells[0].write_bytes(content[: len(content) // 2])
    cells[1].write_bytes(b"")
    middle = len(content) // 2
    cells[2].write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    (tmp_path / "cells" / f".{cells[3].name}.0a1b2c3d-1-0123456789abcdef.part").write_bytes(
        content[:100]
    )
    others = tmp_path / "cells" / ".letters.cell.mine.part"
    others.write_text("of somebody else", encoding="utf-8")
    # an archive with valid checksums and other content, and the cell of another point
    np.savez(
        tmp_path / "foreign.npz",
        header=np.frombuffer(b'{"form": 3, "coords": [], "data_vars": 1}', np.uint8),
    )
    cells[4].write_bytes((tmp_path / "foreign.npz").read_bytes())
    cells[5].write_bytes(cells[6].read_bytes())
    notices = []
    assert first.identical(hs.sweep(rough, OVER, store=tmp_path / "cells", notify=notices.append))
    assert len(counted) == 8 + 5
    assert {notice.split(":")[0] for notice in notices if "is damaged, ignored" in notice} <= {
        *map(str, cells[:6])
    }
    assert len(notices) == 5
    assert sorted((tmp_path / "cells").iterdir()) == [others, *cells, tmp_path / "cells" / "lock"]


HOLDS = """
import sys, time
from pathlib import Path
from historysim.studies.store import Store
with Store(Path(sys.argv[1])).claim(sys.argv[2], wait=False):
    print("holds", flush=True)
    sys.stdin.read()
"""


def test_a_cell_that_another_process_computes_is_left_to_the_end(rough, tmp_path, counted):
    store = tmp_path / "cells"
    first = hs.sweep(rough, OVER, store=store)
    scenario = hs.load(rough)
    name = sweeping.digest(
        scenario, {"surface.seed": 0, "friction.coefficient": 0.1}, sweeping.chosen_outputs(())
    )
    for path in store.glob("*.cell"):
        path.unlink()
    counted.clear()
    command = [sys.executable, "-c", HOLDS, store, name]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        other.stdout.readline()
        taken = []
        with ThreadPoolExecutor(1) as threads:
            running = threads.submit(hs.sweep, rough, OVER, store=store)
            while len(taken) < 7 and not running.done():
                taken = list(store.glob("*.cell"))
                time.sleep(0.01)
            assert not (store / f"{name}.cell").exists()
            other.stdin.close()
            assert first.identical(running.result())
    assert len(counted) == 8
    assert counted[-1] == {"surface.seed": 0, "friction.coefficient": 0.1}


# -- who computes ----------------------------------------------------------------------------------


@mark.ci
def test_any_executor_gives_the_same_bits(rough, tmp_path):
    here = hs.sweep(rough, OVER)
    with ThreadPoolExecutor(3) as threads:
        assert here.identical(hs.sweep(rough, OVER, executor=threads, store=tmp_path / "cells"))
        assert threads.submit(int, "1").result() == 1
    assert here.identical(hs.sweep(rough, OVER, workers=2, store=tmp_path / "others"))


@mark.slow
def test_a_cell_that_ends_its_process_does_not_sink_the_others(rough, monkeypatch):
    here = hs.sweep(rough, OVER)
    monkeypatch.setattr(sweeping, "compute_batch", dying.computed_unless_3)
    found = hs.sweep(rough, OVER, workers=2)
    assert (found.failure == sweeping.KILLED).sum() == 2
    assert (found.failure.sel(surface_seed=3) == sweeping.KILLED).all()
    alive = {"surface_seed": slice(0, 3)}
    assert found.drop_vars("failure").isel(alive).equals(here.isel(alive))


def test_dask_computes_a_sweep(rough):
    distributed = importorskip("distributed")
    options = {
        "processes": False,
        "dashboard_address": None,
        "n_workers": 1,
        "threads_per_worker": 1,
    }
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        assert hs.sweep(rough, OVER, executor=client).identical(hs.sweep(rough, OVER))


def test_numbers_of_all_summits_and_of_the_nominal_area(rough):
    outputs = [
        "mean_summit_radius",
        "summit_height_deviation",
        "summit_count",
        "peak_nominal_pressure",
    ]
    outputs.append("initial_stiffness")
    found = hs.sweep(rough, {"surface.seed": [1, 2]}, outputs=outputs)
    for row, seed in enumerate((1, 2)):
        ground = hs.load(rough, {"surface.seed": seed}).surface()
        assert float(found.mean_summit_radius[row]) == approx(
            ground.summits.radius.mean(), rel=1e-12
        )
        assert float(found.summit_height_deviation[row]) == approx(
            ground.summits.height.std(ddof=1), rel=1e-12
        )
        assert int(found.summit_count[row]) == len(ground.summits)
        history = hs.run(hs.load(rough, {"surface.seed": seed}))
        load = float(history.total_normal_load.max())
        assert float(found.peak_nominal_pressure[row]) == approx(
            load / ground.surface.nominal_area, rel=1e-12
        )
        peak = history.isel(step=int(history.total_normal_load.values.argmax()))
        area = 8 * history.attrs["shear_modulus"] * float(peak.contact_radius.sum())
        assert float(found.initial_stiffness[row]) == approx(area, rel=1e-9)
    # rows of those that touch say nothing of the others
    both = hs.sweep(rough, {"surface.seed": [1, 2]}, outputs=["summit_count", "total_normal_load"])
    assert "failure" not in both
    with refused("summit_count: not all summits are recorded together with rows of each asperity"):
        hs.sweep(rough, {"surface.seed": [1, 2]}, outputs=["summit_count", "normal_load"])
