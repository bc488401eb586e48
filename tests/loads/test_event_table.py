"""Tables of events to append."""

import pytest

import historysim as hs
from historysim.loads.event_table import read_events, value_text


@pytest.fixture
def table(tmp_path):
    def write(text):
        path = tmp_path / "events.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_each_cell_is_an_event(table):
    text = (
        "time,normal_load,tangential_displacement,friction\n0,50 mN,,\n\n1 s,0.02,-10 nm,0.2\n2.5,,1e-9,0.1 0.2 0.3\n"
    )
    assert read_events(table(text)) == [
        hs.NormalLoad(0.0, 0.05),
        hs.NormalLoad(1.0, 0.02),
        hs.TangentialDisplacement(1.0, -1e-8),
        hs.FrictionChange(1.0, 0.2),
        hs.TangentialDisplacement(2.5, 1e-9),
        hs.FrictionChange(2.5, (0.1, 0.2, 0.3)),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: has the columns none; expected time and one or more of normal_load"),
        ("normal_load\n1\n", "line 1: has the columns normal_load"),
        ("time,load\n", "line 1: has the columns time, load"),
        ("time,normal_load,normal_load\n", "each once"),
        ("time,normal_load\n1,0.1\n2,0.1,3\n", "line 3: has 3 cells; expected 2"),
        ("time,normal_load\n1,heavy\n", "line 2, column normal_load: "),
        ("time,normal_load\n,1\n", "line 2, column time: "),
        ("time,normal_load\n1,50 nm\n", "line 2, column normal_load: '50 nm'"),
        ("time,normal_load\n1,-1\n", "line 2, column normal_load: NormalLoad: a normal load of -1 N pulls"),
        ("time,normal_load\nnan,1\n", "line 2, column normal_load: NormalLoad: time is nan"),
        ("time,friction\n1,-0.1\n", "line 2, column friction: "),
    ],
)
def test_what_cannot_be_read_is_named_with_its_place(table, text, message):
    with pytest.raises(hs.InputError) as caught:
        read_events(table(text))
    assert message in str(caught.value)
    assert "events.csv" in str(caught.value)


def test_files_that_are_no_tables_are_refused(tmp_path):
    with pytest.raises(hs.InputError, match="there is no such file; expected a table of events"):
        read_events(tmp_path / "none.csv")
    with pytest.raises(hs.InputError, match="is not a CSV table"):
        read_events(tmp_path)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(hs.InputError, match="is not a CSV table"):
        read_events(tmp_path / "binary.csv")


def test_events_are_written_with_every_digit():
    assert value_text(hs.NormalLoad(0.0, 0.1 + 0.2)) == "0.30000000000000004"
    assert value_text(hs.FrictionChange(0.0, (0.1, 0.25))) == "0.1 0.25"
