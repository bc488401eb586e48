"""What is exported: the contact of a scenario, of a log, of a result or of a replay."""

from pathlib import Path
from typing import NamedTuple

from historysim.basics.file_kinds import is_log, is_netcdf
from historysim.log import inputs
from historysim.log.file import LogFile
from historysim.replay import Replay
from historysim.scenario.scenario import Scenario, as_scenario


class Source(NamedTuple):
    """A replay, what it is called, and the files that it was read from."""

    replay: Replay
    name: str
    title: str
    files: tuple[Path, ...]


def source_of(given: Scenario | Replay | str | Path) -> Source:
    """Return what is exported: a scenario or its file, a log, a result, or a replay.

    Raises
    ------
    InputError
        It cannot be used as it is.
    """
    if isinstance(given, Replay):
        return Source(given, "contact", "", ())
    if isinstance(given, str | Path) and is_log(Path(given)):
        with LogFile(Path(given)) as file:
            head, events = file.head, file.sound().events
        return Source(head.replay(events), Path(given).stem, head.title, (Path(given),))
    if isinstance(given, str | Path) and is_netcdf(Path(given)):
        head, content = inputs.read(Path(given))
        return Source(head.replay(content.events), Path(given).stem, head.title, (Path(given),))
    scenario = as_scenario(given)
    return Source(scenario.replay(), scenario.path.stem, scenario.title, scenario.files)
