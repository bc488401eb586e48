"""A contact in python-control: what it says is what stepping by hand says, also interconnected and a second time."""

import sys

import numpy as np
import pytest

import historysim as hs
from historysim.coupling import contact_system

PAIR = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=8e9)
ENSEMBLE = hs.Ensemble(PAIR, [0.0, -20e-9, -40e-9], [10e-6, 20e-6, 15e-6], 0.2)
PRESSED = ENSEMBLE.advance(ENSEMBLE.initial_state(), normal_load=5e-3)
DT = 1e-4


@pytest.fixture
def control():
    return pytest.importorskip("control")


def test_its_response_agrees_with_stepping_by_hand(control):
    system = contact_system(ENSEMBLE, PRESSED, dt=DT, outputs=["tangential_load", "dissipated_energy"])
    time = np.arange(200) * DT
    moves = 8e-9 * np.sin(300 * time)
    _, totals = ENSEMBLE.advance_many(PRESSED, tangential_displacement=moves)
    for _ in range(2):
        response = control.input_output_response(system, time, moves)
        np.testing.assert_array_equal(response.outputs[0], totals.tangential_load)
        np.testing.assert_array_equal(response.outputs[1], totals.dissipated_energy)


def test_in_a_loop_with_a_mass_it_agrees_with_the_loop_by_hand(control):
    """A mass, semi-implicit: its outputs do not depend directly on its input, so that the loop is well posed."""
    mass, damping = 1e-4, 0.5

    def update(_t, x, u, _params):
        speed = x[1] + DT / 100 / mass * (u[0] - u[1] - damping * x[1])
        return np.array([x[0] + DT / 100 * speed, speed])

    body = control.nlsys(
        update, lambda _t, x, _u, _p: x[:1], inputs=["force", "load"], outputs=["place"], states=2, dt=DT, name="body"
    )
    contact = contact_system(ENSEMBLE, PRESSED, dt=DT)
    loop = control.interconnect(
        [body, contact],
        connections=[["contact.tangential_displacement", "body.place"], ["body.load", "contact.tangential_load"]],
        inplist=["body.force"],
        outlist=["body.place", "contact.tangential_load"],
    )
    time = np.arange(300) * DT
    force = 5e-4 * np.sin(200 * time)
    response = control.input_output_response(loop, time, force)
    stepper, x, places, loads = ENSEMBLE.stepper(PRESSED), np.zeros(2), [], []
    for sample in force:
        stepper.step(tangential_displacement=x[0])
        places.append(x[0])
        loads.append(stepper.tangential_load)
        x = update(0.0, x, [sample, stepper.tangential_load], None)
    assert np.ptp(loads) > 0
    np.testing.assert_array_equal(response.outputs[0], places)
    np.testing.assert_array_equal(response.outputs[1], loads)


def test_nonsense_is_refused(control):
    assert control.__version__
    with pytest.raises(hs.InputError, match=r"inputs: \['force'\]; expected some of normal_load"):
        contact_system(ENSEMBLE, dt=DT, inputs=["force"])
    with pytest.raises(hs.InputError, match="outputs: none"):
        contact_system(ENSEMBLE, dt=DT, outputs=[])
    with pytest.raises(hs.InputError, match="both load and displacement of the normal channel"):
        contact_system(ENSEMBLE, dt=DT, inputs=["normal_load", "normal_displacement"])
    with pytest.raises(hs.InputError, match="dt is 0"):
        contact_system(ENSEMBLE, dt=0)
    with pytest.raises(hs.InputError, match=r"sample 0\.5 of the contact"):
        contact_system(ENSEMBLE, dt=DT).dynamics(0, [0.5], [0.0])


def test_without_python_control_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(hs.InputError, match="expected: pip install control"):
        contact_system(ENSEMBLE, dt=DT)
