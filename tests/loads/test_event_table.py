"""Tables of events to append."""

from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import historysim as hs
from historysim.basics.limits import LARGEST, MOST_FRICTION
from historysim.loads.event_sequence import digest
from historysim.loads.event_table import read_events, write_events
from historysim.tables import Format


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


FOUR = [
    hs.NormalLoad(0.0, 0.05),
    hs.NormalLoad(1.5, 0.02),
    hs.TangentialLoad(1.5, -0.0035),
    hs.FrictionChange(1.5, 0.2),
]


@pytest.mark.parametrize(
    ("text", "layout"),
    [
        ("time,normal_load,tangential_load,friction\n0,0.05,,\n1.5,0.02,-0.0035,0.2\n", {}),
        ("time;normal_load;tangential_load;friction\n0;0,05;;\n1,5;0,02;-0,0035;0,2\n", {"decimal": ","}),
        ("time;normal_load;tangential_load;friction\n0;50 mN;;\n1,5 s;20 mN;-3,5 mN;0,2\n", {"decimal": ","}),
        ("time\tnormal_load\ttangential_load\tfriction\n0\t50 mN\t\t\n1.5 s\t20 mN\t-3.5 mN\t0.2\n", {}),
        ("time [s],normal_load [mN],tangential_load / mN,friction\n0,50,,\n1.5,20,-3.5,0.2\n", {}),
        ("time (ms)|normal_load|tangential_load|friction (%)\n0|50 mN||\n1500|20 mN|-3.5 mN|20\n", {}),
        ("time,normal_load,tangential_load,friction\n[ms],[mN],[mN],\n0,50,,\n1500,20,-3.5,0.2\n", {}),
        ('time normal_load tangential_load friction\n0 0.05 "" ""\n1.5 20e-3 -0.0035 .2\n', {}),
        ("run 7\n# of old\ntime,normal_load,tangential_load,friction,\n\n0,0.05,,,\n# then\n1.5,.02,-.0035,.2,\n", {}),
        ("% old\n# time,normal_load,tangential_load,friction\n0,0.05,,\n1.5,0.02,-0.0035,0.2\n", {}),
        ('"time","normal_load","tangential_load","friction"\n"0","50 mN","",""\n"1.5","20 mN","-3.5 mN","0.2"\n', {}),
        ("\ufefftime,normal_load,tangential_load,friction\r\n0,0.05,,\r\n,,,\r\n1.5,0.02,-0.0035,0.2\r\n", {}),
        ("time&normal_load&tangential_load&friction\n0&.05&&\n1.5&.02&-.0035&.2\n", {"delimiter": "&"}),
    ],
)
def test_tables_in_the_forms_that_scenarios_read(table, text, layout):
    assert read_events(table(text), Format(**layout)) == FOUR


def test_the_encoding_may_be_said(tmp_path):
    path = tmp_path / "events.csv"
    path.write_text("time,tangential_displacement [µm]\n1,2\n", encoding="latin-1")
    assert read_events(path, Format(encoding="latin-1")) == [hs.TangentialDisplacement(1.0, 2e-6)]
    # a text of Windows is read as such, since it cannot be UTF-8
    assert read_events(path) == [hs.TangentialDisplacement(1.0, 2e-6)]


def test_the_time_may_stand_in_any_column(table):
    assert read_events(table("normal_load,time\n0.1,2\n")) == [hs.NormalLoad(2.0, 0.1)]


def test_a_header_alone_has_no_events(table):
    assert read_events(table("time,normal_load\n")) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; expected a header line"),
        ("0,1\n", "has no header line; expected one with time, normal_load, "),
        ("normal_load\n1\n", "the header names normal_load alone; expected a table of events: a text with a header"),
        ("time,normal_laod\n", "column 'normal_laod' is no kind of event; did you mean 'normal_load'?"),
        ("time,normal_load,normal_load [N]\n", "the header names 'normal_load' 2 times; expected it once"),
        ("time,normal_load\n1,0.1\n2,0.1,3\n", "line 3: 3 values where the header names 2 columns"),
        ("time,normal_load\n1,heavy\n", "line 2, column normal_load: 'heavy' is not one number and its unit"),
        ("time,normal_load\n,1\n", "line 2, column time: ''; expected a finite number"),
        ("time,normal_load\n1,50 nm\n", "line 2, column normal_load: '50 nm'"),
        ("time,normal_load\n1,-1\n", "line 2, column normal_load: NormalLoad: a normal load of -1 N pulls"),
        ("time;normal_load\n1;0,5\n", "'0,5'; expected a finite number; if it has a decimal comma, say decimal"),
        ("time;normal_load\n1;0,5 mN\n", "'0,5 mN'; expected a finite number; if it has a decimal comma, say decimal"),
        ("time,normal_load [mm]\n1,1\n", "column normal_load: 'mm' is not a unit of a force"),
        (
            "time friction\n1 0.1 0.2\n",
            "line 2: 3 values where the header names 2 columns; expected one value for each",
        ),
        ("time,friction\n1,[]\n", "line 2, column friction: FrictionChange: friction is empty"),
        ("time,normal_load x\n1,2\n", "column 'normal_load x' is no kind of event"),
        (
            "time,tangential_load,tangential_load x,tangential_load y\n1,2,3,4\n",
            "expected 'tangential_load x' and 'tangential_load y' alone",
        ),
    ],
)
def test_what_cannot_be_read_is_named_with_its_place(table, text, message):
    with pytest.raises(hs.InputError) as caught:
        read_events(table(text))
    assert str(caught.value).startswith("events.csv: ")
    assert message in str(caught.value)
    assert "give columns by position" not in str(caught.value)


PAIRS = [
    hs.NormalLoad(0.0, 0.05),
    hs.TangentialDisplacement(1.0, (5e-9, 1e-9)),
    hs.TangentialDisplacement(2.0, (-5e-9, 8e-9)),
]


def test_a_pair_has_two_columns(table):
    text = (
        "time,tangential_displacement y [nm],normal_load,tangential_displacement x\n0,,50 mN,\n1,1,,5 nm\n2,8,,-5e-9\n"
    )
    assert read_events(table(text)) == PAIRS
    write_events(path := table("x"), PAIRS)
    assert path.read_text(encoding="utf-8").splitlines()[0] == (
        "time,normal_load,tangential_displacement x,tangential_displacement y"
    )
    assert read_events(path) == PAIRS


def test_columns_of_pairs_go_round_through_a_table_of_a_result(tmp_path, monkeypatch):
    # a result as a table, a scenario that the table suggests, and its result
    from historysim.scenario.suggestion import suggested_loading
    from historysim.tables import describe

    monkeypatch.chdir(tmp_path)
    ensemble = hs.Ensemble(hs.MaterialPair(hs.material("silicon"), hs.material("silica")), 0.0, 1e-3, 0.2)
    hs.write_csv(hs.replay(ensemble, PAIRS).contact.time_series(form="totals"), "series.csv")
    listings = describe(Path("series.csv"))
    names = {listing.column for listing in listings}
    assert {'"tangential_displacement x [m]"', '"tangential_displacement y [m]"'} <= names
    loading = suggested_loading(Path("series.csv"), listings, Format())
    assert 'tangential_displacement_y = "tangential_displacement y [m]"' in loading
    head = '[materials]\nfirst = "silicon"\nsecond = "silica"\n[surface]\nkind = "sphere"\nradius = "1 mm"\n'
    Path("again.toml").write_text(f"{head}[friction]\ncoefficient = 0.2\n{loading}\n", encoding="utf-8")
    events = list(hs.load("again.toml").events())
    moved = [event for event in events if isinstance(event, hs.TangentialDisplacement)]
    assert [event.value for event in moved if event.time > 0] == [pytest.approx(event.value) for event in PAIRS[1:]]
    assert [event.value for event in events if isinstance(event, hs.NormalLoad)] == pytest.approx([0.05] * 3)


def test_a_decimal_point_beside_commas_is_reported(table):
    for text in ("0.5", "0.5 mN"):
        with pytest.raises(hs.InputError, match='it has a decimal point, although decimal is ","'):
            read_events(table(f"time;normal_load\n1;{text}\n"), Format(decimal=","))


def test_files_that_are_no_tables_are_refused_as_what_they_are(tmp_path):
    ensemble = hs.Ensemble(hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25), 0.0, 1.0, 0.2)
    hs.EventLog.create(tmp_path / "a.history", ensemble, FOUR).close()
    (tmp_path / "a.toml").write_text("[materials]\n", encoding="utf-8")
    for name, said in (
        ("none.csv", "there is no such file"),
        (".", "is a folder"),
        ("a.history", "is the log of a run, or another SQLite database; historysim log "),
        ("a.toml", "is a scenario"),
    ):
        with pytest.raises(hs.InputError, match=r"; expected a table of events: a text with a header line") as caught:
            read_events(tmp_path / name)
        assert said in str(caught.value)


def test_events_are_written_with_every_digit():
    assert hs.NormalLoad(0.0, 0.1 + 0.2).cell == "0.30000000000000004"
    assert hs.FrictionChange(0.0, (0.1, 0.25)).cell == "0.1 0.25"
    assert hs.FrictionChange(0.0, (0.1,)).cell == "[0.1]"


NUMBERS = st.floats(-LARGEST, LARGEST)
LOADS = st.floats(0, LARGEST)
COEFFICIENTS = st.floats(0, MOST_FRICTION)
ANY_EVENTS = st.lists(
    st.one_of(
        st.builds(hs.NormalLoad, NUMBERS, LOADS),
        *(
            st.builds(kind, NUMBERS, NUMBERS)
            for kind in (hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement)
        ),
        st.builds(hs.FrictionChange, NUMBERS, st.one_of(COEFFICIENTS, st.lists(COEFFICIENTS, min_size=1, max_size=3))),
    )
)


@given(ANY_EVENTS)
@example([])
@example([hs.FrictionChange(-0.0, [0.1]), hs.FrictionChange(0.0, 0.1), hs.TangentialLoad(5e-324, -0.0)])
def test_what_is_written_is_read_bit_for_bit(tmp_path_factory, events):
    path = tmp_path_factory.getbasetemp() / "written.csv"
    write_events(path, events)
    assert digest(read_events(path)) == digest(events)


def test_a_table_appears_whole_or_not_at_all(tmp_path):
    write_events(tmp_path / "a.csv", FOUR[:2])
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == "time,normal_load\n0.0,0.05\n1.5,0.02\n"
    with pytest.raises(AttributeError):
        write_events(tmp_path / "a.csv", [*FOUR, None])
    with pytest.raises(FileNotFoundError) as caught:
        write_events(tmp_path / "none" / "a.csv", FOUR)
    assert caught.value.filename == str(tmp_path / "none" / "a.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_components_of_their_own_are_read_and_written(tmp_path):
    events = [
        hs.NormalLoad(0.0, 1e-3),
        hs.TangentialLoad(1.0, (None, 1e-4)),
        hs.TangentialDisplacement(2.0, (1e-8, None)),
        hs.TangentialDisplacement(3.0, (2e-8, 1e-9)),
    ]
    write_events(tmp_path / "a.csv", events)
    assert read_events(tmp_path / "a.csv") == events
    (tmp_path / "b.csv").write_text("time,tangential_displacement x [nm],tangential_load y [mN]\n1,,0.1\n2,10,\n")
    assert read_events(tmp_path / "b.csv") == events[1:3]
