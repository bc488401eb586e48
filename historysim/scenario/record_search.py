"""Find loops, or sliding friction, in a history, a measurement, a scenario, or a file of them."""

import functools
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import attrs
import xarray as xr

from historysim.asperities.instrument import RIGID
from historysim.basics.places import at
from historysim.errors import InputError
from historysim.measured.branches import DEFAULT, Definitions
from historysim.measured.loops import Loops, loops_of_history, loops_of_measurement
from historysim.measured.measurement import Measurement
from historysim.measured.sliding import Over, Sliding, sliding_of_history, sliding_of_measurement
from historysim.results.result_files import kind_of, open_result
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import given, reported

Record = xr.Dataset | Measurement | Scenario | str | Path
Opened = Iterator[tuple[xr.Dataset | Measurement, Scenario | None]]


def loops(
    record: Record,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: Definitions | None = None,
) -> Loops:
    """Return the friction loops of a record, measured or simulated.

    Parameters
    ----------
    record : xarray.Dataset, Measurement, Scenario or path
        A history; a measurement; a scenario that replays one; or the file of a scenario (TOML) or a result (netCDF).
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts as a reversal [m]; by default that of the
        measurement or its scenario, else 5 % of the range of the displacement.
    skip : int
        Loops at the start that are left out.
    skip_per_level : int
        Loops that are left out at the start of each series at one normal load.
    definitions : Definitions, optional
        What is taken for sliding, for reached, and for the beginning of a branch.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, a record without a whole loop, or with loops that run the wrong way
        round.

    Examples
    --------
    >>> loops = hs.loops("scenarios/15_instrument_in_series.toml")
    >>> len(loops)
    8
    """
    options: dict[str, Any] = {
        "dead_band": dead_band,
        "skip": skip,
        "skip_per_level": skip_per_level,
        "definitions": DEFAULT if definitions is None else definitions,
    }

    with _opened(record) as (channels, scenario):
        if isinstance(channels, xr.Dataset):
            return loops_of_history(channels, **options)
        stiffness = RIGID.stiffness if scenario is None else scenario.instrument.stiffness
        found = loops_of_measurement(channels, lateral_stiffness=stiffness, **options)
        return found if scenario is None else attrs.evolve(found, columns=_question(scenario))


def sliding(record: Record, *, over: Over | None = None, windows: int = 50) -> Sliding:
    """Return friction over time or distance of a record that slides one way, measured or simulated.

    Parameters
    ----------
    record
        As for `loops`.
    over : {"time", "distance"}, optional
        What friction is given over; by default the distance where the displacement is known.
    windows : int
        How many windows of equal length.

    Returns
    -------
    Sliding
        Means per window, the static peak, and the approach to the steady value.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, or a record that turns back or never presses.
    """
    with _opened(record) as (channels, _):
        if isinstance(channels, xr.Dataset):
            return sliding_of_history(channels, over=over, windows=windows)
        return sliding_of_measurement(channels, over=over, windows=windows)


@functools.singledispatch
def _opened(record: object) -> AbstractContextManager[tuple[xr.Dataset | Measurement, Scenario | None]]:
    """Give a history or a measurement by the kind of record, and the scenario of a measurement."""
    raise InputError(
        f"{record!r}: cannot be evaluated; expected a history (Dataset), a Measurement, a Scenario, or the path of a "
        "scenario or a result"
    )


@_opened.register(xr.Dataset)
@_opened.register(Measurement)
@contextmanager
def _(record: xr.Dataset | Measurement) -> Opened:
    yield record, None


@_opened.register(Scenario)
@contextmanager
def _(record: Scenario) -> Opened:
    measurement = record.measurement()
    with reported(record.path.name), at("loading"):
        yield measurement, record


@_opened.register(str)
@_opened.register(Path)
@contextmanager
def _(record: str | Path) -> Opened:
    path = Path(record)
    match kind_of(path):
        case "result":
            with open_result(path) as history:
                yield history, None
        case "scenario":
            with _opened(load(path)) as opened:
                yield opened
        case "log":
            raise InputError(
                f"{path}: is the log of a run; expected its result, which historysim run {path} makes again, or a "
                "scenario (.toml)"
            )
        case _:
            raise InputError(f"{path}: is no scenario (.toml) and no result of historysim run; expected one of them")


def _question(scenario: Scenario) -> str:
    """Return the columns that were read, as a question whether they are right."""
    loading = scenario.measured_loading()
    channels = {**given(loading.columns), **given(loading.response)}
    used = [
        f"{name} = {' and '.join(repr(source.column) for source in channels[name].sources)}"
        for name in ("tangential_load", "tangential_displacement")
        if name in channels
    ]
    return f"are the columns right, {' and '.join(used)}? historysim columns {loading.files[0]} shows what there is"


def _earlier(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function under its earlier name, which warns."""

    @functools.wraps(function)
    def called(*args: Any, **options: Any) -> Any:  # noqa: ANN401 - of the function
        own = function.__name__
        warnings.warn(f"hs.{name} is called hs.{own} now, as its command is", DeprecationWarning, stacklevel=2)
        return function(*args, **options)

    return called


find_loops, find_sliding = _earlier("find_loops", loops), _earlier("find_sliding", sliding)
