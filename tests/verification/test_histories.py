"""Any history of normal and tangential loads, against springs, polylines and identities."""

import numpy as np
import pytest
from histories import TABLE, follow, random_contact, random_moves, to_events
from polylines import Polylines
from springs import SpringRow

import historysim as hs

UNIT = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)


def test_random_histories(page):
    """Random histories of twelve asperities

    Compared with **rows of 2000 Coulomb springs** under each asperity (`springs.py`), which know
    nothing of vertices. Moves are drawn at random: loads and displacements in both channels,
    together and alone, with lift-off, new touch and changes of friction.

    The model ends where friction falls after a reversal (above), and where asperities press on one
    another (below).
    """

    def random_history(contact, events):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        rough = hs.Ensemble(pair, contact.summit_height, contact.summit_radius, contact.friction)
        history = hs.replay(rough, events, record="all")
        return history

    rng = np.random.default_rng(5)
    contact = random_contact(rng, 12)
    moves = random_moves(rng, contact, 0.1, count=25, friction_changes=True)
    events = to_events(moves)
    history = page.shows(random_history, contact, events)
    row = SpringRow(contact, contact.approach(0.1) * (1 + 1e-12), 2000)
    rows = [
        (each.tangential_load.copy(), each.dissipated_energy.sum())
        for each in follow(row, moves, substeps=50)
    ]
    loads, energies = np.array([each[0] for each in rows]), np.array([each[1] for each in rows])
    times = np.unique([event.time for event in events])
    at = [int(np.flatnonzero(history.time == time)[-1]) for time in times]
    limit = float((history.friction * history.normal_load).sum("asperity").max())
    found = history.tangential_load.values[at]
    total = history.total_tangential_load.values
    page.row(
        "total tangential load [N]",
        loads.sum(axis=1),
        total[at],
        2.5e-7,
        "springs: 1/n²",
        of="μN",
        scale=limit,
    )
    page.row("of each asperity [N]", loads, found, 2.5e-7, "springs: 1/n²", of="μN", scale=limit)
    spent = history.total_dissipated_energy.values[at]
    page.row("energy lost [J]", energies, spent, 1e-5, "springs: 50 steps a ramp", of="all of it")

    @page.picture
    def draw(axes):
        axes.plot(history.time[at], total[at] / limit, label="found")
        axes.plot(times, loads.sum(axis=1) / limit, "k.", ms=3, label="springs")
        axes.set(xlabel="time (s)", ylabel="tangential load, of the largest μN")


def test_theory_table(page):
    """A straight path after another

    Compared with **a printed table**: seven ramps of both loads, worked out once by another program
    from the memory function, for E* = R = 1, G* = 1/4 and μ = 1/2.

    The model ends where a ramp is not straight. A measured record is replayed sample by sample, so
    it is.
    """

    def ramps(table):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=0.5)
        state = ball.advance(ball.initial_state(), normal_load=0.01)
        found = []
        for normal, tangential, *_ in table:
            state = ball.advance(state, normal_load=normal, tangential_load=tangential)
            found.append((state.tangential_displacement, state.dissipated_energy))
        return np.array(found)

    found, table = page.shows(ramps, TABLE), np.array(TABLE)
    page.row("displacement [m]", table[:, 2], found[:, 0], 1e-7, "printed digits", of="the largest")
    page.row("energy lost [J]", table[:, 3], found[:, 1], 1e-6, "printed digits", of="the largest")

    @page.picture
    def draw(axes):
        axes.plot(table[:, 0], table[:, 1], "-o", ms=3)
        axes.plot([0, 0.02], [0, 0.01], "0.6", [0, 0.02], [0, -0.01], "0.6")
        axes.set(xlabel="normal load (N)", ylabel="tangential load (N); grey: ±μN")


@pytest.mark.slow
def test_at_the_limit(page):
    """Loads at and beyond the limit of friction

    Compared with **polylines in plain Python** (`polylines.py`), carried in 200 small steps a ramp.
    Two asperities have coefficients of their own; requests go beyond what they hold, and `saturate`
    has them slide at the limit.

    The model ends where the contact slides far: there is no inertia, and the displacement is the
    nearest at which the load is the limit.
    """

    def beyond(targets):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        two = hs.Ensemble(pair, summit_height=[0.0, -0.3], summit_radius=1.0, friction=[0.18, 0.8])
        state, found = two.initial_state(), []
        for normal, tangential in targets:
            state = two.advance(
                state, normal_load=normal, tangential_load=tangential, saturate=True
            )
            found.append(
                (state.tangential_load, state.tangential_displacement, state.dissipated_energy)
            )
        return np.array(found)

    targets = [(0.45, 0.0), (0.87, 1.74), (0.13, 0.3), (0.93, 0.41)]
    found = page.shows(beyond, targets)
    coarse, fine = (walked(targets, steps) for steps in (100, 200))
    settled = 2 * fine - coarse
    page.row(
        "tangential load [N]",
        fine[:, 0],
        found[:, 0],
        1e-9,
        "rounding of 200 steps",
        of="the largest",
    )
    page.row(
        "displacement [m]",
        settled[:, 1],
        found[:, 1],
        1e-5,
        "200 steps, first order",
        of="the largest",
    )
    page.row(
        "energy lost [J]",
        settled[:, 2],
        found[:, 2],
        2e-3,
        "200 steps, first order",
        of="all of it",
    )

    @page.picture
    def draw(axes):
        normal = np.linspace(0, 1, 50)
        oracle = Polylines([0.0, -0.3], 1.0, [0.18, 0.8])
        axes.plot(
            normal, [oracle.limit_at(oracle.approach_at(n)) for n in normal], "0.6", label="limit"
        )
        axes.plot(*np.array(targets).T, "--o", ms=3, label="asked for")
        axes.plot(np.array(targets)[:, 0], found[:, 0], "-s", ms=3, label="found")
        axes.set(xlabel="normal load (N)", ylabel="tangential load (N)")


def walked(targets, steps):
    oracle, rows = Polylines([0.0, -0.3], 1.0, [0.18, 0.8]), []
    for normal, tangential in targets:
        oracle.to(("load", normal), ("load", tangential), steps=steps)
        rows.append((oracle.tangential_load, oracle.displacement, oracle.dissipated))
    return np.array(rows)


def test_energy_balance(page):
    """Work is stored or lost

    Compared with **the first law**: over a random path at a constant approach, the work ∫ T dU by
    quadrature over 200 parts of each event is what is stored and what is lost.

    The model ends where heat changes the materials: energies are mechanical, and nothing warms up.
    """

    def balance(turns):
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        rough = hs.Ensemble(pair, [0.0, -30e-9, -80e-9], [10e-6, 20e-6, 5e-6], friction=0.2)
        events = [hs.NormalLoad(-1.0, 4e-3)]
        events += [hs.TangentialDisplacement(float(k), turn) for k, turn in enumerate(turns)]
        history = hs.replay(rough, events, substeps=200)
        stored = hs.Replay(rough, events).state().stored_energy
        return history, stored

    turns = np.append(0.0, np.random.default_rng(2).uniform(-20e-9, 20e-9, 30))
    history, stored = page.shows(balance, turns)
    load, place = history.total_tangential_load.values, history.tangential_displacement.values
    work = np.trapezoid(load, place)
    lost = history.total_dissipated_energy.values
    page.row("work [J]", work, stored + lost[-1], 1e-4, "trapezoids of 1/200")
    # the lost energy never falls
    page.row(
        "smallest change of the lost energy [J]",
        0.0,
        min(np.diff(lost).min(), 0.0),
        0.0,
        "it never falls",
        scale=1.0,
    )

    @page.picture
    def draw(axes):
        axes.plot(1e9 * place, 1e3 * load, lw=0.8)
        axes.set(xlabel="displacement (nm)", ylabel="tangential load (mN)")


def test_same_numbers(page):
    """The log gives the same numbers

    Compared with **a second replay, event by event**, in which the state becomes bytes and is read
    again after each.

    The model ends where the version changes: a log says which version made it, and `historysim
    verify` what differs.
    """

    def twice(moves):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        rough = hs.Ensemble(pair, np.linspace(-0.02, 0, 50), summit_radius=1.0, friction=0.4)
        events = []
        for time, approach, displacement in moves:
            events += [
                hs.NormalDisplacement(time, approach),
                hs.TangentialDisplacement(time, displacement),
            ]
        history = hs.replay(rough, events)
        state, again = rough.initial_state(), []
        for _, approach, displacement in moves:
            state = hs.State.from_bytes(state.to_bytes())
            state = rough.advance(
                state, normal_displacement=approach, tangential_displacement=displacement
            )
            again.append((state.tangential_load, state.dissipated_energy))
        return history, np.array(again)

    rng = np.random.default_rng(9)
    moves = np.column_stack(
        [np.arange(160.0), rng.uniform(0.005, 0.03, 160), rng.uniform(-0.01, 0.01, 160)]
    )
    history, again = page.shows(twice, moves)
    page.row(
        "tangential load [N]",
        history.total_tangential_load.values,
        again[:, 0],
        0.0,
        "the same bits",
    )
    page.row(
        "energy lost [J]", history.total_dissipated_energy.values, again[:, 1], 0.0, "the same bits"
    )

    @page.picture
    def draw(axes):
        axes.plot(history.time, history.total_tangential_load, lw=0.8)
        axes.set(xlabel="time (s)", ylabel="tangential load (N)")
