"""Recovery of runs after crashes, faults and swapped files."""

import os
import re
import shutil
from pathlib import Path

import h5py
import netCDF4
from golden import refused
from kill_runs import EVERY, kill_runs
from preloaded import POSSIBLE, REASON, run_script
from promises import LONG, last_snapshot, variables
from pytest import approx, fixture, mark, param, raises, skip

import historysim as hs
from historysim.log import result as result_writer
from historysim.log.file import LogFile
from historysim.log.result import add_snapshot, snapshots
from historysim.recording.netcdf import FileRecorder

TESTS = Path(__file__).parents[1]


@fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    (folder / "killed.toml").write_text(LONG, encoding="utf-8")
    hs.run(folder / "killed.toml", folder / "killed.nc", snapshot_every=EVERY).close()
    return folder


@fixture
def folder(whole, tmp_path):
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    return tmp_path


class Ended(BaseException):
    """The process ends here."""


def interrupted(folder, monkeypatch, after=5):
    """A run that ends in the midst: its log and rows stay, its result does not come."""
    for name in ("killed.nc", "killed.history"):
        (folder / name).unlink(missing_ok=True)
    written = []
    original = result_writer.add_snapshot

    def add(file, content, cursor, *rest):
        original(file, content, cursor, *rest)
        written.append(cursor.rows)
        if len(written) == after:
            raise Ended

    monkeypatch.setattr(result_writer, "add_snapshot", add)
    with raises(Ended):
        hs.run(folder / "killed.toml", folder / "killed.nc", snapshot_every=EVERY)
    monkeypatch.undo()
    return folder / "killed.toml", folder / "killed.nc", written


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# -- killed ----------------------------------------------------------------------------------------


@mark.skipif(not hasattr(os, "fork"), reason="kills forked processes")
def test_killed_runs_appends_and_forks_lose_nothing(tmp_path):
    assert sum(kill_runs(1, tmp_path, seed=1).values()) >= 1


def test_a_resume_computes_only_rows_after_the_last_snapshot(folder, whole, monkeypatch):
    scenario, output, written = interrupted(folder, monkeypatch)
    assert names(folder) == [".killed.nc.unfinished", "killed.history", "killed.toml"]
    assert last_snapshot(output.with_suffix(".history")) == written[-1]
    walked = []
    original = FileRecorder.record
    monkeypatch.setattr(
        FileRecorder,
        "record",
        lambda self, times: (walked.append(times.size), original(self, times))[1],
    )
    told = []
    hs.run(scenario, output, resume=True, snapshot_every=EVERY, notify=told.append).close()
    assert variables(output) == variables(whole / "killed.nc")
    with netCDF4.Dataset(output) as result:
        steps = len(result.dimensions["step"])
    assert sum(walked) == steps - written[-1]
    assert f"after {written[-1]:,} rows" in told[0]
    assert names(folder) == ["killed.history", "killed.nc", "killed.toml"]


def kept_rows(folder, whole, written):
    """The bytes of an unfinished file, and where a row between the second snapshot and the third is in them."""
    content = bytearray((folder / ".killed.nc.unfinished").read_bytes())
    with netCDF4.Dataset(whole / "killed.nc") as file:
        row = file["time"][written[1] + 3].tobytes()
    assert content.count(row) == 1
    return content, content.index(row)


@mark.parametrize(
    "harm",
    [
        "cut",
        "of another log",
        *(param(harm, marks=mark.slow) for harm in ("left open", "no netCDF", "of another run")),
    ],
)
def test_rows_that_do_not_belong_to_a_snapshot_are_recomputed(folder, whole, monkeypatch, harm):
    scenario, output, written = interrupted(folder, monkeypatch)
    unfinished = folder / ".killed.nc.unfinished"
    content, at = kept_rows(folder, whole, written)
    if harm.startswith(("of another", "left")):
        name = "date_created" if harm == "of another run" else "log_digest"
        with netCDF4.Dataset(unfinished, "a") as file:
            file.setncattr(name, b"x" + file.getncattr(name).encode()[1:])
        # as HDF5 leaves some damaged files that it fails to open
        left = netCDF4.Dataset(unfinished) if harm == "left open" else None
    else:
        unfinished.write_bytes({"cut": content[:at], "no netCDF": bytes(len(content))}[harm])
    told = []
    hs.run(scenario, output, resume=True, snapshot_every=EVERY, notify=told.append).close()
    assert "has no snapshot with its rows; the replay starts at the beginning" in told[0]
    assert variables(output) == variables(whole / "killed.nc")
    assert names(folder) == ["killed.history", "killed.nc", "killed.toml"]
    if harm == "left open":
        left.close()


def test_a_resume_of_another_result_of_the_same_log_does_not_take_its_snapshots(
    folder, whole, monkeypatch
):
    """Whose rows may be fewer: each of them says in which file its rows are."""
    scenario, output, _ = interrupted(folder, monkeypatch, after=2)
    (folder / ".killed.nc.unfinished").rename(folder / ".other.nc.unfinished")
    hs.run(
        output.with_suffix(".history"), folder / "other.nc", resume=True, snapshot_every=EVERY
    ).close()
    assert variables(folder / "other.nc") == variables(whole / "killed.nc")
    hs.run(scenario, output, resume=True, snapshot_every=EVERY).close()
    assert variables(output) == variables(whole / "killed.nc")


def test_a_resume_without_a_log_is_a_run(folder, whole):
    (folder / "killed.history").unlink()
    told = []
    hs.run(folder / "killed.toml", folder / "killed.nc", resume=True, notify=told.append).close()
    assert "there is no log to resume from" in told[0]
    assert variables(folder / "killed.nc") == variables(whole / "killed.nc")


# -- faults ----------------------------------------------------------------------------------------


def faulty(tmp_path, stride):
    if not POSSIBLE:
        skip(REASON)
    printed = run_script(TESTS / "scripts" / "fault_runs.py", tmp_path, stride)
    found = re.search(
        r"(\d+) calls; (\d+) runs went through, (\d+) ended with a message, (\d+) in a crash",
        printed,
    )
    assert found, printed[-2000:]
    return [int(number) for number in found.groups()]


@mark.slow
def test_a_failed_write_sync_or_rename_is_reported_and_resumed(tmp_path):
    calls, _, told, _ = faulty(tmp_path, 97)
    assert calls > 40
    assert told > 2


def test_a_full_disk_is_reported_and_the_run_resumes_later(folder, whole, monkeypatch):
    scenario, output, written = interrupted(folder, monkeypatch)
    monkeypatch.setattr(
        shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10**9, 10**9, -(10**6))
    )
    with raises(
        OSError, match=r"the disk is full: the result needs .* then continue with --resume"
    ):
        hs.run(scenario, output, resume=True, snapshot_every=EVERY)
    monkeypatch.undo()
    assert not output.exists()
    told = []
    hs.run(scenario, output, resume=True, snapshot_every=EVERY, notify=told.append).close()
    assert f"after {written[-1]:,} rows" in told[0]
    assert variables(output) == variables(whole / "killed.nc")


# -- mixed up --------------------------------------------------------------------------------------


def test_an_edited_scenario_is_not_resumed(folder):
    scenario = folder / "killed.toml"
    scenario.write_text(
        scenario.read_text(encoding="utf-8").replace("0.012", "0.013"), encoding="utf-8"
    )
    before = (folder / "killed.nc").read_bytes(), (folder / "killed.history").read_bytes()
    with refused(r"is not the scenario that .*killed\.history was made from"):
        hs.run(scenario, folder / "killed.nc", resume=True)
    assert ((folder / "killed.nc").read_bytes(), (folder / "killed.history").read_bytes()) == before


def test_the_log_alone_makes_the_result_again(folder, whole):
    (folder / "killed.toml").unlink()
    hs.run(folder / "killed.history", folder / "again.nc").close()
    assert variables(folder / "again.nc") == variables(whole / "killed.nc")
    with (
        netCDF4.Dataset(folder / "again.nc") as again,
        netCDF4.Dataset(whole / "killed.nc") as first,
    ):
        assert again.groups["surface"].variables.keys() == first.groups["surface"].variables.keys()
        assert again.scenario == first.scenario
    history = hs.run(folder / "killed.history")
    assert (
        history.total_normal_load.values.tobytes()
        == variables(whole / "killed.nc")["total_normal_load"]
    )


def test_a_second_run_of_one_result_is_refused(folder):
    for resume in (False, True):
        busy = raises(OSError, match="another process is writing it")
        with LogFile(folder / "killed.history", write=True), busy:
            hs.run(folder / "killed.toml", folder / "killed.nc", resume=resume)


# -- verified --------------------------------------------------------------------------------------


def test_a_result_equals_the_replay_of_its_log(folder):
    assert hs.verify(folder / "killed.nc").differences == ()
    found = hs.verify(folder / "killed.history")
    assert found
    assert found.events > 100
    assert found.snapshots > 5


def test_a_changed_value_is_named(folder):
    with netCDF4.Dataset(folder / "killed.nc", "a") as result:
        result["stick_radius"][7, 1] += 1e-9
        result["saturated"][3] = 1
    found = {
        difference.name: difference for difference in hs.verify(folder / "killed.nc").differences
    }
    assert set(found) == {"stick_radius", "saturated"}
    assert found["stick_radius"].count == 1
    assert found["stick_radius"].first.startswith("step 7, asperity 1 (")
    assert found["stick_radius"].largest == approx(1e-9, rel=1e-5)
    assert "saturated: 1 values differ, first at step 3" in found["saturated"].text


def test_a_swapped_result_is_refused(folder):
    other = folder / "other.toml"
    other.write_text(
        (folder / "killed.toml").read_text(encoding="utf-8").replace("repeat = 20", "repeat = 2"),
        encoding="utf-8",
    )
    hs.run(other, folder / "other.nc").close()
    (folder / "other.nc").replace(folder / "killed.nc")
    with refused("holds another scenario than"):
        hs.verify(folder / "killed.nc")
    with netCDF4.Dataset(folder / "killed.nc", "a") as result:
        result.scenario = (folder / "killed.toml").read_text(encoding="utf-8")
    with refused(r"is not the result of .*one of the two was swapped"):
        hs.verify(folder / "killed.nc")


def test_a_result_is_verified_after_its_log_has_grown(folder):
    with hs.EventLog(folder / "killed.history") as log:
        log.append(hs.NormalLoad(1e6, 0.01))
    assert hs.verify(folder / "killed.nc").differences == ()


def test_a_snapshot_that_differs_from_the_replay_is_reported(folder):
    with LogFile(folder / "killed.history", write=True) as file:
        content = file.sound()
        add_snapshot(
            file, content, next(snapshots(file, content)).cursor, file.head.ensemble.initial_state()
        )
    told = []
    hs.verify(folder / "killed.history", notify=told.append)
    assert any("differs from the replay" in line for line in told)


def flipped(path, within):
    """Change a bit of a file in the midst of these bytes of it."""
    content = bytearray(path.read_bytes())
    content[content.index(within) + len(within) // 2] ^= 1
    path.write_bytes(content)


def test_a_damaged_chunk_of_a_compressed_result_is_reported(folder):
    hs.run(folder / "killed.toml", folder / "killed.nc", compression="zlib").close()
    with h5py.File(folder / "killed.nc") as file:
        _, chunk = file["stick_radius"].id.read_direct_chunk((0, 0))
    flipped(folder / "killed.nc", chunk)
    with refused(r"killed\.nc: is damaged \(NetCDF: "):
        hs.verify(folder / "killed.nc")
