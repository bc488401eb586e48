"""Types of arrays, and arguments of functions that take numbers in SI, checked, with messages that name them."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.basics.limits import LARGEST, SIZE
from historysim.basics.units import UNIT_OF, has_unit, in_si
from historysim.basics.wording import counted
from historysim.errors import InputError

Array = npt.NDArray[Any]
ArrayLike = npt.ArrayLike
Booleans = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
NAMED_STATES = "named_states"  # the attribute of a history with the times of its named states, as JSON
DIRECTION = "direction"  # the last dimension of a load or displacement in two tangential directions


class FrozenArrays:
    """A frozen attrs class with slots and read-only arrays, also after pickling and copying.

    numpy forgets on the way that an array is read-only. The class is made with ``getstate_setstate=False``, since attrs
    would else put its own method in the place of this one.
    """

    __slots__ = ()

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        for name, value in state[1].items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)


NUMBERS = "iufO"  # kinds of arrays that may hold numbers; of objects, fractions and the like


def _has_boolean(values: Any) -> bool:
    """Whether a boolean stands among the numbers of a list, where numpy takes it for 0 or 1."""
    if isinstance(values, list | tuple):
        return any(map(_has_boolean, values))
    return isinstance(values, bool | np.bool_)


def checked(name: str, values: ArrayLike, *, above: float = -math.inf, least: float = -math.inf) -> Floats:
    """Return an argument as finite floats above a number, and of a least one; anything else is an InputError.

    Strings with units and quantities of pint are converted, where `UNIT_OF` has the name.
    """
    if name in UNIT_OF or has_unit(values):
        try:
            values = in_si(values, UNIT_OF.get(name, "1"))
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
    try:
        given = np.asarray(values)
        # strings, booleans and complex numbers would become floats, too
        is_none = given.dtype.kind == "O" and any(each is None for each in given.ravel())
        result = None if is_none or given.dtype.kind not in NUMBERS else given.astype(np.float64, copy=False)
    except (TypeError, ValueError):
        result = None
    if result is None or _has_boolean(values):
        raise InputError(f"{name} is {values!r}; expected numbers in SI")
    good = np.isfinite(result) & (result >= least)
    if above > -math.inf:
        good &= result > above
    if not good.all():
        lowest = f" of {least:g} or more" if least > -math.inf else ""
        bound = f" greater than {above:g}" if above > -math.inf else lowest
        raise InputError(f"{name}{_first(~good)} is {result[~good][0]:g}; expected a finite number{bound}, in SI")
    return result


def _first(wrong: Booleans) -> str:
    """Return the place of the first value that is wrong: ``"[2, 3]"``; empty of a single number."""
    return f"[{', '.join(map(str, np.argwhere(wrong)[0]))}]" if wrong.ndim else ""


def scalar(name: str, value: ArrayLike, *, above: float = -math.inf, least: float = -math.inf) -> float:
    """Return an argument that is one number, as a float. Parameters and errors as in `checked`."""
    number = checked(name, value, above=above, least=least)
    if number.ndim:
        raise InputError(f"{name} is a list of shape {number.shape}; expected one number, in SI")
    return float(number)


def per_axis(name: str, values: ArrayLike) -> tuple[float, float]:
    """Return an argument that is a positive number along x and one along y; one number stands for both."""
    numbers = checked(name, values, above=0)
    if numbers.shape not in {(), (1,), (2,)}:
        raise InputError(f"{name} has shape {numbers.shape}; expected one number, or one for x and one for y")
    x, y = np.broadcast_to(numbers, 2)
    return float(x), float(y)


def one_per(
    one: str, several: str, name: str, values: ArrayLike, count: int | None = None, *, above: float = -math.inf
) -> Floats:
    """Return an argument with one value for each of several things, as a read-only array; one number stands for all.

    ``one`` and ``several`` name the things in messages; without ``count`` there are as many as values.
    """
    array = np.atleast_1d(checked(name, values, above=above))
    if array.ndim > 1:
        raise InputError(f"{name} has shape {array.shape}; expected one number, or a list with one per {one}")
    if count is not None and array.size not in {1, count}:
        found = counted(array.size, "value", "values")
        raise InputError(f"{name} has {found} for {counted(count, one, several)}; expected one, or one per {one}")
    array = np.array(array if count is None else np.broadcast_to(array, count))
    array.flags.writeable = False
    return array


def workable(name: str, values: ArrayLike, *, smallest: float = 0.0) -> Floats:
    """Return floats that are small enough, and at least ``smallest``, for their powers to be floats, too."""
    numbers: Floats = np.asarray(values)
    sizes = np.abs(numbers)
    wrong = (sizes > LARGEST) | (sizes < smallest)
    if wrong.any():
        least = f", and at least {smallest:g}" if smallest else ""
        raise InputError(
            f"{name}{_first(wrong)} is {numbers[wrong][0]:g}; expected {SIZE}{least}, in SI: powers of others are "
            "beyond what floats hold"
        )
    return numbers


@contextmanager
def representable() -> Iterator[None]:
    """Check that floats can hold what is computed inside: no overflow, no division by 0; else it is an InputError."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except ArithmeticError as error:
        raise InputError(
            "a number is so large or so small that its square, or a ratio to another, is beyond what floats hold; "
            "expected lengths in SI, such as 1e-6 for a micrometre"
        ) from error
