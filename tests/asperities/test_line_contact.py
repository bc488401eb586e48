import pickle

import numpy as np
from golden import check_messages
from half_space import HalfSpace
from pytest import approx, mark, raises
from scipy.integrate import quad

import historysim as hs

MODULUS, RADIUS, LENGTH, FRICTION = 1e11, 0.01, 0.005, 0.5
# G* is of no influence in plane strain
PAIR = hs.MaterialPair.from_moduli(contact_modulus=MODULUS, shear_modulus=2.9e10)


def cylinder(depth=0.01, length=LENGTH):
    return hs.LineContact(PAIR, RADIUS, length, FRICTION, depth)


def half_width(load):
    return np.sqrt(4 * load * RADIUS / (np.pi * MODULUS * LENGTH))


def approach(load, depth):
    """Approach of a cylinder under a load, after Johnson (1985)."""
    if load <= 0:
        return 0.0
    per_length = load / LENGTH
    return 2 / (np.pi * MODULUS) * per_length * (np.log(2 * depth / half_width(load)) + 0.5)


def masing_energy(load, amplitude, depth):
    """Energy of a cycle of ±Q at a constant load: the area of two branches, each the virgin curve doubled."""

    def displacement(tangential):
        return FRICTION * (approach(load, depth) - approach(load - tangential / FRICTION, depth))

    rise = quad(displacement, 0, amplitude, epsabs=0, epsrel=1e-12)[0]
    return 4 * amplitude * displacement(amplitude) - 8 * rise


RECORD = f"""
materials = {{ contact_modulus = {MODULUS}, shear_modulus = 2.9e10 }}
surface = {{ kind = "cylinder", radius = {RADIUS}, length = {LENGTH}, reference_depth = 0.01 }}
friction = {{ coefficient = 0.3 }}
instrument = {{ lateral_stiffness = 1e8 }}
fit = {{ parameters = ["friction", "lateral_stiffness"] }}

[loading]
file = "m.csv"

[loading.columns]
time = {{ column = "t", unit = "s" }}
normal_load = {{ column = "N", unit = "N" }}
tangential_displacement = {{ column = "u", unit = "m" }}

[loading.response]
tangential_load = {{ column = "T", unit = "N" }}
"""


@mark.parametrize("ratio", [0.0, 0.1, 0.3, 0.6, 0.9, 0.999, 1.0])
def test_the_half_widths_are_those_of_cattaneo(ratio):
    contact, load = cylinder(), 500.0
    state = contact.advance(contact.initial_state(), normal_load=load)
    state = contact.advance(state, tangential_load=ratio * FRICTION * load)
    whole, stick = contact.contact_half_width(state), contact.stick_half_width(state)
    assert whole == approx(half_width(load), rel=1e-14)
    assert stick / whole == approx(np.sqrt(1 - ratio), rel=1e-12, abs=1e-7)
    history = hs.replay(
        contact, [hs.NormalLoad(0, load), hs.TangentialLoad(1, ratio * FRICTION * load)]
    )
    assert history.contact_half_width[-1, 0] == approx(whole, rel=1e-14)
    assert history.stick_half_width[-1, 0] == approx(stick, rel=1e-9, abs=1e-12)
    assert history.real_contact_area[-1] == approx(2 * LENGTH * whole, rel=1e-14)


# the table is coarse beside an annulus that is thin
@mark.parametrize("ratio, error", [(0.1, 2e-5), (0.2, 1e-6), (0.6, 1e-7), (0.95, 1e-7)])
@mark.parametrize("depth", [0.001, 0.01, 1.0])
def test_the_energy_of_a_cycle_does_not_depend_on_the_reference_depth(ratio, error, depth):
    load, contact = 500.0, cylinder(depth)
    amplitude = ratio * FRICTION * load
    turns = [hs.TangentialLoad(time, sign * amplitude) for time, sign in ((1, 1), (2, -1), (3, 1))]
    history = hs.replay(contact, [hs.NormalLoad(0, load), *turns])
    energy = history.total_dissipated_energy.values
    expected = masing_energy(load, amplitude, depth)
    assert expected == approx(masing_energy(load, amplitude, 0.05), rel=1e-9)
    assert energy[3] - energy[1] == approx(expected, rel=error)
    displacement = FRICTION * (approach(load, depth) - approach(load * (1 - ratio), depth))
    assert history.tangential_displacement[1] == approx(displacement, rel=1e-7)


def test_the_energy_of_the_example():
    assert masing_energy(500.0, 150.0, 0.01) / LENGTH == approx(1.70243928e-3, rel=1e-8)


class HalfPlane(HalfSpace):
    """Boundary elements of contact with friction on a half-plane: constant tractions on equal cells."""

    def __init__(self, reach, count, depth):
        edges = np.linspace(-reach, reach, count + 1)
        self.x, self.cell, self.shape = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0], count
        distance = self.x[:, None] - edges
        # the displacement under a strip is the integral of 2/(π E*) ln(L/|x|)
        potential = distance * (1 + np.log(depth / np.abs(distance)))
        self.matrix = -2 / (np.pi * MODULUS) * np.diff(potential, axis=1)
        self.kernel = np.linalg.eigvalsh(0.5 * (self.matrix + self.matrix.T))
        self.z = -(self.x**2) / (2 * RADIUS)

    def moved(self, load):
        return self.matrix @ load


MOVES = [
    (1.0, 0.0),
    (1.0, 0.25),
    (0.7, 0.1),
    (0.9, -0.2),
    (0.95, -0.2),
    (0.6, -0.05),
    (0.8, 0.5),
    (0.75, 0.2),
]


def test_tractions_at_varying_loads_beside_a_half_plane_of_elements():
    depth, deepest = 0.01, approach(500.0, 0.01)
    contact, plane = cylinder(depth), HalfPlane(1.02 * half_width(500.0), 100, depth)
    state = contact.initial_state()
    moves = [(d * deepest, u * FRICTION * deepest) for d, u in MOVES]
    for (d, u), (p, q) in zip(
        moves, plane.history(moves, FRICTION, parts=16, accuracy=1e-7), strict=True
    ):
        state = contact.advance(state, normal_displacement=d, tangential_displacement=u)
        largest = p.max()
        # first order in the cells, at the edges of contact and stick zone
        assert contact.pressure(plane.x, state) == approx(p, abs=0.03 * largest)
        error = np.abs(contact.traction(plane.x, state) - q) / (FRICTION * largest)
        assert error.max() < 0.06
        assert error.mean() < 3e-3
        sums = plane.cell * LENGTH * np.array([p.sum(), q.sum()])
        assert np.array([state.normal_load, state.tangential_load]) == approx(
            sums, abs=5e-5 * sums[0]
        )


def test_a_log_a_file_and_a_pickle_hold_it(tmp_path):
    contact = cylinder()
    events = [
        hs.NormalLoad(0, 500),
        hs.TangentialLoad(1, 150),
        hs.NormalLoad(2, 400),
        hs.TangentialLoad(3, -100),
    ]
    path = tmp_path / "line.history"
    with hs.EventLog.create(path, contact) as log:
        log.append(events)
        assert log.verify().whole
        again = log.replay()
    direct = hs.replay(contact, events, hold=False)
    for name in ("stick_half_width", "total_dissipated_energy", "tangential_displacement"):
        assert again[name].values.tobytes() == direct[name].values.tobytes()
    copy = pickle.loads(pickle.dumps(contact))
    state = contact.advance(contact.initial_state(), normal_load=500.0)
    assert copy.advance(
        copy.state_from_bytes(state.to_bytes()), tangential_load=100.0
    ) == contact.advance(state, tangential_load=100.0)


def test_springs_of_an_instrument_add_their_deflection():
    contact = cylinder()
    spring = hs.Instrument(lateral_stiffness=1e9, parallel_stiffness=1e7)
    loads = [hs.NormalLoad(0, 500), hs.TangentialLoad(1, 120)]
    history = hs.replay(contact, loads, instrument=spring)
    held, moved = (
        history.total_tangential_load[-1].item(),
        history.tangential_displacement[-1].item(),
    )
    assert moved == approx(
        FRICTION * (approach(500, 0.01) - approach(500 - held / FRICTION, 0.01)), rel=1e-7
    )
    assert held + 1e7 * (moved + held / 1e9) == approx(120, rel=1e-9)


def test_a_noisy_record_is_fitted(tmp_path):
    """Truth: Cattaneo's contact in strokes beyond sliding, behind a spring, at a load that varies."""
    truth, spring = hs.LineContact(PAIR, RADIUS, LENGTH, 0.42, 0.01), hs.Instrument(2e8)
    time = np.linspace(0, 4, 801)
    loads, moved = 500 + 60 * np.sin(2 * time), 5e-6 * np.sin(2 * np.pi * time)
    pressed = truth.advance(truth.initial_state(), normal_load=500.0, tangential_displacement=0.0)
    held = []
    for load, place in zip(loads.tolist(), moved.tolist(), strict=True):
        pressed = truth.advance(
            pressed, normal_load=load, tangential_displacement=place, instrument=spring
        )
        held.append(pressed.tangential_load)
    noisy = held + np.random.default_rng(0).normal(0, 0.5, time.size)
    columns = np.column_stack([time, loads, moved, noisy])
    np.savetxt(tmp_path / "m.csv", columns, delimiter=",", header="t,N,u,T", comments="")
    path = tmp_path / "s.toml"
    path.write_text(RECORD, encoding="utf-8")
    found = hs.fit(path)
    for parameter, value in zip(found.parameters, (0.42, 2e8), strict=True):
        assert parameter.low < value < parameter.high
        assert parameter.high - parameter.low < 0.02 * value
    assert found.comparison.residuals.rms == approx(0.5, rel=0.1)


SCENARIO = """
[materials]
contact_modulus = "100 GPa"
shear_modulus = "29 GPa"

[surface]
kind = "cylinder"
radius = "10 mm"
length = "5 mm"
reference_depth = "1 cm"
{surface}

[friction]
coefficient = 0.5

[loading]
waypoints = [{{ time = 0, normal_load = 500 }}, {{ time = 1, tangential_load = 150 }}]

{more}
"""


@mark.parametrize(
    "surface, more, reason",
    [
        ('yielding = "kogut-etsion"', "", "surface.yielding: .*without summits"),
        ('interaction = "full"', "", "surface.interaction: .*without a height map"),
        (
            "",
            '[wear]\nlaw = "archard"\ncoefficient = 1e-4\nhardness = "6 GPa"',
            "wear: a line contact",
        ),
    ],
)
def test_a_scenario_refuses_what_a_cylinder_has_not(tmp_path, surface, more, reason):
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(surface=surface, more=more), encoding="utf-8")
    with raises(hs.InputError, match=reason):
        hs.run(path)


def test_messages():
    check_messages(globals())
