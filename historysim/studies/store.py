"""A folder of cells, one file each, so that completed cells survive an interrupted sweep.

The name of a cell is the digest of its inputs: the scenario at its point, the contents of the files
that it names, the outputs, and the versions of the software. So several sweeps can share a folder,
also simultaneously. A file is written under a temporary name, renamed once it is on the disk, and
begins with the digest of its name and content; a file with any other content is ignored.
"""

import contextlib
import functools
import hashlib
import io
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim._version import __version__
from historysim.basics.files import UNFINISHED, is_file, is_own, own_file, replacing
from historysim.basics.system import lock_byte
from historysim.recording.provenance import made_with
from historysim.scenario.document import find_named_files
from historysim.scenario.grid import with_values
from historysim.scenario.scenario import Scenario

FORM = 3
ENDING = ".cell"
_UNFINISHED = re.compile(rf"\.([0-9a-f]{{64}}){re.escape(ENDING)}{UNFINISHED.pattern}")
HEADER = "header"
# bytes at the start of a file, the digest of its name and content
MARK_SIZE = hashlib.sha256().digest_size
# sections that do not change the content of a cell
IRRELEVANT = ("title", "sweep", "design", "fit", "metadata", "picture")


Stamp = tuple[str, int, int]  # path, size and time of change of a file, as far as it exists
_made_with = functools.cache(made_with)


def stamp(path: Path) -> Stamp:
    """Return the stamp of a file, which changes when the file does."""
    try:
        status = path.stat()
    except OSError:
        return str(path), -1, -1
    return str(path), status.st_size, status.st_mtime_ns


@functools.lru_cache(maxsize=256)
def _content_digest(of: Stamp) -> str:
    """Return the SHA-256 of the content of a file; a fixed string if it cannot be read."""
    path = Path(of[0])
    with contextlib.suppress(OSError):
        if is_file(path):
            with path.open("rb") as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
    return "cannot be read"


def digest(scenario: Scenario, point: Mapping[str, Any], outputs: Sequence[str]) -> str:
    """Return the digest of the inputs of a cell, as hexadecimal digits."""
    document = with_values(scenario.document, point)
    read = sorted(set(find_named_files(document, scenario.path.parent)))
    content = {
        "form": FORM,
        "historysim_version": __version__,
        "made_with": _made_with(),
        "scenario": {key: value for key, value in document.items() if key not in IRRELEVANT},
        "files": {
            os.path.relpath(path, scenario.path.parent): _content_digest(stamp(path))
            for path in read
        },
        "outputs": sorted(outputs),
    }
    # a date would be refused by the scenario before
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, default=str)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


@attrs.frozen
class Store:
    """The cells in a folder."""

    folder: Path

    def read(self, name: str) -> xr.Dataset | None:
        """Return the cell of a digest; None if it does not exist or is damaged."""
        path = self._path(name)
        try:
            content = path.read_bytes() if is_file(path) else b""
        except FileNotFoundError:
            return None
        mark, cell = content[:MARK_SIZE], content[MARK_SIZE:]
        return from_bytes(cell) if mark == _mark(name, cell) else None

    def find_damaged(self, names: Iterable[str]) -> list[Path]:
        """Return the files of these digests that exist and are not their cells."""
        return [
            path for name in names if is_file(path := self._path(name)) and self.read(name) is None
        ]

    def write(self, name: str, cell: xr.Dataset) -> None:
        """Store a cell, which is then on the disk; OSError if it cannot be written."""
        with replacing(self._path(name)) as unfinished:
            content = to_bytes(cell)
            unfinished.write_bytes(_mark(name, content) + content)

    @contextlib.contextmanager
    def claim(self, name: str, *, wait: bool) -> Iterator[bool]:
        """Claim a cell, so that no other process computes it, too; yield True once it is claimed."""
        # a byte of one file for each cell, which the system releases when this process ends; nothing
        # remains, and shared disks support such locks; without them a cell may be computed twice
        handle = own_file(self.folder / "lock", shared=True)
        try:
            yield lock_byte(handle, int(name[:15], 16), wait=wait)
        finally:
            os.close(handle)

    def tidy(self) -> None:
        """Remove files that killed processes have left unfinished."""
        for path in self.folder.glob(f".*{ENDING}.*.part"):
            unfinished = _UNFINISHED.fullmatch(path.name)
            if unfinished is None or not is_own(path.lstat()):
                continue
            with self.claim(unfinished[1], wait=False) as free:
                if free:
                    path.unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{ENDING}"


def _mark(name: str, content: bytes) -> bytes:
    return hashlib.sha256(name.encode() + content).digest()


def to_bytes(cell: xr.Dataset) -> bytes:
    """Return the content of the file of a cell: an NPZ of its arrays and a header in JSON."""
    header = json.dumps(cell.to_dict(data=False)).encode()
    arrays = {f"v.{name}": variable.values for name, variable in cell.variables.items()}
    stream = io.BytesIO()
    np.savez(
        stream, allow_pickle=False, **{HEADER: np.frombuffer(header, dtype=np.uint8)}, **arrays
    )
    return stream.getvalue()


def from_bytes(content: bytes) -> xr.Dataset:
    """Return the cell in the content of its file."""
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        header = json.loads(file[HEADER].tobytes())
        for name, declared in (*header["coords"].items(), *header["data_vars"].items()):
            declared["data"] = file[f"v.{name}"]
    return xr.Dataset.from_dict(header)
