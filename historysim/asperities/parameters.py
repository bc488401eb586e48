"""What an ensemble is: its parameters, checked, and what they say by themselves."""

import math
from functools import cached_property, partial

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.curves import NormalCurves
from historysim.asperities.friction import at_start
from historysim.asperities.laws.base import FrictionLaw
from historysim.asperities.wear import WearLaw
from historysim.basics.arguments import checked, one_per, scalar
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.layout import Units

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@attrs.frozen(eq=False, init=False, repr=False)
class Parameters:
    """Parameters of an `Ensemble`, which says what they are.

    They and their checks take no compiler, so that a scenario is checked without one; what moves states does.
    """

    pair: MaterialPair
    summit_height: Floats
    summit_radius: Floats
    friction: Floats
    x: Floats | None
    y: Floats | None
    tolerance: float
    curves: NormalCurves | None
    nominal_area: float | None
    law: FrictionLaw | None
    wear: WearLaw | None
    follow_sliding: bool

    def __init__(
        self,
        pair: MaterialPair,
        summit_height: "npt.ArrayLike",
        summit_radius: "npt.ArrayLike",
        friction: "npt.ArrayLike | FrictionLaw",
        *,
        x: "npt.ArrayLike | None" = None,
        y: "npt.ArrayLike | None" = None,
        nominal_area: float | None = None,
        tolerance: float = 1e-6,
        curves: NormalCurves | None = None,
        wear: WearLaw | None = None,
        follow_sliding: bool = False,
    ) -> None:
        if not isinstance(pair, MaterialPair):
            raise InputError(f"pair is {pair!r}; expected a MaterialPair")
        if not (wear is None or isinstance(wear, WearLaw)):
            raise InputError(f"wear is {wear!r}; expected a WearLaw, such as ArchardWear(coefficient=…, hardness=…)")
        each = partial(one_per, "asperity", "asperities")
        height = each("summit_height", summit_height)
        if not height.size:
            raise InputError("summit_height is empty; expected one number, or a list with one per asperity")
        count = max(height.size, np.size(summit_radius))
        height = each("summit_height", height, count)
        law = friction if isinstance(friction, FrictionLaw) else None
        coefficients = at_start(friction, count)
        coefficients.flags.writeable = False
        self.__attrs_init__(
            pair=pair,
            summit_height=height,
            summit_radius=each("summit_radius", summit_radius, count, above=0),
            friction=coefficients,
            x=None if x is None else each("x", x, count),
            y=None if y is None else each("y", y, count),
            tolerance=float(checked("tolerance", tolerance, above=0)),
            curves=curves,
            nominal_area=None if nominal_area is None else scalar("nominal_area", nominal_area, above=0),
            law=law,
            wear=wear,
            follow_sliding=bool(follow_sliding),
        )
        if curves is not None and (law is not None or self.evolves):
            raise InputError(
                "patches of one contact share one coefficient and keep their normal curves; expected a number for "
                "friction, and neither wear nor slid distances, or an ensemble of summits"
            )

    def alone(self) -> "Parameters":
        """Return the parameters by themselves, of the same arrays."""
        found = Parameters.__new__(Parameters)
        found.__attrs_init__(**{field.name: getattr(self, field.name) for field in attrs.fields(Parameters)})
        return found

    def __len__(self) -> int:
        """Return the number of asperities, or of patches."""
        return self.elements if self.curves is None else len(self.curves)

    @property
    def elements(self) -> int:
        """Number of Hertzian contacts that the memory is replayed on: of asperities, or of what carries all patches."""
        return self.summit_height.size

    @property
    def evolves(self) -> bool:
        """Whether friction depends on how asperities are loaded, they wear, or what they slide is followed."""
        changing = self.law is not None and self.law.depends_on != "nothing"
        return changing or self.wear is not None or self.follow_sliding

    @property
    def first_touch(self) -> Floats:
        """Approach at which each asperity or patch first touches [m]."""
        if self.curves is None:
            return self.highest_summit - self.summit_height
        return self.curves.first_touch

    @property
    def coordinates(self) -> dict[str, Floats]:
        """What is known of each asperity or patch: heights, radii, friction at the start, positions."""
        if self.curves is None:
            known = {
                "summit_height": self.summit_height,
                "summit_radius": self.summit_radius,
                "friction": self.friction,
            }
            places = {"x": self.x, "y": self.y}
        else:
            height = self.highest_summit - self.curves.first_touch
            known = {"summit_height": height, "friction": np.full(len(self), self.friction[0])}
            places = {"x": self.curves.x, "y": self.curves.y}
        return known | {name: place for name, place in places.items() if place is not None}

    @property
    def highest_summit(self) -> float:
        """Height of the highest summit [m]: the separation at first touch."""
        return float(self.summit_height.max())

    @cached_property
    def by_gap(self) -> Integers:
        """The elements at the start by ascending gap, equals in the order in which they come."""
        return np.argsort(self.shape()[0], kind="stable")

    def shape(self) -> tuple[Floats, Floats]:
        """Gaps and weights of the elements at the start, dimensionless."""
        scale = self.summit_radius.max()
        gap = (self.summit_height.max() - self.summit_height) / scale
        weight = np.sqrt(self.summit_radius / scale)
        return gap, weight if self.curves is None else np.copysign(weight, self.curves.weight)

    def units(self) -> Units:
        """Physical size of the dimensionless units."""
        length = radius = float(self.summit_radius.max())
        load = 4.0 / 3.0 * self.pair.contact_modulus * length**2
        displacement = self.pair.displacement_ratio * length
        return Units(
            load=load,
            length=length,
            displacement=displacement,
            energy=load * displacement,
            radius=radius,
            area=math.pi * radius * length,
            stiffness=load / displacement,
        )
