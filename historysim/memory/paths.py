"""Straight paths of both channels, one after the other, and the rows that are recorded on the way."""

from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array, Integers
from historysim.basics.library import ffi, pointer
from historysim.errors import InputError
from historysim.memory.binding import PATH, PLANAR_PATH, TOTALS

# Paths (path), one after the other, with the fields of ``hs_path``, or in two tangential directions of
# ``hs_planar_path``: where each channel goes, in N or m, and how many rows are recorded on the way.
Paths = npt.NDArray[Any]

# What is recorded of each asperity together.
PROJECTED = ("normal_load", "tangential_load", "contact_radius", "stick_radius", "slip_state")
STILL = (0.0, 0.0)  # target and fraction of a channel that is held
UNTIMED = (np.nan, np.nan)  # beginning and end of a path where they are not known


class Goals(NamedTuple):
    """Where one channel goes on each of several paths; a single entry stands for all of them.

    ``control`` is `LOAD` or `DISPLACED`, ``target`` in N or m; ``fraction`` of the way there is gone.
    """

    control: npt.ArrayLike
    target: npt.ArrayLike
    fraction: npt.ArrayLike = 1.0


def paths_to(
    normal: Goals,
    tangential: Goals,
    *,
    parts: npt.ArrayLike = 1,
    recorded: npt.ArrayLike = True,
    times: tuple[npt.ArrayLike, npt.ArrayLike] = UNTIMED,
) -> Paths:
    """Return the straight paths to the goals of both channels, whose rows follow one another from row 0 on.

    A single entry stands for all paths. Tangential targets may be pairs (path, 2), in x and y; their controls and
    fractions are one for both components, or pairs. Each path is walked in
    equal ``parts``, with the inner ends ``recorded``, and its end where that says so. Times are when paths begin and
    end [s]; NaN where that is not known.
    """
    entries = [np.atleast_1d(entry) for entry in (*normal, *tangential, parts, recorded, *times)]
    (count,) = np.broadcast_shapes(*(entry.shape[:1] for entry in entries))
    paths = np.zeros(count, dtype=PATH if np.ndim(tangential.target) < 2 else PLANAR_PATH)
    names = [f"{channel}_{name}" for channel in ("normal", "tangential") for name in Goals._fields]
    for name, column in zip((*names, "parts", "recorded", "begin", "end"), entries, strict=True):
        paths[name] = column[:, None] if paths[name].ndim > column.ndim else column
    rows = paths["parts"] - 1 + paths["recorded"]
    paths["first_row"] = np.cumsum(rows) - rows
    return paths


def in_plane(paths: Paths, control: Any) -> Paths:
    """Return paths in two tangential directions; those of one have to hold it, with the `control` of x and y."""
    if paths.dtype == PLANAR_PATH:
        return paths
    if paths["tangential_fraction"].any():
        raise InputError("the state is of two tangential directions; expected two numbers, in x and y, not one")
    found = np.zeros(paths.size, dtype=PLANAR_PATH)
    for name in set(PATH.names or ()) & set(PLANAR_PATH.names or ()):
        if PATH[name] == PLANAR_PATH[name]:
            found[name] = paths[name]
    found["tangential_control"] = list(control)
    return found


def unrecorded(paths: Paths) -> Paths:
    """Return the same paths without rows on the way."""
    found = paths.copy()
    found["parts"], found["recorded"], found["first_row"] = 1, 0, 0
    return found


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
