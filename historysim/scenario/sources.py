"""What a run replays: a scenario, the log of an earlier run, or its result; which of them a file is, is asked once."""

import abc
import itertools
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import attrs

from historysim.basics.files import is_log, is_netcdf
from historysim.basics.notices import Notify
from historysim.basics.targets import LOG, RESULT, Output
from historysim.errors import InputError
from historysim.loads.events import Event
from historysim.log import embedded_log
from historysim.log.file import LogFile, links_of
from historysim.log.header import LogHeader
from historysim.log.result import log_beside
from historysim.recording import surface_group
from historysim.scenario.scenario import Scenario, load


class Source(abc.ABC):
    """What a run replays."""

    @property
    @abc.abstractmethod
    def files(self) -> tuple[Path, ...]:
        """The files that are read."""

    @abc.abstractmethod
    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:
        """Return the header and the events of the log of such a run, and the last link of its chain."""

    @abc.abstractmethod
    def log(self, output: Path, *, resume: bool, notify: Notify) -> LogFile:
        """Open or make the log that a run writes; whoever has it is the only writer."""

    def placed(self) -> AbstractContextManager[None]:
        """Say of an event that cannot be carried out where it stands in what is replayed, if it has a place there."""
        return nullcontext()

    def outputs(self, output: Path) -> tuple[Output, ...]:
        """Return the files that a run writes: a result and its log."""
        return Output(output, (RESULT,)), Output(log_beside(output), (LOG,))


@attrs.frozen
class _ScenarioSource(Source):
    """A scenario."""

    scenario: Scenario

    def placed(self) -> AbstractContextManager[None]:
        """See `Scenario.placed`."""
        return self.scenario.placed()

    @property
    def files(self) -> tuple[Path, ...]:
        return self.scenario.files

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:
        header, events = self._resolved(notify)
        return header, events, links_of(header, events)[-1]

    def log(self, output: Path, *, resume: bool, notify: Notify) -> LogFile:
        beside = log_beside(output)
        if not (resume and beside.exists()):
            if resume:
                notify(f"{beside}: there is no log to resume from; the run starts at the beginning")
            return LogFile.create(beside, *self._resolved(notify))
        file = LogFile(beside, write=True)
        if file.head.settings["scenario"] != self.scenario.text:
            file.close()
            raise InputError(
                f"{self.scenario.path}: is not the scenario that {beside} was made from, so the run cannot go on from "
                "there; run it without --resume to begin again, or go on with the old one: "
                f"historysim run {beside} --resume"
            )
        return file

    def _resolved(self, notify: Notify) -> tuple[LogHeader, Sequence[Event]]:
        loaded = self.scenario
        if loaded.sections.sweep is not None:
            notify(f"{loaded.path.name}: ignoring [sweep]; use `historysim sweep` to run it")
        built = loaded.build(notify)
        surface = built.surface
        shown, attributes = surface_group.contents(surface.summits, surface.surface, surface.solutions)
        header = LogHeader.of(
            built.replay,
            scenario=loaded.text,
            title=loaded.title,
            metadata=loaded.metadata,
            seeds=loaded.seeds,
            surface=shown,
            surface_attributes=attributes,
        )
        return header, built.events


@attrs.frozen
class _LogSource(Source):
    """The log of an earlier run, which the run goes on writing."""

    path: Path

    @property
    def files(self) -> tuple[Path, ...]:
        return (self.path,)

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - nothing is to be told
        with LogFile(self.path) as file:
            content = file.sound()
            return file.head, content.events, content.links[-1]

    def log(self, output: Path, *, resume: bool, notify: Notify) -> LogFile:  # noqa: ARG002 - it is there already
        return LogFile(self.path, write=True)

    def outputs(self, output: Path) -> tuple[Output, ...]:
        """Return the file that a run writes: a result."""
        return (Output(output, (RESULT,)),)


@attrs.frozen
class _ResultSource(Source):
    """The result of an earlier run, which holds its log."""

    path: Path

    @property
    def files(self) -> tuple[Path, ...]:
        return (self.path,)

    def content(self, notify: Notify) -> tuple[LogHeader, Sequence[Event], bytes]:  # noqa: ARG002 - nothing is to be told
        header, content = embedded_log.read(self.path)
        return header, content.events, content.links[-1]

    def log(self, output: Path, *, resume: bool, notify: Notify) -> LogFile:  # noqa: ARG002 - nothing is to be told
        beside = log_beside(output)
        header, content = embedded_log.read(self.path)
        if resume and beside.exists():
            file = LogFile(beside, write=True)
            if file.sound().links == content.links:
                return file
            file.close()
            raise InputError(
                f"{self.path}: was not made from {beside}, so the run cannot go on from there; run it without --resume "
                "to begin again"
            )
        # batch by batch, as it was written
        file = LogFile.create(beside, header, content.events[: content.ends[1]])
        for first, last in itertools.pairwise(content.ends[1:]):
            file.append(content.events[first:last])
        return file


def source_of(what: str | Path | Scenario | Source, values: Mapping[str, Any] | None = None) -> Source:
    """Return what a run replays.

    Parameters
    ----------
    what : path, Scenario or Source
    values : mapping, optional
        Values to take in place of those of a scenario's file, as for `load`.

    Raises
    ------
    InputError
        A scenario that cannot be used, or values for what is no scenario.
    """
    if isinstance(what, Source):
        return what
    if isinstance(what, Scenario):
        return _ScenarioSource(what)
    if isinstance(what, str | Path):
        kind = _LogSource if is_log(Path(what)) else _ResultSource if is_netcdf(Path(what)) else None
        if kind is not None:
            if values:
                raise InputError(f"{what}: is no scenario (.toml), so that --set has nothing to change; leave it out")
            return kind(Path(what))
    return _ScenarioSource(load(what, values))
