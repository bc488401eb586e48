"""Where an error belongs in what was given: names and indices, which gather at the error on its way out."""

from collections.abc import Iterator
from contextlib import contextmanager

from historysim.errors import InputError


@contextmanager
def at(*place: str | int) -> Iterator[None]:
    """Note at an InputError raised inside that it belongs to this place."""
    try:
        yield
    except InputError as error:
        error.place = (*place, *error.place)
        raise


def misfit(problem: str, *place: str | int) -> InputError:
    """Return an InputError that belongs to a place inside the value that is being read."""
    error = InputError(problem)
    error.place = place
    return error
