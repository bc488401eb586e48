"""Recorded rows: arrays that the library writes to."""

from typing import Any, Self

import attrs
import numpy as np

from historysim.basics.arguments import Array, Integers
from historysim.basics.library import ffi, pointer
from historysim.memory.binding import TOTALS

PROJECTED = ("normal_load", "tangential_load", "contact_radius", "stick_radius", "slip_state")
"""What is recorded of each asperity together."""


@attrs.frozen(eq=False)
class Rows:
    """Recorded rows in SI units.

    Attributes
    ----------
    totals : array (row)
        Of the whole contact, with the fields of ``hs_totals``.
    each : mapping of array (row, column)
        Of each recorded asperity, by the names of the fields of ``hs_rows``.
    """

    totals: Array
    each: dict[str, Array]

    def __getitem__(self, where: slice) -> Self:
        """Return some of the rows, which are the same arrays."""
        return type(self)(self.totals[where], {name: array[where] for name, array in self.each.items()})

    def __getattr__(self, name: str) -> Array:
        """Return the array of a name (row, column)."""
        try:
            return self.each[name]
        except KeyError:
            raise AttributeError(name) from None

    def as_struct(self, asperities: Integers) -> Any:
        """Return the rows of asperities (column) as the library takes them; all of it has to outlive the call."""
        found = ffi.new("hs_rows *")
        found.columns, found.asperity = asperities.size, pointer(asperities)
        found.totals = ffi.cast("hs_totals *", ffi.from_buffer(self.totals))
        for name, array in self.each.items():
            setattr(found, name, pointer(array))
        return found


def blank_rows(count: int, asperities: int | None, *more: str) -> Rows:
    """Return arrays for rows to be written to.

    Parameters
    ----------
    count : int
    asperities : int, optional
        How many are recorded; None for totals alone.
    *more : str
        What is recorded of each asperity beside what always is, by the names of the fields of ``hs_rows``.
    """
    names = () if asperities is None else (*PROJECTED, "dissipated_energy", *more)
    shape = (count, asperities or 0)
    each = {name: np.empty(shape, dtype=np.int8 if name == "slip_state" else np.float64) for name in names}
    return Rows(np.empty(count, dtype=TOTALS), each)
