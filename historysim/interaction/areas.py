"""Real contact area of one map over the normal load: common area laws, its summits and its full solution.

The surface of the laws is isotropic and Gaussian, and a rigid flat presses it.

Bush, Gibson and Thomas, *Wear* 35 (1975) 87-111; Persson, *J. Chem. Phys.* 115 (2001) 3840-3861;
Bowden and Tabor, *The Friction and Lubrication of Solids* (1950); elliptic contacts: Johnson,
*Contact Mechanics* (1985), section 4.2.
"""

import functools
import math

import numpy as np
import xarray as xr
from scipy import special

from historysim.basics.arguments import ArrayLike, Floats, as_floats, scalar
from historysim.basics.units import pascals
from historysim.basics.wording import Notify, silent
from historysim.contact.greenwood_williamson import (
    GreenwoodWilliamson,
    height_integral,
    summit_contact,
)
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.interaction.solutions import NormalSolutions
from historysim.surfaces.heights import Surface
from historysim.surfaces.surface_statistics import SpectralMoments

HOLDS = 0.2  # relative difference from the whole map up to which a law counts as holding
# Points of the Gauss-Legendre rules for the mean curvature of a summit, and for the difference of
# its curvatures.
CURVATURES, RATIOS = 48, 32
# limit of the rule for the mean curvature, over the average curvature of summits of one height
DEVIATIONS = 9.0
# separation over the rms height at which the linear law is reached within 3 %, and no contact is
# left
HIGHEST = 12.0


def area_laws(
    surface: Surface,
    pair: MaterialPair,
    normal_load: "ArrayLike",
    *,
    hardness: float | None = None,
    rule: int = 9,
    whole_map: bool = True,
    notify: Notify = silent,
) -> xr.Dataset:
    """Return the real contact area of a map over the normal load by the laws in use.

    These are "Bowden–Tabor" N/H, with a hardness; "Greenwood–Williamson" with mean radius and
    deviation of the summits; "Bush–Gibson–Thomas" and "Persson" with the spectral moments of the
    map; "summits", the sum over the summits of this map, which is what an ensemble has; "whole
    map", its fully interacting solution.

    Parameters
    ----------
    surface, pair
    normal_load : array_like (normal_load)
        Loads [N], > 0.
    hardness : float, optional
        Of the softer body [Pa].
    rule : {5, 9}
        Points by which the summits are found.
    whole_map : bool
        Solve the whole map, which takes seconds to minutes.
    notify : callable, optional
        Takes the notice of how long that will take.

    Returns
    -------
    Dataset
        `real_contact_area` (law, normal_load) [m²], NaN where a law has no value; `holds` (law,
        normal_load), whether it is within 20 % of the whole map, and for Bowden–Tabor whether the
        mean pressure of the whole map exceeds H.

    Raises
    ------
    InputError
        A profile, no summits, a load that is not > 0, or a map that cannot be solved.
    """
    if 1 in surface.shape:
        raise InputError("a profile has no contact area; expected a height map")
    loads = np.sort(np.atleast_1d(as_floats("normal_load", normal_load, above=0)))
    summits, moments = surface.summits(rule), surface.statistics().moments
    pressure, modulus, nominal = (
        loads / surface.nominal_area,
        pair.contact_modulus,
        surface.nominal_area,
    )
    greenwood = GreenwoodWilliamson.from_summits(summits, modulus)
    areas: dict[str, Floats] = {}
    if hardness is not None:
        areas["Bowden–Tabor"] = bowden_tabor_area(pressure, pascals(hardness)) * nominal
    areas["Greenwood–Williamson"] = np.asarray(
        greenwood.contact_area(greenwood.separation_at(loads))
    )
    areas["Bush–Gibson–Thomas"] = bush_gibson_thomas_area(pressure, moments, modulus) * nominal
    areas["Persson"] = persson_area(pressure, moments, modulus) * nominal
    # every first touch, and steps between them; the area varies linearly from one to the next
    between = np.linspace(summits.height.max(), summits.height.min(), 400)
    separations = np.unique(np.concatenate([summits.height, between]))[::-1]
    sums = summit_contact(summits.height, summits.radius, separations, contact_modulus=modulus)
    areas["summits"] = np.interp(loads, sums.normal_load, sums.contact_area, right=np.nan)
    if whole_map:
        solved = NormalSolutions.solve(
            surface, largest_load=float(loads[-1]) / modulus, notify=notify
        )
        # a row for each load that was solved; between two of them the area is straight
        areas["whole map"] = np.interp(
            loads, solved.load.sum(axis=1) * modulus, solved.area.sum(axis=1)
        )
    table, over = np.array(list(areas.values())), ("law", "normal_load")
    laws = xr.Dataset(
        {"real_contact_area": (over, table, {"units": "m2", "long_name": "real contact area"})},
        {
            "law": list(areas),
            "normal_load": ("normal_load", loads, {"units": "N", "long_name": "normal load"}),
        },
        {"nominal_area": nominal, "rms_slope": float(np.sqrt(2 * moments.m2))},
    )
    if whole_map:
        holds = np.abs(table / table[-1] - 1) <= HOLDS
        if hardness is not None:
            holds[0] = loads / table[-1] >= pascals(hardness)
        laws["holds"] = (over, holds, {"long_name": f"within {HOLDS:.0%} of the whole map"})
    return laws


# -- laws ------------------------------------------------------------------------------------------


def bowden_tabor_area(pressure: ArrayLike, hardness: float) -> Floats:
    """Return A/A0 = p/H, at most 1: every contact flows at its hardness [Pa]."""
    return np.minimum(
        as_floats("pressure", pressure, least=0) / scalar("hardness", hardness, above=0), 1.0
    )


def persson_area(pressure: ArrayLike, moments: SpectralMoments, contact_modulus: float) -> Floats:
    """Return A/A0 = erf(√2 p / (E* h')) by Persson, with the rms slope h' = √(2 m2).

    Exact where the contact is complete; at low pressure A/A0 = √(8/π) p/(E* h'), where solutions of
    whole maps lie between this and √(2π) p/(E* h') of Bush, Gibson and Thomas.
    """
    slope = math.sqrt(2 * scalar("m2", moments.m2, above=0))
    return np.asarray(
        special.erf(
            math.sqrt(2) * as_floats("pressure", pressure, least=0) / (contact_modulus * slope)
        )
    )


def bush_gibson_thomas(
    separation: ArrayLike, moments: SpectralMoments, contact_modulus: float
) -> tuple[Floats, Floats]:
    """Return nominal pressure [Pa] and A/A0 at separations from the mean plane: independent elliptic summits.

    Heights and both curvatures of the summits are distributed as on a Gaussian surface with α > 3/2
    (Nayak 1971). Far from the mean plane A/A0 approaches √(2π) p/(E* h'), which is reached only
    where next to nothing touches.
    """
    m0, m2, m4 = (scalar(name, value, above=0) for name, value in moments._asdict().items())
    alpha = m0 * m4 / m2**2
    if not alpha > 1.5:
        raise InputError(
            f"the moments have m0 m4/m2² = {alpha:.4g}; expected more than 1.5, as every surface has"
        )
    heights = np.atleast_1d(as_floats("separation", separation)) / math.sqrt(m0)
    sums = np.array([_summits_above(height, alpha) for height in heights]).T
    # lengths in √m0 and curvatures in √m4; summits per area from 1/(2π m2)
    scale = m4 / (2 * math.pi * m2)
    pressure = sums[0] * scale * contact_modulus * m0**0.75 * m4**-0.25
    area = sums[1] * scale * math.sqrt(m0 / m4)
    shape = np.shape(separation)
    return pressure.reshape(shape), np.minimum(area, 1.0).reshape(shape)


def bush_gibson_thomas_area(
    pressure: ArrayLike, moments: SpectralMoments, contact_modulus: float
) -> Floats:
    """Return A/A0 by Bush, Gibson and Thomas at nominal pressures [Pa]; NaN beyond contact at the mean plane."""
    nominal_pressure = as_floats("pressure", pressure, least=0)
    separations = np.linspace(HIGHEST, 0.0, 241) * math.sqrt(scalar("m0", moments.m0, above=0))
    pressures, areas = bush_gibson_thomas(separations, moments, contact_modulus)
    # between the separations both go nearly as exponentials, and their ratio is nearly constant
    with np.errstate(divide="ignore"):
        area_per_pressure = np.interp(
            np.log(nominal_pressure), np.log(pressures), areas / pressures
        )
    return np.where(
        nominal_pressure > pressures[-1], math.nan, area_per_pressure * nominal_pressure
    )


def _summits_above(height: float, alpha: float) -> tuple[float, float]:
    """Return load and area of all summits above a height, per 1/(2π m2) and in √m0, √m4 and E* as units.

    The mean curvature κ and the half difference r of the two are Gaussian and Rayleigh numbers of
    variances 2/3 and 1/3; summits have r < κ, and their density carries the determinant κ² - r².
    Height and κ correlate by √(3/(2α)).
    """
    correlation = math.sqrt(1.5 / alpha)
    residual_deviation = math.sqrt(1 - correlation**2)
    deviation = math.sqrt(2 / 3)
    nodes, weights = np.polynomial.legendre.leggauss(CURVATURES)
    middle = correlation * deviation * max(height, 0.0)
    low, high = max(0.0, middle - DEVIATIONS * deviation), middle + DEVIATIONS * deviation
    mean = low + (high - low) * (nodes + 1) / 2
    of_mean = (
        weights
        * (high - low)
        / 2
        * np.exp(-((mean / deviation) ** 2) / 2)
        / (deviation * math.sqrt(2 * math.pi))
    )
    nodes, weights = np.polynomial.legendre.leggauss(RATIOS)
    share = (nodes + 1) / 2
    half = mean[:, np.newaxis] * share
    of_half = mean[:, np.newaxis] * weights / 2 * 3 * half * np.exp(-1.5 * half**2)
    determinant = mean[:, np.newaxis] ** 2 - half**2
    loads, areas = _elliptic((1 - share) / (1 + share))
    # heights above the flat of summits with this mean curvature
    gap = (height - correlation * mean / deviation) / residual_deviation
    deep, shallow = (
        residual_deviation**1.5 * height_integral(1.5, gap),
        residual_deviation * height_integral(1.0, gap),
    )
    load = of_half * determinant * loads * determinant**-0.25
    area = of_half * determinant * areas * determinant**-0.5
    return float(of_mean * deep @ load.sum(axis=1)), float(of_mean * shallow @ area.sum(axis=1))


def _elliptic(ratio: Floats) -> tuple[Floats, Floats]:
    """Return P √κ/(E* δ^(3/2)) and A κ/δ of Hertzian contacts with this ratio of curvatures and geometric mean κ."""
    ratios, load, area = _ellipses()
    return np.interp(ratio, ratios, load), np.interp(ratio, ratios, area)


@functools.cache
def _ellipses() -> tuple[Floats, Floats, Floats]:
    """Tabulate ellipses by their axes' ratio k: ratio of curvatures, load and area as in `_elliptic`."""
    k = np.concatenate([np.geomspace(1e-6, 0.1, 2000), np.linspace(0.1, 1 - 1e-6, 4000)[1:]])
    square = 1 - k**2
    elliptic_k, elliptic_e = special.ellipk(square), special.ellipe(square)
    # curvatures over p0/(E* a): Johnson's Eqs. 4.25 to 4.28 with b = k a
    small = 2 * k * (elliptic_k - elliptic_e) / square
    large = 2 * k * (elliptic_e / k**2 - elliptic_k) / square
    approach = k * elliptic_k
    mean = np.sqrt(small * large)
    load = 2 / 3 * math.pi * k * np.sqrt(mean) / approach**1.5
    area = math.pi * k * mean / approach
    ends = [
        np.append(values, limit)
        for values, limit in ((small / large, 1.0), (load, 4 / 3), (area, math.pi))
    ]
    return ends[0], ends[1], ends[2]
