"""A contact law in forty lines, scored: springs that stick, or slide at μ times their normal load.

    python example.py results/vector_springs && python score.py --all results/vector_springs

The springs of Popov's method of dimensionality reduction, 400 for each asperity, moved along chords
of each leg. In two directions they are pulled back to a circle, which is not Coulomb's law on the
contact: the score shows it. Cases that prescribe loads are left out.
"""

import sys
from pathlib import Path

import numpy as np
import score

SPRINGS, CHORDS = 400, 20


def follow(case, given):
    """Rows of the tangential load (x, y), and of the energy dissipated."""
    slope = case["contact_modulus"] / (4 * case["shear_modulus"])
    radius = np.array(case["summit_radius"])[:, None]
    lag = max(case["summit_height"]) - np.array(case["summit_height"])[:, None]
    edge = np.sqrt(radius * np.maximum(given["d"].max() - lag, 0))
    x = edge * (np.arange(SPRINGS) + 0.5) / SPRINGS
    stiffness = 8 * case["shear_modulus"] * edge / SPRINGS
    along = given["ux" if "ux" in given else "u"]
    motion = np.column_stack([given["d"], along, given.get("uy", 0 * along)])
    friction = given.get("mu", np.full(len(motion), case["friction"]))
    spring, lost, rows, before = np.zeros((2, *x.shape)), 0.0, [], motion[0]
    for after, mu in zip(motion, friction, strict=True):
        step = (after - before) / CHORDS
        for chord in range(1, CHORDS + 1):
            d = before[0] + chord * step[0]
            limit = mu * slope * np.maximum(d - lag - x**2 / radius, 0)
            trial = spring + step[1:, None, None]
            size = np.hypot(*trial)
            spring = trial * np.where(size > limit, limit / np.where(size > 0, size, 1), 1)
            lost += (stiffness * limit * np.maximum(size - limit, 0)).sum()
        rows.append([*(stiffness * spring).sum(axis=(1, 2)), lost])
        before = after
    return np.array(rows)


def main(folder):
    """Write a result for every case that prescribes d and u."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in score.list_cases():
        case, given = score.read_case(name)
        if not {"d", "u"} <= set(case["control"]) and not {"d", "ux"} <= set(case["control"]):
            continue
        rows, names = follow(case, given), ["Tx", "Ty", "E"]
        if "u" in given:
            rows, names = rows[:, [0, 2]], ["T", "E"]
        np.savetxt(folder / f"{name}.csv", rows, "%.9e", ",", header=",".join(names), comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
