"""Suggested ``[loading]`` for a file of numbers, from the names and units of its columns."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.tables import Format, Listing
from historysim.tables.column_roles import (
    NORMAL,
    NOT_A_STROKE,
    STROKE,
    TANGENTIAL,
    RawColumns,
    column_name,
    column_reference,
    find_across,
    find_coefficient,
    find_column,
    find_forces,
    find_rate,
    find_ratios,
    find_still_columns,
    find_times,
    find_trace_and_retrace,
    read_columns,
    select_time,
    time_unit,
    unit_in_name,
    unit_of_steps,
    values_in_unit,
)
from historysim.tables.run_column import find_run_column


def suggest_loading(
    path: Path,
    listings: Sequence[Listing],
    layout: Format,
    blocks: int = 1,
    *,
    files: Sequence[Path] = (),
) -> str:
    """Suggest a section ``[loading]`` in TOML for a file with these columns, with ``"?"`` for unknown values.

    The path is relative to the scenario; ``blocks`` is the number of tables in the file. With
    ``files``, a folder, a pattern or several files of these columns, each file is a run.
    """
    lines = ["[loading]", f"file = {_quote_files(files or [path])}"]
    lines += ['run = "each"  # each file is a run'] if files else []
    if blocks > 1:
        layout = attrs.evolve(layout, block=layout.block or 1)
        lines.append(f"block = {layout.block}  # of {blocks}")
    layout, raw = _read_with_decimal(path, listings, layout)
    layout_keys = {
        key: getattr(layout, key) for key in ("delimiter", "decimal", "header", "encoding", "sheet")
    }
    lines += [
        f"{key} = {_quote(of)}" for key, of in layout_keys.items() if of != getattr(Format(), key)
    ]
    interval = find_rate(path, listings, layout)
    times = find_times(raw, listings, None if interval is None else 1 / interval[0])
    time = select_time(raw, times, listings)
    still = find_still_columns(raw, [listing for listing in listings if listing not in times], time)
    rows = max((values.size for values in raw.values()), default=0)
    short = [listing for listing, values in raw.items() if 2 * values.size < rows]
    moving = [listing for listing in listings if listing not in (*still, *times, *short)]
    ratios = find_ratios(raw, moving)
    lateral = [listing for listing in moving if find_column([listing], "N", TANGENTIAL[:1])]
    normal = find_column(
        [listing for listing in moving if listing not in (*lateral, *ratios)], "N", NORMAL
    )
    across = find_across(listings)
    remaining = [
        listing for listing in moving if listing not in (normal, *ratios, *across.values())
    ]
    friction = find_column(remaining, "N", TANGENTIAL)
    stroke = find_column(
        [listing for listing in remaining if not NOT_A_STROKE.search(column_name(listing))],
        "m",
        STROKE,
    )
    depth = None if stroke else find_column(remaining, "m", (NOT_A_STROKE.pattern,))
    normal, friction = find_forces(
        raw, remaining, normal, friction, only_normal=stroke is None and depth is not None
    )
    if (both := find_trace_and_retrace(remaining)) is not None:
        friction = both[0]
        stroke = stroke or find_column(remaining, "m", ("dist|scan|length",))
    coefficient = (
        None
        if friction
        else find_coefficient(remaining) or (ratios[0] if len(ratios) == 1 else None)
    )
    lines += [] if files else _run_lines(path, raw, time, layout)
    lines += _time_lines(raw, time, interval)
    lines += [
        f"# {column_reference(item)} is constant, or the amplitude of a faster motion: no displacement"
        for item in still
        if find_column([item], "m", STROKE)
    ]
    is_absent = normal is None and not find_column(listings, "", NORMAL)
    if is_absent and (friction or coefficient or stroke):
        lines.append(
            f'normal_load = {{ constant = "{_guessed_load(raw, friction)}" }}  # a guess: fill it in'
        )
    else:
        lines.append(
            _key(
                "normal_load",
                normal,
                "mN",
                *_pressing(raw, normal),
                stated=_assumed_unit(raw, normal, "N"),
            )
        )
    if (friction or coefficient) and not stroke:
        # a load recorded without a displacement was the controlled quantity
        saturate = "saturate = true  # a tangential load beyond the friction limit is held there"
        lines.insert(lines.index(""), saturate)
        controlled = (
            _times_load(coefficient)
            if coefficient
            else _tangential_keys(raw, "tangential_load", friction, "mN", across)
        )
        return "\n".join([*lines, *controlled])
    if normal and depth and not friction:
        key = _key("normal_displacement", depth, "µm", stated=_assumed_unit(raw, depth, "m"))
        return "\n".join([*lines, "", "[loading.response]", key])
    lines += _tangential_keys(raw, "tangential_displacement", stroke, "µm", across)
    if stroke in across:
        # a response has one tangential direction
        return "\n".join(lines)
    if coefficient:
        return "\n".join([*lines, "", "[loading.response]", *_times_load(coefficient)])
    back = "" if both is None else f"retrace = {column_reference(both[1])}"
    stated = _assumed_unit(raw, friction, "N")
    key = _key("tangential_load", friction, "mN", back, stated=stated)
    response = ["", "[loading.response]", key] if friction else []
    return "\n".join(lines + response)


def _read_with_decimal(
    path: Path, listings: Sequence[Listing], layout: Format
) -> tuple[Format, "RawColumns"]:
    """Read the columns; with a decimal comma if more of them are numbers then."""
    raw = read_columns(path, listings, layout)
    if layout.decimal == "." and layout.delimiter != "," and len(raw) < len(listings):
        with_comma = attrs.evolve(layout, decimal=",")
        if read_columns(path, [listing for listing in listings if listing not in raw], with_comma):
            return with_comma, read_columns(path, listings, with_comma)
    return layout, raw


def _run_lines(path: Path, raw: "RawColumns", time: Listing | None, layout: Format) -> list[str]:
    """Return the keys that select one of several runs; empty for a single run."""
    if time and (count := 1 + int((np.diff(values_in_unit(raw, time, "s")) < 0).sum())) > 1:
        return [f'run = 1  # of {count:,}, the clock starts again; run = "each" evaluates all']
    if runs := find_run_column(path, layout):
        each = f'run = {runs.numbers[0]}  # of {runs.runs_text}; run = "each" evaluates all'
        return [f"runs_by = {_quote(runs.name)}", each]
    return []


def _time_lines(
    raw: "RawColumns", time: Listing | None, interval: tuple[float, str] | None
) -> list[str]:
    """Return the sampling rate above, or the time column below, the heading of the columns."""
    if time is not None:
        return ["", "[loading.columns]", _time_key(raw, time, interval)]
    if interval is not None:
        return [f'rate = "{interval[0]:.10g} Hz"  # {interval[1]}', "", "[loading.columns]"]
    return [
        "",
        "[loading.columns]",
        "# no column looks like time: without it, the row is the clock",
    ]


def suggest_scenario(
    path: Path,
    output: Path,
    listings: Sequence[Listing],
    layout: Format,
    blocks: int = 1,
    *,
    files: Sequence[Path] = (),
) -> str:
    """Suggest a scenario in TOML for the file ``output``; keys that do not follow from columns are comments."""
    named = relative = [*(files or [path])]
    if output.parent.absolute() != Path.cwd():
        relative = [
            Path(os.path.relpath(file.absolute(), output.parent.absolute())) for file in named
        ]
    loading = suggest_loading(path, listings, layout, blocks, files=files)
    loading = loading.replace(
        f"file = {_quote_files(named)}", f"file = {_quote_files(relative)}", 1
    )
    fit = "" if "[loading.response]" not in loading else _FIT
    return f"title = {_quote(path.stem)}\n{_HEAD}\n{loading}\n{fit}"


GUESSED_FRICTION = 0.2
# Largest displacement and load of a file without units that is taken to be in SI.
_LARGEST_IN_SI = {"m": 5e-3, "N": 1e3}
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


def _times_load(listing: Listing) -> list[str]:
    """Return the key of a tangential load: a column of coefficients times the normal load."""
    reference = column_reference(listing)
    column = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return [
        f'tangential_load = {{ {column}, times = "normal_load" }}  # a coefficient, times the normal load'
    ]


def _guessed_load(raw: RawColumns, friction: Listing | None) -> str:
    """Guess a normal load from the largest tangential load and the guessed coefficient, to one digit."""
    values = values_in_unit(raw, friction, "N") if friction else np.empty(0)
    largest = float(np.abs(values).max(initial=0.0)) / GUESSED_FRICTION
    return quantity_text(float(f"{largest:.0e}"), "N") if largest > 0 else "1 N"


def _pressing(raw: RawColumns, listing: Listing | None) -> tuple[str, str]:
    """Return a key and a comment for a negative normal load; empty if it is positive or cannot be read."""
    values = np.empty(0) if listing is None else values_in_unit(raw, listing, "N")
    if not (below := int((values < 0).sum())):
        return "", ""
    if values.mean() < 0:
        return "scale = -1", "compression is negative in the file"
    return (
        "",
        f"{count_text(below, 'sample is', 'samples are')} below zero; if that is noise: negative_as_zero = true",
    )


_NO_UNIT, _BY_NAME = "no unit in the file: check it", "from its name: check it"


def _key(
    key: str,
    listing: Listing | None,
    unit: str,
    more: str = "",
    reason: str = "",
    *,
    stated: str = "",
    origin: str = _NO_UNIT,
) -> str:
    """Return the line of a key; ``stated`` is a unit that the file does not state, and ``origin`` its origin."""
    if listing is None:
        return f'{key} = "?"  # fill in: one of the columns above'
    reference = column_reference(listing)
    extra = [more]
    if not listing.unit or stated:
        named = unit_in_name(listing)
        extra.insert(0, f'unit = "{named or stated or "?"}"')
        origin = _BY_NAME if named else origin if stated else f'fill in, as in "{unit}"'
        reason = "; ".join(filter(None, [reason, origin]))
    comment = f"  # {reason}" if reason else ""
    if not any(extra):
        return f"{key} = {reference}{comment}"
    inner = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return f"{key} = {{ {', '.join(filter(None, [inner, *extra]))} }}{comment}"


def _time_key(raw: RawColumns, listing: Listing, interval: tuple[float, str] | None) -> str:
    """Return the key of the time column, whose unit may follow from its name or the sampling interval."""
    unit = time_unit(listing)
    if unit and unit == listing.unit:
        return _key("time", listing, "s")
    if unit:
        return _key("time", listing, "s", stated=unit, origin=_BY_NAME)
    if interval and (unit := unit_of_steps(raw[listing], 1 / interval[0])):
        return _key("time", listing, "s", stated=unit, origin=f"by {interval[1]}")
    return _key("time", listing, "s", stated="s")


def _assumed_unit(raw: RawColumns, listing: Listing | None, unit: str) -> str:
    """Return the SI unit if a file without units is plausible in SI, else an empty string."""
    if (
        listing is None
        or listing.unit
        or unit_in_name(listing)
        or not (values := values_in_unit(raw, listing, unit)).size
    ):
        return ""
    largest = float(np.ptp(values) if unit == "m" else np.abs(values).max())
    return unit if 0 < largest <= _LARGEST_IN_SI[unit] else ""


def _tangential_keys(
    raw: RawColumns,
    key: str,
    listing: Listing | None,
    unit: str,
    across: Mapping[Listing | None, Listing],
) -> list[str]:
    """Return the key of a tangential channel and, if it has a column along y, the key of that column."""
    si = "m" if key.endswith("displacement") else "N"
    keys = [_key(key, listing, unit, stated=_assumed_unit(raw, listing, si))]
    if listing not in across:
        return keys
    return [
        *keys,
        _key(f"{key}_y", across[listing], unit, stated=_assumed_unit(raw, across[listing], si)),
    ]


def _quote_files(files: Sequence[Path]) -> str:
    """Return a path, or an array of paths, in TOML."""
    names = [_quote(file.as_posix()) for file in files]
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _quote(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
