"""Suggested ``[loading]`` for a file of numbers, from the names and units of its columns."""

import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor, quantity_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.tables import Column, Format, Listing, read_table
from historysim.tables.columns import split_unit
from historysim.tables.run_column import find_run_column

# A word starts at the start of a name, or after a device or a group, and ends before a non-letter.
_AT, _END = r"^(?:.*[./:|>])?\W*", r"(?![^\W\d_])"
_WORD = r"(?<![^\W\d_])"
# Names of the columns of a channel in English, German, French, Chinese and Japanese, the most likely first; a pattern
# counts if exactly one column matches, or several of one name.
_TIME = (
    rf"{_AT}(time(stamp)?|zeit|temps|elapsed|t|时间|時間|时刻|時刻){_END}",
    rf"^\W*(?-i:t){_END}",
    rf"{_WORD}(time|temps){_END}|zeit{_END}|uhrzeit|时间|時間|时刻|時刻",
)
_NORMAL = (
    "normal|press|applied|法向|正压|法線|垂直|押(し)?付",
    rf"{_AT}(fn|fz|f_n|n|load|p){_END}",
    (
        rf"{_WORD}(?:ball|dead|axial|vertical|contact|clamp(?:ing)?|specimen|preload)\W*(?:load|force|weight)?{_END}"
        rf"|{_WORD}(?:preload|weight|last|charge){_END}|auflast|axialkraft|anpress|vorspann|appui"
        "|载荷|載荷|荷载|荷重|负荷|負荷"
    ),
)
_TANGENTIAL = (
    r"fric|tang|reib|shear|traction|querkraft|schub|scher|frott|cisaill|摩擦|切向|剪切|接線|せん断",
    rf"{_AT}(ff|ft|f_t){_END}",
    rf"{_AT}fx{_END}",
    rf"lateral|横向|{_AT}(fy|t|q){_END}",
)
_ANY_FORCE = (
    rf"{_AT}f{_END}",
    rf"{_WORD}(force|effort){_END}|kraft|力",
)
_STROKE = (
    "^(?!.*normal).*(tang|lateral|shear|slid|接線|切向)",
    "disp|weg|verschieb|d[eé]placement|位移|変位|滑移|すべり",
    rf"stroke|pos|行程|ストローク|course|auslenk|{_WORD}(hub|slip){_END}",
    rf"{_AT}(x|u|ux|s|dx){_END}",
)
# A coefficient of friction is not a load; a depth, a height or wear is not a tangential displacement.
_RATIO = re.compile(r"(?i)coef|(?<![^\W_])cof|ratio|beiwert|zahl|系数|係数|率")
# Names of friction coefficients, which times the normal load are the tangential load.
_COEFFICIENT = re.compile(
    r"(?i)(?<![^\W_])cof(?![^\W\d_])|fric\w*\W*coef|coef\w*.*fri?[co]t|reib\w*(beiwert|zahl|koeff)|摩擦(系数|係数)"
)
_NOT_A_STROKE = re.compile(
    r"(?i)depth|indent|penetr|approach|height|wear|normal|vertical|eindring|tiefe|höhe|verschleiß|verschleiss|profond|usure"
    r"|深|高度|高さ|压入|圧入|押込|磨损|磨耗|摩耗"
)
_UNIT = r"(s|ms|us|µs|μs|min|N|mN|uN|µN|μN|nN|kN|mm|um|µm|μm|nm)"
# A unit at the end of a name, as in ``Fx_mN``, ``Weg in µm``, ``Force, N``, ``F/N`` or ``Force N``; letters that often
# have another meaning are left out.
_UNIT_IN_NAME = re.compile(rf".+?(?:_|\s+in\s+|[,;:/]\s*|\s+|-){_UNIT}")


def suggest_loading(path: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Suggest a section ``[loading]`` in TOML for a file with these columns, with ``"?"`` for unknown values.

    The path is relative to the scenario; ``blocks`` is the number of tables in the file.
    """
    lines = ["[loading]", f"file = {_quote(path.as_posix())}"]
    if blocks > 1:
        layout = attrs.evolve(layout, block=layout.block or 1)
        lines.append(f"block = {layout.block}  # of {blocks}")
    if any(re.fullmatch(r"[+-]?\d+,\d+(e[+-]?\d+)?", listing.first_value, re.IGNORECASE) for listing in listings):
        layout = attrs.evolve(layout, decimal=",")
    layout_keys = {key: getattr(layout, key) for key in ("delimiter", "decimal", "header", "encoding", "sheet")}
    lines += [f"{key} = {_quote(of)}" for key, of in layout_keys.items() if of != getattr(Format(), key)]
    time = _find_column(listings, "s", _TIME)
    lateral = [listing for listing in listings if _find_column([listing], "N", _TANGENTIAL[:1])]
    normal = _find_column([listing for listing in listings if listing not in (time, *lateral)], "N", _NORMAL)
    across = _along_y(listings)
    remaining = [listing for listing in listings if listing not in (time, normal, *across.values())]
    friction = _find_column(remaining, "N", _TANGENTIAL)
    stroke = _find_column([listing for listing in remaining if not _NOT_A_STROKE.search(_name(listing))], "m", _STROKE)
    depth = None if stroke else _find_column(remaining, "m", (_NOT_A_STROKE.pattern,))
    normal, friction = _any_forces(
        path, remaining, layout, normal, friction, only_normal=stroke is None and depth is not None
    )
    if (both := _trace_and_retrace(remaining)) is not None:
        friction, stroke = both[0], stroke or _find_column(remaining, "m", ("dist|scan|length",))
    coefficient = None if friction else _coefficient(remaining)
    if time and (count := 1 + int((np.diff(_values(path, time, layout, "s")) < 0).sum())) > 1:
        lines.append(f'run = 1  # of {count:,}, the clock starts again; run = "each" is for loops, sliding and fit')
    elif runs := find_run_column(path, layout):
        lines.append(f"runs_by = {_quote(runs.name)}")
        lines.append(f'run = {runs.numbers[0]}  # of {runs.runs_text}; run = "each" is for loops, sliding and fit')
    lines += ["", "[loading.columns]"]
    lines.append(_key("time", time, "s") if time else "# no column looks like time: without it, the row is the clock")
    if normal is None and (friction or coefficient or stroke) and not _find_column(listings, "", _NORMAL):
        lines.append(f'normal_load = {{ constant = "{_guessed_load(path, friction, layout)}" }}  # a guess: fill it in')
    else:
        lines.append(_key("normal_load", normal, "mN", *_pressing(path, normal, layout)))
    if (friction or coefficient) and not stroke:
        # a load recorded without a displacement was the controlled quantity
        saturate = "saturate = true  # a tangential load beyond the friction limit is held there"
        lines.insert(lines.index(""), saturate)
        controlled = (
            _times_load(coefficient) if coefficient else _tangential_keys("tangential_load", friction, "mN", across)
        )
        return "\n".join([*lines, *controlled])
    if normal and depth and not friction:
        return "\n".join([*lines, "", "[loading.response]", _key("normal_displacement", depth, "µm")])
    lines += _tangential_keys("tangential_displacement", stroke, "µm", across)
    if stroke in across:
        # a response has one tangential direction
        return "\n".join(lines)
    if coefficient:
        return "\n".join([*lines, "", "[loading.response]", *_times_load(coefficient)])
    back = "" if both is None else f"retrace = {_reference(both[1])}"
    response = ["", "[loading.response]", _key("tangential_load", friction, "mN", back)] if friction else []
    return "\n".join(lines + response)


def suggest_scenario(path: Path, output: Path, listings: Sequence[Listing], layout: Format, blocks: int = 1) -> str:
    """Suggest a scenario in TOML for the file ``output``; keys that do not follow from columns are comments."""
    if output.parent.absolute() != Path.cwd():
        relative = Path(os.path.relpath(path.absolute(), output.parent.absolute())).as_posix()
    else:
        relative = path.as_posix()
    loading = suggest_loading(path, listings, layout, blocks)
    loading = loading.replace(f"file = {_quote(path.as_posix())}", f"file = {_quote(relative)}", 1)
    fit = "" if "[loading.response]" not in loading else _FIT
    return f"title = {_quote(path.stem)}\n{_HEAD}\n{loading}\n{fit}"


GUESSED_FRICTION = 0.2

_HEAD = """
[materials]  # fill in: both materials, by name or as { name = …, youngs_modulus = …, poissons_ratio = … }
# first = "silicon"
# second = "float glass"

[surface]
kind = "sphere"  # or "random", "measured", "summits", …
# radius = "2.5 mm"  # fill in

[friction]
coefficient = GUESS  # a guess, the starting value of a fit
""".replace("GUESS", str(GUESSED_FRICTION))
_FIT = """
# [instrument]  # if the displacement was measured at the drive, in series with a spring
# lateral_stiffness = "300 mN/µm"

[fit]
parameters = ["friction"]  # and "lateral_stiffness", with [instrument]
"""


def _values(path: Path, listing: Listing, layout: Format, unit: str) -> Floats:
    """Return the finite values of a column in a unit, the default for an unknown unit; empty if it cannot be read."""
    reference = tomllib.loads(f"column = {_reference(listing)}")["column"]
    column = Column(**reference) if isinstance(reference, dict) else Column(reference)
    column = attrs.evolve(column, unit=listing.unit or _unit_in_name(listing) or unit)
    try:
        values = read_table(path, {"read": column}, {"read": unit}, layout, missing=True).columns["read"]
    except InputError:
        return np.empty(0)
    return values[np.isfinite(values)]


def _find_column(listings: Sequence[Listing], unit: str, patterns: Sequence[str]) -> Listing | None:
    """Find the column that alone matches a pattern and a unit, by the first such pattern.

    Of several columns of one name, e.g. of several tests, the first. An empty unit matches any column.
    """
    for pattern in patterns:
        fitting = [
            listing
            for listing in listings
            if re.search(pattern, _name(listing), re.IGNORECASE)
            and not _RATIO.search(_name(listing))
            and listing.values != "a text"
            and (not unit or _is_of(listing.unit or _unit_in_name(listing) or unit, unit))
        ]
        if fitting and len({re.split(r"[.:|>}]", _name(listing))[-1] for listing in fitting}) == 1:
            return fitting[0]
    return None


def _coefficient(listings: Sequence[Listing]) -> Listing | None:
    """Return the column of friction coefficients; None unless exactly one column has such a name."""
    fitting = [
        listing
        for listing in listings
        if _COEFFICIENT.search(_name(listing)) and listing.values != "a text" and listing.unit in {"", "1"}
    ]
    return fitting[0] if len(fitting) == 1 else None


def _times_load(listing: Listing) -> list[str]:
    """Return the key of a tangential load: a column of coefficients times the normal load."""
    reference = _reference(listing)
    column = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return [f'tangential_load = {{ {column}, times = "normal_load" }}  # a coefficient, times the normal load']


def _trace_and_retrace(listings: Sequence[Listing]) -> tuple[Listing, Listing] | None:
    """Return the columns of trace and retrace of a force, by name; None unless there is exactly one pair."""
    names = {_name(listing).lower(): listing for listing in listings if _is_of(listing.unit or "N", "N")}
    pairs = [
        (names[trace], listing)
        for name, listing in names.items()
        if (trace := name.replace("retrace", "trace")) != name and trace in names
    ]
    return pairs[0] if len(pairs) == 1 else None


def _any_forces(
    path: Path,
    listings: Sequence[Listing],
    layout: Format,
    normal: Listing | None,
    friction: Listing | None,
    *,
    only_normal: bool,
) -> tuple[Listing | None, Listing | None]:
    """Return the columns of normal load and friction, completed by columns with the plain name of a force.

    Of two forces the one with less scatter relative to its mean is the normal load.
    """
    if normal and friction:
        return normal, friction
    forces = [
        listing
        for listing in listings
        if listing not in (normal, friction) and _find_column([listing], "N", _ANY_FORCE)
    ]
    if not forces or len(forces) > 2:
        return normal, friction
    steady = [_steadiness(_values(path, listing, layout, "N")) for listing in forces]
    if len(forces) == 2:
        both = (forces[0], forces[1]) if steady[0] > steady[1] else (forces[1], forces[0])
        return both if normal is None and friction is None else (normal, friction)
    if normal is None and (friction or only_normal):
        return forces[0], friction
    return normal, friction or forces[0]


def _steadiness(values: Floats) -> float:
    """Return the absolute mean of a channel divided by its standard deviation."""
    return float(abs(values.mean()) / (values.std() or 1e-300)) if values.size else 0.0


def _guessed_load(path: Path, friction: Listing | None, layout: Format) -> str:
    """Guess a normal load from the largest tangential load and the guessed coefficient, to one digit."""
    values = _values(path, friction, layout, "N") if friction else np.empty(0)
    largest = float(np.abs(values).max(initial=0.0)) / GUESSED_FRICTION
    return quantity_text(float(f"{largest:.0e}"), "N") if largest > 0 else "1 N"


def _pressing(path: Path, listing: Listing | None, layout: Format) -> tuple[str, str]:
    """Return a key and a comment for a negative normal load; empty if it is positive or cannot be read."""
    values = np.empty(0) if listing is None else _values(path, listing, layout, "N")
    if not (below := int((values < 0).sum())):
        return "", ""
    if values.mean() < 0:
        return "scale = -1", "compression is negative in the file"
    return "", f"{count_text(below, 'sample is', 'samples are')} below zero; if that is noise: negative_as_zero = true"


def _key(key: str, listing: Listing | None, unit: str, more: str = "", reason: str = "") -> str:
    if listing is None:
        return f'{key} = "?"  # fill in: one of the columns above'
    reference, extra = _reference(listing), [more]
    if not listing.unit:
        unit_in_name = _unit_in_name(listing)
        extra.insert(0, f'unit = "{unit_in_name or "?"}"')
        reason = "; ".join(
            filter(None, [reason, "from its name: check it" if unit_in_name else f'fill in, as in "{unit}"'])
        )
    comment = f"  # {reason}" if reason else ""
    if not any(extra):
        return f"{key} = {reference}{comment}"
    inner = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return f"{key} = {{ {', '.join(filter(None, [inner, *extra]))} }}{comment}"


def _tangential_keys(
    key: str, listing: Listing | None, unit: str, across: Mapping[Listing | None, Listing]
) -> list[str]:
    """Return the key of a tangential channel and, if it has a column along y, the key of that column."""
    keys = [_key(key, listing, unit)]
    return keys if listing not in across else [*keys, _key(f"{key}_y", across[listing], unit)]


def _along_y(listings: Sequence[Listing]) -> dict[Listing | None, Listing]:
    """Return the columns ``NAME y`` by the columns ``NAME x`` of tables with two tangential directions."""
    names = {split_unit(_name(listing))[0]: listing for listing in listings}
    return {
        listing: names[f"{stem} y"]
        for name, listing in names.items()
        if (stem := name.removesuffix(" x")) != name and f"{stem} y" in names
    }


def _reference(listing: Listing) -> str:
    return listing.column.partition(" # ")[0]


def _name(listing: Listing) -> str:
    """Return the name of a column; empty if it has none, or an ambiguous one."""
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


def _quote(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
