"""Whatever a path names, opened as what it is."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

from historysim.basics.file_kinds import is_netcdf
from historysim.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from historysim.log.event_log import EventLog
    from historysim.measured.sliding import Sliding
    from historysim.results.written_table import WrittenTable
    from historysim.scenario.scenario import Scenario
    from historysim.surfaces.heights import Surface


class Reading(TypedDict, total=False):
    """What a height map may leave open: arguments of `read_surface`."""

    pixel_size: float | str | tuple[float | str, float | str]
    height_unit: str
    lateral_unit: str
    channel: int | str


@contextmanager
def opened(
    path: str | Path, *, form: str | None = None, **reading: Unpack[Reading]
) -> Iterator["Scenario | EventLog | xr.Dataset | Sliding | Surface | WrittenTable"]:
    """Open a scenario, a log, a result, a file of loops or of sliding, a sweep or a height map; close it in the end.

    Parameters
    ----------
    path : path
    form : str, optional
        What is taken off a height map, as by `Surface.detrended`; by default a plane.
    **reading
        What a height map leaves open, as for `read_surface`.

    Yields
    ------
    Scenario, EventLog, xarray.Dataset, Sliding, WrittenTable, ReducedModel or Surface
        Of results, of friction loops, of sweeps and of tables, a Dataset; of a table in CSV a `WrittenTable`; of a
        reduced model a `ReducedModel`.

    Raises
    ------
    InputError
        There is no such file, it cannot be used, or it is no height map and something is said of its reading.
    """
    from historysim.results.result_files import CALLED, FILES, kind_of, open_result, read_table

    path = Path(path)
    kind = kind_of(path)
    if kind == "height map":
        yield _height_map(path, form or "plane", **reading)
        return
    if unused := ([] if form is None else ["form"]) + list(reading):
        raise InputError(
            f"{', '.join(unused)}: {path} is {CALLED.get(kind, f'a {kind}')}; expected a height map, to be read so"
        )
    if kind == "scenario":
        from historysim.scenario.scenario import load

        yield load(path)
    elif kind == "log":
        from historysim.log.event_log import EventLog

        with EventLog(path) as log:
            yield log
    elif kind == "table" and not is_netcdf(path):
        from historysim.results import written_table

        yield written_table.WrittenTable.read(path)
    elif kind == "sliding":
        from historysim.measured.sliding import Sliding

        yield Sliding.from_dataset(read_table(path))
    elif kind in {"loops", "sweep", "table"}:
        yield read_table(path)
    elif kind == "result":
        with open_result(path) as history:
            yield history
    else:
        yield FILES[kind].read(path)


def open(  # noqa: A001 - as users of xarray and of files call it
    path: str | Path, *, form: str | None = None, **reading: Unpack[Reading]
) -> "Scenario | EventLog | xr.Dataset | Sliding | Surface | WrittenTable":
    """Return what a file holds, whatever it is: ``hs.open("my.nc").contact.slides_first()``.

    Parameters
    ----------
    path : path
        A scenario, a log, a result, friction loops, friction over time or distance, a sweep, a table of a question,
        a reduced model (JSON), or a height map.
    form : str, optional
        What is taken off a height map, as by `Surface.detrended`; by default a plane.
    **reading
        What a height map leaves open, as for `read_surface`.

    Returns
    -------
    Scenario, EventLog, xarray.Dataset, Sliding, WrittenTable, ReducedModel or Surface
        A result is read lazily; it and a log are closed by their ``close()`` or at the end of a ``with`` block.

    Raises
    ------
    InputError
        There is no such file, it cannot be used, or it is no height map and something is said of its reading.

    Examples
    --------
    >>> history = hs.run("scenarios/04_normal_up_tangential_up.toml", "up.nc")
    >>> hs.open("up.nc").sizes["step"]
    121
    """
    import xarray as xr

    from historysim.log.event_log import EventLog

    with ExitStack() as stack:
        content = stack.enter_context(opened(path, form=form, **reading))
        if isinstance(content, EventLog):
            return EventLog(path)
        if isinstance(content, xr.Dataset):
            # the file is closed through the Dataset that opened it, which must not be asked to close itself
            content = content.copy()
            content.set_close(stack.pop_all().close)
    return content


def _height_map(path: Path, form: str, **reading: Unpack[Reading]) -> "Surface":
    from historysim.basics.arguments import representable
    from historysim.surfaces.reading import read_surface

    try:
        surface = read_surface(path, **reading)
    except InputError as error:
        raise InputError(
            f"{error} (read as a height map: neither named .toml nor a result of historysim run)"
        ) from error
    with representable():
        return surface.detrended(form)
