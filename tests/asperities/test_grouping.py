"""Asperities stand by group and gap: groups by their smallest gap, equals in the order in which they come."""

import numpy as np
import pytest

from historysim.asperities.grouping import groups, ordered


@pytest.mark.parametrize("number", [1, 3, 40])
@pytest.mark.parametrize("indexed", [False, True])
def test_asperities_stand_in_the_order_of_all_keys(number, indexed):
    rng = np.random.default_rng(number)
    gap = rng.integers(0, 12, 40).astype(float)  # with equals
    group = rng.permutation(np.arange(40) % number)
    index = rng.permutation(40) if indexed else None
    contact, order = ordered(group, 0.1 * group, gap, gap + 1.0, index)
    smallest = np.array([gap[group == one].min() for one in range(number)])
    expected = sorted(range(40), key=lambda i: (smallest[group[i]], group[i], gap[i], i))
    assert order.tolist() == expected
    assert contact.gap.tolist() == gap[expected].tolist()
    assert contact.friction.tolist() == [0.1 * group[expected[first]] for first in contact.first[:-1]]
    everyone = sorted(range(40), key=lambda i: (gap[i], index[i] if indexed else i))
    assert contact.sorted_weight.tolist() == (gap[everyone] + 1.0).tolist()


def test_those_that_are_alike_in_every_key_are_one_group():
    assert groups(np.full(4, 0.3)).tolist() == [0, 0, 0, 0]
    assert groups(np.full(4, 0.3), np.array([2.0, 1.0, 2.0, 1.0])).tolist() == [1, 0, 1, 0]
    assert groups(np.array([0.2, 0.2, 0.1, 0.1]), np.array([5, 4, 4, 4])).tolist() == [2, 1, 0, 0]
