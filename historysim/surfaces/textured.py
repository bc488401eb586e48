"""Textured surfaces: regular arrays of equal summits, with scatter on request, and one asperity split into n.

Two laws say what the n asperities look like that share the load of one, F/n each: self-similar ones have R/√n,
curvature-invariant ones keep R.

Winogrodzka, *Pre-sliding behaviour of multi asperity ceramic contacts* (University of Twente), section 6.2.1. The loads
per contact printed there, F/n² and F/√n, do not add up to F and are not used.
"""

import math
import operator
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked, per_axis, scalar
from historysim.basics.array_types import Floats
from historysim.contact import hertz
from historysim.errors import InputError
from historysim.surfaces.distribution import MOST_SUMMITS
from historysim.surfaces.seeds import generator
from historysim.surfaces.summits import Summits

LAWS: Final[Mapping[str, float]] = MappingProxyType({"self-similar": -0.5, "curvature-invariant": 0.0})
"""The scaling laws by name: the power of n to which the radius of each asperity goes."""


def textured_summits(
    count: tuple[int, int],
    pitch: float | tuple[float, float],
    radius: float,
    *,
    height_scatter: float = 0.0,
    radius_scatter: float = 0.0,
    seed: int | None = None,
) -> Summits:
    """Return the summits of a regular array, at x = i pitch_x and y = j pitch_y.

    Parameters
    ----------
    count : tuple of int
        Numbers of summits (nx, ny) along x and y. Summit i ny + j is at (i, j).
    pitch : float or tuple of float
        Distance from one summit to the next [m], > 0; one for both directions, or (px, py).
    radius : float
        R [m], > 0, the mean of the radii.
    height_scatter : float
        Standard deviation of the heights around 0 [m], Gaussian.
    radius_scatter : float
        Standard deviation of the radii over R [1], 0 to 1. They are log-normal, so that every radius is positive.
    seed : int, optional
        Whole number, 0 or more, needed for scatter. One seed gives the same heights with any scatter of the radii, and
        the same radii with any scatter of the heights.

    Returns
    -------
    Summits
        With the nominal area nx px ny py.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, counts that are not whole or above `MOST_SUMMITS` in all,
        scatter without a seed.
    """
    nx, ny = _shape(count)
    px, py = per_axis("pitch", pitch)
    mean_radius = scalar("radius", radius, above=0)
    deviation = scalar("height_scatter", height_scatter, least=0)
    relative = scalar("radius_scatter", radius_scatter, least=0)
    if relative > 1:
        raise InputError(f"radius_scatter is {relative:g}; expected 0 to 1: a fraction of the radius, not a percentage")
    heights, radii = np.zeros(nx * ny), np.full(nx * ny, mean_radius)
    if deviation or relative:
        if seed is None:
            raise InputError("height_scatter or radius_scatter came without a seed; expected a whole number as seed")
        normal = generator(seed).standard_normal((2, nx * ny))
        heights += deviation * normal[0]
        # the logarithm is Gaussian; these two parameters give the mean and the deviation asked for
        variance = math.log1p(relative**2)
        radii *= np.exp(math.sqrt(variance) * normal[1] - variance / 2)
    x, y = np.repeat(np.arange(nx) * px, ny), np.tile(np.arange(ny) * py, nx)
    return Summits(heights, radii, x, y, nominal_area=nx * px * ny * py)


def split(radius: npt.ArrayLike, count: npt.ArrayLike, law: str) -> Floats:
    """Return the radius [m] of each of n equal asperities that replace one.

    Parameters
    ----------
    radius : array_like
        R of the one [m], > 0.
    count : array_like
        n, whole numbers of 1 or more.
    law : str
        ``"self-similar"``: R/√n; ``"curvature-invariant"``: R.

    Raises
    ------
    InputError
        A number out of its range, or an unknown law.
    """
    if law not in LAWS:
        raise InputError(f"law is {law!r}; expected one of {', '.join(map(repr, LAWS))}")
    return checked("radius", radius, above=0) * _whole(count) ** LAWS[law]


@attrs.frozen(eq=False)
class SplitContact:
    """Contact of n equal asperities that share a load.

    Attributes
    ----------
    normal_load : array
        Load of each, F/n [N].
    summit_radius : array
        Radius of each [m].
    approach : array
        Approach δ, the same for all [m]. It goes as n^(-1/2) in self-similar, as n^(-2/3) in curvature-invariant
        splitting, and so does the preliminary displacement, which is θ μ δ.
    contact_radius : array
        Contact radius of each [m].
    contact_area : array
        Area of all together [m²]: that of the one asperity in self-similar, n^(1/3) times it in curvature-invariant
        splitting.
    """

    normal_load: Floats
    summit_radius: Floats
    approach: Floats
    contact_radius: Floats
    contact_area: Floats


def split_contact(
    normal_load: npt.ArrayLike,
    radius: npt.ArrayLike,
    count: npt.ArrayLike,
    law: str,
    *,
    contact_modulus: npt.ArrayLike,
) -> SplitContact:
    """Return the contact of n equal asperities that replace one and share its load, F/n each, by Hertz.

    Parameters
    ----------
    normal_load : array_like
        F of all together [N], ≥ 0.
    radius, count, law
        As in `split`.
    contact_modulus : array_like
        E* [Pa], > 0.

    Raises
    ------
    InputError
        A number out of its range, or an unknown law.
    """
    number, each = _whole(count), split(radius, count, law)
    load = checked("normal_load", normal_load, least=0) / number
    depth = hertz.approach(load, summit_radius=each, contact_modulus=contact_modulus)
    contact_radius = hertz.contact_radius(depth, summit_radius=each)
    return SplitContact(load, each, depth, contact_radius, number * math.pi * contact_radius**2)


def _shape(count: Any) -> tuple[int, int]:
    try:
        nx, ny = map(operator.index, count)
    except (TypeError, ValueError) as error:
        raise InputError(f"count is {count!r}; expected two whole numbers (nx, ny)") from error
    if min(nx, ny) < 1 or nx * ny > MOST_SUMMITS:
        raise InputError(f"count is {(nx, ny)}; expected 1 or more each way, and at most {MOST_SUMMITS:,} in all")
    return nx, ny


def _whole(count: npt.ArrayLike) -> Floats:
    values = checked("count", count, least=1)
    if np.any(values != np.round(values)):
        raise InputError(f"count is {count!r}; expected whole numbers")
    return values
