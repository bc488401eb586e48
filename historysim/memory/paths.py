"""Straight paths of both channels, one after the other, and the rows that are recorded on the way."""

from typing import Any, NamedTuple, Self

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import Array, ArrayLike
from historysim.basics.library import ffi, pointer
from historysim.memory.binding import AS_BEFORE, PATH, TOTALS

# Paths (path), in sequence, with the fields of ``hs_path``: targets of the channels, in N or m, and
# the number of rows that are recorded on the way. In one tangential direction the control of y is
# `AS_BEFORE`.
Paths = npt.NDArray[Any]

# What is recorded of each asperity together.
PROJECTED = ("normal_load", "tangential_load", "contact_radius", "stick_radius", "slip_state")
STILL = (0.0, 0.0)  # target and fraction of a channel that is held
UNTIMED = (np.nan, np.nan)  # beginning and end of a path where they are not known


class Goals(NamedTuple):
    """Targets of one channel on several paths; a single entry stands for all of them.

    ``control`` is `LOAD` or `DISPLACED`, ``target`` in N or m; a path covers ``fraction`` of the
    distance to it.
    """

    control: npt.ArrayLike
    target: npt.ArrayLike
    fraction: npt.ArrayLike = 1.0


def straight_paths(
    normal: Goals,
    tangential: Goals,
    *,
    parts: npt.ArrayLike = 1,
    recorded: npt.ArrayLike = True,
    times: tuple[npt.ArrayLike, npt.ArrayLike] = UNTIMED,
) -> Paths:
    """Return the straight paths to the goals of both channels, whose rows follow one another from row 0 on.

    A single entry applies to all paths. Tangential targets may be pairs (path, 2), in x and y;
    their controls and fractions are one for both components, or pairs. Each path is walked in
    equal ``parts``, with the inner ends ``recorded``, and its end where that says so. Times are
    when paths begin and end [s]; NaN where that is not known.
    """
    entries = [np.atleast_1d(entry) for entry in (*normal, *tangential, parts, recorded, *times)]
    (count,) = np.broadcast_shapes(*(entry.shape[:1] for entry in entries))
    paths, in_plane = np.zeros(count, dtype=PATH), np.ndim(tangential.target) == 2
    names = [f"{channel}_{name}" for channel in ("normal", "tangential") for name in Goals._fields]
    for name, column in zip((*names, "parts", "recorded", "begin", "end"), entries, strict=True):
        if paths[name].ndim == 1:
            paths[name] = column
        elif in_plane:
            paths[name] = column if column.ndim == 2 else column[:, None]
        else:
            paths[name][:, 0] = column
    if not in_plane:
        paths["tangential_control"][:, 1] = AS_BEFORE
    rows = paths["parts"] - 1 + paths["recorded"]
    paths["first_row"] = np.cumsum(rows) - rows
    return paths


def drop_rows(paths: Paths) -> Paths:
    """Return the same paths without rows on the way."""
    copy = paths.copy()
    copy["parts"], copy["recorded"], copy["first_row"] = 1, 0, 0
    return copy


def drop_slide_times(paths: Paths) -> Paths:
    """Return a copy of paths on which it is not recorded when asperities slide."""
    copy = paths.copy()
    copy["begin"], copy["end"] = UNTIMED
    return copy


@attrs.frozen(eq=False)
class Rows:
    """Recorded rows in SI units."""

    totals: Array  #: (row) of the whole contact, with the fields of ``hs_totals``
    #: (row, column) of each recorded asperity, by the names of the fields of ``hs_rows``
    each: dict[str, Array]
    #: (row, 2) of the whole contact in two tangential directions: ``tangential_load`` and
    #: ``displacement``; tangential loads of asperities are (row, column, 2) then. Empty in one
    #: direction.
    vectors: dict[str, Array] = attrs.Factory(dict)

    def __getitem__(self, where: slice) -> Self:
        """Return some of the rows, which are the same arrays."""
        parts = (
            {name: array[where] for name, array in arrays.items()}
            for arrays in (self.each, self.vectors)
        )
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

    def as_struct(self, asperities: ArrayLike) -> Any:
        """Return the rows of asperities (column) as the library takes them; it keeps the arrays alive."""
        columns = np.asarray(asperities, dtype=np.int64)
        rows = ffi.new("hs_rows *")
        rows.columns, rows.asperity = columns.size, pointer(columns)
        rows.totals = ffi.cast("hs_totals *", ffi.from_buffer(self.totals))
        for name, array in self.each.items():
            setattr(rows, name, pointer(array))
        for name, array in self.vectors.items():
            setattr(rows, f"total_{name}", pointer(array))
        # a struct of cffi does not own the targets of its pointers; its destructor does
        return ffi.gc(rows, lambda _, targets=(columns, self): None)  # noqa: ARG005


def blank_rows(count: int, asperities: int | None, *more: str, planar: bool = False) -> Rows:
    """Return arrays for rows to be written to, of so many asperities; None for totals alone.

    ``more`` names further fields of ``hs_rows`` that are recorded of each asperity.
    """
    names = () if asperities is None else (*PROJECTED, "dissipated_energy", *more)
    shape = (count, asperities or 0)
    each = {
        name: np.empty(shape, dtype=np.int8 if name == "slip_state" else np.float64)
        for name in names
    }
    vectors: dict[str, Array] = {}
    if planar:
        vectors = {name: np.empty((count, 2)) for name in ("tangential_load", "displacement")}
        if each:
            each["tangential_load"] = np.empty((*shape, 2))
    return Rows(np.empty(count, dtype=TOTALS), each, vectors)
