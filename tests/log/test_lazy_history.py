"""Histories that are computed where they are read, against a run that records all variables."""

import os
import pickle
import re
import shutil
import signal
import sqlite3
import sys
import threading
import warnings
from contextlib import closing

import numpy as np
import xarray as xr
from golden import refused
from pairs import UNIT as PAIR
from pytest import approx, fixture, importorskip, mark, raises, warns
from rough_scenario import SCENARIO

import historysim as hs
from historysim.asperities import laws
from historysim.asperities.wear import ArchardWear
from historysim.log import lazy_history, result
from historysim.log.lazy_history import HistoryBackend, open_lazily

COUNT = 7
APPROACH = np.linspace(0.0, 0.2, 9)
SPRING = hs.Instrument(lateral_stiffness=0.2)


def ensemble(rng, friction=0.5, **options):
    return hs.Ensemble(
        PAIR, -rng.uniform(0.0, 0.04, COUNT), rng.uniform(0.5, 2.0, COUNT), friction, **options
    )


def ramps(rng, count=14, *, by_load=True):
    """Random paths of both channels; some times have one waypoint only, so that the other channel is between two."""
    events = [
        hs.NormalLoad(0.0, 0.02),
        hs.TangentialLoad(0.0, 0.0) if by_load else hs.TangentialDisplacement(0.0, 0.0),
    ]
    for time in range(1, count):
        if rng.random() < 0.6:
            events.append(hs.NormalLoad(time, rng.uniform(0.015, 0.03)))
        if by_load:
            events.append(hs.TangentialLoad(time, rng.uniform(-0.006, 0.006)))
        else:
            events.append(hs.TangentialDisplacement(time, rng.uniform(-0.03, 0.03)))
    return events


def with_friction(rng):
    events = [
        *ramps(rng, by_load=False),
        hs.FrictionChange(2.0, rng.uniform(0.3, 0.6, COUNT).tolist()),
        hs.FrictionRamp(4.0, 0.4),
        hs.FrictionRamp(7.5, rng.uniform(0.4, 0.6, COUNT).tolist()),
    ]
    return sorted(events, key=lambda event: event.time)


def planar(rng):
    targets = ((float(k), tuple(rng.uniform(-0.02, 0.02, 2))) for k in range(1, 8))
    return [hs.NormalLoad(0.0, 0.02), *(hs.TangentialDisplacement(*each) for each in targets)]


CASES = {
    "one coefficient": lambda rng: (ensemble(rng), ramps(rng), {}),
    "own coefficients": lambda rng: (ensemble(rng, rng.uniform(0.4, 0.8, COUNT)), ramps(rng), {}),
    "displacements": lambda rng: (ensemble(rng), ramps(rng, by_load=False), {}),
    "evolution": lambda rng: (
        ensemble(rng, laws.SlidFriction([0.0, 0.1], [0.5, 0.3]), wear=ArchardWear(coefficient=0.01, hardness=1.0)),
        ramps(rng, 8, by_load=False),
        {},
    ),
    "friction changes": lambda rng: (ensemble(rng), with_friction(rng), {}),
    "saturate and instrument": lambda rng: (
        ensemble(rng),
        [*ramps(rng), hs.TangentialLoad(20.0, 0.1), hs.TangentialLoad(21.0, 0.0)],
        {"saturate": True, "instrument": SPRING},
    ),
    "two directions": lambda rng: (ensemble(rng), planar(rng), {"instrument": SPRING}),
    "patches": lambda rng: (
        hs.Patches.from_normal_curves(PAIR, APPROACH, np.outer(APPROACH**1.5, rng.uniform(0.5, 1.0, 3)), friction=0.5),
        ramps(rng, by_load=False),
        {},
    ),
}  # fmt: skip


def make_log(folder, seed, name, *, snapshot_every=4, record="all"):
    """Write the log of a random history, and its result under another name, which the lazy history does not find."""
    rng = np.random.default_rng(seed)
    contact, events, options = CASES[name](rng)
    options = {"substeps": int(rng.integers(1, 4)), "record": record, **options}
    path = folder / "run.history"
    hs.EventLog.create(path, contact, events, hold=False, **options).close()
    hs.run(path, folder / "full.nc", snapshot_every=snapshot_every).close()
    return path


@fixture
def log(tmp_path):
    return make_log(tmp_path, 1, "one coefficient")


def recorded(path):
    return hs.open(path.with_name("full.nc")).load()


def assert_same_bits(found, expected):
    assert {*found.data_vars} == {*expected.data_vars}
    for name, values in expected.variables.items():
        assert found[name].dims == values.dims, name
        assert found[name].dtype == values.dtype or name == "direction", name
        assert found[name].values.tobytes() == values.values.tobytes() or name == "direction", name
        assert {*found[name].attrs} == {*values.attrs}, name


def random_key(rng, size):
    kind = rng.integers(4)
    first, last = sorted(rng.integers(0, size, 2).tolist())
    if kind == 0:
        return int(rng.integers(-size, size))
    if kind == 1:
        return slice(first, last + 1, int(rng.integers(1, 3)))
    if kind == 2:
        return slice(last, None if first == 0 else first - 1, -1)
    return rng.integers(0, size, int(rng.integers(0, 5)))


@mark.parametrize("name", CASES)
def test_any_block_has_the_bits_of_a_whole_run(tmp_path, monkeypatch, name):
    seed = len(name)
    snapshot_every = (3, 1000)[seed % 2]
    path = make_log(tmp_path, seed, name, snapshot_every=snapshot_every)
    expected = recorded(path)
    # several blocks, and replays that leave out rows, in one selection
    monkeypatch.setattr(lazy_history, "BLOCK_CELLS", 40)
    monkeypatch.setattr(lazy_history, "GAP_CELLS", 30)
    history = xr.open_dataset(path, engine=HistoryBackend)
    assert_same_bits(history.copy(), expected)
    assert {**history.attrs, "date_created": ""} == {**expected.attrs, "date_created": ""}
    rng = np.random.default_rng(seed)
    for _ in range(3):
        key = {axis: random_key(rng, expected.sizes[axis]) for axis in ("step", "asperity")}
        fresh = xr.open_dataset(path, engine=HistoryBackend)
        lazy_history._open_history.cache_clear()
        assert_same_bits(fresh.isel(key), expected.isel(key))


@mark.parametrize("name", ["one coefficient", "evolution", "two directions"])
def test_chunks_computed_by_threads_have_the_bits_of_a_whole_run(tmp_path, name):
    dask = importorskip("dask")
    path = make_log(tmp_path, len(name), name)
    expected = recorded(path)
    rng = np.random.default_rng(len(name))
    chunks = {"step": int(rng.integers(2, 9)), "asperity": int(rng.integers(1, 4))}
    with dask.config.set(scheduler="threads", num_workers=4):
        assert_same_bits(hs.open(path, chunks=chunks).compute(), expected)
        assert_same_bits(
            xr.open_dataset(path, engine=HistoryBackend, chunks=chunks).compute(), expected
        )


def test_variables_of_one_block_are_computed_once(log, monkeypatch):
    importorskip("dask")
    computed = []
    block = lazy_history.LazyHistory.block

    def count(self, steps, columns, threads=None):
        computed.append((steps.tobytes(), None if columns is None else columns.tobytes()))
        return block(self, steps, columns, threads)

    monkeypatch.setattr(lazy_history.LazyHistory, "block", count)
    names = ["normal_load", "tangential_load", "slip_state"]
    history = xr.open_dataset(log, engine=HistoryBackend)
    history[names].isel(step=slice(3, 9), asperity=[1, 2]).load()
    assert len(computed) == 1
    computed.clear()
    hs.open(log, chunks={"step": 10, "asperity": 3})[names].compute()
    assert len(computed) == len(set(computed))


def test_an_error_of_a_block_is_raised_and_not_cached(tmp_path):
    path = tmp_path / "run.history"
    ball = hs.Ensemble(PAIR, 0.0, 1.0, 0.5)
    events = [hs.NormalLoad(0.0, 0.01), hs.TangentialLoad(1.0, 0.002), hs.TangentialLoad(2.0, 0.1)]
    hs.EventLog.create(path, ball, events, record="all").close()
    history = xr.open_dataset(path, engine=HistoryBackend)
    assert history.tangential_load.isel(step=1).item() == approx(0.002)
    for _ in range(2):
        with raises(hs.LoadError, match=r"event 2 at t = 2 s"):
            history.tangential_load.isel(step=2).load()


def test_a_selection_replays_from_the_last_snapshot_only(log, monkeypatch):
    replayed, steps = [], recorded(log).sizes["step"]
    walk = hs.Replay.walk

    def count(self, target, **options):
        replayed.append(target.asperities)
        assert options["start"].rows > steps / 2
        return walk(self, target, **options)

    history = xr.open_dataset(log, engine=HistoryBackend)
    lazy_history._open_history.cache_clear()
    history.step.size  # noqa: B018 - opens it
    monkeypatch.setattr(hs.Replay, "walk", count)
    history.normal_load.isel(step=slice(-4, None), asperity=[2, 5]).load()
    assert [each.tolist() for each in replayed if each is not None] == [[2, 5]]


def test_a_log_of_totals_has_the_asperities_that_touch(tmp_path):
    path = make_log(tmp_path, 3, "one coefficient", record="totals")
    history = hs.open(path, chunks={})
    with hs.EventLog(path) as log:
        expected = log.replay(record="touching")
    assert_same_bits(history.compute(), expected)
    few = xr.open_dataset(path, engine=HistoryBackend, record=[4, 1], drop_variables="slip_state")
    assert few.asperity.values.tolist() == [1, 4]
    assert "slip_state" not in few


# -- what a run keeps ------------------------------------------------------------------------------


@fixture
def scenario(tmp_path):
    path = tmp_path / "rough.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


def test_a_run_with_totals_keeps_log_totals_and_snapshots(scenario, tmp_path):
    output = tmp_path / "rough.nc"
    totals = hs.run(scenario, output, record="totals", snapshot_every=10)
    expected = hs.run(scenario)
    assert "asperity" not in totals.dims
    assert (
        totals.total_tangential_load.values.tobytes()
        == expected.total_tangential_load.values.tobytes()
    )
    totals.close()
    assert hs.verify(output)
    assert hs.verify(output.with_suffix(".history")).snapshots == 2
    assert hs.run(scenario, record="totals").sizes == {"step": 46}
    for path in (output, output.with_suffix(".history")):
        with hs.open(path, chunks={"step": 20}) as history:
            # read from the result, not computed
            assert history.total_normal_load.chunks is None
            assert_same_bits(history.compute(), expected)
    # the result alone, which holds its log
    alone = shutil.copy(output, tmp_path / "alone.nc")
    assert_same_bits(xr.open_dataset(alone, engine=HistoryBackend).load(), expected)


def test_a_full_result_is_read_in_chunks_and_not_computed(scenario, tmp_path, monkeypatch):
    expected = hs.run(scenario, tmp_path / "rough.nc").load()
    monkeypatch.setattr(lazy_history, "open_lazily", None)
    with hs.open(tmp_path / "rough.nc", chunks={"step": 20}) as history:
        assert history.normal_load.chunks[0] == (20, 20, 6)
        assert_same_bits(history.compute(), expected)


def test_a_resume_with_another_selection_starts_at_the_beginning(scenario, tmp_path, monkeypatch):
    output = tmp_path / "rough.nc"
    sync = result.FileRecorder.flush

    def interrupt(self):
        sync(self)
        if self._filled > 20:
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(result.FileRecorder, "flush", interrupt)
        with raises(KeyboardInterrupt):
            hs.run(scenario, output, snapshot_every=10)
    notes = []
    hs.run(scenario, output, record="totals", resume=True, notify=notes.append).close()
    assert any("starts at the beginning" in note for note in notes)
    assert hs.verify(output)
    # a complete result of totals is not that of all variables
    hs.run(scenario, output, resume=True).close()
    with hs.open(output) as history:
        assert "normal_load" in history


def test_large_snapshots_are_further_apart(tmp_path, monkeypatch):
    monkeypatch.setattr(result, "MOST_SNAPSHOT_ROWS", 2)
    path = tmp_path / "run.history"

    def spaced(limit):
        monkeypatch.setattr(result, "SNAPSHOT_BYTES", limit)
        rng = np.random.default_rng(1)
        hs.EventLog.create(path, ensemble(rng), ramps(rng, 60), hold=False).close()
        hs.run(path, tmp_path / "run.nc", record="totals").close()
        with closing(sqlite3.connect(path)) as connection:
            return [size for (size,) in connection.execute("SELECT length(state) FROM snapshot")]

    many = spaced(1 << 30)
    limit = 5 * max(many)
    few = spaced(limit)
    assert len(many) > 3 * len(few) > 0
    assert limit / 3 < sum(few) <= limit + max(few)


def test_a_long_log_without_snapshots_says_which_option_helps(log, tmp_path, monkeypatch):
    monkeypatch.setattr(lazy_history, "SNAPSHOT_CELLS", 10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_lazily(log)
    bare = tmp_path / "bare.history"
    shutil.copy(log, bare)
    with closing(sqlite3.connect(bare)) as connection:
        connection.execute("DELETE FROM snapshot")
        connection.commit()
    with warns(
        UserWarning, match=r"no usable snapshot; historysim run .* --record totals --snapshot-every"
    ):
        history = open_lazily(bare)
    assert_same_bits(history.load(), recorded(log))
    hs.run(bare, tmp_path / "totals.nc", record="totals", snapshot_every=5).close()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_lazily(bare)


# -- queries and pictures --------------------------------------------------------------------------


def test_a_query_reads_what_it_needs_only(log, monkeypatch):
    history = xr.open_dataset(log, engine=HistoryBackend)
    read = []
    cached = lazy_history.LazyHistory._cached_block

    def note(self, steps, columns):
        if columns is not None:
            read.append((steps.size, columns.size))
        return cached(self, steps, columns)

    monkeypatch.setattr(lazy_history.LazyHistory, "_cached_block", note)
    history.contact.slides_first()
    history.contact.preliminary_displacement()
    assert read == []
    monkeypatch.setattr("historysim.results.plots.histories.MOST_ROWS", 3)
    hs.plot(history, panels=["states"])
    assert {columns for _, columns in read} == {3}
    read.clear()
    history.contact.profiles(3, [5])
    assert {columns for _, columns in read} == {1}
    read.clear()
    history.contact.stick_ratio().isel(step=4, asperity=2).load()
    assert set(read) == {(1, 1)}


# -- failures --------------------------------------------------------------------------------------


def test_a_damaged_log_is_refused(log):
    with closing(sqlite3.connect(log)) as connection:
        connection.execute("DROP TRIGGER no_update_of_batch")
        connection.execute("UPDATE batch SET time = zeroblob(length(time))")
        connection.commit()
    with refused(r"run\.history: is damaged: batch 1"):
        hs.open(log, chunks={})


def test_a_damaged_snapshot_is_passed_over_with_a_warning(log):
    history = xr.open_dataset(log, engine=HistoryBackend)
    with closing(sqlite3.connect(log)) as connection:
        connection.execute(
            "UPDATE snapshot SET state = zeroblob(length(state)) WHERE number % 2 = 0"
        )
        connection.commit()
    with warns(UserWarning, match="a snapshot is damaged"):
        found = history.isel(step=slice(-3, None)).load()
    assert_same_bits(found, recorded(log).isel(step=slice(-3, None)))


def test_a_log_that_grows_stays_as_it_was_opened(log):
    expected = recorded(log)
    history = hs.open(log, chunks={"step": 5})
    with hs.EventLog(log) as writer:
        writer.append([hs.NormalLoad(30.0, 0.001), hs.TangentialLoad(31.0, 0.0)])
    # as a worker that opens it later
    lazy_history._open_history.cache_clear()
    assert_same_bits(history.compute(), expected)
    assert history.contact.asperity(3, time=20.5 if expected.time[-1] > 20.5 else 7.5)
    assert hs.open(log, chunks={}).sizes["step"] > expected.sizes["step"]


def test_a_log_that_was_replaced_is_refused(log, tmp_path):
    history = xr.open_dataset(log, engine=HistoryBackend)
    log.unlink()
    make_log(tmp_path, 2, "one coefficient")
    # memory still holds the log; its snapshots are of another one
    with warns(UserWarning, match="another log than before; it was replaced"):
        history.normal_load.isel(step=-1).load()
    lazy_history._open_history.cache_clear()
    with refused(r"is not the log that the history was opened from.*replaced"):
        history.normal_load.isel(step=-1).load()


def test_a_worker_without_the_file_is_told_which_file_it_needs(log):
    history = hs.open(log, chunks={})
    log.unlink()
    lazy_history._open_history.cache_clear()
    with refused(r"run\.history: there is no such file on .*every machine.*same path"):
        history.normal_load.compute()


def test_another_version_is_refused(log, monkeypatch):
    history = hs.open(log, chunks={})
    monkeypatch.setattr(lazy_history, "program", lambda _: "historysim 99")
    lazy_history._open_history.cache_clear()
    with refused(r"was opened by historysim .*, and historysim 99 is installed on"):
        history.normal_load.compute()


def test_invalid_chunks_are_refused(log):
    for chunks, message in (
        ({"steps": 3}, "chunks is {'steps': 3}; expected numbers of steps and asperities"),
        ({"step": 0}, "chunks is {'step': 0}"),
        ({"asperity": "many"}, "chunks is {'asperity': 'many'}"),
        ("all", "chunks is 'all'"),
    ):
        for path in (log, log.with_name("full.nc")):
            with refused(re.escape(message)):
                hs.open(path, chunks=chunks)


def test_files_without_a_history_are_refused(scenario, tmp_path):
    with refused("is a scenario; expected a log or a result"):
        hs.open(scenario, chunks={})
    with refused("expected the log of a run"):
        xr.open_dataset(scenario, engine=HistoryBackend)
    with refused("there is no such file"):
        xr.open_dataset(tmp_path / "none.history", engine=HistoryBackend)
    hs.EventLog.create(tmp_path / "empty.history", hs.Ensemble(PAIR, 0.0, 1.0, 0.5)).close()
    with refused("holds no events yet"):
        hs.open(tmp_path / "empty.history", chunks={})


def test_without_dask_the_message_names_the_extra(log, monkeypatch):
    monkeypatch.setitem(sys.modules, "dask.array", None)
    for path in (log, log.with_name("full.nc")):
        with refused(r'pip install "historysim\[dask\]"; without chunks, xarray\.open_dataset'):
            hs.open(path, chunks={})


def test_a_lazy_array_is_pickled_by_path_and_digest(log):
    history = xr.open_dataset(log, engine=HistoryBackend, record="all")
    content = pickle.dumps(history.normal_load.variable)
    # ten times the asperities, the same size
    assert len(content) < 3000
    again = pickle.loads(content)
    assert again.values.tobytes() == recorded(log).normal_load.values.tobytes()


def test_xarray_finds_the_engine_by_the_file(log):
    backend = HistoryBackend()
    assert backend.guess_can_open(log)
    assert not backend.guess_can_open(log.with_name("full.nc"))
    assert not backend.guess_can_open("https://example.org/run.history")


@fixture
def read_by_threads(tmp_path, monkeypatch):
    """A lazy history that six threads read, each block evicting another one, and its values."""
    path, rng = tmp_path / "x.history", np.random.default_rng(5)
    hs.EventLog.create(path, ensemble(rng), ramps(rng, by_load=False), hold=False).close()
    monkeypatch.setattr(lazy_history, "CACHE_BYTES", 1)
    history = xr.open_dataset(path, engine="historysim")
    values, errors, done = history["normal_load"].values, [], threading.Event()

    def read(seed):
        steps = np.random.default_rng(seed)
        while not done.is_set():
            step = int(steps.integers(0, values.shape[0]))
            try:
                if not np.array_equal(history["normal_load"][step].values, values[step]):
                    errors.append(step)
            except Exception as error:  # noqa: BLE001 - of any kind, in a thread
                errors.append(error)

    threads = [threading.Thread(target=read, args=(seed,)) for seed in range(6)]
    for thread in threads:
        thread.start()
    yield history, values
    done.set()
    for thread in threads:
        thread.join()
    assert not errors


@mark.ci
@mark.skipif(not hasattr(os, "fork"), reason="processes are copied on POSIX only")
@mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_copies_of_a_process_read_while_its_threads_do(read_by_threads):
    history, values = read_by_threads
    chunked = hs.open(history.encoding["source"], chunks={"step": 2})
    assert float(chunked.normal_load.sum().compute()) == approx(values.sum())
    for attempt in range(6):
        process = os.fork()
        if not process:
            # a signal ends a copy that waits for ever
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(60)
            read = chunked.normal_load.compute() if attempt % 3 == 0 else history["normal_load"]
            os._exit(0 if np.array_equal(read.values, values) else 1)
        assert os.waitpid(process, 0)[1] == 0
