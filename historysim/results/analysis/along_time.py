"""A history along its time: its friction loops with their energy, and a table with a row for each time."""

from typing import Any

import xarray as xr

from historysim.errors import InputError
from historysim.measured.branches import DEFAULT, Definitions
from historysim.measured.loops import Loops, loops_of_history
from historysim.results.analysis.recorded import check_any, check_recorded, describe, find_column
from historysim.results.queries import query

FORMS = ("wide", "long", "totals")
CONTENT = "history over time"  # the attribute content of a history over time
OF_THE_RESULT = ("complete", "id", "log_digest")  # attributes of the result only


@query(table="loop,start_time")
def friction_loops(
    history: xr.Dataset,
    *,
    dead_band: float | None = None,
    skip: int = 0,
    definitions: Definitions = DEFAULT,
) -> Loops:
    """Return the friction loops of a history, and their quantities.

    Loops of a measured record are found in the same way, so the two can be compared. The history is
    interpolated linearly between its recorded steps (see ``substeps``).

    Parameters
    ----------
    history : xarray.Dataset
        With or without asperities.
    dead_band : float, optional
        The smallest swing of the tangential displacement that counts [m]; by default 5 % of its
        range.
    skip : int
        Number of loops left out at the start.
    definitions : Definitions
        Criteria for sliding, for a reached load, and for the beginning of a branch.

    Raises
    ------
    InputError
        A history without a complete loop.
    """
    return loops_of_history(history, dead_band=dead_band, skip=skip, definitions=definitions)


@query(table="loop,start_time")
def energy_per_cycle(
    history: xr.Dataset, *, dead_band: float | None = None, skip: int = 0
) -> xr.Dataset:
    """Return the energy that friction dissipates in each loop, of every asperity and of all of them.

    This is the rise of the dissipated energy from the start of a friction loop to its end. ∮ T dU
    of `friction_loops` differs by the change of the elastic energy, unless the loop is closed.

    ``total_energy`` (loop) [J], ``energy`` (loop, asperity) [J] where it is recorded, and the times
    of beginning and end [s] as coordinates. ``dead_band`` [m], ``skip`` and errors:
    `friction_loops`.
    """
    check_recorded(history)
    loops = loops_of_history(history, dead_band=dead_band, skip=skip)
    ends = loops.ends[:, [0, 2]]
    time = history["time"].values[ends]
    variables = {}
    sources = {
        "total_energy": ("total_dissipated_energy", ", all asperities"),
        "energy": ("dissipated_energy", ""),
    }
    for name, (source, of) in sources.items():
        if source in history:
            # only the steps at the ends of loops are read
            start_energy, end_energy = (
                history[source].isel(step=column).values for column in ends.T
            )
            along = ("loop", *history[source].dims[1:])
            variables[name] = describe(
                along, end_energy - start_energy, f"energy per cycle{of}", "J"
            )
    coordinates: dict[str, Any] = {
        "loop": describe("loop", loops.number, "loop of the history, from 0"),
        "start_time": describe("loop", time[:, 0], "start of the loop", "s"),
        "end_time": describe("loop", time[:, 1], "end of the loop", "s"),
    }
    if "energy" in variables:
        coordinates["asperity"] = history["asperity"]
    return xr.Dataset(variables, coordinates)


@query(per_step=True, table="elapsed_time,total_normal_load", planar=True)
def time_series(history: xr.Dataset, asperity: int | None = None, form: str = "wide") -> xr.Dataset:
    """Return a history along its time in place of ``step``: all of it, or of one asperity.

    CDO and other tools expect time as a dimension. It is named ``elapsed_time`` here, since CF
    counts ``time`` from a date.

    The variables of the history along ``elapsed_time`` [s], and ``asperity`` unless one is selected
    by its label. Values are read when they are used. The form ``"totals"`` omits variables of
    asperities; ``"long"`` has a row for each time and asperity with the totals of that time, as
    spreadsheets and data frames group them.

    InputError: an asperity that is not recorded, another form, or a Dataset that is not a history.
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
