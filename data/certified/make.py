"""Generate the certified load histories: CSV, YAML and the hash file.

    python make.py [CASE …]     # all cases by default; the plane ones take some minutes each

Needs numpy, scipy, and two oracles of `tests/support`: rows of springs, which confirm the cases
along one line, and square cells on a half-space, which confirm those in the plane and give their
bounds. Nothing of historysim is imported.
"""

import hashlib
import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from references import Annuli, Profile

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parents[1] / "tests" / "support"))

from planar_half_space import PlanarHalfSpace  # noqa: E402 - of the folder added above
from springs import Contact, SpringRow  # noqa: E402

VERSION = "histories-1.0"
SPRINGS = 2000  # of the second method along a line, on each half of an asperity
ANNULI = 80  # of the reference in the plane


class Resolution(NamedTuple):
    """Parts of a leg for the extrapolation of the annuli; cells on a side of the second method, and parts of a leg."""

    parts: tuple[int, ...]
    cells: int
    cell_parts: int

    @classmethod
    def of(cls, case):
        if len(case.path) > 15:  # chords of a curve: short legs
            return cls((4, 8, 16), case.cells, 3)
        return cls((8, 16, 32), case.cells, 12 if np.ptp(case.path[:, 0]) > 0 else 6)


class Case(NamedTuple):
    """One load history: path (row, controls) in SI, and the contact that follows it."""

    title: str
    # columns that are given: d and u, N and T, or d, ux and uy; and mu where friction changes
    control: tuple[str, ...]
    path: np.ndarray
    contact_modulus: float = 44e9
    shear_modulus: float = 13.75e9
    friction: float = 0.2
    height: tuple[float, ...] = (0.0,)
    radius: tuple[float, ...] = (2.5e-3,)
    time: tuple[float, ...] = ()
    dimensionless: bool = False
    cells: int = 40  # on a side, of the second method in the plane
    notes: tuple[tuple[str, object], ...] = ()  # more lines of the description

    @property
    def plane(self):
        return "uy" in self.control

    @property
    def loads(self):
        return self.control[0] == "N"

    @property
    def slip(self):
        """θ μ: full slip over approach."""
        return self.contact_modulus / (4 * self.shear_modulus) * self.friction

    def load(self, d):
        lag = max(self.height) - np.array(self.height)
        return (
            4
            / 3
            * self.contact_modulus
            * float(np.sqrt(self.radius) @ np.maximum(d - lag, 0.0) ** 1.5)
        )

    def largest_approach(self):
        if not self.loads:
            return float(self.path[:, 0].max())
        return (
            0.75 * self.path[:, 0].max() / self.contact_modulus / math.sqrt(self.radius[0])
        ) ** (2 / 3)

    def units(self):
        """Units of errors: the largest N and d of the case, μN, full slip, and their product."""
        d = self.largest_approach()
        load = self.load(d)
        values = {"d": d, "N": load, "T": self.friction * load, "u": self.slip * d}
        return values | {"E": values["T"] * values["u"]}


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
    dither = [(1, 0, 0), (1, 1.5, 0)] + [(1, 1.5, y) for y in (0.3, -0.3) * 4] + [(1, 1.8, 0)]
    equal = {"height": (0.0,) * 12, "radius": (10e-6,) * 12}
    many = rough(15, 200, 20e-9, (5e-6, 15e-6))
    corner = plane([(1, 0, 0), (1, 0.6, 0), (1, 0.6, 0.3), (1, 0.6, 0.6), (1, 0.6, 0)])
    return {
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
        "16_corner": Case("L: along x, then along y", duu, corner, **PLANE, cells=56),
        "17_square": Case(
            "Square",
            duu,
            plane([(1, 0, 0), (1, 0.5, 0), (1, 0.5, 0.5), (1, 0, 0.5), (1, 0, 0), (1, 0.5, 0)]),
            **PLANE,
            cells=56,
        ),
        "18_circle_03": Case("Circle of 0.3 of full slip", duu, circle(0.3, 16, 1.125), **PLANE),
        "19_circle_07": Case("Circle of 0.7 of full slip", duu, circle(0.7, 24, 1), **PLANE),
        "20_spiral": Case("Spiral out to full slip", duu, spiral(), **PLANE),
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
        "23_random_varying_load": Case("Random way points with N varying", duu, random_12, **PLANE),
        "24_dither": Case(
            "Dither across a contact that has slid", duu, plane(dither), **PLANE, cells=56
        ),
    }


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


def plane_columns(case, loads, energy):
    """Columns in SI from dimensionless loads and energies (E* = R = θ = μ = 1, largest approach 1)."""
    unit = case.units()
    load = np.array([case.load(each) for each in case.path[:, 0]])
    tx, ty = 0.75 * np.array(loads).T * unit["T"]
    names = dict(zip(case.control, case.path.T, strict=True))
    return names | {"N": load, "Tx": tx, "Ty": ty, "E": 0.75 * np.array(energy) * unit["E"]}


def solve_plane(case):
    """Columns by annuli: implicit Euler in three numbers of parts, extrapolated."""
    unit = case.units()
    path = case.path / (unit["d"], unit["u"], unit["u"])
    runs = []
    for parts in Resolution.of(case).parts:
        annuli, rows = Annuli(ANNULI), []
        for step, (d, *u) in enumerate(path):
            annuli.to(d, u, parts if step else 1)
            rows.append((*annuli.tangential_load, annuli.dissipated))
        runs.append(np.array(rows))
    found = 8 / 3 * runs[2] - 2 * runs[1] + runs[0] / 3
    return plane_columns(case, found[:, :2], found[:, 2])


def check_plane(case):
    """The same columns by square cells with the kernel of Cerruti, in steps of second order."""
    unit = case.units()
    path = case.path / (unit["d"], unit["u"], unit["u"])
    _, count, parts = Resolution.of(case)
    cells, rows = PlanarHalfSpace(count), []
    before = path[0]
    cells.to(before[1:], before[0])
    for after in path:
        for part in np.arange(1, parts + 1) / parts if (after != before).any() else ():
            at = before + part * (after - before)
            cells.to(at[1:], at[0])
        rows.append((*cells.tangential_load, cells.dissipated))
        before = after
    found = np.array(rows)
    return plane_columns(case, found[:, :2], found[:, 2])


# -- files -----------------------------------------------------------------------------------------


def answer_columns(case):
    """Columns that are the answer, in the order of the file."""
    if case.loads:
        return ("d", "u", "E")
    return ("N", "Tx", "Ty", "E") if case.plane else ("N", "T", "E")


def column_unit(case, column):
    return case.units()[column[0]]


def round_up(number):
    """Round up to one digit."""
    power = 10.0 ** math.floor(math.log10(number)) if number > 0 else 1.0
    return float(f"{math.ceil(number / power * (1 - 1e-12)) * power:.0e}")


def derive_bounds(case, difference):
    """Bounds of the answer over its units: proven along a line, the difference of two discretisations in the plane."""
    if case.plane:
        loads = round_up(max(difference["Tx"], difference["Ty"]))
        return {"N": 1e-12, "Tx": loads, "Ty": loads, "E": round_up(difference["E"])}
    return {
        column: 1e-9 if column == "E" and case.loads else 1e-12 for column in answer_columns(case)
    }


def describe(case, difference):
    """Text of the YAML file."""
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
        "friction": case.friction,
        "summit_height": list(case.height),
        "summit_radius": list(case.radius),
        "control": list(case.control),
        "expected": list(answer_columns(case)),
        "path": "straight in (N, T) between rows"
        if case.loads
        else "straight in (d, u) between rows",
        "start": "untouched, u = 0; the first row is reached by d or N alone",
        "equation": "T = Σ Δm_j N(a_j), Jäger (1995) and Ciavarella (1998); E by the work of slip",
        "bound_type": "proven: closed form in 40 digits, printed with 15"
        + ("; E measured: error estimate of an adaptive quadrature" if case.loads else ""),
        "second_method": f"{SPRINGS} springs on each half of an asperity, 400 substeps where both loads vary",
    }
    if case.plane:
        parts, cells, cell_parts = Resolution.of(case)
        texts |= {
            "equation": "half-space of ν = 0, |q| ≤ μp at every point, slip along q; friction by implicit steps",
            "bound_type": "measured: difference of two independent discretisations, rounded up",
            "method": f"{ANNULI} annuli with exact energy; implicit Euler, {parts} parts of a leg, extrapolated",
            "second_method": f"{cells}² square cells with the kernel of Cerruti, SDIRK2, {cell_parts} parts of a leg",
        }
    if case.time and 0.0 in case.time[1:]:
        texts["start"] += "; t = 0 begins a new, untouched contact"
    if "mu" in case.control:
        texts["path"] += "; mu falls at the beginning of its row's path, before d and u move"
    lines = [f"{key}: {_text(value)}" for key, value in (texts | dict(case.notes)).items()]
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
    answer, check = (solve_plane, check_plane) if case.plane else (solve_line, check_line)
    found, second = answer(case), check(case)
    difference = {
        column: float(np.abs(found[column] - second[column]).max() / column_unit(case, column))
        for column in answer_columns(case)
    }
    columns = {"t": np.array(case.time or np.arange(float(len(case.path))))}
    columns |= dict(zip(case.control, case.path.T, strict=True)) | {
        column: found[column] for column in answer_columns(case)
    }
    save(name, columns, case.control)
    (FOLDER / f"{name}.yaml").write_text(describe(case, difference), encoding="utf-8")
    print(name, {column: f"{value:.1e}" for column, value in difference.items()}, flush=True)


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
    for chosen in sys.argv[1:] or every:
        write(chosen, every[chosen])
    write_hashes()
