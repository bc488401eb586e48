"""All groups on one path: each moves as it does alone."""

import numpy as np
import pytest

import historysim as hs
from historysim.basics.library import ffi, lib
from historysim.memory.binding import check, copied, drive, owned, stack, view

PAIR = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1e10)
DRIVE = drive(1e-6, 0.0, False)


def move(memory, *goals):
    check(lib.hs_step(memory, lib.HS_DISPLACED, goals[0], lib.HS_DISPLACED, goals[1], DRIVE, ffi.NULL))


@pytest.mark.parametrize("seed", range(6))
def test_groups_of_one_asperity_have_the_bits_of_each_alone(seed):
    """Groups of one asperity are moved by a shorter update than a group that is alone, which has the general one."""
    random = np.random.default_rng(seed)
    height, radius = random.uniform(-50e-9, 0.0, 20), random.uniform(1e-6, 2e-6, 20)
    friction = random.choice([0.0, 0.2, 0.3, 0.45], 20) + 1e-3 * np.arange(20)
    memory = copied(hs.Ensemble(PAIR, height, radius, friction).initial_state().memory)
    assert memory.contact.groups == 20
    alone = [owned(lib.hs_memory_of_one(memory, i)) for i in view(memory.contact.order, 20)]
    approach, met = 40e-9, [0.0]
    ratio = memory.contact.units.displacement / memory.contact.units.length
    for _ in range(300):
        # held, grown, withdrawn, lifted off; loops within loops, the same places again, slides of all, the limit
        before, approach = approach, random.choice([approach] * 4 + [random.uniform(-5e-9, 60e-9), approach + 1e-10])
        ways = [random.uniform(-9e-9, 9e-9), random.uniform(-3e-8, 3e-8), met[-1] + 1e-16]
        ways += [met[-1] + sign * random.choice(friction) * (approach - before) * ratio for sign in (-1.0, 1.0)]
        met.append(random.choice([*met[-4:], *ways]))
        move(memory, approach, met[-1])
        for group, one in enumerate(alone):
            move(one, approach, met[-1])
            assert stack(one).tobytes() == stack(memory, group).tobytes()
    lost = np.array([one.each[0] for one in alone])
    assert np.count_nonzero(lost) >= 19
    # energies are worked out several at a time, by a reciprocal in place of a quotient
    np.testing.assert_allclose(view(memory.each, 20), lost, rtol=1e-13)
