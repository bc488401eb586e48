"""Range pairs of a sequence: its cycles after the rainflow count of ASTM E1049-85, section 5.4.4.

The count goes through the turning points, with the last three of those that are left in mind. As soon as the range
between the last two is not smaller than the one before it, that one before is counted and taken out: as a full cycle,
or as a half cycle where it begins at the first point that is left. At the end the ranges that are left are half cycles.

Range pairs and memory
----------------------
A full cycle is a small loop within a larger swing. It closes when the sequence passes the turning point from which it
has begun, and at constant normal load that is the moment at which a contact with Masing memory forgets both of its
turning points (wipe-out): from then on everything is as if the loop had not been. Hence, in any such sequence,

- every full cycle is a closed loop of the contact, and dissipates ΔW of its range wherever on the way it lies
  (`contact.mindlin.dissipated_energy_per_loop` for one asperity);
- the half cycles, one after the other, are the sequence without these loops, `RangePairs.residue`, which leads to the
  same state as the whole sequence; the energy of the whole is that of the residue and of the closed loops.

The converse holds but for the first point: a loop that begins there is two half cycles, and a virgin contact also
forgets a reversal without any loop, when the sequence passes its mirror image on the virgin curve.

ASTM E1049-85 (2017), *Standard practices for cycle counting in fatigue analysis*; Matsuishi and Endo (1968); Downing
and Socie, *Int. J. Fatigue* 4 (1982) 31-40.
"""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.array_types import Floats, Integers
from historysim.basics.library import lib, pointer
from historysim.measured.reduction import turning_points


@attrs.frozen(eq=False)
class RangePairs:
    """Cycles of a sequence, in the order in which they are counted."""

    range: Floats
    """(cycle) Peak to valley, positive, in the unit of the sequence."""
    mean: Floats
    """(cycle) Half way between peak and valley."""
    count: Floats
    """(cycle) 1 for a full cycle, 0.5 for a half cycle."""
    start: Integers
    end: Integers
    """start and end: (cycle) The samples at which the range begins and ends. A full cycle goes on from its end to the
    value of its start."""

    @property
    def residue(self) -> Integers:
        """Samples that are left when all full cycles are taken out: the half cycles, one after the other."""
        half = self.count < 1
        return np.append(self.start[half], self.end[half][-1:])


def range_pairs(values: npt.ArrayLike, *, dead_band: float = 0.0) -> RangePairs:
    """Count the cycles of a sequence.

    Parameters
    ----------
    values : array_like (sample)
        A displacement [m] or a load [N], in any unit.
    dead_band : float
        The smallest swing that counts as a reversal, as in `turning_points`.

    Returns
    -------
    RangePairs
        None in a sequence that stays where it is.

    Raises
    ------
    InputError
        Missing or infinite samples, or a dead band below 0.
    """
    kept = turning_points(values, dead_band)
    samples = np.asarray(values, dtype=np.float64)
    # a record that rests at its end has its last turning point twice
    kept = kept[np.diff(samples[kept], prepend=np.nan) != 0]
    start, end, left = (np.empty(kept.size, dtype=np.int64) for _ in range(3))
    full = np.empty(kept.size, dtype=np.bool_)
    cycles = lib.hs_range_pairs(
        kept.size, pointer(samples[kept]), pointer(start), pointer(end), pointer(full), pointer(left)
    )
    start, end = kept[start[:cycles]], kept[end[:cycles]]
    return RangePairs(
        range=np.abs(samples[end] - samples[start]),
        # the sum of the two may be too large for a float
        mean=0.5 * samples[start] + 0.5 * samples[end],
        count=np.where(full[:cycles], 1.0, 0.5),
        start=start,
        end=end,
    )
