"""Zarr stores on disk: checksums of their metadata, missing chunks, foreign members, and replacement.

Chunks have checksums of their own (crc32c). The group ``checksums`` holds those of all other files;
a store that another program has written has no such group.
"""

import hashlib
import itertools
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from historysim.errors import InputError

CHECKSUMS, METADATA = "checksums", "zarr.json"


def _text(digests: Mapping[str, str]) -> bytes:
    group = {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": {"sha256": dict(sorted(digests.items()))},
    }
    return json.dumps(group, indent=1).encode()


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write_checksums(store: Path) -> None:
    """Write the checksums of the metadata of all members of a complete store."""
    digests = {
        str(path.relative_to(store).as_posix()): _digest(path) for path in store.rglob(METADATA)
    }
    (store / CHECKSUMS).mkdir()
    (store / CHECKSUMS / METADATA).write_bytes(_text(digests))


def _checksums(store: Path) -> Mapping[str, str] | None:
    """Return the checksums of a store; None if it has none. InputError if they are damaged."""
    path = store / CHECKSUMS / METADATA
    if not path.parent.exists():
        return None
    try:
        content = path.read_bytes()
        digests: dict[str, str] = json.loads(content)["attributes"]["sha256"]
        if content == _text(digests):
            return digests
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    raise InputError(f"{path} is damaged")


def check_store(store: Path) -> None:
    """Raise InputError if metadata of a store differ from their checksums, or a chunk is missing.

    Stores of other programs, which leave out chunks without values, are not checked.
    """
    digests = _checksums(store)
    for name, digest in (digests or {}).items():
        path = store / name
        try:
            changed = _digest(path) != digest
        except OSError as error:
            raise InputError(f"{path} cannot be read ({error.strerror})") from error
        if changed:
            raise InputError(
                f"{path} was changed since it was written; where that was intended, remove the folder "
                f"{store / CHECKSUMS}, which checks it"
            )
        missing = next((chunk for chunk in _chunks(path) if not chunk.exists()), None)
        if missing is not None:
            raise InputError(f"the chunk {missing} is missing")


def _chunks(path: Path) -> Iterator[Path]:
    """Yield the paths of all chunks of the array with this metadata; none of a group."""
    metadata: dict[str, Any] = json.loads(path.read_bytes())
    if metadata["node_type"] != "array":
        return
    sizes = metadata["chunk_grid"]["configuration"]["chunk_shape"]
    counts = (
        range(-(-length // size)) for length, size in zip(metadata["shape"], sizes, strict=True)
    )
    for position in itertools.product(*counts):
        yield path.parent.joinpath("c", *map(str, position))


def foreign_member(store: Path) -> str:
    """Return the relative path of a member that historysim has not written into a store; empty if there is none."""
    digests = _checksums(store)
    if digests is None:
        return METADATA
    expected = {store / name for name in (*digests, f"{CHECKSUMS}/{METADATA}")}
    expected |= {chunk for name in digests for chunk in _chunks(store / name)}
    folders = {parent for path in expected for parent in path.parents}
    for folder, names, files in os.walk(store):
        for path in (Path(folder, name) for name in (*names, *files)):
            known = folders if path.is_dir() else expected
            if path.is_symlink() or path not in known:
                return str(path.relative_to(store))
    return ""


def identify(store: Path) -> tuple[int, ...]:
    """Return the identity of a store, which changes when it is replaced; InputError if it is missing."""
    try:
        status = (store / METADATA).stat()
    except OSError as error:
        raise InputError(
            f"{store}: is not there any more ({error.strerror}); open it again"
        ) from error
    return status.st_dev, status.st_ino, status.st_mtime_ns
