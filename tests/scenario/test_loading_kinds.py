"""Measured records in a scenario: every key does what it says, and only that, and wrong ones are one clear line."""

import json

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from pytest import fixture, mark, raises
from records import scenario_text, write_columns

import historysim as hs
from historysim.errors import InputError, LoadError
from historysim.scenario import scenario

TIME = np.arange(15.0)
LOAD = 1 + 0.1 * TIME
MOVED = np.array([0, 1, 2, 1, 0, -1, -2, -1, 0, 1, 2, 1, 0, -1, -2.0])
FORCE = 0.01 * MOVED


@fixture
def folder(tmp_path):
    write_columns(tmp_path / "m.csv", t=TIME, N=LOAD, u=MOVED, T=FORCE, t2=TIME + 0.25, p=10 * TIME)
    return tmp_path


def loaded(folder, *arguments, **options):
    path = folder / "s.toml"
    path.write_text(scenario_text(*arguments, **options), encoding="utf-8")
    return scenario.load(path)


def record(folder, *arguments, **options):
    return loaded(folder, *arguments, **options).measurement()


def refusal(folder, *arguments, **options):
    with raises(InputError) as refused:
        loaded(folder, *arguments, **options).events()
    return str(refused.value)


def remarks(found):
    return dict(found.remarks)


# -- what each key does ----------------------------------------------------------------------------


@mark.parametrize(
    "channel, expected",
    [
        ('{ column = "N", unit = "mN", scale = 2, offset = 1 }', 2e-3 * LOAD + 1),
        ('{ column = "p", unit = "MPa", area = "3 mm2" }', 30 * TIME),
        ('{ column = "p", area = 2, scale = 0.5, offset = 7 }', 10 * TIME + 7),
        ('{ constant = "2 kN" }', np.full(15, 2000.0)),
        ('{ column = "u", scale = -1, negative_as_zero = true }', np.maximum(-MOVED, 0)),
    ],
)
def test_a_load_channel_in_si(folder, channel, expected):
    assert_allclose(
        record(folder, {"normal_load": channel})["normal_load"], expected, rtol=1e-14, atol=1e-14
    )


@mark.parametrize("shift", [-0.4, 2.5])
@mark.parametrize("own", [False, True])
def test_a_channels_own_clock_and_shift(folder, own, shift):
    clock = TIME + 0.25 if own else TIME
    time = 'time = "t2", ' if own else ""
    found = record(
        folder, {"tangential_displacement": f'{{ column = "u", {time}shift = {shift} }}'}
    )
    inside = (clock[0] + shift <= TIME) & (clock[-1] + shift >= TIME)
    assert_array_equal(found.time, TIME[inside])
    assert_allclose(
        found["tangential_displacement"],
        np.interp(TIME[inside], clock + shift, MOVED),
        rtol=1e-13,
        atol=1e-15,
    )
    assert_array_equal(found["normal_load"], LOAD[inside])
    left = 15 - int(inside.sum())
    plural = "sample" if left == 1 else "samples"
    expected = {"outside the clocks of all channels": f"{left} {plural}, left out"} if left else {}
    assert remarks(found) == expected


def test_clocks_may_have_samples_of_their_own_number(folder):
    slow = np.arange(0, 14.1, 2.5)
    content = {
        "a": {"t": TIME.tolist(), "u": MOVED.tolist()},
        "b": {"t": slow.tolist(), "N": (slow**2).tolist()},
    }
    (folder / "m.json").write_text(json.dumps(content), encoding="utf-8")
    columns = {
        "time": '"a.t"',
        "tangential_displacement": '"a.u"',
        "normal_load": '{ column = "b.N", time = { column = "b.t", unit = "s" } }',
    }
    found = record(folder, columns, file="m.json")
    inside = slow[-1] >= TIME
    assert_array_equal(found.time, TIME[inside])
    assert_allclose(found["normal_load"], np.interp(TIME[inside], slow, slow**2), rtol=1e-14)


@mark.parametrize(
    "keys, inside",
    [
        ('end = "5000 ms"', TIME <= 5),
        ("start = 2.5\nend = 8.5", (TIME > 2.5) & (TIME < 8.5)),
        ("start = 4\nend = 4", TIME == 4),
    ],
)
def test_a_window(folder, keys, inside):
    found = record(folder, loading=keys)
    assert_array_equal(found.time, TIME[inside])
    assert_array_equal(found["normal_load"], LOAD[inside])
    assert ("before the start or after the end" in remarks(found)) == (not inside.all())


def test_corrections_see_the_window_alone(folder):
    """Thirty before the window would move the middle of the cycles."""
    moved = np.concatenate([[30, -30, 30, -30], MOVED])
    write_columns(folder / "m.csv", t=np.arange(19), N=np.ones(19), u=moved)
    found = record(
        folder,
        {"tangential_displacement": '{ column = "u", offset = 5, centred = true }'},
        loading="start=4",
    )
    assert_allclose(found["tangential_displacement"], MOVED, atol=1e-14)


def test_an_interval_is_straight_between_samples(folder):
    found = record(folder, {"tangential_displacement": '"u"'}, loading='interval = "300 ms"')
    time = 0.3 * np.arange(47)
    assert_allclose(found.time, time, rtol=1e-14)
    assert_allclose(found["tangential_displacement"], np.interp(time, TIME, MOVED), atol=1e-13)
    assert_allclose(found["normal_load"], np.interp(time, TIME, LOAD), rtol=1e-13)
    assert remarks(found) == {"resampled": "every 300 ms, 47 samples"}


def test_missing_values_are_refused_with_line_and_column(folder):
    write_columns(folder / "m.csv", t=[0, 1, 2], N=[1, 1, 1], u=[0, np.nan, 1])
    assert refusal(folder).startswith(
        "s.toml: loading.file: m.csv: line 3, column 'u': ''; expected a finite number"
    )


def test_missing_values_are_dropped_and_counted(folder):
    write_columns(
        folder / "m.csv",
        t=[0, 1, np.nan, 3, 4, 5],
        N=[1, 2, 3, np.nan, 5, 6],
        u=[0, np.nan, 2, 3, 4, 5],
    )
    found = record(folder, loading='missing = "drop"')
    assert_array_equal(found.time, [0, 4, 5])
    assert_array_equal(found["normal_load"], [1, 5, 6])
    assert remarks(found) == {"missing": "3 samples, left out"}
    assert found.place(1) == "line 6"


def test_what_lies_outside_a_clock_is_not_called_missing_nor_the_other_way(folder):
    load = np.array([np.nan, *LOAD[1:]])
    write_columns(folder / "m.csv", t=TIME, N=load, u=MOVED, t2=TIME - 0.5)
    found = record(
        folder,
        {"tangential_displacement": '{ column = "u", time = "t2" }'},
        loading='missing = "drop"',
    )
    assert remarks(found) == {
        "outside the clocks of all channels": "1 sample, left out",  # the last
        "missing": "1 sample, left out",  # the first
    }
    assert_array_equal(found.time, TIME[1:-1])


def test_gaps_are_refused(folder):
    write_columns(folder / "m.csv", t=[0, 1, 2, 5, 6, 9.5], N=np.ones(6), u=np.arange(6))
    assert "2 gaps longer than max_gap, the first one of 3 s before line 5" in refusal(
        folder, loading="max_gap = 2"
    )
    assert record(folder, loading="max_gap = 3.5").time.size == 6
    assert "one of 3 s before line 5" in refusal(folder, loading="max_gap = 2\ninterval = 0.5")


def test_gaps_of_an_own_clock(folder):
    own = np.where(TIME < 6, TIME, TIME + 3)
    write_columns(folder / "m.csv", t=TIME, N=LOAD, u=MOVED, t2=own)
    columns = {"tangential_displacement": '{ column = "u", time = "t2" }'}
    said = refusal(folder, columns, loading="max_gap = 2")
    # from 5 s to 9 s nothing is known
    assert "3 samples within gaps of a channel's separate clock, the first one at line 8" in said
    assert_allclose(
        record(folder, columns, loading="max_gap = 4")["tangential_displacement"],
        np.interp(TIME, own, MOVED),
    )
    said = refusal(folder, columns, loading='max_gap = 2\nmissing = "drop"')
    assert "1 gap longer than max_gap, the first one of 4 s before line 11" in said


def test_centred_and_free_of_drift(folder):
    """A triangle of a constant amplitude about 3, drifting by 0.02 a second: both are found to rounding."""
    time = np.arange(0, 24.01, 0.5)
    swing = np.abs((time + 3) % 4 - 2) - 1
    write_columns(folder / "m.csv", t=time, N=np.ones(time.size), u=3 + 0.02 * time + swing)
    found = record(
        folder,
        {
            "tangential_displacement": '{ column = "u", unit = "µm", drift_free = true, centred = true }'
        },
        dead_band={"tangential_displacement": '"500 nm"'},
    )
    assert_allclose(found["tangential_displacement"], swing * 1e-6, atol=1e-18)
    said = remarks(found)
    assert said["tangential displacement: drift removed"].startswith("20 nm/s ± ")
    assert said["tangential displacement: offset removed"].startswith("3 µm ± ")


def test_a_backlash_is_taken_up(folder):
    """A triangle read through a play of half a width of 0.25: while the reading moves it is 0.25 behind."""
    time = np.arange(0, 16.01, 0.25)
    true = 2 * (np.abs((time + 6) % 8 - 4) - 2)
    reading, play = [], 0.0
    for value in true:
        play = min(max(play, value - 0.25), value + 0.25)
        reading.append(play)
    write_columns(folder / "m.csv", t=time, N=np.ones(time.size), u=reading)
    found = record(folder, {"tangential_displacement": '{ column = "u", backlash = 0.5 }'})
    settled = time > 1
    assert_allclose(found["tangential_displacement"][settled], true[settled], atol=1e-12)
    assert remarks(found) == {"tangential displacement: backlash removed": "500 mm"}


@mark.parametrize("closing", ["", ', closing_load = "10 mN"'])
@mark.parametrize("replayed", ["tangential_displacement", "tangential_load"])
def test_free_play_is_taken_off_by_the_load(folder, closing, replayed):
    channels = {
        "tangential_displacement": f'{{ column = "u", free_play = 0.2{closing} }}',
        "tangential_load": '"T"',
    }
    other_channel = next(key for key in channels if key != replayed)
    found = record(
        folder,
        {"tangential_displacement": None, replayed: channels[replayed]},
        {other_channel: channels[other_channel]},
    )
    side = np.clip(FORCE / 0.01, -1, 1) if closing else np.sign(FORCE)
    assert_allclose(found["tangential_displacement"], MOVED - 0.1 * side, atol=1e-14)
    assert remarks(found) == {"tangential displacement: free play removed": "200 mm"}


# -- replay ----------------------------------------------------------------------------------------


def replayed(of):
    return hs.replay(of.ensemble(), of.events(), record="totals")


def test_every_sample_is_passed_exactly(folder):
    history = replayed(loaded(folder))
    assert_array_equal(history.time, TIME)
    assert_allclose(history.total_normal_load, LOAD, rtol=1e-12)
    assert_allclose(history.tangential_displacement, MOVED * 1e-9, rtol=1e-12, atol=1e-21)


def test_reduced_to_turning_points(folder):
    columns = {"normal_load": '{ constant = "2 N" }'}
    whole, reduced = loaded(folder, columns), loaded(folder, columns, loading="reduce = true")
    kept = [0, 2, 6, 10, 14]
    assert remarks(reduced.measurement()) == {
        "replayed": "5 of 15 samples, which the contact remembers"
    }
    long, short = replayed(whole), replayed(reduced)
    assert_array_equal(short.time, TIME[kept])
    # nothing is lost without a dead band
    assert_allclose(short.total_tangential_load, long.total_tangential_load[kept], rtol=1e-9)
    assert_allclose(short.total_dissipated_energy, long.total_dissipated_energy[kept], rtol=1e-9)


# -- what is refused -------------------------------------------------------------------------------


def test_times_that_go_back_are_refused(folder):
    write_columns(folder / "m.csv", t=[0, 1, 0.5, 3], N=np.ones(4), u=[0, 1, 2, 4])
    said = "s.toml: loading.file: m.csv: line 4: the time 0.5 s comes after 1 s; expected times that do not decrease"
    assert refusal(folder).startswith(said)


# -- channels that a waypoint does not name
# ----------------------------------------------------------


def events_of(written, folder):
    path = folder / "s.toml"
    head = '[materials]\nfirst = "silicon"\nsecond = "silica"\n[surface]\nkind = "sphere"\nradius = "1 mm"\n'
    path.write_text(f"{head}[friction]\ncoefficient = 0.2\n[loading]\n{written}", encoding="utf-8")
    told = []
    return [
        (event.name, event.time, event.value) for event in hs.load(path).events(told.append)
    ], told


# a normal load that falls from 50 to 45 mN unnoticed while the tangential load rises
UNNAMED = """waypoints = [
    { time = 0, normal_load = 0.05 },
    { time = 1, tangential_load = 0.005 },
    { time = 2, normal_load = 0.045 },
    { time = 3, tangential_load = 0.002 },
]
"""


def test_a_channel_that_runs_on_unnamed_is_reported_and_may_be_held(tmp_path):
    as_ever, told = events_of(UNNAMED, tmp_path)
    (notice,) = told
    assert notice == (
        "loading.waypoints[1]: normal_load is not set here and ramps from 50 mN at 0 s to 45 mN at 2 s, "
        "and so in 1 other place; set loading.hold = true to hold it, or hold = false if the ramp is intended"
    )
    assert as_ever == [
        ("normal_load", 0.0, 0.05),
        ("tangential_load", 1.0, 0.005),
        ("normal_load", 2.0, 0.045),
        ("tangential_load", 3.0, 0.002),
    ]
    assert events_of("hold = false\n" + UNNAMED, tmp_path) == (as_ever, [])
    held, told = events_of("hold = true\n" + UNNAMED, tmp_path)
    assert told == []
    assert held == [
        ("normal_load", 0.0, 0.05),
        ("tangential_load", 1.0, 0.005),
        ("normal_load", 1.0, 0.05),
        ("normal_load", 2.0, 0.045),
        ("tangential_load", 2.0, 0.005),
        ("tangential_load", 3.0, 0.002),
        ("normal_load", 3.0, 0.045),
    ]


@mark.parametrize(
    "written",
    [
        # it is where it was; it is named at the same time; nothing comes after; it begins later
        "waypoints = [{time=0, normal_load=1}, {time=1, tangential_load=0.1}, {time=2, normal_load=1}]",
        "waypoints = [{time=0, normal_load=1}, {time=1, tangential_load=0.1}, {time=1, normal_load=2}]",
        "\n".join(
            f"[[loading.blocks]]\nwaypoints = [{{after=1, {reached}}}]"
            for reached in ("normal_load=1", "tangential_load=0.1", "normal_load=2")
        ),
    ],
)
def test_a_channel_that_stays_or_is_named_is_not_told(tmp_path, written):
    assert events_of(written, tmp_path)[1] == []


def test_blocks_before_a_record_condition_the_contact(folder):
    """The record keeps its clock, and follows the waypoints by one sample."""
    moved = 20.0 * np.sin(np.arange(50) / 5)
    write_columns(folder / "m.csv", t=np.arange(50) * 0.1, N=np.full(50, 0.05), u=moved)
    block = """
[[loading.blocks]]
repeat = 2
waypoints = [
    { after = "1 s", normal_load = "80 mN", tangential_displacement = "300 nm" },
    { after = "2 s", tangential_displacement = 0 },
]
"""
    (folder / "s.toml").write_text(scenario_text(loading=block), encoding="utf-8")
    scenario = hs.load(folder / "s.toml")
    found = scenario.replay().dataset()
    events = []
    for time, displacement in ((-5.1, 300e-9), (-3.1, 0.0), (-2.1, 300e-9), (-0.1, 0.0)):
        events += [hs.NormalLoad(time, 80e-3), hs.TangentialDisplacement(time, displacement)]
    for row in range(50):
        events += [
            hs.NormalLoad(0.1 * row, 0.05),
            hs.TangentialDisplacement(0.1 * row, 1e-9 * float(moved[row])),
        ]
    expected = hs.replay(scenario.ensemble(), events)
    np.testing.assert_allclose(found["time"], expected["time"], atol=1e-12)
    np.testing.assert_allclose(
        found["total_tangential_load"], expected["total_tangential_load"], rtol=1e-12
    )
    assert scenario.measurement().time.size == 50
    with raises(
        InputError, match=r"loading\.blocks: only run replays blocks before a record: .*skip = 1"
    ):
        hs.compare(folder / "s.toml")


def test_errors_of_blocks_before_a_record_name_the_waypoint(folder):
    write_columns(folder / "m.csv", t=[0, 1], N=[0.05, 0.05], u=[0, 1])
    block = '[[loading.blocks]]\nwaypoints = [{ after = "1 s", normal_load = "50 mN", tangential_load = "1 N" }]'
    (folder / "s.toml").write_text(scenario_text(loading=block), encoding="utf-8")
    with raises(LoadError, match=r"loading\.blocks\[0\]\.waypoints\[0\]"):
        hs.run(folder / "s.toml")
