import numpy as np
from golden import check_messages
from numpy.testing import assert_allclose
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark, param, raises

import historysim as hs

APPROACH = np.linspace(0.0, 0.1, 41)
HERTZ = 4 / 3 * APPROACH**1.5
EVENTS = [
    hs.NormalLoad(0, 0.01),
    hs.TangentialLoad(1, 0.003),
    hs.TangentialLoad(2, -0.002),
    hs.NormalLoad(3, 0.02),
    hs.TangentialLoad(4, 0.004),
    hs.NormalLoad(5, 0.012),
]


def pressing(approach):
    """Loads of two contacts that soften each other: they stiffen less than any sum of balls."""
    load = approach**1.5 / 1.5 - 0.8 * approach**2 / 2
    return np.stack([0.7 * load, 0.3 * load], axis=1)


def random_moves(rng, approach, count=30):
    events = []
    for time in range(count):
        events += [
            hs.NormalDisplacement(time, approach * rng.uniform(-0.1, 1)),
            hs.TangentialDisplacement(time, approach * rng.uniform(-0.5, 0.5)),
        ]
    return events


@fixture(scope="module")
def asperities():
    rng = np.random.default_rng(1)
    height, radius = -np.abs(rng.normal(size=60)) * 0.02, rng.uniform(0.5, 1.0, 60)
    return hs.Ensemble(PAIR, height - height.max(), radius, friction=0.5)


def clipped(approach, touch):
    return np.clip(approach - touch, 0, None)


# Loads over approaches up to .1 that rise and are convex.
CURVES = {
    "flat punch": lambda a: a,
    "rounded flat punch": lambda a: np.where(
        a < 0.03, a**1.5, 0.03**1.5 + 1.5 * 0.03**0.5 * (a - 0.03)
    ),
    "d^1.05": lambda a: a**1.05,
    "d^1.1": lambda a: a**1.1,
    "indenter r^8": lambda a: a**1.125,
    "indenter r^4": lambda a: a**1.25,
    "ball": lambda a: a**1.5,
    "cone": lambda a: a**2,
    "d^3": lambda a: a**3,
    "two plateaus": lambda a: a + 3 * clipped(a, 0.0333),
    "two balls": lambda a: a**1.5 + clipped(a, 0.05) ** 1.5,
    "balls that soften": lambda a: pressing(a).sum(axis=-1),
    "exponential": lambda a: np.expm1(30 * a),
    "sinh": lambda a: np.sinh(40 * a),
    "blunt cone": lambda a: a**2 + 0.02 * a,
    "nine balls": lambda a: sum(clipped(a, touch) ** 1.5 for touch in np.linspace(0, 0.08, 9)),
    "punches and a ball": lambda a: a + 0.5 * clipped(a, 0.01) + 0.7 * clipped(a, 0.04) ** 1.5,
    "thirty plateaus": lambda a: sum(clipped(a, touch) for touch in np.geomspace(5e-5, 0.09, 30)),
    "cut cone": lambda a: (a + 0.01) ** 2 - 1e-4,
    "d^1.7": lambda a: a**1.7,
}


def rows_of(kind, count, rng):
    if kind == "even":
        return np.linspace(0, 0.1, count + 1)[1:]
    if kind == "logarithmic":
        return np.geomspace(1e-4, 0.1, count)
    return np.append(np.sort(rng.uniform(1e-4, 0.1, count - 1)), 0.1)


def errors(curve, noise, rng):
    """The estimate and the true largest error, both over the largest load."""
    rows = rows_of(
        rng.choice(["even", "logarithmic", "random"]),
        int(rng.integers(20, 200 if noise else 60)),
        rng,
    )
    exact = curve(rows) / curve(np.array([0.1]))
    own = exact if rng.random() < 0.5 else 1.0
    load = np.maximum(exact + noise * own * rng.normal(size=rows.size), 1e-9)
    curves = hs.Patches.from_normal_curves(PAIR, rows, load, friction=0.5).curves
    between = np.linspace(0, 0.1, 3001)
    true = np.abs(curves.total(between) - curve(between) / curve(np.array([0.1]))).max()
    return curves.error(), float(true)


@mark.parametrize("name", CURVES)
@mark.parametrize("rows", ["even", "logarithmic"])
def test_a_convex_curve_is_met_at_its_rows_and_obeys_the_superposition(name, rows):
    curve, approach = CURVES[name], rows_of(rows, 60, np.random.default_rng(1))
    table = hs.Patches.from_normal_curves(PAIR, approach, curve(approach), friction=0.5)
    assert table.curves.noise is None
    assert table.curves.residual < 1e-12
    stiffness = table.curves.stiffness
    assert stiffness is None or (np.diff(stiffness) >= 0).all()
    depth, moved = approach[-4], 0.6 * approach[-4]
    state = table.advance(table.initial_state(), normal_displacement=depth)
    state = table.advance(state, tangential_displacement=0.5 * moved)
    error = max(table.curves.error(), 1e-12) * float(curve(approach)[-1])
    expected = 0.5 * (curve(np.array([depth])) - curve(np.array([depth - moved])))[0]
    assert abs(state.tangential_load - expected) < 0.5 * error
    back = table.advance(state, tangential_displacement=-0.1 * moved)
    half = 0.5 * (curve(np.array([depth])) - curve(np.array([depth - 0.6 * moved])))[0]
    assert abs(back.tangential_load - (expected - 2 * half)) < 1.5 * error
    closed = table.advance(back, tangential_displacement=0.5 * moved)
    assert closed.tangential_load == approx(state.tangential_load, rel=1e-12)


@mark.slow
@mark.parametrize("noise", [0.0, 1e-4, 3e-3, 1e-2])
def test_ninety_five_of_a_hundred_errors_are_within_the_estimate(noise):
    rng = np.random.default_rng(3)
    found = np.array([errors(curve, noise, rng) for curve in CURVES.values() for _ in range(5)])
    assert (found[:, 1] <= found[:, 0] + 1e-12).mean() >= 0.95


def test_the_energy_lost_at_knots_and_between_them_is_the_work_of_a_closed_loop():
    for name in ("flat punch", "two plateaus", "rounded flat punch", "cone", "thirty plateaus"):
        approach = rows_of("even", 30, None)
        table = hs.Patches.from_normal_curves(PAIR, approach, CURVES[name](approach), friction=0.5)
        events = [hs.NormalDisplacement(0, 0.08)]
        events += [
            hs.TangentialDisplacement(t + 1, u)
            for t, u in enumerate((0.06, -0.06, 0.06, -0.06, 0.06))
        ]
        history = hs.replay(table, events, substeps=400)
        force, moved = (
            history["total_tangential_load"].values,
            history["tangential_displacement"].values,
        )
        work = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(moved)))
        energy = history["total_dissipated_energy"].values
        loop = slice(-1601, None, 800)
        # the trapezoidal rule leaves some 1/400² of it, and as much where slip begins immediately
        assert_allclose(np.diff(energy[loop]), np.diff(work[loop]), rtol=1e-3)
        assert np.diff(energy).min() > -1e-15 * energy[-1]


@mark.parametrize("seed", range(2))
def test_a_path_in_parts_loses_what_the_whole_path_does_however_the_stiffness_jumps(seed):
    rng = np.random.default_rng(seed)
    touch = np.append(0.0, np.sort(rng.uniform(0, 0.1, 8)))
    # rows at the jumps, which are knots at one place
    approach = np.append(touch[1:], 0.1)
    load = clipped(approach[:, None], touch) @ rng.uniform(0.1, 1.0, 9)
    table = hs.Patches.from_normal_curves(PAIR, approach, load, friction=0.5)
    events = random_moves(rng, 0.1, 20)
    whole, parts = (
        hs.replay(table, events, substeps=each)["total_dissipated_energy"].values
        for each in (1, 50)
    )
    assert_allclose(whole, parts[np.arange(1, whole.size + 1) * 50 - 50], rtol=1e-10, atol=1e-16)


@mark.parametrize("shape", [param((5000, 1e-4), marks=mark.slow), (40, 2e-2)])
def test_measured_curves_of_any_length_are_taken(shape):
    count, noise = shape
    rng, approach = np.random.default_rng(7), np.linspace(0, 0.1, count + 1)[1:]
    exact = 4 / 3 * approach**1.5
    load = np.maximum(exact * (1 + noise * rng.normal(size=count)), 1e-9)
    curves = hs.Patches.from_normal_curves(PAIR, approach, load, friction=0.5).curves
    assert np.abs(curves.total(approach) - exact).max() / exact[-1] < curves.error() < 3 * noise


def test_noise_that_is_given_is_the_noise():
    noise = 1e-3 * HERTZ[-1]
    load = HERTZ[1:] + noise * np.random.default_rng(5).normal(size=40)
    table = hs.Patches.from_normal_curves(
        PAIR, APPROACH[1:], np.abs(load), friction=0.5, noise=noise
    )
    assert_allclose(table.curves.noise, noise)
    assert table.curves.residual < 4e-3


def test_what_is_not_known_of_a_curve_is_reported():
    def texts(approach, load):
        table = hs.Patches.from_normal_curves(PAIR, approach, load, friction=0.5)
        return {
            finding.name: finding.text
            for finding in hs.replay(table, [hs.NormalDisplacement(0, 0.09)]).contact.validity()
        }

    assert texts(APPROACH, HERTZ) == texts(APPROACH, APPROACH) == {}
    late = np.linspace(0.05, 0.1, 30)
    assert (
        "is at 50 % of its range of approach"
        in texts(late, pressing(late).sum(axis=1))["first_row"]
    )
    noisy = np.abs(HERTZ + 0.02 * HERTZ[-1] * np.random.default_rng(1).normal(size=41))
    assert "of its largest load under its noise" in texts(APPROACH[1:], noisy[1:])["normal_curve"]


def test_parts_of_patches_agree_with_the_superposition(tabulated):
    state = tabulated.initial_state()
    for approach, displacement in ((0.07, 0.02), (0.05, -0.01), (0.05, 0.012), (0.06, 0.0)):
        state = tabulated.advance(
            state, normal_displacement=approach, tangential_displacement=displacement
        )
    found, load = tabulated.superposition(state), tabulated.curves.load
    assert found.normal @ load.sum(axis=1) == approx(state.normal_load, rel=1e-12)
    assert found.tangential @ load.sum(axis=1) == approx(state.tangential_load, rel=1e-10)
    events = [hs.NormalDisplacement(0, 0.07), hs.TangentialDisplacement(0, 0.02)]
    events += [hs.NormalDisplacement(1, 0.05), hs.TangentialDisplacement(1, -0.01)]
    events += [hs.NormalDisplacement(2, 0.05), hs.TangentialDisplacement(2, 0.012)]
    events += [hs.NormalDisplacement(3, 0.06), hs.TangentialDisplacement(3, 0.0)]
    row = hs.replay(tabulated, events, record="all").isel(step=-1)
    assert_allclose(row["normal_load"], found.normal @ load, rtol=1e-9, atol=1e-15)
    assert_allclose(row["tangential_load"], found.tangential @ load, rtol=1e-9, atol=1e-15)


@fixture(scope="module")
def tabulated(asperities):
    approach = np.linspace(0.0, 0.08, 61)
    depth = np.clip(approach[:, None] + asperities.summit_height, 0, None)
    load, area = (
        4 / 3 * np.sqrt(asperities.summit_radius) * depth**1.5,
        np.pi * asperities.summit_radius * depth,
    )
    return hs.Patches.from_normal_curves(PAIR, approach, load, area, friction=0.5)


def test_hertz_as_a_table_is_hertz():
    table = hs.Patches.from_normal_curves(PAIR, APPROACH, HERTZ, np.pi * APPROACH, friction=0.5)
    assert table.elements == 1
    assert table.curves.error() < 1e-9
    given = hs.replay(table, EVENTS, substeps=5, hold=False)
    expected = hs.replay(hs.Ensemble(PAIR, 0.0, 1.0, friction=0.5), EVENTS, substeps=5, hold=False)
    for name in set(given.data_vars) & set(expected.data_vars):
        assert_allclose(given[name], expected[name], rtol=1e-9, atol=1e-15, err_msg=name)
    assert_allclose(given["stick_area"], np.pi * expected["stick_radius"] ** 2, atol=1e-12)


def test_an_approach_is_found_beyond_what_the_first_element_alone_would_carry():
    table = hs.Patches.from_normal_curves(PAIR, APPROACH, pressing(APPROACH), friction=0.5)
    for approach in (0.01, 0.05, 0.0999):
        load = pressing(np.array([approach])).sum()
        assert table.approach_at(load) == approx(approach, rel=1e-5)


def test_first_touch_and_count_of_patches():
    load = np.stack([HERTZ, np.clip(APPROACH - 0.05, 0, None) ** 1.5], axis=1)
    table = hs.Patches.from_normal_curves(PAIR, APPROACH, load, friction=0.5, x=[0, 1], y=[0, 0])
    assert_allclose(table.first_touch, [0.0, 0.05])
    history = hs.replay(
        table, [hs.NormalDisplacement(0, 0.04), hs.NormalDisplacement(1, 0.09)], record="all"
    )
    assert history["contact_count"].values.tolist() == [1, 2]
    assert history["slip_state"].values.tolist() == [[1, 0], [1, 1]]
    assert history["normal_load"].values[0, 1] == 0.0
    assert history["x"].values.tolist() == [0, 1]


def rising(**change):
    table = {"approach": APPROACH, "load": HERTZ, **change}
    return hs.Patches.from_normal_curves(PAIR, **table, friction=0.5)


def test_patches_share_one_friction(tabulated):
    with raises(hs.InputError, match="one number"):
        tabulated.advance(tabulated.initial_state(), normal_load=0.01, friction=[0.1] * 60)


def test_messages():
    check_messages(globals())
