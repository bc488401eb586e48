"""A height map in a few lines."""

import math
from collections.abc import Iterable

import numpy as np

from historysim.basics.arguments import representable
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.surfaces.detached import detached_summits
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits


def summary(surface: Surface, rule: int = 9) -> list[tuple[str, str]]:
    """Return what a height map is like, in a few lines.

    Parameters
    ----------
    surface : Surface
    rule : int
        The summits are found by: 3, 5 or 9 points. A profile always has rule 3.

    Returns
    -------
    list of (label, text)
        Size, missing points, heights, slopes, curvatures, bandwidth, autocorrelation lengths, lay and summits; "none"
        for what the surface does not have; a warning where a handful of summits stands apart above all others.

    Raises
    ------
    InputError
        Another rule, or lengths whose squares no float holds.
    """
    with representable():
        return [*_height_lines(surface), *_correlation_lines(surface), *_summit_lines(surface, rule)]


def _height_lines(surface: Surface) -> list[tuple[str, str]]:
    found = surface.statistics()
    # across a profile there is nothing to tell
    axes = [axis for axis in (0, 1) if surface.shape[axis] > 1] or [0, 1]
    points = _product(f"{surface.shape[axis]:,}" for axis in axes)
    pixels = _product(dict.fromkeys(_length(surface.pixel_size[axis]) for axis in axes))
    lengths = _product(_length(surface.size[axis]) for axis in axes)
    return [
        ("points", f"{points}, {pixels} apart"),
        ("size", lengths),
        ("missing", f"{100 * found.missing_fraction:.3g} % of the points" if found.missing_fraction else "none"),
        ("rms height Rq", _length(found.rms_height)),
        ("mean deviation Ra", _length(found.mean_deviation)),
        ("height range Rz", _length(found.height_range)),
        ("skewness, kurtosis", f"{_number(found.skewness)}, {_number(found.kurtosis)}"),
        ("rms slope", _number(found.rms_slope)),
        ("rms curvature", _number(found.rms_curvature, " 1/m")),
        ("bandwidth ψ", _number(found.bandwidth)),
    ]


def _correlation_lines(surface: Surface) -> list[tuple[str, str]]:
    try:
        correlation = surface.autocorrelation()
    except InputError:
        return [("autocorrelation length", "none: all heights are equal")]
    along_x, along_y = surface.shape[0] > 1, surface.shape[1] > 1
    lines = []
    for level, name in ((0.1, "0.1"), (1 / math.e, "1/e")):
        lengths = [f"{_length(correlation.length('x', level))} along x"] if along_x else []
        lengths += [f"{_length(correlation.length('y', level))} along y"] if along_y else []
        lines.append((f"autocorrelation length at {name}", ", ".join(lengths)))
    if along_x and along_y:
        lines.append(("lay γ", _number(correlation.lay)))
    return lines


def _summit_lines(surface: Surface, rule: int) -> list[tuple[str, str]]:
    rule = 3 if 1 in surface.shape else rule
    summits = surface.summits(rule)
    label = f"summits, {rule}-point rule"
    if not len(summits):
        return [(label, "none")]
    density = "" if summits.density is None else f", {summits.density * 1e-12:.4g} per µm²"
    return [
        (label, f"{len(summits):,}{density}"),
        ("mean summit height", f"{_length(float(summits.height.mean() - np.nanmean(surface.heights)))} over the mean"),
        (
            "mean summit radius",
            f"{_length(float(summits.radius.mean()))}, median {_length(float(np.median(summits.radius)))}",
        ),
        *_outlier_lines(summits),
    ]


def _outlier_lines(summits: Summits) -> list[tuple[str, str]]:
    count = detached_summits(summits.height)
    if not count:
        return []
    heights = np.sort(summits.height)[::-1]
    which = "1 summit stands" if count == 1 else f"{count} summits stand"
    apart = _length(float(heights[count - 1] - heights[count]))
    text = (
        f"{which} {apart} or more above all others and would carry the first load: see whether they are spikes or dirt"
    )
    return [("warning", text)]


def _product(texts: Iterable[str]) -> str:
    return " × ".join(texts)


def _length(value: float) -> str:
    return "none" if math.isnan(value) else quantity_text(value, "m")


def _number(value: float, unit: str = "") -> str:
    return "none" if math.isnan(value) else f"{value:.4g}{unit}"
