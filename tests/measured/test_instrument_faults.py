"""What a record looks like: each fault is put into a simulated record, and found; a sound record has none."""

import attrs
import numpy as np
import synthetic
from pytest import approx, mark

import historysim as hs
from historysim.measured.loops import loops_of_measurement


def test_the_printed_interval_of_a_mean_holds_it():
    loops = hs.loops(synthetic.reciprocating(1, 16, 3_000, scatter=0.02))
    row = next(both for label, *_, both in loops.rows() if label == "friction coefficient")
    low, high = (float(text) for text in row.partition("95 %: ")[2].rstrip(")").split(" to "))
    assert low < 0.2 < high
    wander = loops.wander("friction_coefficient")
    assert high - low == approx(2 * wander.reach, abs=2e-4)
    assert not wander.drifts


CLEAN = synthetic.measured(
    "ball", 0, amplitude=100e-9, loads=(30e-3, 50e-3, 90e-3), rate=400.0, noise=0.1
)


def with_hum(sign):
    """Give the record with 3 nm of 50 Hz, 1.5 % of its stroke, in quadrature with 0.25 mN."""
    phase = 2 * np.pi * 50 * CLEAN.time + 0.3
    return attrs.evolve(
        CLEAN,
        channels={
            **CLEAN.channels,
            "tangential_displacement": CLEAN["tangential_displacement"] + 3e-9 * np.sin(phase),
        },
        response={"tangential_load": CLEAN["tangential_load"] + sign * 0.25e-3 * np.cos(phase)},
    )


@mark.parametrize("sign", [1, -1])
def test_hum_in_quadrature_does_not_bias(sign):
    clean, hum = loops_of_measurement(CLEAN), loops_of_measurement(with_hum(sign))
    assert len(hum) == len(clean)
    # at the ends of a branch the phases of one period are not all there: 3 nm of 50, with the mean
    # load of half a wave
    assert hum.friction_coefficient[clean.large] == approx(
        clean.friction_coefficient[clean.large],
        abs=0.25e-3 * 2 / np.pi * 3 / 50 / 30e-3,
        nan_ok=True,
    )
    # at most the whole height of the hum, over its width, at both ends
    room = 2 * 0.25e-3 * 2 * 3e-9
    np.testing.assert_allclose(hum.dissipated_energy, clean.dissipated_energy, rtol=0, atol=room)
    # in the order of time each period encloses π 3 nm 0.25 mN, and there are 800 of them in a loop
    # of 16 s
    assert np.pi * 3e-9 * 0.25e-3 * 800 > 500 * room
    exponents = [each.by_load().power_law("friction_coefficient").exponent for each in (hum, clean)]
    assert exponents[0] == approx(exponents[1], abs=2e-3)
