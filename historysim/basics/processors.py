"""How many processors there are, and how many threads use them."""

from historysim.basics.system import processors
from historysim.errors import InputError

MOST_THREADS = 4
"""Threads by default, at most: the walk of a replay, which is one thread, takes a quarter of its time or more."""


def threads_of(given: int | None) -> int:
    """Return how many threads are meant; by default one for each processor, up to `MOST_THREADS`.

    Raises
    ------
    InputError
        What is no number of threads.
    """
    if given is None:
        return min(processors(), MOST_THREADS)
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise InputError(f"threads is {given!r}; expected a whole number of 1 or more")
    return given
