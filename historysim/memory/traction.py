"""`TractionMemory`: what one asperity remembers, as a view of its friction group's polyline."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.memory.layout import LABEL, MADE_AT, SLOPE, Units

Floats = npt.NDArray[np.float64]


@attrs.frozen(eq=False)
class TractionMemory:
    """The part of a friction group's polyline that one asperity sees, in SI units.

    The polyline is the anchor of the springs over the label of the springs, the approach of the
    highest summit at which a spring first touched. An asperity sees the labels above its own gap.

    Parameters
    ----------
    vertices : array (vertex, column)
        View of the group's stack, deepest vertex first, the contact edge last (see `layout`); empty
        where the group has no contact.
    gap : float
        Depth of the summit below the highest one [m].
    summit_radius : float
        [m].
    units : Units
        Physical size of the stack's units.
    """

    vertices: Floats = attrs.field(repr=False)
    gap: float
    summit_radius: float
    units: Units = attrs.field(repr=False)

    def _seen(self) -> Floats:
        return self.vertices[self.vertices[:, LABEL] * self.units.length > self.gap]

    @property
    def radius(self) -> Floats:
        """Radii of the vertices, from the contact edge inward [m]: √(R (a_j - gap))."""
        depth = self._seen()[::-1, LABEL] * self.units.length - self.gap
        return np.sqrt(self.summit_radius * depth)

    @property
    def slope(self) -> Floats:
        """Slope dw/da of the anchors between each vertex and the next one inward, edge first; ±μ where springs slip."""
        return self._seen()[::-1, SLOPE].copy()

    @property
    def jump(self) -> Floats:
        """Weight of each vertex in the superposition of Hertz solutions, edge first: its slope less the one outside."""
        return np.diff(self.slope, prepend=0.0)

    @property
    def made_at(self) -> Floats:
        """Tangential displacement at which each vertex was made, edge first [m]."""
        return self._seen()[::-1, MADE_AT] * self.units.displacement
