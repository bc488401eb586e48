"""Write the height map of this folder, the same bytes every time: ``python data/make_heights.py``."""

import math
import random
from pathlib import Path

FOLDER = Path(__file__).parent

POINTS = 128
WAVES = 300
LONGEST, SHORTEST = 100.0, 3.0  # µm; a pixel is 1 µm
RMS_HEIGHT = 60.0  # nm
RADIUS = 2500.0  # µm
TILT = 2.0, -1.0  # nm/µm
RESOLUTION = 0.1  # nm
MISSING = 0.02


def waves(source: random.Random) -> list[tuple[float, float, float, float]]:
    """Give wave vectors (1/µm), amplitudes (nm) and phases of an isotropic roughness with a Hurst exponent of 0.8."""
    found = []
    for _ in range(WAVES):
        number = 2 * math.pi / LONGEST * (LONGEST / SHORTEST) ** source.random()
        direction = math.pi * source.random()
        found.append(
            (number * math.cos(direction), number * math.sin(direction), number**-0.8, 2 * math.pi * source.random())
        )
    # of independent waves the squares of the amplitudes add up
    scale = RMS_HEIGHT / math.sqrt(sum(amplitude**2 for _, _, amplitude, _ in found) / 2)
    return [(x, y, amplitude * scale, phase) for x, y, amplitude, phase in found]


def main() -> None:
    """Write the map."""
    source = random.Random(11)  # noqa: S311 - a reproducible stream is wanted, not a secret
    roughness = waves(source)
    middle = (POINTS - 1) / 2
    lines = []
    for j in range(POINTS):
        row = []
        for i in range(POINTS):
            height = sum(amplitude * math.cos(x * i + y * j + phase) for x, y, amplitude, phase in roughness)
            distance = (i - middle) ** 2 + (j - middle) ** 2
            height += 1000 * (math.sqrt(RADIUS**2 - distance) - RADIUS) + TILT[0] * i + TILT[1] * j
            lost = source.random() < MISSING
            row.append("nan" if lost else f"{round(height / RESOLUTION) * RESOLUTION:.1f}")
        lines.append(" ".join(row))
    path = FOLDER / "heights_128.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    print(f"{path.name}: {POINTS} × {POINTS} heights")


if __name__ == "__main__":
    main()
