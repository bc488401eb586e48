"""Execution of the cells of a sweep: in this process, in several processes, or by an executor."""

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from typing import ParamSpec, TypeVar, final

from historysim.errors import HistorySimError, InputError

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

WORKERS_OF_ANY = 256  # workers that are assumed for an executor without a number of them
AHEAD = 2  # tasks submitted for each worker, so that none waits


class BrokenError(HistorySimError):
    """A process that carried out tasks was killed."""


@final
class Processes(ProcessPoolExecutor):
    """Processes on this machine, which end with this process in any case, or when they are released."""

    def __init__(self, count: int) -> None:
        # a fork of a process with threads may hang; each new process imports its modules once
        context = multiprocessing.get_context("spawn")
        self._released, self._alive = context.Pipe(duplex=False)
        super().__init__(count, mp_context=context, initializer=_begin, initargs=(self._released,))

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Submit a task; an interrupt is for this process alone, also while others start."""
        with _without_interrupts():
            return super().submit(fn, *args, **kwargs)

    def release(self) -> None:
        """End the processes immediately."""
        self._alive.close()


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Delay interrupts of this thread and of processes that it starts."""
    if sys.platform == "win32":
        yield
        return
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _begin(released: multiprocessing.connection.Connection) -> None:
    """End a process with its parent, which alone handles interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel, released), daemon=True).start()


def _end_with(*sentinels: "int | multiprocessing.connection.Connection") -> None:
    multiprocessing.connection.wait(sentinels)
    os._exit(1)


@contextlib.contextmanager
def open_executor(
    workers: int, executor: object = None, *, apart: bool = False
) -> Iterator[tuple[Executor | None, int]]:
    """Yield an executor and its number of workers: the given one, or processes of the block; None is this process.

    With ``apart`` even a single worker is a separate process. InputError unless the number of
    workers is 1 or more.
    """
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InputError(f"workers is {workers!r}; expected a whole number of 1 or more")
    if isinstance(executor, Executor):
        yield executor, getattr(executor, "_max_workers", WORKERS_OF_ANY)
    elif hasattr(executor, "get_executor"):
        # a client of dask.distributed; a task that is submitted twice is executed
        # twice
        yield executor.get_executor(pure=False), WORKERS_OF_ANY
    elif executor is not None:
        expected = (
            "an executor of concurrent.futures or mpi4py.futures, or a client of dask.distributed"
        )
        raise InputError(f"executor is {executor!r}; expected {expected}")
    elif workers == 1 and not apart:
        yield None, 1
    else:
        with ending(Processes(workers)) as processes:
            yield processes, workers


@contextlib.contextmanager
def ending(executor: Executor) -> Iterator[Executor]:
    """Shut an executor down with the block: after an error without pending tasks, after an interrupt immediately."""
    try:
        yield executor
    except BaseException as error:
        if isinstance(executor, Processes) and not isinstance(error, Exception):
            executor.release()
        executor.shutdown(wait=True, cancel_futures=True)
        raise
    executor.shutdown()


def outcomes(
    function: Callable[[T], R], tasks: Sequence[T], executor: Executor | None, at_once: int
) -> Iterator[tuple[int, R]]:
    """Yield the index of each task with its result, as they end; `BrokenError` if a process was killed."""
    if executor is None:
        yield from enumerate(map(function, tasks))
        return
    waiting, running = deque(enumerate(tasks)), dict[Future[R], int]()
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                index, task = waiting[0]
                running[executor.submit(function, task)] = index
                waiting.popleft()
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            # tasks that ended before a process was killed come first
            for future in sorted(done, key=lambda finished: finished.exception() is not None):
                yield running[future], future.result()
                del running[future]
    except BrokenExecutor as error:
        raise BrokenError(
            "a process was killed, perhaps for lack of memory; use fewer workers"
        ) from error


def map_in_order(
    function: Callable[[T], R],
    tasks: Sequence[T],
    executor: Executor | None,
    workers: int,
    done: Callable[[], object],
) -> list[R]:
    """Return the results of tasks in their order, and call `done` as each ends."""
    results: dict[int, R] = {}
    for index, result in outcomes(function, tasks, executor, AHEAD * workers):
        results[index] = result
        done()
    return [results[index] for index in range(len(tasks))]
