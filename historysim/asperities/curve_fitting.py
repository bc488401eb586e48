"""From a table of a normal curve to a sum of powers 3/2 of the approach, which is what the memory replays.

The total load of a table is written as P(a) = Σ_k W_k (a - h_k)^(3/2) on labels h_k. First with W_k ≥ 0 (a monotone,
convex regression, which finds a Hertz contact or an ensemble of them exactly). Contacts that press on one another
stiffen less than any such sum, so what is left is then taken up by a smooth density of either sign: each label
gets a little, and P stays convex between them.
"""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

BETWEEN = 2
"""Labels per interval of the table."""
MOST_POINTS = 200
"""Rows of the table that get labels of their own; a longer one is a measurement, and gets evenly chosen ones."""
FIXED = 1e-9
"""Largest relative misfit of the sum with positive weights that is taken for rounding."""
RIDGE = 1e-6
SMOOTHINGS = tuple(10.0**power for power in range(-9, 4))
LEAST = 1e-9
"""Weight, relative to the density of the curve, of an element that the total does not need, but its patches may."""


def powers(approach: Floats, label: Floats, power: float = 1.5) -> Floats:
    """Return (a - h)₊^power (approach, label)."""
    return np.clip(approach[:, None] - label, 0.0, None) ** power


def labels(approach: Floats) -> Floats:
    """Return where elements of a table first touch, from 0 up [m]."""
    rows = np.linspace(0, approach.size - 1, min(approach.size, MOST_POINTS)).round().astype(int)
    edges = np.concatenate([[0.0], approach[rows]])
    steps = np.arange(BETWEEN) / BETWEEN
    return (edges[:-1, None] + np.diff(edges)[:, None] * steps).ravel()


def density(label: Floats, approach: Floats, load: Floats) -> Floats:
    """Return the weight that elements have on average, if each is there for its own stretch of labels [N/m^1.5]."""
    width = np.diff(label, append=approach[-1])
    return width * np.interp(
        label, np.append(0.0, approach), np.append(load[0], load) / np.append(approach[0], approach) ** 2.5
    )


def spread(matrix: Floats, smoothing: float) -> Floats:
    """Return the operator (element, row) that makes residuals vanish by a smooth change of the elements.

    Parameters
    ----------
    matrix : array (row, element)
        What each element adds to each row, all of them relative.
    smoothing : float
    """
    count = matrix.shape[1]
    rough = np.sqrt(smoothing) * np.diff(np.eye(count), axis=0)
    small = 1e-2 * np.sqrt(smoothing) * np.eye(count)
    columns, triangle = np.linalg.qr(np.vstack([matrix, rough, small]))
    operator: Floats = np.linalg.solve(triangle, columns[: len(matrix)].T)
    return operator


def fit_weights(label: Floats, approach: Floats, load: Floats) -> Floats:
    """Return weights of the elements [N/m^1.5], with which P rises and is convex.

    Parameters
    ----------
    label : array (element)
        Where they first touch [m].
    approach, load : array (row)
        The table [m], [N].
    """
    from scipy.optimize import nnls

    matrix = powers(approach, label) / load[:, None]
    size = np.linalg.norm(matrix, axis=0)
    stacked = np.vstack([matrix / size, RIDGE * np.eye(label.size)])
    wanted = np.append(np.ones(approach.size), np.zeros(label.size))
    weight: Floats = nnls(stacked, wanted, maxiter=100 * label.size)[0] / size
    residual = 1.0 - matrix @ weight
    if np.abs(residual).max() < FIXED:
        weight[weight * size < FIXED * (weight * size).max()] = 0.0
        return weight
    typical = density(label, approach, load)
    middle = label + 0.5 * np.diff(label, append=approach[-1])
    for smoothing in SMOOTHINGS:
        changed = weight + typical * (spread(matrix * typical, smoothing) @ residual)
        stiffness = powers(middle, label, 0.5) @ changed
        if stiffness[0] > 0 and (np.diff(stiffness) >= 0).all():
            return changed
    return weight


def shared(label: Floats, weight: Floats, approach: Floats, total: Floats) -> Floats:
    """Return the operator (element, row) that turns the load of a patch in the table into its share of each element.

    An element belongs first to the patches whose load rises where it touches. What that leaves of the table is taken up
    by smooth changes of the shares. The operator turns the total into 1.
    """
    fitted = powers(approach, label) @ weight
    row = np.minimum(np.searchsorted(approach, label, side="right"), approach.size - 1)
    first = np.zeros((label.size, approach.size))
    rise = np.diff(total, prepend=0.0)[row]
    first[np.arange(label.size), row] = 1.0 / rise
    inner = row > 0
    first[np.flatnonzero(inner), row[inner] - 1] = -1.0 / rise[inner]
    typical = np.abs(weight) + density(label, approach, total)
    scale = (powers(approach, label) * typical) / fitted[:, None]
    missing = np.diag(fitted / total) - powers(approach, label) @ (weight[:, None] * first)
    change = typical[:, None] * (spread(scale, SMOOTHINGS[0]) @ (missing / fitted[:, None]))
    return first + change / weight[:, None]
