"""The form of a surface, which is removed to leave its roughness: a plane, a quadratic, a sphere."""

import math
from collections.abc import Mapping

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats
from historysim.errors import InputError

_DEGREE: Mapping[str, int] = {"mean": 0, "plane": 1, "quadratic": 2}
FORMS = (*_DEGREE, "sphere", "polynomial")

HIGHEST_DEGREE = 12
"""Of a polynomial; higher ones follow the roughness."""

NO_CURVATURE = 1e-12
"""Curvature over height, both in half diagonals, below which a fitted sphere would be rounding of the heights."""
STEEPEST = 0.9
"""Largest distance from the axis over the radius of the sphere that the search starts from; 1 is at the equator."""


@attrs.frozen(eq=False)
class Form:
    """The least-squares form of a surface."""

    kind: str
    """One of `FORMS`."""
    heights: Floats = attrs.field(repr=False)
    """(nx, ny) At all points, missing ones too [m]."""
    radius: float | None = None
    """Of a sphere [m]: positive for a ball, which is highest in the middle, negative for a hollow."""


def fit_form(heights: Floats, pixel_size: tuple[float, float], kind: str, degree: int | None = None) -> Form:
    """Return the form of a surface: least squares of the height over the points that are not missing.

    "quadratic" has all six terms up to second order, "polynomial" all up to its degree, 0 to 12; "sphere" has a free
    centre and radius, so that a tilted ball needs no levelling first. On a profile they are a line, a parabola and a
    circle. Raises InputError: another form, a degree out of range or of another form, too few points for it, or a
    surface that no sphere fits.
    """
    if kind not in FORMS:
        raise InputError(f"form is {kind!r}; expected one of {', '.join(FORMS)}")
    if (kind == "polynomial") != (degree is not None):
        given = "no degree" if degree is None else f"degree {degree!r}"
        raise InputError(f"{given} for the form {kind}; expected a degree of a polynomial, and of nothing else")
    if degree is None:
        degree = _DEGREE.get(kind, 0)
    elif isinstance(degree, bool) or not isinstance(degree, int) or not 0 <= degree <= HIGHEST_DEGREE:
        raise InputError(f"degree is {degree!r}; expected a whole number from 0 to {HIGHEST_DEGREE}")
    narrow = 1 in heights.shape
    terms = degree + 1 if narrow else (degree + 1) * (degree + 2) // 2
    unknowns = (3 if narrow else 4) if kind == "sphere" else terms
    present = int(np.count_nonzero(np.isfinite(heights)))
    if present < unknowns:
        raise InputError(f"{present} points for a form, {kind}, of {unknowns} unknowns; expected more points")
    if kind == "sphere":
        return _sphere(heights, pixel_size)
    return Form(kind, _polynomial(heights, degree))


def _polynomial(heights: Floats, degree: int) -> Floats:
    """Return the polynomial of this total degree in x and y, in Legendre terms, which keep their digits."""
    from numpy.polynomial import legendre

    present = np.isfinite(heights)
    terms = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    (x, half_x), (y, half_y) = (_centred(present.any(axis=across)) for across in (1, 0))
    columns_x = legendre.legvander(x / (half_x or 1), degree)[:, [i for i, _ in terms]]
    columns_y = legendre.legvander(y / (half_y or 1), degree)[:, [j for _, j in terms]]
    # sums over all points of the products of two terms, without a column of all points for each term
    products = [
        ((columns_x * columns_x[:, [k]]).T @ present.astype(np.float64) * (columns_y * columns_y[:, [k]]).T).sum(axis=1)
        for k in range(len(terms))
    ]
    # Legendre terms are nearly orthogonal, so that normal equations keep their digits
    form = np.zeros(heights.shape)
    # once more on what is left, so that a surface that is its own form leaves nothing but rounding
    for _ in range(2):
        left = np.where(present, heights - form, 0.0)
        projections = ((columns_x.T @ left) * columns_y.T).sum(axis=1)
        coefficients = np.linalg.lstsq(np.stack(products), projections, rcond=None)[0]
        form += (columns_x * coefficients) @ columns_y.T
    return form


def _centred(present: npt.ArrayLike) -> tuple[Floats, float]:
    """Return the indices counted from the middle of the present ones, and how far these reach from it.

    Counted from the middle of the map, a small piece that alone is present would cost the form its digits.
    """
    first, last = np.flatnonzero(present)[[0, -1]]
    return np.arange(np.size(present)) - (first + last) / 2, float(last - first) / 2


def _sphere(heights: Floats, pixel_size: tuple[float, float]) -> Form:
    """Return the sphere z = z0 - (1 - √(1 - κ²ρ²))/κ, ρ² = (x-x0)² + (y-y0)², of least squares.

    The unit of length is half the diagonal of the present points. The search starts from the paraboloid of least
    squares; on a profile along x, y0 stays 0.
    """
    from scipy.optimize import least_squares

    present = np.isfinite(heights)
    indices, half = zip(*(_centred(present.any(axis=across)) for across in (1, 0)), strict=True)
    length = math.hypot(half[0] * pixel_size[0], half[1] * pixel_size[1])
    x_all = indices[0][:, None] * (pixel_size[0] / length)
    y_all = indices[1][None, :] * (pixel_size[1] / length)
    x, y = (np.broadcast_to(axis, heights.shape)[present] for axis in (x_all, y_all))
    mean = heights[present].mean()
    z = (heights[present] - mean) / length
    terms = np.stack([np.ones_like(x), x, y, -(x**2 + y**2) / 2])
    (level, slope_x, slope_y, curvature), _, rank, _ = np.linalg.lstsq(terms @ terms.T, terms @ z, rcond=NO_CURVATURE)
    if rank < (3 if 1 in heights.shape else 4):
        raise InputError("no sphere fits points on a line or a circle better than others do; expected points all over")
    rounding = NO_CURVATURE * np.abs(z).max(initial=0) + 8 * np.finfo(float).eps * abs(mean) / length
    if not abs(curvature) > rounding:
        raise InputError("no sphere fits a surface that is not curved; expected a ball or a hollow, or the form plane")
    start = [
        slope_x / curvature,
        slope_y / curvature,
        level + (slope_x**2 + slope_y**2) / (2 * curvature),
    ]
    steepest = STEEPEST / np.hypot(x - start[0], y - start[1]).max()
    start.append(np.clip(curvature, -steepest, steepest))
    moving = [index for index in range(4) if not (index < 2 and heights.shape[index] == 1)]

    def unknowns(moved: Floats) -> Floats:
        values = np.array(start)
        values[moving] = moved
        return values

    found = least_squares(
        lambda moved: _cap(unknowns(moved), x, y)[0] - z,
        np.array(start)[moving],
        lambda moved: _cap(unknowns(moved), x, y)[1][moving].T,
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    best = unknowns(found.x)
    if not np.isfinite(best).all() or abs(best[3]) * np.hypot(x - best[0], y - best[1]).max() >= 1 or best[3] == 0:
        raise InputError("no sphere fits: the best one does not cover all points; expected a ball or a hollow")
    return Form("sphere", _cap(best, x_all, y_all)[0] * length + mean, float(length / best[3]))


def _cap(unknowns: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the heights of a sphere, and their derivatives by x0, y0, z0 and κ."""
    x0, y0, z0, curvature = unknowns
    square = (x - x0) ** 2 + (y - y0) ** 2
    # a step of the search may go beyond the equator, where there is no height; the best fit may not
    root = np.sqrt(np.maximum(1 - curvature**2 * square, 1e-12))
    slope = curvature / root
    gradient = np.stack([slope * (x - x0), slope * (y - y0), np.ones_like(square), -square / (root * (1 + root))])
    return z0 - curvature * square / (1 + root), gradient
