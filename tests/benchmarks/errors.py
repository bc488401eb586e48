"""Worst errors by family of paths: random histories beside those of a tolerance 100 times smaller.

Run after the package is installed::

    python tests/benchmarks/errors.py

It prints the table of the page of the memory (`historysim/memory/README.md`).
"""

import numpy as np

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=1.4875e10)
DEPTH, FRICTION, HISTORIES, EVENTS = 5e-8, 0.3, 60, 8
FULL_SLIP = FRICTION * DEPTH * 7e10 / (4 * 1.4875e10)
LAWS = (
    hs.laws.PowerLaw(coefficient=0.3, reference_load=1e-5, exponent=-1 / 3),
    hs.laws.PowerLaw(coefficient=0.3, reference_load=1e-4, exponent=-0.2, load="total"),
    hs.laws.SlidFriction(distance=[0.0, 5e-9, 5e-8], coefficient=[0.35, 0.25, 0.2]),
)
FAMILIES = (
    "ramps of both loads, one coefficient",
    "ramps of both loads, several coefficients",
    "falls of friction",
    "laws of friction",
    "wear",
    "yielding",
    "two directions",
)


def options(rng, family, count):
    """Return the options of an ensemble of a number of asperities."""
    if family == "laws of friction":
        return {"friction": LAWS[rng.integers(len(LAWS))]}
    if "several" in family:
        return {"friction": rng.uniform(0.2, 0.4, count)}
    found = {"friction": FRICTION}
    if family == "wear":
        coefficient = 10.0 ** rng.uniform(-6, -3)
        found["wear"] = hs.wear.ArchardWear(coefficient=coefficient, hardness=5e9)
    if family == "yielding":
        found["yielding"] = hs.yielding.JacksonGreen(hardness=5e9)
    return found


def path(rng, family, load):
    """Return the targets of a random path, by both loads or by the approach."""
    if family == "two directions":
        return {"tangential_displacement": tuple(FULL_SLIP * rng.uniform(-1.0, 1.0, 2))}
    # the limit of a law is lower
    share = (0.2 if "laws" in family else 0.8) * rng.uniform(-1.0, 1.0)
    tangential = {"tangential_load": share * FRICTION * load}
    if family.startswith("ramps") or rng.random() < 0.5:
        return {"normal_load": load * rng.uniform(0.5, 1.3)} | tangential
    if rng.random() < 0.5:
        tangential = {"tangential_displacement": FULL_SLIP * rng.uniform(-1.5, 1.5)}
    return {"normal_displacement": DEPTH * rng.uniform(0.7, 1.1)} | tangential


def history(family, seed, refinement):
    """Return T, U and the energies after each event, over their scales."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 9))
    heights = -rng.exponential(0.3 * DEPTH, count)
    radii = rng.uniform(0.5e-6, 2e-6, count)
    contact = hs.Ensemble(
        PAIR,
        heights - heights.max(),
        radii,
        tolerance=1e-6 / refinement,
        rings=hs.Rings(tolerance=1e-3 / refinement),
        **options(rng, family, count),
    )
    state = contact.advance(contact.initial_state(), normal_displacement=DEPTH)
    if family == "two directions":
        state = contact.enter_plane(state)
    load, found = state.normal_load, []
    for _ in range(EVENTS):
        state = contact.advance(state, saturate=True, **path(rng, family, load))
        if family.startswith("falls"):
            for coefficient in (FRICTION * rng.uniform(0.3, 0.9), FRICTION):
                state = contact.with_friction(state, coefficient)
        tangential = np.atleast_1d(state.tangential_load) / (FRICTION * load)
        moved = np.atleast_1d(state.tangential_displacement) / FULL_SLIP
        found.append([*tangential, *moved, state.dissipated_energy])
    return np.array(found)


def main():
    print("| family | T, of μN | U, of full slip | energy, of all of it | histories |")
    print("| --- | --- | --- | --- | --- |")
    for family in FAMILIES:
        worst = np.zeros(3)
        histories = HISTORIES if family != "two directions" else 6
        for seed in range(histories):
            found, wanted = (history(family, seed, refinement) for refinement in (1, 100))
            error = np.abs(found - wanted)
            tangential, moved = np.split(error[:, :-1], 2, axis=1)
            energy = error[:, -1] / max(wanted[-1, -1], 1e-300)
            worst = np.maximum(worst, [tangential.max(), moved.max(), energy.max()])
        print(
            f"| {family} | {worst[0]:.0e} | {worst[1]:.0e} | {worst[2]:.0e} | {histories} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
