"""Spectral moments of a surface, and the summits of a Gaussian surface that has them."""

import math

import attrs

from historysim.basics.units import as_float
from historysim.errors import InputError


def _moment(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    if not (isinstance(value, float) and (0 <= value < math.inf or math.isnan(value))):
        raise InputError(
            f"{type(owner).__name__}: {attribute.name} is {value!r}; expected a finite number of 0 or more, in SI, or "
            "NaN where it is not known"
        )


def ratio(part: float, whole: float) -> float:
    """Return part over whole, NaN where the whole is 0."""
    return part / whole if whole else math.nan


@attrs.frozen
class SpectralMoments:
    """Spectral moments of the profiles of a surface, and the summits of a Gaussian surface that has them.

    The surface of the closed forms is isotropic, Gaussian and continuous. All are NaN where they have no value.

    Parameters
    ----------
    m0 : float
        Variance of the height [m²].
    m2 : float
        Mean square slope of a profile [1].
    m4 : float
        Mean square curvature of a profile [1/m²].

    Raises
    ------
    InputError
        A moment that is negative, infinite or not a number; NaN is let through.

    Notes
    -----
    Longuet-Higgins, *Phil. Trans. R. Soc. A* 249 (1957) 321-387; Nayak, *J. Lubr. Technol.* 93 (1971) 398-407.
    """

    m0: float = attrs.field(converter=as_float, validator=_moment)
    m2: float = attrs.field(converter=as_float, validator=_moment)
    m4: float = attrs.field(converter=as_float, validator=_moment)

    @property
    def alpha(self) -> float:
        """Nayak's bandwidth parameter α = m0 m4 / m2² [1]: 3/2 or more for an isotropic surface.

        This is not ψ of `HeightStatistics.bandwidth`.
        """
        return ratio(self.m0 * self.m4, self.m2 * self.m2)

    @property
    def summit_density(self) -> float:
        """Summits per area [1/m²]: m4 / (6 π √3 m2)."""
        return ratio(self.m4, 6 * math.pi * math.sqrt(3) * self.m2)

    @property
    def mean_summit_height(self) -> float:
        """Mean height of the summits over the mean plane [m]: 4 √m0 / √(π α)."""
        return ratio(4 * math.sqrt(self.m0), math.sqrt(math.pi * self.alpha))

    @property
    def mean_summit_curvature(self) -> float:
        """Mean over the summits of their mean curvature [1/m], positive: 8 √m4 / (3 √π)."""
        return 8 * math.sqrt(self.m4) / (3 * math.sqrt(math.pi))
