"""Picture of a quantity over what was swept, with its spread over the rest, such as seeds."""

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import xarray as xr

from historysim.basics.array_types import Floats
from historysim.errors import InputError
from historysim.results.plots.line_styles import LINES
from historysim.results.plots.paper import COLUMN, Drawn, Page, Place, paper
from historysim.results.plots.style import FAINT, INK, by_factors
from historysim.results.plots.swept_cells import cell_label, selected
from historysim.results.plots.words import member_text, name_of, readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SPREADS = ("deviation", "quantiles", "none")
FITS = ("straight", "power")
QUANTILES = (0.1, 0.9)
WIDE = 30.0
"""Greatest over smallest number of an axis, from which on it may be logarithmic."""
MOST_LINES = len(LINES)


def plot_swept(
    sweep: xr.Dataset,
    quantity: str,
    over: str | None = None,
    *,
    each: str | None = None,
    spread: str = "deviation",
    fit: str | None = None,
    logarithmic: bool | None = None,
    labels: Sequence[str] = (),
    where: Mapping[str, Any] | None = None,
    ends: Mapping[str, tuple[str, str]] | None = None,
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw a quantity of a sweep over a swept one, or over another quantity.

    Parameters
    ----------
    sweep : xarray.Dataset
        From `historysim.sweep`, or any Dataset whose ``quantity`` has only dimensions that were swept.
    quantity : str
        The variable to draw.
    over : str, optional
        The dimension along the axis; by default the first with numbers that are not those of seeds, or else the
        longest. Where its values repeat, or are those of seeds, points are not joined. Or another number of the
        sweep, such as ``peak_nominal_pressure``: each point then stands at its mean over the rest.
    each : str, optional
        A dimension whose members are lines of their own; by default the next one, where it has at most 8.
    spread : {"deviation", "quantiles", "none"}
        Over all other dimensions, such as seeds, the mean is drawn with error bars of one standard deviation, or the
        median with a band from the 10 to the 90 % quantile, or the mean alone.
    fit : {"straight", "power"}, optional
        A line through the means of each, by least squares: straight, with its R², or a power law, with its exponent.
    logarithmic : bool, optional
        Both axes, or neither; by default the axis of what was swept where its values are spaced by factors.
    labels : sequence of str, optional
        What the lines are called.
    where : dict, optional
        Only the cells with these values of swept keys: ``{"materials.first": "silicon"}``.
    ends : dict, optional
        For ``"x"``, ``"y"`` or both, two variables that tell the lower and upper end of error bars, in place of the
        spread.
    title : str, optional
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.

    Raises
    ------
    InputError
        Names that the sweep does not have, a quantity that is no number, more lines than can be told apart, labels that
        do not fit them, or another spread or fit.
    """
    options = {"each": each, "spread": spread, "fit": fit, "logarithmic": logarithmic, "labels": labels, "ends": ends}
    with paper(plot_swept, (COLUMN, 75.0 if title else 70.0), place) as page:
        draw_swept(page, selected(sweep, where), quantity, over, **options)  # type: ignore[arg-type] # one each
        page.heading(title)
    return page.drawn


def draw_swept(
    page: Page,
    sweep: xr.Dataset,
    quantity: str,
    over: str | None = None,
    *,
    each: str | None = None,
    spread: str = "deviation",
    fit: str | None = None,
    logarithmic: bool | None = None,
    labels: Sequence[str] = (),
    ends: Mapping[str, tuple[str, str]] | None = None,
    title: str = "",
) -> None:
    """Draw a quantity on a page; parameters and errors as for `plot_swept`."""
    values, along_name, points, each = _chosen(sweep, quantity, over, each)
    for name, value, known in (("spread", spread, SPREADS), ("fit", fit, (None, *FITS))):
        if value not in known:
            raise InputError(f"{name} is {value!r}; expected one of {', '.join(filter(None, known))}")
    rest = [name for name in values.dims if name not in {points, each}]
    factor, unit = readable(values)
    members: list[Any] = [None] if each is None else list(range(sweep.sizes[each]))
    if labels and len(labels) != len(members):
        raise InputError(f"labels has {len(labels)}; expected one for each of {len(members)} lines")
    axes = page.axes()
    places = []
    for number, (member, line) in enumerate(zip(members, LINES, strict=False)):
        own = sweep if member is None else sweep.isel({each: member})
        along, ticks, joined = _along(own, along_name, points)
        # as they were written they may go to and fro
        ascending = np.argsort(along, kind="stable")
        along = along[ascending]
        joined = joined and bool((np.diff(along) > 0).all())

        def column(name: str, times: float, own: xr.Dataset = own, order: Any = ascending) -> Floats:
            part = own[name].transpose(points, *[dim for dim in own[name].dims if dim != points])
            found: Floats = part.values.reshape(part.shape[0], -1)[order] * times
            return found

        numbers = column(quantity, factor)
        label = labels[number] if labels else "" if member is None else _member(sweep, str(each), member)
        given = {}
        for axis, names in (ends or {}).items():
            times = factor if axis == "y" else _factor(sweep, along_name)
            low, high = (_means(column(name, times)) for name in names)
            middle = _means(numbers) if axis == "y" else along
            given[f"{axis}err"] = np.maximum([middle - low, high - middle], 0.0)
        # lines may lie on one another: those below are the larger ones
        size = max(5.0 - 0.6 * number, 2.0) if len(members) > 1 else 3.5
        looks = (line[0], line[1] if joined else "none", line[2], size)
        _draw(axes, along, numbers, "none" if "y" in (ends or {}) else spread, looks, label, given)
        if fit is not None:
            _fitted(axes, along, numbers, fit, line[0])
        places.append(along)
    _scales(axes, np.concatenate(places), ticks, logarithmic)
    axes.set(xlabel=_label(sweep, along_name), ylabel=name_of(sweep, quantity) + (f" ({unit})" if unit else ""))
    axes.margins(0.06, 0.08)
    handles = axes.get_legend_handles_labels()[1]
    if handles:
        # beside the axes: inside, it might lie on a line
        page.legend(axes, title=_heading(sweep, each, labels))
    caption = _caption(sweep, values, rest, spread) if not ends else ""
    if title:
        axes.set_title(title, pad=6 + 9 * bool(caption))
        above: dict[str, Any] = {"xytext": (0, 4), "textcoords": "offset points", "fontsize": 7, "color": FAINT}
        axes.annotate(caption, (0, 1), xycoords="axes fraction", **above)
    else:
        axes.set_title(caption, fontsize=7, fontweight="normal")


def _chosen(
    sweep: xr.Dataset, quantity: str, over: str | None, each: str | None
) -> tuple[xr.DataArray, str, str, str | None]:
    """Return the values, what they are drawn over, the dimension of the points, and that of the lines."""
    if quantity not in sweep.data_vars or sweep[quantity].dtype.kind not in "fiu" or not sweep[quantity].dims:
        known = [str(name) for name, values in sweep.data_vars.items() if values.dtype.kind in "fiu" and values.dims]
        raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(known)}")
    values = sweep[quantity]
    # seeds repeat, and are no quantity to draw over
    free = [str(name) for name in values.dims if "seed" not in str(name)]
    names = [name for name in free if name != each] or [str(name) for name in values.dims if name != each]
    points = next((name for name in names if _numbers(sweep, name)), None)
    points = points or max(names, key=lambda name: sweep.sizes[name], default="")
    if over is not None and over not in values.dims and over not in _numbers_of(sweep, values):
        known = [*map(str, values.dims), *_numbers_of(sweep, values)]
        raise InputError(f"{quantity} does not go over {over!r}; expected one of {', '.join(known)}")
    if over in values.dims:
        points = str(over)
    elif over is not None and sweep[over].ndim == 1:
        # along one dimension it says which one the points go through
        points = str(sweep[over].dims[0])
    if each is not None and each not in values.dims:
        raise InputError(f"{quantity} does not go over {each!r}; expected one of {', '.join(map(str, values.dims))}")
    if points == each:
        raise InputError(f"each is {each!r}, which is on the axis already; expected another dimension")
    if each is None:
        each = next((name for name in free if name != points and 1 < sweep.sizes[name] <= MOST_LINES), None)
    elif sweep.sizes[each] > MOST_LINES:
        raise InputError(f"each is {each!r} with {sweep.sizes[each]} members; expected at most {MOST_LINES} lines")
    return values, over or points, points, each


def _heading(sweep: xr.Dataset, each: str | None, labels: Sequence[str]) -> str | None:
    """Return what stands above the names of lines: what they are numbers of."""
    if each is None or labels or "seed" in each or not _numbers(sweep, each):
        return None
    return name_of(sweep, each)


def _numbers_of(sweep: xr.Dataset, values: xr.DataArray) -> list[str]:
    """Return the other numbers of a sweep that values may be drawn over: with dimensions that these have, too."""
    return [
        str(name)
        for name, other in {**sweep.data_vars, **sweep.coords}.items()
        if other.dtype.kind in "fiu" and other.dims and set(other.dims) <= set(values.dims) and name != values.name
    ]


def _numbers(sweep: xr.Dataset, name: Hashable) -> bool:
    return name not in sweep.coords or sweep[name].dtype.kind in "fiu"


def _factor(sweep: xr.Dataset, name: str) -> float:
    return readable(sweep[name])[0] if name in sweep and _numbers(sweep, name) else 1.0


def _label(sweep: xr.Dataset, name: str) -> str:
    unit = readable(sweep[name])[1] if name in sweep and _numbers(sweep, name) else ""
    return name_of(sweep, name) + (f" ({unit})" if unit else "")


def _along(sweep: xr.Dataset, name: str, points: str) -> tuple[Floats, list[str], bool]:
    """Return where points stand on the axis, their names where they are texts, and whether lines may join them."""
    if name in sweep and (name != points or _numbers(sweep, name)):
        values = sweep[name]
        rest = [dim for dim in values.dims if dim != points]
        middle = values.astype(float).mean(rest).values if rest else values.values.astype(float)
        return middle * _factor(sweep, name), [], "seed" not in name
    names = [str(value) for value in sweep[points].values] if points in sweep.coords else []
    return np.arange(sweep.sizes[points], dtype=np.float64), names, "seed" not in points


def _scales(axes: "Axes", along: Floats, ticks: Sequence[str], logarithmic: bool | None) -> None:
    if ticks:
        axes.set_xticks(np.unique(along), ticks)
        return
    own = np.unique(along)
    if logarithmic:
        for axis in (axes.xaxis, axes.yaxis):
            by_factors(axis)
    elif logarithmic is None and _spaced_by_factors(own):
        by_factors(axes.xaxis)
    elif logarithmic is None and own.size > 3 and own[0] == 0 and _spaced_by_factors(own[1:]):
        # a zero beside values that go by factors is told apart from the least of them
        axes.set_xscale("symlog", linthresh=own[1])
        axes.set_xticks(own, [f"{value:g}" for value in own])


def _spaced_by_factors(along: Floats) -> bool:
    """Return whether numbers span so much, and so evenly by their factors, that a linear axis would crowd them."""
    if along.size < 3 or not (along > 0).all() or along.max() < WIDE * along.min():
        return False
    factors = np.diff(np.log(np.sort(along)))
    return bool(factors.max() < 4 * max(factors.min(), 1e-12))


def _member(sweep: xr.Dataset, each: str, member: int) -> str:
    if each not in sweep.coords:
        return str(member)
    if "seed" in each:
        return cell_label(sweep, each, member)
    return member_text(sweep, each, member)


def _means(numbers: Floats) -> Floats:
    """Return the mean of each row of what is there; NaN where nothing is."""
    count = np.isfinite(numbers).sum(axis=1)
    return np.where(count > 0, np.nansum(numbers, axis=1) / np.maximum(count, 1), np.nan)


def _draw(
    axes: "Axes",
    along: Floats,
    numbers: Floats,
    spread: str,
    line: tuple[Any, ...],
    label: str,
    given: Mapping[str, Floats],
) -> None:
    colour, dashes, marker, markersize = line
    looks: dict[str, Any] = {"color": colour, "linestyle": dashes, "marker": marker, "ms": markersize, "linewidth": 1.0}
    # cells that have failed are gaps
    there = np.isfinite(numbers).any(axis=1)
    along, numbers = along[there], numbers[there]
    if not along.size:
        return
    if spread == "quantiles" and numbers.shape[1] > 1:
        low, middle, high = np.nanquantile(numbers, [QUANTILES[0], 0.5, QUANTILES[1]], axis=1)
        axes.fill_between(along, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(along, middle, label=label, **looks)
        return
    mean = np.nanmean(numbers, axis=1)
    count = np.isfinite(numbers).sum(axis=1)
    bars: dict[str, Any] = {name: values[:, there] for name, values in given.items()}
    if spread == "deviation" and (count > 1).any():
        # of one cell there is no deviation
        square = np.nansum((numbers - mean[:, np.newaxis]) ** 2, axis=1)
        bars["yerr"] = np.where(count > 1, np.sqrt(square / np.maximum(count - 1, 1)), np.nan)
    axes.errorbar(along, mean, **({"yerr": None} | bars), capsize=2, elinewidth=0.8, label=label or None, **looks)


def _fitted(axes: "Axes", along: Floats, numbers: Floats, fit: str, colour: Any) -> None:
    """Draw a straight line or a power law through means, by least squares, and tell R² or the exponent."""
    mean = np.nanmean(numbers, axis=1)
    there = np.isfinite(mean) & ((along > 0) & (mean > 0) if fit == "power" else True)
    if there.sum() < 2:
        return
    x, y = along[there], mean[there]
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


def plot_bars(
    sweep: xr.Dataset,
    quantity: str,
    groups: Mapping[str, Sequence[str]],
    *,
    title: str = "",
    **place: Unpack[Place],
) -> Drawn:
    """Draw a number of a few cells as bars in groups, with the difference between the bars of each group.

    Parameters
    ----------
    sweep : xarray.Dataset
        Whose ``quantity`` goes over one dimension besides seeds; error bars are the standard deviation over these.
    quantity : str
    groups : dict
        The names of the groups, each with those of its bars: one for each cell, in their order.
    title : str, optional
        A heading.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.

    Raises
    ------
    InputError
        A quantity that the sweep does not have, or groups that do not fit its cells.
    """
    with paper(plot_bars, (COLUMN, 75.0), place) as page:
        draw_bars(page, sweep, quantity, groups)
        page.heading(title)
    return page.drawn


def draw_bars(
    page: Page, sweep: xr.Dataset, quantity: str, groups: Mapping[str, Sequence[str]], title: str = ""
) -> None:
    """Draw bars on a page; parameters and errors as for `plot_bars`."""
    if quantity not in sweep.data_vars or sweep[quantity].dtype.kind != "f":
        raise InputError(f"quantity is {quantity!r}; expected one of {', '.join(map(str, sweep.data_vars))}")
    values = sweep[quantity]
    dims = [str(dim) for dim in values.dims if "seed" not in str(dim)]
    cells = sweep.sizes[dims[0]] if len(dims) == 1 else 0
    wanted = sum(map(len, groups.values()))
    if cells != wanted:
        raise InputError(
            f"groups have {wanted} bars; expected one for each cell of one dimension besides seeds, of which there are "
            f"{', '.join(f'{sweep.sizes[dim]} along {dim}' for dim in dims) or 'none'}"
        )
    factor, unit = readable(values)
    numbers = values.transpose(dims[0], ...).values.reshape(cells, -1) * factor
    mean = np.nanmean(numbers, axis=1)
    # cells that have failed are left out; of one there is no deviation
    several = np.isfinite(numbers).sum(axis=1) > 1
    deviation = np.zeros(cells)
    deviation[several] = np.nanstd(numbers[several], axis=1, ddof=1)
    kinds = list(dict.fromkeys(name for names in groups.values() for name in names))
    axes = page.axes()
    width, first = 0.8 / len(kinds), 0
    for place, (group, names) in enumerate(groups.items()):
        own = slice(first, first + len(names))
        lefts = place + (np.array([kinds.index(name) for name in names]) - (len(kinds) - 1) / 2) * width
        for name, left, height, bar in zip(names, lefts, mean[own], deviation[own], strict=True):
            colour = LINES[kinds.index(name)][0]
            axes.bar(left, height, 0.92 * width, color=colour, alpha=0.85, label=name if place == 0 else None)
            if bar:
                axes.errorbar(left, height, yerr=bar, color=FAINT, capsize=2, elinewidth=0.8)
            axes.annotate(f"{height:.3g}", (left, 0), (0, 2), textcoords="offset points", ha="center", color="white")
        if len(names) == 2:
            low, high = mean[own]
            top = (mean + deviation).max() * 1.06
            axes.annotate("", (lefts[0], top), (lefts[1], top), arrowprops={"arrowstyle": "|-|", "mutation_scale": 2.5})
            told = f"{group}: drift {abs(high - low):.2g} {unit}"
            axes.annotate(told, (place, top), (0, 4), textcoords="offset points", ha="center", color=INK)
        first += len(names)
    axes.set_xticks(range(len(groups)), list(groups))
    axes.set(ylabel=f"{name_of(sweep, quantity)} ({unit})", ylim=(0, (mean + deviation).max() * 1.2))
    if title:
        axes.set_title(title)
    seeds = numbers.shape[1]
    if seeds > 1:
        axes.set_title(f"mean ± standard deviation of {seeds} surfaces", loc="right", fontsize=6.5, fontweight="normal")
    page.legend(axes)


def _caption(sweep: xr.Dataset, values: xr.DataArray, rest: list[Hashable], spread: str) -> str:
    cells = int(np.prod([values.sizes[name] for name in rest]))
    if cells == 1 or not rest:
        return ""
    over = ", ".join(name_of(sweep, str(name), symbol=False) for name in rest)
    of = f"of {cells} surfaces" if all("seed" in str(name) for name in rest) else f"over {cells} cells ({over})"
    told = {
        "deviation": "mean ± standard deviation",
        "quantiles": f"median, {100 * QUANTILES[0]:.0f} to {100 * QUANTILES[1]:.0f} %",
        "none": "mean",
    }
    return f"{told[spread]} {of}"
