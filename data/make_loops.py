"""Write the friction loops of this folder, the same bytes every time: ``python data/make_loops.py``.

Needs historysim itself, which simulates them.
"""

import itertools
import random
from pathlib import Path

import historysim as hs

FOLDER = Path(__file__).parent

RADIUS, FRICTION = 2.5e-3, 0.2  # m
LATERAL_STIFFNESS = 334e3  # N/m, UNAT
LOADS, LOOPS, AMPLITUDE = (30, 50, 70, 90), 2, 300.0  # mN, at each load, nm
SPEED, SAMPLE_RATE, LOAD_RAMP = 25.0, 5, 2.0  # nm/s, Hz, s
DISPLACEMENT_NOISE, FORCE_NOISE = 1.0, 0.006  # nm, mN


def waypoints() -> list[tuple[float, float, float]]:
    """Give time (s), normal load (mN) and displacement of the drive (nm) where one of them turns."""
    quarter = AMPLITUDE / SPEED
    time, points = 0.0, [(0.0, 0.0, 0.0)]
    for load in LOADS:
        time += LOAD_RAMP
        points.append((time, float(load), 0.0))
        for _ in range(LOOPS):
            for after, displacement in (
                (quarter, AMPLITUDE),
                (2 * quarter, -AMPLITUDE),
                (quarter, 0.0),
            ):
                time += after
                points.append((time, float(load), displacement))
    return points


def main() -> None:
    """Write the loops."""
    points = waypoints()
    samples = []
    for (start, load, displacement), (end, next_load, next_displacement) in itertools.pairwise(
        points
    ):
        count = round((end - start) * SAMPLE_RATE)
        for index in range(count):
            share = index / count
            samples.append(
                (
                    start + share * (end - start),
                    load + share * (next_load - load),
                    displacement + share * (next_displacement - displacement),
                )
            )
    samples.append(points[-1])
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    events: list[hs.NormalLoad | hs.TangentialDisplacement] = []
    for time, load, displacement in samples:
        events += [
            hs.NormalLoad(time, load * 1e-3),
            hs.TangentialDisplacement(time, displacement * 1e-9),
        ]
    history = hs.replay(
        hs.Ensemble(pair, 0.0, RADIUS, FRICTION),
        events,
        instrument=hs.Instrument(LATERAL_STIFFNESS),
    )
    noise = random.Random(5)  # noqa: S311 - a reproducible stream is wanted, not a secret
    rows = ["time_s,normal_load_mN,displacement_nm,tangential_load_mN"]
    for (time, load, displacement), force in zip(
        samples, history["total_tangential_load"].values, strict=True
    ):
        read = displacement + noise.gauss(0.0, DISPLACEMENT_NOISE)
        rows.append(
            f"{time:.1f},{load:.3f},{read:.2f},{force * 1e3 + noise.gauss(0.0, FORCE_NOISE):.4f}"
        )
    path = FOLDER / "unat_loops.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8", newline="\n")
    print(f"{path.name}: {len(rows) - 1} rows")


if __name__ == "__main__":
    main()
