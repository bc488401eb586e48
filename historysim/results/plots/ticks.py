"""Ticks with a readable SI prefix, and logarithmic axes with plain numbers."""

import math
import re
from typing import Any

import numpy as np
from matplotlib.axis import Axis, XAxis
from matplotlib.ticker import Formatter, LogLocator, ScalarFormatter

from historysim.results.plots.style import LABEL_ABOVE, WITH_PREFIX, choose_scale

# greatest over smallest number of a logarithmic axis up to which 2 and 5 are numbered, too
FEW_DECADES = 30.0
# range of an axis over its greatest number below which the ticks count from a common part
COMMON_PART = 1e-3


class PrefixFormatter(Formatter):
    """Tick numbers in one SI prefix, which the labels of all axes with these ticks state.

    Axes that share limits share their ticks and this formatter, and so the prefix. It follows the
    limits.
    """

    def __init__(self, unit: str, quantities: dict[Axis, str]) -> None:
        self.unit, self.quantities, self.suffix = unit, quantities, ""

    def __call__(self, value: float, _: object = None) -> str:
        """Format one number."""
        return self.format_ticks([value])[0]

    def format_ticks(self, values: Any) -> list[str]:
        """Choose the prefix for the present limits, write it into the labels, and format the ticks."""
        own_axis: Any = self.axis
        limits = _limits(own_axis)
        is_log = own_axis.get_scale() == "log"
        center = sum(limits) / 2
        span = abs(limits[1] - limits[0])
        offset = 0.0
        if not is_log and 0 < span < COMMON_PART * np.abs(limits).max():
            decade = 10.0 ** math.ceil(math.log10(span))
            offset = round(center / decade) * decade
        factor, unit = choose_scale(self.unit, np.subtract(limits, offset))
        self.suffix = f" ({unit})" if unit else ""
        if offset:
            far, its_unit = choose_scale(self.unit, offset)
            self.suffix += f", from {far * offset:.10g} {its_unit}".rstrip()
        for axis in self.quantities:
            _write_label(axis, self.label(axis))
        return [self.fix_minus(f"{(value - offset) * factor:.6g}") for value in values]

    def label(self, axis: Axis) -> str:
        """Return the label of an axis with the prefix; empty if it has none."""
        return f"{self.quantities[axis]}{self.suffix}".strip() if axis in self.quantities else ""


def _limits(axis: Axis) -> Any:
    """Return the limits of an axis, or of the longer axis of a map, since both have one prefix."""
    axes: Any = axis.axes
    if axes.get_aspect() != 1:
        return axis.get_view_interval()
    return max(axes.get_xlim(), axes.get_ylim(), key=lambda limits: abs(limits[1] - limits[0]))


def set_prefix(axis: Axis, *, every_unit: bool = False) -> None:
    """Choose a prefix for an axis with linear ticks that is labelled in an SI unit, "load (N)"."""
    formatter = axis.get_major_formatter()
    labels = _labels_in_si(axis)
    unit = labels[axis][1]
    numeric = isinstance(formatter, ScalarFormatter | PrefixFormatter) or every_unit
    if numeric and (unit in WITH_PREFIX or every_unit):
        named = {
            key: quantity
            for key, (quantity, its_unit) in labels.items()
            if its_unit == unit and _read_label(key)
        }
        axis.set_major_formatter(PrefixFormatter(unit, named))
        axis.get_major_formatter().format_ticks([*axis.get_majorticklocs()])


def set_log_scale(axis: Axis) -> None:
    """Make an axis logarithmic once its data are drawn, with plain numbers: 0.4, and not 4 × 10⁻¹."""
    labels = _labels_in_si(axis)
    (axis.axes.set_xscale if isinstance(axis, XAxis) else axis.axes.set_yscale)("log")
    for member, (quantity, unit) in labels.items():
        if quantity:
            _write_label(member, f"{quantity} ({unit})" if unit else quantity)
    ends = np.array([member.get_data_interval() for member in labels])
    ends = ends[np.isfinite(ends).all(axis=1)]
    few = ends.max() < FEW_DECADES * ends.min()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,)))
    axis.set_minor_formatter("")
    set_prefix(axis, every_unit=True)


def _labels_in_si(axis: Axis) -> dict[Axis, tuple[str, str]]:
    """Return the quantity and SI unit of an axis and of those that share its limits."""
    axes: Any = axis.axes
    is_x = isinstance(axis, XAxis)
    formatter = axis.get_major_formatter()
    siblings = (axes.get_shared_x_axes() if is_x else axes.get_shared_y_axes()).get_siblings(axes)
    labels = {}
    for member in (sibling.xaxis if is_x else sibling.yaxis for sibling in siblings):
        quantity, unit = split_label(text := _read_label(member))
        if isinstance(formatter, PrefixFormatter) and text and text == formatter.label(member):
            quantity = formatter.quantities[member]
            unit = formatter.unit
        labels[member] = quantity, unit
    return labels


def _read_label(axis: Axis) -> str:
    """Return the label of an axis; a y label above the axes is their title."""
    axes: Any = axis.axes
    return axis.get_label_text() or ("" if isinstance(axis, XAxis) else axes.get_title(loc="left"))


def _write_label(axis: Axis, text: str) -> None:
    axes: Any = axis.axes
    if axis.get_label_text() or isinstance(axis, XAxis):
        axis.set_label_text(text)
    elif axes.get_title(loc="left") != text:
        axes.set_title(text, **LABEL_ABOVE)


def split_label(label: str) -> tuple[str, str]:
    """Return the quantity and the unit of a label, "load (N)"."""
    match = re.fullmatch(r"(.*?) ?\(([^()]*)\)", label, re.DOTALL)
    return (match[1], match[2]) if match else (label, "")
