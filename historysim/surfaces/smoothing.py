"""What cubic splines take from a surface that is laid between the points of another, in a sentence."""

import math

import numpy as np
import numpy.typing as npt

from historysim.surfaces.heights import Surface
from historysim.surfaces.resampling import COINCIDENT

LEAST = 0.01
"""The share of the rms curvature below which nothing is said."""


def smoothing_notice(
    surface: Surface, other: Surface, *, shift: npt.ArrayLike = (0.0, 0.0), rotation: float = 0.0
) -> str | None:
    """Return what the splines of ``surface.combined(other, …)`` take from the other surface, in a sentence.

    It is a share of the rms curvature of `height_statistics`; a surface that loses curvature has fewer summits, of
    larger radii.

    Parameters
    ----------
    surface, other, shift, rotation
        As in `Surface.combined`.

    Returns
    -------
    str or None
        None where all points coincide, or less than 1 % is taken. Where the pixel sizes differ there is no number,
        since the curvature depends on the pixel size it is taken over.

    Raises
    ------
    InputError
        As in `Surface.combined`.
    """
    level = Surface(np.zeros(surface.shape), surface.pixel_size, surface.periodic)
    laid = level.combined(other, shift=shift, rotation=rotation)
    if np.isin(laid.heights[~laid.missing], other.heights).all():
        return None
    if all(math.isclose(*sizes, rel_tol=COINCIDENT) for sizes in zip(laid.pixel_size, other.pixel_size, strict=True)):
        taken = 1 - laid.statistics().rms_curvature / other.statistics().rms_curvature
        if not taken >= LEAST:
            return None
        share = f"{100 * taken:.2g} % of its rms curvature"
    else:
        share = "what is shorter than some four of its pixels"
    return (
        f"it is interpolated by cubic splines between its points, which takes {share}: fewer summits, of larger radii; "
        f"{_remedy(other, rotation)}"
    )


def _remedy(other: Surface, rotation: float) -> str:
    """Return what would take nothing from this surface."""
    free = "interpolation 'fourier'" if other.periodic else "interpolation 'none', by whole pixels of one size,"
    return f"without a rotation {free} takes nothing" if rotation else f"{free} takes nothing"
