"""Height integrals of Greenwood and Williamson: moments of Gaussian heights above a separation.

Greenwood and Williamson, *Proc. R. Soc. Lond. A* 295 (1966) 300-319.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.special import gamma, hyp1f1

from historysim.basics.arguments import checked, scalar
from historysim.basics.array_types import Floats
from historysim.errors import InputError

HIGHEST_ORDER = 10

# below, the part of the normal curve that a height integral leaves out is less than a rounding: F_n(h) = (-h)^n
_WHOLE_CURVE = -1e8


def height_integral(order: float, separation: npt.ArrayLike) -> Floats:
    """Return the height integral F_n(h) = ∫_h^∞ (x - h)^n φ(x) dx [1], with φ the standard normal density.

    Parameters
    ----------
    order : float
        n, from 0 to 10 and not necessarily whole: 0 counts contacts, 1 goes with their area, 3/2 with their load and
        1/2 with their stiffness.
    separation : array_like
        h = d/σ [1], of either sign.

    Raises
    ------
    InputError
        A separation that is not finite, or an order out of its range.

    Notes
    -----
    Accurate to 1e-13 relative, 1e-14 up to order 5/2 and h = 10; from h = 20 the h²/2 roundings of the exponent count.
    The result is 0 where the integral is less than the smallest float (h > 38), and goes as (-h)^n far below 0.
    """
    power = scalar("order", order, least=0)
    if power > HIGHEST_ORDER:
        raise InputError(f"order is {power:g}; expected 0 to {HIGHEST_ORDER}, where the quadrature is accurate")
    with np.errstate(over="ignore"):
        return np.exp(log_height_integral(power, checked("separation over deviation", separation)))


def _nodes() -> tuple[Floats, Floats]:
    """Return nodes x and weights of ∫_0^∞ f(x) dx for f that decays as exp(-x): the double exponential rule.

    Takahasi and Mori, *Publ. RIMS Kyoto Univ.* 9 (1974) 721-741, with x = exp(y - exp(-y)) and a step of 0.1 in y.
    What the ends leave out is below 1e-20 of the whole for f with powers of x up to `HIGHEST_ORDER`.
    """
    step = 0.1
    y = np.arange(-40, 46) * step
    nodes = np.exp(y - np.exp(-y))
    return nodes, step * nodes * (1 + np.exp(-y))


_NODES, _WEIGHTS = _nodes()


def log_height_integral(order: float, h: Floats) -> Floats:
    """Return ln F_n(h), which stays finite where F_n itself is smaller than any float."""
    return np.where(h > 0, _log_above_mean(order, np.maximum(h, 0)), _log_below_mean(order, np.minimum(h, 0)))


def _log_above_mean(order: float, h: Floats) -> Floats:
    """Return ln F_n(h) for h ≥ 0, by quadrature of F_n(h) = φ(h) ∫_0^∞ t^n exp(-t²/2 - h t) dt with t = x/(1 + h)."""
    scale = 1 / (1 + h)
    total = np.zeros_like(h)
    # node by node, so that a million separations need no memory for all nodes at once
    for x, weight in zip(_NODES, _WEIGHTS * _NODES**order, strict=True):
        total += weight * np.exp(-x * scale * (h + x * scale / 2))
    with np.errstate(over="ignore"):
        return np.log(total) + (order + 1) * np.log(scale) - h**2 / 2 - math.log(2 * math.pi) / 2


def _log_below_mean(order: float, h: Floats) -> Floats:
    """Return ln F_n(h) for h ≤ 0, by Kummer's functions, all terms positive.

    F_n(h) = Γ(n+1) exp(-h²/4)/√(2π) · D_(-n-1)(h), with Abramowitz and Stegun, *Handbook*, 19.3 and 19.12 for the
    parabolic cylinder function D and 13.1.27 for the exponential.
    """
    near = np.maximum(h, _WHOLE_CURVE)
    # scipy's hyp1f1 is infinite for some arguments below 1e-200, where the functions are 1 to rounding long since
    argument = -np.maximum(near**2 / 2, 1e-30)
    even = gamma((order + 1) / 2) * hyp1f1(-order / 2, 0.5, argument)
    odd = math.sqrt(2) * -near * gamma(order / 2 + 1) * hyp1f1((1 - order) / 2, 1.5, argument)
    whole: Floats = np.log(2 ** (order / 2 - 1) / math.sqrt(math.pi) * (even + odd))
    return whole + order * np.log(np.maximum(h / _WHOLE_CURVE, 1))
