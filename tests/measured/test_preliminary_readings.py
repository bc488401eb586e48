"""Readings of the preliminary displacement, against closed forms of one sphere and at the noise of instruments."""

import attrs
import numpy as np
from numpy.testing import assert_allclose
from pairs import GLASS as PAIR
from pytest import approx, fixture

import historysim as hs
from historysim.contact import mindlin
from historysim.measured.branches import reversal_factor, zero_load_factor
from historysim.measured.loops import loops_of_channels, loops_of_measurement
from historysim.measured.reduction import Measurement

DISPLACEMENT_NOISE, LOAD_NOISE = 1e-9, 6e-6  # of the instruments
LOOPS, AMPLITUDE, STEP = 40, 50e-9, 2.5e-9
LOADS = {50e-3: 0.12, 90e-3: 0.2}


def theory(normal_load, friction):
    sphere = hs.Ensemble(PAIR, 0.0, 2.5e-3, friction)
    return PAIR.displacement_ratio * friction * float(sphere.approach_at(normal_load))


@fixture(scope="module", params=list(LOADS))
def swung(request):
    """Triangular loops of one sphere whose reversals lie between the samples; the normal load and its θμδ."""
    friction = LOADS[request.param]
    way = np.arange(STEP * 0.37, 4 * AMPLITUDE * LOOPS, STEP)
    turns = np.arange(AMPLITUDE, way[-1], 2 * AMPLITUDE)
    every = np.sort(np.concatenate([way, turns]))
    moved = np.interp(every, [0, *turns], [0, *(AMPLITUDE * (-1.0) ** np.arange(turns.size))])
    moved[every > turns[-1]] = (
        AMPLITUDE * (-1) ** (turns.size - 1) * (1 - (every[every > turns[-1]] - turns[-1]) / 50e-9)
    )
    events = [hs.NormalLoad(0.0, request.param)]
    events += [
        hs.TangentialDisplacement(float(at), float(u)) for at, u in zip(every, moved, strict=True)
    ]
    history = hs.replay(hs.Ensemble(PAIR, 0.0, 2.5e-3, friction), events, record="totals")
    sampled = history.isel(step=np.isin(history.time.values, way))
    return sampled, request.param, theory(request.param, friction)


def noisy(sampled, normal_load, seed=None, lateral_stiffness=np.inf):
    u, load = sampled.tangential_displacement.values, sampled.total_tangential_load.values
    if seed is not None:
        random = np.random.default_rng(seed)
        u = u + DISPLACEMENT_NOISE * random.normal(size=u.size)
        load = load + LOAD_NOISE * random.normal(size=u.size)
    u = u + load / lateral_stiffness
    return loops_of_channels(
        sampled.time, u, load, normal_load, dead_band=10e-9, lateral_stiffness=lateral_stiffness
    )


def test_the_bias_at_the_noise_of_the_instruments(swung):
    sampled, normal_load, truth = swung
    for seed, share in ((None, 0.003), (1, 0.02)):
        found = noisy(sampled, normal_load, seed)
        assert len(found) == LOOPS - 1
        virgin = found.statistics("virgin_displacement")
        assert virgin.count == LOOPS - 1
        assert virgin.mean == approx(truth, rel=share)
        for name, factor in (
            ("preliminary_displacement", reversal_factor(0.95)),
            ("displacement_from_zero_load", zero_load_factor(0.95)),
        ):
            assert found.statistics(name).mean == approx(factor * truth, abs=1e-9)


def test_the_virgin_displacement_excludes_the_instrument(swung):
    sampled, normal_load, truth = swung
    found = noisy(sampled, normal_load, lateral_stiffness=334e3)
    assert found.statistics("virgin_displacement").mean == approx(truth, rel=0.003)
    assert found.statistics("preliminary_displacement").mean > 1.1 * reversal_factor(0.95) * truth
    lines = dict(found.summary())
    assert lines["preliminary displacement"].endswith(
        ", plus the load over the stiffness of the instrument, 334 kN/m"
    )


def test_factors_agree_with_theory():
    """To slip: 2 from the reversal, 2^(1/3) from zero load (the source's Eq. 4.5)."""
    assert reversal_factor(1 - 1e-15) == approx(2, abs=1e-9)
    assert zero_load_factor(1 - 1e-15) == approx(2 ** (1 / 3), abs=1e-9)
    contact = {"normal_load": 1.0, "contact_radius": 1.0, "shear_modulus": 1.0, "friction": 1.0}
    slide = float(mindlin.preliminary_displacement(**contact))
    for reached in (0.5, 0.8, 0.95):
        # from sliding backward to forward
        load = -1 + 2 * reached
        u = float(mindlin.displacement_after_reversal(-load, reversal_load=1.0, **contact))
        assert (slide - u) / slide == approx(reversal_factor(reached), rel=1e-12)


def test_undetermined_displacements_are_nan():
    u = np.concatenate([np.linspace(-1, 1, 5), np.linspace(1, -1, 5)[1:]])
    # all of the way in one sample
    steep = loops_of_channels(np.arange(9.0), u, [-1, 1, 1, 1, 1, -1, -1, -1, -1], dead_band=0.1)
    assert np.isnan(steep.virgin_displacement).all()
    # a load that never changes its sign has no zero
    above = attrs.evolve(
        Measurement(np.arange(9.0), {"tangential_displacement": u}),
        response={"tangential_load": np.array([2.0, 2.5, 2.8, 3, 3, 2.5, 2.2, 2, 2])},
    )
    found = loops_of_measurement(above)
    assert np.isnan(found.displacement_from_zero_load[0, 0])
    assert_allclose(found.preliminary_displacement[0, 0], 0.5 * 2.5, rtol=0.2)
