"""Recorded rows: their columns, and the arrays that they are written to."""

from typing import NamedTuple

import numpy as np

from historysim.memory.layout import Bytes, Contact, Floats, Integers

SEPARATED, FULL_STICK, PARTIAL_SLIP, GROSS_SLIP = range(4)

# columns of Rows.totals
TOTALS_OF_ROW = 11
(
    ROW_NORMAL,
    ROW_TANGENTIAL,
    ROW_APPROACH,
    ROW_DISPLACEMENT,
    ROW_COUNT,
    ROW_AREA,
    ROW_STIFFNESS,
    ROW_DISSIPATED,
    ROW_LIMIT,
    ROW_SATURATED,
    ROW_TRACTION_RATIO,
) = range(TOTALS_OF_ROW)

# columns of Rows.evolved
TOGETHER = 3
SLID_TOGETHER, ERASED_MEMORIES, ERASED_ENERGY = range(TOGETHER)
OF_EACH = 6
"""Numbers in a row of one asperity."""
PER_ASPERITY = ("slid_distance", "worn_volume", "summit_height", "summit_radius")


class Rows(NamedTuple):
    """Recorded rows in SI units: totals (row, quantity), and per recorded asperity the projections (row, column).

    ``friction`` has no column where friction does not change, one where it is the same of all asperities, or one for
    each recorded asperity. ``evolved`` has columns where asperities evolve: first those of all together, then of each
    of `PER_ASPERITY` one for each recorded asperity.
    """

    totals: Floats
    normal_load: Floats
    tangential_load: Floats
    contact_radius: Floats
    stick_radius: Floats
    slip_state: Bytes
    dissipated: Floats
    friction: Floats
    evolved: Floats


class Columns(NamedTuple):
    """The recorded asperities, one a column: their places in the contact, gaps and weights."""

    place: Integers
    gap: Floats
    weight: Floats


def columns_of(contact: Contact, place: Integers) -> Columns:
    """Return columns for the asperities at some places of a contact."""
    return Columns(place, contact.gap[place], contact.weight[place])


class Scratch(NamedTuple):
    """One row of all asperities in the order of the contact, not yet in that of the columns.

    ``numbers`` (4, asperity) are tangential and normal loads, contact and stick radii; ``state`` is the slip state.
    """

    numbers: Floats
    state: Bytes


def scratch_for(asperities: int) -> Scratch:
    """Return scratch for a contact of so many asperities."""
    return Scratch(np.empty((4, asperities)), np.empty(asperities, dtype=np.int8))


def blank_rows(count: int, asperities: int, coefficients: int = 0, *, evolve: bool = False) -> Rows:
    """Return arrays for rows of asperities to be written to, with columns of friction, and of what evolves."""
    shape = (count, asperities)
    return Rows(
        totals=np.empty((count, TOTALS_OF_ROW)),
        normal_load=np.empty(shape),
        tangential_load=np.empty(shape),
        contact_radius=np.empty(shape),
        stick_radius=np.empty(shape),
        slip_state=np.empty(shape, dtype=np.int8),
        dissipated=np.empty(shape),
        friction=np.empty((count, coefficients)),
        evolved=np.empty((count, TOGETHER + len(PER_ASPERITY) * asperities if evolve else 0)),
    )
