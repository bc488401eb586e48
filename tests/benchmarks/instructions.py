"""Instructions of the C core by case, counted by valgrind: exact on any load of the machine.

Run after the package is installed, with valgrind and gcc::

    python tests/benchmarks/instructions.py

It writes `instructions.json`: instructions per asperity and step of each case, and the compiler of
which they are, for others give other numbers. Goals that are not reached yet are kept beside them.
``pytest -m ci tests/test_instructions.py`` compares.
"""

import ctypes
import functools
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import historysim as hs

TABLE = Path(__file__).with_name("instructions.json")
#: entry points of the core that integrate paths
COUNTED = ("hs_integrate", "hs_set_friction", "hs_stepper_step")
#: functions that start and stop counting, in the measured process itself
SWITCH = """
#include <valgrind/callgrind.h>
void start(void) { CALLGRIND_START_INSTRUMENTATION; }
void toggle(void) { CALLGRIND_TOGGLE_COLLECT; }
void dump(const char *name) { CALLGRIND_DUMP_STATS_AT(name); }
"""
GCC, VALGRIND = shutil.which("gcc"), shutil.which("valgrind")
PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
APPROACH, SWING = 2e-7, 3e-8  # of the contact, and of its tangential displacement [m]


def ensemble(count, friction=0.2, **options):
    """Return asperities of random heights and radii; ``friction`` may be a range of random coefficients."""
    rng = np.random.default_rng(1)
    heights, radii = rng.uniform(0.0, 1e-7, count), rng.uniform(0.5e-6, 2e-6, count)
    if isinstance(friction, tuple):
        friction = rng.uniform(*friction, count)
    return hs.Ensemble(PAIR, heights, radii, friction, **options)


def patches():
    """Return 20 patches of a contact with full interaction."""
    approach = np.linspace(0.0, 3e-7, 40)
    shares = np.random.default_rng(1).uniform(0.5, 1.5, 20)
    return hs.Patches.from_normal_curves(
        PAIR, approach, 1e6 * approach[:, None] ** 1.5 * shares, friction=0.2
    )


def displacements(steps, swing=SWING):
    values = np.random.default_rng(3).uniform(-swing, swing, steps)
    return [hs.TangentialDisplacement(1.0 + k, float(u)) for k, u in enumerate(values)]


def loads(steps, limit):
    values = 0.5 * limit * np.random.default_rng(3).uniform(-1.0, 1.0, steps)
    return [hs.TangentialLoad(1.0 + k, float(load)) for k, load in enumerate(values)]


def ramps(steps, load, swing, friction=0.15):
    rng = np.random.default_rng(3)
    normal = load * (1.0 + swing * rng.uniform(-1.0, 1.0, steps))
    tangential = 0.5 * friction * load * rng.uniform(-1.0, 1.0, steps)
    events = [
        (hs.NormalLoad(1.0 + k, float(n)), hs.TangentialLoad(1.0 + k, float(normal[k] and t)))
        for k, (n, t) in enumerate(zip(normal, tangential, strict=True))
    ]
    return [event for pair in events for event in pair]


def approaches(steps):
    values = APPROACH * (1.0 + 0.02 * np.random.default_rng(5).uniform(-1.0, 1.0, steps))
    return [hs.NormalDisplacement(1.0 + k, float(d)) for k, d in enumerate(values)]


def together(*channels):
    """Merge events of several channels by time."""
    return sorted(
        (event for channel in channels for event in channel), key=lambda event: event.time
    )


def reversals(count):
    """Return ever smaller reversals, all of which are remembered."""
    k = np.arange(count)
    return [
        hs.TangentialDisplacement(1.0 + i, float(u))
        for i, u in enumerate(SWING * (-1.0) ** k * (1 - k / (count + 50)))
    ]


def circle(steps, radius, turns=1.0):
    angle = 2 * np.pi * turns * np.arange(1, steps + 1) / steps
    return [
        hs.TangentialDisplacement(1.0 + k, (float(radius * np.cos(a)), float(radius * np.sin(a))))
        for k, a in enumerate(angle)
    ]


def cliffs(case, contact, normal):
    """Yield cases of falling friction, and of a limit that falls below a held load, with neighbours."""
    pressed = [hs.NormalLoad(1.0, normal), hs.TangentialLoad(1.0, 0.15 * normal)]
    turned = [hs.NormalLoad(2.0, normal), hs.NormalLoad(3.0, normal)]
    turned += [hs.TangentialLoad(2.0 + k, sign * 0.1 * normal) for k, sign in enumerate((-1, 1))]
    fall = hs.FrictionChange(5.0, 0.15)
    yield case("friction falls, load", contact, together(pressed, turned, [fall]))
    at_rest = [hs.TangentialDisplacement(4.0, 0.0), fall]
    yield case("friction falls, displacement", contact, together(pressed, turned, at_rest))
    for name, share in (
        ("load, normal load falls", 0.05),
        ("saturated load, normal load falls", 0.15),
    ):
        withdrawn = [hs.NormalLoad(2.0, 0.5 * normal), hs.TangentialLoad(2.0, share * normal)]
        yield case(name, contact, [*pressed, *withdrawn], saturate=True)


def events_of_many(case):
    """Yield cases of 200,000 asperities, of which each event counts: totals do not grow with their number."""
    crowd = ensemble(200_000)
    normal = crowd.advance(crowd.initial_state(), normal_displacement=APPROACH).normal_load
    for name, events in (
        ("displacement", displacements(40)),
        ("load", loads(40, 0.2 * normal)),
        ("ramps of 10 %", ramps(4, normal, 0.1)),
    ):
        *job, size = case(f"event of 200,000, {name}", crowd, events)
        yield *job, size // len(crowd)


def cases():
    """Yield the cases: name, ensemble, events, options of the replay, and the number of asperities times steps."""

    def case(name, contact, events, record="totals", **options):
        size = len({event.time for event in events}) * len(contact)
        events = [hs.NormalDisplacement(0.0, APPROACH), *events]
        return name, contact, events, {"record": record, **options}, size

    many, few, one, own = (
        ensemble(2000),
        ensemble(20, (0.15, 0.25)),
        ensemble(1),
        ensemble(1000, (0.15, 0.25)),
    )
    load = {
        contact: contact.advance(contact.initial_state(), normal_displacement=APPROACH).normal_load
        for contact in (many, few, one, own)
    }
    for record in ("totals", "all"):
        yield case(f"displacement, {record}", many, displacements(20), record)
        yield case(f"own coefficients, displacement, {record}", own, displacements(6), record)
        yield case(f"ramps of 0.1 %, {record}", many, ramps(6, load[many], 1e-3), record)
        yield case(f"ramps of 10 %, {record}", many, ramps(6, load[many], 0.1), record)
    yield case("one asperity, displacement", one, displacements(100))
    yield case("one asperity, ramps of 10 %", one, ramps(50, load[one], 0.1))
    yield case("300 reversals", many, reversals(300))
    yield case("load", many, loads(20, 0.15 * load[many]))
    crowd = ensemble(50_000)
    normal = crowd.advance(crowd.initial_state(), normal_displacement=APPROACH).normal_load
    yield case(
        "normal load of 50,000",
        crowd,
        [hs.NormalLoad(1.0 + k, normal * (1.0 + 0.1 * k)) for k in range(20)],
    )
    yield from events_of_many(case)
    yield case("approach and displacement", many, together(approaches(10), displacements(10)))
    yield case("own coefficients, load", own, loads(4, 0.15 * load[own]))
    # ramps of several coefficients take at most 4 times as many as the same asperities of one
    yield case("1 coefficient of 20, ramps of 10 %", ensemble(20), ramps(4, load[few], 0.1))
    two = ensemble(20, np.tile((0.15, 0.25), 10))
    yield case("2 coefficients, ramps of 10 %", two, ramps(4, load[few], 0.1))
    yield case("20 coefficients, ramps of 0.1 %", few, ramps(10, load[few], 1e-3))
    yield case("20 coefficients, ramps of 10 %", few, ramps(2, load[few], 0.1))
    law = hs.laws.PowerLaw(coefficient=0.2, reference_load=1e-6, exponent=-0.2)
    wear = hs.wear.ArchardWear(coefficient=1e-4, hardness=5e9)
    moves = together(approaches(4), displacements(4))
    yield case("law of friction", ensemble(50, law), moves)
    yield case("law of friction, all", ensemble(20, law), moves, "all")
    yield case("wear", ensemble(50, wear=wear), displacements(3))
    yields = ensemble(50, yielding=hs.yielding.JacksonGreen())
    yield case("yielding", yields, moves)
    for name, contact in (
        ("law of friction", ensemble(50, law)),
        ("wear", ensemble(50, wear=wear)),
        ("yielding", yields),
    ):
        state = contact.advance(contact.initial_state(), normal_displacement=APPROACH)
        yield case(f"{name}, ramps of 2 %", contact, ramps(4, state.normal_load, 0.02, 0.05))
    yield from cliffs(case, many, load[many])
    plane = ensemble(20)
    limit = 0.2 * plane.advance(plane.initial_state(), normal_displacement=APPROACH).normal_load
    turn = [hs.TangentialDisplacement(0.5, (SWING, 0.0))]
    yield case("two directions, slip", plane, turn + circle(8, SWING))
    yield case("two directions, small circle", plane, turn + circle(8, 0.1 * SWING))
    pressed = [hs.NormalLoad(0.25, limit / 0.2), hs.TangentialLoad(0.5, (0.9 * limit, 0.0))]
    yield case(
        "two directions, 0.9 of the limit",
        plane,
        [*pressed, hs.TangentialLoad(1.0, (0.0, 0.9 * limit))],
    )
    yield case(
        "two directions, loads",
        plane,
        [
            *turn,
            hs.TangentialLoad(1.0, (0.5 * limit, 0.0)),
            hs.TangentialLoad(2.0, (0.3 * limit, 0.4 * limit)),
        ],
    )
    yield case("patches", patches(), displacements(20))
    yield case(
        "patches, ramps of 10 %",
        patches(),
        ramps(
            10,
            patches().advance(patches().initial_state(), normal_displacement=APPROACH).normal_load,
            0.1,
        ),
    )


def stepper_after_a_turn():
    """Return a stepper of 20 asperities that slipped in two directions, and paths on which none slips."""
    stepper = ensemble(20).stepper()
    stepper.step(normal_displacement=APPROACH, tangential_displacement=(SWING, 0.0))
    stepper.step(tangential_displacement=(SWING, SWING))
    turns = np.cumsum(np.random.default_rng(7).uniform(-1e-11, 1e-11, (40, 2)), axis=0)
    return stepper, [
        {
            "normal_displacement": APPROACH * (1.0 + 0.001 * k),
            "tangential_displacement": (float(SWING + x), float(SWING + y)),
        }
        for k, (x, y) in enumerate(turns, 1)
    ]


class CountedLibrary:
    """The C library, whose instructions are counted while it integrates paths."""

    def __init__(self, library, toggle):
        self._library, self._toggle = library, toggle

    def __getattr__(self, name):
        function = getattr(self._library, name)
        return functools.partial(self._count, function) if name in COUNTED else function

    def _count(self, function, *arguments):
        self._toggle()
        try:
            return function(*arguments)
        finally:
            self._toggle()


def count_here(switch):
    """Integrate all cases and have the instructions of each counted; print names and sizes."""
    library = ctypes.CDLL(switch)
    # what is imported for the first history is not instrumented
    hs.replay(ensemble(2), displacements(2), record="all")
    everything = list(cases())
    module = importlib.import_module("historysim.asperities.integration")
    module.lib = CountedLibrary(module.lib, library.toggle)
    library.start()
    for name, contact, events, options, size in everything:
        hs.replay(contact, events, threads=1, **options)
        library.dump(name.encode())
        print(json.dumps([name, size]))
    stepper, moves = stepper_after_a_turn()
    importlib.import_module("historysim.asperities.stepper")._step = module.lib.hs_stepper_step
    for move in moves:
        stepper.step(**move)
    library.dump(b"stick")
    print(json.dumps(["two directions, stick", 20 * len(moves)]))


def measure():
    """Count the instructions per asperity and step of each case."""
    with tempfile.TemporaryDirectory() as folder:
        source, switch = Path(folder, "switch.c"), Path(folder, "switch.so")
        source.write_text(SWITCH, encoding="utf-8")
        subprocess.run([GCC, "-shared", "-fPIC", "-O1", "-o", switch, source], check=True)
        count = [
            VALGRIND,
            "--tool=callgrind",
            "--instr-atstart=no",
            "--collect-atstart=no",
            f"--callgrind-out-file={folder}/counts",
        ]
        lines = subprocess.run(
            [*count, sys.executable, __file__, str(switch)],
            env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            check=True,
            capture_output=True,
            text=True,
        ).stdout.splitlines()
        table = {}
        for number, line in enumerate(lines, 1):
            name, size = json.loads(line)
            counted = re.search(
                r"^(?:summary|totals): (\d+)",
                Path(folder, f"counts.{number}").read_text("utf-8"),
                re.MULTILINE,
            )
            table[name] = round(int(counted[1]) / size, 1)
    return table


def compiler():
    """Return the compiler whose instructions are counted."""
    return subprocess.run(
        [GCC, "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        count_here(sys.argv[1])
    else:
        goals = json.loads(TABLE.read_text("utf-8"))["goals"]
        table = {"compiler": compiler(), "instructions": measure(), "goals": goals}
        TABLE.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")
        print(TABLE.read_text("utf-8"))
