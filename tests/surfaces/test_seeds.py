import numpy as np
import pytest

from historysim.errors import InputError
from historysim.surfaces.seeds import generator


def test_a_seed_draws_the_same_numbers_again():
    # of PCG64 with this seed, as numpy documents it
    expected = np.random.Generator(np.random.PCG64(7)).random(4)
    for seed in (7, np.int32(7), np.uint8(7)):
        np.testing.assert_array_equal(generator(seed).random(4), expected)
    assert not np.array_equal(generator(8).random(4), expected)


@pytest.mark.parametrize("seed", [None, -1, 1.5, True, "7", [7]])
def test_what_is_no_seed(seed):
    with pytest.raises(InputError, match="expected a whole number of 0 or more, which draws the same numbers again"):
        generator(seed)
