"""Summary of a height map, and a warning of height steps that are too coarse for the radii of summits."""

import math

import numpy as np

from historysim.basics.arguments import ArrayLike, Floats, representable
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import detached_summits

# Height of the median summit over its neighbours, in height steps, that gives its radius within
# some 10 %.
LEAST_STEPS = 5


def summary(surface: Surface) -> list[tuple[str, str]]:
    """Return size, roughness, autocorrelation lengths and summits of a map, as (label, text)."""
    with representable():
        return [*_height_lines(surface), *_correlation_lines(surface), *_summit_lines(surface)]


def height_step(heights: ArrayLike) -> float:
    """Return the quantisation step of heights [m]: the median step between neighbouring levels; 0 if all are equal."""
    values = np.asarray(heights, dtype=np.float64)
    levels = np.unique(values[np.isfinite(values)])
    steps = np.diff(levels)
    # levels that differ by rounding only are equal
    steps = steps[steps > 1e-9 * (levels[-1] - levels[0])] if steps.size else steps
    return float(np.median(steps)) if steps.size else 0.0


def quantisation_notice(surface: Surface) -> str | None:
    """Return a notice if the raw heights are too coarsely quantised for the radii of summits; otherwise None.

    The surface is the raw map, before any filter or removal of form.
    """
    step = height_step(surface.heights)
    summits = surface.summits(3 if 1 in surface.shape else 9)
    if step == 0 or not len(summits):
        return None
    pixel = max(surface.pixel_size)
    # drop to the neighbours on average: p²/(2R)
    steps = float(np.median(pixel**2 / (2 * summits.radius))) / step
    if steps >= LEAST_STEPS:
        return None
    return (
        f"heights come in steps of {quantity_text(step, 'm', 2)}, and the median summit rises {steps:.2g} steps over "
        "its neighbours: unfiltered, radii of summits come in bands that are noise of the instrument; filter with "
        "s_filter"
    )


def _height_lines(surface: Surface) -> list[tuple[str, str]]:
    statistics = surface.statistics()
    # a profile has no second axis
    axes = [axis for axis in (0, 1) if surface.shape[axis] > 1] or [0, 1]
    pixels = dict.fromkeys(_length(surface.pixel_size[axis]) for axis in axes)
    return [
        (
            "points",
            f"{' × '.join(f'{surface.shape[axis]:,}' for axis in axes)}, {' × '.join(pixels)} apart",
        ),
        ("size", " × ".join(_length(surface.size[axis]) for axis in axes)),
        (
            "missing",
            f"{100 * statistics.missing_fraction:.3g} % of the points"
            if statistics.missing_fraction
            else "none",
        ),
        ("rms height Rq", _length(statistics.rms_height)),
        ("mean deviation Ra", _length(statistics.mean_deviation)),
        ("height range Rz", _length(statistics.height_range)),
        ("skewness, kurtosis", f"{_number(statistics.skewness)}, {_number(statistics.kurtosis)}"),
        ("rms slope", _number(statistics.rms_slope)),
        ("rms curvature", _number(statistics.rms_curvature, " 1/m")),
        ("bandwidth ψ", _number(statistics.bandwidth)),
    ]


def _correlation_lines(surface: Surface) -> list[tuple[str, str]]:
    try:
        correlation = surface.autocorrelation()
    except InputError:
        return [("autocorrelation length", "none: all heights are equal")]
    axes = [axis for axis, points in zip("xy", surface.shape, strict=True) if points > 1]
    lines = [
        (
            f"autocorrelation length at {name}",
            ", ".join(f"{_length(correlation.length(axis, level))} along {axis}" for axis in axes),  # type: ignore[arg-type]
        )
        for level, name in ((0.1, "0.1"), (1 / math.e, "1/e"))
    ]
    return [*lines, *([("lay γ", _number(correlation.lay))] if len(axes) == 2 else [])]


def _summit_lines(surface: Surface) -> list[tuple[str, str]]:
    rule = 3 if 1 in surface.shape else 9
    summits = surface.summits(rule)
    label = f"summits, {rule}-point rule"
    if not len(summits):
        return [(label, "none")]
    density = "" if summits.density is None else f", {summits.density * 1e-12:.4g} per µm²"
    return [
        (label, f"{len(summits):,}{density}"),
        (
            "mean summit height",
            f"{_length(float(summits.height.mean() - np.nanmean(surface.heights)))} over the mean",
        ),
        (
            "mean summit radius",
            f"{_length(float(summits.radius.mean()))}, median {_length(float(np.median(summits.radius)))}",
        ),
        *_outlier_lines(summits.height),
    ]


def _outlier_lines(heights: Floats) -> list[tuple[str, str]]:
    count = detached_summits(heights)
    if not count:
        return []
    heights = np.sort(heights)[::-1]
    summits = "1 summit is" if count == 1 else f"{count} summits are"
    gap = _length(float(heights[count - 1] - heights[count]))
    consequence = "and would carry the first load: see whether they are spikes or dirt"
    return [("warning", f"{summits} {gap} or more above all others {consequence}")]


def _length(value: float) -> str:
    return "not reached" if math.isnan(value) else quantity_text(value, "m")


def _number(value: float, unit: str = "") -> str:
    return "none" if math.isnan(value) else f"{value:.4g}{unit}"
