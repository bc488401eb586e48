"""Friction loops: a record split at the reversals of its tangential displacement, and what each loop says.

The same code reads measured records and simulated ones. The tangential displacement U and the load T that drives it
count positive in one direction, so that friction takes energy: ∮ T dU > 0. A *branch* leads from one reversal to the
next; on the forward one U rises, and T tends to +μN; on the backward one U falls, and T tends to -μN. Below, u and f
are displacement and load of a branch in its own direction, u = ±(U - U_reversal) and f = ±T, with + on the forward
branch, so that both branches look alike.

What is read off a branch, with the choices that `Definitions` has:

- **friction force** F: the mean of f over the displacement of the sliding part, ∫ f du / ∫ du. An offset of T moves it
  up on one branch and down on the other; the mean of both is free of it.
- **normal load** and **friction coefficient**: the mean of N over the same displacement, and F over it.
- **preliminary displacement**: u where f has first come a given share p of the way from the reversal to F. One asperity
  at constant normal load that slid before the reversal has 2 θμδ (1 - (1 - p)^(2/3)), which tends to 2 θμδ, twice the
  preliminary displacement of virgin loading (Masing).
- **stiffness** at the reversal: the slope of the least-squares line through the first part of the branch, of U over T
  where that part is told by the load, and of T over U where it is told by the displacement, so that noise of the other
  channel does not tilt it. It is less than k_t = 8 G* Σa by what the curve bends there.

and off a whole loop:

- **energy**: ∮ T dU by the trapezoidal rule through all samples, exact for a polyline, closed by a straight line from
  the end back to the start; **gaps** say how far those two are apart.
"""

import math
from typing import TYPE_CHECKING, Any, Literal

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import scalar
from historysim.basics.units import prefixed, quantity_text
from historysim.errors import InputError
from historysim.measured.reduction import channel, clock, turning_points

if TYPE_CHECKING:
    import xarray as xr

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Direction = Literal["forward", "backward", "both"]

DIRECTIONS: tuple[Direction, Direction] = ("forward", "backward")

# what each quantity is called, and its unit
BRANCH_QUANTITIES = {
    "friction_force": ("friction force", "N"),
    "normal_load": ("normal load", "N"),
    "friction_coefficient": ("friction coefficient", "1"),
    "preliminary_displacement": ("preliminary displacement", "m"),
    "tangential_stiffness": ("stiffness at reversal", "N m-1"),
}
LOOP_QUANTITIES = {
    "dissipated_energy": ("energy per loop", "J"),
    "displacement_gap": ("gap in displacement", "m"),
    "tangential_load_gap": ("gap in tangential load", "N"),
}

WRONG_WAY = -0.05


def _share(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    name = f"{attribute.name} of {type(owner).__name__}"
    if not 0 < scalar(name, value) < 1:
        raise InputError(f"{name} is {value:g}; expected a share, between 0 and 1")


def _length(owner: object, attribute: "attrs.Attribute[float]", value: float) -> None:
    scalar(f"{attribute.name} of {type(owner).__name__}", value, above=0)


def _one_of(*kinds: type) -> Any:
    names = " or ".join(kind.__name__ for kind in kinds)

    def check(owner: object, attribute: "attrs.Attribute[Any]", value: object) -> None:
        if not isinstance(value, kinds):
            raise InputError(f"{attribute.name} of {type(owner).__name__} is {value!r}; expected {names}")

    return check


@attrs.frozen
class LastPart:
    """Sliding part of a branch: its last part, by displacement.

    Parameters
    ----------
    share : float
        Of the displacement of the branch, between 0 and 1.
    """

    share: float = attrs.field(default=0.25, validator=_share)

    def __str__(self) -> str:
        return f"the last {self.share:.3g} of the displacement of a branch"


@attrs.frozen
class Plateau:
    """Sliding part of a branch: from where the load has first come near its greatest value, on to the end.

    Parameters
    ----------
    share : float
        How much of the way from the reversal to the greatest load has been covered there, between 0 and 1.
    """

    share: float = attrs.field(default=0.95, validator=_share)

    def __str__(self) -> str:
        return f"from {self.share:.3g} of the way between the load at the reversal and the greatest load of a branch"


@attrs.frozen
class FirstLoad:
    """First part of a branch: until the load has covered a share of the way from the reversal to the friction force.

    Parameters
    ----------
    share : float
        Between 0 and 1.
    """

    share: float = attrs.field(default=0.2, validator=_share)

    def __str__(self) -> str:
        return f"until {self.share:.3g} of the way between the load at the reversal and the friction force"


@attrs.frozen
class FirstDisplacement:
    """First part of a branch: until it is a length away from the reversal.

    Parameters
    ----------
    length : float
        [m].
    """

    length: float = attrs.field(validator=_length)

    def __str__(self) -> str:
        return f"the first {self.length:.3g} m of a branch"


@attrs.frozen
class Definitions:
    """What is taken for sliding, for reached, and for the beginning of a branch.

    Parameters
    ----------
    sliding : LastPart or Plateau
        The part of a branch that the friction force is the mean of.
    reached : float
        The share of the way between the load at the reversal and the friction force that ends the preliminary
        displacement, between 0 and 1.
    initial : FirstLoad or FirstDisplacement
        The part of a branch that the stiffness is the slope of.
    """

    sliding: LastPart | Plateau = attrs.field(factory=LastPart, validator=_one_of(LastPart, Plateau))
    reached: float = attrs.field(default=0.95, validator=_share)
    initial: FirstLoad | FirstDisplacement = attrs.field(
        factory=FirstLoad, validator=_one_of(FirstLoad, FirstDisplacement)
    )


DEFAULT = Definitions()


@attrs.frozen
class Statistics:
    """Mean and scatter of one quantity over the loops.

    Attributes
    ----------
    mean : float
        NaN where no loop has a value.
    standard_deviation : float
        Of one loop, with count - 1 in the denominator; NaN for fewer than two.
    count : int
        The loops that have a value.
    """

    mean: float
    standard_deviation: float
    count: int


@attrs.frozen(eq=False)
class Record:
    """Channels over time, each an array (sample); the normal load is None where it is not known.

    Attributes
    ----------
    time : array (sample)
        Rising [s].
    displacement : array (sample)
        Tangential displacement U [m].
    tangential_load : array (sample)
        T [N], positive in the direction of U.
    normal_load : array (sample) or None
        N [N].
    """

    time: Floats
    displacement: Floats
    tangential_load: Floats
    normal_load: Floats | None


@attrs.frozen(eq=False)
class Loops:
    """The loops of a record, from `find_loops`.

    Quantities of branches are arrays (loop, direction) with the forward branch first; NaN where a branch has no value.

    Attributes
    ----------
    record : Record
    definitions : Definitions
    number : array of int (loop)
        Which loop of the record each one is, from 0.
    ends : array of int (loop, 3)
        The samples at which each loop begins, turns back, and ends.
    left_out : tuple of (int, int)
        Pieces of the record at its beginning and its end, from sample to sample, that are no part of a loop.
    friction_force : array (loop, direction)
        [N], positive.
    normal_load : array (loop, direction)
        Mean over the sliding part [N].
    friction_coefficient : array (loop, direction)
        [1].
    preliminary_displacement : array (loop, direction)
        From the reversal [m].
    tangential_stiffness : array (loop, direction)
        At the reversal [N/m].
    dissipated_energy : array (loop)
        ∮ T dU [J].
    displacement_gap, tangential_load_gap : array (loop)
        U [m] and T [N] at the end of the loop less those at its start.
    """

    record: Record = attrs.field(repr=False)
    definitions: Definitions
    number: Integers
    ends: Integers
    left_out: tuple[tuple[int, int], ...]
    friction_force: Floats
    normal_load: Floats
    friction_coefficient: Floats
    preliminary_displacement: Floats
    tangential_stiffness: Floats
    dissipated_energy: Floats
    displacement_gap: Floats
    tangential_load_gap: Floats

    def __len__(self) -> int:
        """Return the number of loops."""
        return self.number.size

    def statistics(self, quantity: str, direction: Direction = "both") -> Statistics:
        """Return mean and scatter of a quantity over the loops.

        Parameters
        ----------
        quantity : str
            The name of one of the arrays.
        direction : {"forward", "backward", "both"}
            For quantities of branches. "both" takes the mean of the two branches of each loop first.

        Raises
        ------
        InputError
            Another name.
        """
        if direction not in {*DIRECTIONS, "both"}:
            raise InputError(f"direction is {direction!r}; expected 'forward', 'backward' or 'both'")
        if quantity not in {**BRANCH_QUANTITIES, **LOOP_QUANTITIES}:
            raise InputError(
                f"quantity is {quantity!r}; expected one of {', '.join([*BRANCH_QUANTITIES, *LOOP_QUANTITIES])}"
            )
        values: Floats = getattr(self, quantity)
        if values.ndim == 2:
            values = values.mean(axis=1) if direction == "both" else values[:, DIRECTIONS.index(direction)]
        values = values[np.isfinite(values)]
        return Statistics(
            mean=float(values.mean()) if values.size else math.nan,
            standard_deviation=float(values.std(ddof=1)) if values.size > 1 else math.nan,
            count=values.size,
        )

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Return the summary as a table of texts: quantity, forward, backward, both; the first row is the heading.

        Values are mean ± standard deviation over the loops, and the largest of the gaps without its sign.
        """
        table: list[tuple[str, str, str, str]] = [("quantity", *DIRECTIONS, "both")]
        for name, (label, unit) in BRANCH_QUANTITIES.items():
            forward, backward = (self.text(name, unit, direction) for direction in DIRECTIONS)
            table.append((label, forward, backward, self.text(name, unit, "both")))
        for name, (label, unit) in LOOP_QUANTITIES.items():
            if name.endswith("_gap"):
                text = quantity_text(float(np.abs(getattr(self, name)).max()), unit)
                table.append((f"largest {label}", "", "", text))
            else:
                table.append((label, "", "", self.text(name, unit, "both")))
        skipped = f", {self.number[0]} before them skipped" if self.number[0] else ""
        table.append(("loops", "", "", f"{len(self)}{skipped}"))
        return table

    def to_dataset(self) -> "xr.Dataset":
        """Return all quantities as a Dataset with the dimensions loop and direction, and the definitions in words."""
        import xarray as xr

        time = self.record.time
        variables = {
            name: (dims, getattr(self, name), {"long_name": label, "units": unit})
            for dims, table in ((("loop", "direction"), BRANCH_QUANTITIES), (("loop",), LOOP_QUANTITIES))
            for name, (label, unit) in table.items()
        }
        return xr.Dataset(
            variables,
            coords={
                "loop": ("loop", self.number, {"long_name": "loop of the record, from 0"}),
                "direction": ("direction", list(DIRECTIONS)),
                "start_time": ("loop", time[self.ends[:, 0]], {"long_name": "start of the loop", "units": "s"}),
                "end_time": ("loop", time[self.ends[:, 2]], {"long_name": "end of the loop", "units": "s"}),
            },
            attrs={
                "title": f"{len(self)} friction loops",
                "sliding_part": str(self.definitions.sliding),
                "preliminary_displacement_reached_at": self.definitions.reached,
                "initial_part": str(self.definitions.initial),
            },
        )

    def text(self, quantity: str, unit: str, direction: Direction = "both") -> str:
        """Return mean ± standard deviation of a quantity as a text; parameters and errors as in `statistics`."""
        found = self.statistics(quantity, direction)
        if found.count == 0:
            return "–"
        factor, prefix = prefixed(found.mean) if unit != "1" else (1.0, "")
        # a scatter at the level of rounding is none
        spread = found.standard_deviation if found.standard_deviation > 1e-12 * abs(found.mean) else 0.0
        scatter = f" ± {spread * factor:.2g}" if found.count > 1 else ""
        symbol = {"1": "", "N m-1": f" {prefix}N/m"}.get(unit, f" {prefix}{unit}")
        some = f" (of {found.count})" if found.count < len(self) else ""
        return f"{found.mean * factor:.4g}{scatter}{symbol}{some}"


def find_loops(
    time: npt.ArrayLike,
    displacement: npt.ArrayLike,
    tangential_load: npt.ArrayLike,
    normal_load: npt.ArrayLike | None = None,
    *,
    dead_band: float,
    skip: int = 0,
    definitions: Definitions = DEFAULT,
) -> Loops:
    """Split a record into friction loops and read off what each of them says.

    A loop is two branches, one forward and one backward, that follow each other between three reversals; loops do not
    overlap. The branch from the start of the record to its first reversal, often that of virgin loading, and the one
    from its last reversal to the end of the record belong to a loop only if that loop closes: if the displacements at
    its two ends differ by no more than the dead band.

    Parameters
    ----------
    time : array_like (sample)
        Rising [s].
    displacement : array_like (sample)
        Tangential displacement U [m].
    tangential_load : array_like (sample)
        T [N], positive in the direction of U.
    normal_load : array_like (sample) or float, optional
        N [N].
    dead_band : float
        The smallest swing of U that counts as a reversal [m], 0 or more: a few times its noise, and well below its
        amplitude. See `turning_points`.
    skip : int
        How many loops at the start are left out.
    definitions : Definitions

    Returns
    -------
    Loops

    Raises
    ------
    InputError
        Missing or infinite samples, times that do not rise, channels of different lengths, no loop, or loops that run
        the wrong way round.
    """
    moved = channel("displacement", displacement)
    load = channel("tangential_load", tangential_load, moved.size)
    times = clock(time, moved.size)
    pressed = None
    if normal_load is not None:
        given = np.full(moved.size, normal_load) if np.ndim(normal_load) == 0 else normal_load
        pressed = channel("normal_load", given, moved.size)
    if not isinstance(definitions, Definitions):
        raise InputError(f"definitions is {definitions!r}; expected Definitions(...)")
    ends = _loop_ends(moved, dead_band)
    if scalar("skip", skip) % 1 or not 0 <= skip < len(ends):
        raise InputError(
            f"the record has {len(ends)} whole loops at a dead band of {dead_band:g} m, of which {skip} are left out; "
            "expected one or more to be left: lower dead_band or skip, or take a longer record"
        )
    left_out = tuple(
        piece for piece in ((0, int(ends[0, 0])), (int(ends[-1, 2]), moved.size - 1)) if piece[0] < piece[1]
    )
    number = np.arange(int(skip), len(ends))
    ends = ends[number]

    energy = np.array([_enclosed(moved[start : end + 1], load[start : end + 1]) for start, _, end in ends])
    _check_sense(energy, moved[ends], load[ends])
    branches = np.full((len(ends), 2, len(BRANCH_QUANTITIES)), math.nan)
    for loop, (start, turn, end) in enumerate(ends):
        for first, last in ((start, turn), (turn, end)):
            backward = moved[last] < moved[first]
            sign = -1.0 if backward else 1.0
            part = slice(first, last + 1)
            branches[loop, int(backward)] = _branch(
                sign * (moved[part] - moved[first]),
                sign * load[part],
                None if pressed is None else pressed[part],
                definitions,
            )
    return Loops(
        Record(times, moved, load, pressed),
        definitions,
        number,
        ends,
        left_out,
        **dict(zip(BRANCH_QUANTITIES, np.moveaxis(branches, -1, 0), strict=True)),
        dissipated_energy=energy,
        displacement_gap=moved[ends[:, 2]] - moved[ends[:, 0]],
        tangential_load_gap=load[ends[:, 2]] - load[ends[:, 0]],
    )


def _loop_ends(displacement: Floats, dead_band: float) -> Integers:
    """Return the first, middle and last sample of each loop, (loop, 3)."""
    kept = turning_points(displacement, dead_band)
    swings = np.abs(np.diff(displacement[kept]))
    branches = np.flatnonzero((swings > 0) & (swings >= dead_band))
    if branches.size < 2:
        return np.empty((0, 3), dtype=np.int64)
    # only the first and the last swing may be too small to be a branch
    turns = kept[branches[0] : branches[-1] + 2]
    triples = np.column_stack([turns[:-2], turns[1:-1], turns[2:]])
    closed = np.abs(displacement[triples[:, 2]] - displacement[triples[:, 0]]) <= dead_band
    loops = triples[0 if closed[0] else 1 :: 2]
    return loops[:-1] if loops.size and loops[-1, 2] == turns[-1] and not closed[-1] else loops


def _check_sense(energy: Floats, displacement: Floats, load: Floats) -> None:
    """Refuse loops, given by U and T at their ends, that give energy instead of taking it."""
    box = np.ptp(displacement, axis=1) * np.ptp(load, axis=1)
    if energy.sum() < WRONG_WAY * box.sum():
        raise InputError(
            f"the loops run the wrong way round: friction would give {-energy.mean():.4g} J per loop instead of taking "
            "it; expected displacement and tangential_load positive in one direction: reverse one of the two, with a "
            "scale of -1"
        )


def _branch(u: Floats, f: Floats, normal: Floats | None, definitions: Definitions) -> tuple[float, ...]:
    """Return the quantities of one branch, in its own direction, in the order of BRANCH_QUANTITIES."""
    sliding, initial = definitions.sliding, definitions.initial
    if isinstance(sliding, LastPart):
        slides_from = _crossing(u, (1 - sliding.share) * u[-1])
    else:
        slides_from = _crossing(f, f[0] + sliding.share * (f.max() - f[0]))
    force = _mean_from(slides_from, u, f)
    load = math.nan if normal is None else _mean_from(slides_from, u, normal)
    rise = force - f[0]
    preliminary = stiffness = math.nan
    if rise > 0:
        preliminary = _at(_crossing(f, f[0] + definitions.reached * rise), u)
        if isinstance(initial, FirstLoad):
            stiffness = 1 / _slope(_crossing(f, f[0] + initial.share * rise), f, u)
        else:
            stiffness = _slope(_crossing(u, initial.length), u, f)
    return force, load, force / load if load > 0 else math.nan, preliminary, stiffness


def _crossing(values: Floats, level: float) -> float:
    """Return where values first reach a level, as a sample number with a fraction; NaN where they never do."""
    above = values >= level
    first = int(above.argmax())
    if not above[first]:
        return math.nan
    if first == 0:
        return 0.0
    low, high = values[first - 1], values[first]
    return first - 1 + float((level - low) / (high - low))


def _at(place: float, values: Floats) -> float:
    if math.isnan(place):
        return math.nan
    before = min(int(place), values.size - 2)
    return float(values[before] + (place - before) * (values[before + 1] - values[before]))


def _mean_from(place: float, u: Floats, values: Floats) -> float:
    """Return the mean of values over the displacement from a place on to the end."""
    after = math.ceil(place)
    along = np.append(_at(place, u), u[after:])
    heights = np.append(_at(place, values), values[after:])
    length = along[-1] - along[0]
    return float(_area(along, heights) / length) if length > 0 else float(heights[-1])


def _slope(place: float, x: Floats, y: Floats) -> float:
    """Return the least-squares slope of y over x in the samples up to a place; NaN where it is not positive."""
    count = 0 if math.isnan(place) else int(place) + 1
    across = x[:count] - x[:count].mean() if count else x[:0]
    slope = float(across @ y[:count])
    return slope / float(across @ across) if slope > 0 else math.nan


def _area(u: Floats, f: Floats) -> float:
    return float(np.diff(u) @ (f[1:] + f[:-1])) / 2


def _enclosed(u: Floats, f: Floats) -> float:
    """Return the area of a loop, closed by a straight line."""
    return _area(u, f) + float((u[0] - u[-1]) * (f[0] + f[-1])) / 2
