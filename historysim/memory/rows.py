"""Recorded rows: arrays that the library writes to."""

from typing import Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import Array, Integers
from historysim.basics.library import ffi, pointer
from historysim.memory.binding import TOTALS

# What is recorded of each asperity together.
PROJECTED = ("normal_load", "tangential_load", "contact_radius", "stick_radius", "slip_state")


@attrs.frozen(eq=False)
class Rows:
    """Recorded rows in SI units."""

    totals: Array  #: (row) of the whole contact, with the fields of ``hs_totals``
    each: dict[str, Array]  #: (row, column) of each recorded asperity, by the names of the fields of ``hs_rows``
    #: (row, 2) of the whole contact in two tangential directions, by the names of the fields of ``hs_planar_rows``;
    #: tangential loads of asperities are (row, column, 2) then. In one direction there are none.
    vectors: dict[str, Array] = attrs.Factory(dict)

    def __getitem__(self, where: slice) -> Self:
        """Return some of the rows, which are the same arrays."""
        parts = ({name: array[where] for name, array in arrays.items()} for arrays in (self.each, self.vectors))
        return type(self)(self.totals[where], *parts)

    def __getattr__(self, name: str) -> Array:
        """Return the array of a name (row, column)."""
        try:
            return self.each[name]
        except KeyError:
            raise AttributeError(name) from None

    def total(self, name: str) -> Array:
        """Return a number of the whole contact, a vector where it is one, (row) or (row, 2)."""
        total: Array = self.vectors[name] if name in self.vectors else self.totals[name]
        return total

    def as_struct(self, asperities: Integers) -> Any:
        """Return the rows of asperities (column) as the library takes them; all of it has to outlive the call."""
        whole = ffi.new("hs_planar_rows *" if self.vectors else "hs_rows *")
        for name, array in self.vectors.items():
            setattr(whole, name, pointer(array))
        found = whole.rows if self.vectors else whole
        found.columns, found.asperity = asperities.size, pointer(asperities)
        found.totals = ffi.cast("hs_totals *", ffi.from_buffer(self.totals))
        for name, array in self.each.items():
            setattr(found, name, pointer(array))
        return whole


def blank_rows(count: int, asperities: int | None, *more: str, planar: bool = False) -> Rows:
    """Return arrays for rows to be written to, of so many asperities; None for totals alone.

    ``more`` is recorded of each asperity beside what always is, by the names of the fields of ``hs_rows``.
    """
    names = () if asperities is None else (*PROJECTED, "dissipated_energy", *more)
    shape = (count, asperities or 0)
    each = {name: np.empty(shape, dtype=np.int8 if name == "slip_state" else np.float64) for name in names}
    vectors: dict[str, Array] = {}
    if planar:
        vectors = {name: np.empty((count, 2)) for name in ("tangential_load", "displacement")}
        if each:
            each["tangential_load"] = np.empty((*shape, 2))
    return Rows(np.empty(count, dtype=TOTALS), each, vectors)
