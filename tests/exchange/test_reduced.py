"""Springs in place of a contact: their bound against adversaries, random histories and closed forms."""

import numpy as np
from c_core import ROOT
from golden import check_messages, refused
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx, mark
from reduced_contacts import CONTACTS, LOAD, PAIR, ball, job, rough, worst_history  # noqa: F401 - of the messages

import historysim as hs
from historysim.exchange.reduced.reducing import VirginCurve, _springs, place_nodes


def difference(model, curve, way):
    """What the contact carries more than springs at the end of a way [N]."""
    _, totals = curve.ensemble.advance_many(curve.rest, tangential_displacement=way)
    return totals.tangential_load[-1] - model.force(way)[-1]


@mark.parametrize("elements, bound", [(8, 0.0410), (32, 0.0104)])
def test_the_bound_of_a_ball_is_the_closed_form_s(elements, bound):
    curve = VirginCurve(ball(), LOAD)
    found = place_nodes(curve, elements)
    assert found.bound / found.load[-1] == approx(bound, abs=5e-5)
    # T = μN (1 - (1 - u)^1.5) by Cattaneo and Mindlin, whose slope is a chord's at u = 1 - (2 chord/3)²
    node = np.append(0.0, found.node / curve.end)
    virgin = 1 - np.maximum(1 - node, 0.0) ** 1.5
    chord = np.diff(virgin) / np.diff(node)
    top = 1 - (chord / 1.5) ** 2
    error = 1 - (1 - top) ** 1.5 - virgin[:-1] - chord * (top - node[:-1])
    assert found.bound == approx(2 * error.sum() * 0.2 * LOAD, rel=1e-9)
    # the asymptote (∫ √|T''|)²/4n = 1/3n
    assert bound == approx(1 / (3 * elements), rel=0.02)


@mark.parametrize("kind", CONTACTS)
@mark.parametrize("elements", [2, 12])
def test_an_adversary_reaches_the_bound(kind, elements):
    ensemble = CONTACTS[kind]()
    model = hs.reduce(job(ensemble), elements=elements)
    curve = VirginCurve(ensemble, LOAD)
    way = worst_history(curve, model.slip_displacement)
    limit = float(curve.evaluate(curve.end)[0])
    # the springs' nodes are quotients, and the spiral has twice as many reversals as there are
    # springs
    assert difference(model, curve, way) == approx(model.bound * limit, abs=1e-8 * limit)
    assert difference(model, curve, -way) == approx(-model.bound * limit, abs=1e-8 * limit)
    assert model.friction_limit == approx(limit, rel=1e-12)


@settings(max_examples=6)
@given(
    kind=st.sampled_from(sorted(CONTACTS)),
    elements=st.integers(1, 20),
    seed=st.integers(0, 2**32 - 1),
    fall=st.floats(0.5, 1.0),
)
def test_no_history_goes_beyond_the_bound(kind, elements, seed, fall):
    ensemble = CONTACTS[kind]()
    curve = VirginCurve(ensemble, LOAD)
    found = place_nodes(curve, elements)
    stiffness, limit = _springs(found.node, found.load)
    rng = np.random.default_rng(seed)
    # spirals inward and walks anywhere
    way = curve.end * rng.uniform(-1.3, 1.3, 60) * fall ** np.arange(60)
    _, totals = ensemble.advance_many(curve.rest, tangential_displacement=way)
    force, before = np.zeros(elements), 0.0
    for place, exact in zip(way, totals.tangential_load, strict=True):
        force = np.clip(force + stiffness * (place - before), -limit, limit)
        before = place
        assert abs(exact - force.sum()) <= found.bound + 1e-9 * found.load[-1]


@mark.parametrize("kind", CONTACTS)
@mark.parametrize("elements", [5])
def test_energies_of_closed_loops_keep_their_bound(kind, elements):
    ensemble = CONTACTS[kind]()
    curve = VirginCurve(ensemble, LOAD)
    model = hs.reduce(job(ensemble), elements=elements)
    errors = []
    for amplitude in np.linspace(0.02, 1.5, 30) * curve.end:
        stepper = ensemble.stepper(curve.rest)
        stepper.step(tangential_displacement=float(amplitude))
        before = stepper.dissipated_energy
        stepper.step(tangential_displacement=-float(amplitude))
        stepper.step(tangential_displacement=float(amplitude))
        # a spring of Jenkins takes 4 limits times what it slides
        own = 4 * (model.limit * np.maximum(amplitude - model.slip_displacement, 0.0)).sum()
        errors.append(abs(stepper.dissipated_energy - before - own))
    assert max(errors) <= model.energy_bound * (1 + 1e-6)
    assert max(errors) > 0.6 * model.energy_bound


def test_where_the_normal_load_varies_more_springs_are_nearer():
    errors = [
        hs.reduce(job(rough(), varies=True), elements=elements).errors["own history"]
        for elements in (2, 8, 32)
    ]
    assert errors[0] > errors[1] > errors[2]
    model = hs.reduce(job(rough(), varies=True), elements=8)
    for load in (LOAD, 0.3 * LOAD, 1e-3 * LOAD):
        curve = VirginCurve(rough(), load)
        stiffness, limit = model.scaling.interpolate(np.array([load]))
        # the table is straight between its rows
        assert limit.sum() == approx(0.2 * load, rel=1e-9)
        assert stiffness.sum() == approx(curve.rest.stiffness(1), rel=0.3)


def test_normal_load_and_shipped_scenario():
    scenario = ROOT / "scenarios" / "03_constant_load.toml"
    model = hs.reduce(scenario, elements=32, normal_load=0.02)
    assert model.normal_load == 0.02
    assert model.friction_limit == approx(0.2 * 0.02, rel=1e-12)
    assert hs.reduce(scenario).errors["own history"] < 0.01


def test_contacts_that_cannot_be_reduced_are_reported():
    model = hs.reduce(job(ball()), elements=4)
    model = hs.reduce(job(ball(), varies=True), elements=4)
    with refused("the end of the table of the model"):
        model.force([1e-9], [2 * LOAD])
    with refused("has shape"):
        model.force([1e-9], [LOAD, LOAD])


def test_messages():
    check_messages(globals())
