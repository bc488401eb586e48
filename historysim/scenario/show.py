"""Whatever can be said of something in a few lines."""

from pathlib import Path
from typing import TYPE_CHECKING, Unpack, cast

from historysim.basics.display import Lines
from historysim.errors import InputError
from historysim.scenario.opening import Reading, opened
from historysim.scenario.scenario import Scenario
from historysim.scenario.scenario_summary import summary as scenario_summary

if TYPE_CHECKING:
    import xarray as xr

    from historysim.log.event_log import EventLog
    from historysim.surfaces.heights import Surface

    Showable = str | Path | xr.Dataset | Scenario | EventLog | Surface


def show(what: "Showable", *, form: str | None = None, **reading: Unpack[Reading]) -> Lines:
    """Return in a few lines what a scenario, a result, a log or a height map holds, or a file of them.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, EventLog or Surface
    form : str, optional
        What is taken off the height map of a file first; by default a plane.
    **reading
        What the height map of a file leaves open, as for `read_surface`.

    Returns
    -------
    Lines
        Labels and texts, which print and show themselves in two columns.

    Raises
    ------
    InputError
        Something else, a file that cannot be used, or an option that does not fit what is shown.

    Examples
    --------
    >>> print(hs.show("scenarios/04_normal_up_tangential_up.toml"))
    title                Silicon ball on glass: both loads rise
    asperities           1
    events               242 over 12 s
    substeps             1
    recorded asperities  touching
    """
    if isinstance(what, str | Path):
        from historysim.results.result_files import kind_of

        if kind_of(Path(what)) == "height map":
            with opened(what, form="mean", **reading) as measured:
                return _height_map(cast("Surface", measured), form or "plane")
        with opened(what, form=form, **reading) as content:
            return _lines(content)
    if form is not None or reading:
        raise InputError("form, pixel_size, …: expected with the path of a height map alone, which is read with them")
    return _lines(what)


def _lines(what: object) -> Lines:
    import xarray as xr

    from historysim.surfaces.heights import Surface

    if isinstance(what, xr.Dataset):
        return _dataset(what)
    if isinstance(what, Scenario):
        return Lines(scenario_summary(what))
    if isinstance(what, Surface):
        from historysim.surfaces.surface_summary import summary

        return Lines(summary(what))
    if hasattr(what, "summary"):
        return Lines(what.summary())
    raise InputError(f"{what!r} cannot be shown; expected a history, a scenario, a log, a surface, or a file of them")


def _height_map(measured: "Surface", form: str) -> Lines:
    """Return lines on a map once a form is taken off, and on its steps in height, before that."""
    from historysim.basics.arguments import representable
    from historysim.surfaces.quantisation import quantisation_notice
    from historysim.surfaces.surface_summary import summary

    with representable():
        lines = [*summary(measured.detrended(form)), ("form taken off", form)]
        coarse = quantisation_notice(measured)
    return Lines([*lines, *([] if coarse is None else [("warning", coarse)])])


def _dataset(history: "xr.Dataset") -> Lines:
    from historysim.results import loop_summary, netcdf_table, sliding_order, sweeps
    from historysim.results.analysis.history_summary import readable_attributes
    from historysim.results.result_files import KINDS

    if history.attrs.get("content") == sweeps.CONTENT:
        return Lines(sweeps.summary(history))
    if KINDS.get(str(history.attrs.get("content"))) == "table":
        return Lines(netcdf_table.summary(history))
    if "loop" in history.dims or "loops" in history.coords:
        return Lines(loop_summary.summary(history))
    if "total_normal_load" not in history:
        raise InputError("this Dataset is no history; expected one from historysim, with all its variables")
    attributes = readable_attributes(history)
    # texts of many lines, such as the scenario, would hide the rest
    short = [(name, text) for name, text in attributes.items() if "\n" not in text.strip()]
    return Lines([*sliding_order.summary(history), ("", ""), *short])
