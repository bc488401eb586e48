"""Pictures of measured friction loops: the loops, their values from loop to loop, and over their loads."""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.basics.arguments import Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import count_text
from historysim.measured.fretting import TRANSITION_A, TRANSITION_B, Fretting
from historysim.measured.loop_table import LoopStatistics, LoopTable
from historysim.measured.loop_values import DIRECTIONS
from historysim.measured.loops import Loops
from historysim.results.plots.canvas import TWO_COLUMNS
from historysim.results.plots.chart import (
    MOVED,
    SHIFT,
    Chart,
    Curve,
    Item,
    Note,
    Shape,
    Sheet,
    span,
)
from historysim.results.plots.pictures import PICTURES, Titled
from historysim.results.plots.style import (
    DASHED,
    FAINT,
    INK,
    LOOP_AXES,
    LOOP_NUMBER,
    MOST_EDGED,
    STATE_COLOURS,
    Look,
    escape_math,
    format_unit,
)
from historysim.results.tables import values_in_mean

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist

COLOURS, MARKERS = STATE_COLOURS[1:3], "^v"
FIRST, LAST = {"F": "friction_force", "P": "preliminary_displacement"}, {"E": "dissipated_energy"}
TRENDS = FIRST | {"S": "tangential_stiffness"} | LAST
LEVELS = FIRST | {"C": "friction_coefficient"} | LAST
# samples outside of the loops
REST: Look = {"color": FAINT, "linewidth": 0.6, "alpha": 0.7, "zorder": 1}


@PICTURES.register
@attrs.frozen(kw_only=True)
class MeasuredLoopsPicture(Titled):
    """Measured friction loops over one another, with their means, and their change from loop to loop.

    At one normal load the loop of median energy is drawn stronger than the others, and at it the
    means of the first set are marked: the friction force of both directions, and the preliminary
    displacement and the stiffness of the forward branches. At several loads the loops have the
    colours of their loads. Grey is the rest of the record, and branches that are left out.

    Attributes
    ----------
    model
        A second set, to compare.
    labels
        Names of the two sets.
    """

    model: Loops | None = None
    labels: tuple[str, ...] = ("measured", "model")

    kind, of, size, own_figure = "measured-loops", (Loops,), (TWO_COLUMNS, 117.0), True

    def sheet(self, data: Loops) -> Sheet:
        """Return the loops, and the trends next to them."""
        sets = [data] if self.model is None else [data, self.model]
        has_trends = len(data) > 1
        several_loads = int(data.load_level.max()) > 0
        items = _levels(sets, self.labels) if several_loads else _loops(sets, self.labels)
        names = (
            [f"{escape_math(label)}, from loop to loop" for label in self.labels]
            if len(sets) > 1
            else []
        )
        options: Look = {
            "title": "Friction loops",
            "margins": (0.05, 0.18),
            "height": 40.0,
        }
        charts = {"L": Chart(items=items, **options, **LOOP_AXES)}
        if not has_trends:
            return Sheet(charts, notices=("no trends from loop to loop: there is one",))
        charts |= _trends(
            [loops.to_dataset() for loops in sets], 20.0, names if several_loads else ()
        )
        return Sheet(charts, wide="LLFF;LLPP;LLSS;LLEE", narrow="LL;FP;SE")


def _loops(sets: list[Loops], labels: Sequence[str]) -> list[Item]:
    """Return the loops of one normal load, each set in its colour."""
    items: list[Item] = []
    for loops, colour, label in zip(sets, COLOURS, labels, strict=False):
        items += [_part(loops, start, stop, "", REST) for start, stop in loops.left_out]
        if loops.left_out_branches.any() or np.any(np.diff(loops.number) > 1):
            items.append(_part(loops, loops.ends[0, 0], loops.ends[-1, 2], "", REST))
        for start, stop in _branches(loops):
            items.append(
                _part(
                    loops,
                    start,
                    stop,
                    "",
                    {"color": colour, "linewidth": 0.6, "alpha": 0.4, "zorder": 2},
                )
            )
        start, _, stop = loops.ends[_typical(loops)]
        count = count_text(len(loops), "loop", "loops")
        name = f"{escape_math(label)}, {count}" if len(sets) > 1 else count
        items.append(
            _part(loops, start, stop, name, {"color": colour, "linewidth": 1.3, "zorder": 3})
        )
    return items + _means(sets[0])


def _levels(sets: list[Loops], labels: Sequence[str]) -> list[Item]:
    """Return the loops of several normal loads, each in the colour of its load; a second set is dashed."""
    import matplotlib as mpl

    items: list[Item] = []
    loads = sets[0].by_load()
    # the light end is left out: it is lost on white
    colours = mpl.colormaps["viridis_r"](np.linspace(0.15, 1.0, len(loads)))
    for order, (loops, label) in enumerate(zip(sets, labels, strict=False)):
        if order == 0:
            items.append(_part(loops, 0, loops.trace.time.size - 1, "", REST))
        for value, colour in zip(loads.value, colours, strict=True):
            load = np.nanmean(loops.normal_load, axis=1)
            selected = np.flatnonzero(np.abs(load - value) <= loops.definitions.load_share * value)
            name = f"{quantity_text(float(value), 'N', 3)}, {count_text(selected.size, 'loop', 'loops')}"
            look: Look = {"color": colour, "linewidth": 1.0, "zorder": 2}
            if order:
                name = escape_math(label)
                look = {"color": INK, "linewidth": 0.8, "zorder": 3, "linestyle": (0, (3, 1.5))}
            items += [
                _part(loops, start, stop, name, look) for start, stop in _branches(loops, selected)
            ]
    return items


def _part(loops: Loops, start: int, stop: int, label: str, look: Look) -> Curve:
    """Return a record from one sample to another."""
    x, y = (
        values[start : stop + 1]
        for values in (loops.trace.displacement, loops.trace.tangential_load)
    )
    return Curve(x, y, label, {"rasterized": True, "solid_joinstyle": "round"} | look)


def _branches(loops: Loops, which: Integers | None = None) -> list[list[int]]:
    """Return the ends of the branches that are not left out, joined where they follow each other."""
    pieces: list[list[int]] = []
    for loop in range(len(loops)) if which is None else which:
        ends = loops.ends[loop]
        for start, stop in ((ends[0], ends[1]), (ends[1], ends[2])):
            backward = int(loops.trace.displacement[stop] < loops.trace.displacement[start])
            if loops.left_out_branches[loop, backward] or start == stop:
                continue
            if pieces and pieces[-1][1] == start:
                pieces[-1][1] = int(stop)
            else:
                pieces.append([int(start), int(stop)])
    return pieces


def _means(loops: Loops) -> list[Item]:
    """Return marks of the means at the forward branch of the typical loop and at both of its plateaus."""
    start, turn, stop = loops.ends[_typical(loops)]
    u = loops.trace.displacement
    f = loops.trace.tangential_load
    low, high = (start, turn) if u[start] < u[turn] else (turn, stop)
    lower = u[low]
    upper = u[high]
    bottom = f[low]
    top, backward = (loops.statistics("friction_force", direction).mean for direction in DIRECTIONS)
    if not np.isfinite([top, backward]).all():
        # without sliding there is no friction force to mark
        return []
    line: Look = {"color": INK, "linewidth": 0.9, "zorder": 4}
    dashes = line | {"linestyle": (0, (4, 2))}
    items: list[Item] = [
        Curve([lower, upper], [top, top], "means", dashes),
        Curve([lower, upper], [-backward, -backward], "", dashes),
        Note(quantity_text(top, "N", 3), (upper, top), (0, 4), {"ha": "right"}),
        Note(quantity_text(backward, "N", 3), (upper, -backward), (0, -4), {"ha": "right"}),
    ]
    displacement = loops.statistics("preliminary_displacement", "forward").mean
    if np.isfinite(displacement):
        middle = bottom + 0.3 * (top - bottom)
        reached = lower + displacement
        dots = line | {"linewidth": 0.5, "linestyle": (0, (1, 2))}
        items += [
            span((lower, middle), (reached, middle)),
            Curve([reached, reached], [middle, top], "", dots),
        ]
        items.append(Note(quantity_text(displacement, "m", 3), (reached, middle), (5, 0)))
    stiffness = loops.statistics("tangential_stiffness", "forward").mean
    if np.isfinite(stiffness):
        rise = loops.definitions.initial_part * (top - bottom)
        # through the middle of the fitted samples, and on to where it is visible
        fitted = slice(low, low + max(int((f[low:] >= bottom + rise).argmax()), 1))
        x = u[fitted].mean()
        y = f[fitted].mean()
        ends = np.array([bottom, bottom + 0.6 * (top - bottom)])
        items.append(Curve(x + (ends - y) / stiffness, ends, "", line))
        items.append(
            Note(
                quantity_text(stiffness, "N/m", 3), (x + (ends[1] - y) / stiffness, ends[1]), (5, 0)
            )
        )
    return items


def _typical(loops: Loops) -> int:
    """Return the loop of median energy among those that the means are of."""
    energy = np.where(loops.large, loops.dissipated_energy, np.nan)
    evaluated = int(np.isfinite(energy).sum()) or len(loops)
    return int(np.argsort(energy, kind="stable")[(evaluated - 1) // 2])


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopTrendsPicture(Titled):
    """Friction force, preliminary displacement, stiffness and energy of each loop, with their means at one load."""

    kind, of, size, own_figure, headed = "loop-trends", (), (TWO_COLUMNS, 97.0), True, True

    def sheet(self, data: "xr.Dataset") -> Sheet:
        """Return charts of the Dataset of `Loops.to_dataset`."""
        return Sheet(_trends([data], 24.0), wide="FP;SE", narrow="FP;SE")


def _trend_keys(names: Sequence[str]) -> "list[Artist]":
    from matplotlib.lines import Line2D

    key = partial(Line2D, [], [], linestyle="", ms=3.5)
    sets = [
        key(marker="o", color=colour, label=name)
        for colour, name in zip(COLOURS, names, strict=False)
    ]
    marks = zip((*MARKERS, ""), (*DIRECTIONS, MOVED), strict=True)
    return [*sets, *(key(marker=marker, color=INK, label=name) for marker, name in marks)]


def _trends(
    sets: "Sequence[xr.Dataset]", height: float, names: Sequence[str] = ()
) -> dict[str, Chart]:
    """Return a chart for each of the `TRENDS`, of one set of loops or of several in their colours."""
    charts = {}
    for letter, quantity in TRENDS.items():
        items: list[Item] = []
        values = [loops[quantity].values.reshape(loops.sizes["loop"], -1) for loops in sets]
        # one marker for each direction, or a dot for the whole loop
        markers = MARKERS if values[0].shape[1] == len(MARKERS) else "o"
        columns = len(sets) * len(markers)
        finite = np.concatenate([array[np.isfinite(array)] for array in values])
        for number, (loops, value, colour) in enumerate(zip(sets, values, COLOURS, strict=False)):
            look: Look = {
                "color": colour,
                "ms": 3.5,
                "mec": "white",
                "mew": 0.4,
                "clip_on": False,
            }
            look |= {"ms": 1.8, "mew": 0, "rasterized": True} if len(value) > MOST_EDGED else {}
            for column, marker in enumerate(markers):
                shift = SHIFT * (number * len(markers) + column - (columns - 1) / 2)
                look |= {"marker": marker, "linestyle": ""}
                items.append(
                    Curve(loops["loop"].values, value[:, column], "", dict(look), shift=shift)
                )
            # a mean over several loads has no meaning
            if "load_level" not in loops or np.unique(loops["load_level"].values).size == 1:
                mean = LoopStatistics.from_values(values_in_mean(loops, quantity)).mean
                items.append(
                    Shape("axhline", (mean,), {"color": colour, "linewidth": 0.7, "zorder": 0})
                )
        low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
        # scatter below a tenth must not fill the panel
        room = max(0.2 * (high - low), 0.1 * max(abs(low), abs(high))) or 1.0
        axes = {"ylim": (low - room, high + room)}
        options: Look = {
            "height": height,
            "integers": True,
            "keys": _trend_keys(names),
            "axes": axes,
        }
        charts[letter] = _chart(sets[0][quantity], items, share="loop", x=LOOP_NUMBER, **options)
    return charts


def _chart(values: "xr.DataArray", items: Sequence[Item], **options: Any) -> Chart:
    """Return a chart of a quantity, with its label above."""
    labels: Look = {
        "name": str(values.name).replace("_", " "),
        "y": _label(values),
        "label_above": True,
    }
    return Chart(items=items, margins=(0.08, 0.1), **labels, **options)


def _from_zero(values: Floats) -> tuple[float, float]:
    """Return limits of an axis that include 0, so that heights compare, and leave room above the values."""
    low = np.nanmin(values, initial=0.0)
    high = np.nanmax(values, initial=0.0)
    return 1.2 * float(low), 1.2 * float(high) or 1.0


def _label(values: "xr.DataArray") -> str:
    unit = format_unit(values.attrs["units"])
    return f"{values.attrs['long_name']} ({unit})" if unit else str(values.attrs["long_name"])


# quantities of a fretting report that are drawn, and their values at the transition to gross slip
FRETTING = {
    "C": ("energy_friction_coefficient", None),
    "S": ("slip_amplitude", None),
    "A": ("energy_ratio", TRANSITION_A),
    "B": ("system_free_ratio", TRANSITION_B),
}
DECADES = 100.0  # range of the numbers of runs from which their axis is logarithmic


@PICTURES.register
@attrs.frozen(kw_only=True)
class FrettingPicture(Titled):
    """Energy friction coefficient, slip amplitude and energy ratios A and B of fretting cycles.

    Lines are the transition from partial slip to gross slip.
    """

    kind, of, size, own_figure, headed = "fretting", (Fretting,), (TWO_COLUMNS, 97.0), True, True

    def sheet(self, data: "Fretting | xr.Dataset") -> Sheet:
        """Return charts of a fretting report, or of a Dataset of loops or a report."""
        table = data.to_dataset() if isinstance(data, Fretting) else data
        along = "run" if "run" in table.dims else "loop"
        number = table[along].values
        charts = {}
        logarithmic = number.min() > 0 and number.max() >= DECADES * number.min()
        look = {"marker": "o", "linestyle": "", "color": COLOURS[0], "ms": 3.5, "clip_on": False}
        for letter, (name, transition) in FRETTING.items():
            items: list[Item] = [Curve(number, table[name].values, "", look)]
            if transition is not None:
                items.append(
                    Shape("axhline", (transition,), DASHED | {"label": "transition to gross slip"})
                )
            axes = {"ylim": _from_zero(table[name].values)} | (
                {"xscale": "log"} if logarithmic else {}
            )
            x = LOOP_NUMBER if along == "loop" else "run"
            charts[letter] = _chart(table[name], items, height=24.0, share=along, x=x, axes=axes)
        title = "" if self.title else str(table.attrs.get("title", ""))
        return Sheet(charts, wide="CS;AB", narrow="CS;AB", subtitle=title)


DIRECTION_MARKS = (
    ("forward", "^", STATE_COLOURS[1]),
    ("backward", "v", STATE_COLOURS[2]),
    ("both", "o", INK),
)


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopLevelsPicture(Titled):
    """Friction force, coefficient, preliminary displacement and energy over the normal load, or the amplitude.

    Error bars are the standard deviation of one loop; lines are the laws that were fitted to the
    means at the loads.
    """

    kind, of, size, own_figure, headed = (
        "loop-levels",
        (LoopTable,),
        (TWO_COLUMNS, 122.0),
        True,
        True,
    )

    def sheet(self, data: "LoopTable | xr.Dataset") -> Sheet:
        """Return charts of a table of loops, or of the Dataset of its `to_dataset`."""
        table = data.to_dataset() if isinstance(data, LoopTable) else data
        along = table[next(name for name in ("level", "amplitude_class") if name in table.coords)]
        charts = {}
        for letter, quantity in LEVELS.items():
            items, law = _level(table, quantity)
            if law:
                items.append(
                    Note(
                        law,
                        (0.03, 0.97),
                        (0, 0),
                        {"xycoords": "axes fraction", "ha": "left", "va": "top"},
                    )
                )
            ends = _from_zero(
                table[quantity].values + table[f"{quantity}_standard_deviation"].fillna(0).values
            )
            options: Look = {"height": 27.0, "share": "level", "axes": {"ylim": ends}}
            charts[letter] = _chart(table[quantity], items, x=_label(along), **options)
        title = "" if self.title else str(table.attrs.get("title", ""))
        note = f"bars: standard deviation of one loop; {MOVED}"
        return Sheet(charts, wide="FP;CE", narrow="FP;CE", subtitle=title, note=note)


def _level(table: "xr.Dataset", quantity: str) -> tuple[list[Item], str]:
    """Return the means of a quantity with their scatter, and its law."""
    values = table[quantity]
    items = list[Item]()
    along = table[values.dims[0]].values
    by_direction = "direction" in values.dims
    for number, (direction, marker, colour) in enumerate(
        DIRECTION_MARKS if by_direction else DIRECTION_MARKS[-1:]
    ):
        rows = table.sel(direction=direction) if by_direction else table
        # one loop has a mean and no scatter
        scatter = np.nan_to_num(rows[f"{quantity}_standard_deviation"].values)
        look = {"color": colour, "ms": 4, "mec": "white", "mew": 0.4, "fmt": marker}
        shift = SHIFT * (number - 1) if by_direction else 0.0
        items.append(
            Curve(
                along, rows[quantity].values, direction, look, errors={"yerr": scatter}, shift=shift
            )
        )
    attributes = table.attrs
    load = np.linspace(float(along.min()), float(along.max()), 60)
    if quantity == "friction_force" and "friction_line_slope" in attributes:
        slope = attributes["friction_line_slope"]
        offset = attributes["friction_line_intercept"]
        law = slope * load + offset
        text = f"$F$ = {slope:.3g} $N$ {'−' if offset < 0 else '+'} {quantity_text(abs(offset), 'N', 3)}"
    elif f"{quantity}_exponent" in attributes:
        exponent = attributes[f"{quantity}_exponent"]
        law = attributes[f"{quantity}_factor"] * load**exponent
        text = f"∝ $N^{{{exponent:.2f}}}$"
    else:
        return items, ""
    return [*items, Curve(load, law, "", DASHED | {"zorder": 0})], text
