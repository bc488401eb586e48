"""Johnson's translation system: heights of given skewness and kurtosis as a function of Gaussian ones.

With y = z/δ of a standard normal z, and up to a scale and an origin, a translation is

    bounded (SB):     (e^y - 1)/(1 + κ e^y)
    log-normal (SL):  e^y - 1, where both others arrive at κ = 0
    unbounded (SU):   (e^y - 1) - κ (e^-y - 1)

with 0 ≤ κ ≤ 1: κ is e^(-γ/δ) for SB and e^(2γ/δ) for SU, in terms of Johnson's γ. These skew to the right; mirrored
ones skew to the left. Every pair with kurtosis > skewness² + 1 belongs to exactly one translation.

Johnson, *Biometrika* 36 (1949) 149-176.
"""

import math
from collections.abc import Callable
from typing import Final

import attrs
import numpy as np

from historysim.basics.array_types import Floats
from historysim.errors import InputError

MOST_KURTOSIS: Final = 100.0
# bounded heights of a larger 1/δ are two levels with hardly a slope between
_MOST_SHARPNESS: Final = 10.0
# where SU passes MOST_KURTOSIS, at any skewness
_HEAVIEST_SHARPNESS: Final = 1.5
# below it the kurtosis differs from 3 by less than 4/δ² = 4e-10
_LEAST_SHARPNESS: Final = 1e-5
# of -ln κ, beyond which κ is nothing
_MOST_SHIFT: Final = 40.0

# The trapezoidal rule converges as exp(-2π²/(s h)) with s = 1/δ, for the poles of SB lie π/s off the axis; the range
# holds the fourth powers of SU; their weight z² /2 - 4 s z is least at z = 4 s ≤ 6.
_NODES: Final = np.linspace(-16, 16, 1601)
_WEIGHTS: Final = np.exp(-(_NODES**2) / 2) / np.exp(-(_NODES**2) / 2).sum()

# The powers of SB fall as exp(-2 √n π/s), to 1e-14 within these terms; those of SU faster than any exponential.
_HERMITE_REST: Final = 1e-14
_MOST_HERMITE_TERMS: Final = 2600
_KNOTS: Final = 8193


@attrs.frozen
class Translation:
    """An increasing function of standard normal numbers, up to a scale and an origin; see above for 1/δ and κ."""

    bounded: bool
    """SB, otherwise SU."""
    sharpness: float
    """1/δ [1], > 0."""
    kappa: float
    """κ [1], from 0 (log-normal) to 1 (symmetric)."""
    mirrored: bool = False
    """Skews to the left."""

    def __call__(self, normal: Floats) -> Floats:
        """Return standard normal numbers, translated."""
        y = (-self.sharpness if self.mirrored else self.sharpness) * normal
        right = np.expm1(y)
        if self.bounded:
            right /= 1 + self.kappa * (1 + right)
        elif self.kappa:
            right -= self.kappa * np.expm1(-y)
        return -right if self.mirrored else right

    def moments(self) -> tuple[float, float]:
        """Return the skewness and the kurtosis of the translated numbers."""
        translated = self._standard()
        return float(np.sum(_WEIGHTS * translated**3)), float(np.sum(_WEIGHTS * translated**4))

    def correlations(self) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
        """Return the correlation of two translated numbers as a function of that of the normal ones, and the inverse.

        That is R(ρ) = Σ b_n² ρ^n from -1 to 1, with the coefficients b_n of the translation in normalised Hermite
        polynomials (Mehler's formula; Grigoriu, *Applied Non-Gaussian Processes*, 1995); the inverse is from 0 to 1.
        """
        from scipy.interpolate import CubicSpline

        powers = self._hermite_powers()

        def series(correlation: Floats) -> Floats:
            total = np.zeros_like(correlation)
            for power in powers[::-1]:
                total = (total + power) * correlation
            return total

        # of a sine, for R rises to R(1) = 1 as a root where the translation is steep
        normal = np.sin(np.linspace(-math.pi / 2, math.pi / 2, 2 * _KNOTS - 1))
        translated = series(normal)
        return CubicSpline(normal, translated), CubicSpline(translated[_KNOTS - 1 :], normal[_KNOTS - 1 :])

    def _hermite_powers(self) -> Floats:
        """Return b_n² for n = 1, 2, …, with the sum 1."""
        root = np.sqrt(_WEIGHTS)
        translated = self._standard()
        powers: list[float] = []
        before, now, left = np.zeros_like(root), root, 1.0
        while left > _HERMITE_REST and len(powers) < _MOST_HERMITE_TERMS:
            n = len(powers) + 1
            before, now = now, (_NODES * now - math.sqrt(n - 1) * before) / math.sqrt(n)
            powers.append(float(np.sum(translated * root * now)) ** 2)
            left -= powers[-1]
        return np.array(powers) / sum(powers)

    def _standard(self) -> Floats:
        """Return the translated nodes, with mean 0 and rms 1."""
        translated = self(_NODES)
        translated -= np.sum(_WEIGHTS * translated)
        translated /= math.sqrt(np.sum(_WEIGHTS * translated**2))
        return translated


def translation(skewness: float, kurtosis: float) -> Translation | None:
    """Return Johnson's translation to a skewness and a kurtosis, met within 1e-9 of it; None for Gaussian heights.

    Raises InputError: a pair that no distribution has, or only one next to two-level, or a kurtosis > `MOST_KURTOSIS`.
    """
    if skewness == 0 and kurtosis == 3:
        return None
    # most surfaces are Gaussian, and do without
    from scipy.optimize import brentq

    limit = skewness * skewness + 1
    if kurtosis < limit:
        raise InputError(
            f"kurtosis is {kurtosis:g} with a skewness of {skewness:g}; no heights have a kurtosis below "
            f"skewness² + 1 = {limit:g}: raise the kurtosis or bring the skewness closer to 0"
        )
    if kurtosis > MOST_KURTOSIS:
        raise InputError(
            f"kurtosis is {kurtosis:g}; expected at most {MOST_KURTOSIS:g}, beyond which a few single points hold all "
            "of it: lower it"
        )
    target = abs(skewness)
    least, line = _log_normal(target)
    bounded = kurtosis < line
    most = _MOST_SHARPNESS if bounded else _HEAVIEST_SHARPNESS

    def surplus(sharpness: float) -> float:
        return _of_skewness(target, bounded, sharpness).moments()[1] - kurtosis

    least = max(least, _LEAST_SHARPNESS)
    if bounded and (over := surplus(most)) > 0:
        raise InputError(
            f"kurtosis is {kurtosis:g} with a skewness of {skewness:g}, which leaves the heights next to two-level; "
            f"expected at least {kurtosis + over:.4g}: raise the kurtosis or bring the skewness closer to 0"
        )
    # on the log-normal line itself rounding may leave both ends on one side
    between = surplus(least) * surplus(most) < 0
    sharpness = brentq(surplus, least, most, xtol=1e-14, rtol=1e-14) if between else least
    return attrs.evolve(_of_skewness(target, bounded, sharpness), mirrored=skewness < 0)


def _log_normal(skewness: float) -> tuple[float, float]:
    """Return the sharpness and the kurtosis of the log-normal distribution of a skewness ≥ 0."""
    # skewness² = (w - 1)(w + 2)², kurtosis = w⁴ + 2w³ + 3w² - 3, with w = 1 + u = exp(1/δ²)
    u = 4 * math.sinh(math.asinh(skewness / 2) / 3) ** 2
    return math.sqrt(math.log1p(u)), 3 + u * (16 + u * (15 + u * (6 + u)))


def _of_skewness(skewness: float, bounded: bool, sharpness: float) -> Translation:
    """Return the translation of one family and sharpness with a skewness ≥ 0, which grows as κ falls from 1 to 0."""
    from scipy.optimize import brentq

    def of_shift(shift: float) -> Translation:
        return Translation(bounded, sharpness, math.exp(-shift))

    def lack(shift: float) -> float:
        return of_shift(shift).moments()[0] - skewness

    if lack(0.0) >= 0:
        return of_shift(0.0)
    if lack(_MOST_SHIFT) <= 0:
        return of_shift(_MOST_SHIFT)
    return of_shift(brentq(lack, 0.0, _MOST_SHIFT, xtol=1e-13, rtol=1e-14))
