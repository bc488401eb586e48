"""A bar on standard error that says how far something is: tqdm's, without the lock and the thread beside it."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def progress_bar(shown: bool, unit: str, total: int | None = None, **options: Any) -> Iterator[Callable[..., object]]:
    """Show how much is done, where standard error is a terminal; elsewhere nothing is made at all.

    Parameters
    ----------
    shown : bool
        Whether it is asked for.
    unit : str
        What is counted.
    total : int, optional
        How many there are, if that is known.
    options
        Of tqdm: ``desc``, ``initial``, ``delay``, ``leave``.

    Yields
    ------
    callable
        Is told each time how many more are done, 1 by default.
    """
    if not (shown and sys.stderr is not None and sys.stderr.isatty()):
        yield _unseen
        return
    from tqdm import tqdm

    class Bar(tqdm):  # type: ignore[misc] # it has no types
        # tqdm's own lock is one of processes: whoever is killed while he has it makes all others wait for ever
        _lock = threading.RLock()
        monitor_interval = 0

    with Bar(unit=unit, total=total, **options) as bar:
        yield bar.update


def _unseen(_: int = 1) -> None:
    """Count nothing."""
