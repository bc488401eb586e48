"""The command that asks a result: the tables that it writes, and what it refuses."""

import csv
import shutil

import numpy as np
import xarray as xr
from click.testing import CliRunner
from pairs import COMPLIANT as PAIR
from pytest import fixture, mark

import historysim as hs
from historysim.cli import main
from historysim.recording.provenance import named_states_attribute
from historysim.results.queries import all_queries

EVENTS = [hs.NormalLoad(0.0, 4e-3)]
EVENTS += [hs.TangentialDisplacement(float(time), (-1) ** time * 30e-9) for time in (1, 2, 3)]


@fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("made") / "r.nc"
    hs.Replay(hs.Ensemble(PAIR, [0.0, -20e-9], [10e-6, 30e-6], 0.2), EVENTS, substeps=4).write(path)
    return path


@fixture
def history(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(made, "r.nc")
    with xr.open_dataset("r.nc", decode_times=False) as history:
        yield history


def call(*arguments):
    return CliRunner().invoke(main, ["table", *arguments])


def read(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


# an asperity is no table, and `state --asperity` shows it; maps are those of a surface with
# interaction, see tests/results/plots/test_contact_map.py; cycles need events; slopes are of
# inclined asperities, pull-off of those that attract; and a load curve needs the contact itself,
# see test_load_curve.py
OTHERS = {"asperity", "cycles", "load_curve", "point_maps", "pull_off", "slope_load"}
TABLES = [name.replace("_", "-") for name in all_queries() if name not in OTHERS]
NEEDED = {
    **{
        question: ["--asperity", "0", "--step", "6"] for question in ("profiles", "reversal-points")
    },
    **{
        question: ["--with", "first=5", "--with", "second=9"]
        for question in ("branch-drift", "drift")
    },
    "positioning-error": ["--with", "start=4", "--with", "end=12"],
    "nominal-pressure": ["--with", "nominal_area=1e-9"],
    "run-drift": ["--with", "second=r.nc"],
    "peak-stress": ["--with", "poissons_ratio=0.3"],
}


def test_every_query_writes_a_table(history, tmp_path):
    listed = call("--help").output
    for question in TABLES:
        assert f"  {question} " in listed
        done = call("r.nc", question, *NEEDED.get(question, []))
        assert (done.exit_code, done.output) == (0, f"r_{question}.csv\n"), question
        header, *rows = read(tmp_path / f"r_{question}.csv")
        assert all(len(row) == len(header) for row in rows)
    header, *rows = read(tmp_path / "r_drift.csv")
    assert (header, float(rows[0][0])) == (["drift [m]"], history.contact.drift(5, 9))
    header, *rows = read(tmp_path / "r_slides-first.csv")
    assert header == ["rank", "asperity"]
    assert [int(row[1]) for row in rows] == list(history.contact.slides_first())
    header, *rows = read(tmp_path / "r_stick-ratio.csv")
    assert header == ["time [s]", "stick_ratio 0", "stick_ratio 1"]
    assert (
        np.array(rows, dtype=float)[:, 1:].tolist() == history.contact.stick_ratio().values.tolist()
    )
    header, *rows = read(tmp_path / "r_profiles.csv")
    column = header.index("traction [Pa]")
    expected = history.contact.profiles(0, 6)["traction"].values[0]
    assert [float(row[column]) for row in rows] == expected.tolist()


def test_a_table_can_be_netcdf(history):
    assert call("r.nc", "slip-shares", "-o", "s.nc").exit_code == 0
    with xr.open_dataset("s.nc", decode_times=False) as found:
        xr.testing.assert_allclose(found, history.contact.slip_shares())


def test_a_step_is_given_by_the_name_of_its_state(history, tmp_path):
    named = history.load().assign_attrs(named_states_attribute({"held": 2.0}))
    named.to_netcdf(tmp_path / "named.nc")
    for step in ("held", "8"):
        done = call("named.nc", "profiles", "--asperity", "0", "--step", step, "-o", f"{step}.csv")
        assert done.exit_code == 0, done.output
    assert read(tmp_path / "held.csv") == read(tmp_path / "8.csv")
    done = call("named.nc", "profiles", "--asperity", "0", "--step", "hold", "-o", "p.csv")
    assert done.exit_code == 2
    assert (
        "step 'hold' is not a named state of the history; expected held, or a number" in done.output
    )
    done = call("named.nc", "drift", "--with", "first=0", "--with", "second=held")
    assert done.exit_code == 0, done.output


@mark.usefixtures("history")
def test_an_earlier_name_of_a_query_writes_its_table():
    done = call("r.nc", "first-slips")
    assert (done.exit_code, done.output) == (0, "r_slip-onset.csv\n")
