"""Contacts that are reduced to springs, and their histories."""

import numpy as np

import historysim as hs
from historysim.exchange.reduced.reducing import VirginCurve, _chords, _find_tops

PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=2e10)
LOAD = 0.05


def ball():
    return hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)


def rough(friction=0.2, count=60):
    rng = np.random.default_rng(3)
    return hs.Ensemble(
        PAIR, rng.normal(0.0, 30e-9, count), rng.uniform(20e-6, 60e-6, count), friction
    )


def curved():
    approach = np.linspace(0, 200e-9, 31)[1:]
    return hs.Patches.from_normal_curves(
        PAIR, approach, 1.2e9 * approach**1.5 + 1e15 * approach**2.5, None, 0.3
    )


CONTACTS = {
    "ball": ball,
    "rough": rough,
    "many coefficients": lambda: rough(np.linspace(0.1, 0.4, 60)),
    "normal curve": curved,
}


def job(ensemble, *, load=LOAD, varies=False, start=0.0):
    reach = VirginCurve(ensemble, load).end
    turns = [0.0, 0.9, -0.7, 0.4, -0.2, 0.8, -0.9]
    events = [hs.NormalLoad(0.0, load), hs.TangentialDisplacement(0.0, start)]
    events += [hs.TangentialDisplacement(float(t), turn * reach) for t, turn in enumerate(turns, 1)]
    if varies:
        events += [
            hs.NormalLoad(float(t) + 0.5, load * part)
            for t, part in enumerate((1.0, 0.6, 0.8, 0.5, 1.0), 1)
        ]
    return hs.Replay(ensemble, sorted(events, key=lambda event: event.time), substeps=5, hold=False)


def worst_history(curve, node):
    """Return displacements of reversals, from rest, after which the error is as large as the bound [m].

    The error of the virgin curve rises and falls once between two nodes. The spiral turns so that
    dE_r/dr is 1 where it rises and -1 where it falls.
    """
    ends, _, chord = _chords(curve, node)
    turns = np.sort(np.concatenate([node, _find_tops(curve, ends, chord)]))[::-1]
    # E_r falls with r below the outermost turn: the spring that is nearest to sliding has slid back
    place, side, reached = -turns[0], 1.0, [-turns[0]]
    for turn in turns[1:]:
        place += side * 2.0 * turn
        reached.append(place)
        side = -side
    return np.array(reached)
