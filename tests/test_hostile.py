"""The table of hostile inputs: all of it is slow; that it finds what it looks for is not."""

import re
import sys
import time

from pytest import fixture, importorskip, mark, raises

import historysim as hs

pytestmark = mark.skipif(sys.platform != "linux", reason="needs forks, and limits of memory")
hostile = importorskip("hostile") if sys.platform == "linux" else None


@fixture(scope="module")
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
    assert "does not say" in hostile.wrong(
        case(arguments=["validate", "none.toml"], said=("no such word",)), made
    )

    monkeypatch.setattr(hostile, "carried_out", lambda *_: sys.exit(7))
    assert "without an answer" in hostile.wrong(case(), made)
    monkeypatch.setattr(hostile, "carried_out", harmful)
    assert "changed" in hostile.wrong(case(), made)
    monkeypatch.setattr(hostile, "carried_out", lambda *_: time.sleep(60))
    monkeypatch.setattr(hostile, "PATIENCE", 0.5)
    assert "waits" in hostile.wrong(case(seconds=0.1), made)
    monkeypatch.setattr(
        hostile, "carried_out", lambda *rest: rest[2].send((1, "KeyError('x')", "", 0.0))
    )
    assert "KeyError" in hostile.wrong(case(), made)


def harmful(_, folder, answer):
    (folder / "s.toml").write_text("harmed", encoding="utf-8")
    answer.send((2, "", "Error: s.toml", 0.0))


@mark.slow
@mark.parametrize("kind", [] if hostile is None else hostile.CLASSES)
def test_every_hostile_input_ends_as_expected(kind, made):
    hs.run(made / "s.toml", made / "a.nc").close()
    (made / "loads.csv").write_text("time,normal_load\n10,0.01\n", encoding="utf-8")
    found = [
        f"{each.name}: {problem}"
        for _, each in hostile.cases([kind])
        if (problem := hostile.wrong(each, made))
    ]
    assert not found


SECRET = "SECRET" + "abcdefghij" * 30
FOREIGN = {
    "environment": f"A={SECRET}\0B={SECRET}\0" * 4,
    "words": f"{SECRET} " * 5,
    "columns": ",".join(f"{SECRET}{index}" for index in range(6)) + "\n1,2,3,4,5,6\n2,3,4,5,6,7\n",
    "passwords": f"root:x:0:0:{SECRET}:/root:/bin/bash\nuser:x:1:1:{SECRET}:/h:/b\n",
    "JSON": f'{{"{SECRET}": "{SECRET}"}}',
    "TOML": f'key = "{SECRET}"\n[{SECRET}]\n',
    "numbers": f"1 2 3\n4 5 {SECRET}\n",
    "units": f"t [{SECRET}],N [{SECRET}],U [{SECRET}]\n0,1,2\n1,2,3\n",
    "directions": "a\u202eb\x1b[31mc\u2066 x\n1 2\n",
}
PLACES = {
    "surface": '[surface]\nkind = "measured"\nfile = "f"\n',
    "map": '[surface]\nkind = "measured"\nfile = "f"\npixel_size = 1e-6\nheight_unit = "nm"\n',
    "summits": '[surface]\nkind = "summits"\nfile = "f"\n',
    "record": '[surface]\nkind = "sphere"\nradius = 1e-3\n[loading]\nfile = "f"\n'
    'columns = { time = "t", normal_load = "N", tangential_displacement = "U" }\n',
}


@mark.parametrize("content", FOREIGN.values(), ids=FOREIGN)
@mark.parametrize("place", [*PLACES, "file"])
def test_a_message_echoes_little_of_a_file_and_no_control_characters(tmp_path, place, content):
    (tmp_path / "f").write_text(content, encoding="utf-8")
    loading = (
        "" if place == "record" else "[loading]\nwaypoints = [{ time = 0, normal_load = 1e-3 }]\n"
    )
    materials = (
        '[materials]\nfirst = "silicon"\nsecond = "float glass"\n[friction]\ncoefficient = 0.2\n'
    )
    (tmp_path / "s.toml").write_text(materials + PLACES.get(place, "") + loading, encoding="utf-8")
    calls = [hs.open, hs.show, hs.run] if place == "file" else [hs.run]
    for call in calls:
        with raises(hs.InputError) as caught:
            call(tmp_path / ("f" if place == "file" else "s.toml"))
        message = str(caught.value)
        assert sum(map(len, re.findall(r"(?:SECRET|abcdefghij)[a-j]*", message))) <= 40
        assert all(character.isprintable() or character == "\n" for character in message)
