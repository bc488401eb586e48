"""Real contact area of one map over the normal load: the laws in use beside its summits and its whole solution."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.basics.notices import Notify, silent
from historysim.basics.units import pascals
from historysim.contact.area_laws import bowden_tabor_area, bush_gibson_thomas_area, persson_area
from historysim.contact.greenwood_williamson import GreenwoodWilliamson, summit_contact
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.interaction.solutions import NormalSolutions
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

if TYPE_CHECKING:
    import xarray as xr

HOLDS = 0.2
"""Relative difference from the whole map up to which a law counts as holding."""


def area_laws(
    surface: Surface,
    pair: MaterialPair,
    normal_load: "npt.ArrayLike",
    *,
    hardness: float | None = None,
    rule: int = 9,
    whole_map: bool = True,
    notify: Notify = silent,
) -> "xr.Dataset":
    """Return the real contact area of a map over the normal load by the laws in use.

    The laws: "Bowden–Tabor" N/H, with a hardness; "Greenwood–Williamson" with mean radius and deviation of the summits;
    "Bush–Gibson–Thomas" and "Persson" with the spectral moments of the map; "summits", the sum over the summits of this
    map, which is what an ensemble has; "whole map", its fully interacting solution.

    Parameters
    ----------
    surface : Surface
        A height map.
    pair : MaterialPair
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
        `real_contact_area` (law, normal_load) [m²], NaN where a law has no value; `holds` (law, normal_load), whether
        it is within 20 % of the whole map, and for Bowden–Tabor whether the mean pressure of the whole map exceeds H.

    Raises
    ------
    InputError
        A profile, no summits, a load that is not > 0, or a map that cannot be solved.
    """
    import xarray as xr

    if 1 in surface.shape:
        raise InputError("a profile has no contact area; expected a height map")
    loads = np.sort(np.atleast_1d(checked("normal_load", normal_load, above=0)))
    summits, moments = surface.summits(rule), surface.statistics().moments
    pressure, modulus, nominal = loads / surface.nominal_area, pair.contact_modulus, surface.nominal_area
    greenwood = GreenwoodWilliamson.of_summits(summits, modulus)
    areas: dict[str, Floats] = {}
    if hardness is not None:
        areas["Bowden–Tabor"] = bowden_tabor_area(pressure, pascals(hardness)) * nominal
    areas["Greenwood–Williamson"] = np.asarray(greenwood.contact_area(greenwood.separation_at(loads)))
    areas["Bush–Gibson–Thomas"] = bush_gibson_thomas_area(pressure, moments, modulus) * nominal
    areas["Persson"] = persson_area(pressure, moments, modulus) * nominal
    areas["summits"] = _of_summits(summits, loads, modulus)
    if whole_map:
        solved = NormalSolutions.of(surface, largest_load=float(loads[-1]) / modulus, notify=notify)
        areas["whole map"] = np.interp(loads, solved.load.sum(axis=1) * modulus, solved.area.sum(axis=1))
    table = np.array(list(areas.values()))
    data: dict[str, tuple[tuple[str, str], npt.NDArray[np.float64] | npt.NDArray[np.bool_], dict[str, str]]] = {
        "real_contact_area": (("law", "normal_load"), table, {"units": "m2", "long_name": "real contact area"})
    }
    if whole_map:
        holds = np.abs(table / table[-1] - 1) <= HOLDS
        if hardness is not None:
            holds[0] = loads / table[-1] >= pascals(hardness)
        data["holds"] = (("law", "normal_load"), holds, {"long_name": f"within {HOLDS:.0%} of the whole map"})
    coordinates = {
        "law": list(areas),
        "normal_load": ("normal_load", loads, {"units": "N", "long_name": "normal load"}),
    }
    return xr.Dataset(data, coordinates, {"nominal_area": nominal, "rms_slope": float(np.sqrt(2 * moments.m2))})


def _of_summits(summits: Summits, loads: Floats, contact_modulus: float) -> Floats:
    """Return the area of independent summits at loads [m²]; between the separations of a fine table, by its slope."""
    heights = np.sort(summits.height)[::-1]
    # every first touch, and steps between them
    separations = np.unique(np.concatenate([heights, np.linspace(heights[0], heights[-1], 400)]))[::-1]
    found = summit_contact(summits.height, summits.radius, separations, contact_modulus=contact_modulus)
    return np.asarray(np.interp(loads, found.normal_load, found.contact_area, right=np.nan))
