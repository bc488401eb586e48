"""Where the cells of a sweep are computed: in this process, in several, or wherever an executor has its workers."""

import contextlib
import functools
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from typing import Any, ParamSpec, TypeVar, final

from historysim.errors import HistorySimError, InputError

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

AHEAD = 2  # tasks that each worker is given before it has ended its first, so that none ever waits


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


@final
class Processes(ProcessPoolExecutor):
    """Processes on this machine, which end when this one does, however it ends, or gives them up."""

    def __init__(self, count: int) -> None:
        # a fork of a process with threads may hang; new ones import what they need once each
        context = multiprocessing.get_context("spawn")
        self._given_up, self._alive = context.Pipe(duplex=False)
        super().__init__(count, mp_context=context, initializer=_begin, initargs=(self._given_up,))

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Submit a task; an interrupt is for this process alone, also while others start."""
        with _without_interrupts():
            return super().submit(fn, *args, **kwargs)

    def give_up(self) -> None:
        """End the processes at once."""
        self._alive.close()


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Have an interrupt wait, for this thread and for processes that it starts."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(given_up: multiprocessing.connection.Connection) -> None:
    """Let a process end with the one that started it, which alone takes interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel, given_up), daemon=True).start()


def _end_with(*sentinels: "int | multiprocessing.connection.Connection") -> None:
    multiprocessing.connection.wait(sentinels)
    os._exit(1)


WORKERS_OF_ANY = 256  # workers that are assumed for an executor without a number of them


def check_workers(workers: int) -> None:
    """Check that a number of workers is a whole number of 1 or more."""
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise InputError(f"workers is {workers!r}; expected a whole number of 1 or more")


@contextlib.contextmanager
def executor_for(workers: int, given: object = None) -> Iterator[tuple[Executor, int]]:
    """Yield an executor and its number of workers: the given one, this process, or processes of the block."""
    check_workers(workers)
    if given is not None:
        yield _as_executor(given), getattr(given, "_max_workers", WORKERS_OF_ANY)
    elif workers == 1:
        yield InlineExecutor(), 1
    else:
        with ending(Processes(workers)) as own:
            yield own, workers


def _as_executor(given: object) -> Executor:
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
    """Shut an executor down with the block: after an error without tasks that wait, after an interrupt at once."""
    try:
        yield executor
    except BaseException as error:
        if isinstance(executor, Processes) and not isinstance(error, Exception):
            executor.give_up()
        executor.shutdown(wait=True, cancel_futures=True)
        raise
    executor.shutdown()


def outcomes(
    function: Callable[[T], Any], tasks: Iterable[T], executor: Executor, at_once: int
) -> Iterator[tuple[T, Any]]:
    """Yield each task with its result, as they end; `BrokenError` where a process was killed."""
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


def in_order(
    function: Callable[[T], R], tasks: Sequence[T], executor: Executor, workers: int, done: Callable[[], object]
) -> list[R]:
    """Return the results of tasks in their order, and call `done` as each ends."""
    found: dict[int, R] = {}
    numbered = functools.partial(_of_numbered, function)
    for (index, _), result in outcomes(numbered, enumerate(tasks), executor, AHEAD * workers):
        found[index] = result
        done()
    return [found[index] for index in range(len(tasks))]


def _of_numbered(function: Callable[[T], R], task: tuple[int, T]) -> R:
    return function(task[1])


class BrokenError(HistorySimError):
    """A process that carried out tasks was killed."""

    def __init__(self, suspects: list[Any], waiting: list[Any]) -> None:
        super().__init__(suspects, waiting)
        self.suspects, self.waiting = suspects, waiting
        """suspects and waiting: the tasks that were under way, and those that had not begun."""

    def __str__(self) -> str:
        return "a process that computed was killed, perhaps for lack of memory; take fewer workers"
