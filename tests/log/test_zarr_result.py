"""Results in zarr stores, written by threads and by a cluster of which a worker is killed, against netCDF results."""

import os
import shutil
import signal
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import numpy as np
import xarray as xr
from click.testing import CliRunner
from golden import refused
from pytest import fixture, importorskip, mark, raises
from rough_scenario import SCENARIO

import historysim as hs
from historysim.cli import main
from historysim.log import lazy_history, zarr_result

pytestmark = mark.ci

importorskip("zarr")
importorskip("dask.array")

ONCE = {"date_created"}


@fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(lazy_history, "CHUNK_CELLS", 300)
    monkeypatch.setattr(lazy_history, "CHUNK_ASPERITIES", 20)
    path = tmp_path / "rough.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def assert_same(found, expected):
    """Assert that all bits and metadata are the same, but for when they were made."""
    found, expected = found.load().drop_indexes("time", errors="ignore"), expected.load()
    for each in (found, expected):
        each.attrs = {name: value for name, value in each.attrs.items() if name not in ONCE}
        for variable in each.variables.values():
            variable.attrs.pop("coordinates", None)
    xr.testing.assert_identical(found, expected)
    for name, values in expected.variables.items():
        assert found[name].values.tobytes() == values.values.tobytes()
        assert found[name].dtype == values.dtype


def test_a_run_to_a_store_is_that_to_a_file(scenario, tmp_path, monkeypatch):
    done = []
    monkeypatch.setattr(zarr_result, "progress_bar", lambda *_, **__: nullcontext(done.append))
    hs.run(scenario, "rough.zarr", progress=True, threads=2).close()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "rough.history",
        "rough.toml",
        "rough.zarr",
    ]
    hs.run("rough.history", "full.nc").close()
    history, expected = hs.open("rough.zarr"), hs.open("full.nc")
    assert len(done) > 1
    assert sum(done) == history.sizes["step"]
    assert len(hs.open("rough.zarr", chunks="auto").normal_load.data.chunks[0]) > 1
    assert history.slip_state.attrs["flag_values"].dtype == np.int8
    assert_same(history, expected)
    label = int(history.contact.slides_first()[0])
    # queries that need the log, next to the store
    for each in (history, expected):
        each.contact.load_curve()
        each.close()
    assert history.contact.asperity(label, time=1.234) is not None
    assert history.contact.summary() == expected.contact.summary()


def test_a_lazy_history_is_written_by_xarray(scenario):
    hs.run(scenario, "rough.nc").close()
    history = hs.open("rough.history", chunks={"step": 10, "asperity": 30})
    history.to_zarr("rough.zarr", consolidated=False)
    found = hs.open("rough.zarr")
    assert_same(found, hs.open("rough.nc"))
    assert found.contact.profiles(int(found.asperity[0]), ["turned"]).traction.size


def test_the_command_writes_reads_and_replaces_stores(scenario, tmp_path):
    def command(*arguments):
        return CliRunner().invoke(main, arguments)

    for force in ([], ["--force"]):
        done = command("run", scenario.name, "-o", "out.zarr", "--snapshot-every", "10", *force)
        assert done.exit_code == 0, done.stderr
    assert "result                    out.zarr" in done.stdout
    done = command("run", scenario.name, "-o", "out.zarr")
    assert done.exit_code == 2
    assert "out.zarr: exists already, and a store is never replaced" in done.stderr
    assert "--force" in done.stderr
    assert "steps" in command("show", "out.zarr").stdout
    (tmp_path / "other.zarr").mkdir()
    done = command("run", scenario.name, "-o", "other.zarr", "--force")
    assert done.exit_code == 2
    assert "other.zarr: exists already and is not a zarr store of historysim" in done.stderr
    done = command("run", scenario.name, "-o", "out.nc", "--cluster", "tcp://127.0.0.1:1")
    assert done.exit_code == 2
    assert "expected a zarr store (.zarr) as output" in done.stderr


def test_totals_alone_are_a_small_store(scenario):
    hs.run(scenario, "rough.zarr", record="totals").close()
    assert "asperity" not in hs.open("rough.zarr").dims


def test_an_interrupted_store_is_resumed(scenario, tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(zarr_result, "_write_store", interrupt)
        with raises(
            KeyboardInterrupt, match=r"rough\.history keeps the events and snapshots; .* --resume"
        ):
            hs.run(scenario, "rough.zarr")
    assert not (tmp_path / "rough.zarr").exists()
    replayed = []
    monkeypatch.setattr(zarr_result, "write_result", lambda *given: replayed.append(given))
    hs.run(scenario, "rough.zarr", resume=True).close()
    assert len(replayed) == 1
    assert hs.open("rough.zarr").sizes["step"] == 46


def test_what_is_no_finished_store_is_refused(scenario, tmp_path):
    with refused("is compressed by zarr itself"):
        hs.run(scenario, "rough.zarr", compression="zlib")
    (tmp_path / "broken.zarr").mkdir()
    (tmp_path / "broken.zarr" / "zarr.json").write_text("{")
    with refused(r"broken\.zarr: is damaged, or not a result"):
        hs.open("broken.zarr")
    xr.Dataset({"a": ("x", [1.0])}).to_zarr("foreign.zarr", consolidated=False)
    with refused(r"foreign\.zarr: is not a finished result"):
        hs.open("foreign.zarr")


@mark.parametrize("module", ["zarr", "dask.array"])
def test_without_its_packages_the_message_names_the_extras(scenario, tmp_path, monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    with refused(r'pip install "historysim\[dask,zarr\]"'):
        hs.run(scenario, "rough.zarr")
    # before anything is written
    assert [path.name for path in tmp_path.iterdir()] == ["rough.toml"]


def test_a_cluster_that_is_not_there_is_an_error(scenario, monkeypatch):
    importorskip("distributed")
    monkeypatch.setattr(zarr_result, "CONNECT_SECONDS", 0.2)
    with refused(r"cluster tcp://127\.0\.0\.1:9: no scheduler answers there"):
        hs.run(scenario, "rough.zarr", cluster="tcp://127.0.0.1:9")


@mark.ci
@mark.filterwarnings("ignore")
@mark.skipif(os.name == "nt", reason="ends a process by a signal")
def test_a_cluster_that_loses_a_worker_gives_the_same_bits(scenario):
    distributed = importorskip("distributed")
    hs.run(scenario, "rough.nc").close()
    expected = hs.open("rough.nc").load()
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        victim = next(iter(client.run(os.getpid).values()))
        future = client.compute(hs.open("rough.history", chunks={"step": 2, "asperity": 7}))
        while not any(client.run(opened_logs).values()):
            time.sleep(0.02)
        os.kill(victim, signal.SIGKILL)
        assert_same(future.result(), expected)
        assert not future.cancelled()
        # each process reads the log once, not once for each task
        assert set(client.run(opened_logs).values()) == {1}
        hs.run("rough.history", "out.zarr", cluster=cluster.scheduler_address).close()
        history = hs.open("rough.history", chunks={"step": 2})
        Path("rough.history").rename("moved.history")
        client.run(lazy_history._open_history.cache_clear)
        with refused(r"rough\.history: there is no such file on .* under the same path"):
            history.normal_load.compute()
    assert_same(hs.open("out.zarr"), expected)


def opened_logs():
    return lazy_history._open_history.cache_info().misses


# few chunks, since each test reads all of them often
FEW = {"CHUNK_CELLS": 3000, "CHUNK_ASPERITIES": 200}


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "rough.toml").write_text(SCENARIO, encoding="utf-8")
    with (
        patch.multiple(lazy_history, **FEW),
        hs.run(folder / "rough.toml", folder / "rough.zarr", threads=2) as history,
    ):
        values = {name: variable.values.tobytes() for name, variable in history.variables.items()}
    return folder, values


@fixture
def stored(made, scenario):
    folder, values = made
    shutil.copytree(folder, scenario.parent, dirs_exist_ok=True)
    with patch.multiple(lazy_history, **FEW):
        yield Path("rough.zarr"), values


def test_any_flipped_bit_is_told_or_changes_nothing(stored):
    store, values = stored
    rng, files = (
        np.random.default_rng(1),
        sorted(path for path in store.rglob("*") if path.is_file()),
    )
    for number in range(30):
        path = files[number % len(files)]
        content = path.read_bytes()
        flipped = bytearray(content)
        flipped[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        with refused(r"rough\.zarr.*damaged"), hs.open(store) as history:
            assert {
                name: variable.values.tobytes() for name, variable in history.variables.items()
            } == values
        path.write_bytes(content)


def test_a_missing_chunk_is_an_error(stored):
    store, _ = stored
    for path in [path for path in store.rglob("*") if path.is_file()][::7]:
        content = path.read_bytes()
        path.unlink()
        for read in (hs.open, hs.show, hs.verify):
            with refused(r"damaged|there is no|is a folder"):
                read(store)
        path.write_bytes(content)
    assert hs.verify(store)


def test_verify_compares_a_store_with_its_log(scenario, stored):
    store, _ = stored
    assert hs.verify(store)
    text = SCENARIO.replace("coefficient = 0.2", "coefficient = 0.21")
    assert text != SCENARIO
    scenario.write_text(text, encoding="utf-8")
    hs.run(scenario, "other.zarr", threads=2).close()
    with refused("another scenario"):
        hs.verify("other.zarr", store.with_suffix(".history"))
    with hs.open(store) as history:
        changed = history.load()
    changed["normal_load"][3, 2] *= 1.01
    changed.drop_encoding().to_zarr("changed.zarr", consolidated=False)
    found = hs.verify("changed.zarr", store.with_suffix(".history"))
    assert not found
    assert [difference.name for difference in found.differences] == ["normal_load"]


@mark.parametrize(
    "member", ["notes.txt", "analysis/zarr.json", "normal_load/c/notes", "normal_load/link"]
)
def test_a_store_with_a_foreign_member_is_never_replaced(scenario, stored, member):
    store, _ = stored
    path = store / member
    path.parent.mkdir(exist_ok=True)
    path.symlink_to("zarr.json") if path.name == "link" else path.write_text("{}", encoding="utf-8")
    before = sorted((path, path.read_bytes()) for path in store.rglob("*") if path.is_file())
    for force, message in ((False, "--force"), (True, "has not written")):
        with refused(message):
            hs.run(scenario, store, force=force)
    assert (
        sorted((path, path.read_bytes()) for path in store.rglob("*") if path.is_file()) == before
    )


@mark.parametrize("in_one_step", [True, False])
def test_an_open_reader_never_reads_another_run(scenario, stored, monkeypatch, in_one_step):
    store, values = stored
    if not in_one_step:
        monkeypatch.setattr("ctypes.CDLL", lambda _: None)
    reader = hs.open(store)
    with refused("exists already"):
        hs.run(scenario, store)
    assert reader.stick_radius.values.tobytes() == values["stick_radius"]
    reader = hs.open(store)
    scenario.write_text(
        SCENARIO.replace("coefficient = 0.2", "coefficient = 0.21"), encoding="utf-8"
    )
    hs.run(scenario, store, force=True).close()
    with refused("was replaced"):
        _ = reader.stick_radius.values
    assert hs.open(store).stick_radius.values.tobytes() != values["stick_radius"]
    assert sorted(path.name for path in Path().iterdir()) == [
        "rough.history",
        "rough.toml",
        "rough.zarr",
    ]
