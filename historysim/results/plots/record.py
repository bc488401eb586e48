"""Picture of a measured record: each channel as it was read, as conditioning left it, and its spectrum."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.basics.units import prefixed
from historysim.errors import InputError
from historysim.loads.events import LOAD_KINDS
from historysim.measured.conditioning import sampling_rate
from historysim.measured.measurement import Measurement
from historysim.results.plots.paper import PAGE, Size, new_figure
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, MARK, legend_below, plain_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

MOST_POINTS = 20_000
DETAIL = 200
"""Samples that the detail of a channel shows."""
_PIECE = 8192


def plot_record(measurement: Measurement, *, title: str = "", size: tuple[float, float] | None = None) -> "Figure":
    """Draw the channels of a record: over time, a detail of it, and the amplitudes over the frequency.

    What was read is grey, and lies below what conditioning left of it. Of a record without an even clock there is no
    spectrum.

    Parameters
    ----------
    measurement : Measurement
    title : str
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 180 mm wide.
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
    with new_figure(size, (PAGE, 18.0 + 45.0 * len(channels))) as figure:
        grid = figure.add_gridspec(len(channels), 3, width_ratios=(1.4, 1, 1))
        for row, (name, values) in enumerate(channels.items()):
            read = values + measurement.removed[name] if name in measurement.removed else None
            unit, label = LOAD_KINDS[name].unit, name.replace("_", " ")
            factor, prefix = prefixed(float(np.abs(values).max()))
            whole, detail, spectrum = (figure.add_subplot(grid[row, column]) for column in range(3))
            shown = np.unique(np.linspace(0, values.size - 1, min(values.size, MOST_POINTS)).astype(int))
            _draw(whole, measurement.time, values, read, shown, factor)
            middle = _detail(values)
            _draw(detail, measurement.time, values, read, middle, factor)
            whole.set(title=label.capitalize(), ylabel=f"({prefix}{unit})")
            detail.set(title="Detail")
            detail.ticklabel_format(axis="x", useOffset=False)
            _draw_spectrum(spectrum, values, read, rate, factor, f"{prefix}{unit}")
            if row == len(channels) - 1:
                whole.set(xlabel="time (s)")
                detail.set(xlabel="time (s)")
                spectrum.set(xlabel="frequency (Hz)")
        legend_below(figure, *figure.axes)
        if title:
            figure.suptitle(plain_title(title), x=0.01, ha="left", fontsize=9.5)
    return figure


def _draw(
    axes: "Axes", time: Floats, values: Floats, read: Floats | None, shown: npt.NDArray[np.int64], factor: float
) -> None:
    line: dict[str, Any] = {"rasterized": True, "solid_joinstyle": "round"}
    if read is not None:
        axes.plot(time[shown], read[shown] * factor, color=FAINT, linewidth=0.7, label="as read", **line)
    axes.plot(time[shown], values[shown] * factor, color=MARK, linewidth=0.8, label="as used", **line)
    axes.margins(x=0.01)


def _detail(values: Floats) -> npt.NDArray[np.int64]:
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
def _of_record(what: Measurement, *, title: str = "", size: Size | None = None, **_: Any) -> "Figure":
    return plot_record(what, title=title, size=size)
