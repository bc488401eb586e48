"""Friction loops of whatever has some: a history, a measurement, a scenario that replays one, or their files."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from historysim.basics.places import at
from historysim.errors import InputError
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.definitions import Definitions
    from historysim.measured.loops import Loops
    from historysim.measured.measurement import Measurement


def loops(
    record: "xr.Dataset | Measurement | Scenario | str | Path",
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

    Returns
    -------
    Loops

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
    import xarray as xr

    from historysim.measured.definitions import DEFAULT
    from historysim.measured.measurement import Measurement
    from historysim.measured.splitting import loops_of_history, loops_of_measurement
    from historysim.results.result_files import kind_of, open_result

    options: dict[str, Any] = {
        "dead_band": dead_band,
        "skip": skip,
        "skip_per_level": skip_per_level,
        "definitions": DEFAULT if definitions is None else definitions,
    }
    if isinstance(record, str | Path):
        path = Path(record)
        match kind_of(path):
            case "result":
                with open_result(path) as history:
                    return loops_of_history(history, **options)
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
            stiffness = record.instrument.lateral_stiffness
            return loops_of_measurement(measurement, lateral_stiffness=stiffness, **options)
    if isinstance(record, Measurement):
        return loops_of_measurement(record, **options)
    if isinstance(record, xr.Dataset):
        return loops_of_history(record, **options)
    raise InputError(
        f"{record!r}: has no loops to find; expected a history (Dataset), a Measurement, a Scenario, or the path of a "
        "scenario or a result"
    )


def find_loops(*args: Any, **options: Any) -> "Loops":
    """Return what `loops` does, under its earlier name, and warn."""
    warnings.warn("hs.find_loops is called hs.loops now, as its command is", DeprecationWarning, stacklevel=2)
    return loops(*args, **options)
