import pickle

import numpy as np
from golden import check_messages, refused
from pytest import approx, mark

import historysim as hs
from historysim.measured.fit_model import build_model

MODULUS, RADIUS, WORK, FRICTION = 1e11, 1e-5, 0.05, 0.3
PAIR = hs.MaterialPair.from_moduli(contact_modulus=MODULUS, shear_modulus=0.25 * MODULUS)
PULL = 2 * np.pi * RADIUS * WORK
DMT = hs.attraction.DMT(work_of_adhesion=WORK)


def sphere():
    return hs.Ensemble(PAIR, 0.0, RADIUS, FRICTION, attraction=DMT)


def rough(seed=1, count=30, friction=FRICTION):
    rng = np.random.default_rng(seed)
    height, radius = rng.normal(size=count) * 2e-9, RADIUS * rng.uniform(0.5, 1.5, count)
    return hs.Ensemble(PAIR, height, radius, friction, attraction=DMT)


def external_load(ensemble, approach):
    """Load from outside at approaches, summed over touching asperities."""
    depth = np.atleast_1d(approach)[:, None] - ensemble.first_touch
    each = 4 / 3 * MODULUS * np.sqrt(ensemble.summit_radius) * np.maximum(depth, 0) ** 1.5
    return (each - 2 * np.pi * WORK * ensemble.summit_radius * (depth > 0)).sum(axis=1)


def test_one_sphere_snaps_in_and_is_pulled_off():
    ball = sphere()
    state = ball.advance(ball.initial_state(), normal_load=0.0)
    assert state.approach == approx(
        ((3 * PULL / (4 * MODULUS)) ** 2 / RADIUS) ** (1 / 3), rel=1e-12
    )
    contact = ball.asperity(0, state).contact_radius
    assert contact == approx((3 * PULL * RADIUS / (4 * MODULUS)) ** (1 / 3), rel=1e-12)
    assert (state.normal_load, state.attraction) == approx((0.0, PULL), abs=1e-12 * PULL)
    # ∫ (F - P) dd up to P = F
    assert (state.jumps, state.jump_energy) == (
        1,
        approx(0.6 * PULL * state.approach, rel=1e-9),
    )
    held = ball.advance(state, tangential_load=0.999 * FRICTION * PULL)
    assert held.tangential_load == approx(0.999 * FRICTION * PULL, rel=1e-12)
    pulled = ball.advance(state, normal_load=-PULL)
    assert pulled.normal_load == approx(-PULL, rel=1e-8)
    assert ball.pull_off(state.approach) == (approx(-PULL, rel=1e-12), 0.0)
    apart = ball.advance(pulled, normal_displacement=-1e-9)
    assert (apart.normal_load, apart.attraction, apart.contact_load) == (0.0, 0.0, 0.0)


@mark.parametrize("seed", range(3))
def test_loads_of_an_ensemble_are_met_first_in_the_direction_of_the_path(seed):
    ensemble = rough(seed)
    deepest = ensemble.resolve(0.0, 60 * PULL)[1]
    fine = np.unique(
        np.concatenate([np.linspace(0, deepest, 400_001)[1:], ensemble.first_touch + 1e-18])
    )
    fine = fine[(fine > 0) & (fine <= deepest)]
    load = external_load(ensemble, fine)
    targets = [0.0, 5 * PULL, 40 * PULL, 10 * PULL, 0.5 * load.min(), 30 * PULL, 0.9 * load.min()]
    events = [hs.NormalLoad(float(time), target) for time, target in enumerate(targets)]
    history = hs.replay(ensemble, events)
    here = 0.0
    for step, target in enumerate(targets):
        rises = target >= (external_load(ensemble, here)[0] if here else 0.0)
        later = fine >= here if rises else fine <= here
        met = later & ((load >= target) if rises else (load <= target))
        expected = fine[met][0 if rises else -1]
        here = ensemble.highest_summit - history.separation[step].item()
        assert here == approx(expected, abs=2 * deepest / 400_000)
        assert history.total_normal_load[step].item() == approx(target, abs=1e-9 * PULL)
        pull = 2 * np.pi * WORK * ensemble.summit_radius[ensemble.first_touch < here].sum()
        assert history.total_attraction[step].item() == approx(pull, rel=1e-12)
    assert ensemble.pull_off(deepest)[0] == approx(load.min(), rel=1e-4)


def test_energy_is_balanced_over_a_loop_of_the_normal_load():
    """Work from outside = what is lost in jumps, for a path that begins and ends with the same contacts."""
    ensemble = rough()
    start = ensemble.advance(ensemble.initial_state(), normal_load=0.0)
    targets = np.concatenate([np.linspace(0, 50, 2001)[1:], np.linspace(50, 0, 2001)[1:]]) * PULL
    state, work = start, 0.0
    for target in targets:
        moved = ensemble.advance(state, normal_load=float(target))
        work += 0.5 * (moved.normal_load + state.normal_load) * (moved.approach - state.approach)
        state = moved
    before, after = (
        {float(touch) for touch in ensemble.first_touch if touch < s.approach}
        for s in (start, state)
    )
    elastic = [
        8
        / 15
        * MODULUS
        * (
            np.sqrt(ensemble.summit_radius)
            * np.maximum(s.approach - ensemble.first_touch, 0) ** 2.5
        ).sum()
        - (
            2
            * np.pi
            * WORK
            * ensemble.summit_radius
            * np.maximum(s.approach - ensemble.first_touch, 0)
        ).sum()
        for s in (start, state)
    ]
    assert len(after) >= len(before)
    assert state.jumps > start.jumps
    assert state.jump_energy - start.jump_energy == approx(
        work - (elastic[1] - elastic[0]), rel=1e-3
    )


def test_the_tangential_memory_is_that_of_the_contact_without_attraction():
    ensemble = rough()
    plain = hs.Ensemble(PAIR, ensemble.summit_height, ensemble.summit_radius, FRICTION)
    rng = np.random.default_rng(3)
    events = []
    for time in range(25):
        events += [
            hs.NormalDisplacement(time, rng.uniform(0, 8e-9)),
            hs.TangentialDisplacement(time, rng.uniform(-1, 1) * 2e-9),
        ]
    first, second = hs.replay(ensemble, events), hs.replay(plain, events)
    for name in (
        "tangential_load",
        "stick_radius",
        "normal_load",
        "dissipated_energy",
        "friction_limit",
    ):
        assert first[name].values.tobytes() == second[name].values.tobytes()
    difference = second.total_normal_load - first.total_normal_load
    assert difference.values == approx(first.total_attraction.values, rel=1e-9)


@mark.parametrize("held", ["tangential_load", "tangential_displacement"])
@mark.parametrize("seed", [1, 2])
def test_two_directions_are_those_of_the_contact_under_both_loads(held, seed):
    """A sphere under N and F; a snap-in is a straight path in approach and displacement."""
    rings = hs.Rings(8, 12)
    ball = hs.Ensemble(PAIR, 0.0, RADIUS, FRICTION, attraction=DMT, rings=rings)
    plain = hs.Ensemble(PAIR, 0.0, RADIUS, FRICTION, rings=rings)
    random = np.random.default_rng(seed)
    reach = {"tangential_load": 0.4 * FRICTION * PULL, "tangential_displacement": 4e-10}[held]
    apart = {"normal_displacement": -1e-10, "tangential_displacement": (0.0, 0.0)}
    attracted, pressed = (body.advance(body.initial_state(), **apart) for body in (ball, plain))
    snap = {"tangential_displacement": tuple(random.uniform(-1, 1, 2) * 4e-10)}
    attracted = ball.advance(attracted, normal_load=0.0, **snap)
    assert attracted.jumps == 1
    pressed = plain.advance(pressed, normal_displacement=attracted.approach, **snap)
    for _ in range(8):
        load, goal = PULL * random.uniform(-0.3, 3.0), tuple(random.uniform(-1, 1, 2) * reach)
        attracted = ball.advance(attracted, normal_load=load, saturate=True, **{held: goal})
        pressed = plain.advance(pressed, normal_load=load + PULL, saturate=True, **{held: goal})
        assert attracted.contact_load == approx(pressed.normal_load, rel=1e-9)
        for name in ("tangential_load", "tangential_displacement"):
            found, expected = (np.array(getattr(state, name)) for state in (attracted, pressed))
            scale = FRICTION * pressed.normal_load if name == "tangential_load" else 4e-10
            assert found == approx(expected, abs=2e-3 * scale)
    assert attracted.jumps == 1
    assert np.hypot(*attracted.tangential_load) <= FRICTION * attracted.contact_load * (1 + 1e-9)


@mark.parametrize("substeps", [1, 7])
def test_a_ramp_of_both_loads_crosses_jumps(substeps):
    ensemble = rough()
    events = [
        hs.NormalLoad(0, 5 * PULL),
        hs.TangentialLoad(0, 0.0),
        hs.NormalLoad(1, 40 * PULL),
        hs.TangentialLoad(1, 4 * PULL),
    ]
    events += [hs.NormalLoad(2, 8 * PULL), hs.TangentialLoad(2, -2 * PULL)]
    history = hs.replay(ensemble, events, substeps=substeps)
    time = history.time.values
    assert history.total_normal_load.values == approx(
        np.interp(time, [0, 1, 2], [5 * PULL, 40 * PULL, 8 * PULL]), rel=1e-9
    )
    wanted = np.interp(time, [0, 1, 2], [0, 4 * PULL, -2 * PULL])
    assert history.total_tangential_load.values == approx(wanted, abs=1e-9 * PULL)
    assert (np.diff(history.jumps) >= 0).all()
    assert history.jumps[-1] == hs.replay(ensemble, events).jumps[-1]
    whole = hs.replay(ensemble, events).total_dissipated_energy[-1].item()
    assert history.total_dissipated_energy[-1].item() == approx(whole, rel=1e-5)


def test_a_log_a_state_and_a_pickle_hold_the_attraction(tmp_path):
    ensemble, events = rough(), [hs.NormalLoad(0, 9 * PULL), hs.TangentialLoad(1, PULL)]
    with hs.EventLog.create(tmp_path / "pulled.history", ensemble) as log:
        log.append(events[0])
        log.append(events[1])
        assert log.verify().whole
        assert log.ensemble.attraction == DMT
        assert log.state() == hs.Replay(ensemble, events).state()
        again = log.replay()
    direct = hs.replay(ensemble, events)
    for name in ("total_normal_load", "total_attraction", "jumps", "jump_energy"):
        assert again[name].values.tobytes() == direct[name].values.tobytes()
    state = pickle.loads(pickle.dumps(hs.Replay(ensemble, events).state()))
    copy = pickle.loads(pickle.dumps(ensemble))
    assert copy.advance(state, tangential_load=0.0).normal_load == approx(9 * PULL, rel=1e-12)


def test_the_force_of_a_meniscus():
    meniscus = hs.attraction.Meniscus(surface_tension=0.072, contact_angles=(np.pi / 3, np.pi / 2))
    assert meniscus.forces(np.array([RADIUS])) == approx(
        2 * np.pi * RADIUS * 0.072 * 0.5, rel=1e-12
    )


SCENARIO = """
[materials]
contact_modulus = "100 GPa"
shear_modulus = "25 GPa"
[surface]
kind = "{kind}"
radius = "10 µm"
{more}
[friction]
coefficient = 0.3
[attraction]
{law}
[loading]
waypoints = [{{ time = 0, normal_load = 0 }}, {{ time = 1, normal_load = "-1 µN" }}]
"""


def test_a_scenario_has_the_section(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(
        SCENARIO.format(kind="sphere", more="", law='law = "dmt"\nwork_of_adhesion = 0.05'),
        encoding="utf-8",
    )
    history = hs.run(path)
    assert history.total_normal_load.values == approx([0.0, -1e-6], abs=1e-18)
    assert history.attrs["attraction_law"].startswith("DMT")


@mark.parametrize(
    "given, reason",
    [
        (
            {"kind": "sphere", "more": "", "law": 'law = "jkr"\nwork_of_adhesion = 0.05'},
            "attraction: .*disputed",
        ),
        (
            {
                "kind": "cylinder",
                "more": "length = 1\nreference_depth = 1",
                "law": 'law = "dmt"\nwork_of_adhesion = 1',
            },
            "attraction: ",
        ),
    ],
)
def test_a_scenario_is_refused_with_the_reason(tmp_path, given, reason):
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(**given), encoding="utf-8")
    with refused(reason):
        hs.run(path)


@mark.parametrize("seed", [1, 2, 3])
@mark.parametrize("held", [hs.TangentialLoad, hs.TangentialDisplacement])
def test_shortest_histories_lead_to_the_same_place(seed, held):
    ensemble, random = rough(seed), np.random.default_rng(seed)
    reach = PULL if held is hs.TangentialLoad else 2e-9
    events = [hs.NormalLoad(0.0, 12 * PULL), held(0.0, 0.0)]
    for time in range(1, 13):
        events += [
            hs.NormalLoad(float(time), random.uniform(0, 25) * PULL),
            held(float(time), random.uniform(-1, 1) * reach),
        ]
    end = hs.Replay(ensemble, events, saturate=True).state()
    shortened = hs.shortest(hs.Replay(ensemble, events, saturate=True))
    assert len(shortened) <= len(events)
    for retraced in (shortened, end.shortest_history()):
        reached = hs.Replay(ensemble, retraced, saturate=True, hold=True).state()
        for name in ("approach", "normal_load", "tangential_displacement", "tangential_load"):
            scale = {"approach": 1e-9, "tangential_displacement": 1e-9}.get(name, PULL)
            expected = getattr(end, name)
            assert getattr(reached, name) == approx(expected, rel=1e-9, abs=1e-9 * scale)
        onward = {"normal_displacement": 1.1 * end.approach, "tangential_displacement": -1e-9}
        first, second = (ensemble.advance(state, **onward) for state in (end, reached))
        assert second.tangential_load == approx(first.tangential_load, rel=1e-8)


def test_reasons_name_attraction():
    history = hs.replay(rough(), [hs.NormalLoad(0.0, 5 * PULL)])
    with refused("attraction the contact jumps"):
        history.contact.cycles()
    with refused("a fit has no attraction"):
        build_model(rough(), hs.Instrument())
    with refused(r"reduced models .* have no attraction"):
        rough().stepper()


def test_the_pull_off_of_a_history_and_its_picture():
    ensemble = rough()
    deepest = ensemble.resolve(0.0, 20 * PULL)[1]
    depths = np.append(np.linspace(-1e-9, deepest, 40), np.linspace(deepest, -1e-9, 40))
    history = hs.replay(
        ensemble, [hs.NormalDisplacement(float(k), depth) for k, depth in enumerate(depths)]
    )
    curve = history.contact.pull_off(points=2001)
    assert curve.attrs["pull_off_load"] == approx(curve.normal_load.values.min(), rel=1e-9)
    assert curve.normal_load.values == approx(
        external_load(ensemble, curve.approach.values), rel=1e-9, abs=1e-9 * PULL
    )
    assert history.total_normal_load.values.min() >= curve.attrs["pull_off_load"]
    hs.plot(history, picture="pull-off")
    assert (
        "peak normal load, which is that from outside"
        in dict(history.contact.summary())["attraction"]
    )


def test_messages():
    check_messages(globals())


def test_loops_say_that_their_coefficient_leaves_attraction_out():
    ball = sphere()
    stroke = 10 * FRICTION * ball.advance(ball.initial_state(), normal_load=PULL).approach
    turns = stroke * np.array([1, -1, 1, -1, 1])
    drive = [hs.TangentialDisplacement(1.0 + t, u) for t, u in enumerate(turns.tolist())]
    history = hs.replay(ball, [hs.NormalLoad(0.0, PULL), *drive], substeps=100)
    loops = hs.loops(history)
    # the contact slides at μ times the load from outside and the attraction together
    assert loops.friction_coefficient == approx(2 * FRICTION, rel=1e-6)
    note = dict(loops.summary())["friction coefficient"]
    assert (
        note == "is over the load from outside alone; the asperities attract, with up to 3.142 µN"
    )
    without = hs.loops(history.drop_vars("total_attraction"))
    assert "friction coefficient" not in dict(without.summary())
