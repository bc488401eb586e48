"""A ``[loading]`` to start from, out of what the columns of a file are called and measured in."""

import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.loads.events import ACROSS
from historysim.scenario.run_column import find_run_column
from historysim.scenario.schema import column_from_toml
from historysim.tables import Format, Listing, read_table
from historysim.tables.columns import split_unit

# A word begins at the start of a name or behind a device or a group, and ends where no letter follows.
_AT, _END = r"^(?:.*[./:|>])?\W*", r"(?![^\W\d_])"
# What the columns of a channel are called, the likeliest first; each is taken where one column fits alone.
_TIME = (rf"{_AT}(time(stamp)?|zeit|temps|elapsed|t){_END}", rf"^\W*(?-i:t){_END}")
_NORMAL = (rf"normal|press|applied|{_AT}(fn|fz|f_n|n|load|p){_END}",)
_TANGENTIAL = ("fric|tang|reib|shear", rf"{_AT}(ff|ft|f_t){_END}", rf"{_AT}fx{_END}", rf"lateral|{_AT}(fy|t|q){_END}")
_STROKE = ("^(?!.*normal).*(tang|lateral|shear|slid)", "disp|weg", "stroke|pos", rf"{_AT}(x|u|ux|s|dx){_END}")
_SHARE = re.compile(r"(?i)coef|(?<![^\W_])cof|ratio")  # A coefficient of friction is no load
# A name that ends as ``Fx_mN`` does; letters that stand for other things as often are left out.
_UNIT_IN_NAME = re.compile(r".+_(s|ms|us|µs|μs|min|N|mN|uN|µN|μN|nN|kN|mm|um|µm|μm|nm)")


def suggested_loading(path: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Return a section ``[loading]`` in TOML for a file with these columns, with ``"?"`` where something is open.

    The path is relative to the scenario; ``blocks`` is the number of tables in the file.
    """
    lines = ["[loading]", f"file = {_quoted(path.as_posix())}"]
    if blocks > 1:
        layout = attrs.evolve(layout, block=layout.block if isinstance(layout.block, int) else 1)
        lines.append(f'block = {layout.block}  # of {blocks}; an array of some, or "all", joins them')
    if any(re.fullmatch(r"[+-]?\d+,\d+(e[+-]?\d+)?", each.first, re.IGNORECASE) for each in listings):
        layout = attrs.evolve(layout, decimal=",")
    layout_keys = {key: getattr(layout, key) for key in ("delimiter", "decimal", "header", "encoding", "sheet")}
    lines += [f"{key} = {_quoted(of)}" for key, of in layout_keys.items() if of != getattr(Format(), key)]
    time, normal = _found(listings, "s", _TIME), _found(listings, "N", _NORMAL)
    across = _along_y(listings)
    left = [each for each in listings if each not in (time, normal, *across.values())]
    friction, stroke = _found(left, "N", _TANGENTIAL), _found(left, "m", _STROKE)
    if time and (count := 1 + int((np.diff(_values(path, time, layout, "s")) < 0).sum())) > 1:
        lines.append(f'run = 1  # of {count:,}, the clock starts again; run = "each" is for loops, sliding and fit')
    elif runs := find_run_column(path, layout):
        lines.append(f"runs_by = {_quoted(runs.name)}")
        lines.append(f'run = {runs.numbers[0]}  # of {runs.listed}; run = "each" is for loops, sliding and fit')
    lines += ["", "[loading.columns]"]
    lines.append(_key("time", time, "s") if time else "# no column looks like time: without it, the row is the clock")
    lines.append(_key("normal_load", normal, "mN", *_pressing(path, normal, layout)))
    if friction and not stroke:
        # where the load alone was recorded, it is what was controlled
        return "\n".join([*lines, *_tangential_keys("tangential_load", friction, "mN", across)])
    lines += _tangential_keys("tangential_displacement", stroke, "µm", across)
    if stroke in across:
        # a response has one direction
        return "\n".join(lines)
    response = ["", "[loading.response]", _key("tangential_load", friction, "mN")] if friction else []
    return "\n".join(lines + response)


def suggested_scenario(path: Path, output: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Return a scenario in TOML to start from, for the file ``output``; keys of no column stand in it as comments."""
    if output.parent.absolute() != Path.cwd():
        relative = Path(os.path.relpath(path.absolute(), output.parent.absolute())).as_posix()
    else:
        relative = path.as_posix()
    loading = suggested_loading(path, listings, layout, blocks)
    loading = loading.replace(f"file = {_quoted(path.as_posix())}", f"file = {_quoted(relative)}", 1)
    fit = "" if "[loading.response]" not in loading else _FIT
    return f"title = {_quoted(path.stem)}\n{_HEAD}\n{loading}\n{fit}"


_HEAD = """
[materials]  # fill in: both of the pair, by name or as { name = …, youngs_modulus = …, poissons_ratio = … }
# first = "silicon"
# second = "float glass"

[surface]
kind = "sphere"  # or "random", "measured", "summits", …
# radius = "2.5 mm"  # fill in

[friction]
coefficient = 0.2  # a guess, where a fit starts
"""
_FIT = """
# [instrument]  # where the displacement is that of a drive, behind a spring
# lateral_stiffness = "300 mN/µm"

[fit]
parameters = ["friction"]  # and "lateral_stiffness", with [instrument]
"""


def _values(path: Path, listing: Listing, layout: Format, unit: str) -> Floats:
    """Return the finite values of a column in a unit, which stands for one that is open; none if it cannot be read."""
    column = column_from_toml(tomllib.loads(f"column = {_reference(listing)}")["column"])
    column = attrs.evolve(column, unit=listing.unit or _unit_in_name(listing) or unit)
    try:
        values = read_table(path, {"read": column}, {"read": unit}, layout, missing=True).columns["read"]
    except InputError:
        return np.empty(0)
    return values[np.isfinite(values)]


def _found(listings: Sequence[Listing], unit: str, patterns: Sequence[str]) -> Listing | None:
    """Return the column with a fitting name and unit: by the first of the patterns that one alone has."""
    for pattern in patterns:
        fitting = [
            each
            for each in listings
            if re.search(pattern, _name(each), re.IGNORECASE)
            and not _SHARE.search(_name(each))
            and each.values != "a text"
            and _is_of(each.unit or _unit_in_name(each) or unit, unit)
        ]
        if len(fitting) == 1:
            return fitting[0]
    return None


def _pressing(path: Path, listing: Listing | None, layout: Format) -> tuple[str, str]:
    """Return a key and a comment for a normal load below zero; empty where it presses, or cannot be read."""
    values = np.empty(0) if listing is None else _values(path, listing, layout, "N")
    if not (below := int((values < 0).sum())):
        return "", ""
    if values.mean() < 0:
        return "scale = -1", "pressing counts negative in the file"
    return "", f"{counted(below, 'sample is', 'samples are')} below zero; if that is noise: negative_as_zero = true"


def _key(key: str, listing: Listing | None, unit: str, more: str = "", why: str = "") -> str:
    if listing is None:
        return f'{key} = "?"  # fill in: one of the columns above'
    reference, extra = _reference(listing), [more]
    if not listing.unit:
        known = _unit_in_name(listing)
        extra.insert(0, f'unit = "{known or "?"}"')
        why = "; ".join(filter(None, [why, "as its name ends: check it" if known else f'fill in, as in "{unit}"']))
    comment = f"  # {why}" if why else ""
    if not any(extra):
        return f"{key} = {reference}{comment}"
    inner = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return f"{key} = {{ {', '.join(filter(None, [inner, *extra]))} }}{comment}"


def _tangential_keys(
    key: str, listing: Listing | None, unit: str, across: Mapping[Listing | None, Listing]
) -> list[str]:
    """Return the key of a tangential channel and, where it has a column along y, the key of that."""
    keys = [_key(key, listing, unit)]
    return keys if listing not in across else [*keys, _key(key + ACROSS, across[listing], unit)]


def _along_y(listings: Sequence[Listing]) -> dict[Listing | None, Listing]:
    """Return the columns ``NAME y`` by the columns ``NAME x``, as tables of two tangential directions have them."""
    names = {split_unit(_name(listing))[0]: listing for listing in listings}
    return {
        listing: names[f"{stem} y"]
        for name, listing in names.items()
        if (stem := name.removesuffix(" x")) != name and f"{stem} y" in names
    }


def _reference(listing: Listing) -> str:
    return listing.column.partition(" # ")[0]


def _name(listing: Listing) -> str:
    """Return the name of a column; empty where it has none, or one that may be its neighbour's."""
    match = re.search(r'"((?:[^"\\]|\\.)*)"', listing.column.partition(" # under ")[0])
    return match[1] if match else ""


def _unit_in_name(listing: Listing) -> str:
    match = _UNIT_IN_NAME.fullmatch(_name(listing))
    return match[1] if match else ""


def _is_of(unit: str, like: str) -> bool:
    try:
        conversion_factor(unit.partition(",")[0], like)
    except InputError:
        return False
    return True


def _quoted(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
