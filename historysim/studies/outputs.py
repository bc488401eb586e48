"""What a cell of a sweep gives: numbers that sum a history up, its totals, or its rows of each asperity."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.recording import variables
from historysim.results import analysis
from historysim.results.history_drift import branch_drift

if TYPE_CHECKING:
    import xarray as xr


@attrs.frozen
class Summary:
    """One number that sums a history up."""

    units: str
    """UDUNITS text; "1" where dimensionless."""
    long_name: str
    of: "Callable[[xr.Dataset], float]"
    """Takes a history in which the coordinates of all asperities stand, and returns the number."""


def _at_peak(history: "xr.Dataset") -> "xr.Dataset":
    return history.isel(step=[int(history["total_normal_load"].values.argmax())])


def _approach(history: "xr.Dataset") -> float:
    heights = history["present_summit_height" if "present_summit_height" in history else "summit_height"]
    highest = heights.transpose(..., "asperity").values.max(axis=-1, initial=-np.inf)
    return float((highest - history["separation"].values).max(initial=0.0))


def _deviation(values: "xr.DataArray") -> float:
    return float(values.values.std(ddof=1)) if values.size > 1 else math.nan


def _initial_stiffness(peak: "xr.Dataset") -> float:
    """Return Σ 8 G* a of the asperities that touch."""
    depth = np.maximum(peak["summit_height"].values - peak["separation"].values, 0.0)
    radius = np.sqrt(peak["summit_radius"].values * depth)
    return float(8 * peak.attrs["shear_modulus"] * radius.sum())


def _first(history: "xr.Dataset") -> int:
    return int((history["contact_count"].values > 0).argmax())


SUMMARIES = {
    "peak_normal_load": Summary("N", "greatest normal load", lambda h: h["total_normal_load"].values.max()),
    "peak_tangential_load": Summary(
        "N", "greatest tangential load, of either sign", lambda h: np.abs(h["total_tangential_load"].values).max()
    ),
    "preliminary_displacement": Summary(
        "m",
        "preliminary displacement at the greatest normal load",
        lambda h: analysis.preliminary_displacement(_at_peak(h)).values[0],
    ),
    "drift": Summary(
        "m",
        "change of the preliminary displacement between the first step in contact and the last step, either way",
        lambda h: analysis.drift(h, _first(h), -1),
    ),
    "branch_drift": Summary(
        "m",
        "branch drift between the first step in contact and the last step, without sign",
        lambda h: branch_drift(h, _first(h), -1),
    ),
    "critical_asperity": Summary(
        "1",
        "asperity that is the last to slide at the greatest normal load",
        lambda h: analysis.critical_asperity(_at_peak(h)).values[0],
    ),
    "peak_contact_count": Summary(
        "1", "greatest number of asperities in contact", lambda h: h["contact_count"].values.max()
    ),
    "peak_contact_area": Summary("m2", "greatest real contact area", lambda h: h["real_contact_area"].values.max()),
    "peak_approach": Summary(
        "m",
        "greatest approach of the highest summit from first touch",
        _approach,
    ),
    "final_dissipated_energy": Summary(
        "J", "energy dissipated by friction in the whole history", lambda h: h["total_dissipated_energy"].values[-1]
    ),
    "presliding_work": Summary(
        "J",
        "mechanical work of pre-sliding at the greatest normal load, closed loop between ±δ",
        lambda h: analysis.presliding_work(_at_peak(h)).values[0],
    ),
    "peak_mean_pressure": Summary(
        "Pa",
        "greatest mean pressure over the real contact area",
        lambda h: analysis.total_mean_pressure(h).values.max(),
    ),
    "peak_nominal_pressure": Summary(
        "Pa", "greatest normal load over the nominal area", lambda h: analysis.nominal_pressure(h).values.max()
    ),
    "initial_stiffness": Summary(
        "N m-1",
        "tangential stiffness at the greatest normal load, before anything slips",
        lambda h: _initial_stiffness(_at_peak(h)),
    ),
    "mean_summit_height": Summary("m", "mean height of all summits", lambda h: h["summit_height"].values.mean()),
    "mean_summit_radius": Summary("m", "mean radius of all summits", lambda h: h["summit_radius"].values.mean()),
    "summit_height_deviation": Summary(
        "m", "standard deviation of the heights of all summits", lambda h: _deviation(h["summit_height"])
    ),
    "summit_radius_deviation": Summary(
        "m", "standard deviation of the radii of all summits", lambda h: _deviation(h["summit_radius"])
    ),
    "summit_count": Summary("1", "number of all summits", lambda h: h.sizes["asperity"]),
}
"""Numbers that sum a history up, by name."""

OF_ALL_SUMMITS = frozenset(name for name in SUMMARIES if "summit_" in name)
"""Those that are of all summits, whether they touch or not."""
UNASKED = tuple(SUMMARIES)[: tuple(SUMMARIES).index("presliding_work")]
"""What a sweep gives where nothing is asked for: all that any contact has, also one of patches, or without areas."""

ROWS = frozenset(
    variable.name
    for variable in (
        *variables.TOTALS,
        *variables.BEHIND_A_SPRING,
        *variables.WHERE_FRICTION_CHANGES,
        *variables.WHERE_ASPERITIES_SLIDE,
        *variables.WHERE_GEOMETRY_CHANGES,
    )
)
"""Totals along ``step``, by name."""
OF_EACH = frozenset(
    variable.name
    for variable in (
        *variables.PER_ASPERITY,
        *variables.PER_PATCH,
        variables.PRESENT_FRICTION_OF_EACH,
        *variables.SLID_OF_EACH,
        *variables.WORN_OF_EACH,
        *variables.GEOMETRY_OF_EACH,
    )
)
"""Variables of each asperity along ``step``, by name."""


def chosen_outputs(names: Iterable[str]) -> tuple[str, ...]:
    """Return the outputs of these names, `UNASKED` where there are none; an unknown name is an InputError."""
    names = tuple(names)
    known = (*SUMMARIES, *sorted(ROWS), *sorted(OF_EACH))
    for index, name in enumerate(names):
        if name not in known:
            raise misfit(f"{shown(name)}; {nearest(str(name), known)}", "outputs", index)
    return tuple(dict.fromkeys(names)) or UNASKED


def asks_for_each(outputs: Sequence[str]) -> bool:
    """Return whether rows of single asperities are asked for."""
    return not OF_EACH.isdisjoint(outputs)
