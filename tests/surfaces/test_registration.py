"""Maps of one place before and after wear: sums of waves, which are known exactly at any shift and rotation."""

import math

import numpy as np
from golden import check_messages
from pytest import approx, importorskip, mark

import historysim as hs
from historysim.surfaces.registration import KEPT, LOST

importorskip("skimage", reason="needs scikit-image: pip install historysim[surfaces]")

PIXEL = 1e-6
HEIGHT = 1e-6
TILT = (1e-3, -2e-3)


def waves(seed, count=400):
    """A rough surface of wavelengths from 4 to 120 pixels and rms height 1, as a function of the place."""
    rng = np.random.default_rng(seed)
    number = 2 * np.pi / np.exp(rng.uniform(np.log(4.0), np.log(120.0), count))
    angle, phase = rng.uniform(0, 2 * np.pi, (2, count))
    amplitude = number**-0.8 / math.sqrt((number**-1.6).sum() / 2)

    def height(x, y):
        found = np.zeros_like(x)
        for a, k, direction, start in zip(amplitude, number, angle, phase, strict=True):
            found += a * np.cos(k * (math.cos(direction) * x + math.sin(direction) * y) + start)
        return found

    return height


def grid(points):
    along = np.arange(points) - (points - 1) / 2
    return np.meshgrid(along, along, indexing="ij")


def pair(seed, shift, rotation, *, noise=0.02, level=1.0, points=(128, 128)):
    """Two maps of one place, the second cut off at a level, and the volume lost where they overlap [m³]."""
    rng, height, turn = np.random.default_rng(seed), waves(seed), math.radians(rotation)
    (x, y), (u, v) = grid(points[0]), grid(points[1])
    on_x = math.cos(turn) * u - math.sin(turn) * v + shift[0]
    on_y = math.sin(turn) * u + math.cos(turn) * v + shift[1]
    before, after = height(x, y), np.minimum(height(on_x, on_y), level)
    back_u = math.cos(turn) * (x - shift[0]) + math.sin(turn) * (y - shift[1])
    back_v = math.cos(turn) * (y - shift[1]) - math.sin(turn) * (x - shift[0])
    inside = np.maximum(np.abs(back_u), np.abs(back_v)) <= (points[1] - 1) / 2
    lost = np.maximum(before - level, 0.0)[inside].sum() * HEIGHT * PIXEL**2
    tilted = 3e-7 + (TILT[0] * u + TILT[1] * v) * PIXEL
    maps = (
        HEIGHT * (before + noise * rng.standard_normal(before.shape)),
        HEIGHT * (after + noise * rng.standard_normal(after.shape)) + tilted,
    )
    return *(hs.Surface(heights, PIXEL) for heights in maps), lost


@mark.parametrize(
    "seed, shift, rotation, options",
    [
        (1, (3.3, -5.7), 0.6, {}),
        (3, (20.5, 14.25), 0.3, {"level": 0.5}),
    ],
)
def test_shift_rotation_and_worn_volume_are_found(seed, shift, rotation, options):
    before, after, lost = pair(seed, shift, rotation, **options)
    found = hs.register_maps(before, after)
    assert np.array(found.shift) / PIXEL == approx(shift, abs=0.1)
    assert abs(np.array(found.shift) / PIXEL - shift).max() < 6 * found.shift_error / PIXEL
    assert math.degrees(found.rotation) == approx(rotation, abs=0.02)
    assert found.worn_volume == approx(lost, rel=0.02)
    assert abs(found.worn_volume - lost) < 3 * found.worn_volume_error < 0.03 * lost
    assert (found.fate != KEPT).sum() > 0.5 * (
        before.summits().height > options.get("level", 1.0) * HEIGHT
    ).sum() * 0.5


def test_a_worn_volume_gives_its_law():
    law = hs.wear.ArchardWear.from_volume(
        "3 µm3", normal_load="200 mN", sliding_distance="10 mm", hardness=6e9
    )
    assert law.coefficient == approx(3e-18 * 6e9 / (0.2 * 0.01))
    energy = hs.wear.EnergyWear.from_volume("3 µm3", dissipated_energy=4e-4)
    assert energy.volume_per_energy == approx(3e-18 / 4e-4)


def test_without_wear_nothing_is_significant():
    before, after, _ = pair(6, (2.4, 1.1), 0.2, level=99.0)
    found = hs.register_maps(before, after)
    assert (
        abs(found.worn_volume) < 3 * found.worn_volume_error < 1e-4 * HEIGHT * before.nominal_area
    )
    assert (found.fate == LOST).sum() <= 1
    assert found.worn.mean() < 0.01


def test_maps_without_noise_differ_where_they_are_worn_alone():
    # most differences are 0, and so is their scale
    one = pair(8, (0.0, 0.0), 0.0, noise=0.0, level=10.0)[0]
    found = hs.register_maps(one, hs.Surface(np.minimum(one.heights, HEIGHT), PIXEL))
    lost = np.maximum(one.heights - HEIGHT, 0.0).sum() * PIXEL**2
    assert found.worn_volume == approx(lost, rel=1e-3)


def test_missing_points_and_another_pixel_size_are_allowed():
    before, after, lost = pair(7, (3.0, -2.0), 0.0)
    hole = np.zeros(before.shape, dtype=bool)
    hole[40:50, 60:70] = True
    found = hs.register_maps(before.without(hole), after.at_resolution(0.8 * PIXEL))
    assert np.array(found.shift) / PIXEL == approx((3.0, -2.0), abs=0.1)
    assert 0.9 * lost < found.worn_volume < 1.02 * lost


def test_messages():
    check_messages(globals())
