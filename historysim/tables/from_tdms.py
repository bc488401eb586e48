"""TDMS: the channels of a LabVIEW recording, as ``group/channel``, through npTDMS.

The time of a channel that was sampled evenly is listed as ``group/channel/time``.
"""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from historysim.errors import InputError
from historysim.tables.arrays import Array, Contents, readable
from historysim.tables.columns import Format
from historysim.tables.readers import READERS, TableReader


@contextmanager
def _strict() -> Iterator[None]:
    """Refuse a file that npTDMS warns of: it goes on with what is left of it."""
    from nptdms.log import log_manager

    reader = threading.get_ident()

    def refuse(record: logging.LogRecord) -> bool:
        # what other threads read, in whatever way, is not concerned
        if threading.get_ident() == reader:
            raise InputError(f"is damaged ({record.getMessage()[:200]})")
        return True

    log_manager.console_handler.addFilter(refuse)
    try:
        yield
    finally:
        log_manager.console_handler.removeFilter(refuse)


def _arrays(channel: Any) -> Iterator[Array]:
    name, length = f"{channel.group_name}/{channel.name}", (len(channel),)
    yield Array(name, length, lambda selection: channel[selection[0]], str(channel.properties.get("unit_string", "")))
    if channel.properties.get("wf_increment"):
        yield Array(f"{name}/time", length, lambda selection: channel.time_track()[selection[0]], "s")


@READERS.register
class TdmsReader(TableReader):
    """TDMS of LabVIEW, through npTDMS."""

    kind, endings = "tdms", (".tdms",)

    @contextmanager
    def opened(self, path: Path, layout: Format) -> Iterator[Contents]:  # noqa: ARG002 - other formats need it
        """Yield what a TDMS file holds; a damaged file, another, or no npTDMS is an InputError."""
        try:
            from nptdms import TdmsFile
        except ImportError as error:
            raise InputError('is read by npTDMS, which is not installed; pip install "historysim[tdms]"') from error
        with readable("TDMS"), path.open("rb") as stream, _strict(), TdmsFile.open(stream) as file:
            if file.file_status.incomplete_final_segment:
                raise InputError("is cut short: its last segment is not complete; save the file again without it")
            yield Contents(
                [array for group in file.groups() for channel in group.channels() for array in _arrays(channel)]
            )
