"""Asperities that evolve, in the compiled core by itself: against springs in small steps, and results known before."""

import numpy as np
import pytest

from historysim.basics.library import ffi, lib, pointer
from tests.support.evolving_springs import EvolvingSprings

LAWS = {"none": 0, "power": 1, "strength": 2, "shifted": 3, "slid": 4, "callers": 5}
DEPENDS_ON = {"nothing": 0, "total": 1, "own": 2, "slid": 3}
WEARS = {"none": 0, "archard": 1, "energy": 2, "callers": 3}
EACH = ("friction", "slid_distance", "worn_volume", "summit_height", "summit_radius")


class Evolving:
    """A memory of the core whose asperities evolve; each has a memory of its own."""

    def __init__(
        self, modulus, shear, height, radius, *, friction=0.0, law=None, wear=None, tolerance=1e-6, saturate=False
    ):
        self.height, self.radius = (np.array(part, dtype=float) for part in np.broadcast_arrays(height, radius))
        self.count, alone = self.height.size, np.arange(self.height.size)
        contact = lib.hs_contact_new(
            self.count,
            pointer(self.height),
            pointer(self.radius),
            ffi.NULL,
            pointer(alone),
            modulus,
            modulus / 4 / shear,
        )
        coefficients = np.full(self.count, friction)
        self.memory = ffi.gc(lib.hs_state_new(contact, pointer(coefficients)), lib.hs_state_free)
        assert lib.hs_state_evolve(self.memory) == lib.HS_OK
        lib.hs_contact_free(contact)
        self.drive = ffi.new("hs_drive *", {"tolerance": tolerance, "saturate": saturate, "threads": 1})
        self.refusal, self.evolution = ffi.new("hs_refusal *"), ffi.new("hs_evolution *")
        self.evolution.count = self.count
        self.evolution.contact_modulus = modulus
        self.kept = []
        self._fill(self.evolution.law, LAWS, law or {})
        self._fill(self.evolution.wear, WEARS, wear or {})

    def _fill(self, struct, kinds, settings):
        for name, value in settings.items():
            if name == "kind":
                struct.kind = kinds[value]
            elif name == "depends_on":
                struct.depends_on = DEPENDS_ON[value]
            elif isinstance(value, np.ndarray):
                struct.rows = value.size
                self.kept += [value, pointer(value)]
                setattr(struct, name, self.kept[-1])
            else:
                setattr(struct, name, value)

    def go(self, normal, tangential, parts=1, *, goal=None, plain=False):
        """Walk one path to targets, each ("load" | "displacement", value); return the status."""
        path = ffi.new("hs_path *", {"parts": parts, "recorded": 1})
        for name, (kind, value) in (("normal", normal), ("tangential", tangential)):
            numbers = {"control": int(kind == "displacement"), "target": value, "fraction": 1.0}
            for field, number in numbers.items():
                setattr(path, f"{name}_{field}", number if name == "normal" else [number])
        self.totals = ffi.new("hs_totals[]", parts)
        which, rows = np.arange(self.count), ffi.new("hs_rows *", {"totals": self.totals, "columns": self.count})
        rows.asperity = pointer(which)
        self.rows = {name: np.zeros((parts, self.count)) for name in EACH}
        pointers = {name: pointer(array) for name, array in self.rows.items()}
        for name, place in pointers.items():
            setattr(rows, name, place)
        if plain:
            return lib.hs_integrate(self.memory, path, 1, rows, self.drive, 1.0, ffi.NULL, self.refusal)
        if goal is not None:
            goal = np.full(self.count, goal)
            self.evolution.goal, self.evolution.goal_fraction = pointer(goal), 1.0
        status = lib.hs_integrate(self.memory, path, 1, rows, self.drive, 1.0, self.evolution, self.refusal)
        self.evolution.goal = ffi.NULL
        return status

    @property
    def displacement(self):
        return self.memory.line.displacement * self.memory.line.contact.units.displacement

    @property
    def approach(self):
        return self.memory.line.approach * self.memory.line.contact.units.length

    @property
    def tangential_load(self):
        return self.memory.line.tangential_load * self.memory.line.contact.units.load

    @property
    def dissipated(self):
        return self.memory.line.dissipated * self.memory.line.contact.units.energy

    def each(self, name):
        """What has become of the asperities."""
        return np.frombuffer(ffi.buffer(getattr(self.memory.line.evolved, name), 8 * self.count)).copy()


# -- wear

MODULUS, SHEAR = 43050430504.305046, 9231762427.3725


class InnermostSprings:
    """Blunted wear by small explicit steps: while it slides, an asperity's springs are all at the limit, whatever its
    shape, so that the innermost spring alone says whether it slides."""

    def __init__(self, height, radius, friction, rate):
        self.lag, self.curvature = -np.array(height), 1 / np.full(len(height), radius)
        self.friction, self.rate, self.ratio = friction, rate, MODULUS / 4 / SHEAR
        self.strain, self.approach, self.displacement = np.zeros(len(height)), 0.0, 0.0

    def loads(self, approach):
        return 4 / 3 * MODULUS / np.sqrt(self.curvature) * np.maximum(approach - self.lag, 0.0) ** 1.5

    def approach_at(self, load, guess):
        for _ in range(50):
            missing = load - self.loads(guess).sum()
            slope = 2 * MODULUS * np.sqrt(np.maximum(guess - self.lag, 0.0) / self.curvature).sum()
            guess += missing / slope
            if abs(missing) < 1e-13 * load:
                break
        return guess

    def go(self, load, displacement, steps):
        lag, curvature = self.lag.copy(), self.curvature.copy()
        first = self.approach
        last = self.approach_at(load, max(self.approach, 1e-8))
        moved = (displacement - self.displacement) / steps
        for k in range(1, steps + 1):
            # as the program has it: the normal load that the shape at the start carries on a straight approach
            own = np.maximum(first + (last - first) * k / steps - lag, 0.0)
            self.approach = self.approach_at(
                (4 / 3 * MODULUS / np.sqrt(curvature) * own**1.5).sum(), self.approach or last
            )
            own = np.maximum(self.approach - self.lag, 0.0)
            limit, trial = self.ratio * self.friction * own, self.strain + moved
            slides = (np.abs(trial) > limit) & (own > 0)
            self.strain = np.where(own > 0, np.clip(trial, -limit, limit), 0.0)
            lost = np.where(slides, self.rate * self.loads(self.approach) * abs(moved), 0.0)
            square = np.where(slides, own / self.curvature, 1.0)
            self.lag += 2 * lost / np.pi / square
            self.curvature *= np.exp(-4 * lost / np.pi / square**2 / self.curvature)
        self.displacement = displacement


def blunted(parts):
    core = Evolving(
        MODULUS,
        SHEAR,
        [0.0, -20e-9, -50e-9],
        10e-6,
        friction=0.3,
        wear={"kind": "archard", "rate": 0.1 / 6e9, "shape": 1},
    )
    for load, displacement in ((0.01, 0.0), (0.02, 200e-9), (0.005, -200e-9)):
        assert core.go(("load", load), ("displacement", displacement), 1 if displacement == 0 else parts) == 0
    return core


def test_blunted_summits_agree_with_springs_at_any_substeps():
    ends = []
    for steps in (1500, 3000):
        springs = InnermostSprings([0.0, -20e-9, -50e-9], 10e-6, 0.3, 0.1 / 6e9)
        for load, displacement in ((0.01, 0.0), (0.02, 200e-9), (0.005, -200e-9)):
            springs.go(load, displacement, steps)
        ends.append(np.array([1 / springs.curvature, -springs.lag]))
    # of order one half in the step where a summit comes into contact while it slides
    error = 3 * np.abs(ends[1] - ends[0])
    for parts in (1, 10, 100):
        core = blunted(parts)
        assert core.each("summit_radius")[2] == pytest.approx(23.170e-6, abs=0.0006e-6)
        assert core.each("summit_height")[2] == pytest.approx(-68.140e-9, abs=0.002e-9)
        found = np.array([core.each("summit_radius"), core.each("summit_height")])
        assert (np.abs(found - ends[1]) <= error + np.array([[2e-9], [2e-12]])).all()


# -- lift-off under a tangential load

LIFTED = {
    "plain": {"friction": 0.4},
    "wear": {"friction": 0.4, "wear": {"kind": "archard", "rate": 1e-12}},
    "law": {"law": {"kind": "strength", "depends_on": "own", "shear_strength": 3e8}},
}


@pytest.mark.parametrize("parts", [1, 50])
@pytest.mark.parametrize("name", LIFTED)
def test_lift_off_under_a_load_leaves_no_displacement(name, parts):
    """The last spring to leave never slipped, and is anchored where it touched."""
    core, plain = Evolving(43e9, 9.2e9, [0.0], 10e-6, **LIFTED[name]), name == "plain"
    assert core.go(("displacement", 80e-9), ("load", 0.0), plain=plain) == 0
    assert core.go(("displacement", 80e-9), ("load", 0.6e-3), plain=plain) == 0
    assert core.displacement > 1e-9
    assert core.go(("displacement", -10e-9), ("load", 0.0), parts, plain=plain) == 0
    assert (core.displacement, core.tangential_load) == (0.0, 0.0)


def test_the_displacement_stays_while_the_limit_of_a_sliding_contact_falls():
    """A load held at the limit while the contact lifts off: the displacement stays where sliding began."""
    ends = []
    for parts in (1, 4, 50):
        core = Evolving(
            43e9, 9.2e9, [0.0, -20e-9], 10e-6, friction=0.4, wear={"kind": "archard", "rate": 1e-16}, saturate=True
        )
        core.go(("displacement", 80e-9), ("load", 0.6e-3))
        core.go(("displacement", -10e-9), ("load", 0.2e-3), parts)
        ends.append(core.displacement)
    plain = Evolving(43e9, 9.2e9, [0.0, -20e-9], 10e-6, friction=0.4, saturate=True)
    plain.go(("displacement", 80e-9), ("load", 0.6e-3), plain=True)
    # with the load straight in the share, as where asperities evolve, in many paths
    approach, load = 80e-9, 0.6e-3
    for k in range(1, 301):
        plain.go(("displacement", approach - 90e-9 * k / 300), ("load", load - 0.4e-3 * k / 300), plain=True)
    assert ends == pytest.approx([plain.displacement] * 3, rel=5e-3)


# -- slid distances


def test_slid_distance_counts_gross_slip_only():
    """Friction falls after a reversal: the inner springs slip while the annulus sticks, and that counts for nothing."""
    core = Evolving(1.0, 0.25, [0.0], 1.0, friction=0.5)
    targets = [(0.5, 0.008), (0.5, 0.0), (0.15, 0.003), (0.15, 0.009)]
    approach, springs, steps = 0.02, 400, 4000
    x = np.sqrt(approach) * (np.arange(springs) + 0.5) / springs
    own = approach - x**2
    core.go(("displacement", approach), ("displacement", 0.0))
    strain, friction, at, whole, inner = np.zeros(springs), 0.5, 0.0, 0.0, 0.0
    for last, displacement in targets:
        before = whole
        for k in range(1, steps + 1):
            limit = (friction + (last - friction) * k / steps) * own
            trial = strain + (displacement - at) / steps
            strain = np.clip(trial, -limit, limit)
            slips = np.sign(trial) * (np.abs(trial) > limit)
            whole += abs(displacement - at) / steps * abs(slips.mean() == slips[0] != 0)
            inner += abs(displacement - at) / steps * (slips[0] != 0)
        at, friction = displacement, last
        goal = {} if friction == 0.5 and last == 0.5 else {"goal": last}
        core.go(("displacement", approach), ("displacement", displacement), **goal)
        assert core.each("slid_distance")[0] == pytest.approx(whole, abs=3e-5), (last, displacement, before)
    assert inner > whole + 1e-3
    assert whole > 1e-3


# -- friction that goes with the own load

HEIGHT, RADIUS = np.array([0.0, -0.012, -0.03]), np.array([1.0, 0.7, 0.9])
ADHESION, STRENGTH = 1e-5, 0.05


def of_jkr(load, _total, radius, _slid):
    pull = 3 * np.pi * ADHESION * radius
    square = np.cbrt(0.75 * radius * (load + pull + np.sqrt(2 * pull * load + pull**2))) ** 2
    return np.where(load > 0, STRENGTH * np.pi * square / np.maximum(load, 1e-300), 0.0)


TOUCHING = [
    (("load", 0.01), ("displacement", 0.03)),
    (("displacement", 0.045), ("displacement", 0.08)),
    (("load", 0.004), ("displacement", 0.05)),
    (("displacement", -0.004), ("displacement", 0.04)),
    (("displacement", 0.03), ("displacement", 0.09)),
]


def test_jkr_friction_near_touch_and_lift_off_agrees_with_springs_at_any_substeps():
    rows = [EvolvingSprings(1.0, 0.25, HEIGHT, RADIUS, of_jkr, 0.12) for _ in range(2)]
    law = {"kind": "strength", "depends_on": "own", "shear_strength": STRENGTH, "work_of_adhesion": ADHESION}
    cores = {parts: Evolving(1.0, 0.25, HEIGHT, RADIUS, law=law) for parts in (1, 10, 100)}
    for target in TOUCHING:
        for row, steps in zip(rows, (250, 500), strict=True):
            row.go(*target, steps)
        for parts, core in cores.items():
            assert core.go(*target, parts) == 0
            for name, found in (("dissipated", core.dissipated), ("slid", core.each("slid_distance").sum())):
                coarse, fine = (getattr(row, name).sum() for row in rows)
                assert found == pytest.approx(2 * fine - coarse, abs=2 * abs(fine - coarse) + 2e-3 * abs(fine)), name
            assert core.tangential_load == pytest.approx(rows[1].tangential_loads.sum(), abs=2e-4)
    ends = [[core.dissipated, *core.each("slid_distance")] for core in cores.values()]
    assert (np.ptp(ends, axis=0) <= 1e-3 * np.max(ends, axis=0)).all()


# -- what was known before

TARGETS = [
    (("load", 0.01), ("displacement", 0.0)),
    (("load", 0.012), ("displacement", 0.06)),
    (("load", 0.02), ("displacement", -0.02)),
    (("displacement", 0.035), ("displacement", 0.03)),
    (("load", 0.015), ("load", 0.002)),
    (("load", 0.01), ("displacement", -0.05)),
]
# approach, tangential load, dissipated energy; slid distances; worn volumes: of another implementation, at a tolerance
# of 1e-8
KNOWN = {
    "power": (0.0306232196, -0.00486760287, 0.00123524517, [0.1661394, 0.1822308, 0.2317132], None),
    "total": (0.0306232196, -0.004, 0.000982808109, [0.1843381, 0.2128826, 0.2556662], None),
    "strength": (0.0306232196, -0.00694611964, 0.00145034299, [0.1137267, 0.1629448, 0.2113984], None),
    "shifted": (0.0306232196, -0.00349008845, 0.00098037652, [0.1886662, 0.2135256, 0.2415643], None),
    "slid": (0.0306232196, -0.00390339351, 0.00101946162, [0.1797193, 0.2094705, 0.2537452], None),
    "archard": (
        0.0331953739,
        -0.005,
        0.00122823236,
        [0.1463594, 0.1871031, 0.2458095],
        [2.551279e-05, 1.477663e-05, 3.431723e-06],
    ),
    "energy": (
        0.033947292,
        -0.005,
        0.00122752604,
        [0.1469251, 0.1872898, 0.2451496],
        [4.41656e-05, 2.398486e-05, 5.501146e-06],
    ),
}
EVOLUTIONS = {
    "power": {
        "law": {"kind": "power", "depends_on": "own", "coefficient": 0.4, "reference_load": 0.01, "exponent": -0.3}
    },
    "total": {
        "law": {"kind": "power", "depends_on": "total", "coefficient": 0.4, "reference_load": 0.01, "exponent": -0.5}
    },
    "strength": {"law": {"kind": "strength", "depends_on": "own", "shear_strength": 0.05}},
    "shifted": {"law": {"kind": "shifted", "depends_on": "own", "coefficient": 0.3, "work_of_adhesion": 1e-4}},
    "slid": {
        "friction": 0.5,
        "law": {
            "kind": "slid",
            "depends_on": "slid",
            "distance": np.array([0.0, 0.05, 0.2]),
            "coefficients": np.array([0.5, 0.3, 0.4]),
        },
    },
    "archard": {"friction": 0.5, "wear": {"kind": "archard", "rate": 0.02}},
    "energy": {"friction": 0.5, "wear": {"kind": "energy", "rate": 0.06}},
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_results(name):
    core = Evolving(1.0, 0.25, HEIGHT, RADIUS, **EVOLUTIONS[name])
    assert not any(core.go(*target) for target in TARGETS)
    approach, load, energy, slid, worn = KNOWN[name]
    assert core.approach == pytest.approx(approach, rel=1e-4)
    assert core.tangential_load == pytest.approx(load, rel=4e-4)
    assert core.dissipated == pytest.approx(energy, rel=1e-3)
    assert core.each("slid_distance") == pytest.approx(slid, rel=1e-3, abs=5e-4)
    if worn is not None:
        assert core.each("worn_volume") == pytest.approx(worn, rel=1e-3)
        assert core.each("worn_volume") == pytest.approx(
            core.each("shaped_volume") + core.each("waiting_volume"), rel=1e-9
        )


def test_a_law_as_a_callback_equals_the_built_in_one():
    @ffi.callback("int(void *, const hs_loaded *, double *)")
    def strength(_user, loaded, friction):
        load, radius = (
            np.frombuffer(ffi.buffer(part, 8 * loaded.count)) for part in (loaded.normal_load, loaded.summit_radius)
        )
        target = np.frombuffer(ffi.buffer(friction, 8 * loaded.count))
        target[:] = 0.05 * np.pi * np.cbrt(0.75 * load * radius) ** 2 / load
        return 0

    built_in = Evolving(1.0, 0.25, HEIGHT, RADIUS, **EVOLUTIONS["strength"])
    own = Evolving(1.0, 0.25, HEIGHT, RADIUS, law={"kind": "callers", "depends_on": "own", "function": strength})
    for target in TARGETS:
        assert built_in.go(*target) == own.go(*target) == 0
    assert own.dissipated == pytest.approx(built_in.dissipated, rel=1e-9)
    assert own.each("slid_distance") == pytest.approx(built_in.each("slid_distance"), rel=1e-9)


def test_a_law_that_fails_ends_the_step():
    @ffi.callback("int(void *, const hs_loaded *, double *)")
    def fails(_user, _loaded, _friction):
        return 1

    core = Evolving(1.0, 0.25, HEIGHT, RADIUS, law={"kind": "callers", "depends_on": "own", "function": fails})
    assert core.go(*TARGETS[0]) == 3


def test_a_load_beyond_the_limit_is_refused_or_held():
    for saturate in (False, True):
        core = Evolving(1.0, 0.25, HEIGHT, RADIUS, **EVOLUTIONS["strength"], saturate=saturate)
        core.go(("load", 0.01), ("load", 0.0))
        assert core.go(("load", 0.01), ("load", 1.0)) == (0 if saturate else 1)
        limit = core.totals[0].friction_limit if saturate else core.refusal.limit
        assert 0.001 < limit < 0.05
        if saturate:
            assert core.tangential_load == pytest.approx(limit, rel=1e-12)
            assert core.totals[0].saturated == 1


def test_other_summits_are_new_contacts():
    core = Evolving(1.0, 0.25, HEIGHT, RADIUS, **EVOLUTIONS["strength"])
    core.go(("displacement", 0.04), ("displacement", 0.01))
    height, radius, fresh = HEIGHT.copy(), RADIUS.copy(), np.array([True, False, True])
    height[0], radius[2] = -0.001, 1.2
    stored = lib.hs_stored_energy(core.memory)
    status = lib.hs_set_summits(
        core.memory, pointer(height), pointer(radius), ffi.from_buffer("uint8_t[]", fresh), core.evolution
    )
    assert status == 0
    assert core.each("summit_height").tolist() == height.tolist()
    assert core.memory.line.evolved.erased_memories == 2
    erased = core.memory.line.evolved.erased_energy
    assert 0 < erased < stored
    assert erased == pytest.approx(stored - lib.hs_stored_energy(core.memory), rel=1e-12)
    # what is fresh has the friction of its load, and no tractions
    core.go(("displacement", 0.04), ("displacement", 0.01))
    load = 4 / 3 * np.sqrt(radius) * (0.04 + height) ** 1.5
    assert core.rows["friction"][0] == pytest.approx(
        0.05 * np.pi * np.cbrt(0.75 * load * radius) ** 2 / load, rel=1e-12
    )
