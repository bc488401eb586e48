"""Write the CSV files of this folder, the same bytes every time: ``python data/make_sequences.py``."""

import itertools
import random
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

FOLDER = Path(__file__).parent

SAMPLE_RATE = 10  # Hz
DISPLACEMENT_RESOLUTION = 1.0  # nm
FORCE_RESOLUTION = 0.006  # mN, UNAT
VAFT_FORCE_ACCURACY = 0.008  # mN
SPEED = 25.0  # nm/s
LOAD_RAMP = 2.0  # s

Waypoint = tuple[float, ...]


def sampled(waypoints: Sequence[Waypoint], rate: float = SAMPLE_RATE) -> Iterator[Waypoint]:
    """Give (time, value, …) at the sample rate along straight lines between the waypoints."""
    yield waypoints[0]
    for start, end in itertools.pairwise(waypoints):
        count = round((end[0] - start[0]) * rate)
        for index in range(1, count + 1):
            yield tuple(a + (b - a) * index / count for a, b in zip(start, end, strict=True))


def read_off(value: float, resolution: float, noise: random.Random) -> float:
    """Give what an instrument shows: noise of the spread of its resolution, then the nearest step."""
    return round(value / resolution + noise.gauss(0.0, 12**-0.5)) * resolution


def loops(
    levels: Iterable[float], count: int, amplitude: float, speed: float = SPEED
) -> list[Waypoint]:
    """Give waypoints (s, mN, nm) of triangular loops at each normal load, without release in between."""
    quarter = amplitude / speed
    time = 0.0
    waypoints: list[Waypoint] = [(time, 0.0, 0.0)]
    for load in levels:
        time += LOAD_RAMP
        waypoints.append((time, load, 0.0))
        for _ in range(count):
            for after, displacement in (
                (quarter, amplitude),
                (2 * quarter, -amplitude),
                (quarter, 0.0),
            ):
                time += after
                waypoints.append((time, load, displacement))
    return waypoints


def write(name: str, header: str, rows: Iterable[str]) -> None:
    """Write one file and say so."""
    text = "\n".join([header, *rows]) + "\n"
    (FOLDER / name).write_text(text, encoding="utf-8", newline="\n")
    print(f"{name}: {text.count(chr(10)) - 1} rows")


def write_sequence(
    name: str, seed: int, waypoints: Sequence[Waypoint], force_resolution: float = FORCE_RESOLUTION
) -> None:
    """Write a sequence as the instrument would have sampled it."""
    noise = random.Random(seed)  # noqa: S311 - a reproducible stream is wanted, not a secret
    rows = []
    for time, load, displacement in sampled(waypoints):
        # the contact does not pull, so neither does its reading
        force = max(read_off(load, force_resolution, noise), 0.0)
        moved = read_off(displacement, DISPLACEMENT_RESOLUTION, noise)
        rows.append(f"{time:.1f},{force:.3f},{moved:.0f}")
    write(name, "time_s,normal_load_mN,tangential_displacement_nm", rows)


def write_path(
    name: str, normal_change: float, tangential_start: float, tangential_change: float
) -> None:
    """Write a load path of one asperity: out and back twice along a straight line in (N, T)."""
    start, end = (
        (50.0, tangential_start),
        (50.0 + normal_change, tangential_start + tangential_change),
    )
    corners = [(0.0, 0.0), (50.0, 0.0), start, end, start, end, start]
    waypoints = [(2.0 * index, *corner) for index, corner in enumerate(corners)]
    rows = (
        f"{time:.1f},{normal:.3f},{tangential:.3f}"
        for time, normal, tangential in sampled(waypoints)
    )
    write(name, "time_s,normal_load_mN,tangential_load_mN", rows)


def write_summits(name: str, seed: int) -> None:
    """Write a table of random summits."""
    chance = random.Random(seed)  # noqa: S311 - a reproducible stream is wanted, not a secret
    rows = []
    for _ in range(200):
        height = chance.gauss(0.0, 60.0)
        radius = 10.0 * chance.lognormvariate(0.0, 0.3)
        x, y = chance.uniform(0.0, 500.0), chance.uniform(0.0, 500.0)
        rows.append(f"{height:.2f},{radius:.3f},{x:.2f},{y:.2f}")
    write(name, "height_nm,radius_um,x_um,y_um", rows)


def main() -> None:
    """Write all files."""
    write_sequence("unat_50.csv", 1, loops([50.0], count=5, amplitude=50.0))
    write_sequence("unat_50_70_90.csv", 2, loops([50.0, 70.0, 90.0], count=4, amplitude=100.0))
    write_sequence("unat_90_70_50.csv", 3, loops([90.0, 70.0, 50.0], count=4, amplitude=100.0))
    vaft = loops([30.0, 60.0, 90.0], count=4, amplitude=200.0, speed=2 * SPEED)
    write_sequence("vaft_30_60_90.csv", 4, vaft, VAFT_FORCE_ACCURACY)
    write_path("path_normal_up_tangential_up.csv", 20.0, 1.0, 4.0)
    write_path("path_normal_down_tangential_up.csv", -20.0, 1.0, 4.0)
    write_path("path_normal_up_tangential_down.csv", 20.0, 5.0, -4.0)
    write_path("path_normal_down_tangential_down.csv", -20.0, 5.0, -4.0)
    write_summits("summits_200.csv", 8)


if __name__ == "__main__":
    main()
