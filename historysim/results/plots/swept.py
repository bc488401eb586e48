"""Pictures of swept quantities (curves and bars) and the labels of these quantities."""

import math
import re
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats
from historysim.basics.fields import choice
from historysim.basics.units import quantity, quantity_text
from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, field_error
from historysim.results.plots.canvas import COLUMN, Size
from historysim.results.plots.chart import MOVED, Chart, Curve, Item, Note, Shape, Sheet, span
from historysim.results.plots.pictures import PICTURES, SWEEP, Panel
from historysim.results.plots.style import FAINT, INK, LINES, Look, choose_scale, format_unit

SPREADS = {
    "deviation": "mean ± standard deviation",
    "quantiles": "median, 10 to 90 %",
    "none": "mean",
}
QUANTILES = (0.1, 0.9)
BARS_APART = 3.0  # distance of error bars from those of the next line [pt]
LEAST_FACTOR = 30.0  # greatest over smallest number of an axis, from which on it may be logarithmic


@PICTURES.register
@attrs.frozen(kw_only=True)
class CurvePicture(Panel):
    """A swept quantity over a swept parameter or over another quantity.

    Attributes
    ----------
    quantity
        The number of the sweep.
    over
        A dimension, or another number, such as ``peak_nominal_pressure``; by default the first
        dimension with numbers.
    each
        The dimension of the lines.
    spread
        ``"deviation"``, ``"quantiles"`` or ``"none"``.
    fit
        ``"straight"`` (with R²) or ``"power"`` (with the exponent).
    logarithmic
        Both axes.
    from_zero
        The axis of the number begins at 0.
    unit, over_unit
        Units of the two axes, such as ``"MPa"``; by default those of a readable prefix.
    ends
        For ``x`` or ``y`` two variables with the lower and upper ends of error bars, in place of
        the spread.

    Examples
    --------
    [[picture]]
    kind = "curve"
    quantity = "presliding_work"
    over = "loading_waypoints[0]_normal_load"
    fit = "power"
    """

    quantity: str
    over: str | None = None
    each: str | None = None
    spread: str = attrs.field(default="deviation", validator=choice(*SPREADS))
    fit: str | None = attrs.field(
        default=None, validator=attrs.validators.optional(choice("straight", "power"))
    )
    logarithmic: bool | None = None
    from_zero: bool = False
    unit: str = ""
    over_unit: str = ""
    ends: dict[str, Any] | None = None

    kind, of = "curve", (SWEEP,)

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return a column, with room for the title."""
        return COLUMN, 75.0 if self.title else 70.0

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return a line for each member of a dimension; points of seeds, or that repeat, are not joined."""
        if self.from_zero and self.logarithmic:
            raise InputError(
                "from_zero: a logarithmic axis has no zero; expected logarithmic = false"
            )
        sweep, quantity = _without_mean(select_cells(data, self.where), self.quantity)
        over, points, grouping = self._resolve_axes(sweep, quantity)
        members = [None] if grouping is None else list(range(sweep.sizes[grouping]))
        names = [
            "" if member is None else cell_name(sweep, str(grouping), member) for member in members
        ]
        labels = self.resolve_labels(names, "lines")
        numeric = over in sweep and _is_number(sweep, over)
        scales = {
            "x": (1.0, "") if not numeric else _unit_scale(sweep[over], self.over_unit, "over_unit")
        }
        scales["y"] = _unit_scale(sweep[quantity], self.unit, "unit")
        items: list[Item] = []
        limits = []
        for number, (member, (colour, dashes, marker)) in enumerate(
            zip(members, LINES, strict=False)
        ):
            curve_data = sweep if member is None else sweep.isel({grouping: member})
            line = self._line(curve_data, points, over if numeric else "", quantity)
            for column in line:
                line[column] *= scales[column[0]][0]
            joined = (
                "seed" not in over and line["x"].is_monotonic_increasing and line["x"].is_unique
            )
            # lines may hide one another: those below have the larger marks
            size = max(5.0 - 0.6 * number, 2.0) if len(members) > 1 else 3.5
            look = {
                "color": colour,
                "linestyle": dashes if joined else "none",
                "marker": marker,
                "ms": size,
            }
            shift = BARS_APART * (number - (len(members) - 1) / 2)
            # failed cells are gaps
            items += self._curve(
                line.dropna(subset="y"), labels[number], look | {"linewidth": 1.0}, shift
            )
            limits += line["x"].tolist()
        low = np.nanmin(limits)
        high = np.nanmax(limits)
        axes: Look = {"ylim": (0.0, None)} if self.from_zero else {}
        log = (
            "xy"
            if self.logarithmic
            else "x"
            if self.logarithmic is None and 0 < LEAST_FACTOR * low < high
            else ""
        )
        if not numeric and points in sweep.coords:
            axes |= {
                "xticks": range(sweep.sizes[points]),
                "xticklabels": [str(name) for name in sweep[points].values],
            }
            log = log.replace("x", "")
        x, y = (
            quantity_label(sweep, name) + (f" ({scales[axis][1]})" if scales[axis][1] else "")
            for axis, name in (("x", over), ("y", quantity))
        )
        numbered = (
            grouping is not None
            and not self.labels
            and "seed" not in grouping
            and _is_number(sweep, grouping)
        )
        moved = any(isinstance(item, Curve) and item.shift for item in items)
        return Sheet(
            {"A": Chart(items=items, x=x, y=y, log=log, margins=(0.06, 0.08), axes=axes)},
            subtitle=""
            if self.ends
            else _describe_cells(sweep, quantity, {points, grouping}, self.spread),
            note=MOVED if moved else "",
            legend_title=quantity_label(sweep, str(grouping)) if numbered else None,
        )

    def _line(self, curve_data: xr.Dataset, points: str, over: str, quantity: str) -> Any:
        """Return one row per point: position, cells and ends of error bars (DataFrame)."""
        sides = [(axis, *names) for axis, names in (self.ends or {}).items()]
        ends = {f"{axis}_low": low for axis, low, _ in sides} | {
            f"{axis}_high": high for axis, _, high in sides
        }
        names = ({quantity, over, *ends.values()} - {"", points}) | ({"deviation"} & {*curve_data})
        for name in names:
            if points not in curve_data[name].dims:
                raise InputError(f"{name} does not go over {points!r}; expected a number that does")
        # a value may repeat, and is another point
        cells = curve_data.reset_coords()[[*names]].drop_vars(points, errors="ignore")
        by_point = cells.to_dataframe().groupby(level=points)
        line = by_point[quantity].agg(y="median" if self.spread == "quantiles" else "mean")
        if self.spread == "quantiles":
            line["y_low"], line["y_high"] = (
                by_point[quantity].quantile(quantile) for quantile in QUANTILES
            )
        elif self.spread == "deviation":
            deviation = (
                by_point["deviation"].mean()
                if "deviation" in curve_data
                else by_point[quantity].std()
            )
            line["y_low"], line["y_high"] = line["y"] - deviation, line["y"] + deviation
        for column, name in ends.items():
            line[column] = by_point[name].mean()
        along = (
            curve_data[over].values
            if over == points
            else by_point[over].mean()
            if over
            else range(curve_data.sizes[points])
        )
        return line.assign(x=np.asarray(along, dtype=float)).sort_values("x", kind="stable")

    def _curve(self, line: Any, label: str, look: Look, shift: float) -> list[Item]:
        """Return one of some lines with its spread and fit."""
        if line.empty:
            return []
        x = line["x"].to_numpy()
        y = line["y"].to_numpy()
        if self.spread == "quantiles" and not self.ends:
            band = {"color": look["color"], "alpha": 0.2, "linewidth": 0}
            items: list[Item] = [
                Shape("fill_between", (x, line["y_low"], line["y_high"]), band),
                Curve(x, y, label, look),
            ]
        else:
            errors: Look = {}
            for axis in "xy":
                if f"{axis}_low" in line and line[f"{axis}_low"].notna().any():
                    low = line[axis] - line[f"{axis}_low"]
                    high = line[f"{axis}_high"] - line[axis]
                    errors[f"{axis}err"] = np.maximum([low, high], 0.0)
            items = [
                Curve(x, y, label, look, errors=errors, shift=shift if "yerr" in errors else 0.0)
            ]
        return items if self.fit is None else [*items, *_fit(x, y, self.fit, look["color"])]

    def _resolve_axes(self, sweep: xr.Dataset, quantity: str) -> tuple[str, str, str | None]:
        """Return the quantity of the x axis, the dimension of the points and the dimension of the lines."""
        values = sweep[quantity]
        grouping = self.each
        over = self.over
        dims = [str(name) for name in values.dims]
        for name, available in ((over, [*dims, *_numbers_over(sweep, quantity)]), (grouping, dims)):
            if name is not None and name not in available:
                raise InputError(
                    f"{quantity} does not go over {name!r}; expected one of {', '.join(available)}"
                )
        # seeds repeat, and are no quantity to draw over
        free = [name for name in dims if "seed" not in name]
        names = [name for name in free if name != grouping] or [
            name for name in dims if name != grouping
        ]
        longest = max(names, key=lambda name: sweep.sizes[name], default="")
        points = next((name for name in names if _is_number(sweep, name)), longest)
        if over in dims:
            points = str(over)
        elif over is not None and sweep[over].ndim == 1:
            points = str(sweep[over].dims[0])
        if points == grouping:
            raise InputError(
                f"each is {grouping!r}, which is on the axis already; expected another dimension"
            )
        if grouping is None:
            grouping = next(
                (name for name in free if name != points and 1 < sweep.sizes[name] <= len(LINES)),
                None,
            )
        elif sweep.sizes[grouping] > len(LINES):
            raise InputError(
                f"each is {grouping!r} with {sweep.sizes[grouping]} members; expected at most {len(LINES)} lines"
            )
        return over or points, points, grouping


def _without_mean(sweep: xr.Dataset, quantity: str) -> tuple[xr.Dataset, str]:
    """Return a sweep and a quantity; a mean of `historysim.sweep_statistics` gets the name of its quantity."""
    numeric = [
        str(name)
        for name, values in sweep.data_vars.items()
        if values.dtype.kind in "fiu" and values.dims
    ]
    if quantity not in numeric:
        raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(numeric)}")
    name = quantity.removesuffix("_mean")
    if name == quantity or f"{name}_standard_deviation" not in sweep:
        return sweep, quantity
    text = str(sweep[quantity].attrs.get("long_name", name)).removeprefix("mean of: ")
    mean = sweep[quantity].assign_attrs(long_name=text)
    return sweep.assign({name: mean, "deviation": sweep[f"{name}_standard_deviation"]}), name


def _numbers_over(sweep: xr.Dataset, quantity: str) -> list[str]:
    """Return the other numbers of a sweep that one may be drawn over: with dimensions that it has, too."""
    return [
        str(name)
        for name, variable in sweep.variables.items()
        if name != quantity
        and _is_number(sweep, str(name))
        and variable.dims
        and {*variable.dims} <= {*sweep[quantity].dims}
    ]


def _is_number(sweep: xr.Dataset, name: str) -> bool:
    return name not in sweep or sweep[name].dtype.kind in "fiu"


def _fit(x: Floats, y: Floats, fit: str, colour: Any) -> list[Item]:
    """Return a straight line or a power law through points, by least squares, with R² or the exponent."""
    if fit == "power":
        x, y = x[(x > 0) & (y > 0)], y[(x > 0) & (y > 0)]
    if x.size < 2:
        return []
    if fit == "power":
        exponent, constant = np.polyfit(np.log(x), np.log(y), 1)
        at = np.geomspace(x.min(), x.max(), 60)
        law = np.exp(constant) * at**exponent
        label = f"exponent {exponent:.2f}"
    else:
        slope, offset = np.polyfit(x, y, 1)
        at = np.array([x.min(), x.max()])
        law = slope * at + offset
        label = f"straight line, $R^2$ = {np.corrcoef(x, y)[0, 1] ** 2:.3f}"
    return [
        Curve(
            at,
            law,
            label,
            {"color": colour, "linewidth": 0.7, "linestyle": (0, (1, 1.5)), "zorder": 1},
        )
    ]


def _describe_cells(
    sweep: xr.Dataset, quantity: str, drawn_over: set[str | None], spread: str
) -> str:
    """Describe the cells that a point summarises, if there are several."""
    rest = [str(name) for name in sweep[quantity].dims if name not in drawn_over]
    cells = math.prod(sweep.sizes[name] for name in rest)
    if cells > 1:
        over = ", ".join(label_words(sweep, name)[0] for name in rest)
        of = (
            f"of {cells} surfaces"
            if all("seed" in name for name in rest)
            else f"over {cells} cells ({over})"
        )
        return f"{SPREADS[spread]} {of}"
    return SPREADS[spread] if "deviation" in sweep else ""


@PICTURES.register
@attrs.frozen(kw_only=True)
class BarsPicture(Panel):
    """A number of the cells of a sweep as bars in groups, with the difference within each.

    Attributes
    ----------
    quantity
        The number of the sweep.
    groups
        A table of lists with the name of each bar.

    Examples
    --------
    [[picture]]
    kind = "bars"
    quantity = "preliminary_displacement"
    groups = { "1 N" = ["100 m", "1000 m"] }
    """

    quantity: str
    groups: dict[str, Any]

    kind, of, size = "bars", (SWEEP,), (COLUMN, 75.0)

    def __attrs_post_init__(self) -> None:
        """Check that groups are lists of names."""
        for name, bars in self.groups.items():
            if (
                not isinstance(bars, list)
                or not bars
                or not all(isinstance(bar, str) for bar in bars)
            ):
                raise field_error(
                    f"{format_value(bars)}; expected an array with the names of its bars",
                    "groups",
                    name,
                )

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return a bar for each cell; error bars are the standard deviation over seeds."""
        sweep = select_cells(data, self.where)
        dimension = self._dimension(sweep)
        values = sweep[self.quantity]
        cells = values.to_series().groupby(level=dimension, sort=False)
        mean = cells.mean().to_numpy()
        deviation = cells.std().fillna(0.0).to_numpy()
        unit = str(values.attrs.get("units", ""))
        top = float((mean + deviation).max())
        kinds = list(dict.fromkeys(name for names in self.groups.values() for name in names))
        items: list[Item] = []
        width = 0.8 / len(kinds)
        start = 0
        for number, (group, names) in enumerate(self.groups.items()):
            heights, errors = (array[start : start + len(names)] for array in (mean, deviation))
            start += len(names)
            lefts = (
                number
                + (np.array([kinds.index(name) for name in names]) - (len(kinds) - 1) / 2) * width
            )
            for name, position, height, error in zip(names, lefts, heights, errors, strict=True):
                look = {
                    "color": LINES[kinds.index(name)][0],
                    "alpha": 0.85,
                    "ecolor": FAINT,
                    "capsize": 2,
                }
                look |= {"yerr": error or None, "label": name if number == 0 else ""}
                items.append(Shape("bar", (position, height, 0.92 * width), look))
                text = quantity_text(height, unit, 3).partition(" ")[0]
                items.append(Note(text, (position, 0), (0, 2), {"color": "white"}))
            if len(names) == 2:
                ends = (lefts[0], 1.06 * top), (lefts[1], 1.06 * top)
                items.append(span(*ends, arrowprops={"arrowstyle": "|-|", "mutation_scale": 2.5}))
                drift = quantity_text(abs(heights[1] - heights[0]), unit, 3)
                items.append(
                    Note(f"{group}: drift {drift}", (number, 1.06 * top), (0, 4), {"color": INK})
                )
        axes = {
            "xticks": range(len(self.groups)),
            "xticklabels": list(self.groups),
            "ylim": (0, 1.2 * top),
        }
        chart = Chart(
            items=items,
            y=f"{quantity_label(sweep, self.quantity)} ({format_unit(unit)})",
            axes=axes,
        )
        return Sheet(
            {"A": chart}, subtitle=_describe_cells(sweep, self.quantity, {dimension}, "deviation")
        )

    def _dimension(self, sweep: xr.Dataset) -> str:
        """Return the dimension with a cell for each bar."""
        quantity = self.quantity
        if quantity not in sweep.data_vars or sweep[quantity].dtype.kind != "f":
            raise InputError(
                f"quantity is {quantity!r}; expected one of {', '.join(map(str, sweep.data_vars))}"
            )
        dims = [str(dim) for dim in sweep[quantity].dims if "seed" not in str(dim)]
        group_size = sum(map(len, self.groups.values()))
        if len(dims) != 1 or sweep.sizes[dims[0]] != group_size:
            raise InputError(
                f"groups have {group_size} bars; expected one for each cell of one dimension other than seeds, "
                f"of which there are {', '.join(f'{sweep.sizes[dim]} along {dim}' for dim in dims) or 'none'}"
            )
        return dims[0]


OF_A_SCENARIO = " of the scenario"  # how the name of a swept key ends

# Text and symbol by the name of an output, or by the last part of a key of a scenario.
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


def label_words(dataset: xr.Dataset, name: str) -> tuple[str, str]:
    """Return the words for a variable or swept key, without unit, and its symbol, which may be empty."""
    if name not in dataset:
        return WORDS.get(name, (name.replace("_", " "), ""))[0], ""
    long_name = str(dataset[name].attrs.get("long_name", ""))
    key = long_name.removesuffix(OF_A_SCENARIO) if long_name.endswith(OF_A_SCENARIO) else name
    # of a key its last part, without an index
    match = re.fullmatch(r"(?:.*\.)?([^.\[]+)(?:\[(\d+)\])?", key)
    stem, index = (match[1], match[2]) if match else (key, None)
    if long_name and key == name and name not in WORDS:
        # what somebody else has named is called so
        return long_name, ""
    words, symbol = WORDS.get(stem, (stem.replace("_", " "), ""))
    return (words, symbol) if index is None else (f"{words} of asperity {index}", symbol)


def quantity_label(dataset: xr.Dataset, name: str) -> str:
    """Return the label of a variable or swept key, with its symbol."""
    return " ".join(filter(None, label_words(dataset, name)))


def _unit_scale(values: xr.DataArray, unit: str, option: str) -> tuple[float, str]:
    """Return the factor of a unit that is asked for, and the unit, or the SI unit, which gets a prefix."""
    units = str(values.attrs.get("units", "1"))
    if not unit:
        return 1.0, format_unit(units)
    try:
        return 1 / quantity(f"1 {unit}", units), unit
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


def member_text(dataset: xr.Dataset, name: str, member: int) -> str:
    """Return one value of a swept quantity, each with the prefix that suits it: ``"50 mN"``, ``"silica"``."""
    if name not in dataset.coords:
        return str(member)
    value = dataset[name][member]
    if value.dtype.kind not in "fiu":
        return str(value.values)
    factor, unit = choose_scale(str(value.attrs.get("units", "")), value.values)
    return f"{float(value) * factor:.4g} {unit if value else ''}".strip()


def select_cells(sweep: xr.Dataset, where: Mapping[str, Any] | None) -> xr.Dataset:
    """Return the cells of a sweep that have these values of swept keys, or of its coordinates.

    Raises
    ------
    InputError
        A key that was not swept, or a value that it does not have.
    """
    for key, value in (where or {}).items():
        swept_values = {
            str(values.attrs.get("long_name", name)).removesuffix(OF_A_SCENARIO): str(name)
            for name, values in sweep.coords.items()
            if values.ndim == 1 and name not in {"time", "asperity"}
        }
        if key not in swept_values and key not in sweep.coords:
            raise InputError(f"where: {key!r} was not swept; {nearest(key, swept_values)}")
        values = sweep[swept_values.get(key, key)]
        (dimension,) = values.dims
        requested = np.atleast_1d(np.asarray(value, dtype=object)).tolist()
        unit = str(values.attrs.get("units", "1"))
        numbers = values.dtype.kind in "fiu"
        positions = [
            _position(values, key, quantity(item, unit) if numbers else str(item))
            for item in requested
        ]
        sweep = sweep.isel(
            {dimension: positions if isinstance(value, list | tuple) else positions[0]}
        )
    return sweep


def _position(values: xr.DataArray, key: str, value: float | str) -> int:
    members = values.values
    same = (
        np.isclose(members, value, rtol=1e-9, atol=0)
        if values.dtype.kind in "fiu"
        else members == value
    )
    matches = np.flatnonzero(same)
    if not matches.size:
        raise InputError(
            f"where: {key} has no value {value}; expected one of {', '.join(map(str, members))}"
        )
    return int(matches[0])


def cell_label(sweep: xr.Dataset, dimension: str, member: int) -> str:
    """Return the label of a member of a swept dimension: ``"silica"``, ``"β = 20 µm"``, ``"surface 3"``."""
    text = member_text(sweep, dimension, member)
    if dimension not in sweep.coords or sweep[dimension].dtype.kind not in "fiu":
        return text
    words, symbol = label_words(sweep, dimension)
    return f"{symbol} = {text}" if symbol and "asperity" not in words else f"{words} {text}"


def cell_name(sweep: xr.Dataset, dimension: str, member: int) -> str:
    """Return the label of a line below a legend title with the quantity: its value, with a word for a seed."""
    if dimension not in sweep.coords:
        return str(member)
    return (
        cell_label(sweep, dimension, member)
        if "seed" in dimension
        else member_text(sweep, dimension, member)
    )
