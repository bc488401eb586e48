"""The shortest history of a state, and the waypoints that are still remembered."""

import itertools

import attrs
import numpy as np
from golden import check_messages, refused
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark

import historysim as hs
from historysim.studies.shortest import write_waypoints

FRICTIONS = {"one coefficient": 0.5, "several": [0.5, 0.3, 0.5, 0.2]}
KINDS = [
    *itertools.product(
        (hs.NormalLoad, hs.NormalDisplacement),
        (hs.TangentialLoad, hs.TangentialDisplacement),
        ({},),
    ),
    (hs.NormalLoad, hs.TangentialDisplacement, {"instrument": hs.Instrument(0.3)}),
]
ROUNDING = 1e-13  # of loads, relative to the largest ones


def contact(friction=0.5):
    return hs.Ensemble(PAIR, [0.0, -2e-3, -4e-3, -30e-3], 1.0, friction)


def random_job(seed, kinds=KINDS[1], friction=0.5, count=40):
    """Return a replay of random events; some lift the contact off, and some slide."""
    normal, tangential, options = kinds
    random = np.random.default_rng(seed)
    events = []
    for time in range(count):
        lifts = time > 0 and random.uniform() < 0.05
        value = {hs.NormalLoad: 0.0 if lifts else random.uniform(4e-3, 20e-3)}
        value[hs.NormalDisplacement] = -5e-3 if lifts else random.uniform(20e-3, 60e-3)
        value[hs.TangentialDisplacement] = random.uniform(-20e-3, 20e-3)
        value[hs.TangentialLoad] = random.uniform(-2e-3, 2e-3)
        events += [kind(float(time), value[kind]) for kind in (normal, tangential)]
    return hs.Replay(contact(friction), events, saturate=True, **options)


def futures(state, ensemble):
    """Return tangential loads of a state and of later ones."""
    loads = [state.tangential_load, state.normal_load]
    for turns in itertools.product((0.03, -0.03, 0.004), repeat=2):
        later = state
        for turn in turns:
            later = ensemble.advance(later, normal_displacement=0.05, tangential_displacement=turn)
            loads.append(later.tangential_load)
    return np.array(loads)


def assert_same_future(state, other, ensemble):
    first, second = futures(state, ensemble), futures(other, ensemble)
    assert second == approx(first, abs=ROUNDING * np.abs(first).max())


@mark.parametrize("kinds", KINDS)
@mark.parametrize("seed", range(5))
def test_a_state_is_reached_by_its_shortest_history(seed, kinds):
    job = random_job(seed, kinds)
    state = job.state()
    events = state.shortest_history()
    reached = hs.Replay(job.ensemble, events, hold=False).state()
    assert_same_future(state, reached, job.ensemble)
    assert len({event.time for event in events}) <= state.vertices().size
    # nothing slips, so that nothing is dissipated but by rounding
    assert reached.dissipated_energy <= 1e-13 * state.dissipated_energy
    heights = [event.value for event in events if isinstance(event, hs.NormalDisplacement)]
    assert heights == sorted(heights)
    assert reached.stored_energy == approx(state.stored_energy, rel=1e-12)


@mark.parametrize("seed", range(3))
def test_without_one_of_its_waypoints_a_state_is_another(seed):
    job = random_job(seed)
    state = job.state()
    events = state.shortest_history()
    for time in {event.time for event in events}:
        fewer = [event for event in events if event.time != time]
        if fewer:
            other = hs.Replay(job.ensemble, fewer, hold=False).state()
            change = np.abs(futures(other, job.ensemble) - futures(state, job.ensemble)).max()
            # a contact that slides may also be reached by sliding, which takes energy
            assert change > ROUNDING * 0.02 or other.dissipated_energy > 1e-6 * state.stored_energy


def test_untouched_contacts_have_histories_without_contact():
    ensemble = contact()
    assert ensemble.initial_state().shortest_history() == []
    apart = ensemble.advance(
        ensemble.initial_state(), normal_displacement=-3e-3, tangential_displacement=2e-3
    )
    assert_same_future(apart, hs.Replay(ensemble, apart.shortest_history()).state(), ensemble)


@mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS)
@mark.parametrize("kinds", KINDS)
@mark.parametrize("seed", range(3))
def test_remembered_waypoints_lead_to_the_same_state(seed, kinds, friction):
    job = random_job(seed, kinds, friction)
    events = hs.shortest(job)
    assert len(events) < len(job.events)
    assert [event.time for event in events] == sorted(event.time for event in events)
    assert_same_future(
        job.state(), attrs.evolve(job, events=events, hold=False).state(), job.ensemble
    )


@mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS)
def test_none_of_the_remembered_waypoints_can_be_dropped(friction):
    job = random_job(4, friction=friction)
    expected = futures(job.state(), job.ensemble)
    events = hs.shortest(job)
    for time in {event.time for event in events}:
        fewer = [event for event in events if event.time != time]
        if not fewer:
            continue
        changed = futures(attrs.evolve(job, events=fewer, hold=False).state(), job.ensemble)
        assert np.abs(changed - expected).max() > ROUNDING * np.abs(expected).max()


def test_reversals_that_are_wiped_out_are_left_out():
    turns = [8e-3, -4e-3, 6e-3, 0.0, 3e-3, -1e-3]
    events = [
        hs.NormalLoad(0.0, 10e-3),
        *(hs.TangentialDisplacement(1.0 + k, u) for k, u in enumerate(turns)),
    ]
    kept = [
        event.value
        for event in hs.shortest(contact(), events)
        if isinstance(event, hs.TangentialDisplacement)
    ]
    # 0 and 3 mm are inside the loop that ends at -1 mm
    assert [value for value in kept if value] == [8e-3, -4e-3, 6e-3, -1e-3]


@fixture
def run(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        """
[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.5
[loading]
waypoints = [
    { time = 0, normal_load = "10 mN", tangential_load = "0 mN" },
    { time = 1, normal_load = "10 mN", tangential_load = "3 mN" },
    { time = 2, normal_load = "12 mN", tangential_load = "-1 mN" },
    { time = 3, normal_load = "9 mN", tangential_load = "1 mN" },
    { time = 4, normal_load = "9 mN", tangential_load = "0 mN" },
    { time = 5, normal_load = "9 mN", tangential_load = "2 mN" },
]
""",
        encoding="utf-8",
    )
    hs.run(path, tmp_path / "s.nc").close()
    return tmp_path


@mark.parametrize("name", ["s.toml", "s.history", "s.nc"])
def test_files_have_remembered_waypoints(run, name):
    assert hs.shortest(run / name) == hs.shortest(hs.load(run / "s.toml").replay())


def test_waypoints_are_written_as_table_scenario_and_amplitudes(run):
    scenario = (run / "s.toml").read_text(encoding="utf-8")
    events = hs.shortest(run / "s.history")
    write_waypoints(events, run / "w.toml")
    head = scenario[: scenario.index("[loading]")]
    (run / "again.toml").write_text(
        head + (run / "w.toml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    again, first = (
        hs.load(run / "again.toml").replay().state(),
        hs.load(run / "s.toml").replay().state(),
    )
    assert again.tangential_displacement == approx(first.tangential_displacement, rel=1e-12)
    write_waypoints(events, run / "w.csv")
    header, *rows = (run / "w.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time [s],normal_load [N],tangential_load [N]"
    numbers = [tuple(map(float, row.split(","))) for row in rows]
    expected = [(n.time, n.value, t.value) for n, t in zip(events[::2], events[1::2], strict=True)]
    assert numbers == expected
    write_waypoints(events, run / "w.inp")
    text = (run / "w.inp").read_text(encoding="utf-8")
    _, *tables = text.split("*AMPLITUDE, ")
    assert [table.split("\n")[0] for table in tables] == [
        "NAME=NORMAL_LOAD, TIME=TOTAL TIME",
        "NAME=TANGENTIAL_LOAD, TIME=TOTAL TIME",
    ]
    for column, table in enumerate(tables, start=1):
        lines = table.strip().split("\n")[1:]
        assert all(len(line.split(",")) <= 8 for line in lines)
        values = np.array([float(value) for line in lines for value in line.split(",")]).reshape(
            -1, 2
        )
        assert values.tolist() == [[row[0], row[column]] for row in expected]


def test_waypoints_that_a_file_cannot_have_are_refused(tmp_path):
    mixed = [
        hs.NormalLoad(0.0, 1e-3),
        hs.TangentialLoad(0.0, 0.0),
        hs.NormalDisplacement(1.0, 1e-3),
    ]
    with refused("controlled by load and by displacement"):
        write_waypoints([*mixed, hs.TangentialLoad(1.0, 0.0)], tmp_path / "w.inp")
    with refused("expected the ending"):
        write_waypoints(mixed, tmp_path / "w.txt")
    assert not list(tmp_path.iterdir())


PLANAR = [hs.NormalLoad(0.0, 10e-3), hs.TangentialDisplacement(1.0, (1e-3, 1e-3))]
STRAIGHT = [hs.NormalLoad(0.0, 10e-3), hs.TangentialDisplacement(1.0, 1e-3)]
WORN = hs.Ensemble(PAIR, 0.0, 1.0, 0.5, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=1.0))


def test_friction_that_has_changed_is_that_of_the_untouched_contact():
    job = hs.Replay(
        contact(), [*STRAIGHT, hs.FrictionChange(1.0, 0.8), hs.TangentialDisplacement(3.0, -1e-3)]
    )
    state = job.state()
    assert_same_future(
        state, hs.Replay(job.ensemble, state.shortest_history()).state(), job.ensemble
    )


def test_messages():
    check_messages(globals())
