"""What a state answers, and that it can be compared, pickled and kept in a file."""

import functools
import pickle
import struct

import numpy as np
from golden import refused
from pairs import PLAIN as PAIR
from pairs import UNIT
from pytest import approx, mark, raises

import historysim as hs


def rough(count=20, friction=0.4):
    rng = np.random.default_rng(3)
    return hs.Ensemble(PAIR, rng.normal(0.0, 0.01, count), rng.lognormal(0.0, 0.4, count), friction)


ENSEMBLE = rough()


@functools.cache
def stuck():
    """Return a state that sticks everywhere; made when a test runs, since the first step in a process compiles."""
    return ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=0.3)


def spiral(ensemble, state, turns, largest=0.02):
    """Ever smaller reversals, each of which is remembered."""
    for turn in range(turns):
        state = ensemble.advance(
            state, tangential_displacement=(-1) ** turn * largest * (1 - turn / (turns + 20))
        )
    return state


def test_the_normal_stiffness_is_the_slope_of_the_load():
    step = 1e-5 * stuck().approach
    above, below = (
        ENSEMBLE.advance(stuck(), normal_displacement=stuck().approach + side * step)
        for side in (1, -1)
    )
    slope = (above.normal_load - below.normal_load) / (2 * step)
    assert stuck().normal_stiffness == approx(slope, rel=1e-8)
    assert ENSEMBLE.initial_state().normal_stiffness == 0.0


def test_stiffness_count_and_share_are_those_that_are_recorded():
    state = ENSEMBLE.advance(stuck(), tangential_displacement=0.01)
    radii = [
        (a.contact_radius, a.stick_radius)
        for a in (ENSEMBLE.asperity(i, state) for i in range(len(ENSEMBLE)))
    ]
    contact, stick = np.sum(radii, axis=0)
    assert state.contact_count == sum(radius > 0 for radius, _ in radii) > 3
    assert state.tangential_stiffness == approx(8 * PAIR.shear_modulus * stick, rel=1e-12)
    assert state.slip_share == approx(1 - stick / contact, rel=1e-10)
    assert 0 < state.slip_share < 1
    assert stuck().slip_share == approx(0, abs=1e-15)
    assert ENSEMBLE.initial_state().slip_share == 0
    assert ENSEMBLE.advance(stuck(), tangential_displacement=1.0).slip_share == 1


def test_equal_states_have_the_same_bits():
    again = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=0.3)
    assert again == stuck()
    assert hash(stuck()) == hash(again)
    assert ENSEMBLE.advance(stuck(), tangential_displacement=1e-9) != stuck()
    # the same loads at rest, but held by displacement
    assert ENSEMBLE.advance(stuck(), normal_displacement=stuck().approach) != stuck()
    assert rough(19).initial_state() != ENSEMBLE.initial_state()
    assert rough(friction=0.3).initial_state() != ENSEMBLE.initial_state()
    assert ENSEMBLE.initial_state() != "unloaded"


@mark.parametrize("turns", [3, 160])
def test_a_state_can_be_pickled_and_saved(tmp_path, turns):
    state = spiral(ENSEMBLE, stuck(), turns)
    assert len(state.vertices()) > turns
    assert pickle.loads(pickle.dumps(state)) == state
    path = tmp_path / "one.state"
    state.save(path)
    back = ENSEMBLE.load_state(path)
    assert back == state
    assert ENSEMBLE.advance(back, tangential_load=0.01) == ENSEMBLE.advance(
        state, tangential_load=0.01
    )


def test_damaged_bytes_are_refused():
    content = spiral(ENSEMBLE, stuck(), 3).to_bytes()
    rng = np.random.default_rng(0)
    for place in rng.integers(0, len(content), 200):
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        with refused("expected a state that was saved whole"):
            hs.State.from_bytes(bytes(damaged))


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "one.state"
    stuck().save(path)
    with refused(r"is of 20 asperities .*; expected one of this ensemble.s, of 21 asperities"):
        rough(21).load_state(path)
    for content in (b"", b"text", path.read_bytes()[:-200]):
        path.write_bytes(content)
        with refused(r"not a saved state|cut off|another version|another byte order"):
            ENSEMBLE.load_state(path)
    np.save(tmp_path / "array.npy", np.zeros(3))
    with refused(r"not a saved state|cut off|another version|another byte order"):
        ENSEMBLE.load_state(tmp_path / "array.npy")
    with raises(FileNotFoundError):
        ENSEMBLE.load_state(tmp_path / "none.npz")


def check_forgeries(state, fields):
    """Put numbers without meaning in the place of values of a state; the checksum is right, as a forger makes it."""
    from historysim.basics.library import ffi, lib

    content = state.to_bytes()
    for number in (1e300, float("inf"), float("nan"), -1e300):
        for field, value in fields.items():
            assert content.count(struct.pack("<d", value)) >= 1, field
            forged = content.replace(struct.pack("<d", value), struct.pack("<d", number), 1)[:-8]
            forged += struct.pack("<Q", lib.hs_digest(0, ffi.from_buffer(forged), len(forged)))
            with refused("expected a state that was saved whole"):
                type(state).from_bytes(forged)


def test_forged_numbers_have_the_limits_of_input():
    ensemble = hs.Ensemble(UNIT, 0.0, 1.0, 0.3125)
    state = ensemble.advance(ensemble.initial_state(), normal_load=0.01)
    line = ensemble.advance(state, tangential_displacement=1e-3)
    memory = line.memory.line
    fields = {
        "approach": memory.approach,
        "displacement": memory.displacement,
        "energy": memory.dissipated,
    }
    check_forgeries(line, {"coefficient": 0.3125, **fields})
    plane = ensemble.advance(state, tangential_displacement=(1e-3, 5e-4))
    fields = {
        "displacement": plane.memory.plane.displacement.y,
        "load": plane.memory.plane.tangential_load.x,
    }
    check_forgeries(plane, {"tolerance": 1e-3, **fields})
