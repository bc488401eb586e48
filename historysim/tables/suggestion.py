"""Suggested ``[loading]`` for a file of numbers, from the names and units of its columns."""

import json
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor, is_common, quantity_text
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.tables import Column, Format, Listing, header_lines, read_table
from historysim.tables.columns import split_unit
from historysim.tables.run_column import find_run_column
from historysim.tables.sampling import entry_rate, header_rate, is_even_time, is_time

# A word starts at the start of a name, or after a device or a group, and ends before a non-letter.
_AT, _END = r"^(?:.*[./:|>])?\W*", r"(?![^\W\d_])"
_WORD = r"(?<![^\W\d_])"
# Names of the columns of a channel in English, German, French, Chinese and Japanese, the most
# likely first; a pattern counts if exactly one column matches, or several of one name.
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
# A coefficient of friction is not a load; a depth, a height or wear is not a tangential
# displacement.
_RATIO = re.compile(
    r"(?i)coef|(?<![^\W_])cof|ratio|reibwert|beiwert|zahl|系数|係数|率|^\W*(?:[µμ]|mu)(?![^\W\d_])"
)
# Names of friction coefficients, which times the normal load are the tangential load.
_COEFFICIENT = re.compile(
    r"(?i)(?<![^\W_])cof(?![^\W\d_])|fric\w*\W*coef|coef\w*.*fri?[co]t|reib\w*(wert|zahl|koeff)|摩擦(系数|係数)"
    r"|^\W*(?:[µμ]|mu)(?![^\W\d_])"
)
# values of a tangential column without a unit up to which it is one of coefficients
_LARGEST_COEFFICIENT = 2.0
_NOT_A_STROKE = re.compile(
    r"(?i)depth|indent|penetr|approach|height|wear|normal|vertical|eindring|tiefe|höhe|verschleiß|verschleiss|profond|usure"
    r"|深|高度|高さ|压入|圧入|押込|磨损|磨耗|摩耗|amplitu[dt]|(?<![^\W_])(?:p-?p|pk-?pk|peak)(?![^\W\d_])|振幅"
)
_FREQUENCY = re.compile(r"(?i)freq|frequenz|周波数|频率")
# Names of counters of rows or cycles, which rise in even steps as times do.
_COUNTER = re.compile(
    rf"(?i)^[\W_]*(?:index|idx|i|n|no|nr|num\w*|nummer|samples?|points?|punkte?|row|zeile|records?|count\w*|id|frame|"
    rf"cycles?|zykl\w*|loops?|steps?|messpunkt|行|番号|序号){_END}"
)
_UNIT = r"(s|ms|us|µs|μs|min|N|mN|uN|µN|μN|nN|kN|mm|um|µm|μm|nm)"
# A unit at the end of a name, as in ``Fx_mN``, ``Weg in µm``, ``Force, N``, ``F/N`` or ``Force N``;
# letters that often have another meaning are left out.
_UNIT_IN_NAME = re.compile(rf".+?(?:_|\s+in\s+|[,;:/]\s*|\s+|-){_UNIT}")


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
    interval = _header_rate(path, listings, layout)
    times = _time_columns(raw, listings, None if interval is None else 1 / interval[0])
    time = _time_of_channels(raw, times, listings)
    still = _still_columns(raw, [listing for listing in listings if listing not in times], time)
    rows = max((values.size for values in raw.values()), default=0)
    short = [listing for listing, values in raw.items() if 2 * values.size < rows]
    moving = [listing for listing in listings if listing not in (*still, *times, *short)]
    ratios = _unnamed_ratios(raw, moving)
    lateral = [listing for listing in moving if _find_column([listing], "N", _TANGENTIAL[:1])]
    normal = _find_column(
        [listing for listing in moving if listing not in (*lateral, *ratios)], "N", _NORMAL
    )
    across = _along_y(listings)
    remaining = [
        listing for listing in moving if listing not in (normal, *ratios, *across.values())
    ]
    friction = _find_column(remaining, "N", _TANGENTIAL)
    stroke = _find_column(
        [listing for listing in remaining if not _NOT_A_STROKE.search(_name(listing))], "m", _STROKE
    )
    depth = None if stroke else _find_column(remaining, "m", (_NOT_A_STROKE.pattern,))
    normal, friction = _any_forces(
        raw, remaining, normal, friction, only_normal=stroke is None and depth is not None
    )
    if (both := _trace_and_retrace(remaining)) is not None:
        friction, stroke = both[0], stroke or _find_column(remaining, "m", ("dist|scan|length",))
    coefficient = (
        None if friction else _coefficient(remaining) or (ratios[0] if len(ratios) == 1 else None)
    )
    lines += [] if files else _run_lines(path, raw, time, layout)
    lines += _time_lines(raw, time, interval)
    lines += [
        f"# {_reference(item)} is constant, or the amplitude of a faster motion: no displacement"
        for item in still
        if _find_column([item], "m", _STROKE)
    ]
    is_absent = normal is None and not _find_column(listings, "", _NORMAL)
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
    back = "" if both is None else f"retrace = {_reference(both[1])}"
    stated = _assumed_unit(raw, friction, "N")
    key = _key("tangential_load", friction, "mN", back, stated=stated)
    response = ["", "[loading.response]", key] if friction else []
    return "\n".join(lines + response)


def _read_with_decimal(
    path: Path, listings: Sequence[Listing], layout: Format
) -> tuple[Format, "_Raw"]:
    """Read the columns; with a decimal comma if more of them are numbers then."""
    raw = _read_columns(path, listings, layout)
    if layout.decimal == "." and layout.delimiter != "," and len(raw) < len(listings):
        with_comma = attrs.evolve(layout, decimal=",")
        if _read_columns(path, [listing for listing in listings if listing not in raw], with_comma):
            return with_comma, _read_columns(path, listings, with_comma)
    return layout, raw


def _run_lines(path: Path, raw: "_Raw", time: Listing | None, layout: Format) -> list[str]:
    """Return the keys that select one of several runs; empty for a single run."""
    if time and (count := 1 + int((np.diff(_values(raw, time, "s")) < 0).sum())) > 1:
        return [f'run = 1  # of {count:,}, the clock starts again; run = "each" evaluates all']
    if runs := find_run_column(path, layout):
        each = f'run = {runs.numbers[0]}  # of {runs.runs_text}; run = "each" evaluates all'
        return [f"runs_by = {_quote(runs.name)}", each]
    return []


def _time_lines(raw: "_Raw", time: Listing | None, interval: tuple[float, str] | None) -> list[str]:
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
# median of the absolute difference of two samples of white noise, over its standard deviation
_MEDIAN_STEP = 0.954
# Largest displacement and load of a file without units that is taken to be in SI.
_LARGEST_IN_SI = {"m": 5e-3, "N": 1e3}
# smallest range of a motion, over the noise and over the mean
_LEAST_MOTION, _LEAST_SWING = 12.0, 0.2

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


# finite values of the columns that can be read, in the unit of the file
_Raw = Mapping[Listing, Floats]


def _read_columns(path: Path, listings: Sequence[Listing], layout: Format) -> _Raw:
    """Read the finite values of columns in the unit of the file, without those that cannot be read."""
    listings = [listing for listing in listings if listing.values != "a text"]
    columns = {}
    for number, listing in enumerate(listings):
        reference = tomllib.loads(f"column = {_reference(listing)}")["column"]
        column = Column(**reference) if isinstance(reference, dict) else Column(reference)
        columns[str(number)] = attrs.evolve(column, unit="1")
    try:
        read = read_table(path, columns, dict.fromkeys(columns, "1"), layout, missing=True).columns
    except InputError:
        if len(listings) == 1:
            return {}
        return {
            key: values
            for item in listings
            for key, values in _read_columns(path, [item], layout).items()
        }
    return {listings[int(number)]: values[np.isfinite(values)] for number, values in read.items()}


def _values(raw: _Raw, listing: Listing, unit: str) -> Floats:
    """Return the finite values of a column in a unit, the default for an unknown unit; empty if it cannot be read."""
    try:
        factor = conversion_factor(
            listing.unit.partition(",")[0] or _unit_in_name(listing) or unit, unit
        )
    except InputError:
        return np.empty(0)
    return factor * raw.get(listing, np.empty(0))


def _header_rate(
    path: Path, listings: Sequence[Listing], layout: Format
) -> tuple[float, str] | None:
    """Return the sampling rate [Hz] that the header of a text, or a scalar of a file of arrays, states."""
    for listing in listings:
        if listing.values == "1" or (
            listing.values == "a text" and listing.first_value[:1].isdigit()
        ):
            value, _, unit = listing.first_value.partition(" ")
            label = re.split(r"[./]", split_unit(_name(listing))[0])[-1]
            with suppress(ValueError):
                if rate := entry_rate(
                    label, float(value), unit or listing.unit or _unit_in_name(listing)
                ):
                    return rate, f"{_name(listing)} = {listing.first_value}"
    return header_rate(header_lines(path, layout))


def _time_columns(raw: _Raw, listings: Sequence[Listing], interval: float | None) -> list[Listing]:
    """Return the columns that may hold the times: by name and values, else by unit, else by values alone."""
    rows = max((values.size for values in raw.values()), default=0)
    clocks = [
        listing
        for listing in listings
        if listing in raw and is_time(raw[listing]) and raw[listing].size > 1
    ]
    clocks = (
        [listing for listing in clocks if 2 * raw[listing].size > rows] if rows > 1 else [*listings]
    )
    for pattern in _TIME:
        if named := [listing for listing in clocks if _find_column([listing], "s", (pattern,))]:
            return named
    unnamed = [
        listing
        for listing in clocks
        if is_even_time(raw[listing]) and not _COUNTER.search(_name(listing))
    ]
    if in_time := [listing for listing in unnamed if _time_unit(listing)]:
        return in_time
    of_other_unit = [listing for listing in unnamed if listing.unit and is_common(listing.unit)]
    unknown = [
        listing
        for listing in unnamed
        if listing not in of_other_unit and not _unit_in_name(listing)
    ]
    of_interval = [
        listing for listing in unknown if interval and _unit_of_steps(raw[listing], interval)
    ]
    counted = [listing for listing in unknown if float(np.diff(raw[listing][:2])[0]) == 1]
    quantities = (
        *_NORMAL,
        *_TANGENTIAL,
        *_ANY_FORCE,
        *_STROKE,
        _NOT_A_STROKE.pattern,
        _RATIO.pattern,
    )
    return of_interval or [
        listing
        for listing in unknown
        if listing not in counted and not _find_column([listing], "", quantities)
    ]


def _time_of_channels(
    raw: _Raw, times: Sequence[Listing], listings: Sequence[Listing]
) -> Listing | None:
    """Return one of several time columns: of the displacement, else one in even steps with a unit; None without one."""
    strokes = [_name(listing) for listing in listings if _find_column([listing], "m", _STROKE)]
    return min(
        times,
        key=lambda listing: (
            not any(stroke and _name(listing).startswith(stroke) for stroke in strokes),
            not _time_unit(listing),
            not is_even_time(raw.get(listing, np.empty(0))),
        ),
        default=None,
    )


def _time_unit(listing: Listing) -> str:
    """Return the unit of time of a column: stated, at the end of its name, or its whole name; empty without one."""
    units = (listing.unit, _unit_in_name(listing), _name(listing).strip(" []()"))
    return next((unit for unit in units if unit and _is_of(unit, "s") and is_common(unit)), "")


def _unit_of_steps(values: Floats, interval: float) -> str:
    """Return the unit in which the steps of a column are the sampling interval [s]; empty if none fits."""
    step = float(np.median(np.diff(values)))
    factors = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "min": 60.0}
    return next(
        (
            unit
            for unit, factor in factors.items()
            if np.isclose(step * factor, interval, rtol=2e-3)
        ),
        "",
    )


def _still_columns(raw: _Raw, listings: Sequence[Listing], time: Listing | None) -> list[Listing]:
    """Return columns of lengths that are no displacement: constant, or the amplitude of a faster motion.

    Noise on a value that is not zero is an amplitude, as is any length next to a frequency of one
    cycle or more in each sampling interval.
    """
    cycles = 0.0
    if time is not None and (times := _values(raw, time, "s")).size > 1:
        frequencies = [
            item for item in listings if _FREQUENCY.search(_name(item)) and _is_of(item.unit, "Hz")
        ]
        measured = [values for item in frequencies if (values := _values(raw, item, "Hz")).size]
        cycles = max((float(np.median(values)) for values in measured), default=0.0) * float(
            np.median(np.diff(times))
        )
    still = []
    for listing in listings:
        if (values := raw.get(listing, np.empty(0))).size < 2 or not _is_of(
            listing.unit or "m", "m"
        ):
            continue
        steps = np.abs(np.diff(values))
        # most steps of few digits are 0
        extent, noise = (
            float(np.ptp(values)),
            float(np.median(steps) or steps.mean()) / _MEDIAN_STEP,
        )
        is_noise = extent < _LEAST_MOTION * noise and extent < _LEAST_SWING * abs(
            float(values.mean())
        )
        is_force = not listing.unit and not _find_column([listing], "", _STROKE)
        if not is_force and (not extent or is_noise or cycles >= 1):
            still.append(listing)
    return still


def _find_column(listings: Sequence[Listing], unit: str, patterns: Sequence[str]) -> Listing | None:
    """Find the column that alone matches a pattern and a unit, by the first such pattern.

    Of several columns of one name, e.g. of several tests, the first. An empty unit matches any
    column.
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
    """Return the column of friction coefficients; of several the first whose name is nothing else."""
    fitting = [
        listing
        for listing in listings
        if _COEFFICIENT.search(_name(listing))
        and listing.values != "a text"
        and listing.unit in {"", "1", "-"}
    ]
    plain = [
        listing
        for listing in fitting
        if _COEFFICIENT.fullmatch(split_unit(_name(listing))[0].strip())
    ]
    return fitting[0] if len(fitting) == 1 else next(iter(plain), None)


def _unnamed_ratios(raw: _Raw, listings: Sequence[Listing]) -> list[Listing]:
    """Return columns named after friction, of small numbers without a unit in a file that has units of forces.

    They are coefficients, unless the name states a force.
    """
    if not any(listing.unit and _is_of(listing.unit, "N") for listing in listings):
        return []
    return [
        listing
        for listing in listings
        if not (listing.unit or _unit_in_name(listing))
        and _find_column([listing], "", _TANGENTIAL[:1])
        and not _find_column([listing], "", _ANY_FORCE)
        and 0
        < float(np.abs(raw.get(listing, np.empty(0))).max(initial=0.0))
        <= _LARGEST_COEFFICIENT
    ]


def _times_load(listing: Listing) -> list[str]:
    """Return the key of a tangential load: a column of coefficients times the normal load."""
    reference = _reference(listing)
    column = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return [
        f'tangential_load = {{ {column}, times = "normal_load" }}  # a coefficient, times the normal load'
    ]


def _trace_and_retrace(listings: Sequence[Listing]) -> tuple[Listing, Listing] | None:
    """Return the columns of trace and retrace of a force, by name; None unless there is exactly one pair."""
    names = {
        _name(listing).lower(): listing for listing in listings if _is_of(listing.unit or "N", "N")
    }
    pairs = [
        (names[trace], listing)
        for name, listing in names.items()
        if (trace := name.replace("retrace", "trace")) != name and trace in names
    ]
    return pairs[0] if len(pairs) == 1 else None


def _any_forces(
    raw: _Raw,
    listings: Sequence[Listing],
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
    steady = [_steadiness(_values(raw, listing, "N")) for listing in forces]
    if len(forces) == 2:
        both = (forces[0], forces[1]) if steady[0] > steady[1] else (forces[1], forces[0])
        return both if normal is None and friction is None else (normal, friction)
    if normal is None and (friction or only_normal):
        return forces[0], friction
    return normal, friction or forces[0]


def _steadiness(values: Floats) -> float:
    """Return the absolute mean of a channel divided by its standard deviation."""
    return float(abs(values.mean()) / (values.std() or 1e-300)) if values.size else 0.0


def _guessed_load(raw: _Raw, friction: Listing | None) -> str:
    """Guess a normal load from the largest tangential load and the guessed coefficient, to one digit."""
    values = _values(raw, friction, "N") if friction else np.empty(0)
    largest = float(np.abs(values).max(initial=0.0)) / GUESSED_FRICTION
    return quantity_text(float(f"{largest:.0e}"), "N") if largest > 0 else "1 N"


def _pressing(raw: _Raw, listing: Listing | None) -> tuple[str, str]:
    """Return a key and a comment for a negative normal load; empty if it is positive or cannot be read."""
    values = np.empty(0) if listing is None else _values(raw, listing, "N")
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
    reference, extra = _reference(listing), [more]
    if not listing.unit or stated:
        unit_in_name = _unit_in_name(listing)
        extra.insert(0, f'unit = "{unit_in_name or stated or "?"}"')
        origin = _BY_NAME if unit_in_name else origin if stated else f'fill in, as in "{unit}"'
        reason = "; ".join(filter(None, [reason, origin]))
    comment = f"  # {reason}" if reason else ""
    if not any(extra):
        return f"{key} = {reference}{comment}"
    inner = reference.strip("{} ") if reference.startswith("{") else f"column = {reference}"
    return f"{key} = {{ {', '.join(filter(None, [inner, *extra]))} }}{comment}"


def _time_key(raw: _Raw, listing: Listing, interval: tuple[float, str] | None) -> str:
    """Return the key of the time column, whose unit may follow from its name or the sampling interval."""
    unit = _time_unit(listing)
    if unit and unit == listing.unit:
        return _key("time", listing, "s")
    if unit:
        return _key("time", listing, "s", stated=unit, origin=_BY_NAME)
    if interval and (unit := _unit_of_steps(raw[listing], 1 / interval[0])):
        return _key("time", listing, "s", stated=unit, origin=f"by {interval[1]}")
    return _key("time", listing, "s", stated="s")


def _assumed_unit(raw: _Raw, listing: Listing | None, unit: str) -> str:
    """Return the SI unit if a file without units is plausible in SI, else an empty string."""
    if (
        listing is None
        or listing.unit
        or _unit_in_name(listing)
        or not (values := _values(raw, listing, unit)).size
    ):
        return ""
    largest = float(np.ptp(values) if unit == "m" else np.abs(values).max())
    return unit if 0 < largest <= _LARGEST_IN_SI[unit] else ""


def _tangential_keys(
    raw: _Raw,
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


def _along_y(listings: Sequence[Listing]) -> dict[Listing | None, Listing]:
    """Return the columns ``NAME y`` by the columns ``NAME x`` of tables with two tangential directions."""
    names = {split_unit(_name(listing))[0]: listing for listing in listings}
    return {
        listing: names[f"{stem} y"]
        for name, listing in names.items()
        if (stem := name.removesuffix(" x")) != name and f"{stem} y" in names
    }


def _quote_files(files: Sequence[Path]) -> str:
    """Return a path, or an array of paths, in TOML."""
    names = [_quote(file.as_posix()) for file in files]
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


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
