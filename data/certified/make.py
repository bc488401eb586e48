"""Generate the certified load histories: CSV, YAML and the hash file.

    python make.py [CASE …]     # all cases by default; the plane ones take a minute each
    python make.py --cells CASE …     # compare plane cases with square cells on a half-space

Needs numpy, scipy, and two oracles of `tests/support`: rows of springs, which confirm the cases
along one line, and square cells on a half-space. Nothing of historysim is imported.
"""

import copy
import hashlib
import math
import sys
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
from plane_references import Annuli, Rings
from references import Profile
from scipy.optimize import brentq

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parents[1] / "tests" / "support"))

from planar_half_space import PlanarHalfSpace  # noqa: E402 - of the folder added above
from springs import Contact, SpringRow  # noqa: E402

VERSION = "histories-1.1"
SPRINGS = 2000  # of the second method along a line, on each half of an asperity
LEVELS = (1, 2, 4)  # of the annuli and their steps, which are extrapolated


# two methods may err in common: bounds are at least so large, by the first letter of the column
LEAST_BOUND = {"T": 1e-7}
LEAST_PLANE_BOUND = {"T": 1e-4, "E": 2e-4}


class Resolution(NamedTuple):
    """Annuli and rings at the first level, and steps of a leg."""

    annuli: int
    rings: int
    steps: int


class Case(NamedTuple):
    """One load history: path (row, controls) in SI, and the contact that follows it."""

    title: str
    # columns that are given: d and u, N and T, or d, ux and uy; and mu where friction changes
    control: tuple[str, ...]
    path: np.ndarray
    contact_modulus: float = 44e9
    shear_modulus: float = 13.75e9
    friction: float | tuple[float, ...] = 0.2  # of all asperities, or of each
    height: tuple[float, ...] = (0.0,)
    radius: tuple[float, ...] = (2.5e-3,)
    time: tuple[float, ...] = ()
    dimensionless: bool = False
    poisson_ratio: float = 0.0  # of both bodies
    # in the plane; annuli are best so that the approaches of the path divide them evenly
    resolution: Resolution = Resolution(32, 120, 8)
    saturate: bool = False  # requests of loads beyond the limit: rows of `saturated_moves`
    notes: tuple[tuple[str, object], ...] = ()  # more lines of the description

    @property
    def plane(self):
        return len(self.control) > 2 and self.control[2] in {"uy", "Ty", "Ry"}

    @property
    def loads(self):
        return self.control[0] == "N"

    @property
    def slip(self):
        """θ μ: full slip over approach."""
        return self.contact_modulus / (4 * self.shear_modulus) * max(np.atleast_1d(self.friction))

    @property
    def lag(self):
        """Depths of the summits below the highest."""
        return max(self.height) - np.array(self.height)

    def loads_at(self, d):
        """Hertz load of each asperity."""
        root = np.sqrt(self.radius)
        return 4 / 3 * self.contact_modulus * root * np.maximum(d - self.lag, 0.0) ** 1.5

    def load(self, d):
        return float(self.loads_at(d).sum())

    def largest_approach(self):
        largest = float(self.path[:, 0].max())
        return self.approach(largest) if self.loads else largest

    def approach(self, load):
        """Approach at a total load."""
        single = (0.75 * load / self.contact_modulus / math.sqrt(self.radius[0])) ** (2 / 3)
        if len(self.height) == 1:
            return single
        top = single + max(self.lag)
        return float(brentq(lambda d: self.load(d) - load, 0, top, xtol=1e-16 * top, rtol=1e-15))

    def units(self):
        """Units of errors: the largest N and d of the case, μN, full slip, and their product."""
        d = self.largest_approach()
        load = self.load(d)
        limit = float(self.loads_at(d) @ np.broadcast_to(self.friction, len(self.height)))
        values = {"d": d, "N": load, "T": limit, "u": self.slip * d}
        return values | {"E": values["T"] * values["u"]}


class Derived(NamedTuple):
    """Answers along the path of another case: rows of inputs, such as instants and radii."""

    title: str
    path_of: str
    control: tuple[str, ...]
    expected: tuple[str, ...]
    rows: np.ndarray | None = None  # None: the method gives them


# -- contacts and paths ----------------------------------------------------------------------------

D0 = 200e-9  # largest approach of the ball [m]
FULL = 0.16 * D0  # full slip of the ball at D0 [m], with θ = 0.8: all controls have few digits
# two bodies of E = 80 GPa and ν = 0: θ = 1
PLANE = {"contact_modulus": 40e9, "shear_modulus": 10e9}
STEPS = 2000  # of the integration of an impact


def ball(rows):
    """Rows of d over D0 and u over full slip there, in SI."""
    return np.array(rows, dtype=float) * (D0, FULL)


def plane(rows):
    """Rows of d, ux, uy in the same units, for θ = 1."""
    return np.array(rows, dtype=float) * (D0, 0.2 * D0, 0.2 * D0)


def eleven_paths():
    """Paths of Mindlin and Deresiewicz (1953): N and T [N]; each begins with an untouched contact."""
    start = {"virgin": (0.5,), "unloading": (0.6, 0.5), "reloading": (0.6, -0.3, -0.1)}
    ends = [
        ("virgin", 1.0, 0.75), ("unloading", 1.0, -0.2), ("reloading", 1.0, 0.3), ("virgin", 1.2, 0.8),
        ("virgin", 1.5, 0.6), ("unloading", 1.1, 0.0), ("unloading", 1.4, 0.4), ("reloading", 1.1, 0.3),
        ("virgin", 0.8, 0.7), ("unloading", 0.8, 0.0), ("reloading", 0.8, 0.2),
    ]  # fmt: skip
    rows, times = [], []
    for kind, normal, tangential in ends:
        loads = [(1.0, 0.0), *((1.0, t) for t in start[kind]), (normal, tangential)]
        rows += loads
        times += range(len(loads))
    return np.array(rows) * (50e-3, 10e-3), tuple(map(float, times))


def circle(amplitude, chords, turns):
    """Ramp along x, then counter-clockwise on chords of a circle, at constant approach."""
    angle = 2 * np.pi / chords * np.arange(int(chords * turns) + 1)
    points = amplitude * np.column_stack([np.cos(angle), np.sin(angle)]).round(6)
    return plane([(1, 0, 0), *((1, x, y) for x, y in points)])


def spiral(chords=16, turns=2):
    """From the origin outwards to full slip."""
    share = np.arange(chords * turns + 1) / (chords * turns)
    angle = 2 * np.pi * turns * share
    return plane(
        np.column_stack([np.ones_like(share), *(share * (np.cos(angle), np.sin(angle))).round(6)])
    )


def random_points(seed, count, approaches):
    """Way points within 0.9 of full slip, and approaches between two values."""
    rng = np.random.default_rng(seed)
    size, angle = 0.9 * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(0, 2 * np.pi, count)
    d = rng.uniform(*approaches, count + 1)
    points = np.column_stack([size * np.cos(angle), size * np.sin(angle)])
    return plane(np.column_stack([d, np.vstack([(0, 0), points])]).round(3))


def impact(contact_modulus, shear_modulus, friction, radius, mass, speed, angle, rows=24):
    """Path of an elastic sphere that hits a plane under an angle to the normal; times, and d and u to five digits.

    Leap-frog integration with 400 springs. The digits of the file define the path, whose answer is
    exact for them.
    """
    theta = contact_modulus / (4 * shear_modulus)
    speed_normal = speed * math.cos(angle)
    deepest = (15 * mass * speed_normal**2 / (16 * contact_modulus * math.sqrt(radius))) ** 0.4
    duration = 2.9432 * deepest / speed_normal
    x = math.sqrt(radius * deepest) * (np.arange(400) + 0.5) / 400
    weight = 8 * shear_modulus * 2 * x[0]
    normal, surface = speed_normal, speed * math.sin(angle)
    d = u = 0.0
    stretch, pause, path, step = np.zeros(400), duration / STEPS, [], 0
    while d >= 0:
        if step % (STEPS // rows) == 0 and step:
            path.append((step * pause, d, u))
        load = 4 / 3 * contact_modulus * math.sqrt(radius) * d**1.5
        normal -= pause * load / mass
        # a solid sphere turns: 1 + m R²/I = 7/2
        surface -= 3.5 * pause * weight * stretch.sum() / mass
        d, u = d + pause * normal, u + pause * surface
        limit = theta * friction * np.maximum(d - x**2 / radius, 0.0)
        stretch = np.clip(stretch + pause * surface, -limit, limit)
        step += 1
    path.append((step * pause, -0.01 * deepest, u))
    # the first row, at first touch, has neither load nor displacement
    times, ds, us = np.array([(0.0, 0.0, 0.0), *path]).T
    scale_d, scale_u = (
        10.0 ** (math.floor(math.log10(np.abs(values).max())) - 4) for values in (ds, us)
    )
    rounded = np.column_stack([(ds / scale_d).round() * scale_d, (us / scale_u).round() * scale_u])
    return {"path": rounded, "time": tuple(float(f"{time:.6g}") for time in times)}


def ball_impact(speed, degrees):
    """Impact of a ball of steel's density and the radius of the other cases."""
    modulus, shear, radius = 44e9, 13.75e9, 2.5e-3
    mass = 4 / 3 * math.pi * radius**3 * 7800
    return impact(modulus, shear, 0.2, radius, mass, speed, math.radians(degrees))


def measured_impact():
    """Aluminium oxide on thick glass, taken as a plane a thousand times as stiff (test 4 of Chung and Ooi, 2011)."""
    young, poisson, radius = 380e9, 0.23, 2.5e-3
    modulus = 1 / ((1 - poisson**2) / young * (1 + 1e-3))
    shear = 1 / ((2 - poisson) * 2 * (1 + poisson) / young * (1 + 1e-3))
    modulus, shear = float(f"{modulus:.6g}"), float(f"{shear:.6g}")
    mass, speed, angle = 4 / 3 * math.pi * radius**3 * 4000, 3.9, 20.2
    made = impact(modulus, shear, 0.092, radius, mass, speed, math.radians(angle), rows=40)
    notes = (
        ("sphere_mass", float(f"{mass:.6g}")), ("speed", speed), ("angle_to_normal_degrees", angle),
        ("measured_tangential_restitution", 0.599), ("measured_reading_error", 0.05),
        ("measured_normal_restitution", 0.98),
        ("measured_source", "Kharaz et al., Powder Technol. 120 (2001) 281, read from Granular Matter 13 (2011) 643"),
        ("measured_equation", "tangential restitution = 1 - ∫T dt/(mass speed sin angle)"),
    )  # fmt: skip
    return {
        **made,
        "contact_modulus": modulus,
        "shear_modulus": shear,
        "friction": 0.092,
        "notes": notes,
    }


def rough(seed, count, scatter, radii):
    """Summit heights and radii of drawn asperities [m], to 0.01 nm and 1 nm."""
    rng = np.random.default_rng(seed)
    height = rng.normal(0.0, scatter, count).round(11)
    radius = rng.uniform(*radii, count).round(9)
    order = np.argsort(-height)
    return {"height": tuple(map(float, height[order])), "radius": tuple(map(float, radius[order]))}


def rough_path(depth, full):
    """Nested loops while the approach rises and falls; commensurate with the units of depth and full slip."""
    rows = [
        (0.5, 0), (1, 0.4), (1, -0.4), (0.75, 0), (1, 0.2), (0.5, 0.2), (0.5, -0.3), (1, -0.3), (1, 0.9), (1, 1.2),
        (0.7, 0.6), (0.2, 0.5), (0.9, 0.1), (0.9, 0.5), (0.9, 0.1),
    ]  # fmt: skip
    return np.array(rows) * (depth, full)


def friction_falls():
    """Approach, displacement and friction: virgin slip, a fall at rest, a loop, sliding, a fall, a loop."""
    rows = [
        (1, 0, 0.2), (1, 0.6, 0.2), (1, 0.6, 0.12), (1, 0.7, 0.12), (1, 0.2, 0.12), (1, 0.7, 0.12), (1, 1.5, 0.12),
        (1, 1.5, 0.08), (1, 1.2, 0.08), (1, 1.6, 0.08), (0.6, 1.6, 0.08), (1, 1.8, 0.08),
    ]  # fmt: skip
    return np.array(rows) * (D0, FULL, 1.0)


def build_cases():
    """All cases by name, the path of each in SI."""
    du, loads, duu = ("d", "u"), ("N", "T"), ("d", "ux", "uy")
    eleven, times = eleven_paths()
    random_12 = plane([
        (0.6, 0, 0), (0.9, 0.35, 0.2), (0.5, -0.1, 0.45), (0.8, -0.5, 0.1), (0.4, -0.2, -0.3), (1, 0.3, -0.4),
        (0.7, 0.5, 0.2), (0.85, 0.1, 0.1),
    ])  # fmt: skip
    nested = [0, 20, -10, 12, -4, 6, 0, 6, -4, 12, -10, 20, 40, 20, 35, 20, 40, -40, 0]
    nested_n = [
        (0.4, 0), (1, 0.3), (0.7, -0.2), (0.9, 0.25), (0.6, 0.05), (0.85, 0.15), (0.5, 0.1), (1, 0.6), (0.5, 0.1),
        (1, 0.6), (0.4, 0.6), (1, 0.6), (1, -1), (0.7, -0.4), (0.7, -1),
    ]  # fmt: skip
    inside = [
        (50, 0),
        (20, 0),
        (50, 6),
        (30, 3),
        (60, 6),
        (20, 3),
        (50, -2),
        (25, -2),
        (40, 0),
        (40, 2),
    ]
    outside = [
        (20, 0),
        (30, 5),
        (25, -3),
        (40, 6),
        (30, -4),
        (20, 3),
        (50, 9.5),
        (45, -8),
        (45, 8),
        (50, 9),
    ]
    lift = [
        (0.5, 0), (1, 0.6), (0.4, 0.5), (-0.2, 0.3), (0.3, 0.55), (0.9, 0.2), (-0.1, -0.4), (-0.3, 0.5), (0.6, 0.1),
        (0, 0.1), (0.6, 0.1), (0.6, 0.4), (-0.6, 0.4), (0.6, 1.2),
    ]  # fmt: skip
    slide = [
        (1, 0), (1, 1.5), (0.5, 1.5), (0.2, 1.2), (0.8, 1.2), (0.6, 2.4), (0.9, 2.3), (0.9, 3.5), (0.3, 2.9), (0, 2.6),
        (1, 2.6),
    ]  # fmt: skip
    limit = [0, 0.999, -0.999, 0.999, 0, 0.5, -0.999, 0.999, -0.5, 0]
    equal = {"height": (0.0,) * 12, "radius": (10e-6,) * 12}
    many = rough(15, 200, 20e-9, (5e-6, 15e-6))
    own = [(20, 0), (40, 4), (30, -2), (60, 8), (40, 2), (50, 5), (30, 2), (60, -6), (60, 9)]
    corner = plane([(1, 0, 0), (1, 0.6, 0), (1, 0.6, 0.3), (1, 0.6, 0.6), (1, 0.6, 0)])
    cases = {
        "01_mindlin_deresiewicz": Case(
            "The eleven paths of Mindlin and Deresiewicz", loads, eleven, time=times
        ),
        "02_nested_reversals": Case(
            "Nested reversals and wipe-out at constant N",
            du,
            np.array([(D0, 1e-9 * u) for u in nested]),
        ),
        "03_nested_varying_load": Case(
            "Nested loops with N varying, commensurate numbers",
            du,
            np.array(nested_n, dtype=float),
            0.75,
            0.1875,
            1.0,
            radius=(1.0,),
            dimensionless=True,
        ),
        "04_inside_the_cone": Case(
            "N rises and falls, |dT/dN| < μ; withdrawal at T = 0", loads, 1e-3 * np.array(inside)
        ),
        "05_outside_the_cone": Case(
            "N rises and falls, |dT/dN| > μ", loads, 1e-3 * np.array(outside)
        ),
        "06_lift_off": Case("Lift-off and new touch", du, ball(lift)),
        "07_withdrawal_characteristic": Case(
            "Sliding, then withdrawal with du = θμ dd: no dissipation", du, ball(slide)
        ),
        "08_close_to_sliding": Case(
            "Loads of ±0.999 μN", loads, np.array([(50e-3, 10e-3 * t) for t in limit])
        ),
        "09_friction_falls": Case("Friction falls at rest", ("d", "u", "mu"), friction_falls()),
        "10_grazing_impact": Case("Grazing impact: 75° to the normal", du, **ball_impact(0.5, 75)),
        "11_steep_impact": Case("Steep impact: 10° to the normal", du, **ball_impact(0.5, 10)),
        "12_measured_impact": Case(
            "Oblique impact of aluminium oxide on glass, 20.2°, as measured",
            du,
            **measured_impact(),
        ),
        "13_twelve_equal": Case("Twelve equal asperities", du, rough_path(20e-9, 3.4e-9), **equal),
        "14_twelve_unequal": Case(
            "Twelve unequal asperities",
            du,
            rough_path(30e-9, 5e-9),
            **rough(14, 12, 10e-9, (4e-6, 20e-6)),
        ),
        "15_gaussian_ensemble": Case(
            "Two hundred asperities of Gaussian heights", du, rough_path(40e-9, 6e-9), **many
        ),
        "16_corner": Case("L: along x, then along y", duu, corner, **PLANE),
        "17_square": Case(
            "Square",
            duu,
            plane([(1, 0, 0), (1, 0.5, 0), (1, 0.5, 0.5), (1, 0, 0.5), (1, 0, 0), (1, 0.5, 0)]),
            **PLANE,
        ),
        "18_circle_03": Case(
            "Circle of 0.3 of full slip",
            duu,
            circle(0.3, 16, 1.125),
            **PLANE,
            resolution=Resolution(32, 120, 4),
        ),
        "19_circle_07": Case(
            "Circle of 0.7 of full slip",
            duu,
            circle(0.7, 24, 1),
            **PLANE,
            resolution=Resolution(20, 120, 8),
        ),
        "20_spiral": Case(
            "Spiral out to full slip", duu, spiral(), **PLANE, resolution=Resolution(20, 120, 8)
        ),
        "21_square_varying_load": Case(
            "Square with N varying",
            duu,
            plane(
                [(0.7, 0, 0), (1, 0.5, 0), (0.6, 0.5, 0.5), (0.9, 0, 0.5), (0.5, 0, 0), (1, 0.5, 0)]
            ),
            **PLANE,
        ),
        "22_random_constant_load": Case(
            "Random way points at constant N", duu, random_points(22, 8, (1.0, 1.0)), **PLANE
        ),
        "23_random_varying_load": Case(
            "Random way points with N varying",
            duu,
            random_12,
            **PLANE,
            resolution=Resolution(40, 120, 8),
        ),
        **new_plane_cases(),
        "33_own_friction": Case(
            "Both loads controlled, each asperity with a friction coefficient of its own",
            loads,
            1e-3 * np.array(own),
            height=(0.0, -5e-9, -1.2e-8, -2e-8),
            radius=(1e-5, 1.5e-5, 8e-6, 2e-5),
            friction=(0.15, 0.3, 0.45, 0.2),
        ),
        "34_steady_cycles": Case(
            "Steady cycles of d and u with inner loops", du, ball(steady_cycles())
        ),
        "35_cycle_energies": Derived(
            "Closed loops of the steady cycles: moment of closing and energy",
            "34_steady_cycles",
            ("t",),
            ("closed", "E"),
        ),
        "36_tractions": Derived(
            "Traction profiles along a line",
            "03_nested_varying_load",
            ("t", "r"),
            ("q",),
            profile_rows((2, 4, 6, 9, 14), (0.0, 0.15, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9), 1.0),
        ),
        "37_stick_radii": Derived(
            "Stick radii along a line",
            "03_nested_varying_load",
            ("t",),
            ("c",),
            # at 7 and 9 all springs touch along the slip limit: neither stick nor slip
            np.array([1.0, 2, 3, 4, 5, 6, 8, 10, 11, 12, 13, 14])[:, None],
        ),
        "38_plane_tractions": Derived(
            "Traction profiles in the plane",
            "21_square_varying_load",
            ("t", "r"),
            ("qx", "qy"),
            profile_rows(
                (2, 3, 5), (0.2, 0.3, 0.35, 0.45, 0.55, 0.6, 0.65, 0.85), math.sqrt(2.5e-3 * D0)
            ),
        ),
    }
    return dict(sorted(cases.items()))


def new_plane_cases():
    """Cases in the plane since version 1.1."""
    duu = ("d", "ux", "uy")
    largest = float(f"{4 / 3 * 40e9 * math.sqrt(2.5e-3) * D0**1.5:.6g}")
    unit = np.array([largest, 0.2 * largest, 0.2 * largest])
    # approaches 1, 0.64, 0.36, 0.81
    both = [
        (0.512, 0, 0), (1, 0.5, 0), (1, 0.5, 0.6), (0.729, -0.2, 0.5),
        (1, -0.6, -0.2), (0.512, 0.1, -0.4), (1, 0.7, 0.3),
    ]  # fmt: skip
    normal = [
        (0.512, 0, 0), (1, 0.5, 0), (0.729, 0.3, 0.5),
        (1, -0.4, 0.2), (0.216, -0.4, -0.1), (1, 0.2, -0.6),
    ]  # fmt: skip
    tangential = [
        (1, 0, 0), (1, 0.6, 0), (0.8, 0.1, 0.6),
        (1, -0.5, 0.3), (0.6, -0.2, -0.3), (1, 0.3, -0.7),
    ]  # fmt: skip
    lift = [
        (1, 0, 0), (1, 0.5, 0.2), (0.4, 0.3, 0.5), (-0.2, 0.1, 0.6), (0.5, -0.3, 0.4), (1, -0.3, -0.4),
        (0.6, 0.2, -0.2),
        (-0.1, 0.5, 0.5), (-0.3, 0, 0), (0.7, 0.4, -0.3), (0.7, 0.4, 0.3),
    ]  # fmt: skip
    falls = [
        (1, 0, 0, 0.2), (1, 0.5, 0, 0.2), (1, 0.5, 0.5, 0.2), (1, 0.2, 0.5, 0.2), (1, 0.2, 0.5, 0.12),
        (1, -0.1, 0.2, 0.12), (1, -0.1, 0.5, 0.12), (1, -0.1, 0.5, 0.06), (1, 0.2, 0.5, 0.06),
    ]  # fmt: skip
    many = [
        (0.5, 0, 0), (1, 0.4, 0), (1, 0.4, 0.4), (0.6, 0.1, 0.5),
        (1, -0.3, 0.1), (1, -0.2, -0.6), (0.4, 0.1, -0.2),
    ]  # fmt: skip
    poisson = [(0.7, 0, 0), (1, 0.5, 0), (0.6, 0.5, 0.5), (0.9, 0, 0.5), (0.5, 0, 0), (1, 0.5, 0)]
    dither = [(1, 0, 0), (1, 1.5, 0)] + [(1, 1.5, y) for y in (0.3, -0.3) * 4] + [(1, 1.8, 0)]
    theta = 1.7 / 1.4  # E*/4G* of equal bodies of ν = 0.3
    return {
        "24_dither": Case(
            "Dither across a contact that has slid", duu, plane(dither), **PLANE, resolution=Resolution(20, 120, 16)
        ),
        "25_plane_both_loads": Case(
            "Both loads controlled in the plane", ("N", "Tx", "Ty"), np.array(both) * unit, **PLANE,
            resolution=Resolution(28, 320, 8),
        ),
        "26_plane_normal_load": Case(
            "Mixed control: N and u", ("N", "ux", "uy"), np.array(normal) * (largest, 0.2 * D0, 0.2 * D0), **PLANE,
            resolution=Resolution(28, 200, 8),
        ),
        "27_plane_tangential_load": Case(
            "Mixed control: d and T", ("d", "Tx", "Ty"), np.array(tangential) * (D0, *unit[1:]), **PLANE,
            resolution=Resolution(28, 200, 8),
        ),
        "28_plane_lift_off": Case(
            "Lift-off and new touch in the plane", duu, plane(lift), **PLANE, resolution=Resolution(40, 320, 8)
        ),
        "29_plane_saturation": Case(
            "A request beyond the limit while N falls, then turns", ("N", "Rx", "Ry"),
            np.array(SATURATION) * unit, **PLANE, saturate=True,
            resolution=Resolution(28, 200, 12),
        ),
        "30_plane_friction_falls": Case(
            "Friction falls at rest after turns", (*duu, "mu"),
            np.array(falls) * (D0, 0.2 * D0, 0.2 * D0, 1.0), **PLANE,
        ),
        "31_plane_ensemble": Case(
            "Twenty asperities in the plane", duu, np.array(many) * (4e-8, 8e-9, 8e-9), **PLANE,
            **rough(31, 20, 1e-8, (5e-6, 15e-6)), resolution=Resolution(16, 60, 6),
        ),
        "32_poisson_03": Case(
            "Square with N varying, ν = 0.3", duu, np.array(poisson) * (D0, 0.24 * D0, 0.24 * D0),
            40e9, float(f"{40e9 / 4 / theta:.9g}"), poisson_ratio=0.3,
        ),
    }  # fmt: skip


# rows of N and T over their units: the direction (0.8, 0.6), then turns
SATURATION = (
    (1, 0, 0), (1, 0.64, 0.48), (0.512, 0.64, 0.48), (0.9, 0.64, 0.48), (0.9, -0.4, -0.3), (0.9, -0.3, 0.4),
    (0.729, -0.3, 0.4), (1, 0.5, 0.3),
)  # fmt: skip


def steady_cycles():
    """Three blocks of an outer loop with two inner ones, one in the other; slightly wider each time."""
    rows = [(1, 0), (1, 0.5)]
    for wider in (0, 0.01, 0.02):
        rows += [
            (0.8, 0.1),
            (0.9, 0.3),
            (0.6, -0.4 - wider),
            (0.75, -0.1),
            (0.7, -0.3),
            (0.75, -0.2),
            (1, 0.51 + wider),
        ]
    return rows


def profile_rows(times, shares, edge):
    """Instants and radii of profiles, the radii with four digits."""
    return np.array([(time, float(f"{share * edge:.4g}")) for time in times for share in shares])


# -- answers ---------------------------------------------------------------------------------------


def solve_line(case):
    """Columns by the closed form; the path restarts wherever time is 0."""
    rows, profile = [], None
    lag = [max(case.height) - each for each in case.height]
    for time, controls in zip(case.time or range(len(case.path)), case.path, strict=True):
        if time == 0:
            profile = Profile(
                case.contact_modulus, case.shear_modulus, lag, case.radius, case.friction
            )
        _move_profile(profile, case, [float(f"{each:.12g}") for each in controls], first=time == 0)
        d, u, mu = profile.d, profile.u, profile.friction
        row = {
            "d": d,
            "u": u,
            "N": profile.normal_load,
            "T": profile.tangential_load,
            "E": profile.dissipated,
        }
        rows.append(row | {"mu": mu})
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def _move_profile(profile, case, controls, *, first):
    if case.loads:
        profile.to_loads(*controls)
    elif first:
        # first touch by the approach alone
        profile.to(controls[0], 0.0)
    else:
        if len(controls) == 3 and controls[2] != float(profile.friction):
            profile.change_friction(controls[2])
        profile.to(*controls[:2])


def check_line(case):
    """The same columns by rows of springs."""
    rows, springs = [], None
    contact = Contact.build(
        case.contact_modulus, case.shear_modulus, case.height, case.radius, case.friction
    )
    for time, controls in zip(case.time or range(len(case.path)), case.path, strict=True):
        if time == 0:
            springs = SpringRow(contact, case.largest_approach() * (1 + 1e-9), SPRINGS)
        kinds = "load" if case.loads else "displacement"
        if len(controls) == 3 and controls[2] != springs.contact.friction[0]:
            springs.friction_change(controls[2])
        if time == 0 and not case.loads and controls[0] <= 0:
            rows.append((0.0, 0.0, 0.0, 0.0, 0.0))
            continue
        springs.apply((kinds, controls[0]), (kinds, controls[1]), substeps=400)
        rows.append((
            springs.approach, springs.tangential_displacement, springs.total_normal_load, springs.total_tangential_load,
            springs.dissipated_energy.sum(),
        ))  # fmt: skip
    return dict(zip(("d", "u", "N", "T", "E"), np.array(rows).T, strict=True))


def plane_moves(case):
    """Moves of every row over the units of a case: kind, approach, two values, friction."""
    if case.saturate:
        return saturated_moves()
    unit = case.units()
    columns = dict(zip(case.control, case.path.T, strict=True))
    depth = columns["d"] / unit["d"] if "d" in columns else (columns["N"] / unit["N"]) ** (2 / 3)
    friction = columns.get("mu", np.full(len(case.path), case.friction)) / case.friction
    if "ux" in columns:
        kind, values = "u", np.column_stack([columns["ux"], columns["uy"]]) / unit["u"]
    else:
        kind = "loads" if "N" in columns else "T"
        values = np.column_stack([columns["Tx"], columns["Ty"]]) / unit["T"]
    rows = [[(kind, *row)] for row in zip(depth, values, friction, strict=True)]
    rows[0] = [("u", depth[0], np.zeros(2), 1.0)]
    return rows


def saturated_moves():
    """Moves of case 29, cut where the request crosses the limit.

    While it is beyond, the contact slides: u rests while N falls, and follows d while N rises.
    """
    unit = np.array([0.8, 0.6])
    lowest, limit = 0.64, 0.8 ** (2 / 3)  # approaches at N = 0.512 and 0.8
    slid = limit * unit
    followed = slid + (limit - lowest) * unit

    def loads(row):
        normal, *tangential = SATURATION[row]
        return ("loads", normal ** (2 / 3), np.array(tangential), 1.0)

    near = ("loads", 0.81 ** (2 / 3), 0.8 * unit, 1.0)
    return [
        [("u", 1.0, np.zeros(2), 1.0)], [loads(1)], [near, ("u", limit, slid, 1.0), ("u", lowest, slid, 1.0)],
        [("u", limit, followed, 1.0), loads(3)], *([loads(row)] for row in range(4, len(SATURATION))),
    ]  # fmt: skip


def follow(reference, moves, steps):
    """Rows of d, u, T and E over the units; and what `reference` reports on the way."""
    rows = []
    for number, row in enumerate(moves):
        for kind, depth, values, friction in row:
            parts = steps if number else 1
            if kind == "u":
                reference.to(depth, values, parts, friction)
            elif kind == "loads":
                reference.to_loads(depth, 4 / 3 * values, parts)
            else:
                reference.to_loads(depth, 4 / 3 * values, parts, power=1)
        rows.append((
            reference.d, *reference.u, *(0.75 * reference.tangential_load), 0.75 * reference.dissipated,
        ))  # fmt: skip
    return np.array(rows)


def annuli_at(resolution, depths, level):
    """Annuli of a level: they refine with the steps where the edge of contact moves."""
    if np.ptp(depths) > 0:
        return Annuli(resolution.annuli, depths, level)
    return Annuli(resolution.annuli * LEVELS[-1], depths)


def by_annuli(case, moves):
    """Rows by annuli: implicit Euler in three levels, extrapolated."""
    resolution = case.resolution
    depths = [depth for row in moves for _, depth, _, _ in row]
    first, second, third = (
        follow(annuli_at(resolution, depths, level), moves, level * resolution.steps)
        for level in LEVELS
    )
    return 8 / 3 * third - 2 * second + first / 3


def by_rings(case, moves):
    """Rows by rings: SDIRK2 in two numbers of steps, extrapolated."""
    resolution = case.resolution
    first, second = (
        follow(Rings(resolution.rings), moves, level * resolution.steps) for level in (1, 2)
    )
    return (4 * second - first) / 3


def by_cells(case, moves, count, steps=6):
    """Rows by square cells with the kernel of Cerruti, SDIRK2; paths of d and u."""
    cells, rows, before = PlanarHalfSpace(count, case.poisson_ratio), [], None
    for ((_, depth, values, _),) in moves:
        after = np.array([depth, *values])
        parts = steps if before is not None else 1
        before = after if before is None else before
        for part in np.arange(1, parts + 1) / parts:
            at = before + part * (after - before)
            cells.to(at[1:], at[0])
        rows.append((*after, *(0.75 * cells.tangential_load), 0.75 * cells.dissipated))
        before = after
    return np.array(rows)


def poisson_effect(case, moves, count):
    """Difference that Poisson's ratio makes, by cells of one size."""
    return by_cells(case, moves, count) - by_cells(case._replace(poisson_ratio=0.0), moves, count)


def solve_plane(case, method=by_annuli, cells=40):
    """Columns of all quantities in SI; asperities of an ensemble one after the other."""
    unit, moves = case.units(), plane_moves(case)
    total, depth = 0.0, case.largest_approach()
    loads = case.loads_at(depth)
    for lag, load in zip(case.lag, loads / loads.sum(), strict=True):
        share = 1 - lag / depth  # largest approach of the asperity
        if share <= 0:
            continue
        own = [
            [(kind, (d - lag / depth) / share, values / share, mu) for kind, d, values, mu in row]
            for row in moves
        ]
        rows = method(case, own)
        total = total + rows[:, 3:] * (load, load, load * share)
    d, ux, uy = rows[:, :3].T
    if case.poisson_ratio:
        total = total + poisson_effect(case, moves, cells)[:, 3:]
    columns = {
        "d": d * unit["d"], "ux": ux * unit["u"], "uy": uy * unit["u"],
        "Tx": total[:, 0] * unit["T"], "Ty": total[:, 1] * unit["T"], "E": total[:, 2] * unit["E"],
    }  # fmt: skip
    columns |= dict(zip(case.control, case.path.T, strict=True))
    if "N" not in columns:
        columns["N"] = np.array([case.load(each) for each in columns["d"]])
    return columns


def check_plane(case):
    """The same columns by the second method."""
    return solve_plane(case, by_rings, cells=28)


def compare_cells(name, case, count=40, steps=12):
    """Print the difference between the file of a case and square cells, of the units."""
    found = solve_plane(
        case._replace(poisson_ratio=0.0), lambda case, moves: by_cells(case, moves, count, steps)
    )
    answer = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", names=True)
    load = max(np.abs(found[key] - answer[key]).max() for key in ("Tx", "Ty"))
    energy = np.abs(found["E"] - answer["E"]).max()
    print(f"{name},{load / case.units()['T']:.1e},{energy / case.units()['E']:.1e}", flush=True)


# -- several coefficients: chords -----------------------------------------------------------------


class Groups:
    """Asperities with coefficients of their own, as one `Profile` each; ramps of both loads in chords."""

    def __init__(self, case):
        self.case = case
        # the lag of an asperity is that below the highest of all, since the approach is common
        self.profiles = [
            Profile(case.contact_modulus, case.shear_modulus, [lag], [radius], friction)
            for lag, radius, friction in zip(case.lag, case.radius, case.friction, strict=True)
        ]
        self.d = self.u = self.load = self.tangential = 0.0

    def _tangential(self, d, u):
        total = Decimal(0)
        for profile in self.profiles:
            total += profile.load_of(profile.vertices_at(Decimal(d), Decimal(u)))
        return float(total)

    def to(self, load, tangential, chords):
        start = self.load, self.tangential
        for share in np.arange(1, chords + 1) / chords:
            d = self.case.approach(start[0] + share * (load - start[0]))
            target = start[1] + share * (tangential - start[1])
            reach = self.case.slip * 2 * max(d, self.d)
            u = self.u
            if target or self.tangential:
                u = brentq(
                    lambda u, d=d, target=target: self._tangential(d, u) - target,
                    self.u - reach, self.u + reach, xtol=1e-15 * reach, rtol=1e-14,
                )  # fmt: skip
            for profile in self.profiles:
                profile.to(d, u)
            self.d, self.u = d, u
        self.load, self.tangential = load, tangential

    @property
    def dissipated(self):
        return float(sum(profile.dissipated for profile in self.profiles))


def solve_groups(case):
    """Columns of a case with several coefficients: chords in two numbers, extrapolated."""
    runs = []
    for chords in (8, 16):
        groups, rows = Groups(case), []
        for number, (load, tangential) in enumerate(case.path):
            groups.to(load, tangential, chords if number else 1)
            rows.append((groups.d, groups.u, groups.dissipated))
        runs.append(np.array(rows))
    d, u, energy = ((4 * runs[1] - runs[0]) / 3).T
    return {"d": d, "u": u, "N": case.path[:, 0], "T": case.path[:, 1], "E": energy}


# -- answers along the path of another case --------------------------------------------------------


def solve_derived(case):
    """Columns of a derived case by the closed form, or by annuli in the plane."""
    base = build_cases()[case.path_of]
    if base.plane:
        return plane_tractions(case, base, by_levels=True)
    profile = Profile(base.contact_modulus, base.shear_modulus, [0.0], base.radius, base.friction)
    return METHODS[case.expected[-1]][0](case, base, profile)


def check_derived(case):
    """The same columns by springs, or by rings in the plane."""
    base = build_cases()[case.path_of]
    if base.plane:
        return plane_tractions(case, base, by_levels=False)
    contact = Contact.build(
        base.contact_modulus, base.shear_modulus, base.height, base.radius, base.friction
    )
    springs = SpringRow(contact, base.largest_approach() * (1 + 1e-9), SPRINGS)
    return METHODS[case.expected[-1]][1](case, base, springs)


def move_exactly(profile, base):
    """Follow the path of a case; yields after every row."""
    for number, row in enumerate(base.path):
        d, u = (float(f"{each:.12g}") for each in row)
        profile.to(d, u if number else 0.0)
        yield number


def move_springs(springs, base):
    for number, (d, u) in enumerate(base.path):
        springs.apply(("displacement", d), ("displacement", u))
        yield number


def tractions(case, base, profile):
    values = []
    for number in move_exactly(profile, base):
        radii = case.rows[case.rows[:, 0] == number, 1]
        values += [float(profile.traction(radius)) for radius in radii]
    return inputs_of(case) | {"q": np.array(values)}


def tractions_of_springs(case, base, springs):
    """Tractions by Abel's transformation of the forces of the springs, linear between them."""
    values = []
    x = springs.spacing[0] * (np.arange(SPRINGS) + 0.5)
    for number in move_springs(springs, base):
        force = 4 * base.shear_modulus * springs._deflection[0]
        slope = np.diff(force, append=0.0) / springs.spacing[0]
        ends = np.append(x, x[-1] + springs.spacing[0])
        for radius in case.rows[case.rows[:, 0] == number, 1]:
            area = np.arccosh(np.maximum(ends / max(radius, 1e-9 * x[0]), 1.0))
            values.append(-(slope * np.diff(area)).sum() / np.pi)
    return inputs_of(case) | {"q": np.array(values)}


def stick_radii(case, base, profile):
    rows = move_exactly(profile, base)
    found = [
        math.sqrt(base.radius[0] * float(profile.front_of(profile.vertices, profile.d)))
        for _ in rows
    ]
    return inputs_of(case) | {"c": np.array(found)[case.rows[:, 0].astype(int)]}


def stick_radii_of_springs(case, base, springs):
    found = [springs.stick_radius[0] for _ in move_springs(springs, base)]
    return inputs_of(case) | {"c": np.array(found)[case.rows[:, 0].astype(int)]}


def cycles(case, base, profile):  # noqa: ARG001 - the methods have one signature
    """Closed loops by the closed form: the slip front reaches the place where that of the excursion stopped."""
    path = base.path

    def on_leg(start, leg, share):
        end_d, end_u = (Decimal(float(f"{each:.12g}")) for each in path[leg])
        return start.d + share * (end_d - start.d), start.u + share * (end_u - start.u)

    def front(leg, share):
        d, u = on_leg(profile, leg, share)
        return profile.front_of(profile.vertices_at(d, u), d)

    def energy(leg, share):
        part = copy.copy(profile)
        part.to(*on_leg(part, leg, share))
        return part.dissipated

    def advance(leg):
        profile.to(*(float(f"{each:.12g}") for each in path[leg]))

    return find_loops(path, front, energy, advance, Decimal(1), Decimal("1e-25"))


def cycles_of_springs(case, base, springs):  # noqa: ARG001 - as above
    """Closed loops by springs, whose front is their stick radius."""
    path = base.path

    def at(leg, share):
        part = copy.deepcopy(springs)
        start = np.array([springs.approach, springs.tangential_displacement])
        d, u = start + share * (path[leg] - start)
        part.apply(("displacement", d), ("displacement", u))
        return part

    def front(leg, share):
        return at(leg, share).stick_radius[0] ** 2 / base.radius[0]

    def energy(leg, share):
        return at(leg, share).dissipated_energy.sum()

    def advance(leg):
        springs.apply(*(("displacement", each) for each in path[leg]))

    return find_loops(path, front, energy, advance, 1.0, 1e-12)


class Reversal:
    """Reversal of an open loop: row, energy there and in loops closed since, and where its front stopped."""

    def __init__(self, row, energy):
        self.row, self.energy, self.inner, self.stop = row, energy, 0, None


def find_loops(path, front, energy, advance, one, tolerance):
    """Rows of loops: the reversal that opened each, when it closed, and its energy.

    Legs turn the slip round at every row: |du| > θμ |dd|. The next reversal but one closes the loop
    when its front arrives where the front of the excursion stopped; both reversals are forgotten.
    """
    advance(0)
    stack, loops, signs = [], [], np.sign(np.diff(path[:, 1]))
    for leg in range(1, len(path)):
        if leg > 1 and signs[leg - 1] != signs[leg - 2]:
            stack.append(Reversal(leg - 1, energy(leg, 0 * one)))
        reached = front(leg, one)
        # a repeated cycle closes at its end: what arrives within rounding has arrived
        while len(stack) > 1 and stack[-2].stop >= reached - tolerance:
            low, high = 0 * one, one
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (
                    (low, middle) if front(leg, middle) <= stack[-2].stop else (middle, high)
                )
            turned, opened = stack.pop(), stack.pop()
            total = energy(leg, high) - opened.energy
            loops.append(
                (opened.row, leg - 1 + float(high), float(total - opened.inner - turned.inner))
            )
            if stack:
                stack[-1].inner += total
        advance(leg)
        if stack:
            stack[-1].stop = reached
    rows = sorted(loops)
    return dict(zip(("t", "closed", "E"), np.array(rows).T, strict=True))


def inputs_of(case):
    return dict(zip(case.control, case.rows.T, strict=True))


METHODS = {
    "q": (tractions, tractions_of_springs),
    "c": (stick_radii, stick_radii_of_springs),
    "E": (cycles, cycles_of_springs),
}


def plane_tractions(case, base, *, by_levels):
    """Tractions at instants and radii by annuli, or by rings."""
    moves, resolution = plane_moves(base), base.resolution
    depths = [depth for row in moves for _, depth, _, _ in row]
    unit = base.units()
    edge = math.sqrt(base.radius[0] * unit["d"])
    # T over the square of the edge of contact
    scale = 0.75 * unit["T"] / edge**2
    runs = []
    for level in LEVELS[1:] if by_levels else (1, 2):
        kind = annuli_at(resolution, depths, level) if by_levels else Rings(resolution.rings)
        rows = []
        for number, row in enumerate(moves):
            ((_, depth, values, friction),) = row
            kind.to(depth, values, level * resolution.steps if number else 1, friction)
            radii = case.rows[case.rows[:, 0] == number, 1] / edge
            rows += list(kind.traction_at(radii)) if radii.size else []
        runs.append(np.array(rows))
    # annuli are of first order beside the kinks of a traction
    weights = (-1, 2) if by_levels else (-1 / 3, 4 / 3)
    found = scale * sum(weight * run for weight, run in zip(weights, runs, strict=True))
    return inputs_of(case) | {"qx": found[:, 0], "qy": found[:, 1]}


# -- files -----------------------------------------------------------------------------------------


def answer_columns(case):
    """Columns that are the answer, in the order of the file."""
    if isinstance(case, Derived):
        return case.expected
    plane, line = ("d", "ux", "uy", "N", "Tx", "Ty", "E"), ("d", "u", "N", "T", "E")
    every = plane if case.plane else line
    return tuple(column for column in every if column not in case.control)


def column_unit(case, column):
    """Unit of the error of a column."""
    if isinstance(case, Derived):
        base = build_cases()[case.path_of]
        unit = base.units()
        edge = math.sqrt(base.radius[0] * unit["d"])
        peak = 1.5 * unit["T"] / (math.pi * edge**2)
        return {"q": peak, "c": edge, "closed": 1.0, "E": unit["E"]}[
            "q" if column[0] == "q" else column
        ]
    return case.units()[column[0]]


def round_up(number):
    """Round up to one digit."""
    power = 10.0 ** math.floor(math.log10(number)) if number > 0 else 1.0
    return float(f"{math.ceil(number / power * (1 - 1e-12)) * power:.0e}")


def derive_bounds(case, difference):
    """Bounds of the answer over its units: proven along a line, the difference of two methods otherwise."""
    columns = answer_columns(case)
    measured = is_measured(case)
    if not measured:
        loads = isinstance(case, Case) and case.loads
        return {column: 1e-9 if column == "E" and loads else 1e-12 for column in columns}
    groups = {}
    for column in columns:
        groups[column[0]] = max(groups.get(column[0], 0.0), difference[column])
    least = LEAST_BOUND if case_is_line(case) else LEAST_PLANE_BOUND
    bounds = {}
    for column in columns:
        # N is a function of d alone, and d of N: rounding
        exact = column in {"N", "d"}
        bounds[column] = (
            1e-12 if exact else max(round_up(groups[column[0]]), least.get(column[0], least["T"]))
        )
    return bounds


def case_is_line(case):
    return not (build_cases()[case.path_of] if isinstance(case, Derived) else case).plane


def is_measured(case):
    """Tell if the bound is the difference of two methods."""
    return not case_is_line(case) or (
        isinstance(case, Case) and len(np.atleast_1d(case.friction)) > 1
    )


def describe(case, difference):
    """Text of the YAML file."""
    texts = describe_derived(case) if isinstance(case, Derived) else describe_case(case)
    texts |= describe_methods(case)
    notes = () if isinstance(case, Derived) else case.notes
    lines = [f"{key}: {_text(value)}" for key, value in (texts | dict(notes)).items()]
    units = {column: column_unit(case, column) for column in answer_columns(case)}
    for key, values in (
        ("units", units), ("bounds", derive_bounds(case, difference)), ("second_method_difference", difference)
    ):  # fmt: skip
        lines.append(f"{key}:")
        lines += [
            f"  {column}: {value:.{1 if key != 'units' else 14}e}"
            for column, value in values.items()
        ]
    return "\n".join(lines) + "\n"


def describe_derived(case):
    return {
        "title": case.title,
        "version": VERSION,
        "licence": "CC0-1.0",
        "path_of": case.path_of,
        "control": list(case.control),
        "expected": list(case.expected),
    }


def describe_case(case):
    tangential = "u" if case.control[1].startswith("u") else "T"
    normal = "N" if case.loads and tangential == "T" else "d"
    texts = {
        "title": case.title,
        "version": VERSION,
        "licence": "CC0-1.0",
        "geometry": "a sphere on a plane"
        if len(case.height) == 1
        else f"{len(case.height)} rigidly connected spheres on a plane",
        "unit_system": "dimensionless" if case.dimensionless else "SI (s, m, N, J, Pa)",
        "contact_modulus": case.contact_modulus,
        "shear_modulus": case.shear_modulus,
        "moduli": "E*, and G* with 1/G* = Σ (2 - ν)/G, so that the stiffness without slip is 8 G* a",
        "friction": list(case.friction) if isinstance(case.friction, tuple) else case.friction,
        "summit_height": list(case.height),
        "summit_radius": list(case.radius),
        "control": list(case.control),
        "expected": list(answer_columns(case)),
        "path": f"straight in ({normal}, {tangential}) between rows",
        "start": "untouched, u = 0; the first row is reached by d or N alone",
    }
    if case.poisson_ratio:
        texts["poisson_ratio"] = case.poisson_ratio
    if case.time and 0.0 in case.time[1:]:
        texts["start"] += "; t = 0 begins a new, untouched contact"
    if "mu" in case.control:
        texts["path"] += (
            "; mu falls straight between rows, at rest"
            if case.plane
            else "; mu falls at the beginning of its row's path, before d and u move"
        )
    if case.saturate:
        texts["path"] += (
            "; (Rx, Ry) is the requested load: beyond μN the load is the request shortened to μN, and u moves"
            " no further than the load demands"
        )
    return texts


def describe_methods(case):
    """How the answer was found and confirmed."""
    if not is_measured(case):
        both = isinstance(case, Case) and case.loads
        return {
            "equation": "T = Σ Δm_j N(a_j), Jäger (1995) and Ciavarella (1998); E by the work of slip",
            "bound_type": "proven: closed form in 40 digits, printed with 15"
            + ("; E measured: error estimate of an adaptive quadrature" if both else ""),
            "second_method": f"{SPRINGS} springs on each half of an asperity",
        }
    if case_is_line(case):
        return {
            "equation": "T = Σ Δm_j N(a_j) of every asperity at a common u, in chords of each leg",
            "bound_type": "measured: difference of two methods, rounded up; at least 1e-7",
            "method": "8 and 16 chords of a leg, extrapolated",
            "second_method": f"{SPRINGS} springs on each half of an asperity, 400 substeps",
        }
    base = build_cases()[case.path_of] if isinstance(case, Derived) else case
    annuli, rings, steps = base.resolution
    moving = base.loads or np.ptp(base.path[:, 0]) > 0
    levels = ", ".join(str(annuli * level) for level in (LEVELS if moving else LEVELS[-1:]))
    texts = {
        "equation": "half-space of ν = 0, |q| ≤ μp at every point, slip along q; friction by implicit steps",
        "bound_type": "measured: difference of two independent discretisations, rounded up; at least 1e-4, E 2e-4",
        "method": f"about {levels} annuli with exact energy; implicit Euler, steps of a leg from {steps}, extrapolated",
        "second_method": f"{rings} rings by Abel's transformation; SDIRK2, {steps} and {2 * steps} steps of a leg",
    }
    if isinstance(case, Case) and case.poisson_ratio:
        texts["equation"] = texts["equation"].replace("ν = 0", "ν = 0.3")
        texts["method"] += "; plus the effect of ν by 40² square cells with the kernel of Cerruti"
        texts["second_method"] += "; plus the effect of ν by 28² cells"
    return texts


def _text(value):
    if isinstance(value, list):
        return "[" + ", ".join(map(_text, value)) + "]"
    if isinstance(value, float):
        # readers of YAML 1.1 take 1e-05 for a string
        mantissa, exponent, power = f"{value:.12g}".partition("e")
        return mantissa + (".0" if exponent and "." not in mantissa else "") + exponent + power
    return f'"{value}"' if ": " in value or "#" in value else value


def write(name, case):
    """Calculate a case by both methods and write its two files."""
    answer, check = methods_of(case)
    found, second = answer(case), check(case)
    difference = {
        column: float(np.abs(found[column] - second[column]).max() / column_unit(case, column))
        for column in answer_columns(case)
    }
    if isinstance(case, Derived):
        columns = {column: found[column] for column in case.control}
    else:
        columns = {"t": np.array(case.time or np.arange(float(len(case.path))))}
        columns |= dict(zip(case.control, case.path.T, strict=True))
    columns |= {column: found[column] for column in answer_columns(case)}
    save(name, columns, case.control)
    (FOLDER / f"{name}.yaml").write_text(describe(case, difference), encoding="utf-8")
    print(name, {column: f"{value:.1e}" for column, value in difference.items()}, flush=True)


def methods_of(case):
    """The method that gives the answer, and the one that confirms it."""
    if isinstance(case, Derived):
        return solve_derived, check_derived
    if case.plane:
        return solve_plane, check_plane
    return (solve_line if isinstance(case.friction, float) else solve_groups), check_line


def save(name, columns, inputs):
    """Write columns: inputs with 12 digits, as they define the path, answers with 15."""
    rows = [",".join(columns)]
    for values in zip(*columns.values(), strict=True):
        cells = (
            f"{value + 0.0:.12g}" if column in (*inputs, "t") else f"{value + 0.0:.14e}"
            for column, value in zip(columns, values, strict=True)
        )
        rows.append(",".join(cells))
    (FOLDER / f"{name}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def write_hashes():
    """Write the SHA-256 of every file of the cases, in the form of `sha256sum`."""
    names = sorted(
        path
        for pattern in ("[0-9][0-9]_*.csv", "[0-9][0-9]_*.yaml")
        for path in FOLDER.glob(pattern)
    )
    lines = [
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}" for path in sorted(names)
    ]
    (FOLDER / f"{VERSION}.sha256").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    every = build_cases()
    if "--cells" in sys.argv:
        for chosen in sys.argv[2:]:
            compare_cells(chosen, every[chosen])
    else:
        for chosen in sys.argv[1:] or every:
            write(chosen, every[chosen])
        write_hashes()
