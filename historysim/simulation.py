"""Replay: events → scheduler → ensemble → recorder. The only wiring."""

import platform
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from historysim import log, recorder, scenario, scheduler, surface_group
from historysim._version import __version__
from historysim.ensemble import Ensemble
from historysim.errors import FrictionLimitError, InputError, LoadError
from historysim.events import Event, time_text
from historysim.instrument import RIGID, Instrument, as_instrument

if TYPE_CHECKING:
    import xarray as xr

ROWS_BETWEEN_REPORTS = 1 << 12
"""Rows that are recorded before the progress bar moves on."""


def replay(
    ensemble: Ensemble,
    events: Sequence[Event],
    *,
    substeps: int = 1,
    saturate: bool = False,
    record: recorder.Selection = "touching",
    instrument: Instrument = RIGID,
) -> "xr.Dataset":
    """Replay load events across an ensemble.

    Parameters
    ----------
    ensemble : Ensemble
    events : sequence of events
        In the order of their times; at one time, in the order in which they happen.
    substeps : int
        Rows recorded per interval between event times; they do not change the result.
    saturate : bool
        Hold tangential loads beyond the friction limit at the limit, and flag the step, instead of raising.
    record : {"touching", "all", "totals"} or sequence of int
        Asperities to record: those that touch at any time, all, none (totals alone), or a few by index.
    instrument : Instrument, optional
        In series with the contact: tangential displacements of the events are those of its drive, which is
        recorded beside that of the contact.

    Returns
    -------
    xarray.Dataset
        Dimensions ``step`` and ``asperity``; see `historysim.variables` for what stands in it.

    Raises
    ------
    InputError
        Events, substeps, a selection or an instrument that cannot be used as they are.
    LoadError
        A load that the contact cannot carry; the message names the event.
    """
    if not isinstance(events, Iterable):
        raise InputError(f"events is {events!r}; expected a list of load events")
    events = list(events)
    asperities = recorder.chosen_asperities(ensemble, events, record)
    plan = list(scheduler.stretches(events, substeps))
    steps = sum(stretch.row_time.size for stretch in plan)
    attributes = _attributes(ensemble, events, as_instrument(instrument))
    memory = recorder.DatasetRecorder(ensemble, asperities, steps, attributes, instrument=instrument)
    _walk(ensemble, events, plan, memory, saturate=saturate)
    return memory.dataset()


def run(path: str | Path, output: str | Path | None = None, *, progress: bool = False) -> "xr.Dataset":
    """Replay a scenario file.

    Parameters
    ----------
    path : path
        A scenario in TOML.
    output : path, optional
        A netCDF file to stream the history to, with the surface in the group ``surface``; an existing one is replaced
        when the new one is complete.
    progress : bool
        Show a progress bar on standard error where that is a terminal and the run is long.

    Returns
    -------
    xarray.Dataset
        The history; read lazily from ``output`` where that is given.

    Raises
    ------
    InputError
        The scenario, or a file that it names, cannot be used as it is.
    LoadError
        A load that the contact cannot carry; the message names the event.
    OSError
        ``output`` cannot be written.
    """
    import xarray as xr

    loaded = scenario.load(path)
    ground = loaded.ground()
    ensemble, events, instrument = loaded.ensemble(ground), loaded.events(), loaded.instrument
    asperities = recorder.chosen_asperities(ensemble, events, loaded.record)
    columns = 1 if asperities is None else max(asperities.size, 1)
    most_rows = max(1, min(ROWS_BETWEEN_REPORTS, recorder.BLOCK_CELLS // columns))
    plan = list(scheduler.stretches(events, loaded.substeps, most_rows))
    steps = sum(stretch.row_time.size for stretch in plan)
    attributes = {**_attributes(ensemble, events, instrument), "scenario": loaded.text}
    if loaded.title:
        attributes["title"] = loaded.title
    if output is None:
        memory = recorder.DatasetRecorder(ensemble, asperities, steps, attributes, instrument=instrument)
        _walk(ensemble, events, plan, memory, saturate=loaded.saturate, progress=progress)
        return memory.dataset()
    with recorder.recording(Path(output), ensemble, asperities, steps, attributes, instrument) as file:
        surface_group.write(file.file, surface_group.dataset(ground.summits, ground.surface))
        _walk(ensemble, events, plan, file, saturate=loaded.saturate, progress=progress)
    return xr.open_dataset(output, decode_times=False)


def _walk(
    ensemble: Ensemble,
    events: Sequence[Event],
    plan: Sequence[scheduler.Stretch],
    target: recorder.Recorder,
    *,
    saturate: bool,
    progress: bool = False,
) -> None:
    from tqdm import tqdm

    state = ensemble.initial_state()
    asperities = () if target.asperities is None else target.asperities
    with tqdm(total=target.steps, unit="step", delay=2, disable=None if progress else True) as bar:
        for stretch in plan:
            rows = target.room(stretch.row_time.size)
            try:
                state = ensemble.walk(
                    state,
                    stretch.paths,
                    rows=rows,
                    asperities=asperities,
                    saturate=saturate,
                    instrument=target.instrument,
                )
            except FrictionLimitError as error:
                raise _at(events, stretch.event[error.path], error) from None
            if stretch.friction is not None:
                try:
                    friction = stretch.friction.friction
                    state = ensemble.with_friction(state, friction, instrument=target.instrument)
                except InputError as error:
                    raise _at(events, stretch.friction_event, error) from None
            target.record(stretch.row_time)
            bar.update(stretch.row_time.size)


def _at(events: Sequence[Event], index: int, error: LoadError | InputError) -> LoadError | InputError:
    """Say which event an error belongs to."""
    message = f"event {index} at t = {time_text(events[index].time)}: {error}"
    return LoadError(message) if isinstance(error, LoadError) else InputError(message)


def _attributes(ensemble: Ensemble, events: Sequence[Event], instrument: Instrument) -> dict[str, Any]:
    import numba
    import numpy as np

    in_series = {} if instrument.rigid else {"lateral_stiffness": instrument.lateral_stiffness}
    return {
        "Conventions": "CF-1.11",
        "title": f"Load history of {len(ensemble)} asperities",
        "source": f"historysim {__version__}: exact traction memory of Hertz-Mindlin asperities",
        "history": f"replayed from {len(events)} events by historysim {__version__}",
        "historysim_version": __version__,
        "made_with": f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}",
        "contact_modulus": ensemble.pair.contact_modulus,
        "shear_modulus": ensemble.pair.shear_modulus,
        **in_series,
        "number_of_asperities": len(ensemble),
        "number_of_events": len(events),
        "event_digest": f"sha256:{log.digest(events)}",
    }
