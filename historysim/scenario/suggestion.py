"""A ``[loading]`` to start from, out of what the columns of a file are called and measured in."""

import json
import os
import re
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.scenario.column_keys import column_from_toml
from historysim.tables import Format, Listing, read_table

UNKNOWN = "?"
NOISE = 0.05  # share of its greatest value that a normal load may be below zero, by noise and its zero, and still press
# a word ends where no letter follows ("_" and digits may), and begins at the start or behind a device or a group
_AT = r"^(?:.*[./:|>])?\W*"
_TIME = re.compile(rf"(?i){_AT}(time(stamp)?|zeit|temps|elapsed|t)(?![^\W\d_])")
_NORMAL = re.compile(rf"(?i)normal|{_AT}(fn|fz|f_n|n|load|p)(?![^\W\d_])|press|applied")
_TANGENTIAL = re.compile(rf"(?i)fric|tang|lateral|shear|{_AT}(ft|fx|fy|ff|f_t|t|q)(?![^\W\d_])|reib")
_STROKE = re.compile(
    rf"(?i)^(?!.*normal)(?:.*(tang|lateral|shear|stroke|slid|disp|pos|weg)|{_AT[1:]}(x|u|ux|s|dx)(?![^\W\d_]))"
)
# Where several columns fit, those that are meant before others; an axis x before an axis y, t as a time before T.
_FIRST_OF_SEVERAL = (
    re.compile(r"(?i)fric|tang|reib|shear"),
    re.compile(rf"(?i){_AT}(ff|ft|f_t)(?![^\W\d_])"),
    re.compile(r"(?i)(?<![^\W_])f?x(?![^\W\d_])"),
    re.compile(r"^\W*t(?![^\W\d_])"),
)
_SHARE = re.compile(r"(?i)coef|(?<![^\W_])cof|ratio")  # A coefficient of friction is no load
# A name that ends as ``Fx_mN`` does; letters that stand for other things as often are left out.
_UNIT_IN_NAME = re.compile(r".+_(s|ms|us|µs|μs|min|N|mN|uN|µN|μN|nN|kN|mm|um|µm|μm|nm)")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.IGNORECASE)
_FORCES, _LENGTHS, _TIMES = ("N", "kg"), ("m",), ("s",)


def suggested_loading(path: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Return a section ``[loading]`` in TOML for a file with these columns, and marks where something is open.

    The path is relative to the scenario; ``blocks`` is the number of tables in the file.
    """
    lines = ["[loading]", f"file = {_quoted(path.as_posix())}"]
    if blocks > 1:
        chosen = layout.block if isinstance(layout.block, int) else 1
        lines.append(f'block = {chosen}  # of {blocks}; an array of some, or "all", joins them')
        layout = attrs.evolve(layout, block=chosen)
    if any(_DECIMAL_COMMA.fullmatch(each.first) for each in listings):
        layout = attrs.evolve(layout, decimal=",")
    layout_keys = {key: getattr(layout, key) for key in ("delimiter", "decimal", "header", "encoding", "sheet")}
    lines += [
        f"{key} = {value if isinstance(value, int) else _quoted(value)}"
        for key, value in layout_keys.items()
        if value != getattr(Format(), key)
    ]
    used: set[str] = set()
    time = _found(listings, _TIMES, _TIME, used)
    normal = _found(listings, _FORCES, _NORMAL, used)
    friction = _found(listings, _FORCES, _TANGENTIAL, used)
    moving = [each for each in listings if not _rests(path, each, layout)]
    stroke = _found(moving, _LENGTHS, _STROKE, used)
    if normal and stroke and not friction:
        friction = _lone_force(listings, used)
    if (count := _runs(path, time, layout)) > 1:
        lines.append(f'run = 1  # of {count:,}, the clock starts again; run = "each" is for loops, sliding and fit')
    lines += ["", "[loading.columns]"]
    lines.append(_key("time", time, "s") if time else "# no column looks like time: without it, the row is the clock")
    lines.append(_key("normal_load", normal, "mN", _pressing(path, normal, layout)))
    if friction and not stroke:
        # where the load alone was recorded, it is what was controlled
        return "\n".join([*lines, _key("tangential_load", friction, "mN")])
    lines.append(_key("tangential_displacement", stroke, "µm"))
    if friction:
        lines += ["", "[loading.response]", _key("tangential_load", friction, "mN", _other(listings, friction, used))]
    elif shares := [each for each in listings if _SHARE.search(_name(each))]:
        lines += ["", f"# no [loading.response]: {_name(shares[0])} is a coefficient, and no tangential load"]
    return "\n".join(lines)


def suggested_scenario(path: Path, output: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Return a scenario in TOML to start from, for the file ``output``; keys of no column stand in it as comments."""
    loading = suggested_loading(path, listings, layout, blocks)
    if output.parent.absolute() != Path.cwd():
        relative = Path(os.path.relpath(path.absolute(), output.parent.absolute())).as_posix()
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


def _runs(path: Path, time: Listing | None, layout: Format) -> int:
    """Return how many runs a file has, by the starts of its clock; 1 where that cannot be read."""
    if time is None or layout.block == "all":
        return 1
    return 1 + int((np.diff(_values(path, time, layout, "s")) < 0).sum())


def _values(path: Path, listing: Listing, layout: Format, unit: str, own_unit: str | None = None) -> Floats:
    """Return the finite values of a column in a unit; none where it cannot be read."""
    column = column_from_toml(tomllib.loads(f"column = {_reference(listing)}")["column"])
    if own_unit is not None:
        column = attrs.evolve(column, unit=own_unit)
    try:
        values = read_table(path, {"read": column}, {"read": unit}, layout, missing=True).columns["read"]
    except InputError:
        return np.empty(0)
    return values[np.isfinite(values)]


def _rests(path: Path, listing: Listing, layout: Format) -> bool:
    """Return whether a column may be a displacement, and is constant throughout, which none is."""
    if not _fitting([listing], _LENGTHS, _STROKE, set()):
        return False
    values = _values(path, listing, layout, "m", listing.unit or "m")
    return values.size > 1 and float(np.ptp(values)) == 0


def _lone_force(listings: Sequence[Listing], used: set[str]) -> Listing | None:
    """Return the only column in a unit of force that is left, whatever it is called; None where there are several."""
    left = [
        each
        for each in _fitting(listings, _FORCES, re.compile(""), used)
        if (unit := each.unit or _unit_in_name(each)) and _is_of(unit, _FORCES)
    ]
    used.update(each.column for each in left[:1] if len(left) == 1)
    return left[0] if len(left) == 1 else None


def _other(listings: Sequence[Listing], chosen: Listing | None, used: set[str]) -> tuple[str, str]:
    """Return a comment on other columns that could be the tangential load."""
    others = [_name(each) for each in _fitting(listings, _FORCES, _TANGENTIAL, used)] if chosen else []
    return "", f"or {', '.join(map(_quoted, others))}" if others else ""


def _found(listings: Sequence[Listing], kinds: Sequence[str], name: re.Pattern[str], used: set[str]) -> Listing | None:
    """Return the column with a fitting name and unit: one alone, or of several the first by `_FIRST_OF_SEVERAL`."""
    fitting = _fitting(listings, kinds, name, used)
    for first in _FIRST_OF_SEVERAL if len(fitting) > 1 else ():
        meant = [each for each in fitting if first.search(_name(each))]
        if len(meant) == 1:
            fitting = meant
            break
    if len(fitting) != 1:
        return None
    used.add(fitting[0].column)
    return fitting[0]


def _fitting(listings: Sequence[Listing], kinds: Sequence[str], name: re.Pattern[str], used: set[str]) -> list[Listing]:
    return [
        each
        for each in listings
        if each.column not in used
        and each.values != "a text"
        and name.search(_name(each))
        and not _SHARE.search(_name(each))
        and (not (unit := each.unit or _unit_in_name(each)) or _is_of(unit, kinds))
    ]


def _pressing(path: Path, listing: Listing | None, layout: Format) -> tuple[str, str]:
    """Return a key for a normal load below zero, and a comment; empty where it presses, or cannot be read."""
    if listing is None:
        return "", ""
    # the sign needs no unit: N stands for one that is still open
    unit = f"{listing.unit}f" if listing.unit and _is_of(listing.unit, ("kg",)) else listing.unit or "N"
    values = _values(path, listing, layout, "N", unit)
    below = int((values < 0).sum())
    if not below:
        return "", ""
    if values.mean() < 0:
        return "scale = -1", "pressing counts negative in the file"
    if -values.min() <= NOISE * values.max():
        return "negative_as_zero = true", f"{counted(below, 'sample is', 'samples are')} a little below zero"
    return "", f"{counted(below, 'sample is', 'samples are')} below zero: what is the zero of the load?"


def _reference(listing: Listing) -> str:
    return listing.column.partition(" # ")[0]


def _key(key: str, listing: Listing | None, unit: str, sign: tuple[str, str] = ("", "")) -> str:
    if listing is None:
        return f'{key} = "{UNKNOWN}"  # fill in: one of the columns above'
    reference, comment, extra = _reference(listing), "", list[str]()
    if not listing.unit and (named_unit := _unit_in_name(listing)):
        extra.append(f'unit = "{named_unit}"')
        comment = "  # as its name ends: check it"
    elif not listing.unit and (stated := _stated_unit(listing, unit)):
        extra.append(f'unit = "{stated}"')
        comment = "  # as the file says in its text: check it"
    elif not listing.unit:
        extra.append(f'unit = "{UNKNOWN}"')
        comment = f'  # fill in, as in "{unit}"'
    elif key.endswith("_load") and _is_of(listing.unit, ("kg",)):
        extra.append(f'unit = "{listing.unit}f"')
        comment = "  # a balance: its masses are forces"
    more, why = sign
    if more:
        extra.append(more)
    if why:
        comment += f"; {why}" if comment else f"  # {why}"
    if not extra:
        return f"{key} = {reference}{comment}"
    inner = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return f"{key} = {{ {inner}, {', '.join(extra)} }}{comment}"


def _name(listing: Listing) -> str:
    """Return the name of a column; empty where it has none, or one that may be its neighbour's."""
    match = re.search(r'"((?:[^"\\]|\\.)*)"', listing.column.partition(" # under ")[0])
    return match[1] if match else ""


def _unit_in_name(listing: Listing) -> str:
    """Return the unit at the end of the name of a column; readers of files take none from there."""
    match = _UNIT_IN_NAME.fullmatch(_name(listing))
    return match[1] if match else ""


def _stated_unit(listing: Listing, like: str) -> str:
    """Return the unit that the text of a file says for a column; empty where it says none, or several fit as well."""
    fitting = [(of, unit) for of, unit in listing.stated if _is_of(unit, (like,))]
    words = set(re.findall(r"[^\W\d_]{3,}", _name(listing).lower()))
    named = {unit for of, unit in fitting if words & set(re.findall(r"[^\W\d_]{3,}", of))}
    units = named or {unit for _, unit in fitting}
    return units.pop() if len(units) == 1 else ""


def _is_of(unit: str, kinds: Iterable[str]) -> bool:
    for kind in kinds:
        try:
            conversion_factor(unit.partition(",")[0], kind)
        except InputError:
            continue
        return True
    return False


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
