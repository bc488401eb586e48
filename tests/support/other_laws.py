"""Tangential laws of other programs, by their published equations, and three public histories to try them on.

All laws follow the same path: depths of the asperities, and a displacement that they share, at the recorded steps. They
share no code with the package.
"""

from typing import NamedTuple

import numpy as np
from springs import Contact, SpringRow

import historysim as hs

HISTORIES = {
    "loops": "scenarios/03_constant_load.toml",
    "steps": "scenarios/01_load_steps_up.toml",
    "coupled": "ten lines of Python",
}
SPRINGS = 1000  # springs on each half of each asperity, of the reference


def coupled():
    """A ball on glass: the approach swings by a half while the displacement swings, five to eight times."""
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
    phase = 2 * np.pi * np.arange(321) / 64
    approach = 200e-9 * (1 + 0.5 * np.sin(phase))
    displacement = 30e-9 * np.sin(1.6 * phase)
    events = [hs.NormalDisplacement(-1.0, approach[0])]
    for time, (normal, tangential) in enumerate(zip(approach, displacement, strict=True)):
        events += [hs.NormalDisplacement(time, normal), hs.TangentialDisplacement(time, tangential)]
    return hs.replay(ball, events, record="all")


class Course(NamedTuple):
    """What happens to a contact: depths [m] of (step, asperity), displacement [m] and found load [N] of each step."""

    contact: Contact
    depth: np.ndarray
    displacement: np.ndarray
    found: np.ndarray

    @property
    def approach(self):
        return (self.depth + self.contact.summit_height.max() - self.contact.summit_height)[:, 0]

    @property
    def radius(self):
        """Contact radii [m]."""
        return np.sqrt(self.contact.summit_radius * self.depth.clip(0))

    @property
    def limit(self):
        """Greatest tangential load that friction holds, of each asperity at each step [N]."""
        return self.contact.friction * 4 / 3 * self.contact.contact_modulus * self.radius * self.depth.clip(0)


def course_of(history):
    """The course of a history that is recorded with all asperities that touch."""
    contact = Contact.build(
        history.attrs["contact_modulus"],
        history.attrs["shear_modulus"],
        history.summit_height.values,
        history.summit_radius.values,
        history.friction.values,
    )
    depth = history.summit_height.values - history.separation.values[:, np.newaxis]
    return Course(contact, depth, history.tangential_displacement.values, history.total_tangential_load.values)


def course(name, root):
    """The course of one of the three histories, as historysim replays it."""
    return course_of(coupled() if name == "coupled" else hs.run(root / HISTORIES[name]))


def reference(course, springs=SPRINGS):
    """Total load [N] of springs that find each onset of slip within a step, and the bound of their error [N]."""
    row = SpringRow(course.contact, course.approach.max(), springs)
    loads, bounds = np.zeros(course.displacement.size), np.zeros(course.displacement.size)
    for step, approach in enumerate(course.approach):
        row.apply(("displacement", approach), ("displacement", course.displacement[step]))
        loads[step], bounds[step] = row.total_tangential_load, row.tangential_load_error.sum()
    return loads, bounds.max()


def error(course, loads, expected):
    """Largest difference of total loads, in parts of the greatest friction limit."""
    return float(np.abs(loads - expected).max() / course.limit.sum(axis=1).max())


# -- laws ------------------------------------------------------------------------------------------


def homemade(course, springs):
    """What one writes in ten lines: springs of equal width, moved and cut off at μ times their normal load."""
    contact = course.contact
    ratio = contact.friction * contact.contact_modulus / (4 * contact.shear_modulus)
    half_width = course.radius.max(axis=0)
    x = half_width * (np.arange(springs)[:, np.newaxis] + 0.5) / springs
    force = 8 * contact.shear_modulus * half_width / springs
    stretch, loads = np.zeros_like(x), []
    for depth, move in zip(course.depth, np.diff(course.displacement, prepend=0.0), strict=True):
        limit = ratio * (depth - x**2 / contact.summit_radius).clip(0)
        stretch = (stretch + move).clip(-limit, limit)
        loads.append((force * stretch).sum())
    return np.array(loads)


def slider(course, *, rescaled=False, of_force=False):
    """One slider for each asperity: `mindlin` of LAMMPS' pair granular, and what `_rescale` and `/force` add.

    A spring 8 G* a of the displacement that is kept, or of force that grows with it, cut off at μN; `_rescale` shrinks
    what is kept with the radius (LAMMPS' manual, pair_style granular; Thornton, Cummins and Cleary, 2013).
    """
    kept, before, loads = np.zeros(course.radius.shape[1]), np.zeros(course.radius.shape[1]), []
    for radius, limit, move in zip(course.radius, course.limit, np.diff(course.displacement, prepend=0.0), strict=True):
        stiffness = 8 * course.contact.shear_modulus * radius
        if rescaled:
            kept = kept * np.where(radius < before, radius / np.where(before > 0, before, 1), 1)
        load = (kept + stiffness * move if of_force else stiffness * (kept + move)).clip(-limit, limit)
        kept = load if of_force else np.divide(load, stiffness, out=np.zeros_like(load), where=stiffness > 0)
        before = radius
        loads.append(load.sum())
    return np.array(loads)


def mindlin_iwan_fit(course, radii=100):
    """Tractions at so many radii, which is the rough contact of TMDSimPy.

    Porter and Brake, Mechanical Systems and Signal Processing 192 (2023) 110210, equations 35, 37, 38, 42 and 43. The
    tractions stay at their places while the contact grows or shrinks.
    """
    part = np.linspace(0, 1, radii)
    weight = np.full(radii, 1 / (radii - 1))
    weight[[0, -1]] /= 2
    with np.errstate(divide="ignore"):
        stiff = 0.8709 + (1 - 0.8709) / np.sqrt(1 - part**2) + 0.0629 * part - 0.8915 * part**2 + 0.6998 * part**3
    stiff[-1] = 0.0
    pressure = np.sqrt(1 - part**2)
    traction, before, loads = np.zeros((course.radius.shape[1], radii)), np.zeros(course.radius.shape[1]), []
    for radius, limit, move in zip(course.radius, course.limit, np.diff(course.displacement, prepend=0.0), strict=True):
        area = np.pi * np.where(radius > 0, radius, 1) ** 2
        moved = np.array([
            np.interp(own * part, old * part, values, right=0.0) if own > 0 and old > 0 else np.zeros(radii)
            for own, old, values in zip(radius, before, traction, strict=True)
        ]) if (radius != before).any() else traction  # fmt: skip
        local = (8 * course.contact.shear_modulus * radius / area)[:, np.newaxis] * stiff
        most = (1.5 * limit / area)[:, np.newaxis] * pressure
        traction, before = (moved + local * move).clip(-most, most), radius
        loads.append((2 * np.pi * radius**2 * (traction * part @ weight)).sum())
    return np.array(loads)


LAWS = {
    "historysim": lambda course: course.found,
    "home-made springs, 16 each": lambda course: homemade(course, 16),
    "home-made springs, 256 each": lambda course: homemade(course, 256),
    "TMDSimPy, Mindlin–Iwan fit, 100 radii": mindlin_iwan_fit,
    "TMDSimPy, one slider each; LAMMPS `mindlin/force`": lambda course: slider(course, of_force=True),
    "LAMMPS `mindlin`": slider,
    "LAMMPS `mindlin_rescale`": lambda course: slider(course, rescaled=True),
    "LAMMPS `mindlin_rescale/force`": lambda course: slider(course, rescaled=True, of_force=True),
}
