"""What quantities are called on the axes and in the legends of pictures: as a person would write them."""

import math
import re

import numpy as np
import xarray as xr

from historysim.basics.units import prefixed, quantity_text

OF_A_SCENARIO = " of the scenario"
"""How the name of a swept key ends."""

WORDS = {
    "autocorrelation_length": ("autocorrelation length", r"$\beta$"),
    "branch_drift": ("drift", ""),
    "coefficient": ("friction coefficient", r"$\mu$"),
    "count": ("number of asperities", "$n$"),
    "final_dissipated_energy": ("dissipated energy", ""),
    "first": ("material", ""),
    "friction": ("friction coefficient", r"$\mu$"),
    "mean_summit_height": ("mean summit height", r"$\bar z$"),
    "mean_summit_radius": ("mean summit radius", r"$\bar R$"),
    "normal_load": ("normal load", "$N$"),
    "peak_contact_area": ("real contact area", "$A$"),
    "peak_contact_count": ("asperities in contact", ""),
    "peak_mean_pressure": ("mean pressure", "$p_m$"),
    "peak_nominal_pressure": ("nominal pressure", "$p_0$"),
    "peak_normal_load": ("normal load", "$N$"),
    "peak_tangential_load": ("tangential load", "$T$"),
    "preliminary_displacement": ("preliminary displacement", r"$\delta$"),
    "presliding_work": ("work of pre-sliding", "$W$"),
    "radius": ("radius", "$R$"),
    "rms_height": ("rms roughness", "$R_q$"),
    "second": ("second material", ""),
    "seed": ("surface", ""),
    "summit_count": ("number of summits", ""),
    "tangential_displacement": ("tangential displacement", "$U$"),
    "tangential_load": ("tangential load", "$T$"),
    "total_normal_load": ("normal load", "$N$"),
    "total_tangential_load": ("tangential load", "$T$"),
}
"""Text and symbol by the name of an output, or by the last part of a key of a scenario."""


def last_part(values: xr.DataArray, name: str) -> tuple[str, str]:
    """Return the last part of a swept key, without an index, and that index; of any other variable its name."""
    told = str(values.attrs.get("long_name", ""))
    key = told.removesuffix(OF_A_SCENARIO) if told.endswith(OF_A_SCENARIO) else name
    found = re.fullmatch(r"(?:.*\.)?([^.\[]+)(?:\[(\d+)\])?", key)
    return (found[1], found[2] or "") if found else (key, "")


def name_of(found: xr.Dataset, name: str, *, symbol: bool = True) -> str:
    """Return what a variable or a swept key of a Dataset is called, without its unit."""
    values = found.get(name)
    if values is None:
        return WORDS.get(name, (name.replace("_", " "), ""))[0]
    told = str(values.attrs.get("long_name", ""))
    last, index = last_part(values, name)
    if told and not told.endswith(OF_A_SCENARIO) and name not in WORDS:
        # what somebody else has named is called so
        return told
    text, sign = WORDS.get(last, (last.replace("_", " "), ""))
    of = f" of asperity {index}" if index else ""
    return f"{text}{of} {sign}".strip() if symbol else f"{text}{of}"


def symbol_of(found: xr.Dataset, name: str) -> str:
    """Return the symbol of a variable, or its name where it has none."""
    last, index = last_part(found[name], name) if name in found else (name, "")
    sign = WORDS.get(last, ("", ""))[1]
    return sign if sign and not index else name_of(found, name, symbol=False)


def plain_unit(unit: str) -> str:
    """Return a unit as it is printed: ``"N m-1"`` as N/m, ``"m2"`` as m²."""
    first, *rest = unit.split()
    below = [re.fullmatch(r"([^\d-]+)-(\d+)", part) for part in rest]
    if rest and all(below):
        under = "·".join(each[1] + (each[2] if each[2] != "1" else "") for each in below if each)
        return f"{first}/{under}".replace("2", "²").replace("3", "³")
    return unit.replace("2", "²").replace("3", "³")


def readable(values: xr.DataArray) -> tuple[float, str]:
    """Return the factor of a readable prefix for the greatest of some values, and the unit with it, maybe empty."""
    unit = str(values.attrs.get("units", ""))
    if unit in {"", "1"}:
        return 1.0, ""
    greatest = float(np.nanmax(np.abs(values.values), initial=0.0))
    if unit == "m2":
        # the prefix is squared with the metre
        factor, prefix = prefixed(math.sqrt(greatest))
        return factor**2, f"{prefix}m²"
    # other prefixes of squares and cubes would be misread; behind the first part of a unit they do not count
    if any(character.isdigit() for character in unit.split(maxsplit=1)[0]):
        return 1.0, plain_unit(unit)
    factor, prefix = prefixed(greatest)
    return factor, prefix + plain_unit(unit)


def member_text(found: xr.Dataset, name: str, member: int) -> str:
    """Return one value of a swept quantity, each with the prefix that suits it: ``"50 mN"``, ``"silica"``."""
    if name not in found.coords:
        return str(member)
    values = found[name]
    value = values.values[member]
    if values.dtype.kind not in "fiu":
        return str(value)
    unit = str(values.attrs.get("units", ""))
    if unit in {"", "1"} or value == 0:
        # zero is zero in any unit
        return f"{value:.4g}"
    if any(character.isdigit() for character in unit.split(maxsplit=1)[0]):
        return f"{value:.4g} {plain_unit(unit)}"
    return quantity_text(float(value), plain_unit(unit))
