"""Friction loops of a history, and the energy that each of them takes, of every asperity."""

from typing import TYPE_CHECKING, Any

from historysim.measured.definitions import DEFAULT, Definitions
from historysim.results.analysis.recorded import check_recorded

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.loops import Loops


def friction_loops(
    history: "xr.Dataset", *, dead_band: float | None = None, skip: int = 0, definitions: Definitions = DEFAULT
) -> "Loops":
    """Return the friction loops of a history, with what each of them says.

    Those of a measured record are found in the same way: the two can be compared.
    How finely the history is recorded matters: between steps it is taken as straight (see ``substeps``).

    Parameters
    ----------
    history : xarray.Dataset
        A history, with or without asperities.
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts [m]; by default 5 % of its range.
    skip : int
        How many loops at the start are left out.
    definitions : Definitions
        What is taken for sliding, for reached, and for the beginning of a branch.

    Raises
    ------
    InputError
        A history without a whole loop.
    """
    from historysim.measured.splitting import loops_of_history

    return loops_of_history(history, dead_band=dead_band, skip=skip, definitions=definitions)


def energy_per_cycle(history: "xr.Dataset", *, dead_band: float | None = None, skip: int = 0) -> "xr.Dataset":
    """Return the energy that friction takes in each cycle, of every asperity and of all of them.

    It is the rise of the dissipated energy from the beginning of a friction loop to its end, whose tractions differ
    unless the loop is closed: ∮ T dU, which `friction_loops` tells, differs from it by the elastic energy between them.

    Parameters
    ----------
    history : xarray.Dataset
        A history; one of totals alone, or of patches, has the total energy only.
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts [m]; by default 5 % of its range.
    skip : int
        How many loops at the start are left out.

    Returns
    -------
    xarray.Dataset
        ``total_energy`` (loop) [J], and ``energy`` (loop, asperity) [J] where there is one; the times of beginning and
        end [s] stand beside the loops.

    Raises
    ------
    InputError
        A history without a whole loop.
    """
    import xarray as xr

    from historysim.measured.splitting import loops_of_history

    check_recorded(history)
    loops = loops_of_history(history, dead_band=dead_band, skip=skip)
    ends = loops.ends[:, [0, 2]]
    time = history["time"].values[ends]
    variables = {}
    names = {"total_energy": "total_dissipated_energy", "energy": "dissipated_energy"}
    for name, source in names.items():
        if source not in history:
            continue
        # only the steps at which loops begin and end are read
        first, last = (history[source].isel(step=column).values for column in ends.T)
        label = f"energy per cycle{', all asperities' if name == 'total_energy' else ''}"
        dims = ("loop", *history[source].dims[1:])
        variables[name] = xr.Variable(dims, last - first, {"units": "J", "long_name": label})
    beside: dict[str, Any] = {
        "loop": ("loop", loops.number, {"long_name": "loop of the history, from 0"}),
        "start_time": ("loop", time[:, 0]),
        "end_time": ("loop", time[:, 1]),
    }
    if "energy" in variables:
        beside["asperity"] = history["asperity"]
    result = xr.Dataset(variables, beside)
    for name, text in (("start_time", "start of the loop"), ("end_time", "end of the loop")):
        result[name].attrs = {"units": "s", "long_name": text}
    return result
