"""Friction over time or distance of whatever slides one way: a history, a measurement, a scenario, or their files."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from historysim.basics.places import at
from historysim.errors import InputError
from historysim.scenario.scenario import Scenario, load
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.measurement import Measurement
    from historysim.measured.sliding import Over, Sliding


def sliding(
    record: "xr.Dataset | Measurement | Scenario | str | Path", *, over: "Over | None" = None, windows: int = 50
) -> "Sliding":
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
    import xarray as xr

    from historysim.measured.measurement import Measurement
    from historysim.measured.sliding import sliding_of_history, sliding_of_measurement
    from historysim.results.result_files import kind_of, open_result

    if isinstance(record, str | Path):
        path = Path(record)
        match kind_of(path):
            case "result":
                with open_result(path) as history:
                    return sliding_of_history(history, over=over, windows=windows)
            case "scenario":
                record = load(path)
            case _:
                raise InputError(
                    f"{path}: is no scenario (.toml) and no result of historysim run; expected one of them"
                )
    if isinstance(record, Scenario):
        measurement = record.measurement()
        with reported(record.path.name), at("loading"):
            return sliding_of_measurement(measurement, over=over, windows=windows)
    if isinstance(record, Measurement):
        return sliding_of_measurement(record, over=over, windows=windows)
    if isinstance(record, xr.Dataset):
        return sliding_of_history(record, over=over, windows=windows)
    raise InputError(
        f"{record!r}: has no friction to find; expected a history (Dataset), a Measurement, a Scenario, or the path of "
        "a scenario or a result"
    )


def find_sliding(*args: Any, **options: Any) -> "Sliding":
    """Return what `sliding` does, under its earlier name, and warn."""
    warnings.warn("hs.find_sliding is called hs.sliding now, as its command is", DeprecationWarning, stacklevel=2)
    return sliding(*args, **options)
