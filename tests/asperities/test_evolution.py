"""Contacts that evolve, against springs in small steps and closed forms."""

import itertools

import numpy as np
from pairs import GLASS
from pairs import UNIT as PAIR
from pytest import approx, mark, param

import historysim as hs
from historysim.asperities.laws import PowerLaw, ShearStrength, SlidFriction
from historysim.asperities.wear import ArchardWear, EnergyWear
from tests.support.evolving_springs import EvolvingSprings

HEIGHT, RADIUS = np.array([0.0, -0.012, -0.03]), np.array([1.0, 0.7, 0.9])
TOP = float(HEIGHT.max())
REACH = 0.12

LAWS = {
    "power": (
        PowerLaw(0.4, 0.01, -0.3),
        lambda n, _total, _r, _s: 0.4 * (np.maximum(n, 1e-30) / 0.01) ** -0.3,
    ),
    "rising": (PowerLaw(0.4, 0.01, 0.4), lambda n, _total, _r, _s: 0.4 * (n / 0.01) ** 0.4),
    "total": (
        PowerLaw(0.4, 0.01, -0.5, load="total"),
        lambda n, total, _r, _s: np.full(n.size, 0.4 * (max(total, 1e-30) / 0.01) ** -0.5),
    ),
    "strength": (
        ShearStrength(0.05),
        lambda n, _total, r, _s: 0.05 * np.pi * (0.75 * n * r) ** (2 / 3) / np.maximum(n, 1e-30),
    ),
    "slid": (
        SlidFriction([0.0, 0.05, 0.2], [0.5, 0.3, 0.4]),
        lambda _n, _total, _r, s: np.interp(s, [0.0, 0.05, 0.2], [0.5, 0.3, 0.4]),
    ),
}


def springs(coefficient, **options):
    return EvolvingSprings(1.0, 0.25, HEIGHT, RADIUS, coefficient, REACH, **options)


def random_targets(rng, coefficient, count):
    """Targets of all control modes that stay within the limit of the coarse springs."""
    probe = springs(coefficient, springs=100)
    targets = [(("load", 0.01), ("displacement", 0.0))]
    probe.go(*targets[0], 20)
    while len(targets) < count:
        by_load = rng.random() < 0.6
        load = rng.uniform(0.004, 0.025)
        normal = ("load", load) if by_load else ("displacement", probe.approach_at(load))
        loads = probe.normal_loads(probe.approach_at(load))
        limit = (coefficient(loads, loads.sum(), RADIUS, probe.slid) * loads).sum()
        now = probe.normal_loads()
        limit = min(limit, (coefficient(now, now.sum(), RADIUS, probe.slid) * now).sum())
        if rng.random() < 0.5:
            tangential = ("load", rng.uniform(-0.8, 0.8) * limit)
            if abs(probe.tangential_loads.sum()) > 0.85 * limit:
                tangential = (
                    "displacement",
                    probe.displacement
                    - np.sign(probe.tangential_loads.sum()) * rng.uniform(0.01, 0.04),
                )
        else:
            tangential = ("displacement", probe.displacement + rng.uniform(-0.06, 0.06))
        probe.go(normal, tangential, 20)
        targets.append((normal, tangential))
    return targets


def moved(ensemble, state, normal, tangential, **options):
    kinds = {"load": "load", "displacement": "displacement"}
    return ensemble.advance(
        state,
        **{
            f"normal_{kinds[normal[0]]}": normal[1],
            f"tangential_{kinds[tangential[0]]}": tangential[1],
        },
        **options,
    )


def of_program(ensemble, state):
    """Loads, displacements, energies and slid distances of the program in this state."""
    each = [ensemble.asperity(i, state) for i in range(len(ensemble))]
    return {
        "tangential load": np.array([one.tangential_load for one in each]),
        "displacement": np.array([state.tangential_displacement]),
        "approach": np.array([state.approach]),
        "dissipated": np.array([one.dissipated_energy for one in each]),
        "slid": np.zeros(len(each)) if state.evolved is None else state.evolved.slid_distance,
        "worn": np.zeros(len(each)) if state.evolved is None else state.evolved.worn_volume,
    }


def of_springs(row):
    return {
        "tangential load": row.tangential_loads.copy(),
        "displacement": np.array([row.displacement]),
        "approach": np.array([row.approach]),
        "dissipated": row.dissipated.copy(),
        "slid": row.slid.copy(),
        "worn": row.worn.copy(),
    }


def agree(found, coarse, fine, scales, floor):
    """Compare with two runs of springs, which differ by the error of the coarser one to first order."""
    for name, values in found.items():
        error = 3 * np.abs(coarse[name] - fine[name]).max() + floor * scales[name]
        assert np.abs(values - (2 * fine[name] - coarse[name])).max() <= error, name


SCALES = {
    "tangential load": 5e-3,
    "displacement": 0.05,
    "approach": 0.05,
    "dissipated": 3e-4,
    "slid": 0.1,
    "worn": 1e-4,
}


def compare(ensemble, coefficient, targets, **options):
    """Walk targets with the program and with springs, and compare after each."""
    rows = [springs(coefficient, **options) for _ in range(2)]
    state = ensemble.initial_state()
    for target in targets:
        for row, steps in zip(rows, (60, 120), strict=True):
            row.go(*target, steps)
        state = moved(ensemble, state, *target)
        agree(of_program(ensemble, state), of_springs(rows[0]), of_springs(rows[1]), SCALES, 5e-3)
    return state, rows


@mark.parametrize("name", LAWS)
@mark.parametrize("seed", [1, param(2, marks=mark.slow)])
def test_random_histories_under_each_law_agree_with_springs(name, seed):
    law, coefficient = LAWS[name]
    targets = random_targets(np.random.default_rng(seed), coefficient, 5 if seed == 1 else 8)
    compare(hs.Ensemble(PAIR, HEIGHT, RADIUS, law, follow_sliding=True), coefficient, targets)


def constant(n, _total, _r, _s):
    return np.full(n.size, 0.5)


WEAR = {
    "archard": (ArchardWear(coefficient=0.02, hardness=1.0), lambda n, s, _e: 0.02 * n * s),
    "energy": (EnergyWear(volume_per_energy=0.06), lambda _n, _s, e: 0.06 * e),
}


@mark.parametrize("name", WEAR)
@mark.parametrize("seed", [4, param(5, marks=mark.slow)])
def test_random_histories_of_wear_agree_with_springs(name, seed):
    wear, lost = WEAR[name]

    targets = random_targets(np.random.default_rng(seed), constant, 5)
    state, rows = compare(
        hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.5, wear=wear), constant, targets, lost=lost
    )
    assert rows[1].worn.max() > 1e-6
    deep = TOP - rows[1].lag
    assert state.evolved.summit_height == approx(deep, abs=3e-5)
    assert np.ptp(state.evolved.summit_height - HEIGHT) > 1e-4


def test_other_summits_are_new_contacts():
    """Some of the asperities change under loads that are restored; the others remember."""

    rng = np.random.default_rng(7)
    ensemble, row = hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.5), springs(constant)
    state = ensemble.initial_state()
    for target in random_targets(rng, constant, 5):
        row.go(*target, 150)
        state = moved(ensemble, state, *target)
    height, radius = rng.uniform(-0.02, 0.01, 2), rng.uniform(0.6, 1.2, 2)
    held = (("load", state.normal_load), ("displacement", state.tangential_displacement))
    state = moved(ensemble, state, *held)
    before = state.stored_energy
    state = ensemble.with_geometry(
        state, summit_height=height, summit_radius=radius, asperities=[0, 2]
    )
    row.renew([0, 2], height, radius, TOP)
    row.go(*held, 150)
    assert state.evolved.erased_energy == approx(row.erased, rel=0.02)
    assert 0 < state.evolved.erased_energy < before
    found, expected = of_program(ensemble, state), of_springs(row)
    for name in ("tangential load", "approach", "displacement"):
        assert found[name] == approx(expected[name], abs=4e-3 * SCALES[name]), name
    target = (("load", 0.012), ("displacement", state.tangential_displacement + 0.02))
    row.go(*target, 150)
    state = moved(ensemble, state, *target)
    assert of_program(ensemble, state)["tangential load"] == approx(
        row.tangential_loads, abs=4e-3 * SCALES["tangential load"]
    )


LIFTED = [
    (("load", 0.01), ("displacement", 0.03)),
    (("displacement", -0.004), ("displacement", 0.02)),
    (("displacement", 0.02), ("displacement", 0.025)),
    (("load", 0.012), ("displacement", 0.045)),
    (("load", 0.006), ("load", -0.001)),
]


@mark.parametrize("name", ["strength", "archard"])
def test_lift_off_and_contact_again_agree_with_springs(name):
    """What lifts off forgets its tractions, and keeps what it slid and lost."""
    if name in LAWS:
        law, coefficient = LAWS[name]
        ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, law, follow_sliding=True)
        compare(ensemble, coefficient, LIFTED)
        return
    wear, lost = WEAR[name]

    state, _ = compare(
        hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.5, wear=wear), constant, LIFTED, lost=lost
    )
    assert state.evolved.worn_volume.min() > 0


def test_totals_and_chosen_asperities_of_what_evolves():
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, LAWS["power"][0], wear=WEAR["archard"][0])
    events = [
        hs.NormalLoad(0.0, 0.01),
        hs.TangentialDisplacement(1.0, 0.03),
        hs.NormalLoad(1.0, 0.01),
    ]
    whole = hs.replay(ensemble, events, record="all")
    assert whole.identical(hs.replay(ensemble, events))
    some, totals = (
        hs.replay(ensemble, events, record=[2, 0]),
        hs.replay(ensemble, events, record="totals"),
    )
    for name in ("worn_volume", "slid_distance", "present_summit_height", "present_friction"):
        assert (
            some[name].values.tobytes()
            == np.ascontiguousarray(whole[name].values[:, [0, 2]]).tobytes()
        ), name
        assert name not in totals
    for name in totals.variables:
        assert totals[name].values.tobytes() == whole[name].values.tobytes(), name


EVOLVING = (
    {"yielding": "kogut-etsion"},
    {"yielding": "thornton", "follow_sliding": True},
    {"wear": ArchardWear(coefficient=1e-4, hardness=6e9)},
    {"follow_sliding": True},
)


@mark.parametrize("seed", range(4))
def test_a_state_is_never_changed_and_leads_to_the_same_again(seed):
    """Whatever evolves, and whatever is done: from the state, from it again, and from its bytes."""
    rng = np.random.default_rng(seed)
    pair = hs.MaterialPair.from_moduli(contact_modulus=43e9, shear_modulus=9.2e9, hardness=5.5e9)
    height, radius = np.append(0.0, rng.uniform(-60e-9, 0, 3)), rng.uniform(0.5e-6, 2e-6, 4)
    friction = [0.2, ShearStrength(0.3e9), SlidFriction([0, 1e-7], [0.2, 0.3])][seed % 3]
    ensemble = hs.Ensemble(pair, height, radius, friction, **EVOLVING[seed % 4])
    state = ensemble.initial_state()
    for _ in range(6):
        load, pull = rng.uniform(0.2, 4) * 1e-3, {"tangential_load": rng.uniform(-1, 1) * 1e-4}
        depth, moved = (
            rng.uniform(-0.1, 1) * 1e-7,
            {"tangential_displacement": rng.uniform(-1, 1) * 30e-9},
        )
        one = [int(rng.integers(4))]
        do, options = [
            (ensemble.with_friction, {"friction": 0.3, "asperities": one}),
            (ensemble.with_geometry, {"summit_height": -1e-8, "asperities": one, "saturate": True}),
            (ensemble.advance, {"normal_load": load, "saturate": True} | pull),
            (ensemble.advance, {"normal_load": load} | moved),
            (ensemble.advance, {"normal_displacement": depth, "saturate": True} | pull),
            (
                ensemble.advance,
                {"normal_displacement": depth, "instrument": hs.Instrument(1e6)} | moved,
            ),
        ][rng.integers(6)]
        before = state.to_bytes()
        after = do(state, **options)
        assert state.to_bytes() == before
        assert do(state, **options) == after
        assert do(type(state).from_bytes(before), **options) == after
        state = after


@mark.parametrize("wear, most", [(0.0, 1e-12), (1e-2, 1e-4)])
def test_friction_that_rises_with_the_way_begins_to_rise_where_sliding_begins(wear, most):
    """In as many parts as one likes, up to 0.7 of the rise at which springs that slide stick again."""
    rng = np.random.default_rng(0)
    lag, radius = np.sort(rng.uniform(0, 80e-9, 5)), rng.uniform(0.5e-6, 2e-6, 5)
    lag[0], rise = 0.0, PAIR.displacement_ratio * 100e-9 / 0.7 * 0.4
    options = {"wear": ArchardWear(coefficient=wear, hardness=5e9)} if wear else {}
    ensemble = hs.Ensemble(
        PAIR, -lag, radius, SlidFriction([0.0, rise, 9 * rise], [0.2, 0.6, 0.6]), **options
    )
    start = ensemble.advance(ensemble.initial_state(), normal_displacement=100e-9)
    found = []
    for parts in (1, 3, 10, 100):
        state = start
        for part in np.arange(1, parts + 1) / parts:
            reached = part * 0.21 * PAIR.displacement_ratio * 100e-9
            state = ensemble.advance(
                state, normal_load=start.normal_load, tangential_displacement=reached
            )
        found.append(state.tangential_load)
    assert 0 < state.evolved.slid_distance.min() < 0.05 * reached
    np.testing.assert_allclose(found, found[-1], rtol=0, atol=most * 0.4 * start.normal_load)


# -- laws in their Coulomb limit: the contact is that of a constant coefficient

COEFFICIENT, PEAK = 0.3, 0.02
COULOMB_LIMITS = {
    "power law": {"friction": PowerLaw(COEFFICIENT, 1.0, 1e-12)},
    "power law of the total load": {"friction": PowerLaw(COEFFICIENT, 1.0, 1e-12, load="total")},
    "constant slid friction": {"friction": SlidFriction([0.0, 1.0], [COEFFICIENT, COEFFICIENT])},
    "next to no Archard wear": {"wear": ArchardWear(coefficient=1e-30, hardness=1.0)},
    "next to no energy wear": {"wear": EnergyWear(volume_per_energy=1e-30)},
    "never yields": {"yielding": hs.yielding.Thornton(hardness=1e6, poissons_ratio=0.3)},
    "law, never yields": {
        "friction": PowerLaw(COEFFICIENT, 1.0, 1e-12),
        "yielding": hs.yielding.Thornton(hardness=1e6, poissons_ratio=0.3),
    },
    "sliding followed": {"follow_sliding": True},
}


CONTROLS = [*itertools.product(["load", "displacement"], repeat=2)]


def random_events(rng, normal, tangential, heights, largest):
    """Five joint waypoints; tangential loads up to a multiple of the friction limit at each of them."""
    events, approach = [], 0.0
    for time in range(5):
        if time == 0 or rng.random() < 0.8:
            approach = PEAK * rng.uniform(0.2, 1.2)
        load = float((4 / 3 * np.maximum(approach + np.array(heights), 0.0) ** 1.5).sum())
        events.append(
            hs.NormalLoad(time, load) if normal == "load" else hs.NormalDisplacement(time, approach)
        )
        share = rng.uniform(-largest, largest)
        if tangential == "load":
            events.append(hs.TangentialLoad(time, share * COEFFICIENT * load))
        else:
            events.append(
                hs.TangentialDisplacement(time, 1.5 * COEFFICIENT * PEAK * rng.uniform(-1, 1))
            )
    return events


def replayed(options, heights, events, **replay):
    """The history, or the event that is refused."""
    ensemble = hs.Ensemble(PAIR, heights, 1.0, **{"friction": COEFFICIENT} | options)
    try:
        return hs.replay(ensemble, events, record="totals", **replay), None
    except hs.HistorySimError as refusal:
        return None, str(refusal).split(":")[0]


@mark.parametrize("name", COULOMB_LIMITS)
def test_each_law_in_its_coulomb_limit_is_coulombs(name):
    heights = (0.0, -0.4 * PEAK, -0.8 * PEAK)
    force = COEFFICIENT * 4 / 3 * PEAK**1.5
    scales = {
        "total_tangential_load": 1e-4 * force,
        "tangential_displacement": 1e-4 * COEFFICIENT * PEAK,
        "total_dissipated_energy": 1e-3 * COEFFICIENT * PEAK * force,
        "separation": 1e-9 * PEAK,
    }
    for case, (stiffness, saturate, substeps) in enumerate(
        zip([np.inf, 0.1] * 4, [True] * 4 + [False] * 4, [1, 3, 3, 1] * 2, strict=True)
    ):
        rng = np.random.default_rng([6, case])
        normal, tangential = CONTROLS[case % 4]
        events = random_events(
            rng, normal, tangential, heights, 1.6 if saturate else rng.choice([0.6, 1.2])
        )
        options = {
            "instrument": hs.Instrument(lateral_stiffness=stiffness),
            "saturate": saturate,
            "substeps": substeps,
        }
        expected, refused = replayed({}, heights, events, **options)
        found, also_refused = replayed(COULOMB_LIMITS[name], heights, events, **options)
        assert also_refused == refused
        if expected is None:
            continue
        for quantity, tolerance in scales.items():
            difference = np.abs(found[quantity] - expected[quantity]).max()
            assert difference <= tolerance, (case, quantity, float(difference / tolerance))


@mark.parametrize(
    "wear",
    [
        ArchardWear(coefficient=0.1, hardness=2.0),
        EnergyWear(volume_per_energy=0.3, shape="blunted"),
    ],
)
def test_erased_energy_does_not_depend_on_the_number_of_paths(wear):
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.3, wear=wear)
    erased = []
    for paths in (1, 100):
        state = ensemble.advance(
            ensemble.initial_state(), normal_displacement=0.04, tangential_displacement=0.0
        )
        for share in np.arange(1, paths + 1) / paths:
            approach, displacement = 0.04 - 0.01 * share, 0.04 * share
            state = ensemble.advance(
                state, normal_displacement=approach, tangential_displacement=displacement
            )
        erased.append(state.evolved.erased_energy)
    assert erased[0] == approx(erased[1], rel=3e-3)
    assert erased[1] > 1e-3 * state.dissipated_energy


def test_worn_asperities_first_slide_when_they_would_without_wear():
    events = [
        hs.NormalDisplacement(0.0, 0.05),
        hs.NormalDisplacement(1.0, 0.03),
        hs.TangentialDisplacement(1.0, 0.01),
        hs.NormalDisplacement(2.0, 0.06),
        hs.TangentialDisplacement(2.0, -0.03),
    ]
    times = [
        hs.replay(
            hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.3, wear=wear), events, record="all"
        ).slide_time.values
        for wear in (None, ArchardWear(coefficient=0.1, hardness=1.0))
    ]
    assert np.isfinite(times[0]).all()
    assert times[1] == approx(times[0], rel=1e-12)


# -- blunted wear, lift-off, slid distances
# ----------------------------------------------------------


MODULUS, SHEAR = GLASS.contact_modulus, GLASS.shear_modulus


class InnermostSprings:
    """Blunted wear by small explicit steps: while it slides, an asperity's springs are all at the limit, whatever its
    shape, so that the innermost spring alone says whether it slides."""

    def __init__(self, height, radius, friction, rate):
        self.lag, self.curvature = -np.array(height), 1 / np.full(len(height), radius)
        self.friction, self.rate, self.ratio = friction, rate, MODULUS / 4 / SHEAR
        self.strain, self.approach, self.displacement = np.zeros(len(height)), 0.0, 0.0

    def loads(self, approach):
        return (
            4 / 3 * MODULUS / np.sqrt(self.curvature) * np.maximum(approach - self.lag, 0.0) ** 1.5
        )

    def approach_at(self, load, guess):
        for _ in range(50):
            missing = load - self.loads(guess).sum()
            slope = 2 * MODULUS * np.sqrt(np.maximum(guess - self.lag, 0.0) / self.curvature).sum()
            guess += missing / slope
            if abs(missing) < 1e-13 * load:
                break
        return guess

    def go(self, load, displacement, steps):
        lag, curvature = self.lag.copy(), self.curvature.copy()
        first = self.approach
        last = self.approach_at(load, max(self.approach, 1e-8))
        moved = (displacement - self.displacement) / steps
        for k in range(1, steps + 1):
            # as the program has it: the normal load that the shape at the start carries on a
            # straight approach
            own = np.maximum(first + (last - first) * k / steps - lag, 0.0)
            self.approach = self.approach_at(
                (4 / 3 * MODULUS / np.sqrt(curvature) * own**1.5).sum(), self.approach or last
            )
            own = np.maximum(self.approach - self.lag, 0.0)
            limit, trial = self.ratio * self.friction * own, self.strain + moved
            slides = (np.abs(trial) > limit) & (own > 0)
            self.strain = np.where(own > 0, np.clip(trial, -limit, limit), 0.0)
            lost = np.where(slides, self.rate * self.loads(self.approach) * abs(moved), 0.0)
            square = np.where(slides, own / self.curvature, 1.0)
            self.lag += 2 * lost / np.pi / square
            self.curvature *= np.exp(-4 * lost / np.pi / square**2 / self.curvature)
        self.displacement = displacement


def test_blunted_summits_agree_with_springs_at_any_substeps():
    row, path = (
        InnermostSprings([0.0, -20e-9, -50e-9], 10e-6, 0.3, 0.1 / 6e9),
        ((0.01, 0.0), (0.02, 200e-9), (0.005, -200e-9)),
    )
    for load, displacement in path:
        row.go(load, displacement, 1600)
    wear = ArchardWear(coefficient=0.1, hardness=6e9, shape="blunted")
    ensemble = hs.Ensemble(GLASS, [0.0, -20e-9, -50e-9], 10e-6, 0.3, wear=wear)
    for substeps in (1, 10, 100):
        found = end_of(ensemble, path, substeps).evolved
        # the steps of the springs are of first order
        assert found.summit_radius == approx(1 / row.curvature, rel=1e-3)
        assert found.summit_height == approx(-row.lag, rel=1e-3)


def end_of(ensemble, path, substeps, kinds=(hs.NormalLoad, hs.TangentialDisplacement), **options):
    """State after straight paths to pairs of values."""
    events = [
        kind(float(k), value)
        for k, pair in enumerate(path)
        for kind, value in zip(kinds, pair, strict=True)
    ]
    return hs.Replay(ensemble, events, substeps=substeps, record="totals", **options).state()


UNDER_LOAD = (hs.NormalDisplacement, hs.TangentialLoad)
NEARLY_STEADY = {
    "plain": {"friction": 0.4},
    "wear": {"friction": 0.4, "wear": ArchardWear(coefficient=1e-2, hardness=1e10)},
    "law": {"friction": ShearStrength(3e8)},
}


@mark.parametrize("substeps", [1, 50])
@mark.parametrize("name", NEARLY_STEADY)
def test_lift_off_under_a_load_leaves_no_displacement(name, substeps):
    """The last spring to leave never slipped, and is anchored where it touched."""
    ensemble = hs.Ensemble(GLASS, 0.0, 10e-6, **NEARLY_STEADY[name])
    path = [(80e-9, 0.0), (80e-9, 0.6e-3)]
    assert end_of(ensemble, path, substeps, UNDER_LOAD).tangential_displacement > 1e-9
    lifted = end_of(ensemble, [*path, (-10e-9, 0.0)], substeps, UNDER_LOAD)
    assert (lifted.tangential_displacement, lifted.tangential_load) == (0.0, 0.0)


def test_the_displacement_stays_while_the_limit_of_a_sliding_contact_falls():
    """A load held at the limit while the contact lifts off: the displacement stays where sliding began."""
    shape = GLASS, [0.0, -20e-9], 10e-6, 0.4
    wearing = hs.Ensemble(*shape, wear=ArchardWear(coefficient=1e-6, hardness=1e10))
    path = [(80e-9, 0.6e-3), (-10e-9, 0.2e-3)]
    ends = [
        end_of(wearing, path, parts, UNDER_LOAD, saturate=True).tangential_displacement
        for parts in (1, 4, 50)
    ]
    # with the load straight in the share, as where asperities evolve, in many paths
    many = [
        path[0],
        *zip(
            np.linspace(80e-9, -10e-9, 301)[1:], np.linspace(0.6e-3, 0.2e-3, 301)[1:], strict=True
        ),
    ]
    plain = end_of(hs.Ensemble(*shape), many, 1, UNDER_LOAD, saturate=True)
    assert ends == approx([plain.tangential_displacement] * 3, rel=5e-3)


def test_slid_distance_counts_gross_slip_only():
    """Friction falls after a reversal: the inner springs slip while the annulus sticks, and that counts for nothing."""
    ensemble = hs.Ensemble(PAIR, 0.0, 1.0, 0.5, follow_sliding=True)
    events = [
        hs.NormalDisplacement(0.0, 0.02),
        hs.TangentialDisplacement(0.0, 0.0),
        hs.events.FrictionRamp(0.0, 0.5),
    ]
    targets = [(0.5, 0.008), (0.5, 0.0), (0.15, 0.003), (0.15, 0.009)]
    for k, (friction, displacement) in enumerate(targets, 1):
        events += [
            hs.TangentialDisplacement(float(k), displacement),
            hs.events.FrictionRamp(float(k), friction),
        ]
    slid = hs.replay(ensemble, events, record="all").slid_distance.values[1:, 0]
    count, steps = 400, 4000
    own = 0.02 * (1 - ((np.arange(count) + 0.5) / count) ** 2)
    strain, at, before, whole, inner = np.zeros(count), 0.0, 0.5, 0.0, 0.0
    for (friction, displacement), found in zip(targets, slid, strict=True):
        for share in np.arange(1, steps + 1) / steps:
            limit = (before + (friction - before) * share) * own
            trial = strain + (displacement - at) / steps
            strain = np.clip(trial, -limit, limit)
            slips = np.sign(trial) * (np.abs(trial) > limit)
            whole += abs(displacement - at) / steps * abs(slips.mean() == slips[0] != 0)
            inner += abs(displacement - at) / steps * (slips[0] != 0)
        at, before = displacement, friction
        assert found == approx(whole, abs=3e-5)
    assert inner > whole + 1e-3
    assert whole > 1e-3


def of_jkr(load, _total, radius, _slid):
    pull = 3 * np.pi * 1e-5 * radius
    square = np.cbrt(0.75 * radius * (load + pull + np.sqrt(2 * pull * load + pull**2))) ** 2
    return np.where(load > 0, 0.05 * np.pi * square / np.maximum(load, 1e-300), 0.0)


def test_jkr_friction_near_touch_and_lift_off_agrees_with_springs():
    law = ShearStrength(0.05, area="jkr", work_of_adhesion=1e-5)
    compare(hs.Ensemble(PAIR, HEIGHT, RADIUS, law, follow_sliding=True), of_jkr, LIFTED)


DEPTH = 0.1
FULL_SLIP = 0.3 * DEPTH  # displacement at which all slides, with a coefficient of 0.3 and θ = 1
RAMPS = {
    "power": {"friction": PowerLaw(0.3, 0.04, -1 / 3)},
    "rising": {"friction": PowerLaw(0.3, 0.04, 0.2)},
    "total": {"friction": PowerLaw(0.3, 0.04, -0.2, load="total")},
    "strength": {"friction": ShearStrength(0.03)},
    "slid": {"friction": SlidFriction([0.0, 0.3 * FULL_SLIP, 3 * FULL_SLIP], [0.35, 0.25, 0.2])},
    "wear": {"friction": 0.3, "wear": ArchardWear(coefficient=1e-2, hardness=0.07)},
    "blunted": {
        "friction": 0.3,
        "wear": ArchardWear(coefficient=1e-2, hardness=0.07, shape="blunted"),
    },
    "yielding": {
        "friction": 0.3,
        "yielding": hs.yielding.Thornton(hardness=0.1, poissons_ratio=0.3),
    },
}


def hertz_load(depth):
    return float((4 / 3 * np.sqrt(RADIUS) * np.maximum(depth + HEIGHT, 0.0) ** 1.5).sum())


@mark.parametrize("control", ["normal_displacement", "normal_load"])
@mark.parametrize("reach", [0.5, 0.8, 1.2, 2.0])
@mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_energy_of_an_event_in_which_sticking_turns_into_sliding(control, reach, tolerance):
    """Bowden and Tabor's law on a sphere: all sticks until T = μN ∝ N^(2/3) meets x y^(3/2), at y = (μ/μ0 x)²."""
    load, rise = 4 / 3 * DEPTH**1.5, 1.1
    law = PowerLaw(0.3 * rise, load, -1 / 3)
    ensemble = hs.Ensemble(PAIR, 0.0, 1.0, law, tolerance=tolerance)
    target = DEPTH if control == "normal_displacement" else load
    state = ensemble.advance(
        ensemble.initial_state(), **{control: target}, tangential_displacement=reach * FULL_SLIP
    )
    onset, stored = (rise / reach) ** 2, 0.4 * rise**2
    work = (
        reach * (0.4 * reach * onset**2.5 + 0.5 * rise * (1 - onset**2))
        if onset < 1
        else 0.4 * reach**2
    )
    stored = min(stored, 0.4 * reach**2)
    unit = 0.3 * load * FULL_SLIP
    assert state.stored_energy / unit == approx(stored, rel=1e-6)
    # energies are tolerated 1000 times coarser than displacements
    bound = 1e3 * tolerance * stored
    assert state.dissipated_energy / unit == approx(work - stored, abs=bound)


@mark.parametrize(
    "wear",
    [
        ArchardWear(coefficient=1e-30, hardness=1.0),
        ArchardWear(coefficient=1e-30, hardness=1.0, shape="blunted"),
        EnergyWear(volume_per_energy=1e-30),
    ],
)
@mark.parametrize("control", ["normal_displacement", "normal_load"])
@mark.parametrize("tolerance", [1e-3, 1e-6, 1e-10])
def test_a_path_on_which_nothing_slips_is_the_exact_step_across_a_gap(wear, control, tolerance):
    ensemble = hs.Ensemble(PAIR, 0.0, 1.0, 0.3, wear=wear, tolerance=tolerance)
    gap, load = -0.02 * DEPTH, 4 / 3 * DEPTH**1.5
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=gap)
    target = load if control == "normal_load" else DEPTH
    state = ensemble.advance(state, **{control: target}, tangential_displacement=0.9 * FULL_SLIP)
    assert state.tangential_load == approx(0.9 * FULL_SLIP / (DEPTH - gap) * load, rel=1e-12)


@mark.parametrize("name", RAMPS)
@mark.parametrize("seed", range(3))
def test_one_event_has_the_energy_balance_of_many_small_ones(name, seed):
    """Work less stored energy is what is dissipated; the work is integrated over small events."""
    rng, count = np.random.default_rng(seed), 400
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, **RAMPS[name])
    begin = {
        "normal_displacement": rng.uniform(0.3, 0.9) * DEPTH,
        "tangential_displacement": rng.uniform(-1, 1) * FULL_SLIP,
    }
    start = ensemble.advance(ensemble.initial_state(), **begin)
    end = {
        "normal_displacement": rng.uniform(0.3, 1.2) * DEPTH,
        "tangential_displacement": rng.uniform(-2, 2) * FULL_SLIP,
    }
    once = ensemble.advance(start, **end)
    share = np.arange(1, count + 1) / count
    fine, row = ensemble.advance_many(
        start, **{key: begin[key] + (end[key] - begin[key]) * share for key in begin}
    )
    load = np.append(start.tangential_load, row.tangential_load)
    moved = np.append(start.tangential_displacement, row.tangential_displacement)
    work = float(np.trapezoid(load, moved))
    erased = [0.0 if s.evolved is None else s.evolved.erased_energy for s in (start, fine)]
    lost = fine.dissipated_energy - start.dissipated_energy + erased[1] - erased[0]
    scale = max(lost, fine.stored_energy)
    assert work - (fine.stored_energy - start.stored_energy) == approx(lost, abs=1e-3 * scale)
    assert once.dissipated_energy == approx(fine.dissipated_energy, abs=1e-3 * scale)
    limit = 0.3 * max(fine.normal_load, start.normal_load)
    assert once.tangential_load == approx(fine.tangential_load, abs=2e-4 * limit)


@mark.parametrize("name", RAMPS)
def test_small_events_on_a_smooth_path_leave_few_vertices(name):
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, **RAMPS[name])
    start = ensemble.advance(ensemble.initial_state(), normal_load=hertz_load(0.4 * DEPTH))
    start = ensemble.advance(start, tangential_displacement=-0.2 * FULL_SLIP)
    ends = [hertz_load(DEPTH), 0.05 * hertz_load(DEPTH)]
    states = []
    for count in (1, 1000):
        share = np.arange(1, count + 1) / count
        paths = [
            at + (end - at) * share
            for at, end in zip((start.normal_load, start.tangential_load), ends, strict=True)
        ]
        states.append(
            ensemble.advance_many(start, normal_load=paths[0], tangential_load=paths[1])[0]
        )
    once, many = states
    assert max(len(many.vertices(group)) for group in set(many.group.tolist())) <= 150
    assert many.tangential_displacement == approx(
        once.tangential_displacement, abs=1e-4 * FULL_SLIP
    )
    assert many.stored_energy == approx(once.stored_energy, rel=1e-3)
    assert many.dissipated_energy == approx(once.dissipated_energy, abs=1e-3 * many.stored_energy)


@mark.parametrize(
    "options",
    [
        {"friction": PowerLaw(coefficient=0.3, reference_load=0.01, exponent=-0.2)},
        {"friction": 0.3, "wear": ArchardWear(coefficient=0.1, hardness=2.0)},
    ],
    ids=["law", "wear"],
)
def test_a_press_without_strain_is_one_step(options):
    """Nothing slides, so that the state has the bits of any number of presses."""
    ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, **options)
    once = ensemble.advance(ensemble.initial_state(), normal_displacement=0.05)
    state = ensemble.initial_state()
    for approach in (*np.linspace(0.001, 0.049, 40), 0.05):
        state = ensemble.advance(state, normal_displacement=approach)
    assert (once.normal_load, once.tangential_load) == (state.normal_load, 0.0)
    assert once.friction.tolist() == state.friction.tolist()
    assert (once.dissipated_energy, state.dissipated_energy) == (0.0, 0.0)
    moved = [
        s.tangential_load
        for s in (ensemble.advance(s, tangential_displacement=0.004) for s in (once, state))
    ]
    assert moved[0] == approx(moved[1], rel=1e-12)
