"""A history along its time: its friction loops with their energy, and a table with a row for each time."""

from typing import Any

import xarray as xr

from historysim.errors import InputError
from historysim.measured.branches import DEFAULT, Definitions
from historysim.measured.loops import Loops, loops_of_history
from historysim.results.analysis.recorded import check_any, check_recorded, described, find_column
from historysim.results.asking import question

FORMS = ("wide", "long", "totals")
CONTENT = "history over time"  # the attribute content of a history over time
OF_THE_RESULT = ("complete", "id", "log_digest")  # attributes that hold for the result alone


@question(table="loop,start_time")
def friction_loops(
    history: xr.Dataset, *, dead_band: float | None = None, skip: int = 0, definitions: Definitions = DEFAULT
) -> Loops:
    """Return the friction loops of a history, and their quantities.

    Those of a measured record are found in the same way, so the two can be compared. How finely the history is recorded
    matters: between steps it is taken as straight (see ``substeps``).

    Parameters
    ----------
    history : xarray.Dataset
        With or without asperities.
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts [m]; by default 5 % of its range.
    skip : int
        How many loops at the start are left out.
    definitions : Definitions
        What counts as sliding, as reached, and as the beginning of a branch.

    Raises
    ------
    InputError
        A history without a whole loop.
    """
    return loops_of_history(history, dead_band=dead_band, skip=skip, definitions=definitions)


@question(table="loop,start_time")
def energy_per_cycle(history: xr.Dataset, *, dead_band: float | None = None, skip: int = 0) -> xr.Dataset:
    """Return the energy that friction dissipates in each loop, of every asperity and of all of them.

    It is the rise of the dissipated energy from the beginning of a friction loop to its end. ∮ T dU of `friction_loops`
    differs from it by the elastic energy between the two, unless the loop is closed.

    ``total_energy`` (loop) [J], ``energy`` (loop, asperity) [J] where it is recorded, and the times of beginning and
    end [s] as coordinates. ``dead_band`` [m], ``skip`` and errors: `friction_loops`.
    """
    check_recorded(history)
    loops = loops_of_history(history, dead_band=dead_band, skip=skip)
    ends = loops.ends[:, [0, 2]]
    time = history["time"].values[ends]
    variables = {}
    sources = {"total_energy": ("total_dissipated_energy", ", all asperities"), "energy": ("dissipated_energy", "")}
    for name, (source, of) in sources.items():
        if source in history:
            # only the steps at which loops begin and end are read
            start_energy, end_energy = (history[source].isel(step=column).values for column in ends.T)
            along = ("loop", *history[source].dims[1:])
            variables[name] = described(along, end_energy - start_energy, f"energy per cycle{of}", "J")
    coordinates: dict[str, Any] = {
        "loop": described("loop", loops.number, "loop of the history, from 0"),
        "start_time": described("loop", time[:, 0], "start of the loop", "s"),
        "end_time": described("loop", time[:, 1], "end of the loop", "s"),
    }
    if "energy" in variables:
        coordinates["asperity"] = history["asperity"]
    return xr.Dataset(variables, coordinates)


@question(per_step=True, table="elapsed_time,total_normal_load", planar=True)
def time_series(history: xr.Dataset, asperity: int | None = None, form: str = "wide") -> xr.Dataset:
    """Return a history along its time in place of ``step``: all of it, or of one asperity.

    CDO and other tools take for the axis of time what is a dimension. It is called ``elapsed_time`` here, since what CF
    calls ``time`` counts from a date.

    The variables of the history along ``elapsed_time`` [s], and ``asperity`` where none is chosen by its label. Nothing
    is read yet. With the form ``"totals"`` what asperities have is left out; with ``"long"`` there is a row for each
    time and asperity, with the totals of the time beside it, as spreadsheets and data frames group them.

    InputError: an asperity that is not recorded, another form, or a Dataset that is no history.
    """
    if form not in FORMS:
        raise InputError(f"form is {form!r}; expected one of {', '.join(FORMS)}")
    check_recorded(history)
    chosen = history
    if asperity is not None:
        check_recorded(history, "slip_state")
        check_any(history)
        chosen = history.isel(asperity=find_column(asperity, history))
    without = "asperity" if form == "totals" and "asperity" in chosen.dims else None
    chosen = chosen if without is None else chosen.drop_dims(without)
    along = [name for name, values in chosen.data_vars.items() if "step" in values.dims]
    series = chosen[along].swap_dims(step="time").rename(time="elapsed_time")
    if form == "long" and "asperity" in series.dims:
        rows = series.reset_coords().stack(row=("elapsed_time", "asperity")).reset_index("row")
        # times are the labels of the rows
        series = rows.reset_coords("asperity").set_coords("elapsed_time")
    attributes = {name: value for name, value in history.attrs.items() if name not in OF_THE_RESULT}
    of_asperity = "" if asperity is None else f": asperity {asperity}"
    title = f"{history.attrs.get('title', 'Load history')}{of_asperity}"
    series.attrs = attributes | {"content": CONTENT, "title": title}
    return series
