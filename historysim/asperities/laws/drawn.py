"""Coulomb's law with a coefficient for each asperity, drawn from a distribution."""

import attrs
import numpy as np

from historysim.asperities.laws.friction_law import LAWS, FrictionLaw, Loaded
from historysim.basics.array_types import Floats
from historysim.basics.fields import Number, at_least, one_of
from historysim.basics.units import as_float, is_number
from historysim.errors import InputError


def _seed(law: object, attribute: "attrs.Attribute[int]", value: object) -> None:
    whole = is_number(value) and value == int(value) and value >= 0  # type: ignore[call-overload, operator]
    if not whole:
        raise InputError(f"{type(law).__name__}: {attribute.name} is {value!r}; expected a whole number of 0 or more")


@LAWS.register
@attrs.frozen
class DrawnFriction(FrictionLaw):
    """Coulomb's law with a coefficient for each asperity, drawn once from a distribution with a seed.

    Parameters
    ----------
    mean : float
        Of the coefficients, > 0.
    deviation : float
        Standard deviation of the coefficients, ≥ 0.
    seed : int
        Of the generator: the same seed draws the same coefficients.
    distribution : {"lognormal", "uniform"}
        Neither has negative coefficients; a uniform one needs a deviation of mean/√3 at most.

    Raises
    ------
    InputError
        A number out of its range, or another word.

    Examples
    --------
    [friction]
    law = "drawn"
    mean = 0.2
    deviation = 0.02
    seed = 4
    """

    mean: Number = attrs.field(converter=as_float, validator=at_least(0.0, above=True))
    deviation: Number = attrs.field(converter=as_float, validator=at_least(0.0))
    seed: int = attrs.field(validator=_seed)
    distribution: str = attrs.field(default="lognormal", validator=one_of("lognormal", "uniform"))

    kind = "drawn"
    depends_on = "nothing"

    def __attrs_post_init__(self) -> None:
        """Check that no coefficient is negative."""
        if self.distribution == "uniform" and self.deviation * np.sqrt(3) > self.mean:
            raise InputError(
                f"DrawnFriction: deviation is {self.deviation:g}, which makes some coefficients negative; expected "
                f"{self.mean / np.sqrt(3):.6g} at most (mean/√3), or distribution = 'lognormal'"
            )

    def at_start(self, count: int) -> Floats:
        """Return so many coefficients, as they are drawn (asperity)."""
        generator = np.random.default_rng(self.seed)
        if self.distribution == "uniform":
            half = np.sqrt(3) * self.deviation
            return generator.uniform(self.mean - half, self.mean + half, count)
        variance = np.log1p((self.deviation / self.mean) ** 2)
        return generator.lognormal(np.log(self.mean) - variance / 2, np.sqrt(variance), count)

    def coefficients(self, loaded: Loaded) -> Floats:
        """Return the coefficient μ of each asperity (asperity), as drawn for so many."""
        return self.at_start(loaded.normal_load.size)

    @property
    def text(self) -> str:
        """Say in a line what it is."""
        return (
            f"Coulomb, {self.distribution} over the asperities with mean {self.mean:g} and standard deviation "
            f"{self.deviation:g}, seed {self.seed}"
        )
