"""What can be asked of one asperity: loads, radii, reversal points, traction, slip state, stiffness."""

import copy
import itertools
import math
import pickle
from xml.etree import ElementTree as ET

import numpy as np
from golden import check_messages
from histories import random_contact, random_moves
from pairs import GLASS as PAIR
from pairs import PLAIN
from pytest import approx, mark, raises
from scipy.integrate import quad

import historysim as hs
from historysim.asperities.asperity_set import require_asperities  # noqa: F401 - of the messages
from historysim.contact import hertz, mindlin

EPS = np.finfo(float).eps


R, MU, LOAD = 2.5e-3, 0.2, 50e-3
BALL = hs.Ensemble(PAIR, summit_height=0.0, summit_radius=R, friction=MU)
DEPTH = float(hertz.approach(LOAD, summit_radius=R, contact_modulus=PAIR.contact_modulus))
RADIUS = float(hertz.contact_radius(DEPTH, summit_radius=R))
SLIPPING = {"normal_load": LOAD, "contact_radius": RADIUS, "friction": MU}
ELASTIC = SLIPPING | {"shear_modulus": PAIR.shear_modulus}
LIMIT = MU * LOAD

SEPARATED, FULL_STICK, PARTIAL_SLIP, GROSS_SLIP = hs.SlipState


def state_at(*shares):
    """The ball under its load after tangential loads that are shares of the limit."""
    state = BALL.advance(BALL.initial_state(), normal_load=LOAD, tangential_load=0.0)
    for share in shares:
        state = BALL.advance(state, tangential_load=share * LIMIT)
    return state


def ball_at(*shares):
    return BALL.asperity(0, state_at(*shares))


def scattered_states(several):
    """An ensemble of unequal asperities, and the states of a random history."""
    rng = np.random.default_rng(11)
    contact = random_contact(rng, 6, several_coefficients=several)._replace(
        contact_modulus=2.0, shear_modulus=0.3
    )
    ensemble = hs.Ensemble(PLAIN, contact.summit_height, contact.summit_radius, contact.friction)
    state, states = ensemble.initial_state(), []
    for move in random_moves(rng, contact, 0.12, count=12, friction_changes=True):
        approach = (
            move.normal_value
            if move.normal_kind == "displacement"
            else contact.approach(move.normal_value)
        )
        state = ensemble.advance(
            state,
            normal_displacement=float(approach),
            **{f"tangential_{move.tangential_kind}": move.tangential_value},
            friction=move.friction,
        )
        states.append(state)
    return ensemble, states


def test_slip_states():
    assert BALL.asperity(0, BALL.initial_state()).slip_state == SEPARATED
    assert ball_at().slip_state == FULL_STICK
    assert ball_at(0.5).slip_state == PARTIAL_SLIP
    assert ball_at(0.5, 0.4999).slip_state == PARTIAL_SLIP
    assert ball_at(1.0).slip_state == GROSS_SLIP
    pressed = BALL.advance(state_at(0.5), normal_load=1.1 * LOAD)
    assert BALL.asperity(0, pressed).slip_state == FULL_STICK
    assert BALL.asperity(0, pressed).stick_radius == BALL.asperity(0, pressed).contact_radius


def reversals(asperity):
    """Displacements of the reversals that an asperity remembers, the oldest first."""
    return asperity.reversal_points.displacement[::-1].tolist()


def test_reversal_points_stand_from_the_edge_inward_with_their_displacements():
    shares = (0.9, -0.7, 0.5, -0.2)
    loads = np.array(shares) * LIMIT
    points = ball_at(*shares).reversal_points
    # a half cycle reaches as deep as virgin loading by half of it; the last one is not reversed yet
    jumps = np.abs(np.diff(loads, prepend=-loads[0]))[:-1] / 2
    radii = [mindlin.stick_radius(jump, **SLIPPING) for jump in jumps]
    made = [mindlin.tangential_displacement(loads[0], **ELASTIC)]
    for before, after in itertools.pairwise(loads[:-1]):
        made.append(made[-1] + 2 * mindlin.tangential_displacement((after - before) / 2, **ELASTIC))
    assert points.radius == approx(radii[::-1], rel=1e-13)
    assert points.displacement == approx(made[::-1], rel=1e-12)
    assert np.all(np.diff(points.radius) < 0)
    assert points[0].radius == points.radius[0]


def test_a_reversal_is_wiped_out_when_its_loop_closes_or_all_slides():
    assert ball_at(0.6, -0.2, 0.6).reversal_points.size == 0
    assert ball_at(0.6, -0.2, 0.7).reversal_points.size == 0
    assert ball_at(0.6, -1.0).reversal_points.size == 0
    turned = ball_at(0.6, -0.2)
    assert ball_at(0.6, -0.2, 0.1, -0.2).reversal_points.tolist() == turned.reversal_points.tolist()


def test_a_reversal_out_of_gross_slip_has_no_stick_radius():
    sliding = BALL.advance(state_at(0.6), tangential_displacement=1e-6)
    point = BALL.asperity(0, BALL.advance(sliding, tangential_load=0.2 * LIMIT)).reversal_points
    assert point.tolist() == [(0.0, 1e-6)]


@mark.parametrize("part", [1.2, 0.97])
def test_a_normal_load_that_leaves_its_front_in_contact_leaves_a_reversal(part):
    turned = state_at(0.9, -0.3)
    made = BALL.asperity(0, turned).reversal_points
    pressed = BALL.asperity(0, BALL.advance(turned, normal_load=part * LOAD))
    assert pressed.reversal_points.tolist() == made.tolist()
    # in virgin loading a rising normal load is no reversal, and a falling tangential load then is
    raised = BALL.advance(state_at(0.5), normal_load=1.2 * LOAD)
    assert BALL.asperity(0, raised).reversal_points.size == 0
    onward = BALL.advance(raised, tangential_load=0.9 * LIMIT)
    assert BALL.asperity(0, onward).reversal_points.size == 0
    back = BALL.advance(raised, tangential_load=0.2 * LIMIT)
    assert reversals(BALL.asperity(0, back)) == [raised.tangential_displacement]


def test_a_normal_load_that_takes_the_contact_edge_behind_its_front_wipes_a_reversal_out():
    light = BALL.advance(state_at(0.3, 0.1), normal_load=0.5 * LOAD)
    assert BALL.asperity(0, light).reversal_points.size == 0


def test_each_asperity_of_a_group_remembers_the_reversals_that_it_was_there_for():
    ensemble = hs.Ensemble(PAIR, [0.0, -0.6 * DEPTH, -0.95 * DEPTH], R, MU)
    state = ensemble.advance(
        ensemble.initial_state(), normal_displacement=DEPTH, tangential_displacement=0.0
    )
    slide = PAIR.displacement_ratio * MU * DEPTH
    for target in (0.8 * slide, 0.6 * slide):
        state = ensemble.advance(state, tangential_displacement=target)
    found = [ensemble.asperity(i, state) for i in range(3)]
    # at the reversal the second and the third asperity slid as a whole
    assert [reversals(asperity) for asperity in found] == [[approx(0.8 * slide)]] * 2 + [[]]
    assert found[0].reversal_points.radius > 0
    assert found[1].reversal_points.radius == 0


def integrated(asperity):
    """∫ 2π r τ dr between the kinks of the traction, by quadrature in r = c sin φ, which flattens the roots."""
    ends = [0.0, *asperity.superposition[0][::-1]]
    total = 0.0
    for low, high in itertools.pairwise(ends):
        if high > low:
            total += quad(
                lambda angle, c=high: (
                    2
                    * math.pi
                    * c**2
                    * math.sin(angle)
                    * math.cos(angle)
                    * float(asperity.traction(c * math.sin(angle)))
                ),
                math.asin(low / high),
                math.pi / 2,
                epsabs=1e-12 * asperity.normal_load,
                epsrel=1e-10,
            )[0]
    return total


@mark.parametrize("several", [False, True])
def test_the_traction_integrates_to_the_load_and_obeys_coulomb(several):
    ensemble, states = scattered_states(several)
    for state in states:
        for asperity in (ensemble.asperity(i, state) for i in range(len(ensemble))):
            limit = asperity.friction * asperity.normal_load
            assert integrated(asperity) == approx(
                asperity.tangential_load, abs=1e-7 * limit + 1e-15
            )
            r = np.linspace(0, 1.2 * asperity.contact_radius, 50)
            peak = float(asperity.pressure(0.0))
            excess = np.abs(asperity.traction(r)) - asperity.friction * asperity.pressure(r)
            # the root at a vertex keeps half of its digits
            assert np.all(excess <= 1e-7 * peak)
            assert not asperity.traction(r[r > asperity.contact_radius]).any()


@mark.parametrize("turns", [(0.5,), (0.9, 0.2), (0.9, -0.3, 0.4)])
def test_the_stiffness_is_the_slope_of_the_load(turns):
    state = state_at(*turns)
    ball = BALL.asperity(0, state)
    onward = turns[-1] - (turns[-2] if len(turns) > 1 else 0.0)
    step = math.copysign(1e-6 * DEPTH, onward)
    loads = [
        BALL.advance(
            state, tangential_displacement=state.tangential_displacement + k * step
        ).tangential_load
        for k in (0, 1, 2)
    ]
    # one-sided, second order; the remainder is the third derivative and rounding over the step
    slope = (-3 * loads[0] + 4 * loads[1] - loads[2]) / (2 * step)
    assert ball.tangential_stiffness == approx(slope, rel=1e-8)
    assert ball.tangential_stiffness == approx(
        8 * PAIR.shear_modulus * ball.stick_radius, rel=4 * EPS
    )


# properties of an asperity, as numbers
NUMBERS = (
    *(
        "normal_load",
        "contact_radius",
        "stick_radius",
        "slip_state",
        "slip_annulus",
        "friction",
        "approach",
    ),
    *("dissipated_energy", "stored_energy", "preliminary_displacement", "tangential_stiffness"),
    *("summit_height", "summit_radius"),
)
PLACES = np.linspace(0.0, 1.1, 40)


def answers(asperity):
    """All that an asperity answers, as bytes of numbers."""
    found = {name: np.asarray(getattr(asperity, name)).tobytes() for name in NUMBERS}
    radius = PLACES * asperity.contact_radius
    found |= {
        "traction": asperity.traction(radius).tobytes(),
        "pressure": asperity.pressure(radius).tobytes(),
    }
    if asperity.has_moved_straight:
        found["reversal_points"] = asperity.reversal_points.tobytes()
    return found | {"tangential_load": np.asarray(asperity.tangential_load).tobytes()}


@mark.parametrize("seed", range(2))
def test_an_asperity_by_itself_has_the_bits_of_an_ensemble_of_one(seed):
    rng = np.random.default_rng(seed)
    contact = random_contact(rng, 1)._replace(contact_modulus=2.0, shear_modulus=0.3)
    radius, friction = float(contact.summit_radius[0]), float(contact.friction[0])
    ensemble = hs.Ensemble(PLAIN, 0.0, radius, friction)
    alone, state = hs.Asperity(PLAIN, radius, friction=friction), ensemble.initial_state()
    for move in random_moves(rng, contact, 0.12, count=25, friction_changes=True):
        coefficient = None if move.friction is None else float(np.ravel(move.friction)[0])
        targets = {
            f"normal_{move.normal_kind}": move.normal_value,
            f"tangential_{move.tangential_kind}": move.tangential_value,
        }
        # a load of the draw is within the limit of another approach
        how = targets | {"friction": coefficient, "saturate": True}
        before = answers(alone)
        alone, state, last = alone.advance(**how), ensemble.advance(state, **how), alone
        assert answers(last) == before
        assert alone.state == state
        assert answers(alone) == answers(ensemble.asperity(0, state))
        assert alone.tangential_load == approx(state.tangential_load, rel=1e-12)


def test_along_a_line_in_the_plane_reversal_points_are_vectors():
    direction = np.array([0.6, -0.8])
    flat, plane = (hs.Asperity(PAIR, R, MU).advance(normal_load=LOAD) for _ in range(2))
    for share in (0.9, -0.5, 0.2):
        flat = flat.advance(tangential_load=share * LIMIT)
        plane = plane.advance(tangential_load=tuple(share * LIMIT * direction))
    assert plane.has_moved_straight
    points = plane.reversal_points
    assert points.radius == approx(flat.reversal_points.radius, rel=1e-12)
    expected = np.multiply.outer(flat.reversal_points.displacement, direction)
    assert points.displacement == approx(expected, rel=1e-12)
    assert plane.history.tangential_load == approx(
        np.multiply.outer(flat.history.tangential_load, direction)
    )


def test_the_slip_annulus_is_from_the_stick_radius_to_the_edge():
    assert ball_at(0.5).slip_annulus == (
        approx(RADIUS * 0.5 ** (1 / 3)),
        ball_at().contact_radius,
    )
    assert ball_at().slip_annulus == (ball_at().contact_radius,) * 2


def loads(asperity):
    return [(row.normal_load, row.tangential_load) for row in asperity.history]


def test_steps_are_remembered_until_they_are_wiped_out():
    ball = hs.Asperity(PAIR, R, MU)
    assert ball.history.size == 0
    ball = ball.advance(normal_load=LOAD)
    for share in (0.9, -0.7, 0.5, -0.2):
        ball = ball.advance(tangential_load=share * LIMIT)
    # as many reversals as turns, the last step is now
    assert loads(ball) == [(LOAD, approx(share * LIMIT)) for share in (0.0, 0.9, -0.7, 0.5, -0.2)]
    assert ball.history.tangential_displacement[1:-1].tolist() == reversals(ball)
    # the two inner loops close
    closed = ball.advance(tangential_load=-0.71 * LIMIT)
    assert loads(closed) == [(LOAD, approx(share * LIMIT)) for share in (0.0, 0.9, -0.71)]
    slid = closed.advance(tangential_displacement=-1e-6)
    assert loads(slid) == [(LOAD, 0.0), (LOAD, approx(-LIMIT))]
    assert loads(slid.advance(normal_load=0.0)) == [(0.0, 0.0)]


def test_a_normal_load_is_remembered_while_its_contact_edge_is():
    ball = hs.Asperity(PAIR, R, MU).advance(normal_load=LOAD).advance(tangential_load=0.3 * LIMIT)
    raised = ball.advance(normal_load=2 * LOAD)
    assert loads(raised) == [
        (LOAD, 0.0),
        (LOAD, approx(0.3 * LIMIT)),
        (2 * LOAD, approx(0.3 * LIMIT)),
    ]
    lowered = raised.advance(normal_load=0.9 * LOAD)
    assert [normal for normal, _ in loads(lowered)] == [0.9 * LOAD]


@mark.parametrize("planar", [False, True])
def test_an_asperity_is_pickled_with_its_memory(planar):
    ball = hs.Asperity(PAIR, R, MU).advance(normal_load=LOAD)
    ball = ball.advance(tangential_load=(0.5 * LIMIT, 0.1 * LIMIT) if planar else 0.5 * LIMIT)
    again = pickle.loads(pickle.dumps(ball))
    for same in (again, copy.copy(ball), copy.deepcopy(ball)):
        assert same == ball
        assert hash(same) == hash(ball)
    assert ball not in {
        ball.advance(normal_load=2 * LOAD),
        hs.Asperity(PAIR, R, MU),
        hs.Asperity(PAIR, R, 2 * MU),
    }
    assert answers(again) == answers(ball)
    assert again.history.tobytes() == ball.history.tobytes()
    onward = (0.0, 0.2 * LIMIT) if planar else 0.2 * LIMIT
    assert answers(again.advance(tangential_load=onward)) == answers(
        ball.advance(tangential_load=onward)
    )


@mark.parametrize(
    "targets", [{}, {"normal_load": LOAD}, {"normal_load": LOAD, "tangential_load": (1e-3, 2e-3)}]
)
def test_a_notebook_shows_the_traction(targets):
    ball = hs.Asperity(PAIR, R, MU).advance(**targets)
    text = ball._repr_html_()
    table = ET.fromstring(f"<p>{text}</p>").find("table")  # noqa: S314 - made here
    assert ball.state_text in ET.tostring(table, encoding="unicode")
    curves = ET.fromstring(f"<p>{text}</p>").findall(".//{*}polyline")  # noqa: S314 - as above
    # ± friction × pressure, and the traction or its two components
    assert len(curves) == (0 if not targets else 4 if "tangential_load" in targets else 3)
    assert repr(ball).startswith(f"<Asperity: {ball.state_text}, normal load")


def test_friction_laws_wear_and_yielding_act_on_an_asperity_by_itself():
    worn = hs.Asperity(PAIR, 1e-5, MU, wear=hs.wear.ArchardWear(coefficient=1e-3, hardness=6e9))
    worn = worn.advance(normal_load=1e-3).advance(tangential_displacement=1e-6)
    assert worn.summit_height < 0
    assert worn.summit_height == worn.state.evolved.summit_height[0]
    assert (
        hs.Asperity(PAIR, 1e-5, hs.laws.ShearStrength(300e6)).advance(normal_load=1e-3).friction
        != MU
    )
    assert (
        hs.Asperity(PAIR, 1e-6, MU, yielding="kogut-etsion").advance(normal_load=1e-3).summit_radius
        > 1e-6
    )


def two():
    ensemble = hs.Ensemble(PAIR, [0.0, -1e-8], R, MU)
    return ensemble.asperities(ensemble.advance(ensemble.initial_state(), normal_load=LOAD))


@mark.parametrize("several", [False, True])
def test_all_asperities_are_a_sequence_of_the_same_ones(several):
    ensemble, states = scattered_states(several)
    for state in states[::4]:
        found = ensemble.asperities(state)
        assert len(found) == len(ensemble)
        assert [answers(each) for each in found] == [
            answers(ensemble.asperity(i, state)) for i in range(len(ensemble))
        ]
        assert [each.index for each in found[1:4]] == [1, 2, 3]
        assert [each.index for each in found[::-2]] == [5, 3, 1]
        assert answers(found[-1]) == answers(ensemble.asperity(len(ensemble) - 1, state))
        with raises(IndexError, match="asperity 6 of 6; expected -6 to 5"):
            found[6]


def test_messages():
    check_messages(globals())
