"""Pictures of records: a model and its measurement, channels and spectra, sliding, creep, columns of a table."""

from typing import TYPE_CHECKING

import attrs
import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.wording import join_words
from historysim.errors import InputError
from historysim.loads.events import load_kind
from historysim.measured.comparison import Comparison
from historysim.measured.correction import sampling_rate
from historysim.measured.creep import Creep
from historysim.measured.reduction import Measurement
from historysim.measured.sliding import UNITS, Sliding
from historysim.results.plots.canvas import TWO_COLUMNS, Size
from historysim.results.plots.chart import Chart, Curve, Item, Note, Shape, Sheet
from historysim.results.plots.pictures import PICTURES, SCENARIO, Titled
from historysim.results.plots.style import (
    FAINT,
    INK,
    LOOP_AXES,
    LOOP_NUMBER,
    MARK,
    MOST_EDGED,
    STATE_COLOURS,
    Look,
    format_unit,
    line_style,
    thin_samples,
)
from historysim.results.tables import flat_columns

if TYPE_CHECKING:
    import xarray as xr

MOST_POINTS, MOST_SAMPLES = 50_000, 20_000  # drawn dots of a comparison, and samples of sliding
MEASURED, CORRECTED, MODEL = "#d1603d", "#e0b73c", "#12355b"
AS_READ: Look = {"color": FAINT, "linewidth": 0.7, "rasterized": True}
AS_USED: Look = {"color": MARK, "linewidth": 0.8, "rasterized": True}
DOTS: Look = {"linestyle": "", "marker": ".", "ms": 2.4, "mew": 0, "rasterized": True}


@PICTURES.register
@attrs.frozen(kw_only=True)
class ComparisonPicture(Titled):
    """Loops and loads of measurement and model over each other, energies, and residuals."""

    kind, of, size, own_figure = "comparison", (Comparison,), (TWO_COLUMNS, 137.0), True

    def sheet(self, data: Comparison) -> Sheet:
        """Return all charts."""
        observation = data.observation
        residuals = data.residuals
        time = observation.time
        loads = [
            _thin_curve(
                time,
                channel.tangential_load,
                "",
                {"color": colour, "linewidth": width, "rasterized": True},
            )
            for channel, colour, width in (
                (observation, MEASURED, 0.9),
                (data.response, MODEL, 0.6),
            )
        ]
        after_start = time[observation.start_sample :]
        difference = _thin_curve(after_start, data.difference, "", DOTS | {"color": INK, "ms": 1.2})
        means = zip(
            residuals.position,
            residuals.mean,
            (INK, CORRECTED),
            ("forward", "backward"),
            strict=True,
        )
        branches = [
            Curve(100 * x, y, label, {"color": colour, "linewidth": 1.0})
            for x, y, colour, label in means
        ]
        short: Look = {"height": 28.0, "zero": "x"}
        labels: Look = {"title": "Tangential load", "x": "time (s)", "y": "$T$ (N)"}
        return Sheet(
            {
                "L": Chart(
                    items=_compared_loops(data),
                    title="Friction loops",
                    height=42.0,
                    margins=(0.06, 0.06),
                    **LOOP_AXES,
                ),
                "T": Chart(items=loads, margins=(0.01, 0.05), height=28.0, **labels),
                "E": _energies(data),
                "D": Chart(
                    items=[difference], title="Difference", x="time (s)", y="$ΔT$ (N)", **short
                ),
                "R": Chart(
                    items=branches,
                    title="Residuals",
                    x="way from reversal (%)",
                    y="mean $ΔT$ (N)",
                    **short,
                ),
            },
            wide="LLLTTT;EEDDRR",
            narrow="LL;TT;ED;RR",
        )


def _thin_curve(x: Floats, y: Floats, label: str, look: Look) -> Curve:
    """Return a curve with the samples that a picture can show."""
    samples = thin_samples(y.size, [y], MOST_POINTS)
    return Curve(x[samples], y[samples], label, look)


def _compared_loops(comparison: Comparison) -> list[Item]:
    observation = comparison.observation
    response = comparison.response
    # along a branch the model follows the order of displacements, not of time
    order = response.order
    dots = DOTS | {"color": MEASURED}
    # the model is drawn over the points, in whose noise it would be hidden
    line: Look = {"color": MODEL, "linewidth": 0.8, "rasterized": True, "zorder": 3}
    load = observation.tangential_load
    displacement = observation.displacement
    items: list[Item] = [
        _thin_curve(displacement, load, "measured", dots),
        Curve(response.displacement[order], response.tangential_load[order], "model", line),
    ]
    instrument = comparison.instrument
    if instrument.rigid and not instrument.parallel_stiffness:
        return items

    load = load - instrument.parallel_stiffness * displacement
    moved = displacement - load / instrument.stiffness
    dots = DOTS | {"color": CORRECTED}
    model_load = response.contact_load[order]
    model_moved = response.displacement[order] - model_load / instrument.stiffness
    dashes = line | {"linestyle": (0, (4, 1.5))}
    return [
        *items,
        _thin_curve(moved, load, "measured, of the contact", dots),
        Curve(model_moved, model_load, "model, of the contact", dashes),
    ]


def _energies(comparison: Comparison) -> Chart:
    options: Look = {"title": "Energies", "x": LOOP_NUMBER, "height": 28.0}
    if comparison.measured is None or comparison.model is None:
        return Chart(items=[_remark("no whole loop")], axes={"xticks": [], "yticks": []}, **options)
    items: list[Item] = []
    sets = ("measured", comparison.measured, "o", MEASURED), ("model", comparison.model, "x", MODEL)
    for name, loops, marker, colour in sets:
        size = 4 if len(loops) <= MOST_EDGED else 1.8
        look = {"color": colour, "ms": size, "mfc": "none", "marker": marker, "linestyle": ""}
        items.append(Curve(loops.number, loops.dissipated_energy, name, look))
    # from zero, so that heights compare; a record with mixed-up signs has energies below it
    return Chart(items=items, y="$∮T\\,dU$ (J)", zero="x", integers=True, **options)


def _remark(text: str) -> Note:
    """Return the reason for empty axes."""
    look = {"xycoords": "axes fraction", "color": FAINT}
    return Note(text, (0.5, 0.5), (0, 0), look)


DETAIL, PIECE = 200, 8192  # samples of the detail of a channel, and of a piece of its spectrum


@PICTURES.register
@attrs.frozen(kw_only=True)
class RecordPicture(Titled):
    """The channels of a measured file as read, and after conditioning."""

    kind, of, own_figure = "record", (Measurement, SCENARIO), True

    def default_size(self, data: Measurement) -> Size:
        """Return a row for each channel."""
        return TWO_COLUMNS, 26.0 + 45.0 * len(_changing(data))

    def sheet(self, data: Measurement) -> Sheet:
        """Return channels over time, a detail, and amplitudes over the frequency; without an even clock no spectrum."""
        charts: dict[str, Chart] = {}
        channels = _changing(data)
        wide = []
        for number, (name, values) in enumerate(channels.items()):
            read = values + data.removed[name] if name in data.removed else None
            words = name.replace("_", " ")
            unit = load_kind(name).unit
            letters = [chr(65 + 3 * number + k) for k in range(3)]
            window = _detail(values)
            options: Look = {"y": f"({unit})", "margins": (0.01, 0.05), "height": 24.0}
            all_samples, detail = (
                _channel(data.time, values, read, samples) for samples in (slice(None), window)
            )
            is_last = number == len(channels) - 1
            labels: Look = {"x": "time (s)" if is_last else ""}
            charts[letters[0]] = Chart(
                items=all_samples, title=words.capitalize(), name=words, **labels, **options
            )
            charts[letters[1]] = Chart(
                items=detail, title="Detail", name="details", **labels, **options
            )
            charts[letters[2]] = _spectrum(values, read, data.time, unit, is_last=is_last)
            wide.append("{0}{0}{0}{0}{1}{1}{1}{2}{2}{2}".format(*letters))
        return Sheet(charts, wide=";".join(wide), narrow=";".join(row[0] for row in wide))


def _changing(measurement: Measurement) -> dict[str, Floats]:
    """Return the channels that change."""
    every = {**measurement.channels, **measurement.response}
    varying = {name: values for name, values in every.items() if np.ptp(values) > 0}
    if not varying:
        raise InputError(
            "the record has constants alone; expected a channel that changes, to draw it"
        )
    return varying


def _channel(time: Floats, values: Floats, read: Floats | None, window: slice) -> list[Item]:
    channels = ((read, "as read", AS_READ), (values, "as used", AS_USED))
    return [
        Curve(time[window], channel[window], name, look)
        for channel, name, look in channels
        if channel is not None
    ]


def _detail(values: Floats) -> slice:
    """Return samples around the last greatest value, where a channel turns or slides."""
    count = min(DETAIL, values.size)
    start = int(np.clip(int(values.argmax()) - count // 2, 0, values.size - count))
    return slice(start, start + count)


def _spectrum(
    values: Floats, read: Floats | None, time: Floats, unit: str, *, is_last: bool
) -> Chart:
    options: Look = {
        "title": "Amplitude",
        "name": "spectra",
        "y": f"({unit})",
        "height": 24.0,
    }
    try:
        rate = sampling_rate(time)
    except InputError:
        return Chart(items=[_remark("no even clock")], axes={"xticks": [], "yticks": []}, **options)
    from scipy import signal

    items = []
    for channel, look in ((read, AS_READ), (values, AS_USED)):
        if channel is not None:
            length = min(PIECE, channel.size)
            frequency, power = signal.welch(
                channel, rate, nperseg=length, scaling="spectrum", detrend="linear"
            )
            # the amplitude of a sine; the first bins hold the remainder of the mean
            items.append(Curve(frequency[2:], np.sqrt(2 * power[2:]), "", look))
    x = "frequency (Hz)" if is_last else ""
    return Chart(items=items, x=x, margins=(0.01, 0.05), axes={"yscale": "log"}, **options)


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlidingPicture(Titled):
    """The friction coefficient over time or distance, with its windows, static peak and approach to a steady value."""

    kind, of, size, own_figure = "sliding", (Sliding,), (TWO_COLUMNS, 92.0), True

    def sheet(self, data: Sliding) -> Chart:
        """Return samples, windows, peak and approach."""
        indices = thin_samples(data.place.size, [data.coefficient], MOST_SAMPLES)
        friction = data.coefficient[indices]
        items = list[Item]()
        dots = {"marker": "o", "linestyle": "", "color": STATE_COLOURS[1], "ms": 3, "zorder": 2}
        if np.isfinite(friction).any():
            faint = DOTS | {"ms": 2.2, "color": FAINT, "alpha": 0.6, "zorder": 1}
            items.append(Curve(data.place[indices], friction, "samples", faint))
        items.append(Curve(data.window_place, data.window_mean, "windows", dots))
        if data.approach is not None:
            distance = np.linspace(data.approach.origin, data.place[-1], 200)
            line: Look = {"color": STATE_COLOURS[2], "linewidth": 1.2, "zorder": 3}
            dashes = line | {"linewidth": 0.7, "linestyle": (0, (4, 2)), "zorder": 0}
            items.append(Curve(distance, data.approach.at(distance), "approach", line))
            items.append(Shape("axhline", (data.approach.steady,), dashes))
        if data.peak is not None:
            mark = {"marker": "^", "linestyle": "", "color": INK, "ms": 5, "zorder": 4}
            items.append(Curve([data.peak.place], [data.peak.coefficient], "static peak", mark))
        labels: Look = {
            "title": "Friction coefficient",
            "x": f"{data.over} ({UNITS[data.over]})",
            "y": "$μ = T/N$",
        }
        return Chart(items=items, **labels)


MOST_PANELS, MOST_LINES = 4, 6


@PICTURES.register
@attrs.frozen(kw_only=True)
class TablePicture(Titled):
    """The columns of a table over its first numeric column; columns of one unit share a panel."""

    kind, of, own_figure, headed = "table", (), True, True

    def default_size(self, data: "xr.Dataset") -> Size:
        """Return a row for each unit."""
        return TWO_COLUMNS, 30.0 + 45.0 * min(len(_columns_by_unit(data)[2]), MOST_PANELS)

    def sheet(self, data: "xr.Dataset") -> Sheet:
        """Return up to 4 charts of up to 6 lines."""
        abscissa, numbers, by_unit = _columns_by_unit(data)
        charts: dict[str, Chart] = {}
        omitted: list[str] = []
        for letter, (unit, names) in zip(
            "ABCDEFGHIJKLMNOPQRSTUVWXYZ", by_unit.items(), strict=False
        ):
            words = [name.replace("_", " ") for name in names]
            omitted += words[MOST_LINES:] if letter in "ABCD" else words
            columns = zip(names, words, range(MOST_LINES), strict=False)
            # lines of two panels look alike
            options: Look = {
                "height": 24.0,
                "share": "row",
                "separate_legend": len(by_unit) > 1,
            }
            options["x"] = _label(abscissa, numbers[abscissa].attrs.get("units", "1"))
            options["y"] = _label(words[0] if len(names) == 1 else "value", unit)
            lines = [
                Curve(
                    numbers[abscissa].values,
                    numbers[name].values,
                    label,
                    line_style(number, MOST_LINES),
                )
                for name, label, number in columns
            ]
            if letter in "ABCD":
                charts[letter] = Chart(items=lines, name=" and ".join(words[:2]), **options)
        notice = f"there is no room for {join_words(omitted)}" if omitted else ""
        return Sheet(charts, wide=";".join(charts), notices=(notice,))


def _columns_by_unit(table: "xr.Dataset") -> tuple[str, Look, dict[str, list[str]]]:
    """Return the first column of numbers, all of them, and the names of the others by their units."""
    columns = flat_columns(table)
    numbers = {str(name): values for name, values in columns.items() if values.dtype.kind in "fiu"}
    if len(numbers) < 2 or not columns.sizes["row"]:
        raise InputError(
            f"{columns.title}: needs at least two columns of numbers to draw; `show` lists its columns"
        )
    abscissa, *ordinates = numbers
    by_unit: dict[str, list[str]] = {}
    for name in ordinates:
        by_unit.setdefault(str(numbers[name].attrs.get("units", "1")), []).append(name)
    return abscissa, numbers, by_unit


def _label(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    text = format_unit(unit)
    return f"{words} ({text})" if text else words


@PICTURES.register
@attrs.frozen(kw_only=True)
class CreepPicture(Titled):
    """Relaxation of the load in the holds of a record over log time, and the parts of its change in each hold."""

    kind, of, size, own_figure = "creep", (Creep,), (TWO_COLUMNS, 92.0), True

    def sheet(self, data: Creep) -> Sheet:
        """Return the relaxation without memory and sensor contributions, and the contributions."""
        items: list[Item] = []
        for selected, colour, marker, name in (
            (data.forward, STATE_COLOURS[1], "o", "held forward"),
            (~data.forward, STATE_COLOURS[2], "s", "held backward"),
        ):
            look = {
                "linestyle": "",
                "marker": marker,
                "ms": 2.6,
                "mfc": "none",
                "mew": 0.6,
                "color": colour,
            }
            items.append(Curve(data.time[selected], 100 * data.relaxed[selected], name, look))
        if not data.unknown:
            time = np.geomspace(data.time.min(), data.time.max(), 200)
            percent = -100 * data.relaxation.value / np.log(10) * np.log1p(time / data.onset)
            items.append(
                Curve(
                    time, percent, "log time", {"color": CORRECTED, "linewidth": 1.4, "zorder": 3}
                )
            )
        labels: Look = {
            "x": "time since the displacement is held (s)",
            "y": "change of $T$ over $T$ (%)",
        }
        relaxation = Chart(items=items, title="Relaxation", axes={"xscale": "log"}, **labels)
        caption = "; ".join(
            f"{label} {text}" for label, text in data.summary() if label == "relaxation"
        )
        return Sheet({"R": relaxation, "P": _creep_parts(data)}, subtitle=caption)


def _creep_parts(data: Creep) -> Chart:
    """Return bars of the change of the load against its direction, a bar for each hold."""
    sense = np.sign([hold.tangential_load for hold in data.holds])
    number = np.arange(1, sense.size + 1)
    low = np.zeros(sense.size)
    high = np.zeros(sense.size)
    items: list[Item] = []
    for name, colour in (("memory", MODEL), ("relaxation", CORRECTED), ("sensor", FAINT)):
        values = np.nan_to_num(sense * [getattr(hold, name) for hold in data.holds])
        bars = {"bottom": np.where(values < 0, low, high), "color": colour, "label": name}
        items.append(Shape("bar", (number, values, 0.7), bars))
        low = low + np.minimum(values, 0)
        high = high + np.maximum(values, 0)
    mark = {"marker": "_", "linestyle": "", "color": INK, "ms": 9, "mew": 1.2}
    items.append(Curve(number, sense * [hold.change for hold in data.holds], "measured", mark))
    labels: Look = {
        "title": "Parts of the change",
        "x": "hold",
        "y": "$ΔT$ along $T$ (N)",
    }
    return Chart(items=items, zero="x", integers=True, **labels)
