"""Loops, or friction over time, of whatever has some: a history, a measurement, a scenario, or their files."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from historysim.basics.places import at
from historysim.errors import InputError
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from historysim.measured.definitions import Definitions
    from historysim.measured.loops import Loops
    from historysim.measured.measurement import Measurement
    from historysim.measured.sliding import Over, Sliding

    Record = xr.Dataset | Measurement | Scenario | str | Path

Evaluated = TypeVar("Evaluated")


def loops(
    record: "Record",
    *,
    dead_band: float | None = None,
    skip: int = 0,
    skip_per_level: int = 0,
    definitions: "Definitions | None" = None,
) -> "Loops":
    """Return the friction loops of a record, measured or simulated.

    Parameters
    ----------
    record : xarray.Dataset, Measurement, Scenario or path
        A history; a measurement; a scenario (TOML) that replays one; or the file of a scenario or of a result
        (netCDF).
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts as a reversal [m]; by default what a measurement
        or its scenario says of that channel, else 5 % of the range of the displacement.
    skip : int
        How many loops at the start are left out.
    skip_per_level : int
        How many loops are left out at the start of each series at one normal load.
    definitions : Definitions, optional
        What is taken for sliding, for reached, and for the beginning of a branch.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, a record without a whole loop, or one whose loops run the wrong way
        round.

    Examples
    --------
    >>> loops = hs.loops("scenarios/15_instrument_in_series.toml")
    >>> len(loops)
    8
    """
    from historysim.measured.definitions import DEFAULT
    from historysim.measured.splitting import loops_of_history, loops_of_measurement

    options: dict[str, Any] = {
        "dead_band": dead_band,
        "skip": skip,
        "skip_per_level": skip_per_level,
        "definitions": DEFAULT if definitions is None else definitions,
    }

    def of_measurement(measurement: "Measurement", lateral_stiffness: float) -> "Loops":
        return loops_of_measurement(measurement, lateral_stiffness=lateral_stiffness, **options)

    return _evaluated(record, lambda history: loops_of_history(history, **options), of_measurement)


def sliding(record: "Record", *, over: "Over | None" = None, windows: int = 50) -> "Sliding":
    """Return friction over time or distance of a record that slides one way, measured or simulated.

    Parameters
    ----------
    record : xarray.Dataset, Measurement, Scenario or path
        A history; a measurement; a scenario (TOML) that replays one; or the file of a scenario or of a result
        (netCDF).
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
    from historysim.measured.sliding import sliding_of_history, sliding_of_measurement

    def of_measurement(measurement: "Measurement", _: float) -> "Sliding":
        return sliding_of_measurement(measurement, over=over, windows=windows)

    return _evaluated(record, lambda history: sliding_of_history(history, over=over, windows=windows), of_measurement)


def _evaluated(
    record: "Record",
    of_history: "Callable[[xr.Dataset], Evaluated]",
    of_measurement: "Callable[[Measurement, float], Evaluated]",
) -> Evaluated:
    """Return what is read off a record, whatever it is; a measurement comes with the stiffness in series [N/m]."""
    import xarray as xr

    from historysim.asperities.instrument import RIGID
    from historysim.measured.measurement import Measurement
    from historysim.results.result_files import kind_of, open_result

    if isinstance(record, str | Path):
        path = Path(record)
        match kind_of(path):
            case "result":
                with open_result(path) as history:
                    return of_history(history)
            case "scenario":
                record = load(path)
            case "log":
                raise InputError(
                    f"{path}: is the log of a run; expected its result, which historysim run {path} makes again, or a "
                    "scenario (.toml)"
                )
            case _:
                raise InputError(
                    f"{path}: is no scenario (.toml) and no result of historysim run; expected one of them"
                )
    if isinstance(record, Scenario):
        measurement = record.measurement()
        with reported(record.path.name), at("loading"):
            return of_measurement(measurement, record.instrument.lateral_stiffness)
    if isinstance(record, Measurement):
        return of_measurement(record, RIGID.lateral_stiffness)
    if isinstance(record, xr.Dataset):
        return of_history(record)
    raise InputError(
        f"{record!r}: cannot be evaluated; expected a history (Dataset), a Measurement, a Scenario, or the path of a "
        "scenario or a result"
    )


def find_loops(*args: Any, **options: Any) -> "Loops":  # noqa: ANN401 - what `loops` takes
    """Return what `loops` does, under its earlier name, and warn."""
    warnings.warn("hs.find_loops is called hs.loops now, as its command is", DeprecationWarning, stacklevel=2)
    return loops(*args, **options)


def find_sliding(*args: Any, **options: Any) -> "Sliding":  # noqa: ANN401 - what `sliding` takes
    """Return what `sliding` does, under its earlier name, and warn."""
    warnings.warn("hs.find_sliding is called hs.sliding now, as its command is", DeprecationWarning, stacklevel=2)
    return sliding(*args, **options)
