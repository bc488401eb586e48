"""Histories in two tangential directions: events, logs, files, scenarios, questions and pictures of them."""

import math

import numpy as np
from click.testing import CliRunner
from golden import check_messages, refused
from numpy.testing import assert_allclose, assert_array_equal
from pairs import GLASS as PAIR
from pytest import approx, fixture, mark, raises

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError, LoadError  # noqa: F401 - of the messages
from historysim.exchange.fmu import unit_file

HEIGHTS = np.random.default_rng(7).normal(0, 20e-9, 12)
ENSEMBLE = hs.Ensemble(PAIR, HEIGHTS, 10e-6, 0.2, rings=hs.Rings(height_classes=2, rings=10))
INSTRUMENT = hs.Instrument(("300 mN/µm", "1 N/µm"))

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
"""


def drawn(seed, count=8, *, by_load=False):
    """Events: loads that are held, a path in the plane, now and then a change of friction."""
    rng = np.random.default_rng(seed)
    events = [hs.NormalLoad(0.0, 20e-3)]
    for time in np.arange(1.0, count + 1):
        turn = rng.uniform(0, 2 * np.pi)
        way = np.array([np.cos(turn), np.sin(turn)])
        events.append(
            hs.TangentialLoad(time, 1.5e-3 * way)
            if by_load
            else hs.TangentialDisplacement(time, 8e-9 * way)
        )
        if rng.random() < 0.4:
            events.append(hs.NormalLoad(time, rng.uniform(15e-3, 25e-3)))
        if rng.random() < 0.2:
            events.append(hs.FrictionChange(time, rng.uniform(0.15, 0.3)))
    return events

    # along one line one of the two is the spring


def test_a_log_keeps_pairs_rings_and_snapshots(tmp_path):
    events = drawn(6)
    log = hs.EventLog.create(
        tmp_path / "a.history", ENSEMBLE, events[:4], substeps=2, instrument=INSTRUMENT, hold=False
    )
    log.append(events[4:])
    assert list(log.events()) == events
    assert log.ensemble.rings == ENSEMBLE.rings
    assert log.instrument == INSTRUMENT
    job = hs.Replay(ENSEMBLE, events, substeps=2, instrument=INSTRUMENT, hold=False)
    assert log.state(2.3) == job.state(2.3)
    log.close()
    hs.run(tmp_path / "a.history", tmp_path / "a.nc", snapshot_every=3)
    found = hs.verify(tmp_path / "a.nc")
    assert found
    assert hs.verify(tmp_path / "a.history").snapshots > 1
    log = hs.EventLog(tmp_path / "a.history")
    # from a snapshot
    assert log.state(6.4) == job.state(6.4)
    fork = log.fork(3.5, tmp_path / "b.history")
    # the waypoint at which it forks breaks a path, whose tolerance is of the friction limit of some
    # 4 mN
    limit = 0.2 * job.state(3.5).normal_load
    assert_allclose(fork.state().tangential_load, job.state(3.5).tangential_load, atol=1e-3 * limit)
    with refused("some tangential loads or displacements are one number"):
        fork.append(hs.TangentialDisplacement(9.0, 1e-9))
    assert log.state_dataset(2.5).tangential_load.dims == ("step", "asperity", "direction")
    log.state().save(tmp_path / "state")
    assert ENSEMBLE.load_state(tmp_path / "state") == log.state()


MIXED = [
    hs.NormalLoad(0.0, 1e-3),
    hs.TangentialLoad(1.0, 1e-5),
    hs.TangentialLoad(2.0, (1e-5, 0.0)),
]
MOVED = [hs.NormalLoad(0.0, 1e-3), hs.TangentialDisplacement(1.0, (1e-9, 1e-9))]


def test_a_load_beyond_the_limit_is_held_at_it_in_its_direction():
    events = [hs.NormalLoad(0.0, 1e-3), hs.TangentialLoad(1.0, (3e-4, 4e-4))]
    held = hs.replay(ENSEMBLE, events, saturate=True).isel(step=-1)
    # along one line the limit is exact
    assert_allclose(held.total_tangential_load, [1.2e-4, 1.6e-4], rtol=1e-9)
    assert held.saturated == 1


LOADING = """
[loading]
substeps = 2
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, tangential_displacement = ["10 nm", 0] },
    { time = 2, tangential_displacement = ["10 nm", "10 nm"] },
    { time = 3, tangential_displacement = [0, 0] },
]
[instrument]
lateral_stiffness = ["300 mN/µm", "1 N/µm"]
"""


@fixture
def scenario(tmp_path):
    path = tmp_path / "plane.toml"
    path.write_text(SCENARIO + LOADING)
    return path


def test_a_scenario_and_a_record_give_equal_results(tmp_path, scenario):
    expected = hs.run(scenario)
    (tmp_path / "record.csv").write_text(
        "t [s],N [mN],x [nm],y [nm]\n0,50,0,0\n1,50,10,0\n2,50,10,10\n3,50,0,0\n"
    )
    names = {
        "time": "t",
        "normal_load": "N",
        "tangential_displacement": "x",
        "tangential_displacement_y": "y",
    }
    columns = "\n".join(f'columns.{name} = "{column}"' for name, column in names.items())
    measured = tmp_path / "measured.toml"
    instrument = LOADING[LOADING.index("[instrument]") :]
    measured.write_text(
        f'{SCENARIO}[loading]\nsubsteps = 2\nfile = "record.csv"\n{columns}\n{instrument}'
    )
    found = hs.run(measured)
    assert_allclose(
        found.total_tangential_load, expected.total_tangential_load, rtol=1e-9, atol=1e-12
    )
    run = CliRunner().invoke(main, ["run", str(scenario), "-o", str(tmp_path / "a.nc")])
    assert run.exit_code == 0, run.output
    assert "peak tangential load" in run.output


def test_a_column_along_y_needs_that_along_x(tmp_path):
    (tmp_path / "record.csv").write_text("t [s],N [mN],y [nm]\n0,50,0\n1,50,10\n")
    path = tmp_path / "measured.toml"
    path.write_text(
        f'{SCENARIO}[loading]\nfile = "record.csv"\ncolumns.time = "t"\ncolumns.normal_load = "N"\n'
        'columns.tangential_displacement_y = "y"\n'
    )
    with refused("expected tangential_displacement, the component along x"):
        hs.load(path)


def test_blocks_reach_pairs_in_turn(tmp_path):
    path = tmp_path / "blocks.toml"
    path.write_text(
        SCENARIO
        + """[[loading.blocks]]
waypoints = [{ after = "1 s", normal_load = "50 mN" }]
[[loading.blocks]]
each = { after = "1 s", tangential_displacement = [["5 nm", 0], [0, "5 nm"]] }
waypoints = [{ after = "1 s", tangential_displacement = [0, 0] }]
"""
    )
    values = [event.value for event in hs.load(path).events() if event.channel == "tangential"]
    assert list(dict.fromkeys(values)) == [(5e-9, 0.0), (0.0, 0.0), (0.0, 5e-9)]


COMMANDS = {
    "show {nc}": 0,
    "state {log} --at 1.5": 0,
    "table {nc} time-series -o {out}.csv": 0,
    "plot {nc} --picture hodograph --with drive=true -o {out}.png": 0,
    "report {nc} -o {out}.html": 0,
    "loops {nc}": "supports one tangential direction",
    "table {nc} cycle-drift -o {out}.csv": "cycle_drift supports one tangential direction",
    "plot {nc} --picture loop -o {out}.png": "the picture loops supports one tangential direction",
    "plot {nc} --picture slip-annulus --with steps=2,-1 -o {out}.png": 0,
    "fmu {toml} -o {out}.fmu": 0,
    "fmu {toml} --directions 1 -o {out}.fmu": "the events move in two tangential directions",
    "reduce {toml} -o {out}.json": "one tangential direction",
}


@mark.filterwarnings("ignore::UserWarning")
def test_every_command_supports_or_refuses_two_directions(tmp_path, scenario, monkeypatch):
    monkeypatch.setattr(unit_file, "compile_unit", lambda *_: b"")
    hs.run(scenario, tmp_path / "plane.nc", compression="zlib")
    places = {"nc": tmp_path / "plane.nc", "log": tmp_path / "plane.history", "toml": scenario}
    for number, (command, expected) in enumerate(COMMANDS.items()):
        words = [word.format(out=tmp_path / f"out{number}", **places) for word in command.split()]
        found = CliRunner().invoke(main, words)
        if expected == 0:
            assert found.exit_code == 0, (command, found.output)
        else:
            assert found.exit_code != 0
            assert expected in " ".join(found.output.split()), (command, found.output)
            assert "Traceback" not in found.output


def test_tractions_of_an_asperity_add_up_to_its_load_and_are_at_the_limit_where_it_slips():
    way = ((3e-8, 0.0), (3e-8, 2e-8), (-1e-8, 2e-8), (-1e-8, -2e-8), (-1.1e-8, -1.9e-8))
    events = [
        hs.NormalLoad(0.0, 4e-3),
        *(hs.TangentialDisplacement(t + 1.0, to) for t, to in enumerate(way)),
    ]
    ensemble = hs.Ensemble(PAIR, [0.0, -20e-9, -35e-9], [10e-6, 30e-6, 15e-6], 0.2)
    history = hs.replay(ensemble, events)
    ends = 0
    for step in range(history.sizes["step"]):
        for label in history.asperity.values:
            one, row = (
                history.contact.asperity(int(label), step),
                history.isel(step=step).sel(asperity=label),
            )
            limit = one.friction * one.normal_load
            # a state is reached in other steps than a row, each of them settled to 1e-3
            assert_allclose(one.tangential_load, row.tangential_load, 0.0, 1e-3 * limit)
            # of a Hertz pressure over a circle the integral is the load
            radius = one.contact_radius * np.sqrt((np.arange(20000) + 0.5) / 20000)
            load = one.traction(radius).mean(axis=0) * np.pi * one.contact_radius**2
            # the sum over the area is off by the square roots at the rings
            assert_allclose(load, one.tangential_load, 0.0, 1e-4 * limit)
            share = np.hypot(*one.traction(radius).T) / (one.friction * one.pressure(radius))
            assert share.max() < 1 + 1e-3
            rings = one.superposition[0]
            slips = rings[(rings > one.stick_radius) & (rings < one.contact_radius)]
            at = np.hypot(*one.traction(slips).T) / (one.friction * one.pressure(slips))
            assert_allclose(at, 1.0, atol=1e-3)
            ends += slips.size
    assert ends > 30
    apart = hs.replay(ensemble, [*events, hs.NormalDisplacement(7.0, -1e-9)], hold=False)
    with refused("does not touch at any of the steps"):
        hs.plot(apart, picture="slip-annulus", steps=[-1])
    with refused("reversal_points need motion along one line"):
        assert one.reversal_points


def test_a_stepper_of_two_directions_goes_as_advance_does():
    ensemble = hs.Ensemble(PAIR, [0.0, -20e-9], 1e-5, 0.2)
    state = ensemble.advance(ensemble.enter_plane(ensemble.initial_state()), normal_load=4e-3)
    stepper = ensemble.stepper(state, saturate=True)
    for to in ((1e-8, 0.0), (1e-8, 1e-8)):
        stepper.step(tangential_displacement=to)
        kept, state = stepper.save(), ensemble.advance(state, tangential_displacement=to)
    assert stepper.save() == state
    stepper.step(tangential_load=(1.0, 0.0))
    assert np.hypot(*stepper.tangential_load) == approx(0.2 * 4e-3, rel=2e-3)
    stepper.restore(kept)
    assert_array_equal(stepper.tangential_load, state.tangential_load)
    other = hs.Ensemble(PAIR, [0.0, -20e-9], 1e-5, 0.3)
    with raises(InputError):
        stepper.restore(other.enter_plane(other.initial_state()))
    for wrong in ({"tangential_displacement": 1e-9}, {"tangential_displacement": (math.nan, 0.0)}):
        with raises(InputError):
            stepper.step(**wrong)
    assert stepper.save() == state
    with refused("the state has two tangential directions"):
        stepper.slopes()


def test_a_sweep_uses_the_magnitude_of_vectors(scenario):
    found = hs.sweep(
        scenario, {"friction.coefficient": [0.1, 0.2]}, outputs=["peak_tangential_load"]
    )
    history = hs.run(scenario)
    expected = np.linalg.norm(history.total_tangential_load, axis=-1).max()
    assert found.peak_tangential_load.values[1] == expected


DEAD_WEIGHT = [
    hs.NormalLoad(0.0, 20e-3),
    hs.TangentialLoad(1.0, (None, 1e-3)),
    hs.TangentialDisplacement(2.0, (8e-9, None)),
    hs.TangentialDisplacement(3.0, (-8e-9, None)),
    hs.TangentialLoad(3.0, (None, 2e-3)),
    hs.TangentialLoad(4.0, (1e-3, None)),
    hs.TangentialDisplacement(4.0, (None, 9e-9)),
    hs.TangentialDisplacement(4.0, (2e-9, None)),
]


def test_a_replay_drives_each_component_by_its_own_waypoints(tmp_path):
    history = hs.replay(ENSEMBLE, DEAD_WEIGHT, substeps=2, hold=False)
    load, displacement = (
        history.total_tangential_load.values,
        history.tangential_displacement.values,
    )
    assert_allclose(load[:7, 1], [0, 0.5e-3, 1e-3, 1.25e-3, 1.5e-3, 1.75e-3, 2e-3], atol=1e-12)
    # before its first waypoint x is free of load, and begins to be driven at the event before it
    assert_allclose(displacement[2:7, 0], [0, 4e-9, 8e-9, 0, -8e-9], atol=1e-16)
    # x by load, y by displacement, and immediately x back to a displacement
    assert_allclose(displacement[-1], [2e-9, 9e-9], atol=1e-16)
    state = ENSEMBLE.initial_state()
    for targets in (
        {"normal_load": 20e-3},
        {"tangential_load": (None, 1e-3)},
        {"tangential_displacement": (8e-9, None), "tangential_load": (None, 1.5e-3)},
        {"tangential_displacement": (-8e-9, None), "tangential_load": (None, 2e-3)},
        {"tangential_displacement": (None, 9e-9), "tangential_load": (1e-3, None)},
        {"tangential_displacement": (2e-9, None)},
    ):
        state = ENSEMBLE.advance(state, **targets)
    found = hs.Replay(ENSEMBLE, DEAD_WEIGHT, hold=False).state()
    assert_array_equal(found.tangential_load, state.tangential_load)
    assert found.dissipated_energy == state.dissipated_energy
    log = hs.EventLog.create(tmp_path / "a.history", ENSEMBLE, DEAD_WEIGHT[:3])
    log.append(DEAD_WEIGHT[3:])
    assert list(log.events()) == DEAD_WEIGHT
    assert log.state(3.5) == hs.Replay(ENSEMBLE, DEAD_WEIGHT, hold=False).state(3.5)
    fork = log.fork(2.5, tmp_path / "b.history")
    limit = 0.2 * 20e-3
    assert_allclose(fork.state().tangential_load, log.state(2.5).tangential_load, atol=1e-3 * limit)
    log.close()
    hs.run(tmp_path / "a.history", tmp_path / "a.nc")
    assert hs.verify(tmp_path / "a.nc")


def test_a_scenario_drives_x_under_a_load_in_y(tmp_path):
    path = tmp_path / "weight.toml"
    loading = """
[loading]
hold = true
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, tangential_load = { y = "3 mN" }, tangential_displacement = { x = 0 } },
    { time = 2, tangential_displacement = { x = "10 nm" } },
    { time = 3, tangential_displacement = ["5 nm", "1 nm"] },
    { time = 4, normal_load = "60 mN" },
]
"""
    path.write_text(SCENARIO + loading)
    events = [event for event in hs.load(path).events() if event.channel == "tangential"]
    assert events == [
        hs.TangentialLoad(1.0, (None, 3e-3)),
        hs.TangentialDisplacement(1.0, (0.0, None)),
        hs.TangentialDisplacement(2.0, (10e-9, None)),
        hs.TangentialLoad(2.0, (None, 3e-3)),
        hs.TangentialDisplacement(3.0, (5e-9, 1e-9)),
        hs.TangentialDisplacement(4.0, (5e-9, 1e-9)),
    ]
    history = hs.run(path)
    assert_allclose(history.total_tangential_load[1:3, 1], 3e-3, rtol=1e-9)
    for wrong, says in (
        ("{ x = 1, z = 2 }", "unknown key"),
        ('{ x = "1 N" }', "not a unit of a length"),
        ('{ y = "1 nm" }', "tangential_load and tangential_displacement together"),
        ("{}", "None in one of them"),
    ):
        path.write_text(SCENARIO + loading.replace("{ x = 0 }", wrong))
        with refused(says):
            hs.load(path).events()


def test_messages():
    check_messages(globals())
