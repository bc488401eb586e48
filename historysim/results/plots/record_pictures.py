"""Pictures of records: a model beside its measurement, channels and spectra, sliding, creep, columns of a table."""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats, Integers
from historysim.basics.wording import listed
from historysim.errors import InputError
from historysim.loads.events import load_kind
from historysim.measured.comparison import Comparison
from historysim.measured.correction import sampling_rate
from historysim.measured.creep import Creep
from historysim.measured.reduction import Measurement
from historysim.measured.sliding import UNITS, Sliding
from historysim.results.plots.canvas import TWO_COLUMNS, WIDE, Canvas, Size
from historysim.results.plots.pictures import PICTURES, SCENARIO, Titled
from historysim.results.plots.style import (
    FAINT,
    INK,
    MARK,
    STATE_COLOURS,
    label_loop,
    line_style,
    note_instead,
    scale_of,
    scaled,
)
from historysim.results.tables import WrittenTable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes

MOST_POINTS, MOST_SAMPLES = 50_000, 20_000  # points of a comparison, and samples of a channel, that are drawn
MEASURED, CORRECTED, MODEL = "#d1603d", "#e0b73c", "#12355b"


@PICTURES.register
@attrs.frozen(kw_only=True)
class ComparisonPicture(Titled):
    """Loops and loads of measurement and model over each other, energies, and residuals."""

    kind, of, size, alone = "comparison", (Comparison,), (TWO_COLUMNS, 137.0), True

    def draw(self, canvas: Canvas, data: Comparison) -> None:
        """Draw as many panels as fit."""
        canvas.several(len(COMPARED))
        wide, room = canvas.width >= WIDE, 1
        if wide:
            room = 5 if canvas.height >= 95.0 else 2
        elif canvas.height >= 105.0:
            room = 4
        count, rows, *heights = next(each for each in LAYOUTS[wide] if min(room, canvas.most) >= each[0])
        canvas.fitting([called for called, _ in COMPARED.values()], count)
        panels = canvas.figure.subplot_mosaic(rows, height_ratios=heights)
        for name, axes in panels.items():
            COMPARED[name][1](axes, data)
        canvas.legend(*(axes for name, axes in panels.items() if name in "LR"))
        canvas.heading(self.title)


def _thin(comparison: Comparison) -> Integers:
    """Return the samples to draw: all turning points, and of the rest no more than a picture can show."""
    observation = comparison.observation
    stride = -(-observation.time.size // MOST_POINTS)
    return np.union1d(np.arange(0, observation.time.size, stride), observation.turns)


def _draw_loops(axes: "Axes", comparison: Comparison) -> None:
    observation, response = comparison.observation, comparison.response
    shown = _thin(comparison)
    length, force = label_loop(
        axes, [observation.displacement], [observation.tangential_load, response.tangential_load]
    )
    dots: dict[str, Any] = {"linestyle": "", "marker": ".", "ms": 2.4, "markeredgewidth": 0}
    dots |= {"rasterized": True, "zorder": 2}
    load, modelled = observation.tangential_load, response.tangential_load
    axes.plot(observation.displacement[shown] * length, load[shown] * force, color=MEASURED, label="measured", **dots)
    # along a branch the model passes the displacements in their order, not in that of time
    branches = zip(observation.turns[:-1], observation.turns[1:], strict=True)
    rises = [
        (slice(start, end), np.sign(response.displacement[end] - response.displacement[start]))
        for start, end in branches
    ]
    in_order = [part.start + np.argsort(response.displacement[part] * sign) for part, sign in rises]
    order = np.concatenate([*in_order, observation.turns[-1:]])
    # of a long record no more than a picture can show, and all turning points
    order = order[np.union1d(np.arange(0, order.size, -(-order.size // MOST_POINTS)), observation.turns)]
    # over the points: in their noise it would not be seen
    line: dict[str, Any] = {"color": MODEL, "linewidth": 0.8, "rasterized": True, "zorder": 3}
    axes.plot(response.displacement[order] * length, modelled[order] * force, label="model", **line)
    if not comparison.instrument.rigid:
        stiffness = comparison.instrument.stiffness
        contact = observation.displacement - load / stiffness
        dots["color"] = CORRECTED
        axes.plot(contact[shown] * length, load[shown] * force, label="measured, of the contact", **dots)
        contact = response.displacement - modelled / stiffness
        line["linestyle"] = (0, (4, 1.5))
        axes.plot(contact[order] * length, modelled[order] * force, label="model, of the contact", **line)
    axes.margins(0.06)
    axes.set_title("Friction loops")


def _draw_loads(axes: "Axes", comparison: Comparison) -> None:
    observation = comparison.observation
    shown = _thin(comparison)
    time, loads = observation.time[shown], [each.tangential_load[shown] for each in (observation, comparison.response)]
    force, unit = scale_of("N", *loads)
    for load, colour, width in zip(loads, (MEASURED, MODEL), (0.9, 0.6), strict=True):
        axes.plot(time, load * force, color=colour, linewidth=width, rasterized=True)
    axes.margins(x=0.01)
    axes.set(title="Tangential load", ylabel=f"$T$ ({unit})", xlabel="time (s)")


def _draw_difference(axes: "Axes", comparison: Comparison) -> None:
    observation, (off, unit) = comparison.observation, scaled(comparison.difference, "N")
    stride = -(-off.size // MOST_POINTS)
    time = observation.time[observation.first :][::stride]
    axes.axhline(0, color=FAINT, linewidth=0.6)
    axes.plot(time, off[::stride], ".", color=INK, markersize=1.2, markeredgewidth=0, rasterized=True)
    axes.set(title="Measured less model", ylabel=f"$ΔT$ ({unit})", xlabel="time (s)")


def _draw_residuals(axes: "Axes", comparison: Comparison) -> None:
    """Draw residuals over the branches, in the mean of those that rise, and of those that fall."""
    left = comparison.left
    factor, unit = scale_of("N", left.mean)
    axes.axhline(0, color=FAINT, linewidth=0.6)
    for way, mean, colour, label in zip(left.place, left.mean, (INK, CORRECTED), ("forward", "backward"), strict=True):
        axes.plot(100 * way, mean * factor, color=colour, linewidth=1.0, label=label)
    axes.margins(y=0.12)
    axes.set(title="Residuals over the branch", ylabel=f"mean $ΔT$ ({unit})", xlabel="way from reversal (%)")


def _draw_energies(axes: "Axes", comparison: Comparison) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(title="Energies", xlabel="loop")
    if comparison.measured is None or comparison.model is None:
        note_instead(axes, "no whole loop")
        return
    energies = [loops.dissipated_energy for loops in (comparison.measured, comparison.model)]
    known = np.concatenate(energies)
    # a loop in which the normal load steps has no energy
    known = known[np.isfinite(known)] if np.isfinite(known).any() else np.zeros(1)
    factor, unit = scale_of("J", known)
    sets = ("measured", comparison.measured, "o", MEASURED), ("model", comparison.model, "x", MODEL)
    for (name, loops, marker, colour), energy in zip(sets, energies, strict=True):
        axes.plot(loops.number + 1, energy * factor, marker, color=colour, markersize=4, mfc="none", label=name)
    # from zero, so that heights compare; a record with mixed-up signs has energies below it
    lowest, highest = (factor * float(at(known)) for at in (np.min, np.max))
    axes.set_ylim(min(0.0, 1.15 * lowest), max(0.0, 1.15 * highest) or None)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel(f"$∮T\\,dU$ ({unit})")


# Panels of a comparison by their letters in the layout: what each is called, and what draws it.
COMPARED: "dict[str, tuple[str, Callable[[Axes, Comparison], None]]]" = {
    "L": ("friction loops", _draw_loops),
    "T": ("tangential load", _draw_loads),
    "E": ("energies", _draw_energies),
    "D": ("measured less model", _draw_difference),
    "R": ("residuals", _draw_residuals),
}

# How many panels, where they stand, and heights of their rows, in a wide figure and in a narrow one.
LAYOUTS: dict[bool, list[tuple[Any, ...]]] = {
    True: [(5, "LLLTTT;EEDDRR", 1.25, 1.0), (2, "LT", 1.0), (1, "L", 1.0)],
    False: [(4, "LL;TT;ED", 2.2, 1.1, 1.1), (2, "L;T", 2.0, 1.1), (1, "L", 1.0)],
}

DETAIL, PIECE = 200, 8192  # samples that the detail of a channel, and a piece of its spectrum, take
LEAST_ROW = 24.0  # height of a channel [mm]


@PICTURES.register
@attrs.frozen(kw_only=True)
class RecordPicture(Titled):
    """The channels of a measured file as they were read, beside what conditioning left of them."""

    kind, of, alone = "record", (Measurement, SCENARIO), True

    def size_of(self, data: Measurement) -> Size:
        """Return a row for each channel."""
        return TWO_COLUMNS, 18.0 + 45.0 * len(_changing(data))

    def draw(self, canvas: Canvas, data: Measurement) -> None:
        """Draw channels over time, a detail, and amplitudes over the frequency; without an even clock no spectrum."""
        channels = _changing(data)
        try:
            rate = sampling_rate(data.time)
        except InputError:
            rate = None
        # at the width of one column there is no room for more than the whole of each
        columns = 3 if canvas.width >= WIDE else 1
        names = [name.replace("_", " ") for name in channels]
        rows = len(canvas.fitting(names, int((canvas.height - 18.0) / LEAST_ROW)))
        if columns == 1:
            canvas.notice("at the width of one column there is no room for details and spectra")
        figure = canvas.several(rows * columns) if rows * columns > 1 else canvas.figure
        grid = figure.add_gridspec(rows, columns, width_ratios=(1.4, 1, 1)[:columns])
        for row, (name, values) in enumerate([*channels.items()][:rows]):
            read = values + data.removed[name] if name in data.removed else None
            factor, unit = scale_of(load_kind(name).unit, values)
            whole = canvas.given or figure.add_subplot(grid[row, 0])
            evenly = np.unique(np.linspace(0, values.size - 1, min(values.size, MOST_SAMPLES)).astype(int))
            _draw_channel(whole, data.time, values, read, evenly, factor)
            whole.set(title=name.replace("_", " ").capitalize(), ylabel=f"({unit})")
            panels = [(whole, "time (s)")]
            if columns == 3:
                detail, spectrum = (figure.add_subplot(grid[row, column]) for column in (1, 2))
                _draw_channel(detail, data.time, values, read, _detail(values), factor)
                detail.set(title="Detail")
                detail.ticklabel_format(axis="x", useOffset=False)
                _draw_spectrum(spectrum, values, read, rate, factor, unit)
                panels += [(detail, "time (s)"), (spectrum, "frequency (Hz)")]
            for axes, label in panels if row == rows - 1 else []:
                axes.set(xlabel=label)
        canvas.legend(*([canvas.given] if canvas.given is not None else figure.axes))
        canvas.heading(self.title)


def _changing(measurement: Measurement) -> dict[str, Floats]:
    """Return the channels that change."""
    every = {**measurement.channels, **measurement.response}
    found = {name: values for name, values in every.items() if np.ptp(values) > 0}
    if not found:
        raise InputError("the record has constants alone; expected a channel that changes, to draw it")
    return found


def _draw_channel(
    axes: "Axes", time: Floats, values: Floats, read: Floats | None, shown: Integers, factor: float
) -> None:
    line: dict[str, Any] = {"rasterized": True, "solid_joinstyle": "round"}
    if read is not None:
        axes.plot(time[shown], read[shown] * factor, color=FAINT, linewidth=0.7, label="as read", **line)
    axes.plot(time[shown], values[shown] * factor, color=MARK, linewidth=0.8, label="as used", **line)
    axes.margins(x=0.01)


def _detail(values: Floats) -> Integers:
    """Return samples around the last greatest value, where a channel turns or slides."""
    count = min(DETAIL, values.size)
    start = int(np.clip(int(values.argmax()) - count // 2, 0, values.size - count))
    return np.arange(start, start + count)


def _draw_spectrum(
    axes: "Axes", values: Floats, read: Floats | None, rate: float | None, factor: float, unit: str
) -> None:
    axes.set(title="Amplitude", ylabel=f"({unit})")
    if rate is None:
        note_instead(axes, "no even clock")
        return
    from scipy import signal

    for channel, colour, width in ((read, FAINT, 0.8), (values, MARK, 0.8)):
        if channel is not None:
            length = min(PIECE, channel.size)
            frequency, power = signal.welch(channel, rate, nperseg=length, scaling="spectrum", detrend="linear")
            # of a sine, its amplitude; the first bins hold what is left of the mean
            axes.semilogy(frequency[2:], np.sqrt(2 * power[2:]) * factor, color=colour, linewidth=width)
    axes.margins(x=0.01)


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlidingPicture(Titled):
    """The friction coefficient over time or distance, with its windows, static peak and approach to a steady value."""

    kind, of, size, alone = "sliding", (Sliding,), (TWO_COLUMNS, 92.0), True

    def draw(self, canvas: Canvas, data: Sliding) -> None:
        """Draw them."""
        axes = canvas.axes()
        factor, unit = scale_of("m", data.place) if data.over == "distance" else (1.0, UNITS[data.over])
        stride = -(-data.place.size // MOST_SAMPLES)
        dots: dict[str, Any] = {"linestyle": "", "marker": ".", "ms": 2.2, "mew": 0, "color": FAINT, "alpha": 0.6}
        at, friction = data.place[::stride] * factor, data.coefficient[::stride]
        if np.isfinite(friction).any():
            axes.plot(at, friction, rasterized=True, label="samples", zorder=1, **dots)
        windows = data.window_place * factor, data.window_mean
        axes.plot(*windows, "o", color=STATE_COLOURS[1], ms=3, label="windows", zorder=2)
        if data.approach is not None:
            way = np.linspace(data.approach.origin, data.place[-1], 200)
            line: dict[str, Any] = {"color": STATE_COLOURS[2], "linewidth": 1.2, "zorder": 3}
            axes.plot(way * factor, data.approach.at(way), label="approach", **line)
            steady = line | {"linewidth": 0.7, "linestyle": (0, (4, 2)), "zorder": 0}
            axes.axhline(data.approach.steady, **steady)
        if data.peak is not None:
            peak = data.peak.place * factor, data.peak.coefficient
            axes.plot(*peak, "^", color=INK, ms=5, label="static peak", zorder=4)
        axes.set(title="Friction coefficient", xlabel=f"{data.over} ({unit})", ylabel="$μ = T/N$")
        canvas.legend(axes)
        canvas.heading(self.title)


MOST_PANELS, MOST_LINES = 4, 6


@PICTURES.register
@attrs.frozen(kw_only=True)
class TablePicture(Titled):
    """The columns of a table over its first column of numbers, those of one unit in one panel."""

    kind, of, alone = "table", (WrittenTable,), True

    def size_of(self, data: WrittenTable | xr.Dataset) -> Size:
        """Return a row for each unit."""
        return TWO_COLUMNS, 30.0 + 45.0 * min(len(_by_unit(_table(data))[2]), MOST_PANELS)

    def draw(self, canvas: Canvas, data: WrittenTable | xr.Dataset) -> None:
        """Draw up to 4 panels of up to 6 lines."""
        written = _table(data)
        first, numbers, by_unit = _by_unit(written)
        panels = list(by_unit.items())
        panels = panels[: len(canvas.fitting([_called(names) for _, names in panels], MOST_PANELS))]
        if len(panels) == 1:
            all_axes = [canvas.axes()]
        else:
            all_axes = list(canvas.several(len(panels)).subplots(len(panels), 1, sharex=True))
        unit = str(numbers[first].attrs.get("units", "1"))
        factor, unit = _scale(numbers[first].values, unit)
        at = numbers[first].values * factor
        left_out: list[str] = []
        for axes, (its_unit, names) in zip(all_axes, panels, strict=True):
            left_out += names[MOST_LINES:]
            _draw_columns(axes, at, {name: numbers[name].values for name in names[:MOST_LINES]}, its_unit)
        all_axes[-1].set_xlabel(first.replace("_", " ") + ("" if unit == "1" else f" ({unit})"))
        if len(panels) == 1:
            canvas.legend(*all_axes)
        else:
            # lines of two panels look alike
            for axes in all_axes:
                axes.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
        if left_out:
            canvas.notice(f"there is no room for {listed([name.replace('_', ' ') for name in left_out])}")
        canvas.heading(self.title or written.name)


def _table(data: WrittenTable | xr.Dataset) -> WrittenTable:
    return (
        data if isinstance(data, WrittenTable) else WrittenTable.of(data, str(data.attrs.get("title", "this Dataset")))
    )


def _by_unit(table: WrittenTable) -> tuple[str, dict[str, Any], dict[str, list[str]]]:
    """Return the first column of numbers, all of them, and the names of the others by their units."""
    numbers = {str(name): each for name, each in table.columns.items() if each.dtype.kind in "fiu"}
    if len(numbers) < 2 or not table.columns.sizes["row"]:
        raise InputError(f"{table.name}: needs at least two columns of numbers to draw; `show` lists its columns")
    first, *others = numbers
    by_unit: dict[str, list[str]] = {}
    for name in others:
        by_unit.setdefault(str(numbers[name].attrs.get("units", "1")), []).append(name)
    return first, numbers, by_unit


def _called(names: "Sequence[str]") -> str:
    return " and ".join(name.replace("_", " ") for name in names[:2]) + (" and others" if len(names) > 2 else "")


def _draw_columns(axes: "Axes", at: Floats, columns: dict[str, Floats], unit: str) -> None:
    factor, unit = _scale(np.concatenate([*columns.values()]), unit)
    for number, (name, values) in enumerate(columns.items()):
        axes.plot(at, values * factor, label=name.replace("_", " "), **line_style(number, MOST_LINES))
    label = next(iter(columns)).replace("_", " ") if len(columns) == 1 else "value"
    axes.set_ylabel(f"{label} ({unit})" if unit != "1" else label)


def _scale(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the unit for a column; units of several factors, powers and seconds have no prefix."""
    return scale_of(unit, values) if unit in {"N", "m", "J", "Pa"} else (1.0, unit)


@PICTURES.register
@attrs.frozen(kw_only=True)
class CreepPicture(Titled):
    """Relaxation of the load in the holds of a record over log time, and the parts of its change in each hold."""

    kind, of, size, alone = "creep", (Creep,), (TWO_COLUMNS, 92.0), True

    def draw(self, canvas: Canvas, data: Creep) -> None:
        """Draw what memory and sensor leave of the load, and the parts."""
        axes, beside = canvas.two(("relaxation", "parts of the change"), 1.1)
        for there, colour, marker, name in (
            (data.forward, STATE_COLOURS[1], "o", "held forward"),
            (~data.forward, STATE_COLOURS[2], "s", "held backward"),
        ):
            looks: dict[str, Any] = {"linestyle": "", "marker": marker, "ms": 2.6, "mfc": "none", "mew": 0.6}
            axes.plot(data.time[there], 100 * data.relaxed[there], color=colour, label=name, **looks)
        if not data.unknown:
            way = np.geomspace(data.time.min(), data.time.max(), 200)
            share, colour = -100 * data.relaxation.value / np.log(10), CORRECTED
            axes.plot(way, share * np.log1p(way / data.onset), color=colour, linewidth=1.4, zorder=3, label="log time")
        axes.set_xscale("log")
        axes.set(
            title="Relaxation", xlabel="time since the displacement rests (s)", ylabel="change of $T$ over $T$ (%)"
        )
        if beside is not None:
            _draw_parts(beside, data)
        canvas.legend(*(each for each in (axes, beside) if each is not None))
        canvas.heading(
            self.title, "; ".join(f"{label} {text}" for label, text in data.summary() if label == "relaxation")
        )


def _draw_parts(axes: "Axes", data: Creep) -> None:
    """Draw bars of the change of the load against its own direction, a bar for each hold."""
    from matplotlib.ticker import MaxNLocator

    sense = np.sign([hold.tangential_load for hold in data.holds])
    parts = {name: sense * [getattr(hold, name) for hold in data.holds] for name in ("memory", "relaxation", "sensor")}
    change = sense * [hold.change for hold in data.holds]
    factor, unit = scale_of("N", change, *parts.values())
    number, low, high = np.arange(1, sense.size + 1), np.zeros(sense.size), np.zeros(sense.size)
    for (name, values), colour in zip(parts.items(), (MODEL, CORRECTED, FAINT), strict=True):
        known = np.nan_to_num(values) * factor
        below = np.where(known < 0, low, high)
        axes.bar(number, known, 0.7, bottom=below, color=colour, label=name)
        low, high = low + np.minimum(known, 0), high + np.maximum(known, 0)
    axes.plot(number, change * factor, "_", color=INK, ms=9, mew=1.2, label="measured")
    axes.axhline(0, color=FAINT, linewidth=0.6)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(title="Parts of the change", xlabel="hold", ylabel=f"$ΔT$ along $T$ ({unit})")
