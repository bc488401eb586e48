"""Pictures of records: a model beside its measurement, channels and spectra, sliding, creep, columns of a table."""

from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats
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
    LOOP_NUMBER,
    MARK,
    MOST_EDGED,
    MOST_TICKS,
    STATE_COLOURS,
    format_unit,
    kept_samples,
    label_loop,
    line_style,
    note_instead,
)
from historysim.results.tables import WrittenTable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes

MOST_POINTS, MOST_SAMPLES = 50_000, 20_000  # dots of a comparison, and samples of sliding, that are drawn
MEASURED, CORRECTED, MODEL = "#d1603d", "#e0b73c", "#12355b"
AS_READ: dict[str, Any] = {"color": FAINT, "linewidth": 0.7, "label": "as read"}
AS_USED: dict[str, Any] = {"color": MARK, "linewidth": 0.8, "label": "as used"}


@PICTURES.register
@attrs.frozen(kw_only=True)
class ComparisonPicture(Titled):
    """Loops and loads of measurement and model over each other, energies, and residuals."""

    kind, of, size, own_figure = "comparison", (Comparison,), (TWO_COLUMNS, 137.0), True

    def draw(self, canvas: Canvas, data: Comparison) -> None:
        """Draw as many panels as fit."""
        figure = canvas.several(len(COMPARED))
        count, rows, heights = next(
            (count, rows, heights)
            for count, width, height, rows, heights in LAYOUTS
            if count <= canvas.most and canvas.width >= width and canvas.height >= height
        )
        canvas.fitting([called for called, _ in COMPARED.values()], count)
        for name, axes in figure.subplot_mosaic(rows, height_ratios=heights).items():
            COMPARED[name][1](axes, data)


def _draw_loops(axes: "Axes", comparison: Comparison) -> None:
    observation, response = comparison.observation, comparison.response
    indices = kept_samples(observation.time.size, [observation.tangential_load], MOST_POINTS)
    label_loop(axes)
    dots: dict[str, Any] = {"linestyle": "", "marker": ".", "ms": 2.4, "markeredgewidth": 0}
    dots |= {"rasterized": True, "zorder": 2}
    load, modelled = observation.tangential_load, response.tangential_load
    axes.plot(observation.displacement[indices], load[indices], color=MEASURED, label="measured", **dots)
    # along a branch the model passes the displacements in their order, not in that of time
    branches = zip(observation.turns[:-1], observation.turns[1:], strict=True)
    rises = [
        (slice(start, stop), np.sign(response.displacement[stop] - response.displacement[start]))
        for start, stop in branches
    ]
    in_order = [branch.start + np.argsort(response.displacement[branch] * sign) for branch, sign in rises]
    order = np.concatenate([*in_order, observation.turns[-1:]])
    # over the points: in their noise it would not be seen
    line: dict[str, Any] = {"color": MODEL, "linewidth": 0.8, "rasterized": True, "zorder": 3}
    axes.plot(response.displacement[order], modelled[order], label="model", **line)
    instrument = comparison.instrument
    if not instrument.rigid or instrument.parallel_stiffness:
        stiffness = instrument.stiffness
        load = load - instrument.parallel_stiffness * observation.displacement
        modelled = response.contact_load
        contact = observation.displacement - load / stiffness
        dots["color"] = CORRECTED
        axes.plot(contact[indices], load[indices], label="measured, of the contact", **dots)
        contact = response.displacement - modelled / stiffness
        line["linestyle"] = (0, (4, 1.5))
        axes.plot(contact[order], modelled[order], label="model, of the contact", **line)
    axes.margins(0.06)
    axes.set_title("Friction loops")


def _draw_loads(axes: "Axes", comparison: Comparison) -> None:
    for channel, colour, width in ((comparison.observation, MEASURED, 0.9), (comparison.response, MODEL, 0.6)):
        looks: dict[str, Any] = {"color": colour, "linewidth": width, "rasterized": True}
        axes.plot(comparison.observation.time, channel.tangential_load, **looks)
    axes.margins(x=0.01)
    axes.set(title="Tangential load", ylabel="$T$ (N)", xlabel="time (s)")


def _draw_difference(axes: "Axes", comparison: Comparison) -> None:
    observation, off = comparison.observation, comparison.difference
    indices = kept_samples(off.size, [off], MOST_POINTS)
    axes.axhline(0, color=FAINT, linewidth=0.6)
    dots: dict[str, Any] = {"color": INK, "markersize": 1.2, "markeredgewidth": 0, "rasterized": True}
    axes.plot(observation.time[observation.start_sample :][indices], off[indices], ".", **dots)
    axes.set(title="Measured less model", ylabel="$ΔT$ (N)", xlabel="time (s)")


def _draw_residuals(axes: "Axes", comparison: Comparison) -> None:
    """Draw residuals over the branches, in the mean of those that rise, and of those that fall."""
    residuals = comparison.residuals
    axes.axhline(0, color=FAINT, linewidth=0.6)
    for direction, mean, colour, label in zip(
        residuals.position, residuals.mean, (INK, CORRECTED), ("forward", "backward"), strict=True
    ):
        axes.plot(100 * direction, mean, color=colour, linewidth=1.0, label=label)
    axes.margins(y=0.12)
    axes.set(title="Residuals over the branch", ylabel="mean $ΔT$ (N)", xlabel="way from reversal (%)")


def _draw_energies(axes: "Axes", comparison: Comparison) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(title="Energies", xlabel=LOOP_NUMBER)
    if comparison.measured is None or comparison.model is None:
        note_instead(axes, "no whole loop")
        return
    sets = ("measured", comparison.measured, "o", MEASURED), ("model", comparison.model, "x", MODEL)
    for name, loops, marker, colour in sets:
        size = 4 if len(loops) <= MOST_EDGED else 1.8
        looks: dict[str, Any] = {"color": colour, "markersize": size, "mfc": "none", "label": name}
        axes.plot(loops.number, loops.dissipated_energy, marker, **looks)
    # from zero, so that heights compare; a record with mixed-up signs has energies below it
    axes.axhline(0, linewidth=0)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=MOST_TICKS, integer=True))
    axes.set_ylabel("$∮T\\,dU$ (J)")


# Panels of a comparison by their letters in the layout: what each is called, and what draws it.
COMPARED: "dict[str, tuple[str, Callable[[Axes, Comparison], None]]]" = {
    "L": ("friction loops", _draw_loops),
    "T": ("tangential load", _draw_loads),
    "E": ("energies", _draw_energies),
    "D": ("measured less model", _draw_difference),
    "R": ("residuals", _draw_residuals),
}

# How many panels, least width and height [mm], where they stand, and heights of their rows.
LAYOUTS = (
    (5, WIDE, 95.0, "LLLTTT;EEDDRR", (1.25, 1.0)),
    (2, WIDE, 0.0, "LT", (1.0,)),
    (4, 0.0, 105.0, "LL;TT;ED", (2.2, 1.1, 1.1)),
    (2, 0.0, 105.0, "L;T", (2.0, 1.1)),
    (1, 0.0, 0.0, "L", (1.0,)),
)

DETAIL, PIECE = 200, 8192  # samples that the detail of a channel, and a piece of its spectrum, take
LEAST_ROW = 24.0  # height of a channel [mm]


@PICTURES.register
@attrs.frozen(kw_only=True)
class RecordPicture(Titled):
    """The channels of a measured file as read, and after conditioning."""

    kind, of, own_figure = "record", (Measurement, SCENARIO), True

    def default_size(self, data: Measurement) -> Size:
        """Return a row for each channel."""
        return TWO_COLUMNS, 18.0 + 45.0 * len(_changing(data))

    def draw(self, canvas: Canvas, data: Measurement) -> None:
        """Draw channels over time, a detail, and amplitudes over the frequency; without an even clock no spectrum."""
        channels = _changing(data)
        # at the width of one column there is no room for more than the whole of each
        columns = 3 if canvas.width >= WIDE else 1
        names = [name.replace("_", " ") for name in channels]
        rows = len(canvas.fitting(names, int((canvas.height - 18.0) / LEAST_ROW)))
        if columns == 1:
            canvas.notice("at the width of one column there is no room for details and spectra")
        if rows * columns == 1:
            grid = np.array([[canvas.axes()]])
        else:
            figure = canvas.several(rows * columns)
            grid = figure.subplots(rows, columns, width_ratios=(1.4, 1, 1)[:columns], squeeze=False)
        for (name, values), (time_axes, *detail_axes) in zip(channels.items(), grid, strict=False):
            read = values + data.removed[name] if name in data.removed else None
            unit = load_kind(name).unit
            _draw_channel(time_axes, data.time, values, read, slice(None))
            time_axes.set(title=name.replace("_", " ").capitalize(), ylabel=f"({unit})")
            if detail_axes:
                _draw_channel(detail_axes[0], data.time, values, read, _detail(values))
                detail_axes[0].set(title="Detail", ylabel=f"({unit})")
                detail_axes[0].ticklabel_format(axis="x", useOffset=False)
                _draw_spectrum(detail_axes[1], values, read, data.time, unit)
        for axes, label in zip(grid[-1], ("time (s)", "time (s)", "frequency (Hz)"), strict=False):
            axes.set_xlabel(label)


def _changing(measurement: Measurement) -> dict[str, Floats]:
    """Return the channels that change."""
    every = {**measurement.channels, **measurement.response}
    varying = {name: values for name, values in every.items() if np.ptp(values) > 0}
    if not varying:
        raise InputError("the record has constants alone; expected a channel that changes, to draw it")
    return varying


def _draw_channel(axes: "Axes", time: Floats, values: Floats, read: Floats | None, window: slice) -> None:
    for channel, looks in ((read, AS_READ), (values, AS_USED)):
        if channel is not None:
            axes.plot(time[window], channel[window], rasterized=True, solid_joinstyle="round", **looks)
    axes.margins(x=0.01)


def _detail(values: Floats) -> slice:
    """Return samples around the last greatest value, where a channel turns or slides."""
    count = min(DETAIL, values.size)
    start = int(np.clip(int(values.argmax()) - count // 2, 0, values.size - count))
    return slice(start, start + count)


def _draw_spectrum(axes: "Axes", values: Floats, read: Floats | None, time: Floats, unit: str) -> None:
    axes.set(title="Amplitude", ylabel=f"({unit})")
    try:
        rate = sampling_rate(time)
    except InputError:
        note_instead(axes, "no even clock")
        return
    from scipy import signal

    for channel, looks in ((read, AS_READ), (values, AS_USED)):
        if channel is not None:
            length = min(PIECE, channel.size)
            frequency, power = signal.welch(channel, rate, nperseg=length, scaling="spectrum", detrend="linear")
            # of a sine, its amplitude; the first bins hold what is left of the mean
            axes.semilogy(frequency[2:], np.sqrt(2 * power[2:]), **looks)
    axes.margins(x=0.01)


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlidingPicture(Titled):
    """The friction coefficient over time or distance, with its windows, static peak and approach to a steady value."""

    kind, of, size, own_figure = "sliding", (Sliding,), (TWO_COLUMNS, 92.0), True

    def draw(self, canvas: Canvas, data: Sliding) -> None:
        """Draw them."""
        axes = canvas.axes()
        indices = kept_samples(data.place.size, [data.coefficient], MOST_SAMPLES)
        dots: dict[str, Any] = {"linestyle": "", "marker": ".", "ms": 2.2, "mew": 0, "color": FAINT, "alpha": 0.6}
        friction = data.coefficient[indices]
        if np.isfinite(friction).any():
            axes.plot(data.place[indices], friction, rasterized=True, label="samples", zorder=1, **dots)
        axes.plot(data.window_place, data.window_mean, "o", color=STATE_COLOURS[1], ms=3, label="windows", zorder=2)
        if data.approach is not None:
            distance = np.linspace(data.approach.origin, data.place[-1], 200)
            line: dict[str, Any] = {"color": STATE_COLOURS[2], "linewidth": 1.2, "zorder": 3}
            axes.plot(distance, data.approach.at(distance), label="approach", **line)
            axes.axhline(data.approach.steady, **line | {"linewidth": 0.7, "linestyle": (0, (4, 2)), "zorder": 0})
        if data.peak is not None:
            axes.plot(data.peak.place, data.peak.coefficient, "^", color=INK, ms=5, label="static peak", zorder=4)
        axes.set(title="Friction coefficient", xlabel=f"{data.over} ({UNITS[data.over]})", ylabel="$μ = T/N$")


MOST_PANELS, MOST_LINES = 4, 6


@PICTURES.register
@attrs.frozen(kw_only=True)
class TablePicture(Titled):
    """The columns of a table over its first numeric column; columns of one unit share a panel."""

    kind, of, own_figure = "table", (WrittenTable,), True

    def default_size(self, data: WrittenTable | xr.Dataset) -> Size:
        """Return a row for each unit."""
        return TWO_COLUMNS, 30.0 + 45.0 * min(len(_by_unit(_table(data))[2]), MOST_PANELS)

    def draw(self, canvas: Canvas, data: WrittenTable | xr.Dataset) -> None:
        """Draw up to 4 panels of up to 6 lines."""
        written = _table(data)
        abscissa, numbers, by_unit = _by_unit(written)
        panels = list(by_unit.items())
        panels = panels[: len(canvas.fitting([_column_label(names) for _, names in panels], MOST_PANELS))]
        figure = canvas.several(len(panels)) if len(panels) > 1 else None
        all_axes = [canvas.axes()] if figure is None else figure.subplots(len(panels), 1, sharex=True)
        left_out: list[str] = []
        for axes, (unit, names) in zip(all_axes, panels, strict=True):
            left_out += names[MOST_LINES:]
            for number, name in enumerate(names[:MOST_LINES]):
                looks = line_style(number, MOST_LINES)
                axes.plot(numbers[abscissa], numbers[name], label=name.replace("_", " "), **looks)
            axes.set_ylabel(_label(names[0] if len(names) == 1 else "value", unit))
        all_axes[-1].set_xlabel(_label(abscissa, numbers[abscissa].attrs.get("units", "1")))
        canvas.named = len(panels) > 1
        # lines of two panels look alike
        for axes in all_axes if canvas.named else ():
            axes.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
        if left_out:
            canvas.notice(f"there is no room for {listed([name.replace('_', ' ') for name in left_out])}")
        if not self.title:
            canvas.heading(written.name)


def _table(data: WrittenTable | xr.Dataset) -> WrittenTable:
    return (
        data if isinstance(data, WrittenTable) else WrittenTable.of(data, str(data.attrs.get("title", "this Dataset")))
    )


def _by_unit(table: WrittenTable) -> tuple[str, dict[str, Any], dict[str, list[str]]]:
    """Return the first column of numbers, all of them, and the names of the others by their units."""
    numbers = {str(name): values for name, values in table.columns.items() if values.dtype.kind in "fiu"}
    if len(numbers) < 2 or not table.columns.sizes["row"]:
        raise InputError(f"{table.name}: needs at least two columns of numbers to draw; `show` lists its columns")
    abscissa, *ordinates = numbers
    by_unit: dict[str, list[str]] = {}
    for name in ordinates:
        by_unit.setdefault(str(numbers[name].attrs.get("units", "1")), []).append(name)
    return abscissa, numbers, by_unit


def _column_label(names: "Sequence[str]") -> str:
    return " and ".join(name.replace("_", " ") for name in names[:2]) + (" and others" if len(names) > 2 else "")


def _label(name: str, unit: str) -> str:
    words, text = name.replace("_", " "), format_unit(unit)
    return f"{words} ({text})" if text else words


@PICTURES.register
@attrs.frozen(kw_only=True)
class CreepPicture(Titled):
    """Relaxation of the load in the holds of a record over log time, and the parts of its change in each hold."""

    kind, of, size, own_figure = "creep", (Creep,), (TWO_COLUMNS, 92.0), True

    def draw(self, canvas: Canvas, data: Creep) -> None:
        """Draw the relaxation without memory and sensor contributions, and the contributions."""
        axes, parts_axes = canvas.two(("relaxation", "parts of the change"), 1.1)
        for selected, colour, marker, name in (
            (data.forward, STATE_COLOURS[1], "o", "held forward"),
            (~data.forward, STATE_COLOURS[2], "s", "held backward"),
        ):
            looks: dict[str, Any] = {"linestyle": "", "marker": marker, "ms": 2.6, "mfc": "none", "mew": 0.6}
            axes.plot(data.time[selected], 100 * data.relaxed[selected], color=colour, label=name, **looks)
        if not data.unknown:
            time = np.geomspace(data.time.min(), data.time.max(), 200)
            share, colour = -100 * data.relaxation.value / np.log(10), CORRECTED
            axes.plot(
                time, share * np.log1p(time / data.onset), color=colour, linewidth=1.4, zorder=3, label="log time"
            )
        axes.set_xscale("log")
        axes.set(
            title="Relaxation", xlabel="time since the displacement rests (s)", ylabel="change of $T$ over $T$ (%)"
        )
        if parts_axes is not None:
            _draw_parts(parts_axes, data)
        canvas.caption = "; ".join(f"{label} {text}" for label, text in data.summary() if label == "relaxation")


def _draw_parts(axes: "Axes", data: Creep) -> None:
    """Draw bars of the change of the load against its own direction, a bar for each hold."""
    from matplotlib.ticker import MaxNLocator

    sense = np.sign([hold.tangential_load for hold in data.holds])
    contributions = {
        name: sense * [getattr(hold, name) for hold in data.holds] for name in ("memory", "relaxation", "sensor")
    }
    change = sense * [hold.change for hold in data.holds]
    number, low, high = np.arange(1, sense.size + 1), np.zeros(sense.size), np.zeros(sense.size)
    for (name, values), colour in zip(contributions.items(), (MODEL, CORRECTED, FAINT), strict=True):
        finite = np.nan_to_num(values)
        below = np.where(finite < 0, low, high)
        axes.bar(number, finite, 0.7, bottom=below, color=colour, label=name)
        low, high = low + np.minimum(finite, 0), high + np.maximum(finite, 0)
    axes.plot(number, change, "_", color=INK, ms=9, mew=1.2, label="measured")
    axes.axhline(0, color=FAINT, linewidth=0.6)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(title="Parts of the change", xlabel="hold", ylabel="$ΔT$ along $T$ (N)")
