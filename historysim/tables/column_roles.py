"""Roles of the columns of a file by their names, units and values: times, loads, displacements, coefficients."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor, is_common
from historysim.errors import InputError
from historysim.tables import Column, Format, Listing, header_lines, read_table
from historysim.tables.columns import split_unit
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
NORMAL = (
    "normal|press|applied|法向|正压|法線|垂直|押(し)?付",
    rf"{_AT}(fn|fz|f_n|n|load|p){_END}",
    (
        rf"{_WORD}(?:ball|dead|axial|vertical|contact|clamp(?:ing)?|specimen|preload)\W*(?:load|force|weight)?{_END}"
        rf"|{_WORD}(?:preload|weight|last|charge){_END}|auflast|axialkraft|anpress|vorspann|appui"
        "|载荷|載荷|荷载|荷重|负荷|負荷"
    ),
)
TANGENTIAL = (
    r"fric|tang|reib|shear|traction|querkraft|schub|scher|frott|cisaill|摩擦|切向|剪切|接線|せん断",
    rf"{_AT}(ff|ft|f_t){_END}",
    rf"{_AT}fx{_END}",
    rf"lateral|横向|{_AT}(fy|t|q){_END}",
)
_ANY_FORCE = (
    rf"{_AT}f{_END}",
    rf"{_WORD}(force|effort){_END}|kraft|力",
)
STROKE = (
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
NOT_A_STROKE = re.compile(
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
# median of the absolute difference of two samples of white noise, over its standard deviation
_MEDIAN_STEP = 0.954
# smallest range of a motion, over the noise and over the mean
_LEAST_MOTION, _LEAST_SWING = 12.0, 0.2
# finite values of the columns that can be read, in the unit of the file
RawColumns = Mapping[Listing, Floats]


def read_columns(path: Path, listings: Sequence[Listing], layout: Format) -> RawColumns:
    """Read the finite values of columns in the unit of the file, without those that cannot be read."""
    listings = [listing for listing in listings if listing.values != "a text"]
    columns = {}
    for number, listing in enumerate(listings):
        reference = tomllib.loads(f"column = {column_reference(listing)}")["column"]
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
            for key, values in read_columns(path, [item], layout).items()
        }
    return {listings[int(number)]: values[np.isfinite(values)] for number, values in read.items()}


def values_in_unit(raw: RawColumns, listing: Listing, unit: str) -> Floats:
    """Return the finite values of a column in a unit, the default for an unknown unit; empty if it cannot be read."""
    try:
        factor = conversion_factor(
            listing.unit.partition(",")[0] or unit_in_name(listing) or unit, unit
        )
    except InputError:
        return np.empty(0)
    return factor * raw.get(listing, np.empty(0))


def find_rate(path: Path, listings: Sequence[Listing], layout: Format) -> tuple[float, str] | None:
    """Return the sampling rate [Hz] that the header of a text, or a scalar of a file of arrays, states."""
    for listing in listings:
        if listing.values == "1" or (
            listing.values == "a text" and listing.first_value[:1].isdigit()
        ):
            value, _, unit = listing.first_value.partition(" ")
            label = re.split(r"[./]", split_unit(column_name(listing))[0])[-1]
            with suppress(ValueError):
                if rate := entry_rate(
                    label, float(value), unit or listing.unit or unit_in_name(listing)
                ):
                    return rate, f"{column_name(listing)} = {listing.first_value}"
    return header_rate(header_lines(path, layout))


def find_times(
    raw: RawColumns, listings: Sequence[Listing], interval: float | None
) -> list[Listing]:
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
        if named := [listing for listing in clocks if find_column([listing], "s", (pattern,))]:
            return named
    unnamed = [
        listing
        for listing in clocks
        if is_even_time(raw[listing]) and not _COUNTER.search(column_name(listing))
    ]
    if in_time := [listing for listing in unnamed if time_unit(listing)]:
        return in_time
    of_other_unit = [listing for listing in unnamed if listing.unit and is_common(listing.unit)]
    unknown = [
        listing for listing in unnamed if listing not in of_other_unit and not unit_in_name(listing)
    ]
    of_interval = [
        listing for listing in unknown if interval and unit_of_steps(raw[listing], interval)
    ]
    counted = [listing for listing in unknown if float(np.diff(raw[listing][:2])[0]) == 1]
    quantities = (
        *NORMAL,
        *TANGENTIAL,
        *_ANY_FORCE,
        *STROKE,
        NOT_A_STROKE.pattern,
        _RATIO.pattern,
    )
    return of_interval or [
        listing
        for listing in unknown
        if listing not in counted and not find_column([listing], "", quantities)
    ]


def select_time(
    raw: RawColumns, times: Sequence[Listing], listings: Sequence[Listing]
) -> Listing | None:
    """Return one of several time columns: of the displacement, else one in even steps with a unit; None without one."""
    strokes = [column_name(listing) for listing in listings if find_column([listing], "m", STROKE)]
    return min(
        times,
        key=lambda listing: (
            not any(stroke and column_name(listing).startswith(stroke) for stroke in strokes),
            not time_unit(listing),
            not is_even_time(raw.get(listing, np.empty(0))),
        ),
        default=None,
    )


def time_unit(listing: Listing) -> str:
    """Return the unit of time of a column: stated, at the end of its name, or its whole name; empty without one."""
    units = (listing.unit, unit_in_name(listing), column_name(listing).strip(" []()"))
    return next((unit for unit in units if unit and _is_of(unit, "s") and is_common(unit)), "")


def unit_of_steps(values: Floats, interval: float) -> str:
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


def find_still_columns(
    raw: RawColumns, listings: Sequence[Listing], time: Listing | None
) -> list[Listing]:
    """Return columns of lengths that are no displacement: constant, or the amplitude of a faster motion.

    Noise on a value that is not zero is an amplitude, as is any length next to a frequency of one
    cycle or more in each sampling interval.
    """
    cycles = 0.0
    if time is not None and (times := values_in_unit(raw, time, "s")).size > 1:
        frequencies = [
            item
            for item in listings
            if _FREQUENCY.search(column_name(item)) and _is_of(item.unit, "Hz")
        ]
        measured = [
            values for item in frequencies if (values := values_in_unit(raw, item, "Hz")).size
        ]
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
        extent = float(np.ptp(values))
        noise = float(np.median(steps) or steps.mean()) / _MEDIAN_STEP
        is_noise = extent < _LEAST_MOTION * noise and extent < _LEAST_SWING * abs(
            float(values.mean())
        )
        is_force = not listing.unit and not find_column([listing], "", STROKE)
        if not is_force and (not extent or is_noise or cycles >= 1):
            still.append(listing)
    return still


def find_column(listings: Sequence[Listing], unit: str, patterns: Sequence[str]) -> Listing | None:
    """Find the column that alone matches a pattern and a unit, by the first such pattern.

    Of several columns of one name, e.g. of several tests, the first. An empty unit matches any
    column.
    """
    for pattern in patterns:
        fitting = [
            listing
            for listing in listings
            if re.search(pattern, column_name(listing), re.IGNORECASE)
            and not _RATIO.search(column_name(listing))
            and listing.values != "a text"
            and (not unit or _is_of(listing.unit or unit_in_name(listing) or unit, unit))
        ]
        if (
            fitting
            and len({re.split(r"[.:|>}]", column_name(listing))[-1] for listing in fitting}) == 1
        ):
            return fitting[0]
    return None


def find_coefficient(listings: Sequence[Listing]) -> Listing | None:
    """Return the column of friction coefficients; of several the first whose name is nothing else."""
    fitting = [
        listing
        for listing in listings
        if _COEFFICIENT.search(column_name(listing))
        and listing.values != "a text"
        and listing.unit in {"", "1", "-"}
    ]
    plain = [
        listing
        for listing in fitting
        if _COEFFICIENT.fullmatch(split_unit(column_name(listing))[0].strip())
    ]
    return fitting[0] if len(fitting) == 1 else next(iter(plain), None)


def find_ratios(raw: RawColumns, listings: Sequence[Listing]) -> list[Listing]:
    """Return columns named after friction, of small numbers without a unit in a file that has units of forces.

    They are coefficients, unless the name states a force.
    """
    if not any(listing.unit and _is_of(listing.unit, "N") for listing in listings):
        return []
    return [
        listing
        for listing in listings
        if not (listing.unit or unit_in_name(listing))
        and find_column([listing], "", TANGENTIAL[:1])
        and not find_column([listing], "", _ANY_FORCE)
        and 0
        < float(np.abs(raw.get(listing, np.empty(0))).max(initial=0.0))
        <= _LARGEST_COEFFICIENT
    ]


def find_trace_and_retrace(listings: Sequence[Listing]) -> tuple[Listing, Listing] | None:
    """Return the columns of trace and retrace of a force, by name; None unless there is exactly one pair."""
    names = {
        column_name(listing).lower(): listing
        for listing in listings
        if _is_of(listing.unit or "N", "N")
    }
    pairs = [
        (names[trace], listing)
        for name, listing in names.items()
        if (trace := name.replace("retrace", "trace")) != name and trace in names
    ]
    return pairs[0] if len(pairs) == 1 else None


def find_forces(
    raw: RawColumns,
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
        if listing not in (normal, friction) and find_column([listing], "N", _ANY_FORCE)
    ]
    if not forces or len(forces) > 2:
        return normal, friction
    steady = [_steadiness(values_in_unit(raw, listing, "N")) for listing in forces]
    if len(forces) == 2:
        both = (forces[0], forces[1]) if steady[0] > steady[1] else (forces[1], forces[0])
        return both if normal is None and friction is None else (normal, friction)
    if normal is None and (friction or only_normal):
        return forces[0], friction
    return normal, friction or forces[0]


def _steadiness(values: Floats) -> float:
    """Return the absolute mean of a channel divided by its standard deviation."""
    return float(abs(values.mean()) / (values.std() or 1e-300)) if values.size else 0.0


def find_across(listings: Sequence[Listing]) -> dict[Listing | None, Listing]:
    """Return the columns ``NAME y`` by the columns ``NAME x`` of tables with two tangential directions."""
    names = {split_unit(column_name(listing))[0]: listing for listing in listings}
    return {
        listing: names[f"{stem} y"]
        for name, listing in names.items()
        if (stem := name.removesuffix(" x")) != name and f"{stem} y" in names
    }


def column_reference(listing: Listing) -> str:
    """Return a column as a scenario names it."""
    return listing.column.partition(" # ")[0]


def column_name(listing: Listing) -> str:
    """Return the name of a column; empty if it has none, or an ambiguous one."""
    match = re.search(r'"((?:[^"\\]|\\.)*)"', listing.column.partition(" # under ")[0])
    return match[1] if match else ""


def unit_in_name(listing: Listing) -> str:
    """Return the unit at the end of the name of a column; empty without one."""
    match = _UNIT_IN_NAME.fullmatch(column_name(listing))
    return match[1] if match else ""


def _is_of(unit: str, like: str) -> bool:
    try:
        conversion_factor(unit.partition(",")[0], like)
    except InputError:
        return False
    return True
