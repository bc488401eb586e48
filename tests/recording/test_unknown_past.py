"""Bounds of the loads of a contact with an unknown past."""

import netCDF4
import numpy as np
from golden import refused
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark

import historysim as hs
from historysim.loads.schedule import Start
from historysim.recording.recorder import DatasetRecorder

ROUNDING = 1e-11  # of values, relative to the largest ones of the history
SPRING = {"instrument": hs.Instrument(0.5)}


def contact(*, several, attraction=None):
    random = np.random.default_rng(1)
    height, radius = -random.uniform(0, 0.03, 20), random.uniform(0.5, 1.0, 20)
    return hs.Ensemble(
        PAIR,
        height,
        radius,
        random.uniform(0.1, 0.6, 20) if several else 0.5,
        attraction=attraction,
    )


def loads(kind, seed=2, count=20, reach=1.0):
    random = np.random.default_rng(seed)
    largest = reach * (0.012 if kind is hs.TangentialDisplacement else 1.6e-3)
    events = [hs.NormalLoad(0.0, 0.01), kind(0.0, 0.0)]
    for time in range(1, count):
        events += [
            hs.NormalLoad(float(time), random.uniform(6e-3, 14e-3)),
            kind(float(time), random.uniform(-1, 1) * largest),
        ]
    return events


CASES = {
    "displacements": (hs.TangentialDisplacement, True, {}),
    "displacements of one coefficient": (hs.TangentialDisplacement, False, {}),
    "drive": (hs.TangentialDisplacement, False, SPRING),
    "loads": (hs.TangentialLoad, False, {}),
    "loads behind an instrument": (hs.TangentialLoad, False, SPRING),
    "displacements with attraction": (hs.TangentialDisplacement, True, {}),
}
PULL = hs.attraction.DMT(work_of_adhesion=1e-4)


@mark.parametrize("case", CASES)
def test_no_past_is_outside_the_bounds(case):
    """120 random pasts in all cases together, which end where the contact, or its drive, is at first."""
    kind, several, options = CASES[case]
    attraction = PULL if case.endswith("attraction") else None
    ensemble = contact(several=several, attraction=attraction)
    job = hs.Replay(
        ensemble, loads(kind), substeps=3, record="all", saturate=True, past="unknown", **options
    )
    bounded = job.dataset()
    names = [name.removesuffix("_lower") for name in bounded if name.endswith("_lower")]
    per_asperity = case.startswith("displacements")
    assert ("tangential_load" in names) == per_asperity
    assert ("tangential_displacement" in names) != per_asperity
    drive = options if kind is hs.TangentialDisplacement else {}
    place = job.state(until=0.0).approach
    random = np.random.default_rng(3)
    for _ in range(20):
        state = ensemble.initial_state()
        for _ in range(random.integers(1, 8)):
            target = {"normal_displacement": random.uniform(-2e-3, 0.05)}
            state = ensemble.advance(
                state, tangential_displacement=random.uniform(-0.03, 0.03), **target
            )
        there = random.uniform(-0.03, 0.03)
        state = ensemble.advance(state, normal_displacement=place, tangential_displacement=there)
        state = ensemble.advance(state, tangential_displacement=0.0, **drive)
        target = job.recorder(DatasetRecorder)
        job.walk(target, start=Start(state))
        history = target.dataset({})
        for name in names:
            size = ROUNDING * float(abs(bounded[name]).max())
            assert (history[name] - bounded[f"{name}_lower"]).min() >= -size
            assert (bounded[f"{name}_upper"] - history[name]).min() >= -size


def test_full_slip_forgets_the_past():
    turns = [0.0, 3e-3, -3e-3, 0.05, 0.01, 0.04]
    events = [
        hs.NormalLoad(0.0, 0.01),
        *(hs.TangentialDisplacement(float(t), u) for t, u in enumerate(turns)),
    ]
    history = hs.replay(contact(several=True), events, past="unknown", substeps=10)
    width = (history.total_tangential_load_upper - history.total_tangential_load_lower).values
    limit = float(history.friction_limit.max())
    assert width[0] == approx(2 * limit, rel=1e-9)
    forgotten = history.attrs["past_forgotten_time"]
    assert 3.0 - 0.9 <= forgotten <= 3.0
    after = history.time.values >= forgotten
    assert width[after].max() <= 1e-12 * limit
    assert width[~after].min() > 1e-12 * limit
    # the history itself is that of an untouched contact, as without bounds
    plain = hs.replay(contact(several=True), events, substeps=10)
    assert history.drop_vars(
        [name for name in history if name.endswith(("_lower", "_upper"))]
    ).equals(plain)


def test_a_past_that_is_not_forgotten_has_no_time():
    events = [
        hs.NormalLoad(0.0, 0.01),
        hs.TangentialDisplacement(0.0, 0.0),
        hs.TangentialDisplacement(1.0, 1e-4),
    ]
    assert np.isnan(
        hs.replay(contact(several=True), events, past="unknown", hold=True).attrs[
            "past_forgotten_time"
        ]
    )


def test_an_open_gap_has_no_past():
    events = [
        hs.NormalDisplacement(0.0, -1e-3),
        hs.NormalDisplacement(1.0, 0.02),
        hs.TangentialDisplacement(2.0, 1e-3),
    ]
    history = hs.replay(contact(several=True), events, past="unknown", hold=True)
    assert history.attrs["past_forgotten_time"] == 0.0
    assert history.total_tangential_load_lower.equals(history.total_tangential_load)


def test_the_loop_has_a_band():
    history = hs.replay(contact(several=True), loads(hs.TangentialDisplacement), past="unknown")
    figure = hs.plot(history, picture="loop")
    labels = [collection.get_label() for axes in figure.axes for collection in axes.collections]
    assert "bounds of all pasts" in labels


UNIFORM = loads(hs.TangentialDisplacement)
WORN = hs.Ensemble(PAIR, 0.0, 1.0, 0.5, wear=hs.wear.ArchardWear(coefficient=1e-4, hardness=1.0))
REFUSED = {
    "expected 'untouched' or 'unknown'": (contact(several=False), UNIFORM, {"past": "forgotten"}),
    "two tangential directions": (
        contact(several=False),
        [hs.NormalLoad(0.0, 0.01), hs.TangentialDisplacement(1.0, (1e-3, 0.0))],
        {},
    ),
    "evolves": (WORN, UNIFORM, {}),
    "changes friction": (contact(several=False), [*UNIFORM, hs.FrictionChange(30.0, 0.2)], {}),
    "20 different friction coefficients": (
        contact(several=True),
        loads(hs.TangentialLoad, reach=0.1),
        {},
    ),
    "different friction coefficients, which": (contact(several=True), UNIFORM, SPRING),
    "by loads and by displacements": (
        contact(several=False),
        [*UNIFORM, hs.TangentialLoad(30.0, 0.0)],
        {},
    ),
}


@mark.parametrize("reason", REFUSED)
def test_contacts_without_bounds_are_refused(reason):
    ensemble, events, options = REFUSED[reason]
    with refused(reason):
        hs.replay(ensemble, events, **({"past": "unknown", "hold": True} | options))


SCENARIO = """
materials = { contact_modulus = 1.0, shear_modulus = 0.25 }
surface = { kind = "summits", height = [0.0, -0.01, -0.02], radius = [1.0, 0.7, 0.8] }
friction = { coefficient = 0.5 }

[loading]
past = "unknown"
hold = true
substeps = 7
waypoints = [
    { time = 0, normal_load = 0.01, tangential_displacement = 0 },
    { time = 1, tangential_displacement = 3e-3 },
    { time = 2, tangential_displacement = -0.05, normal_load = 0.02 },
    { time = 3, tangential_displacement = 0.01 },
]
"""


@fixture
def scenario(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@mark.parametrize("compression", ["none", "zlib"])
@mark.parametrize("record", [None, "totals"])
def test_written_results_have_the_bounds(scenario, tmp_path, compression, record, monkeypatch):
    monkeypatch.setattr("historysim.recording.recorder.ROWS_AT_ONCE", 5)
    output = tmp_path / "s.nc"
    written = hs.run(scenario, output, compression=compression, record=record).load()
    written.close()
    expected = hs.replay(
        hs.load(scenario).ensemble(), hs.load(scenario).events(), substeps=7, past="unknown"
    )
    names = [name for name in expected if name.endswith(("_lower", "_upper"))]
    for name in names if record is None else names[:2]:
        assert written[name].identical(expected[name].drop_vars(()))
    assert written.attrs["past_forgotten_time"] == expected.attrs["past_forgotten_time"]
    assert hs.verify(output)
    assert "forgotten at t = " in dict(written.contact.summary())["past"]
    with hs.EventLog(tmp_path / "s.history") as log:
        assert dict(log.summary())["past"].startswith("unknown")
        assert log.replay().attrs["past_forgotten_time"] == written.attrs["past_forgotten_time"]


@mark.parametrize("name", ["tangential_load_upper", "past_forgotten_time"])
def test_changed_bounds_are_found(scenario, tmp_path, name):
    output = tmp_path / "s.nc"
    hs.run(scenario, output).close()
    with netCDF4.Dataset(output, "a") as file:
        if name in file.variables:
            file[name][5, 1] += 1e-9
        else:
            file.setncattr(name, np.float64(0.0))
    verification = hs.verify(output)
    assert [difference.name for difference in verification.differences] == [name]


def test_a_scenario_states_its_past(scenario):
    assert "unknown" in dict(hs.show(scenario))["past"]


REFUSED_KEYS = {
    'loading.past: \'forgotten\'; expected "untouched" or "unknown"': ("unknown", "forgotten"),
    "loading.past: .*two tangential directions": ("= 3e-3", "= [3e-3, 1e-3]"),
    "loading.past: .*3 different friction": (
        "coefficient = 0.5 }",
        "coefficient = [0.1, 0.2, 0.3] }\ninstrument = { lateral_stiffness = 1.0 }",
    ),
}


@mark.parametrize("reason", REFUSED_KEYS)
def test_a_scenario_without_bounds_is_refused(scenario, reason):
    scenario.write_text(SCENARIO.replace(*REFUSED_KEYS[reason]), encoding="utf-8")
    with refused(reason):
        hs.load(scenario).build()


def test_a_store_has_no_bounds(scenario, tmp_path):
    with refused(r"expected a netCDF file \(.nc\)"):
        hs.run(scenario, tmp_path / "s.zarr")
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]
