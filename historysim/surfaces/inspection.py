"""What a user should know of a height map: a summary, and what coarse steps and splines do to its summits."""

import math
from collections.abc import Iterable

import numpy as np

from historysim.basics.arguments import ArrayLike, representable
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.surfaces.heights import Surface
from historysim.surfaces.resampling import COINCIDENT
from historysim.surfaces.summits import Summits, detached_summits

# Steps that the median summit should rise over its neighbours, so that its radius is known to some 10 %.
LEAST_STEPS = 5
LEAST_LOSS = 0.01  # the share of the rms curvature below which the loss by splines is not mentioned


def summary(surface: Surface) -> list[tuple[str, str]]:
    """Return size, roughness, autocorrelation lengths and summits of a map, as (label, text)."""
    with representable():
        return [*_height_lines(surface), *_correlation_lines(surface), *_summit_lines(surface)]


def height_step(heights: ArrayLike) -> float:
    """Return the step in which heights come [m]: the median one between neighbouring levels; 0 where all are one."""
    values = np.asarray(heights, dtype=np.float64)
    levels = np.unique(values[np.isfinite(values)])
    steps = np.diff(levels)
    # the same level with other last digits is no step
    steps = steps[steps > 1e-9 * (levels[-1] - levels[0])] if steps.size else steps
    return float(np.median(steps)) if steps.size else 0.0


def quantisation_notice(surface: Surface) -> str | None:
    """Return that the heights, as they were measured, are too coarse for the radii of summits; None where they are not.

    The surface is as it was read, before any filter or form.
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


def smoothing_notice(
    surface: Surface, other: Surface, *, shift: ArrayLike = (0.0, 0.0), rotation: float = 0.0
) -> str | None:
    """Return what the splines of ``surface.combined(other, …)`` take from the other surface, in a sentence.

    None where all points coincide, or less than 1 % of the rms curvature is taken. Where the pixel sizes differ there
    is no number, since the curvature depends on the pixel size it is taken over.
    """
    level = Surface(np.zeros(surface.shape), surface.pixel_size, surface.periodic)
    laid = level.combined(other, shift=shift, rotation=rotation)
    if np.isin(laid.heights[~laid.missing], other.heights).all():
        return None
    if all(math.isclose(*sizes, rel_tol=COINCIDENT) for sizes in zip(laid.pixel_size, other.pixel_size, strict=True)):
        taken = 1 - laid.statistics().rms_curvature / other.statistics().rms_curvature
        if not taken >= LEAST_LOSS:
            return None
        share = f"{100 * taken:.2g} % of its rms curvature"
    else:
        share = "what is shorter than some four of its pixels"
    return (
        f"it is interpolated by cubic splines between its points, which takes {share}: fewer summits, of larger radii; "
        f"{_remedy(other, rotation)}"
    )


def _height_lines(surface: Surface) -> list[tuple[str, str]]:
    found = surface.statistics()
    # a profile has nothing across
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


def _summit_lines(surface: Surface) -> list[tuple[str, str]]:
    rule = 3 if 1 in surface.shape else 9
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
    return "not reached" if math.isnan(value) else quantity_text(value, "m")


def _number(value: float, unit: str = "") -> str:
    return "none" if math.isnan(value) else f"{value:.4g}{unit}"


def _remedy(other: Surface, rotation: float) -> str:
    """Return what would take nothing from this surface."""
    free = "interpolation 'fourier'" if other.periodic else "interpolation 'none', by whole pixels of one size,"
    return f"without a rotation {free} takes nothing" if rotation else f"{free} takes nothing"
