"""The table of hostile inputs: all of it is slow; that it finds what it looks for is not."""

import sys
import time

import pytest

import historysim as hs

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs forks, and limits of memory")
hostile = pytest.importorskip("hostile") if sys.platform == "linux" else None


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "s.toml").write_text(hostile.SCENARIO, encoding="utf-8")
    return folder


def case(make=None, arguments=("validate", "s.toml"), **more):
    return hostile.Case("a case", make or hostile.nothing, list(arguments), **more)


def test_there_are_enough():
    assert len(hostile.cases([])) >= 300


def test_an_expected_end_passes(made):
    assert hostile.wrong(case(codes=(0,)), made) == ""
    assert hostile.wrong(case(arguments=["validate", "none.toml"], said=("none.toml",)), made) == ""


def test_an_unexpected_end_is_found(made, monkeypatch):
    assert "code 0" in hostile.wrong(case(codes=(2,)), made)
    assert "does not say" in hostile.wrong(case(arguments=["validate", "none.toml"], said=("no such word",)), made)

    monkeypatch.setattr(hostile, "carried_out", lambda *_: sys.exit(7))
    assert "without an answer" in hostile.wrong(case(), made)
    monkeypatch.setattr(hostile, "carried_out", harmful)
    assert "changed" in hostile.wrong(case(), made)
    monkeypatch.setattr(hostile, "carried_out", lambda *_: time.sleep(60))
    monkeypatch.setattr(hostile, "PATIENCE", 0.5)
    assert "waits" in hostile.wrong(case(seconds=0.1), made)
    monkeypatch.setattr(hostile, "carried_out", lambda *rest: rest[2].send((1, "KeyError('x')", "", 0.0)))
    assert "KeyError" in hostile.wrong(case(), made)


def harmful(_, folder, answer):
    (folder / "s.toml").write_text("harmed", encoding="utf-8")
    answer.send((2, "", "Error: s.toml", 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("kind", [] if hostile is None else hostile.CLASSES)
def test_every_hostile_input_ends_as_expected(kind, made):
    hs.run(made / "s.toml", made / "a.nc").close()
    (made / "loads.csv").write_text("time,normal_load\n10,0.01\n", encoding="utf-8")
    found = [f"{each.name}: {problem}" for _, each in hostile.cases([kind]) if (problem := hostile.wrong(each, made))]
    assert not found
