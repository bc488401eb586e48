"""Maps that are run in: what a pass cuts off, and what it leaves alone."""

import numpy as np
from pytest import approx, mark, raises

import historysim as hs
from historysim.asperities.running_in import Pass, run_in
from historysim.asperities.wear import ArchardWear
from historysim.asperities.yielding import KogutEtsion
from historysim.errors import InputError

PAIR = hs.MaterialPair.from_moduli(contact_modulus=43e9, shear_modulus=9.2e9, hardness=5.5e9)
LAW = KogutEtsion(hardness=5.5e9, poissons_ratio=0.25)
RADIUS = 20e-6


def cap(points=41, pixel=0.4e-6):
    """A paraboloid in the middle of a map, finely resolved."""
    x = (np.arange(points) - points // 2) * pixel
    return hs.Surface(-(x[:, None] ** 2 + x[None, :] ** 2) / (2 * RADIUS), pixel)


def test_a_resolved_cap_is_cut_to_the_paraboloid_that_is_left():
    surface = cap()
    after, (record,) = run_in(surface, PAIR, [Pass(0.3)], friction=0.2, yielding=LAW)
    ensemble = hs.Ensemble(PAIR, 0.0, RADIUS, 0.2, yielding=LAW)
    left = ensemble.advance(ensemble.initial_state(), normal_load=0.3).yielded
    lowered = surface.heights - after.heights
    assert lowered[20, 20] == approx(left.yielded_depth[0], rel=1e-6)
    assert after.summits().radius[0] == approx(left.summit_radius[0], rel=1e-6)
    # old paraboloid less new one, over the circle where they cross
    slope = 1 / RADIUS - 1 / left.summit_radius[0]
    volume = np.pi * left.yielded_depth[0] ** 2 / slope
    assert record.removed_volume == approx(volume, rel=0.05)
    assert record.contact_count == 1
    # loaded as much again, the cap yields no more
    again, (second,) = run_in(
        after,
        PAIR,
        [Pass(0.3)],
        friction=0.2,
        yielding=None,
        wear=ArchardWear(coefficient=0.0, hardness=1e9),
    )
    assert second.removed_volume == 0.0
    assert second.preliminary_displacement == approx(record.preliminary_displacement, rel=1e-6)
    np.testing.assert_array_equal(again.heights, after.heights)


def test_volume_is_lost_or_conserved():
    surface = hs.random_surface((64, 64), 1e-6, 300e-9, 10e-6, seed=1)
    steps = [Pass(20e-3)] * 3
    lost, conserved = (
        run_in(surface, PAIR, steps, friction=0.2, yielding=LAW, volume=volume)[0]
        for volume in ("lost", "conserved")
    )
    pixel = 1e-12
    start = surface.heights.sum()
    removed = sum(
        one.removed_volume for one in run_in(surface, PAIR, steps, friction=0.2, yielding=LAW)[1]
    )
    assert (start - lost.heights.sum()) * pixel == approx(removed, rel=1e-6)
    assert conserved.heights.sum() * pixel == approx(start * pixel, abs=1e-6 * removed)


def test_wear_takes_what_archard_says_and_evens_out_the_summits():
    surface = hs.random_surface((64, 64), 1e-6, 300e-9, 10e-6, seed=2)
    law = ArchardWear(coefficient=1e-4, hardness=5.5e9)
    after, records = run_in(surface, PAIR, [Pass(20e-3, 1e-3)] * 3, friction=0.2, wear=law)
    assert (after.heights <= surface.heights).all()
    displacement = [one.preliminary_displacement for one in records]
    assert displacement[-1] < displacement[0]
    assert all(one.removed_volume > 0 for one in records)
    rested, (none,) = run_in(surface, PAIR, [Pass(20e-3)], friction=0.2, wear=law)
    assert none.removed_volume == 0.0
    np.testing.assert_array_equal(rested.heights, surface.heights)


@mark.parametrize(
    "make, message",
    [
        (lambda: Pass(0.0), "normal_load"),
        (lambda: Pass(1.0, -1.0), "sliding_distance"),
        (
            lambda: run_in(cap(), PAIR, [Pass(1e-3)], friction=0.2),
            "passes change nothing without yielding or wear",
        ),
        (
            lambda: run_in(cap(), PAIR, [Pass(1e-3)], friction=0.2, yielding=LAW, volume="gone"),
            "volume is 'gone'",
        ),
        (
            lambda: run_in(
                hs.Surface(np.zeros((5, 5)), 1e-6), PAIR, [Pass(1e-3)], friction=0.2, yielding=LAW
            ),
            "no summit left",
        ),
    ],
)
def test_nonsense_is_refused(make, message):
    with raises(InputError) as caught:
        make()
    assert message in str(caught.value)
