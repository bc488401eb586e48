"""The source of a history: the replay that made it, the log next to its file, or its file, which holds its events."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.state import State
from historysim.errors import InputError
from historysim.log import embedded_log
from historysim.log.event_log import EventLog
from historysim.log.lazy_history import LogReference
from historysim.log.result import digest_attribute, log_path_for
from historysim.recording.provenance import MADE_BY
from historysim.replaying import Replay

Answer = TypeVar("Answer")
# steps below which a history is replayed for a smooth picture, and its steps then
FEW_STEPS, SMOOTH_STEPS = 240, 480


class ReplaySource(NamedTuple):
    """The replay that produced a history, with the surface and settings of its log or file."""

    job: Replay
    state: Callable[[float], State]  #: returns the state at a time [s]
    surface: Mapping[str, Any]  #: arrays of the surface, as in the result
    settings: Mapping[str, Any]  #: further settings in the head of the log


def query_source(history: xr.Dataset, function: Callable[[ReplaySource], Answer]) -> Answer | None:
    """Evaluate a function of the source of a history; None without source, or if it raises InputError."""
    job = history.encoding.get(MADE_BY)
    source = history.encoding.get("source")
    if isinstance(job, Replay):
        with suppress(InputError):
            return function(ReplaySource(job, lambda at: job.state(until=at), {}, {}))
    elif isinstance(job, LogReference):
        with suppress(InputError):
            lazy = job.history
            return function(
                ReplaySource(lazy.job, lazy.state, lazy.head.surface, lazy.head.settings)
            )
    elif source:
        with suppress(InputError), EventLog(log_path_for(Path(source))) as log:
            if (
                history.attrs.get("log_digest")
                == digest_attribute(bytes.fromhex(log.digest))["log_digest"]
            ):
                # with its snapshots, while it is open
                return function(
                    ReplaySource(log.job(), lambda at: log.state(at=at), log.surface, log.settings)
                )
        with suppress(InputError):
            head, content = embedded_log.read(Path(source))
            replay = head.replay(content.events)
            return function(
                ReplaySource(replay, lambda at: replay.state(until=at), head.surface, head.settings)
            )
    return None


def refine(history: xr.Dataset) -> xr.Dataset:
    """Return the totals of a history at enough steps for smooth curves.

    A history with few steps and a source is replayed with more substeps, which do not change the
    result.
    """
    steps = history.sizes["step"]
    if steps >= FEW_STEPS or steps < 2:
        return history

    def replay(origin: ReplaySource) -> xr.Dataset:
        substeps = origin.job.substeps * -(-SMOOTH_STEPS // steps)
        return attrs.evolve(origin.job, substeps=substeps, record="totals").dataset()

    replayed = query_source(history, replay)
    if replayed is None:
        return history
    replayed_limits, recorded_limits = (
        item["time"].values[[0, -1]] for item in (replayed, history)
    )
    # a part of a history is drawn unchanged
    return (
        replayed.assign_attrs(history.attrs)
        if np.allclose(replayed_limits, recorded_limits, rtol=1e-12, atol=0)
        else history
    )
