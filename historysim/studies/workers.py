"""Where the cells of a sweep are computed: in this process, in several, or wherever an executor has its workers."""

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from typing import Any, ParamSpec, TypeVar, final

from historysim.errors import HistorySimError, InputError

P = ParamSpec("P")
T = TypeVar("T")

AHEAD = 2
"""Tasks that each worker is given before it has ended its first, so that none ever waits."""


@final
class InlineExecutor(Executor):
    """The process itself: a task is carried out when it is submitted."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Carry a task out."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - it is raised where the result is asked for
            future.set_exception(error)
        return future


def processes(count: int) -> ProcessPoolExecutor:
    """Return an executor of so many processes on this machine, which end when this one does, however it ends."""
    # a fork of a process with threads may hang; new ones import what they need once each
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, mp_context=context, initializer=_begin)


def _begin() -> None:
    """Make a process end with the one that started it, and leave it to that one to hear an interrupt."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)


WORKERS_OF_ANY = 256
"""Workers that an executor is taken to have, where it does not tell how many."""


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is not a whole number of 1 or more."""
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InputError(f"workers is {workers!r}; expected a whole number of 1 or more")


@contextlib.contextmanager
def executor_for(workers: int, given: object = None) -> Iterator[tuple[Executor, int]]:
    """Yield who computes, and how many: whoever is given, this process, or processes that end with the block."""
    check_workers(workers)
    if given is not None:
        yield as_executor(given), getattr(given, "_max_workers", WORKERS_OF_ANY)
    elif workers == 1:
        yield InlineExecutor(), 1
    else:
        with ending(processes(workers)) as own:
            yield own, workers


def as_executor(given: object) -> Executor:
    """Return an executor with the interface of concurrent.futures; a client of dask.distributed has one."""
    if isinstance(given, Executor):
        return given
    if hasattr(given, "get_executor"):
        # the same task may be given twice, and shall be carried out twice
        made: Executor = given.get_executor(pure=False)
        return made
    raise InputError(
        f"executor is {given!r}; expected an executor of concurrent.futures or mpi4py.futures, or a client of "
        "dask.distributed"
    )


@contextlib.contextmanager
def ending(executor: Executor) -> Iterator[Executor]:
    """End an executor with the block; where that ends with an error, tasks that have not begun are given up."""
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=True, cancel_futures=True)
        raise
    executor.shutdown()


def outcomes(
    function: Callable[[T], Any], tasks: Iterable[T], executor: Executor, at_once: int
) -> Iterator[tuple[T, Any]]:
    """Carry tasks out and yield each with its result, as they end.

    A `BrokenError` has the tasks that were under way when a process was ended from outside.
    """
    waiting, running = deque(tasks), dict[Future[Any], T]()
    while waiting or running:
        try:
            while waiting and len(running) < at_once:
                running[executor.submit(function, waiting[0])] = waiting[0]
                waiting.popleft()
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield running[future], future.result()
                del running[future]
        except BrokenExecutor as error:
            raise BrokenError([*running.values()], [*waiting]) from error


class BrokenError(HistorySimError):
    """A process that carried out tasks was ended from outside.

    Attributes
    ----------
    suspects : list
        Tasks that were under way.
    waiting : list
        Tasks that had not begun.
    """

    def __init__(self, suspects: list[Any], waiting: list[Any]) -> None:
        super().__init__(suspects, waiting)
        self.suspects, self.waiting = suspects, waiting

    def __str__(self) -> str:
        return "a process that computed was killed, perhaps for lack of memory; take fewer workers"
