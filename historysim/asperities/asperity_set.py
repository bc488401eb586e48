"""`AsperitySet`: base class of bodies whose asperities are paraboloids, with their summits and positions."""

import abc
from functools import partial
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from historysim.asperities.body import Body, check_pair, require, warn_if_unlikely
from historysim.asperities.law import FrictionLaw, coulomb
from historysim.basics.arguments import (
    ArrayLike,
    Floats,
    as_floats,
    as_item_array,
    scalar,
    workable,
)
from historysim.basics.limits import SMALLEST
from historysim.basics.wording import brief
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from historysim.asperities.asperity import Asperities, Asperity

per_asperity = partial(as_item_array, "asperity", "asperities")


def summit_fields(  # noqa: PLR0913 - the parameters of `Ensemble`
    pair: MaterialPair,
    summit_height: ArrayLike,
    summit_radius: ArrayLike,
    friction: ArrayLike | FrictionLaw,
    *,
    x: ArrayLike | None = None,
    y: ArrayLike | None = None,
    nominal_area: float | None = None,
    tolerance: float = 1e-6,
    count: int = 1,
) -> dict[str, Any]:
    """Check the parameters of `AsperitySet`, and return its fields; ``count`` is the smallest number of asperities."""
    check_pair(pair)
    height = per_asperity("summit_height", summit_height)
    if not height.size:
        raise InputError(
            "summit_height is empty; expected one number, or a list with one per asperity"
        )
    count = max(height.size, np.size(summit_radius), count)
    height = per_asperity("summit_height", height, count)
    radius = per_asperity("summit_radius", summit_radius, count, above=0)
    coefficients = friction.at_start(count) if isinstance(friction, FrictionLaw) else friction
    # the unit of length is the largest radius; other radii may be arbitrarily small
    workable("summit_radius", radius.max(), smallest=SMALLEST)
    workable("summit_radius", radius)
    workable("summit_height", height)
    coefficients = per_asperity("friction", coulomb(coefficients, count), count)
    warn_if_unlikely(pair, coefficients, radius, stacklevel=3)
    return {
        "pair": pair,
        "summit_height": height,
        "summit_radius": radius,
        "friction": coefficients,
        "x": None if x is None else per_asperity("x", x, count),
        "y": None if y is None else per_asperity("y", y, count),
        "tolerance": float(as_floats("tolerance", tolerance, above=0)),
        "nominal_area": None
        if nominal_area is None
        else scalar("nominal_area", nominal_area, above=0),
    }


class AsperitySet(Body):
    """Base class of `Ensemble` and `InclinedEnsemble`: asperities with heights, radii and friction coefficients."""

    summit_height: Floats
    summit_radius: Floats
    x: Floats | None
    y: Floats | None
    nominal_area: float | None

    @classmethod
    def from_summits(
        cls, pair: MaterialPair, summits: Any, friction: ArrayLike | FrictionLaw, **options: Any
    ) -> Self:
        """Make a body from summits, which have ``height``, ``radius``, ``x`` and ``y`` [m]; options of its class.

        Summits with a ``slope`` need `InclinedEnsemble`; InputError otherwise.
        """
        if not all(hasattr(summits, name) for name in ("height", "radius", "x", "y")):
            raise InputError(
                f"summits is {brief(summits)}; expected Summits, such as Surface.summits() returns"
            )
        options = {
            "x": summits.x,
            "y": summits.y,
            "nominal_area": getattr(summits, "nominal_area", None),
        } | options
        if getattr(summits, "slope", None) is not None:
            options["slope"] = summits.slope
        make: Any = cls
        body: Self = make(pair, summits.height, summits.radius, friction, **options)
        return body

    def __len__(self) -> int:
        """Return the number of asperities."""
        return self.summit_height.size

    def __iter__(self) -> "Iterator[Asperity]":
        """Iterate over the asperities in the initial state; `asperities` has those of another state."""
        return iter(self.asperities(self.initial_state()))

    @property
    def highest_summit(self) -> float:
        """Height of the highest summit [m]: the separation at first touch."""
        return float(self.summit_height.max())

    @property
    def first_touch(self) -> Floats:
        """Approach at which each asperity first touches [m]."""
        return self.highest_summit - self.summit_height

    @property
    def coordinates(self) -> dict[str, Floats]:
        """Properties of each asperity: height, radius, friction at the start; if known its position."""
        properties = {
            "summit_height": self.summit_height,
            "summit_radius": self.summit_radius,
            "friction": self.friction,
            "x": self.x,
            "y": self.y,
        }
        return {name: values for name, values in properties.items() if values is not None}

    @property
    def settings(self) -> dict[str, Any]:
        """Numbers that define it in addition to its arrays and laws, as a log stores them."""
        area = {} if self.nominal_area is None else {"nominal_area": self.nominal_area}
        return super().settings | area

    @abc.abstractmethod
    def asperity(self, index: int, state: Any) -> "Asperity":
        """Return one asperity with its memory in a state; InputError if the index is out of range."""

    @abc.abstractmethod
    def asperities(self, state: Any) -> "Asperities":
        """Return all asperities with their memories in a state, as a sequence: ``len``, index, slice, iteration."""


def require_asperities(body: Body) -> AsperitySet:
    """Return a body of asperities; InputError for patches of normal curves, which have no radii."""
    require(body, "asperities")
    return cast("AsperitySet", body)
