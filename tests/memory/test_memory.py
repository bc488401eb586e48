"""The traction memory against identities that it must obey, closed forms, and rows of springs."""

import math

import numpy as np
from histories import DrivenRow, build_ensemble, contacts, follow, histories, random_contact
from hypothesis import given, settings
from hypothesis import strategies as st
from pairs import GLASS
from pairs import UNIT as UNIT_PAIR
from pytest import approx, mark, param

import historysim as hs
from historysim.contact import hertz, mindlin

EPS = np.finfo(float).eps


SPHERE = hs.Ensemble(UNIT_PAIR, summit_height=0.0, summit_radius=1.0, friction=0.5)
MU, LOAD = 0.5, 0.01
LIMIT = MU * LOAD

CHANNELS = {
    "loads": ("normal_load", "tangential_load"),
    "displacements": ("normal_displacement", "tangential_displacement"),
}


def advance(ensemble, control, *targets, state=None):
    """Advance along straight paths to pairs of loads or of displacements."""
    state = ensemble.initial_state() if state is None else state
    for pair in targets:
        state = ensemble.advance(
            state, **dict(zip(CHANNELS[control], map(float, pair), strict=True))
        )
    return state


def ramped(ensemble, *targets, state=None):
    return advance(ensemble, "loads", *targets, state=state)


def displaced(ensemble, *targets, state=None):
    return advance(ensemble, "displacements", *targets, state=state)


def units(contact, control, normal_load):
    """Normal target and friction limit of a kind of control."""
    approach = contact.approach(normal_load)
    if control == "loads":
        return normal_load, contact.limit(approach)
    return approach, contact.compliance_ratio * contact.friction.max() * approach


def polylines(state):
    """What the groups remember of vertices, the displacements at which they were made, and the present loads."""
    memory = state.memory.line
    stacks = [state.vertices(group) for group in range(state.group.max() + 1)]
    remembered = ("label", "anchor", "slope", "normal", "tangential")
    now = np.array(
        [memory.approach, memory.displacement, memory.normal_load, memory.tangential_load]
    )
    made_at = [stack["made_at"] for stack in stacks]
    return [
        *(np.stack([stack[name] for name in remembered], axis=1) for stack in stacks),
        now,
    ], made_at


def assert_same_memory(state, other, rounding=0.0):
    (vertices, made_at), (other_vertices, other_made_at) = polylines(state), polylines(other)
    for one, two in zip([*vertices, *made_at], [*other_vertices, *other_made_at], strict=True):
        assert one.shape == two.shape
        assert np.abs(one - two).max(initial=0) <= rounding


def hertz_unit(normal_load, friction=MU):
    """Arguments of the closed forms for the unit sphere."""
    depth = hertz.approach(normal_load, summit_radius=1.0, contact_modulus=1.0)
    radius = hertz.contact_radius(depth, summit_radius=1.0)
    return {"normal_load": normal_load, "contact_radius": radius, "friction": friction}


# -- identities ------------------------------------------------------------------------------------

TURNS = st.lists(st.floats(-0.98, 0.98), min_size=3, max_size=8)
CONTROLS = st.sampled_from([*CHANNELS])


@st.composite
def pressed(draw, groups=(1, 3)):
    """Draw a history, the state at its end under the largest normal load, and a kind of control."""
    history = draw(histories(steep=[False], groups=groups, longest=4))
    control = draw(CONTROLS)
    state = history.ensemble.initial_state()
    if draw(st.booleans()):
        *_, state = history.states()
    normal, unit = units(history.contact, control, history.largest_load)
    # touch along (approach, U), on which no limit is met
    state = history.ensemble.advance(
        state,
        normal_displacement=history.contact.approach(history.largest_load),
        tangential_displacement=0.0,
    )
    return history.contact, history.ensemble, state, control, normal, unit


@given(pressed(), TURNS)
def test_return_point_memory_closes_loops(start, shares):
    """Closing inner loops restores the outer states, from a fresh contact and from one with a history."""
    contact, ensemble, state, control, normal, unit = start
    # ever smaller reversals; the first may close older loops
    size, side, turns = 1.0, 1.0, []
    for share in shares:
        size, side = size * (0.5 + 0.5 * abs(share)), -side
        turns.append(side * size * 0.98)
    states = [advance(ensemble, control, (normal, turns[0] * unit), state=state)]
    for turn in turns[1:]:
        states.append(advance(ensemble, control, (normal, turn * unit), state=states[-1]))
    back = states[-1]
    # several groups share a load to the rounding of the U that is found for it, and have vertices to
    # that of the change between their labels and those of a contact of friction 1
    rounding = (1e-14 if control == "loads" else 1e-16) if np.ptp(contact.friction) > 0 else 0.0
    for turn, outer in zip(turns[-2:0:-1], states[-2:0:-1], strict=True):
        back = advance(ensemble, control, (normal, turn * unit), state=back)
        assert_same_memory(back, outer, rounding)
        assert back.dissipated_energy > outer.dissipated_energy


@given(contacts(), st.floats(0.1, 0.9), st.floats(0.1, 1.0))
def test_half_a_cycle_is_the_virgin_curve_scaled_by_two(contact, share, part):
    """Masing's rule."""
    ensemble, limit = build_ensemble(contact), units(contact, "loads", 0.1)[1]
    loaded = ramped(ensemble, (0.1, 0.0))
    turn = ramped(ensemble, (0.1, share * limit), state=loaded)
    rise = ramped(ensemble, (0.1, part * share * limit), state=loaded)
    half = ramped(ensemble, (0.1, (1 - 2 * part) * share * limit), state=turn)
    fallen = turn.tangential_displacement - half.tangential_displacement
    # U is found to rounding of T over the stiffness that is left
    assert fallen == approx(2 * rise.tangential_displacement, rel=1e-12)


@given(contacts(groups=[1]), TURNS, st.floats(1.0, 3.0))
def test_a_rising_normal_load_changes_neither_displacement_nor_energy(contact, shares, rise):
    ensemble, limit = build_ensemble(contact), units(contact, "loads", LOAD)[1]
    before = ramped(ensemble, (LOAD, 0.0), *((LOAD, share * limit) for share in shares))
    after = ramped(ensemble, (rise * LOAD, shares[-1] * limit), state=before)
    # a load below the rounding of its limit moves the contact by rounding
    slide = units(contact, "displacements", LOAD)[1]
    assert after.tangential_displacement == approx(
        before.tangential_displacement, rel=0.0, abs=EPS * slide
    )
    assert after.dissipated_energy == before.dissipated_energy


@given(
    contacts(),
    st.lists(st.tuples(st.floats(1e-6, 1.0), st.floats(-0.999, 0.999)), min_size=1, max_size=8),
    CONTROLS,
)
def test_nothing_is_dissipated_while_everything_sticks(contact, increments, control):
    ensemble, friction = build_ensemble(contact), contact.friction.min()
    path = np.cumsum([(size, slope * friction * size) for size, slope in increments], axis=0)
    unit = (0.1, 0.1) if control == "loads" else (0.02, 0.02 * contact.compliance_ratio)
    state = advance(ensemble, control, *(path * unit))
    assert state.dissipated_energy == 0
    for asperity in ensemble.asperities(state):
        assert asperity.dissipated_energy == 0
        assert asperity.stick_radius == asperity.contact_radius
    # loads in proportion are displacements in proportion
    ratio = increments[0][1] * friction
    first = advance(ensemble, "loads", (increments[0][0], ratio * increments[0][0]))
    expected = ratio * contact.compliance_ratio * first.approach
    # a displacement is found within rounding of full slip
    rounding = 32 * EPS * max(abs(expected), friction * contact.compliance_ratio * first.approach)
    assert abs(first.tangential_displacement - expected) <= rounding


ODD = {"tangential_load", "total_tangential_load", "tangential_displacement", "drive_displacement"}


@given(histories(compliance=True))
def test_a_mirrored_history_is_mirrored_bit_for_bit_and_energies_add_up(drawn):
    mirrored = [move._replace(tangential_value=-move.tangential_value) for move in drawn.moves]
    history, mirror = (each.replay(substeps=2) for each in (drawn, drawn._replace(moves=mirrored)))
    for name in history.data_vars:
        expected = -history[name].values if name in ODD else history[name].values
        assert np.array_equal(mirror[name].values, expected, equal_nan=name == "slide_time"), name
    energies, total = history.dissipated_energy.values, history.total_dissipated_energy.values
    assert np.all(np.diff(energies, axis=0) >= 0)
    assert np.all(np.diff(total) >= 0)
    # a rounding per addition
    assert energies.sum(axis=1) == approx(total, rel=1e-11, abs=1e-18)


@given(histories())
def test_holding_and_saving_a_state_change_nothing(drawn):
    ensemble = drawn.ensemble
    for state in drawn.states():
        saved = hs.State.from_bytes(state.to_bytes())
        held = ensemble.advance(ensemble.advance(saved))
        assert held.approach == state.approach
        assert held.tangential_displacement == approx(
            state.tangential_displacement, abs=1e-14 * drawn.slide
        )
        assert held.tangential_load == approx(
            state.tangential_load, rel=1e-14, abs=1e-15 * drawn.limit
        )
        assert held.dissipated_energy == approx(state.dissipated_energy, rel=1e-12)
        for before, after in zip(
            ensemble.asperities(state), ensemble.asperities(held), strict=True
        ):
            assert after.stick_radius == approx(
                before.stick_radius, abs=1e-6 * before.contact_radius
            )


# exponents of two that a unit of each variable carries: of length, of force
SCALED = {
    "largest_traction_ratio": (0, 0),
    "present_friction": (0, 0),
    "total_normal_load": (0, 1),
    "total_tangential_load": (0, 1),
    "friction_limit": (0, 1),
    "normal_load": (0, 1),
    "tangential_load": (0, 1),
    "separation": (1, 0),
    "tangential_displacement": (1, 0),
    "contact_radius": (1, 0),
    "stick_radius": (1, 0),
    "real_contact_area": (2, 0),
    "tangential_stiffness": (-1, 1),
    "dissipated_energy": (1, 1),
    "total_dissipated_energy": (1, 1),
    "contact_count": (0, 0),
    "slip_state": (0, 0),
    "saturated": (0, 0),
    "slide_time": (0, 0),
}


def rescaled(drawn, length, force):
    """Return the history in other units of length and force."""
    unit, modulus = {"load": force, "displacement": length}, force / length**2
    contact = drawn.contact._replace(
        contact_modulus=drawn.contact.contact_modulus * modulus,
        shear_modulus=drawn.contact.shear_modulus * modulus,
        summit_height=drawn.contact.summit_height * length,
        summit_radius=drawn.contact.summit_radius * length,
    )
    moves = [
        move._replace(
            normal_value=move.normal_value * unit[move.normal_kind],
            tangential_value=move.tangential_value * unit[move.tangential_kind],
        )
        for move in drawn.moves
    ]
    return drawn._replace(contact=contact, moves=moves)


@given(histories(), st.sampled_from([(-30, 0), (0, 40), (20, -25), (-30, -10)]))
def test_units_change_results_by_rounding_only(drawn, exponents):
    length, force = exponents
    history, other = (each.replay() for each in (drawn, rescaled(drawn, 2.0**length, 2.0**force)))
    assert {*history.data_vars} <= {*SCALED}
    for name in history.data_vars:
        lengths, forces = SCALED[name]
        expected = history[name].values * 2.0 ** (lengths * length + forces * force)
        largest = np.nanmax(np.abs(expected), initial=0.0)
        assert other[name].values == approx(
            expected, rel=1e-13, abs=1e-13 * largest, nan_ok=True
        ), name


# -- closed forms ----------------------------------------------------------------------------------


BALL = hs.Ensemble(GLASS, summit_height=1e-3, summit_radius=2.5e-3, friction=0.2)
BALL_LOAD = 50e-3
BALL_DEPTH = hertz.approach(BALL_LOAD, summit_radius=2.5e-3, contact_modulus=GLASS.contact_modulus)
BALL_RADIUS = float(hertz.contact_radius(BALL_DEPTH, summit_radius=2.5e-3))
SLIPPING = {"normal_load": BALL_LOAD, "contact_radius": BALL_RADIUS, "friction": 0.2}
ELASTIC = SLIPPING | {"shear_modulus": GLASS.shear_modulus}
BALL_LIMIT = 0.2 * BALL_LOAD


def ball_at(*shares):
    """The ball under its load after tangential loads that are shares of the limit, and its contact."""
    state = ramped(BALL, (BALL_LOAD, 0.0), *((BALL_LOAD, share * BALL_LIMIT) for share in shares))
    return state, BALL.asperity(0, state)


@mark.parametrize("share", [1e-6, 1e-4, 1e-2, 0.3, 0.9, 1.0])
def test_a_closed_loop_costs_the_closed_form_energy(share):
    first, _ = ball_at(share)
    last = ramped(
        BALL, (BALL_LOAD, -share * BALL_LIMIT), (BALL_LOAD, share * BALL_LIMIT), state=first
    )
    loop = mindlin.dissipated_energy_per_loop(share * BALL_LIMIT, **ELASTIC)
    # the width of the slip annulus, whose cube counts, is known to a rounding of the radius
    assert last.dissipated_energy - first.dissipated_energy == approx(
        loop, rel=1e-12 + 16 * EPS / share
    )
    assert BALL.asperity(0, last).dissipated_energy == last.dissipated_energy


# -- rows of springs -------------------------------------------------------------------------------


def follow_springs(drawn, springs, substeps):
    """T_i, U, W_i, c_i, coefficients and the stored energy of rows of springs after each distinct time."""
    row = DrivenRow(
        drawn.contact,
        drawn.contact.approach(drawn.largest_load) * (1 + 1e-12),
        springs,
        stiffness=drawn.stiffness,
    )
    rows = [
        (
            now.tangential_load,
            now.tangential_displacement,
            now.dissipated_energy,
            now.stick_radius,
            now.contact.friction,
        )
        for now in follow(row, drawn.moves, substeps)
    ]
    return [np.array(quantity) for quantity in zip(*rows, strict=True)], row


def assert_agrees_with_springs(drawn, springs, substeps, radii=True, loss=3):
    """T_i, U, W_i, c_i and the stored energy, within the error of the springs' grid and of their substeps."""
    # where a spring slips only part of a substep, the error falls with the substeps in jumps, and
    # with several coefficients two counts of substeps may agree by chance
    counts = (
        substeps,
        3 * substeps + 1,
        *([10 * substeps + 7] if np.ptp(drawn.contact.friction) > 0 else []),
    )
    *coarser, (fine, row) = (follow_springs(drawn, springs, count) for count in counts)
    doubt = [2 * max(np.abs(c[i] - fine[i]).max() for c, _ in coarser) for i in range(len(fine))]
    load, displacement, energy, stick, friction = fine
    history = drawn.replay()
    limit, slide = drawn.limit, drawn.slide
    # a change of friction leaves more kinks for the midpoint rule; the engine refines ramps to 1e-6
    grid = (3 if any(move.friction for move in drawn.moves) else 1) / springs**2 + 1e-6
    found, total = history.tangential_load.values, history.total_tangential_load.values
    assert np.abs(found - load).max() <= grid * limit + doubt[0]
    assert np.abs(total - load.sum(axis=1)).max() <= grid * limit + doubt[0]
    # an error of the load moves the contact as far as it bends the instrument
    slack = 2 * grid * slide + grid * limit / drawn.stiffness + doubt[1]
    assert np.abs(history.tangential_displacement.values - displacement).max() <= slack
    # a contact much smaller than the largest has fewer springs
    spent = energy.sum(axis=1).max() + 0.01 * limit * (slide + limit / drawn.stiffness)
    assert np.abs(history.dissipated_energy.values - energy).max() <= loss * grid * spent + doubt[2]
    if radii:
        assert np.all(np.abs(history.stick_radius.values - stick) <= 1.5 * row.spacing + doubt[3])
    assert np.all(np.abs(found) <= friction * history.normal_load.values * (1 + 4 * EPS))
    assert found.sum(axis=1) == approx(total, abs=1e-13 * limit)
    *_, last = drawn.states()
    assert last.stored_energy == approx(
        row.elastic_energy.sum(), abs=3 * grid * limit * slide + doubt[0] * slide
    )
    rounding = 32 * EPS * np.abs(history.tangential_displacement.values).max(initial=slide)
    rounding = rounding * (1 + 4 * limit / slide / drawn.stiffness)
    if math.isfinite(drawn.stiffness) and drawn.moves[-1].tangential_kind == "displacement":
        drive = history.drive_displacement.values[-1]
        assert drive == approx(drawn.moves[-1].tangential_value, abs=rounding)


@settings(max_examples=12)
@given(histories(counts=(1, 3, 20)))
def test_histories_agree_with_rows_of_springs(drawn):
    assert_agrees_with_springs(drawn, springs=200, substeps=20)


@settings(max_examples=6)
@given(histories(counts=(1, 3), compliance=True))
def test_histories_behind_an_instrument_agree_with_rows_of_springs(drawn):
    assert_agrees_with_springs(drawn, springs=200, substeps=20, radii=False)


@settings(max_examples=12)
@given(histories(counts=(1, 3), steep=[True], extremes=True))
def test_extreme_histories_agree_with_rows_of_springs(drawn):
    # springs do not see slip annuli as narrow as can be drawn, and a short history loses its energy
    # near its kinks
    assert_agrees_with_springs(drawn, springs=200, substeps=30, radii=False, loss=15)


@mark.slow
@settings(max_examples=400)
@given(histories(counts=(1, 3, 8, 50), longest=14))
def test_many_histories_agree_with_rows_of_springs(drawn):
    # a polyline that is cut several times may leave a sticking ring narrower than the springs'
    # spacing
    assert_agrees_with_springs(drawn, springs=400, substeps=60, radii=False)


# -- friction changes and lift-off -----------------------------------------------------------------


def test_a_fall_of_friction_at_fixed_displacement_clips_the_virgin_state():
    held = SPHERE.advance(
        ramped(SPHERE, (LOAD, 0.0), (LOAD, 0.003)),
        tangential_displacement=mindlin.tangential_displacement(
            0.003, **hertz_unit(LOAD), shear_modulus=0.25
        ),
    )
    fallen = SPHERE.advance(held, friction=0.4)
    fresh = hs.Ensemble(UNIT_PAIR, 0.0, 1.0, 0.4)
    clipped = fresh.advance(
        ramped(fresh, (LOAD, 0.0)),
        tangential_displacement=held.tangential_displacement,
        normal_load=LOAD,
    )
    assert fallen.tangential_displacement == held.tangential_displacement
    assert fallen.tangential_load == approx(clipped.tangential_load, rel=8 * EPS)
    assert SPHERE.asperity(0, fallen).stick_radius == approx(
        fresh.asperity(0, clipped).stick_radius, rel=1e-13
    )
    lost = held.stored_energy - fallen.stored_energy
    assert fallen.dissipated_energy - held.dissipated_energy == approx(lost, rel=1e-9)


@mark.parametrize("factor", [0.999999, 0.998, 0.9, 0.6, 0.31])
def test_sliding_continues_when_friction_falls(factor):
    rng = np.random.default_rng(4)
    for friction, approach in zip(
        rng.uniform(0.1, 0.9, 30), rng.uniform(0.001, 0.1, 30), strict=True
    ):
        sphere = hs.Ensemble(UNIT_PAIR, 0.0, 1.0, friction)
        sliding = displaced(sphere, (approach, 0.0), (approach, 1.5 * approach))
        fallen = sphere.advance(sliding, friction=factor * friction)
        ball = sphere.asperity(0, fallen)
        assert ball.tangential_load == approx(factor * friction * ball.normal_load, rel=4 * EPS)
        assert ball.slip_state == hs.SlipState.GROSS_SLIP
        assert ball.stick_radius == 0
        assert ball.reversal_points.size == 0


def spiral_turns(count, share=0.9):
    """Ever smaller reversals, as shares of the limit."""
    return share * (1 - np.arange(count) / count) * (-1.0) ** np.arange(count)


@given(contacts())
def test_total_lift_off_erases_all_and_touching_again_starts_afresh(contact):
    ensemble = build_ensemble(contact)
    used = displaced(
        ensemble,
        (0.03, 0.0),
        (0.03, 0.01),
        (0.02, 0.004),
        (0.0, 0.004),
        (-0.01, 0.025),
        (0.0, 0.025),
    )
    assert used.tangential_load == used.normal_load == used.stored_energy == 0
    assert not any(len(used.vertices(group)) for group in range(used.group.max() + 1))
    again, fresh = used, ensemble.initial_state()
    for approach, shift in ((0.03, 0.002), (0.03, 0.008), (0.025, -0.001)):
        again = displaced(ensemble, (approach, 0.025 + shift), state=again)
        fresh = displaced(ensemble, (approach, shift), state=fresh)
        assert again.tangential_load == approx(fresh.tangential_load, rel=1e-12)
        assert again.dissipated_energy - used.dissipated_energy == approx(
            fresh.dissipated_energy, rel=1e-11
        )


def test_a_ramp_to_nothing_and_a_displacement_in_the_air():
    state = ramped(SPHERE, (LOAD, 0.0), (LOAD, 0.003), (0.0, 0.0))
    # virgin loading and a proportional release: the last spring never left its anchor
    assert state.tangential_displacement == 0
    assert state.approach == state.tangential_load == state.normal_load == 0
    assert state.stored_energy == 0
    moved_on = SPHERE.advance(state, tangential_displacement=0.02)
    assert moved_on.dissipated_energy == state.dissipated_energy
    touched = SPHERE.advance(moved_on, normal_load=LOAD)
    assert touched.tangential_load == 0
    assert touched.tangential_displacement == 0.02


# -- spirals ---------------------------------------------------------------------------------------


def spiral(ensemble, loads, normal_load, by_load):
    """Dataset of a spiral in and out again at a constant normal load, row for row."""
    kind = hs.TangentialLoad if by_load else hs.TangentialDisplacement
    path = [*loads, *loads[-2::-1]]
    events = [
        hs.NormalLoad(0.0, normal_load),
        *(kind(float(k + 1), value) for k, value in enumerate(path)),
    ]
    return hs.replay(ensemble, events, record="totals").isel(step=slice(1, None))


def assert_closes(history):
    for name in ("total_tangential_load", "tangential_displacement", "tangential_stiffness"):
        values = history[name].values
        assert np.array_equal(values, values[::-1]), name
    assert np.all(np.diff(history.total_dissipated_energy.values) >= 0)


@mark.parametrize("by_load", [False, True])
@mark.parametrize("count, turns", [(1, 3000), (20, 3000), param(1, 100_000, marks=mark.slow)])
def test_all_loops_of_a_spiral_close_on_the_way_out(count, turns, by_load):
    contact = random_contact(np.random.default_rng(0), count)
    approach = contact.approach(0.02 * count)
    unit = (
        contact.limit(approach)
        if by_load
        else contact.compliance_ratio * contact.friction[0] * approach
    )
    assert_closes(
        spiral(build_ensemble(contact), spiral_turns(turns) * unit, 0.02 * count, by_load)
    )


def test_the_memory_is_as_deep_as_the_reversals_that_are_open():
    state = ramped(SPHERE, (LOAD, 0.0))
    turns = spiral_turns(60) * LIMIT
    depths = []
    for load in [*turns, *turns[-2::-1]]:
        state = ramped(SPHERE, (LOAD, load), state=state)
        depths.append(len(state.vertices()))
    # one vertex at the axis, one at the edge, one per open reversal
    assert depths == [*range(3, 63), *range(61, 2, -1)]
