"""Many Hertzian summits under one rigid flat, after Greenwood and Williamson, as integrals or as sums.

Summits of one radius R, with heights of deviation σ around their mean and D of them per nominal
area A0, meet a flat at the separation d over the datum of the heights [m]. They do not influence
one another. A scalar separation gives scalars, an array one value each; loads press when they are
positive. A number that is not finite or out of its range raises `InputError`.

Greenwood and Williamson, *Proc. R. Soc. Lond. A* 295 (1966) 300-319; Johnson, *Contact Mechanics*
(1985), section 13.4.
"""

import math
from typing import Any, NamedTuple, Self

import attrs
import numpy as np
from scipy.special import gamma, hyp1f1

from historysim.basics.arguments import ArrayLike, Floats, as_floats, scalar
from historysim.contact import hertz
from historysim.errors import InputError

# Separation below which a height integral leaves out less of the normal curve than a rounding:
# F_n(h) = (-h)^n.
WHOLE_CURVE = -1e8


def _number(*, signed: bool = False, **options: Any) -> Any:
    """Return a field that is one finite number in SI, and greater than 0 if not signed."""

    def convert(value: Any, field: "attrs.Attribute[float]") -> float:
        return scalar(field.name, value, above=-math.inf if signed else 0)

    return attrs.field(converter=attrs.Converter(convert, takes_field=True), **options)


@attrs.frozen
class GreenwoodWilliamson:
    """A surface of summits with Gaussian heights and one radius, under a rigid flat."""

    contact_modulus: float = _number()  #: E* [Pa], > 0
    summit_radius: float = _number()  #: R [m], > 0
    #: Standard deviation σ of the summit heights [m], > 0; the surface heights have a larger one.
    height_deviation: float = _number()
    summit_density: float = _number()  #: D [1/m²], > 0
    nominal_area: float = _number()  #: A0 [m²], > 0
    #: Mean height of the summits over the datum from which separations count [m].
    mean_height: float = _number(default=0.0, signed=True)

    @classmethod
    def from_summits(cls, summits: Any, contact_modulus: float) -> Self:
        """Return the surface with the mean radius and the mean and deviation of the heights of `Summits`.

        Fewer than two, heights that are all equal, or an area that is not known are an InputError.
        """
        count = np.size(summits.height)
        if count < 2 or np.ptp(summits.height) == 0:
            raise InputError(
                f"{count} summits do not differ in height; expected 2 or more that do, as Gaussian ones"
            )
        if summits.nominal_area is None:
            raise InputError(
                "the summits have no nominal_area; expected the area [m²] of the surface they stand on"
            )
        return cls(
            contact_modulus,
            summit_radius=float(np.mean(summits.radius)),
            height_deviation=float(np.std(summits.height)),
            summit_density=count / summits.nominal_area,
            nominal_area=summits.nominal_area,
            mean_height=float(np.mean(summits.height)),
        )

    def contact_count(self, separation: ArrayLike) -> Floats:
        """Return the expected number of summits in contact [1]: A0 D F_0(h), h = (d - mean height)/σ."""
        return self._summits * self._integral(0, separation)

    def contact_area(self, separation: ArrayLike) -> Floats:
        """Return the real contact area [m²]: A0 π σ R D F_1(h)."""
        return (
            math.pi
            * self.height_deviation
            * self.summit_radius
            * self._summits
            * self._integral(1, separation)
        )

    def normal_load(self, separation: ArrayLike) -> Floats:
        """Return the normal load N [N]: A0 (4/3) E* √R σ^(3/2) D F_(3/2)(h)."""
        return self._load * self._integral(1.5, separation)

    def normal_stiffness(self, separation: ArrayLike) -> Floats:
        """Return the normal stiffness -dN/dd [N/m]: A0 2 E* √R σ^(1/2) D F_(1/2)(h)."""
        return 1.5 * self._load / self.height_deviation * self._integral(0.5, separation)

    def separation_at(self, normal_load: ArrayLike) -> Floats:
        """Return the separation d over the datum of the heights [m] at loads N > 0; there is none without load."""
        target = np.log(as_floats("normal_load", normal_load, above=0)) - math.log(self._load)
        h = np.zeros_like(target)
        step = np.full_like(target, np.inf)
        # ln F is concave and falls, so that Newton's method comes down to the root from any start,
        # and from the second step on without passing it; a step of 1e-9 leaves an error of its
        # square
        while np.any(np.abs(step) > 1e-9 * (1 + np.abs(h))):
            log_load = _log_height_integral(1.5, h)
            slope = 1.5 * np.exp(_log_height_integral(0.5, h) - log_load)
            step = (log_load - target) / slope
            h = h + step
        return self.mean_height + self.height_deviation * h

    @property
    def _summits(self) -> float:
        return self.summit_density * self.nominal_area

    @property
    def _load(self) -> float:
        """Load [N] at F_(3/2) = 1, i.e. of all summits at an approach of σ."""
        summit_load = hertz.normal_load(
            self.height_deviation,
            summit_radius=self.summit_radius,
            contact_modulus=self.contact_modulus,
        )
        return self._summits * float(summit_load)

    def _integral(self, order: float, separation: ArrayLike) -> Floats:
        over_mean = as_floats("separation", separation) - self.mean_height
        return height_integral(order, over_mean / self.height_deviation)


class SummitContact(NamedTuple):
    """Totals over given summits under a rigid flat; each has the shape of the separations."""

    contact_count: Floats  #: number of summits in contact [1]
    contact_area: Floats  #: real contact area Σ π R δ [m²]
    normal_load: Floats  #: Σ (4/3) E* √R δ^(3/2) [N]
    normal_stiffness: Floats  #: -dN/dd = Σ 2 E* √(R δ) [N/m]


def summit_contact(
    summit_height: ArrayLike,
    summit_radius: ArrayLike,
    separation: ArrayLike,
    *,
    contact_modulus: float,
) -> SummitContact:
    """Return the sums over given summits under a rigid flat that `GreenwoodWilliamson` has as integrals.

    Heights (summit) and separations [m] are over one datum, radii [m] one for all or one per
    summit, E* [Pa]. A summit touches where z > d, with the approach δ = z - d.
    """
    height = np.atleast_1d(as_floats("summit_height", summit_height))
    radius = as_floats("summit_radius", summit_radius, above=0)
    if height.ndim > 1 or radius.shape not in {(), (1,), height.shape}:
        raise InputError(
            f"summit_height has shape {height.shape} and summit_radius {radius.shape}; expected a list of heights, and "
            "one radius for all or one per height"
        )
    radius = np.broadcast_to(radius, height.shape)
    modulus = scalar("contact_modulus", contact_modulus, above=0)
    distance = as_floats("separation", separation)
    totals = np.zeros((4, distance.size))
    # one by one: summits times separations may not fit in memory
    for column, d in enumerate(distance.flat):
        touches = height > d
        approach, of = height[touches] - d, radius[touches]
        contact = hertz.contact_radius(approach, summit_radius=of)
        load = hertz.normal_load(approach, summit_radius=of, contact_modulus=modulus)
        stiffness = hertz.normal_stiffness(contact, contact_modulus=modulus)
        area = math.pi * float(np.sum(contact**2))
        totals[:, column] = approach.size, area, np.sum(load), np.sum(stiffness)
    return SummitContact(*(total[()] for total in totals.reshape(4, *distance.shape)))


def height_integral(order: float, separation: ArrayLike) -> Floats:
    """Return the height integral F_n(h) = ∫_h^∞ (x - h)^n φ(x) dx [1], with φ the standard normal density.

    The order n is from 0 to 10: 0 counts contacts, 1 is proportional to their area, 3/2 to their
    load and 1/2 to their stiffness; h = d/σ [1]. Accurate to 1e-13 relative, 1e-14 up to order 5/2
    and h = 10; 0 where the integral is less than the smallest float (h > 38).
    """
    with np.errstate(over="ignore"):
        return np.exp(
            _log_height_integral(order, as_floats("separation over deviation", separation))
        )


def _nodes() -> tuple[Floats, Floats]:
    """Return nodes x and weights of ∫_0^∞ f(x) dx for f that decays as exp(-x): the double exponential rule.

    Takahasi and Mori, *Publ. RIMS Kyoto Univ.* 9 (1974) 721-741, with x = exp(y - exp(-y)) and a
    step of 0.1 in y. What the ends leave out is below 1e-20 of the whole for f with powers of x up
    to 10.
    """
    step = 0.1
    y = np.arange(-40, 46) * step
    nodes = np.exp(y - np.exp(-y))
    return nodes, step * nodes * (1 + np.exp(-y))


_NODES, _WEIGHTS = _nodes()


def _log_height_integral(order: float, h: Floats) -> Floats:
    """Return ln F_n(h), which stays finite where F_n itself is smaller than any float."""
    return np.where(
        h > 0, _log_above_mean(order, np.maximum(h, 0)), _log_below_mean(order, np.minimum(h, 0))
    )


def _log_above_mean(order: float, h: Floats) -> Floats:
    """Return ln F_n(h) for h ≥ 0, by quadrature of F_n(h) = φ(h) ∫_0^∞ t^n exp(-t²/2 - h t) dt with t = x/(1 + h)."""
    scale = 1 / (1 + h)
    total = np.zeros_like(h)
    # node by node, so that a million separations do not need memory for all nodes together
    for x, weight in zip(_NODES, _WEIGHTS * _NODES**order, strict=True):
        total += weight * np.exp(-x * scale * (h + x * scale / 2))
    with np.errstate(over="ignore"):
        return np.log(total) + (order + 1) * np.log(scale) - h**2 / 2 - math.log(2 * math.pi) / 2


def _log_below_mean(order: float, h: Floats) -> Floats:
    """Return ln F_n(h) for h ≤ 0, by Kummer's functions, all terms positive.

    F_n(h) = Γ(n+1) exp(-h²/4)/√(2π) · D_(-n-1)(h), with Abramowitz and Stegun, *Handbook*, 19.3 and
    19.12 for the parabolic cylinder function D and 13.1.27 for the exponential.
    """
    near = np.maximum(h, WHOLE_CURVE)
    # scipy's hyp1f1 is infinite for some arguments below 1e-200, where the functions are 1 to
    # rounding long since
    argument = -np.maximum(near**2 / 2, 1e-30)
    even = gamma((order + 1) / 2) * hyp1f1(-order / 2, 0.5, argument)
    odd = math.sqrt(2) * -near * gamma(order / 2 + 1) * hyp1f1((1 - order) / 2, 1.5, argument)
    log_sum: Floats = np.log(2 ** (order / 2 - 1) / math.sqrt(math.pi) * (even + odd))
    return log_sum + order * np.log(np.maximum(h / WHOLE_CURVE, 1))
