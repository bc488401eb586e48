"""Pictures of the numbers of a sweep: curves over what was swept, and bars; what its quantities are called."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats
from historysim.basics.units import prefixed, quantity
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError, misfit
from historysim.results.plots.canvas import COLUMN, Canvas, Size
from historysim.results.plots.pictures import PICTURES, SWEEP, Panel
from historysim.results.plots.style import FAINT, INK, LINES, by_factors, set_beside

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

SPREADS = {"deviation": "mean ± standard deviation", "quantiles": "median, 10 to 90 %", "none": "mean"}
QUANTILES = (0.1, 0.9)
FITS = ("straight", "power")
BARS_APART = 3.0  # how far error bars stand from those of the next line [pt]
LEAST_FACTOR = 30.0  # greatest over smallest number of an axis, from which on it may be logarithmic


@PICTURES.register
@attrs.frozen(kw_only=True)
class CurvePicture(Panel):
    """A number of a sweep over what was swept, or over another number.

    Attributes
    ----------
    quantity
        The number of the sweep.
    over
        A dimension, or another number, such as ``peak_nominal_pressure``; by default the first dimension with numbers.
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
        For ``x`` or ``y`` two variables with the lower and upper ends of error bars, in place of the spread.

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
    spread: str = "deviation"
    fit: str | None = None
    logarithmic: bool | None = None
    from_zero: bool = False
    unit: str = ""
    over_unit: str = ""
    ends: dict[str, Any] | None = None

    kind, of = "curve", (SWEEP,)

    def size_of(self, data: Any) -> Size:  # noqa: ARG002 - see the base class
        """Return a column, with room for the title."""
        return COLUMN, 75.0 if self.title else 70.0

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a line for each member of a dimension; points of seeds, or that repeat, are not joined."""
        for name, value, known in (("spread", self.spread, SPREADS), ("fit", self.fit, (None, *FITS))):
            if value not in known:
                raise InputError(f"{name} is {value!r}; expected one of {', '.join(filter(None, known))}")
        if self.from_zero and self.logarithmic:
            raise InputError("from_zero: a logarithmic axis has no zero; expected logarithmic = false")
        sweep, quantity, ends = _spread_out(selected(data, self.where), self.quantity, self.ends or {})
        over, points, each = self._axes_of(sweep, quantity)
        members = [None] if each is None else list(range(sweep.sizes[each]))
        if self.labels and len(self.labels) != len(members):
            raise InputError(f"labels has {len(self.labels)}; expected one for each of {len(members)} lines")
        numeric = over in sweep and _is_number(sweep, over)
        factor, unit = _in_unit(sweep[quantity], self.unit, "unit")
        along_factor, along_unit = _in_unit(sweep[over], self.over_unit, "over_unit") if numeric else (1.0, "")
        axes, lines = canvas.axes(), []
        for number, (member, (colour, dashes, marker)) in enumerate(zip(members, LINES, strict=False)):
            own = sweep if member is None else sweep.isel({each: member})
            line = _line(own, points, over if numeric else "", quantity, ends)
            line["along"] *= along_factor
            for end in ends:
                line[[f"{end}_low", f"{end}_high"]] *= along_factor if end == "x" else factor
            line[["mean", *STATISTICS]] *= factor
            joined = "seed" not in over and line["along"].is_monotonic_increasing and line["along"].is_unique
            # lines may lie on one another: those below are the larger ones
            size = max(5.0 - 0.6 * number, 2.0) if len(members) > 1 else 3.5
            looks = {"color": colour, "linestyle": dashes if joined else "none", "marker": marker, "ms": size}
            name = "" if member is None else cell_name(sweep, str(each), member)
            looks["label"] = (self.labels[number] if self.labels else name) or None
            bars = _draw(axes, line, "none" if "y" in ends else self.spread, ends, looks)
            set_beside(bars, number, len(members), BARS_APART)
            if self.fit is not None:
                _draw_fit(axes, line, self.fit, colour)
            lines.append(line["along"])
        names = [] if numeric or points not in sweep.coords else [str(value) for value in sweep[points].values]
        _set_scales(axes, np.unique(np.concatenate(lines)), names, self.logarithmic)
        for axis, name, its_unit in ((axes.xaxis, over, along_unit), (axes.yaxis, quantity, unit)):
            axis.set_label_text(name_of(sweep, name) + (f" ({its_unit})" if its_unit else ""))
        axes.margins(0.06, 0.08)
        if self.from_zero:
            axes.set_ylim(0.0, 1.08 * axes.dataLim.y1)
        if axes.get_legend_handles_labels()[1]:
            numbered = each is not None and not self.labels and "seed" not in each and _is_number(sweep, each)
            # beside the axes: inside, it might lie on a line
            canvas.legend(axes, title=name_of(sweep, str(each)) if numbered else None)
        caption = SPREADS["deviation"] if ends and not self.ends else ""
        caption = caption if ends else _caption(sweep, quantity, {points, each}, self.spread)
        _write_titles(canvas, axes, self.title, caption)

    def _axes_of(self, sweep: xr.Dataset, quantity: str) -> tuple[str, str, str | None]:
        """Return what is on the axis, the dimension of the points, and that of the lines."""
        values, each, over = sweep[quantity], self.each, self.over
        dims = [str(name) for name in values.dims]
        for name, known in ((over, [*dims, *_numbers_over(sweep, quantity)]), (each, dims)):
            if name is not None and name not in known:
                raise InputError(f"{quantity} does not go over {name!r}; expected one of {', '.join(known)}")
        # seeds repeat, and are no quantity to draw over
        free = [name for name in dims if "seed" not in name]
        names = [name for name in free if name != each] or [name for name in dims if name != each]
        longest = max(names, key=lambda name: sweep.sizes[name], default="")
        points = next((name for name in names if _is_number(sweep, name)), longest)
        if over in dims:
            points = str(over)
        elif over is not None and sweep[over].ndim == 1:
            points = str(sweep[over].dims[0])
        if points == each:
            raise InputError(f"each is {each!r}, which is on the axis already; expected another dimension")
        if each is None:
            each = next((name for name in free if name != points and 1 < sweep.sizes[name] <= len(LINES)), None)
        elif sweep.sizes[each] > len(LINES):
            raise InputError(f"each is {each!r} with {sweep.sizes[each]} members; expected at most {len(LINES)} lines")
        return over or points, points, each


def _write_titles(canvas: Canvas, axes: "Axes", title: str, caption: str) -> None:
    """Write the title, and what points and bars are above the axes."""
    if canvas.beside_others and title:
        axes.set_title(title, pad=6 + 9 * bool(caption))
        above: dict[str, Any] = {"xytext": (0, 4), "textcoords": "offset points", "fontsize": 7, "color": FAINT}
        axes.annotate(caption, (0, 1), xycoords="axes fraction", **above)
        return
    axes.set_title(caption, fontsize=7, fontweight="normal")
    canvas.title(axes, title)


Table = Any  # A DataFrame of pandas
Ends = dict[str, tuple[str, str]]


def _spread_out(sweep: xr.Dataset, quantity: str, ends: Mapping[str, Sequence[str]]) -> tuple[xr.Dataset, str, Ends]:
    """Return a sweep with the variables of error bars: those given, or of `historysim.spread` its deviation."""
    known = [str(name) for name, values in sweep.data_vars.items() if values.dtype.kind in "fiu" and values.dims]
    if quantity not in known:
        raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(known)}")
    name = quantity.removesuffix("_mean")
    deviation = f"{name}_standard_deviation"
    if ends or name == quantity or deviation not in sweep:
        return sweep, quantity, {axis: (low, high) for axis, (low, high) in ends.items()}
    # under the name of what it is the mean of, which has words for its axis
    mean = sweep[quantity]
    text = str(mean.attrs.get("long_name", name)).removeprefix("mean of: ")
    found = {
        name: mean.assign_attrs(long_name=text),
        "lower": mean - sweep[deviation],
        "upper": mean + sweep[deviation],
    }
    return sweep.assign(found), name, {"y": ("lower", "upper")}


def _numbers_over(sweep: xr.Dataset, quantity: str) -> list[str]:
    """Return the other numbers of a sweep that one may be drawn over: with dimensions that it has, too."""
    return [
        str(name)
        for name, other in sweep.variables.items()
        if name != quantity and _is_number(sweep, str(name)) and other.dims and {*other.dims} <= {*sweep[quantity].dims}
    ]


def _is_number(sweep: xr.Dataset, name: str) -> bool:
    return name not in sweep or sweep[name].dtype.kind in "fiu"


# Statistics beside the mean of the cells of each point, of their groups of pandas.
STATISTICS: dict[str, Callable[[Any], Any]] = {
    "deviation": lambda cells: cells.std(),
    "low": lambda cells: cells.quantile(QUANTILES[0]),
    "median": lambda cells: cells.median(),
    "high": lambda cells: cells.quantile(QUANTILES[1]),
}


def _line(own: xr.Dataset, points: str, over: str, quantity: str, ends: "Ends") -> Table:
    """Return a row for each point in the order of the axis: where it is, what its cells are, and ends of error bars."""
    names = {quantity, over, *sum(ends.values(), ())} - {"", points}
    for name in names:
        if points not in own[name].dims:
            raise InputError(f"{name} does not go over {points!r}; expected a number that does")
    count = own.sizes[points]
    # a value may repeat, and is another point
    cells = own.reset_coords()[[*names]].drop_vars(points, errors="ignore")
    by_point = cells.to_dataframe().groupby(level=points)
    along = np.arange(count) if not over else own[over].values if over == points else by_point[over].mean()
    columns = {name: of(by_point[quantity]) for name, of in STATISTICS.items()}
    for axis, (low, high) in ends.items():
        columns |= {f"{axis}_low": by_point[low].mean(), f"{axis}_high": by_point[high].mean()}
    found = by_point[[quantity]].mean().set_axis(["mean"], axis=1)
    return found.assign(**columns, along=np.asarray(along, dtype=float)).sort_values("along", kind="stable")


def _draw(axes: "Axes", line: Table, spread: str, ends: "Ends", looks: dict[str, Any]) -> "list[Artist]":
    """Draw a line, and return what has error bars, which may lie on those of other lines."""
    # cells that have failed are gaps
    line = line.dropna(subset="mean")
    if line.empty:
        return []
    looks |= {"linewidth": 1.0}
    if spread == "quantiles":
        axes.fill_between(line["along"], line["low"], line["high"], color=looks["color"], alpha=0.2, linewidth=0)
        axes.plot(line["along"], line["median"], **looks)
        return []
    lengths: dict[str, Any] = {}
    for axis in ends:
        middle, low, high = (line[name] for name in ("mean" if axis == "y" else "along", f"{axis}_low", f"{axis}_high"))
        lengths[f"{axis}err"] = [np.maximum(middle - low, 0.0), np.maximum(high - middle, 0.0)]
    if spread == "deviation" and line["deviation"].notna().any():
        lengths["yerr"] = line["deviation"]
    looks |= {"capsize": 2, "elinewidth": 0.8}
    drawn = axes.errorbar(line["along"].to_numpy(), line["mean"].to_numpy(), **lengths, **looks)
    return drawn.get_children() if "yerr" in lengths else []


def _draw_fit(axes: "Axes", line: Table, fit: str, colour: Any) -> None:
    """Draw a straight line or a power law through means, by least squares, with R² or the exponent."""
    known = line.dropna(subset="mean")
    x, y = known["along"].values, known["mean"].values
    if fit == "power":
        x, y = x[(x > 0) & (y > 0)], y[(x > 0) & (y > 0)]
    if x.size < 2:
        return
    dashes: dict[str, Any] = {"color": colour, "linewidth": 0.7, "linestyle": (0, (1, 1.5)), "zorder": 1}
    if fit == "power":
        exponent, constant = np.polyfit(np.log(x), np.log(y), 1)
        fine = np.geomspace(x.min(), x.max(), 60)
        axes.plot(fine, np.exp(constant) * fine**exponent, label=f"exponent {exponent:.2f}", **dashes)
        return
    slope, offset = np.polyfit(x, y, 1)
    share = np.corrcoef(x, y)[0, 1] ** 2
    ends = np.array([x.min(), x.max()])
    axes.plot(ends, slope * ends + offset, label=f"straight line, $R^2$ = {share:.3f}", **dashes)


def _set_scales(axes: "Axes", along: Floats, names: Sequence[str], logarithmic: bool | None) -> None:
    """Set names as ticks, and logarithmic axes where that is asked for, or numbers go by factors."""
    if names:
        axes.set_xticks(along, names)
    elif logarithmic:
        by_factors(axes.xaxis)
        by_factors(axes.yaxis)
    elif logarithmic is None and _goes_by_factors(along):
        by_factors(axes.xaxis)
    elif logarithmic is None and along.size > 3 and along[0] == 0 and _goes_by_factors(along[1:]):
        # a zero beside values that go by factors stands apart from the least of them
        axes.set_xscale("symlog", linthresh=along[1])
        axes.set_xticks(along, [f"{value:g}" for value in along])


def _goes_by_factors(along: Floats) -> bool:
    """Return whether ascending numbers span so much, and so evenly by their factors, that a linear axis crowds them."""
    if along.size < 3 or along[0] <= 0 or along[-1] < LEAST_FACTOR * along[0]:
        return False
    factors = np.diff(np.log(along))
    return bool(factors.max() < 4 * max(factors.min(), 1e-12))


def _caption(sweep: xr.Dataset, quantity: str, drawn_over: set[str | None], spread: str) -> str:
    """Return what a point stands for, where it is of several cells."""
    rest = [str(name) for name in sweep[quantity].dims if name not in drawn_over]
    cells = math.prod(sweep.sizes[name] for name in rest)
    if cells == 1:
        return ""
    over = ", ".join(words_of(sweep, name)[0] for name in rest)
    return f"{SPREADS[spread]} " + (
        f"of {cells} surfaces" if all("seed" in name for name in rest) else f"over {cells} cells ({over})"
    )


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
            if not isinstance(bars, list) or not bars or not all(isinstance(bar, str) for bar in bars):
                raise misfit(f"{shown(bars)}; expected an array with the names of its bars", "groups", name)

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a bar for each cell; error bars are the standard deviation over seeds."""
        sweep = selected(data, self.where)
        dimension = self._dimension(sweep)
        (factor, unit), line = readable(sweep[self.quantity]), _line(sweep, dimension, "", self.quantity, {})
        mean, deviation = line["mean"].values * factor, line["deviation"].fillna(0.0).values * factor
        kinds = list(dict.fromkeys(name for names in self.groups.values() for name in names))
        axes, top = canvas.axes(), float((mean + deviation).max())
        width, first = 0.8 / len(kinds), 0
        for number, (group, names) in enumerate(self.groups.items()):
            own = slice(first, first := first + len(names))
            lefts = number + (np.array([kinds.index(name) for name in names]) - (len(kinds) - 1) / 2) * width
            for name, left, height, bar in zip(names, lefts, mean[own], deviation[own], strict=True):
                colour = LINES[kinds.index(name)][0]
                axes.bar(left, height, 0.92 * width, color=colour, alpha=0.85, label=name if number == 0 else None)
                if bar:
                    axes.errorbar(left, height, yerr=bar, color=FAINT, capsize=2, elinewidth=0.8)
                _write(axes, f"{height:.3g}", (left, 0), 2, "white")
            if len(names) == 2:
                low, high = mean[own]
                ends = (lefts[0], 1.06 * top), (lefts[1], 1.06 * top)
                axes.annotate("", *ends, arrowprops={"arrowstyle": "|-|", "mutation_scale": 2.5})
                _write(axes, f"{group}: drift {abs(high - low):.3g} {unit}", (number, 1.06 * top), 4, INK)
        axes.set_xticks(range(len(self.groups)), list(self.groups))
        axes.set(ylabel=f"{name_of(sweep, self.quantity)} ({unit})", ylim=(0, 1.2 * top))
        seeds = sweep[self.quantity].size // mean.size
        canvas.legend(axes)
        _write_titles(canvas, axes, self.title, f"{SPREADS['deviation']} of {seeds} surfaces" if seeds > 1 else "")

    def _dimension(self, sweep: xr.Dataset) -> str:
        """Return the dimension with a cell for each bar."""
        quantity = self.quantity
        if quantity not in sweep.data_vars or sweep[quantity].dtype.kind != "f":
            raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(map(str, sweep.data_vars))}")
        dims = [str(dim) for dim in sweep[quantity].dims if "seed" not in str(dim)]
        wanted = sum(map(len, self.groups.values()))
        if len(dims) != 1 or sweep.sizes[dims[0]] != wanted:
            raise InputError(
                f"groups have {wanted} bars; expected one for each cell of one dimension besides seeds, of which there "
                f"are {', '.join(f'{sweep.sizes[dim]} along {dim}' for dim in dims) or 'none'}"
            )
        return dims[0]


def _write(axes: "Axes", text: str, at: tuple[float, float], above: float, colour: str) -> None:
    axes.annotate(text, at, (0, above), textcoords="offset points", ha="center", color=colour)


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


def words_of(found: xr.Dataset, name: str) -> tuple[str, str]:
    """Return what a variable or a swept key of a Dataset is called, without its unit, and its symbol, maybe empty."""
    if name not in found:
        return WORDS.get(name, (name.replace("_", " "), ""))[0], ""
    long_name = str(found[name].attrs.get("long_name", ""))
    key = long_name.removesuffix(OF_A_SCENARIO) if long_name.endswith(OF_A_SCENARIO) else name
    # of a key its last part, without an index
    parts = re.fullmatch(r"(?:.*\.)?([^.\[]+)(?:\[(\d+)\])?", key)
    last, index = (parts[1], parts[2]) if parts else (key, None)
    if long_name and key == name and name not in WORDS:
        # what somebody else has named is called so
        return long_name, ""
    words, symbol = WORDS.get(last, (last.replace("_", " "), ""))
    return (words, symbol) if index is None else (f"{words} of asperity {index}", symbol)


def name_of(found: xr.Dataset, name: str) -> str:
    """Return what a variable or a swept key is called, with its symbol."""
    return " ".join(filter(None, words_of(found, name)))


def _printed(unit: str) -> str:
    """Return a unit as it is printed: ``"N m-1"`` as N/m, ``"m2"`` as m²."""
    first, *rest = unit.translate(str.maketrans("23", "²³")).split()
    if not rest or not all("-" in part for part in rest):
        return " ".join([first, *rest])
    return f"{first}/{'·'.join(part.replace('-1', '').replace('-', '') for part in rest)}"


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
    factor, prefix = (1.0, "") if any(map(str.isdigit, unit.split(maxsplit=1)[0])) else prefixed(greatest)
    return factor, prefix + _printed(unit)


def _in_unit(values: xr.DataArray, unit: str, option: str) -> tuple[float, str]:
    """Return the factor of a unit that is asked for, or of a readable one, and the unit."""
    if not unit:
        return readable(values)
    try:
        return 1 / quantity(f"1 {unit}", str(values.attrs.get("units", "1"))), unit
    except InputError as error:
        raise InputError(f"{option}: {error}") from None


def member_text(found: xr.Dataset, name: str, member: int) -> str:
    """Return one value of a swept quantity, each with the prefix that suits it: ``"50 mN"``, ``"silica"``."""
    if name not in found.coords:
        return str(member)
    value = found[name][member]
    if value.dtype.kind not in "fiu":
        return str(value.values)
    # zero is zero in any unit
    factor, unit = readable(value) if value else (1.0, "")
    return f"{float(value) * factor:.4g} {unit}".strip()


def selected(sweep: xr.Dataset, where: Mapping[str, Any] | None) -> xr.Dataset:
    """Return the cells of a sweep that have these values of swept keys, or of its coordinates.

    Raises
    ------
    InputError
        A key that was not swept, or a value that it does not have.
    """
    for key, value in (where or {}).items():
        known = {
            str(values.attrs.get("long_name", name)).removesuffix(OF_A_SCENARIO): str(name)
            for name, values in sweep.coords.items()
            if values.ndim == 1 and name not in {"time", "asperity"}
        }
        if key not in known and key not in sweep.coords:
            raise InputError(f"where: {key!r} was not swept; {nearest(key, known)}")
        values = sweep[known.get(key, key)]
        (dimension,) = values.dims
        wanted = np.atleast_1d(np.asarray(value, dtype=object)).tolist()
        unit = str(values.attrs.get("units", "1"))
        numbers = values.dtype.kind in "fiu"
        positions = [_position(values, key, quantity(one, unit) if numbers else str(one)) for one in wanted]
        sweep = sweep.isel({dimension: positions if isinstance(value, list | tuple) else positions[0]})
    return sweep


def _position(values: xr.DataArray, key: str, value: float | str) -> int:
    own = values.values
    same = np.isclose(own, value, rtol=1e-9, atol=0) if values.dtype.kind in "fiu" else own == value
    there = np.flatnonzero(same)
    if not there.size:
        raise InputError(f"where: {key} has no value {value}; expected one of {', '.join(map(str, own))}")
    return int(there[0])


def cell_label(sweep: xr.Dataset, dimension: str, member: int) -> str:
    """Return what a member of a swept dimension is called: ``"silica"``, ``"β = 20 µm"``, ``"surface 3"``."""
    text = member_text(sweep, dimension, member)
    if dimension not in sweep.coords or sweep[dimension].dtype.kind not in "fiu":
        return text
    words, symbol = words_of(sweep, dimension)
    return f"{symbol} = {text}" if symbol and "asperity" not in words else f"{words} {text}"


def cell_name(sweep: xr.Dataset, dimension: str, member: int) -> str:
    """Return what a line of a member is called below a heading with the quantity: its value, of a seed with a word."""
    if dimension not in sweep.coords:
        return str(member)
    return cell_label(sweep, dimension, member) if "seed" in dimension else member_text(sweep, dimension, member)
