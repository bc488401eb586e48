"""Logs from anywhere: nothing in them is carried out, and what was forged is told as such."""

import json
import shutil
import sqlite3

import h5py
import hostile
import numpy as np
from golden import refused
from pytest import fixture, mark

import historysim as hs
from historysim.log import canonical
from historysim.log.verification import verify
from historysim.recording import surface_group


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "s.toml").write_text(hostile.SCENARIO, encoding="utf-8")
    hs.run(folder / "s.toml", folder / "a.nc").close()
    return folder


@fixture
def folder(made, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path


@mark.parametrize("forgery", hostile.FORGERIES)
def test_a_forged_log_is_reported_and_never_appended_to(folder, forgery):
    log = folder / "a.history"
    hostile.forged_log(log, hostile.FORGERIES[forgery])
    before = log.read_bytes()
    with refused(r"a\.history"), hs.EventLog(log) as opened:
        opened.append(hs.NormalLoad(10.0, 0.01))
    assert log.read_bytes() == before
    with refused(r"a\.history"):
        verify(log)


def test_a_trigger_that_is_planted_while_the_log_is_open_is_seen(folder):
    log = folder / "a.history"
    with hs.EventLog(log) as opened:
        len(opened)
        hostile.forged_log(
            log, "CREATE TRIGGER t AFTER INSERT ON batch BEGIN DELETE FROM snapshot; END"
        )
        with refused("holds trigger t"):
            opened.append(hs.NormalLoad(10.0, 0.01))


@mark.parametrize("name", hostile.FORGED_HEADS)
def test_a_forged_head_whose_digests_agree_is_reported(folder, name):
    log = folder / "a.history"
    hostile.forged_head(log, {name: hostile.FORGED_HEADS[name]})
    with refused(r"a\.history: "):
        hs.EventLog(log)


def test_digests_that_agree_alone_do_not_make_a_log_bad(folder):
    log = folder / "a.history"
    hostile.forged_head(log, {"title": "Another"})
    with hs.EventLog(log) as opened:
        assert opened.settings["title"] == "Another"
        assert len(opened) == 5


@mark.parametrize(
    "column, values, told",
    [
        ("value", [np.nan] * 5, "infinite, or none"),
        ("time", [0, 1, 2, 3, np.inf], "infinite, or none"),
        ("time", [0, 2, 1, 3, 4], "times that fall"),
    ],
)
def test_events_that_nobody_could_append_are_reported(folder, column, values, told):
    log = folder / "a.history"
    connection = sqlite3.connect(log)
    for table in ("batch", "chain"):
        connection.execute(f"DROP TRIGGER no_update_of_{table}")
    statement = {"value": "UPDATE batch SET value = ?", "time": "UPDATE batch SET time = ?"}[column]
    connection.execute(statement, (np.array(values, dtype="<f8").tobytes(),))
    (head,) = connection.execute("SELECT link FROM chain WHERE number = 0").fetchone()
    (batch,) = connection.execute("SELECT kind, time, value, coefficients FROM batch").fetchall()
    link = canonical.link(head, 0, canonical.Columns(*batch))
    connection.execute("UPDATE chain SET link = ? WHERE number = 1", (link,))
    connection.commit()
    connection.close()
    with hs.EventLog(log) as opened, refused(told):
        opened.events()


def test_steps_beyond_the_limit_are_refused_before_anything_is_made(folder, monkeypatch):
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", "7")
    with refused(r"10 steps; expected 7 at most .*HISTORYSIM_MOST_STEPS raises it"):
        hs.run(folder / "a.history", folder / "b.nc")
    assert not (folder / "b.nc").exists()


def test_no_result_is_what_its_log_gives_whose_own_log_was_changed(folder):
    assert verify(folder / "a.nc")
    with h5py.File(folder / "a.nc", "r+") as file:
        group = file.get(f"{surface_group.GROUP}/log") or file["log"]
        settings = json.loads(group.attrs["settings"]) | {"title": "Another"}
        group.attrs["settings"] = json.dumps(settings, sort_keys=True)
    with refused("does not match its digest"):
        verify(folder / "a.nc")


def test_what_is_written_may_be_longer_than_the_file_that_is_there(tmp_path):
    count = 300_000
    pair = hs.MaterialPair.from_moduli(contact_modulus=1e10, shear_modulus=2.5e9)
    heights = np.linspace(-1e-3, 0.0, count)
    ensemble = hs.Ensemble(pair, summit_height=heights, summit_radius=1e-3, friction=0.5)
    with hs.EventLog.create(tmp_path / "a.history", ensemble, [hs.NormalLoad(0.0, 0.01)]) as log:
        log.append(hs.FrictionChange(1.0, tuple([0.5] * count)))
    with hs.EventLog(tmp_path / "a.history") as log:
        assert len(log) == 2
        assert len(log.ensemble) == count
