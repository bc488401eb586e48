"""Picture of cycles: their energies over their ranges, and how long each is remembered."""

from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import Booleans
from historysim.results.analysis.cycle_counting import cycles
from historysim.results.plots.canvas import TWO_COLUMNS, Size
from historysim.results.plots.chart import Chart, Curve, Item, Sheet
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import STATE_COLOURS, Look

DECADES = 30.0  # largest over smallest number from which on an axis is logarithmic
RANGE = "range of the displacement $\\Delta U$ (m)"
MARKS: Look = {"linestyle": "", "markersize": 4.5, "clip_on": False, "zorder": 3}
CLOSED: Look = {"color": STATE_COLOURS[1]}
RESIDUE: Look = {"color": STATE_COLOURS[2]}


@PICTURES.register
@attrs.frozen(kw_only=True)
class CyclesPicture(Picture):
    """The energy of each cycle over its range, and the time for which it is remembered; closed loops and residue.

    Attributes
    ----------
    asperity
        Label of an asperity; by default the contact as a whole.
    """

    asperity: int | None = None

    kind, size, headed = "cycles", (TWO_COLUMNS, 78.0), True

    def default_size(self, data: xr.Dataset) -> Size:  # noqa: ARG002 - as declared
        """Return the size for two charts."""
        return self.size

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return the chart of energies, and that of times."""
        table = cycles(data, self.asperity)
        closed = table["closed"].values
        end_of_history = float(data["time"].values[-1])
        energies = _marks(table, closed) + _marks(table, ~closed)
        times = _lines(table, closed, end_of_history) + _lines(table, ~closed, end_of_history)
        energy = table["dissipated_energy"].values
        log = _wide("x", table["tangential_displacement_range"].values) + _wide("y", energy)
        charts = {
            "E": Chart(
                items=energies,
                title="Energy of each cycle",
                x=RANGE,
                y="energy (J)",
                height=40.0,
                log=log,
            ),
            "T": Chart(
                items=times,
                title="Remembered from start to end",
                x="time (s)",
                y="range $\\Delta U$ (m)",
                height=40.0,
            ),
        }
        remembered = int(np.isnan(table["end_time"].values).sum())
        note = f"{remembered} remembered at the end" if remembered else ""
        return Sheet(charts, wide="ET", narrow="E;T", note=note)


def _style(is_closed: bool) -> tuple[Look, Look]:
    """Return the looks of marks and lines; they differ in grey print, too."""
    if is_closed:
        return {"marker": "o", **CLOSED}, {"linewidth": 1.3, **CLOSED}
    return {"marker": "s", "markerfacecolor": "white", **RESIDUE}, {
        "linewidth": 1.0,
        "linestyle": (0, (4, 2)),
        **RESIDUE,
    }


def _marks(table: xr.Dataset, chosen: Booleans) -> list[Item]:
    """Return energies over ranges, of closed loops or of residue."""
    if not chosen.any():
        return []
    is_closed = bool(table["closed"].values[chosen][0])
    marks, _ = _style(is_closed)
    noun = "closed loops" if is_closed else "residue (half cycles)"
    x = table["tangential_displacement_range"].values[chosen]
    y = table["dissipated_energy"].values[chosen]
    return [Curve(x, y, f"{noun}, {chosen.sum()}", MARKS | marks)]


def _lines(table: xr.Dataset, chosen: Booleans, end_of_history: float) -> list[Item]:
    """Return a line from start to end of each cycle at its range, all as one curve with gaps."""
    if not chosen.any():
        return []
    _, line = _style(bool(table["closed"].values[chosen][0]))
    start = table["start_time"].values[chosen]
    end = table["end_time"].values[chosen]
    end = np.where(np.isnan(end), end_of_history, end)
    level = table["tangential_displacement_range"].values[chosen]
    gap = np.full(start.size, np.nan)
    x = np.column_stack([start, end, gap]).ravel()
    y = np.column_stack([level, level, gap]).ravel()
    return [Curve(x, y, "", line)]


def _wide(axis: str, values: Any) -> str:
    """Return the axis if its numbers are positive and span so much that it is better logarithmic."""
    is_wide = values.size > 0 and values.min() > 0.0 and values.max() > DECADES * values.min()
    return axis if is_wide else ""
