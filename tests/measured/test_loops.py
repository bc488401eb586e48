"""Friction loops: closed forms of one sphere, the exact energy of simulated ones, and a measured record."""

import json
from itertools import pairwise

import attrs
import numpy as np
import synthetic
from golden import refused
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from pairs import GLASS as PAIR
from pytest import approx, fixture, mark, skip
from records_shared import SHARED

import historysim as hs
from historysim.contact import mindlin
from historysim.measured.branches import Definitions, _gap_between_ends
from historysim.measured.loops import loops_of_channels, loops_of_measurement
from historysim.measured.reduction import Measurement
from historysim.results import analysis

NORMAL_LOAD, RADIUS, FRICTION = 50e-3, 2.5e-3, 0.12
SPHERE = hs.Ensemble(PAIR, 0.0, RADIUS, FRICTION)
CONTACT = {
    "normal_load": NORMAL_LOAD,
    "contact_radius": float(np.sqrt(RADIUS * SPHERE.approach_at(NORMAL_LOAD))),
    "shear_modulus": PAIR.shear_modulus,
    "friction": FRICTION,
}
SLIDE = float(mindlin.preliminary_displacement(**CONTACT))
STIFFNESS = float(
    mindlin.tangential_stiffness(CONTACT["contact_radius"], shear_modulus=PAIR.shear_modulus)
)
LIMIT = FRICTION * NORMAL_LOAD
SUBSTEPS = 400


def swung(amplitude, loops=3, *, ensemble=SPHERE, substeps=SUBSTEPS, offset=0.0, end=None):
    """Swing from 0 to the amplitude, and then that many loops."""
    turns = [amplitude] + loops * [-amplitude, amplitude] + ([] if end is None else [end])
    events = [hs.NormalLoad(0.0, NORMAL_LOAD)]
    events += [
        hs.TangentialDisplacement(1.0 + i, float(turn) + offset) for i, turn in enumerate(turns)
    ]
    return hs.replay(ensemble, events, substeps=substeps)


def step(amplitude, substeps=SUBSTEPS):
    return 2 * amplitude / substeps


# ---------------------------------------------------------------- simulated loops and closed forms


def test_gross_slip_gives_the_limit_and_the_closed_forms():
    amplitude = 4 * SLIDE
    found = analysis.friction_loops(swung(amplitude))
    assert len(found) == 3
    assert found.friction_force == approx(np.full((3, 2), LIMIT), rel=1e-12)
    assert found.normal_load == approx(np.full((3, 2), NORMAL_LOAD), rel=1e-12)
    assert found.friction_coefficient == approx(np.full((3, 2), FRICTION), rel=1e-12)

    # a chord that spans the knee is off by less than a step
    expected = 2 * SLIDE * (1 - 0.05 ** (2 / 3))
    assert found.preliminary_displacement == approx(np.full((3, 2), expected), abs=step(amplitude))
    assert (
        approx(PAIR.displacement_ratio * FRICTION * SPHERE.approach_at(NORMAL_LOAD), rel=1e-9)
        == SLIDE
    )

    energy = mindlin.dissipated_energy_per_loop(LIMIT, **CONTACT) + 4 * LIMIT * (amplitude - SLIDE)
    # trapezoids on two branches, each with a slope that changes by k_t
    error = 2 * STIFFNESS * step(amplitude) ** 2 / 12
    assert found.dissipated_energy == approx(np.full(3, energy), abs=1.1 * error)
    assert found.displacement_gap == approx(np.zeros(3), abs=1e-12 * amplitude)
    assert found.tangential_load_gap == approx(np.zeros(3), abs=1e-12 * LIMIT)


@mark.parametrize("share", [0.1, 0.9])
def test_partial_slip_gives_the_energy_of_mindlin(share):
    amplitude = float(mindlin.tangential_displacement(share * LIMIT, **CONTACT))
    history = swung(amplitude)
    found = analysis.friction_loops(history)
    expected = mindlin.dissipated_energy_per_loop(share * LIMIT, **CONTACT)
    error = 2 * STIFFNESS * step(amplitude) ** 2 / 12
    assert found.dissipated_energy == approx(
        np.full(3, expected), abs=1.1 * error + 1e-12 * expected
    )


@mark.parametrize("friction", [0.12, [0.1, 0.2, 0.12, 0.3]])
def test_the_energy_of_a_loop_equals_the_dissipation_of_the_asperities(friction):
    ensemble = hs.Ensemble(PAIR, [0.0, -5e-9, -10e-9, -30e-9], [1e-3, 2e-3, 2e-3, 1e-3], friction)
    history = swung(20e-9, ensemble=ensemble, substeps=1000)
    found = analysis.friction_loops(history)
    exact = np.diff(history.total_dissipated_energy.values[found.ends[:, [0, 2]]], axis=1)[:, 0]
    stiffness = float(history.tangential_stiffness.max())
    assert found.dissipated_energy == approx(
        exact, abs=1.1 * 2 * stiffness * step(20e-9, 1000) ** 2 / 12
    )


# ---------------------------------------------------------------- what is a loop


def ramp(turns, part=10):
    """Go straight from turn to turn."""
    u = np.concatenate(
        [np.linspace(a, b, part, endpoint=False) for a, b in pairwise(turns)] + [turns[-1:]]
    )
    return np.arange(float(u.size)), u


@mark.parametrize(
    "turns, loops",
    [
        ([0, 1, -1, 1], [(1, 2, 3)]),
        ([0, 1, -1, 1, -1], [(1, 2, 3)]),  # the remainder is half a loop
        ([0, 1, -1, 1, -1, 0], [(1, 2, 3)]),
        ([0, 1, -1, 1, -1, 1], [(1, 2, 3), (3, 4, 5)]),
        ([0, 1, -1, 1, -1, 0.5], [(1, 2, 3)]),  # the last one does not come back
        ([0, 1, -1, 1, -1, 0.5, 0], [(1, 2, 3), (3, 4, 5)]),  # a loop that does not close
        ([-1, 1, -1], [(0, 1, 2)]),  # begins at a reversal
        ([-1, 1, -1, 1, 0], [(0, 1, 2)]),
        ([0, 1, 0, 1, 0], [(0, 1, 2), (2, 3, 4)]),
    ],
)
def test_loops_are_pairs_of_branches_between_reversals(turns, loops):
    time, u = ramp([float(turn) for turn in turns])
    load = np.sign(np.gradient(u))
    found = loops_of_channels(time, u, load, dead_band=0.1)
    assert (found.ends // 10).tolist() == [list(loop) for loop in loops]
    first, last = 10 * loops[0][0], 10 * loops[-1][2]
    assert found.left_out == tuple(
        piece for piece in ((0, first), (last, u.size - 1)) if piece[0] < piece[1]
    )
    assert found.displacement_gap == approx([turns[loop[2]] - turns[loop[0]] for loop in loops])


def test_an_open_loop_is_closed_by_a_straight_line_and_says_its_gaps():
    found = loops_of_channels(np.arange(6.0), [1, 0, 0, 2, 1, 2], [0, 0, 3, 3, 2, 2], dead_band=0.5)
    # from (0, 0) up to (0, 3), along to (2, 3), back to (1, 2), and straight to (0, 0)
    assert found.dissipated_energy == approx([6 - 2.5 - 1])
    assert (found.displacement_gap.tolist(), found.tangential_load_gap.tolist()) == ([1], [2])
    assert {row[0]: row[3] for row in found.rows()}["largest gap in displacement"] == "1 m"


@given(st.floats(-3, 3), st.floats(-3, 3), st.sampled_from([1, -1]))
def test_loop_quantities_do_not_depend_on_the_origin(displacement, load, sense):
    time = np.linspace(0, 10, 501)
    u, f = np.sin(2 * time), np.clip(3 * np.sin(2 * time + 0.8), -1, 1)
    plain = loops_of_channels(time, u, f, 2.0, dead_band=0.1)
    moved = loops_of_channels(
        time + 7, sense * u + displacement, sense * (f + load), 2.0, dead_band=0.1
    )
    sides = slice(None, None, sense)
    for name in ("preliminary_displacement", "tangential_stiffness"):
        assert getattr(moved, name) == approx(getattr(plain, name)[:, sides], rel=1e-9)
    # an offset of the load is in the force of either branch, and not in their mean
    assert moved.friction_force == approx(
        plain.friction_force[:, sides] + load * np.array([1, -1])[sides], abs=1e-12
    )
    assert moved.friction_force.mean() == approx(plain.friction_force.mean(), abs=1e-12)
    assert moved.dissipated_energy == approx(plain.dissipated_energy, abs=1e-12)


# ---------------------------------------------------------------- the dead band


def small_swings_in_large_ones():
    """Loops from -1 to 1, with swings of 0.06, 3 % of their range, on the way down."""
    time, u = ramp([0.0, 1, 0.2, 0.26, -1, 1, 0.2, 0.26, -1, 1], part=100)
    return time, u, np.sign(np.gradient(u))


@mark.parametrize(
    "given, loops, dead_band", [({}, 2, 0.1), ({"tangential_displacement": 0.01}, 3, 0.01)]
)
def test_a_measurement_can_have_a_dead_band(given, loops, dead_band):
    time, u, load = small_swings_in_large_ones()
    measurement = Measurement(
        time, {"tangential_displacement": u}, {"tangential_load": load}, given
    )
    found = loops_of_measurement(measurement)
    assert (len(found), found.dead_band) == (loops, approx(dead_band))
    assert len(loops_of_measurement(measurement, dead_band=0.5)) == 2


def test_loops_close_to_a_line_are_noted():
    turns = np.tile(np.concatenate([np.linspace(-1, 1, 200), np.linspace(1, -1, 200)[1:-1]]), 4)
    load = np.tanh(6 * turns) + 1e-3 * np.gradient(turns)
    spring = loops_of_channels(np.arange(turns.size), 1e-6 * turns, load)
    assert any("4 of 4 loops are almost lines" in note for note in spring.notes)
    # a sphere that just comes to slide: 0.2 of the rectangle, by the closed form
    just = analysis.friction_loops(swung(1.001 * SLIDE))
    assert not any("closed to a line" in note for note in just.notes)
    assert just.dissipated_energy / (4 * LIMIT * just.amplitude) == approx(
        np.full(3, 0.2), rel=0.01
    )


# ---------------------------------------------------------------- summaries


# ---------------------------------------------------------------- a measured record

RECORD = SHARED / "friction_damper" / "0.5Hz36lbtension1amplitude.json"


@fixture(scope="module")
def damper():
    if not RECORD.is_file():
        skip("the measured record of a friction damper is not there")
    rows = np.array(json.loads(RECORD.read_text(encoding="utf-8"))["data"])
    inch, kip = 0.0254, 4448.2216152605
    return rows[:, 0], rows[:, 1] * inch, rows[:, 2] * kip


def test_a_measured_record_agrees_with_its_published_picture(damper):
    time, displacement, load = damper
    found = loops_of_channels(time, displacement, load, dead_band=1e-3)
    # the plateaus at about 3.2 kip forward and 4 kip backward
    assert found.statistics("friction_force", "forward").mean == approx(3.15 * 4448, rel=0.02)
    assert found.statistics("friction_force", "backward").mean == approx(4.1 * 4448, rel=0.03)
    # what went into the damper is in its loops and the pieces at both ends
    work = np.trapezoid(load, displacement)
    pieces = sum(np.trapezoid(load[a : b + 1], displacement[a : b + 1]) for a, b in found.left_out)
    ends = found.ends[:, [0, 2]]
    closing = (displacement[ends[:, 0]] - displacement[ends[:, 1]]) * load[ends].mean(axis=1)
    # but for the noise: in the order of time it encloses a separate area
    assert found.dissipated_energy.sum() - closing.sum() + pieces == approx(work, rel=1e-6)
    # three loops of full amplitude, alike and nearly closed
    full = found.dissipated_energy[2:5]
    assert full.std() < 0.02 * full.mean()
    assert np.abs(found.displacement_gap[3]) < 0.01 * 0.0256


# ---------------------------------------------------------------- bad input


# -- noise of the displacement ---------------------------------------------------------------------


def noisy_strokes(noise, **changed):
    exact = synthetic.measured(
        "ball", 0, amplitude=100e-9, loads=(0.05,), loops=8, noise=0.0, rate=40
    )
    random = np.random.default_rng(0)
    moved = exact["tangential_displacement"] + random.normal(0, noise, exact.time.size)
    load = exact["tangential_load"] + random.normal(0, 6e-6, exact.time.size)
    channels = {**exact.channels, "tangential_displacement": moved}
    return attrs.evolve(
        exact, channels=channels, response={"tangential_load": load}, dead_band={}, **changed
    )


@mark.parametrize("noise", [1e-9, 15e-9])
def test_noise_is_not_counted_as_reversals(noise):
    """With 5 % of the range as the dead band, 5 nm made 528 loops without friction."""
    loops = hs.loops(noisy_strokes(noise))
    assert len(loops) == 7
    assert loops.statistics("friction_coefficient").mean == approx(0.2, rel=0.01)
    assert loops.dead_band >= 6 * 0.95 * noise
    assert any("reversal points are unreliable" in note for note in loops.notes) == (noise > 5e-9)


# ---------------------------------------------------------------- one stored cycle


def one_period(start, samples=200):
    """Return the last period of a steady loop from any sample on, with its friction force and energy."""
    moved = 50e-6 * np.sin(2 * np.pi * np.arange(3 * samples) / samples)
    load = np.zeros(moved.size)
    for i in range(1, load.size):
        load[i] = np.clip(load[i - 1] + 5e6 * (moved[i] - moved[i - 1]), -10.0, 10.0)
    part = slice(samples + start, 2 * samples + start)
    return np.arange(samples) * 1e-3, moved[part], load[part]


@mark.parametrize("start", [0, 50, 90])
@mark.parametrize("samples", [24, 200])
def test_one_closed_period_is_a_loop_wherever_it_starts(start, samples):
    start = start * samples // 200
    found = loops_of_channels(*one_period(start, samples), 50.0)
    assert len(found) == 1
    assert found.friction_coefficient == approx(np.full((1, 2), 0.2), rel=1e-3)
    assert found.dissipated_energy == approx(
        [4 * 10 * (50e-6 - 10 / 5e6)], rel=2e-2 if samples < 50 else 5e-3
    )
    assert (np.diff(found.trace.time) > 0).all()


@mark.parametrize("share", [0.2, 0.9])
def test_a_cycle_in_partial_slip_is_a_loop_once_it_is_steady(share):
    turns = [
        float(mindlin.tangential_displacement(sign * share * LIMIT, **CONTACT))
        for sign in (1, -1, 0)
    ]
    events = [hs.NormalLoad(0.0, NORMAL_LOAD)]
    events += [hs.TangentialDisplacement(1.0 + i, turn) for i, turn in enumerate(turns * 2)]
    history = hs.replay(SPHERE, events, substeps=SUBSTEPS)
    channels = "time", "tangential_displacement", "total_tangential_load", "total_normal_load"
    first, second = (
        [history[name].values[start : start + 3 * SUBSTEPS] for name in channels]
        for start in (0, 3 * SUBSTEPS)
    )
    with refused("0 whole loops"):
        loops_of_channels(*first, displacement_noise=0.0)
    found = loops_of_channels(*second, displacement_noise=0.0)
    energy = mindlin.dissipated_energy_per_loop(share * LIMIT, **CONTACT)
    # two trapezoid rules and the piece between the last and the first sample
    assert found.dissipated_energy == approx([energy], rel=1e-2)


def test_friction_is_averaged_over_the_plateau_that_is_chosen():
    """Load that overshoots by a half in the last fifth of each stroke, and is level from 0.3 to 0.8 of it."""
    way = np.array([0.0, 0.3, 0.8, 0.8001, 1.0])
    load = np.array([-1.5, 1.0, 1.0, 1.5, 1.5])
    stroke = np.linspace(0, 1, 201)
    rising = np.interp(stroke, way, load)
    u = np.concatenate([*[stroke, 1 - stroke[1:]] * 3])
    t = np.concatenate([*[rising, -rising[1:]] * 3])
    channels = np.arange(float(u.size)), u, t, np.full(u.size, 2.0)
    level = loops_of_channels(
        *channels, definitions=Definitions(sliding_part=0.6, sliding_end=0.75)
    )
    assert_allclose(level.friction_coefficient, 0.5, rtol=1e-9)
    # (0.06 at 1 and 0.2 at 1.5) over the last 0.26
    last = loops_of_channels(*channels, definitions=Definitions(sliding_part=0.26))
    assert_allclose(last.friction_force, (0.06 * 1 + 0.2 * 1.5) / 0.26, rtol=0.01)
    # unless another part is chosen, it is the level one
    assert_allclose(loops_of_channels(*channels).friction_force, 1.0, rtol=0.01)
    assert (
        level.to_dataset().attrs["sliding_part"]
        == "from 0.4 to 0.75 of the displacement of a branch"
    )
    with refused(r"from 0\.6 to 0\.5"):
        Definitions(sliding_part=0.4, sliding_end=0.5)


def test_the_gap_between_the_ends_of_a_loop_has_no_origin_of_the_displacement():
    share = np.linspace(0.0, 1.0, 400)
    moved, load = np.sin(2 * np.pi * share) + 0.1 * share, 0.3 * share**2 + np.sin(5 * share)
    gap, error = _gap_between_ends(moved, load)
    assert np.isfinite(gap)
    assert _gap_between_ends(moved + 7.0, load) == approx((gap, error), rel=1e-9)
