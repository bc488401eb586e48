"""Many Hertzian summits under one rigid flat, after Greenwood and Williamson, as integrals or as sums.

Summits of one radius R, with heights of deviation σ around their mean and D of them per nominal area A0, meet a flat at
the separation d over the datum of the heights. They do not influence one another. A scalar separation gives scalars, an
array one value each; loads press when they are positive.

Greenwood and Williamson, *Proc. R. Soc. Lond. A* 295 (1966) 300-319; Johnson, *Contact Mechanics* (1985), section 13.4.
"""

import math
from typing import Any, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked, scalar
from historysim.basics.array_types import Floats
from historysim.contact import hertz
from historysim.contact.height_integral import height_integral, log_height_integral
from historysim.errors import InputError


@attrs.frozen(init=False)
class GreenwoodWilliamson:
    """A surface of summits with Gaussian heights and one radius, under a rigid flat.

    Parameters
    ----------
    contact_modulus : float
        E* [Pa], > 0.
    summit_radius : float
        R [m], > 0.
    height_deviation : float
        Standard deviation σ of the summit heights [m], > 0; not that of the surface, which is larger.
    summit_density : float
        D [1/m²], > 0.
    nominal_area : float
        A0 [m²], > 0.
    mean_height : float
        Mean height of the summits over the datum from which separations count [m].

    Raises
    ------
    InputError
        A number that is not finite or out of its range.
    """

    contact_modulus: float
    summit_radius: float
    height_deviation: float
    summit_density: float
    nominal_area: float
    mean_height: float

    def __init__(  # noqa: PLR0917 - the parameters of the model
        self,
        contact_modulus: float,
        summit_radius: float,
        height_deviation: float,
        summit_density: float,
        nominal_area: float,
        mean_height: float = 0.0,
    ) -> None:
        self.__attrs_init__(
            contact_modulus=scalar("contact_modulus", contact_modulus, above=0),
            summit_radius=scalar("summit_radius", summit_radius, above=0),
            height_deviation=scalar("height_deviation", height_deviation, above=0),
            summit_density=scalar("summit_density", summit_density, above=0),
            nominal_area=scalar("nominal_area", nominal_area, above=0),
            mean_height=scalar("mean_height", mean_height),
        )

    @classmethod
    def of_summits(cls, summits: Any, contact_modulus: float) -> Self:  # noqa: ANN401 - of a room below
        """Return the surface whose parameters are those of given summits.

        Parameters
        ----------
        summits : Summits
            With ``height`` and ``radius`` [m] and ``nominal_area`` [m²]. R is the mean of their radii, σ the root mean
            square of their heights about the mean.
        contact_modulus : float
            E* [Pa], > 0.

        Raises
        ------
        InputError
            Fewer than two summits, heights that are all equal, or an area that is not known.
        """
        count = np.size(summits.height)
        if count < 2:
            raise InputError(f"{count} summits came; expected 2 or more, which have a mean height and a deviation")
        if summits.nominal_area is None:
            raise InputError(
                "the summits have no nominal_area; expected the area [m²] of the surface that they stand on"
            )
        if np.ptp(summits.height) == 0:
            raise InputError(f"all {count} summits have one height; expected heights that differ, as Gaussian ones do")
        return cls(
            contact_modulus,
            summit_radius=float(np.mean(summits.radius)),
            height_deviation=float(np.std(summits.height)),
            summit_density=count / summits.nominal_area,
            nominal_area=summits.nominal_area,
            mean_height=float(np.mean(summits.height)),
        )

    def contact_count(self, separation: npt.ArrayLike) -> Floats:
        """Return the expected number of summits in contact [1]: A0 D F_0(h), h = (d - mean height)/σ.

        Parameters
        ----------
        separation : array_like
            d over the datum of the heights [m].

        Raises
        ------
        InputError
            A separation that is not finite.
        """
        return self._summits * self._integral(0, separation)

    def contact_area(self, separation: npt.ArrayLike) -> Floats:
        """Return the real contact area [m²]: A0 π σ R D F_1(h). Parameters and errors as in `contact_count`."""
        return math.pi * self.height_deviation * self.summit_radius * self._summits * self._integral(1, separation)

    def normal_load(self, separation: npt.ArrayLike) -> Floats:
        """Return the normal load N [N]: A0 (4/3) E* √R σ^(3/2) D F_(3/2)(h).

        Parameters and errors as in `contact_count`.
        """
        return self._load * self._integral(1.5, separation)

    def normal_stiffness(self, separation: npt.ArrayLike) -> Floats:
        """Return the normal stiffness -dN/dd [N/m]: A0 2 E* √R σ^(1/2) D F_(1/2)(h).

        Parameters and errors as in `contact_count`.
        """
        return 1.5 * self._load / self.height_deviation * self._integral(0.5, separation)

    def separation_at(self, normal_load: npt.ArrayLike) -> Floats:
        """Return the separation d over the datum of the heights [m] under a normal load.

        Parameters
        ----------
        normal_load : array_like
            N [N], > 0: Gaussian heights have no highest summit, so no separation is free of load.

        Raises
        ------
        InputError
            A load that is not finite or not positive.
        """
        target = np.log(checked("normal_load", normal_load, above=0)) - math.log(self._load)
        h = np.zeros_like(target)
        step = np.full_like(target, np.inf)
        # ln F is concave and falls, so that Newton's method comes down to the root from any start, and from the second
        # step on without passing it; a step of 1e-9 leaves an error of its square
        while np.any(np.abs(step) > 1e-9 * (1 + np.abs(h))):
            log_load = log_height_integral(1.5, h)
            slope = 1.5 * np.exp(log_height_integral(0.5, h) - log_load)
            step = (log_load - target) / slope
            h = h + step
        return self.mean_height + self.height_deviation * h

    @property
    def _summits(self) -> float:
        return self.summit_density * self.nominal_area

    @property
    def _load(self) -> float:
        """Load [N] at F_(3/2) = 1: that of as many summits, each at an approach of σ."""
        one = hertz.normal_load(
            self.height_deviation, summit_radius=self.summit_radius, contact_modulus=self.contact_modulus
        )
        return self._summits * float(one)

    def _integral(self, order: float, separation: npt.ArrayLike) -> Floats:
        over_mean = checked("separation", separation) - self.mean_height
        return height_integral(order, over_mean / self.height_deviation)


@attrs.frozen(eq=False)
class SummitContact:
    """Totals over given summits under a rigid flat; each has the shape of the separations.

    Attributes
    ----------
    contact_count : array
        Number of summits in contact [1].
    contact_area : array
        Real contact area Σ π R δ [m²].
    normal_load : array
        Σ (4/3) E* √R δ^(3/2) [N].
    normal_stiffness : array
        -dN/dd = Σ 2 E* √(R δ) [N/m].
    """

    contact_count: Floats
    contact_area: Floats
    normal_load: Floats
    normal_stiffness: Floats


def summit_contact(
    summit_height: npt.ArrayLike,
    summit_radius: npt.ArrayLike,
    separation: npt.ArrayLike,
    *,
    contact_modulus: float,
) -> SummitContact:
    """Return what given summits carry under a rigid flat: the sums that `GreenwoodWilliamson` has as integrals.

    Parameters
    ----------
    summit_height : array_like (summit)
        Heights z over any datum [m].
    summit_radius : array_like (summit)
        Radii R [m], > 0, one for all or one per summit.
    separation : array_like
        d over the same datum [m]. A summit touches where z > d, with the approach δ = z - d.
    contact_modulus : float
        E* [Pa], > 0.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, or arrays of different lengths.
    """
    height = np.atleast_1d(checked("summit_height", summit_height))
    radius = checked("summit_radius", summit_radius, above=0)
    if height.ndim > 1 or radius.shape not in {(), (1,), height.shape}:
        raise InputError(
            f"summit_height has shape {height.shape} and summit_radius {radius.shape}; expected a list of heights, and "
            "one radius for all or one per height"
        )
    radius = np.broadcast_to(radius, height.shape)
    modulus = scalar("contact_modulus", contact_modulus, above=0)
    distance = checked("separation", separation)
    totals = np.zeros((4, distance.size))
    for column, d in enumerate(distance.flat):
        touches = height > d
        totals[:, column] = _carried(height[touches] - d, radius[touches], modulus)
    count, area, load, stiffness = totals.reshape(4, *distance.shape)
    return SummitContact(count[()], area[()], load[()], stiffness[()])


def _carried(approach: Floats, summit_radius: Floats, contact_modulus: float) -> tuple[float, float, float, float]:
    """Return count, area [m²], load [N] and stiffness [N/m] of summits that touch, by Hertz."""
    radius = hertz.contact_radius(approach, summit_radius=summit_radius)
    load = hertz.normal_load(approach, summit_radius=summit_radius, contact_modulus=contact_modulus)
    stiffness = hertz.normal_stiffness(radius, contact_modulus=contact_modulus)
    return approach.size, math.pi * float(np.sum(radius**2)), float(np.sum(load)), float(np.sum(stiffness))
