"""Write the height maps of this folder, the same bytes every time: ``python data/make_heights.py``."""

import math
import random
from collections.abc import Callable
from operator import mul
from pathlib import Path

FOLDER = Path(__file__).parent
RESOLUTION = 0.1  # nm

Wave = tuple[float, float, float, float]  # wave vector (1/µm), amplitude (nm) and phase


def waves(
    source: random.Random, count: int, longest: float, shortest: float, rms_height: float
) -> list[Wave]:
    """Give wave vectors (1/µm), amplitudes (nm) and phases of an isotropic roughness with a Hurst exponent of 0.8."""
    found = []
    for _ in range(count):
        number = 2 * math.pi / longest * (longest / shortest) ** source.random()
        direction = math.pi * source.random()
        found.append(
            (
                number * math.cos(direction),
                number * math.sin(direction),
                number**-0.8,
                2 * math.pi * source.random(),
            )
        )
    # of independent waves the squares of the amplitudes add up
    scale = rms_height / math.sqrt(sum(amplitude**2 for _, _, amplitude, _ in found) / 2)
    return [(x, y, amplitude * scale, phase) for x, y, amplitude, phase in found]


def write_map(name: str, rows: list[list[str]]) -> None:
    """Write a map as text, one line along x."""
    path = FOLDER / name
    path.write_text("\n".join(map(" ".join, rows)) + "\n", encoding="utf-8", newline="\n")
    print(f"{path.name}: {len(rows[0])} × {len(rows)} heights")


def rounded(height: float) -> str:
    """Format a height (nm) with the resolution of the maps."""
    return f"{round(height / RESOLUTION) * RESOLUTION:.1f}"


# -- a rough ball
# ---------------------------------------------------------------------------------------

POINTS = 128
RADIUS = 2500.0  # µm
TILT = 2.0, -1.0  # nm/µm
MISSING = 0.02


def write_ball() -> None:
    """Write a tilted rough ball with missing points; a pixel is 1 µm."""
    source = random.Random(11)  # noqa: S311 - a reproducible stream is wanted, not a secret
    roughness = waves(source, 300, 100.0, 3.0, 60.0)
    middle = (POINTS - 1) / 2
    rows = []
    for j in range(POINTS):
        row = []
        for i in range(POINTS):
            height = sum(
                amplitude * math.cos(x * i + y * j + phase) for x, y, amplitude, phase in roughness
            )
            distance = (i - middle) ** 2 + (j - middle) ** 2
            height += 1000 * (math.sqrt(RADIUS**2 - distance) - RADIUS) + TILT[0] * i + TILT[1] * j
            lost = source.random() < MISSING
            row.append("nan" if lost else rounded(height))
        rows.append(row)
    write_map("heights_128.txt", rows)


# -- one area before and after wear
# ------------------------------------------------------------------------

PAIR_POINTS = 256
PAIR_PIXEL = 0.5  # µm
SHIFT = 3.2, -1.85  # µm, of the second map along x and y onto the first
DATUM = 40.0, 0.5, -0.3  # nm, nm/µm, nm/µm: offset and tilt of the second map
NOISE = 0.5  # nm, standard deviation of each reading
WORN_ABOVE = 100.0  # nm over the mean
LEFT = 80.0  # nm: remainder above that level of a summit of any height


def worn(height: float) -> float:
    """Return a height (nm) after wear: the higher a summit, the more of it is lost, and the blunter it is."""
    above = height - WORN_ABOVE
    return height if above < 0 else WORN_ABOVE + LEFT * (1 - math.exp(-above / LEFT))


def heights_on(roughness: list[Wave], shift: tuple[float, float]) -> Callable[[int, int], float]:
    """Return the height (nm) at the point i, j of a map that is shifted by some µm."""
    along = [PAIR_PIXEL * i + shift[0] for i in range(PAIR_POINTS)]
    across = [PAIR_PIXEL * j + shift[1] for j in range(PAIR_POINTS)]
    # cos(u + v) = cos u cos v - sin u sin v
    columns = [
        [turn(k * x) for turn in (math.cos, math.sin) for k, _, _, _ in roughness] for x in along
    ]
    lines = [
        [a * math.cos(k * y + phase) for _, k, a, phase in roughness]
        + [-a * math.sin(k * y + phase) for _, k, a, phase in roughness]
        for y in across
    ]
    return lambda i, j: sum(map(mul, columns[i], lines[j]))


def write_pair() -> None:
    """Write two maps of one area, fresh and worn, with noise, and print the volume lost in the area of both."""
    source = random.Random(54)  # noqa: S311 - as above
    roughness = waves(source, 150, 60.0, 4.0, 100.0)
    before, after = heights_on(roughness, (0.0, 0.0)), heights_on(roughness, SHIFT)
    offset, along_x, along_y = DATUM
    everywhere = range(PAIR_POINTS)
    fresh = [[before(i, j) for i in everywhere] for j in everywhere]
    moved = [
        [worn(after(i, j)) + offset + PAIR_PIXEL * (along_x * i + along_y * j) for i in everywhere]
        for j in everywhere
    ]
    for name, heights in (("fresh_256.txt", fresh), ("worn_256.txt", moved)):
        write_map(
            name, [[rounded(height + source.gauss(0, NOISE)) for height in row] for row in heights]
        )
    far = PAIR_PIXEL * (PAIR_POINTS - 1)
    lost = sum(
        height - worn(height)
        for j, row in enumerate(fresh)
        for i, height in enumerate(row)
        if 0 <= PAIR_PIXEL * i - SHIFT[0] <= far and 0 <= PAIR_PIXEL * j - SHIFT[1] <= far
    )
    print(f"worn volume: {lost * 1e-3 * PAIR_PIXEL**2:.3f} µm³")


if __name__ == "__main__":
    write_ball()
    write_pair()
