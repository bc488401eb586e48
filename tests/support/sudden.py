"""Paths on which all happens late: touching, yielding, sliding, wear and lift-off in the last hundredth, say."""

import numpy as np

import historysim as hs
from historysim.asperities.laws import PowerLaw, ShearStrength, SlidFriction
from historysim.asperities.wear import ArchardWear
from historysim.asperities.yielding import JacksonGreen, KogutEtsion, Thornton
from historysim.basics.library import lib
from historysim.memory.paths import Goals, blank_rows, straight_paths

PAIR = hs.MaterialPair.from_moduli(contact_modulus=43e9, shear_modulus=9.227e9)


def _options(kind, rng, late, radius):
    """Return friction and what evolves; summits begin to yield within some of the approach that comes late."""
    strain = np.sqrt(late * 10 ** rng.uniform(-2, 1) / radius)
    hardness = 2 * PAIR.contact_modulus / np.pi / 0.55 * strain
    mu, options = rng.uniform(0.1, 0.8), {}
    laws = [
        ShearStrength(10 ** rng.uniform(8, 9)),
        PowerLaw(mu, 1e-4, rng.uniform(-0.4, 0.4), load=str(rng.choice(["own", "total"]))),
        SlidFriction([0.0, 10 ** rng.uniform(-9, -6)], [mu, mu * rng.uniform(0.4, 1.3)]),
    ]
    if "yields" in kind:
        options["yielding"] = rng.choice([KogutEtsion, Thornton, JacksonGreen])(
            hardness=hardness, poissons_ratio=0.25
        )
    if "wears" in kind:
        shape = str(rng.choice(["truncated", "blunted"]))
        options["wear"] = ArchardWear(
            coefficient=10 ** rng.uniform(-5, -2), hardness=5e9, shape=shape
        )
    return {"friction": laws[rng.integers(4)] if "law" in kind else mu} | options


def sudden(kind, seed):
    """Return an ensemble, a state, and the goals of both channels of a path along which most happens late."""
    rng = np.random.default_rng([seed, len(kind)])
    count, late = int(rng.choice([1, 2, 3, 5, 12, 30])), rng.choice([1.0, 0.1, 0.01, 0.003])
    reach, radius = 10 ** rng.uniform(-8.5, -6.5), rng.uniform(0.3e-6, 2e-6, count)
    lag = reach * (1 - late * rng.uniform(0, 1, count) * (rng.random() < 0.7))
    lag = np.minimum(lag, reach * (1 - late * rng.uniform(0, 1)))
    lag[0] = 0.0
    ensemble = hs.Ensemble(PAIR, -lag, radius, **_options(kind, rng, reach * late, radius.mean()))
    state, start, friction = ensemble.initial_state(), 0.0, 0.4
    if rng.random() < 0.4:
        start = reach * rng.uniform(0.05, 0.9)
        state = ensemble.advance(state, normal_displacement=start)
        state = ensemble.advance(
            state,
            tangential_displacement=PAIR.displacement_ratio * 0.3 * start * rng.uniform(-1, 1),
        )
        friction = float(state.friction.max())
    stop = start * rng.uniform(-0.3, 0.9) if start and rng.random() < 0.3 else reach
    unit = PAIR.displacement_ratio * friction
    moved = unit * rng.uniform(-1, 1) * (abs(stop - start) if rng.random() < 0.8 else 2 * reach)
    normal, here = Goals(lib.HS_DISPLACED, stop), state.tangential_displacement
    if rng.random() < 0.5:
        normal = Goals(lib.HS_LOAD, ensemble.advance(state, normal_displacement=stop).normal_load)
    tangential = Goals(lib.HS_DISPLACED, here + moved)
    if rng.random() < 0.3:
        far = here + np.copysign(50 * unit * reach, moved)
        most = ensemble.advance(
            state, normal_displacement=stop, tangential_displacement=far
        ).tangential_load
        tangential = Goals(lib.HS_LOAD, rng.uniform(-0.9, 0.9) * abs(most))
    return ensemble, state, normal, tangential


def change_by_parts(kind, seed, parts=100):
    """Return by how much the tangential load of 1 and of many parts differs, over μN."""
    ensemble, state, *goals = sudden(kind, seed)
    ends = [
        ensemble.advance_along(
            state, straight_paths(*goals, parts=n), rows=blank_rows(n, None), saturate=True
        )
        for n in (1, parts)
    ]
    loads = [
        [ensemble.asperity(i, end).normal_load for i in range(len(ensemble))]
        for end in (state, *ends)
    ]
    limit = max(
        float(np.dot(end.friction, load)) for end, load in zip((state, *ends), loads, strict=True)
    )
    return abs(ends[0].tangential_load - ends[1].tangential_load) / limit if limit else 0.0
