"""Maugis's equations, solved in the units of the contact for any Maugis parameter λ.

    A = a/(πWR²/K)^(1/3),   P = N/(πWR),   Δ = δ/(π²W²R/K²)^(1/3),   K = 4 E*/3

A constant attraction, as in Dugdale's cracks, reaches from the contact radius a to the radius c of the adhesive zone.
With m = c/a and t = √(m² - 1),

    1 = (λA²/2) [t + (t² - 1) arctan t] + (4λ²A/3) [t arctan t - m + 1]
    P = A³ - λA² [t + m² arctan t]
    Δ = A² - (4/3) λA t

A falls as t rises, so that t > 0 names each equilibrium of one λ once.

Maugis, *J. Colloid Interface Sci.* 150 (1992) 243-269.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, checked
from historysim.errors import InputError

# The Maugis parameters between which the equations are solved to all digits.
LEAST_PARAMETER, GREATEST_PARAMETER = 1e-12, 1e12

# A contact radius A so small for every λ allowed that a smaller one has the same load and approach in all digits.
SMALLEST_RADIUS = 1e-60


class State(NamedTuple):
    """Contact radius A, load P and approach Δ in the units of the contact."""

    radius: Floats
    load: Floats
    approach: Floats


def solvable(maugis_parameter: ArrayLike) -> Floats:
    """Return λ as floats, within the range that is solved for."""
    parameter = checked("maugis_parameter", maugis_parameter, above=0)
    beyond = (parameter < LEAST_PARAMETER) | (parameter > GREATEST_PARAMETER)
    if beyond.any():
        raise InputError(
            f"the Maugis parameter is {parameter[beyond][0]:g}; expected one between {LEAST_PARAMETER:g} and "
            f"{GREATEST_PARAMETER:g}: "
            "check the units of radius, modulus, work of adhesion and equilibrium separation"
        )
    return parameter


def radius_at(t: Floats, parameter: Floats) -> Floats:
    """Return A, the positive root of the first equation, which is quadratic in A."""
    bending, neck = _brackets(t)
    half = 4 / 3 * parameter**2 * neck
    return 2 / (half + np.sqrt(half**2 + 2 * parameter * bending))


def state_at(t: Floats, parameter: Floats) -> State:
    """Return A, P and Δ."""
    radius = radius_at(t, parameter)
    pull = parameter * radius**2 * (t + (1 + t**2) * np.arctan(t))
    return State(radius, radius**3 - pull, radius**2 - 4 / 3 * parameter * radius * t)


def t_at(radius: Floats, parameter: Floats) -> Floats:
    """Return t at a contact radius A."""
    return crossing(lambda t: radius_at(t, parameter) - radius, 1 / (parameter * radius**1.5))


def load_turn(parameter: Floats) -> Floats:
    """Return t at the least load."""
    return crossing(lambda t: _slopes(t, parameter)[0], 1 / parameter + parameter**-1.5)


def approach_turn(parameter: Floats) -> Floats:
    """Return t at the least approach, where this is reached in contact."""
    return crossing(lambda t: _slopes(t, parameter)[1], 1 / parameter)


def crossing(falling: Callable[[Floats], Floats], start: Floats) -> Floats:
    """Return the t > 0 at which a falling function passes 0, element by element, to all digits."""
    low = np.asarray(start)
    high = low
    while np.any(above := falling(low) <= 0):
        low, high = np.where(above, low / 8, low), np.where(above, low, high)
    while np.any(below := falling(high) > 0):
        low, high = np.where(below, high, low), np.where(below, high * 8, high)
    for _ in range(56):  # 8/2^56 is half a rounding
        middle = (low + high) / 2
        positive = falling(middle) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    result: Floats = (low + high) / 2
    return result


def gap_at(zone: Floats, parameter: Floats) -> tuple[Floats, Floats]:
    """Return P and Δ of surfaces that attract each other across a gap, over a circle of radius c in units of A."""
    # a uniform pressure over a circle (Johnson, section 3.4)
    load = -np.pi / 2 * parameter * zone**2
    return load, zone**2 / 2 - 8 / (3 * np.pi) * parameter * zone - 2 / (np.pi * parameter)


def gap_fold(parameter: Floats) -> Floats:
    """Return the radius in `gap_at` at which the approach is least."""
    return 8 / (3 * np.pi) * parameter


def first_touch(parameter: Floats) -> Floats:
    """Return the radius in `gap_at` at which the gap closes in the middle: Maugis's c for a → 0."""
    half = 4 / 3 * parameter**2 * (np.pi / 2 - 1)
    return 2 / (half + np.sqrt(half**2 + np.pi * parameter))


def curve(parameter: Floats, top: Floats, steps: Floats) -> State:
    """Return all equilibria of one λ up to a load P, at these shares of the greatest contact radius."""
    touch, fold, turn = first_touch(parameter), gap_fold(parameter), load_turn(parameter)
    folds_in_gap = fold < touch
    turns = turn if folds_in_gap else np.array([turn, approach_turn(parameter)])
    last = crossing(lambda t: state_at(t, parameter).load - top, turn)
    # the ends are `last` itself, and the point contact at t = ∞
    inner = t_at(radius_at(last, parameter) * steps[1:-1], parameter)
    contact = state_at(np.sort(np.hstack([last, inner, turns]))[::-1], parameter)
    zone = np.union1d(touch * np.linspace(0, 1, steps.size), fold if folds_in_gap else touch)
    load, approach = gap_at(zone, parameter)
    return State(
        np.concatenate([np.zeros_like(zone), contact.radius]),
        np.concatenate([load, contact.load]),
        np.concatenate([approach, contact.approach]),
    )


def _brackets(t: Floats) -> tuple[Floats, Floats]:
    """Return t + (t² - 1) arctan t and t arctan t - m + 1, the brackets of the first equation."""
    # where t is small and digits of t - arctan t are lost, the second bracket or the Hertz load outweighs it
    angle = np.arctan(t)
    return t - angle + t**2 * angle, t * angle - t**2 / (1 + np.hypot(1, t))


def _slopes(t: Floats, parameter: Floats) -> tuple[Floats, Floats]:
    """Return dP/dA and dΔ/dA along the curve, by the total differentials of the equations."""
    # the differences of large numbers in them cancel in closed form, which leaves Hertz's slope less positive terms
    radius, angle, square = radius_at(t, parameter), np.arctan(t), 1 + t**2
    bending, neck = parameter * radius, 4 / 3 * parameter**2
    v = angle - t / square
    w = t**2 / (square * (1 + np.sqrt(square)))
    both = 2 * bending * t * (angle + t / square) + 2 * neck * (angle - w * t)
    load = 3 * radius**2 - 4 * bending * (bending * (v + 2 * t * angle**2) + neck * (w + angle**2)) / both
    approach = 2 * radius - 8 / 3 * parameter * (bending * v + neck * w) / both
    return load, approach
