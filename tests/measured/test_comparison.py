"""A model compared with a measurement: independent numbers, and the contents of the picture."""

import attrs
import numpy as np
import pytest
import synthetic
from numpy.testing import assert_allclose, assert_array_equal

import historysim as hs
from historysim.measured.comparison import Comparison
from historysim.measured.observation import observe
from historysim.measured.response import compute_response


@pytest.fixture(scope="module")
def compared():
    observed = observe(synthetic.measured("ball", 0), skip=0)
    response = compute_response(
        *synthetic.model("ball")({"friction": 0.19, "lateral_stiffness": 3e5}), observed
    )
    return Comparison(observed, response)


def area(moved, load):
    """Integrate around a loop, closed by a straight line: the shoelace formula."""
    return 0.5 * float(np.sum((load + np.roll(load, -1)) * (np.roll(moved, -1) - moved)))


def test_loops_and_their_energies_by_another_way(compared):
    observed = compared.observation
    assert (
        dict(compared.summary())["loops"] == str(len(compared.measured)) == str(len(compared.model))
    )
    assert_array_equal(compared.measured.ends, compared.model.ends)
    for loops, moved, load in (
        (compared.measured, observed.displacement, observed.tangential_load),
        (compared.model, compared.response.displacement, compared.response.tangential_load),
    ):
        energy = np.array(
            [area(moved[start : end + 1], load[start : end + 1]) for start, _, end in loops.ends]
        )
        # the load steps in the second loop, and the last one is cut off
        energy[[1, 3]] = np.nan
        # noise of 1 nm, of 200, makes the order in time another one than that of the displacements
        assert_allclose(loops.dissipated_energy, energy, rtol=1e-3)


def test_a_record_without_a_loop_is_compared_without_a_table(compared):
    part = slice(0, 80)
    kept = {
        name: getattr(compared.observation, name)[part]
        for name in ("time", "displacement", "tangential_load", "normal_load")
    }
    short = attrs.evolve(
        compared.observation, **kept, turns=np.array([0, 79]), nodes=np.array([0, 79]), loops=None
    )
    response = attrs.evolve(
        compared.response,
        **{
            name: value[part]
            for name, value in attrs.asdict(compared.response, recurse=False).items()
            if np.ndim(value)
        },
    )
    alone = Comparison(short, response)
    assert alone.measured is None
    assert alone.rows() == []
    assert dict(alone.summary())["loops"] == "none"
    axes = hs.plots.comparison(alone).axes
    assert "no whole loop" in [text.get_text() for one in axes for text in one.texts]


def test_spring_in_parallel_acts_on_the_displacement_of_each_sample(compared):
    # noise gives the samples another order in time than along the branch
    observed = compared.observation
    ensemble, instrument = synthetic.model("ball")({"friction": 0.19, "lateral_stiffness": 3e5})
    spring = compute_response(ensemble, attrs.evolve(instrument, parallel_stiffness=2e4), observed)
    alone = compute_response(ensemble, instrument, observed)
    assert_array_equal(spring.displacement, alone.displacement)
    assert_allclose(
        spring.tangential_load - alone.tangential_load,
        2e4 * spring.displacement,
        rtol=0,
        atol=1e-15,
    )
    parallel_load = spring.parallel_stiffness * spring.displacement
    assert_array_equal(spring.tangential_load, spring.contact_load + parallel_load)
    assert_allclose(spring.contact_load, alone.tangential_load, rtol=0, atol=1e-15)


# -- the picture -----------------------------------------------------------------------------------
