"""Picture of a measured record: each channel as it was read, as conditioning left it, and its spectrum."""

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from historysim.basics.array_types import Floats, Integers
from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.loads.events import LOAD_KINDS
from historysim.measured.conditioning import sampling_rate
from historysim.measured.measurement import Measurement
from historysim.results.plots.paper import PAGE, Drawn, Place, paper
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, MARK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST_POINTS = 20_000
DETAIL = 200
"""Samples that the detail of a channel shows."""
LEAST_ROW = 24.0
"""Height of a channel [mm]."""
_PIECE = 8192


def plot_record(measurement: Measurement, *, title: str = "", **place: Unpack[Place]) -> Drawn:
    """Draw the channels of a record: over time, a detail of it, and the amplitudes over the frequency.

    What was read is grey, and lies below what conditioning left of it. Of a record without an even clock there is no
    spectrum.

    Parameters
    ----------
    measurement : Measurement
    title : str
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 180 mm wide.
    """
    channels = {
        name: values for name, values in {**measurement.channels, **measurement.response}.items() if np.ptp(values) > 0
    }
    if not channels:
        raise InputError("the record has constants alone; expected a channel that changes, to draw it")
    try:
        rate = sampling_rate(measurement.time)
    except InputError:
        rate = None
    with paper(plot_record, (PAGE, 18.0 + 45.0 * len(channels)), place) as page:
        # at the width of one column there is no room for more than the whole of each
        columns = 3 if page.width >= 140.0 else 1
        rows = min(len(channels), max(int((page.height - 18.0) / LEAST_ROW), 1))
        figure = page.several(rows * columns) if rows * columns > 1 else page.figure
        grid = figure.add_gridspec(rows, columns, width_ratios=(1.4, 1, 1)[:columns])
        page.left_out(
            *(["details", "spectra"] if columns == 1 else []),
            *(name.replace("_", " ") for name in [*channels][rows:]),
        )
        for row, (name, values) in enumerate([*channels.items()][:rows]):
            read = values + measurement.removed[name] if name in measurement.removed else None
            unit, label = LOAD_KINDS[name].unit, name.replace("_", " ")
            factor, prefix = prefixed(float(np.abs(values).max()))
            whole = page.axes() if page.given is not None else figure.add_subplot(grid[row, 0])
            shown = np.unique(np.linspace(0, values.size - 1, min(values.size, MOST_POINTS)).astype(int))
            _draw(whole, measurement.time, values, read, shown, factor)
            whole.set(title=label.capitalize(), ylabel=f"({prefix}{unit})")
            last = row == rows - 1
            if last:
                whole.set(xlabel="time (s)")
            if columns == 1:
                continue
            detail, spectrum = (figure.add_subplot(grid[row, column]) for column in (1, 2))
            _draw(detail, measurement.time, values, read, _detail(values), factor)
            detail.set(title="Detail")
            detail.ticklabel_format(axis="x", useOffset=False)
            _draw_spectrum(spectrum, values, read, rate, factor, f"{prefix}{unit}")
            if last:
                detail.set(xlabel="time (s)")
                spectrum.set(xlabel="frequency (Hz)")
        page.legend(*([page.axes()] if page.given is not None else figure.axes))
        page.heading(title)
    return page.drawn


def _draw(axes: "Axes", time: Floats, values: Floats, read: Floats | None, shown: Integers, factor: float) -> None:
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
        axes.text(0.5, 0.5, "no even clock", transform=axes.transAxes, ha="center", va="center", color=FAINT)
        axes.set(xticks=[], yticks=[])
        return
    from scipy import signal

    for channel, colour, width in ((read, FAINT, 0.8), (values, MARK, 0.8)):
        if channel is not None:
            length = min(_PIECE, channel.size)
            frequency, power = signal.welch(channel, rate, nperseg=length, scaling="spectrum", detrend="linear")
            # of a sine, its amplitude; the first bins hold what is left of the mean
            axes.semilogy(frequency[2:], np.sqrt(2 * power[2:]) * factor, color=colour, linewidth=width)
    axes.margins(x=0.01)


@figure_of.register(Measurement)
def _of_record(what: Measurement, *, title: str = "", place: Place, **_: Any) -> Drawn:
    return plot_record(what, title=title, **place)
