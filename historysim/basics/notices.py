"""Notices and progress: what a function has to say beside its result."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Notify = Callable[[str], None]
"""Takes a notice, a sentence for the user."""


def silent(_: str) -> None:
    """Drop a notice."""


@contextmanager
def progress_bar(shown: bool, unit: str, total: int | None = None, **options: Any) -> Iterator[Callable[..., object]]:
    """Show a bar of tqdm where standard error is a terminal; yields what counts units, 1 by default."""
    if not (shown and sys.stderr is not None and sys.stderr.isatty()):
        yield lambda _=1: None
        return
    from tqdm import tqdm

    # tqdm's own lock is shared with forked processes: if one is killed while it has it, all others wait for ever
    tqdm.set_lock(threading.RLock())
    tqdm.monitor_interval = 0
    with tqdm(unit=unit, total=total, **options) as bar:
        yield bar.update
