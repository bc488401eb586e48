"""Array types, and checks of numeric arguments in SI with messages that name the argument."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.basics.limits import LARGEST, SIZE
from historysim.basics.units import UNIT_OF, has_unit, to_si
from historysim.basics.wording import count_text
from historysim.errors import InputError

Array = npt.NDArray[Any]
ArrayLike = npt.ArrayLike
Booleans = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
# the attribute of a history with the times of its named states, as JSON
NAMED_STATES = "named_states"
DIRECTION = "direction"  # the last dimension of a load or displacement in two tangential directions


class FrozenArrays:
    """A frozen attrs class with slots and read-only arrays, also after pickling and copying.

    numpy does not preserve the read-only flag when it pickles an array. The class needs
    ``getstate_setstate=False``, since attrs would otherwise replace this method.
    """

    __slots__ = ()

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        for name, value in state[1].items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)


NUMBERS = "iufO"  # kinds of dtypes that may contain numbers; objects may be fractions or decimals


def _has_boolean(values: Any) -> bool:
    """Return True if a list contains a boolean, which numpy would convert to 0 or 1."""
    if isinstance(values, list | tuple):
        return any(map(_has_boolean, values))
    return isinstance(values, bool | np.bool_)


def as_floats(
    name: str, values: ArrayLike, *, above: float = -math.inf, least: float = -math.inf
) -> Floats:
    """Convert an argument to finite floats greater than ``above`` and not less than ``least``; otherwise InputError.

    Strings with units and pint quantities are converted if `UNIT_OF` contains the name.
    """
    if name in UNIT_OF or has_unit(values):
        try:
            values = to_si(values, UNIT_OF.get(name, "1"))
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
    try:
        array = np.asarray(values)
        # strings, booleans and complex numbers would become floats, too
        is_none = array.dtype.kind == "O" and any(element is None for element in array.ravel())
        result = (
            None
            if is_none or array.dtype.kind not in NUMBERS
            else array.astype(np.float64, copy=False)
        )
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
        raise InputError(
            f"{name}{_first_index(~good)} is {result[~good][0]:g}; expected a finite number{bound}, in SI"
        )
    return result


def _first_index(wrong: Booleans) -> str:
    """Return the index of the first wrong value: ``"[2, 3]"``; empty for a single number."""
    return f"[{', '.join(map(str, np.argwhere(wrong)[0]))}]" if wrong.ndim else ""


def scalar(
    name: str, value: ArrayLike, *, above: float = -math.inf, least: float = -math.inf
) -> float:
    """Convert an argument to one float. Parameters and errors as in `as_floats`."""
    number = as_floats(name, value, above=above, least=least)
    if number.ndim:
        raise InputError(f"{name} is a list of shape {number.shape}; expected one number, in SI")
    return float(number)


def per_axis(name: str, values: ArrayLike) -> tuple[float, float]:
    """Convert an argument to two positive numbers, along x and y; one number sets both."""
    numbers = as_floats(name, values, above=0)
    if numbers.shape not in {(), (1,), (2,)}:
        raise InputError(
            f"{name} has shape {numbers.shape}; expected one number, or one for x and one for y"
        )
    x, y = np.broadcast_to(numbers, 2)
    return float(x), float(y)


def as_item_array(
    one: str,
    several: str,
    name: str,
    values: ArrayLike,
    count: int | None = None,
    *,
    above: float = -math.inf,
) -> Floats:
    """Convert an argument to a read-only array with one value per item; one number applies to all items.

    ``one`` and ``several`` are the noun of an item in messages; without ``count`` the number of
    values defines it.
    """
    array = np.atleast_1d(as_floats(name, values, above=above))
    if array.ndim > 1:
        raise InputError(
            f"{name} has shape {array.shape}; expected one number, or a list with one per {one}"
        )
    if count is not None and array.size not in {1, count}:
        size = count_text(array.size, "value", "values")
        raise InputError(
            f"{name} has {size} for {count_text(count, one, several)}; expected one, or one per {one}"
        )
    array = np.array(array if count is None else np.broadcast_to(array, count))
    array.flags.writeable = False
    return array


def workable(name: str, values: ArrayLike, *, smallest: float = 0.0) -> Floats:
    """Return floats whose powers can be represented: at most `LARGEST` and at least ``smallest`` in size."""
    numbers: Floats = np.asarray(values)
    sizes = np.abs(numbers)
    wrong = (sizes > LARGEST) | (sizes < smallest)
    if wrong.any():
        lower_limit = f", and at least {smallest:g}" if smallest else ""
        raise InputError(
            f"{name}{_first_index(wrong)} is {numbers[wrong][0]:g}; expected {SIZE}{lower_limit}, in SI: powers of "
            "others are beyond the range of floats"
        )
    return numbers


@contextmanager
def representable() -> Iterator[None]:
    """Turn floating-point overflow and division by 0 inside the block into an InputError."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except ArithmeticError as error:
        raise InputError(
            "a number is so large or so small that its square, or a ratio to another, is beyond what floats hold; "
            "expected lengths in SI, such as 1e-6 for a micrometre"
        ) from error
