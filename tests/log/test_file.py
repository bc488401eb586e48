"""The file of a log: sound contents are read, damage is reported."""

import multiprocessing
import os
import shutil
import sqlite3
import stat

import attrs
import numpy as np
from golden import refused
from pairs import UNIT as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.loads.schedule import make_cursor
from historysim.log import file as log_file
from historysim.log.canonical import from_columns, to_columns
from historysim.log.file import LogFile, chain_links
from historysim.log.header import LogHeader, parse_head
from historysim.log.result import add_snapshot, snapshots

ENSEMBLE = hs.Ensemble(PAIR, [0.0, -0.01, -0.03], [1.0, 2.0, 0.5], 0.5, x=[0.0, 1.0, 2.0])
JOB = hs.Replay(ENSEMBLE, ())
EVENTS = [
    hs.NormalLoad(0.0, 0.03),
    hs.TangentialLoad(1.0, 0.006),
    hs.FrictionChange(1.5, [0.4, 0.5, 0.6]),
    hs.FrictionChange(1.5, 0.45),
    hs.NormalDisplacement(2.0, 0.01),
    hs.TangentialDisplacement(2.0, -0.01),
]


@fixture
def small_batches(monkeypatch):
    monkeypatch.setattr(log_file, "MOST_EVENTS_OF_A_BATCH", 2)


@fixture
def path(tmp_path):
    return tmp_path / "run.history"


@fixture
def made(path, small_batches):  # noqa: ARG001 - the batches are those that it makes
    LogFile.create(path, LogHeader.from_replay(JOB, title="three"), EVENTS).close()
    return path


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


# -- what is in it ---------------------------------------------------------------------------------


def test_events_come_back_as_they_went_in(made):
    with LogFile(made) as file:
        content = file.sound()
        assert content.events == EVENTS
        assert [type(event) for event in content.events] == [type(event) for event in EVENTS]
        assert content.ends == [0, 2, 4, 6]
        assert content.links == chain_links(file.head, EVENTS)
        assert len(set(content.links)) == 4
    assert names(made.parent) == ["run.history"]


def test_every_bit_of_the_numbers_comes_back():
    numbers = [0.0, -0.0, 5e-324, -1e60, 0.1, float(np.nextafter(0.1, 1.0))]
    events = [hs.TangentialLoad(0.0, number) for number in numbers]
    back = from_columns(to_columns(events))
    assert [event.value.hex() for event in back] == [number.hex() for number in numbers]
    # what was made without the checks is as good as what was made with them
    assert hash(back[0]) == hash(events[0])
    assert repr(back) == repr(events)
    with raises(AttributeError):
        back[0].value = 1.0


def test_the_head_makes_the_ensemble_again_bit_for_bit(made):
    with LogFile(made) as file:
        again = file.head.ensemble
        for name in ("summit_height", "summit_radius", "friction", "x"):
            assert getattr(again, name).tobytes() == getattr(ENSEMBLE, name).tobytes()
        assert again.y is None
        assert again.tolerance == ENSEMBLE.tolerance
        assert again.pair.displacement_ratio == ENSEMBLE.pair.displacement_ratio
        assert file.head.instrument.rigid
        assert file.head.settings["title"] == "three"
    soft = LogHeader.from_replay(attrs.evolve(JOB, instrument=hs.Instrument(3.34e5)))
    assert parse_head(soft.text, soft.arrays).instrument == hs.Instrument(3.34e5)
    assert soft.link != LogHeader.from_replay(JOB).link


def test_appended_events_are_chained_to_earlier_ones(made):
    more = [hs.NormalLoad(2.0, 0.01), hs.NormalLoad(3.0, 0.02), hs.TangentialLoad(4.0, 0.0)]
    with LogFile(made) as file:
        before = list(file.sound().links)
        file.append([])
        assert file.sound().links == before
        file.append(more)
        assert file.sound().events == EVENTS + more
    with LogFile(made) as file:
        content = file.sound()
        assert content.events == EVENTS + more
        assert content.links[: len(before)] == before
        assert len(content.links) == len(before) + 2


@mark.parametrize(
    "event, message",
    [
        (
            hs.NormalLoad(1.9, 0.01),
            r"event 0 at t = 1\.9 s: comes before the last event of the log, at t = 2 s",
        ),
        (
            hs.FrictionChange(3.0, [0.1, 0.2]),
            r"event 0 at t = 3 s: friction has shape \(2,\); expected one coefficie",
        ),
        ("an event", r"event 0: 'an event' is not a load event"),
    ],
)
def test_invalid_successors_are_refused_and_nothing_is_appended(made, event, message):
    with LogFile(made) as file:
        with refused(message):
            file.append([event, hs.NormalLoad(5.0, 0.01)])
        assert file.sound().events == EVENTS
    with LogFile(made) as file:
        assert file.sound().events == EVENTS


def test_rows_can_be_neither_changed_nor_deleted(made):
    connection = sqlite3.connect(made)
    for table in ("head", "array", "batch", "chain"):
        for change in ("DELETE FROM {}", "UPDATE {} SET rowid = rowid"):
            with raises(sqlite3.IntegrityError, match="a log is only ever appended to"):
                connection.execute(change.format(table))
    connection.close()


def test_a_new_log_takes_the_place_of_an_old_one_when_it_is_whole(made):
    before = made.read_bytes()
    with refused("is not a load event"):
        LogFile.create(made, LogHeader.from_replay(JOB), [*EVENTS, None])
    assert made.read_bytes() == before
    LogFile.create(made, LogHeader.from_replay(JOB), EVENTS[:1]).close()
    with LogFile(made) as file:
        assert file.sound().events == EVENTS[:1]
    assert names(made.parent) == ["run.history"]


# -- damage ----------------------------------------------------------------------------------------


def contents(path):
    """Events and problem of a log as read by anyone, or the error."""
    try:
        with LogFile(path) as file:
            content = file.read()
            return content.events, content.problem
    except (hs.InputError, OSError) as error:
        return None, str(error)


def check_damage(path, whole):
    """The history, or a prefix with a notice, or an error: never another history."""
    events, problem = contents(path)
    if events is None:
        assert str(path) in problem
    elif problem:
        assert events == whole[: len(events)]
    else:
        assert events == whole
    return events, problem


def test_a_log_cut_anywhere_is_reported(made, tmp_path):
    whole = made.read_bytes()
    lengths = {*range(0, len(whole), 1021), *range(0, len(whole), 4096), len(whole) - 1}
    for length in sorted(lengths):
        cut = tmp_path / "cut.history"
        cut.write_bytes(whole[:length])
        events, problem = check_damage(cut, EVENTS)
        assert problem, length
        assert events is None or len(events) < len(EVENTS) or problem == "the file was cut"


def test_a_flipped_bit_never_makes_another_history(made, tmp_path):
    whole = made.read_bytes()
    chosen = np.random.default_rng(1).choice(8 * len(whole), 60, replace=False).tolist()
    used = [start for start in range(0, len(whole), 128) if any(whole[start : start + 128])]
    chosen += [8 * (start + bit % 128) + bit % 8 for start in used for bit in (3,)]
    flipped = tmp_path / "flipped.history"
    told = 0
    for bit in chosen:
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        flipped.write_bytes(damaged)
        told += bool(check_damage(flipped, EVENTS)[1])
    assert told > 10


def tampered(path, statement, *values):
    connection = sqlite3.connect(path)
    for (name,) in connection.execute(
        "SELECT name FROM sqlite_master WHERE type = 'trigger'"
    ).fetchall():
        connection.execute(f"DROP TRIGGER {name}")
    connection.execute(statement, values)
    connection.commit()
    connection.close()


@mark.parametrize(
    "statement, sound",
    [
        ("DELETE FROM batch WHERE number = 3", 4),
        ("DELETE FROM chain WHERE number = 3", 4),
        ("UPDATE batch SET time = zeroblob(16) WHERE number = 2", 2),
        ("UPDATE batch SET value = x'00' WHERE number = 2", 2),
        ("UPDATE batch SET number = number + 10 WHERE number = 3", 4),
        ("UPDATE batch SET first = 3 WHERE number = 2", 2),
        ("UPDATE chain SET link = zeroblob(32) WHERE number = 2", 2),
    ],
)
def test_changes_past_the_triggers_are_detected(made, statement, sound):
    tampered(made, statement)
    events, problem = check_damage(made, EVENTS)
    assert problem
    assert len(events) == sound
    with LogFile(made) as file:
        with refused(rf"is damaged: .*event {sound} and later ones cannot be trusted"):
            file.sound()
        with refused("is damaged"):
            file.append([hs.NormalLoad(9.0, 0.01)])


@mark.parametrize(
    "statement",
    [
        "UPDATE head SET settings = replace(settings, '0.25', '0.26')",
        "UPDATE array SET content = substr(content, 1, 20) WHERE name = 'friction'",
        "DELETE FROM array WHERE name = 'x'",
        "DELETE FROM head",
        "DELETE FROM chain",
        "DROP TABLE batch",
    ],
)
def test_a_damaged_head_is_an_error(made, statement):
    tampered(made, statement)
    with refused(r"run\.history"), LogFile(made) as file:
        file.sound()


def test_files_other_than_logs_are_refused(path):
    with refused("there is no such file; expected the log of a run"):
        LogFile(path)
    for content in (b"", b"notes", b"SQLite format 3\x00" + bytes(4080)):
        path.write_bytes(content)
        with refused(r"run\.history"):
            LogFile(path)
    path.unlink()
    other = sqlite3.connect(path)
    other.execute("CREATE TABLE notes (text)")
    other.close()
    with refused("is not a log, or is damaged: it holds table notes and has no table head"):
        LogFile(path)


# -- snapshots -------------------------------------------------------------------------------------


def with_snapshot(path):
    """A log with a snapshot after its first batch."""
    with LogFile(path, write=True) as file:
        state = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=0.03, tangential_load=0.006)
        cursor = make_cursor(EVENTS, 2)
        add_snapshot(file, file.sound(), cursor, state)
    return cursor, state


@mark.parametrize(
    "statement, reason",
    [
        ("UPDATE snapshot SET state = zeroblob(length(state))", "does not match its digest"),
        (
            "UPDATE snapshot SET about = replace(about, '\"rows\": 2', '\"rows\": 3')",
            "does not match its digest",
        ),
        ("UPDATE snapshot SET about = x'ff'", "is damaged"),
        ("DROP TABLE snapshot", "the snapshots cannot be read"),
    ],
)
def test_a_damaged_snapshot_is_reported_and_harms_nothing(made, statement, reason):
    with_snapshot(made)
    tampered(made, statement)
    with LogFile(made) as file:
        told = []
        assert list(snapshots(file, file.sound(), told.append)) == []
        assert reason in told[0]
        assert file.sound().events == EVENTS


def test_a_snapshot_of_another_log_is_reported(made, tmp_path):
    with_snapshot(made)
    other = tmp_path / "other.history"
    LogFile.create(other, LogHeader.from_replay(JOB, title="another"), EVENTS).close()
    connection = sqlite3.connect(other)
    connection.execute("ATTACH DATABASE ? AS source", (str(made),))
    connection.execute("INSERT INTO snapshot SELECT * FROM source.snapshot")
    connection.commit()
    connection.close()
    with LogFile(other) as file:
        told = []
        assert list(snapshots(file, file.sound(), told.append)) == []
        assert "is of another log" in told[0]


# -- several processes
# -------------------------------------------------------------------------------


def test_a_second_writer_is_reported_and_readers_are_not_held_up(made):
    with LogFile(made, write=True) as writer:
        with raises(OSError, match="another process is writing it; wait until it is done"):
            LogFile(made, write=True)
        with LogFile(made) as reader:
            assert reader.sound().events == EVENTS
            with raises(OSError, match="another process is writing it"):
                reader.append([hs.NormalLoad(3.0, 0.01)])
            with raises(OSError, match="another process is writing it"):
                LogFile.create(made, LogHeader.from_replay(JOB), EVENTS)
            writer.append([hs.NormalLoad(3.0, 0.01)])
            assert len(reader.sound().events) == len(EVENTS) + 1
    with LogFile(made) as file:
        file.append([hs.NormalLoad(4.0, 0.01)])
    assert names(made.parent) == ["run.history"]


def write_many(path):
    with LogFile(path) as file:
        for time in range(3, 53):
            file.append([hs.NormalLoad(time, 0.01)] * 3)


def test_a_reader_sees_a_consistent_prefix_while_another_process_writes(made):
    writer = multiprocessing.get_context("fork").Process(target=write_many, args=(made,))
    writer.start()
    sizes = []
    while writer.is_alive():
        with LogFile(made) as file:
            content = file.sound()
            sizes.append(len(content.events))
            assert content.events[: len(EVENTS)] == EVENTS
    writer.join()
    assert writer.exitcode == 0
    assert sizes == sorted(sizes)
    with LogFile(made) as file:
        assert len(file.sound().events) == len(EVENTS) + 150


def test_a_writer_that_dies_in_a_transaction_leaves_what_was_there(made, tmp_path):
    """The journal that it leaves is rolled back by the next reader."""
    connection = sqlite3.connect(made, isolation_level=None)
    connection.execute("PRAGMA cache_size = 1")
    connection.execute("BEGIN IMMEDIATE")
    for number in range(4, 60):
        connection.execute("INSERT INTO chain VALUES (?, 6, zeroblob(3000))", (number,))
    dead = tmp_path / "dead.history"
    shutil.copy(made, dead)
    shutil.copy(made.with_name("run.history-journal"), tmp_path / "dead.history-journal")
    connection.execute("ROLLBACK")
    connection.close()
    assert dead.stat().st_size > made.stat().st_size
    assert contents(dead) == (EVENTS, "")
    assert names(tmp_path) == ["dead.history", "run.history"]


@mark.parametrize("name", ["run.history-journal", ".new.history.part", ".new.history.part-journal"])
def test_a_file_of_something_else_under_a_name_of_its_own_is_left_alone(made, name):
    neighbour = made.with_name(name)
    neighbour.write_text("what nobody has twice", encoding="utf-8")
    with LogFile(shutil.copy(made, made.with_name("kept.history"))) as kept:
        head = kept.head
    with raises((OSError, hs.errors.InputError), match="; move it away"):
        LogFile(made) if name.startswith("run") else LogFile.create(
            made.with_name("new.history"), head
        )
    with raises((OSError, hs.errors.InputError), match="; move it away"):
        LogFile.create(
            made.with_name("run.history" if name.startswith("run") else "new.history"), head
        )
    assert neighbour.read_text(encoding="utf-8") == "what nobody has twice"


@mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_log_in_a_read_only_folder_can_be_read(made):
    made.chmod(stat.S_IRUSR)
    made.parent.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        with LogFile(made) as file:
            assert file.sound().events == EVENTS
            with raises(OSError, match="Permission denied"):
                file.append([hs.NormalLoad(3.0, 0.01)])
    finally:
        made.parent.chmod(stat.S_IRWXU)
