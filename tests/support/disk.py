"""What a disk may hold after a power cut, from a trace (`disk_trace.c`) of what was asked of it.

What was synced stands. Of what was not, anything may stand: every subset of writes, truncations and names, in whatever
order they came; a file may have its new size without the bytes (zeros), and a write may be torn at a sector. A rename
within the disk is one change, as on every file system with a journal. The name of a new file is safe when its folder
was synced, its bytes when it was itself.
"""

import ctypes
import functools
import hashlib
import itertools
import math
import os
import struct
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import ClassVar

import attrs
import numpy as np

SECTOR = 512
ENTRY = struct.Struct("<IIQqQ")
UNFINISHED = ".part"
# Changes at a cut of which each alone may be missing, or be the only one there; of more only the names.
MOST_ONE_BY_ONE = 12
KINDS = ("mark", "open", "write", "truncate", "rename", "unlink", "make_folder", "remove_folder", "link", "sync")

Disk = Mapping[str, bytes | None]  # content by path; None for a folder


@attrs.define(eq=False)
class Node:
    """A file or a folder, which may have several names, or none any more."""

    is_folder: bool = False


@attrs.define(eq=False)
class Naming:
    """Entries of folders that one call has changed together."""

    begun: int
    entries: dict[tuple[Node, str], Node | None]
    safe: float = math.inf
    outcomes: ClassVar = ("whole",)


@attrs.define(eq=False)
class Writing:
    """Bytes written to a file."""

    begun: int
    node: Node
    at: int
    content: bytes
    safe: float = math.inf
    outcomes: ClassVar = ("whole", "size", "beginning", "end")

    def apply(self, file: bytearray, outcome: str) -> None:
        first, last = self.at, self.at + len(self.content)
        file.extend(bytes(max(0, last - len(file))))
        # a boundary between sectors of the disk, where there is one inside
        tear = min(last, (first + len(self.content) // 2) // SECTOR * SECTOR + SECTOR)
        if outcome in {"whole", "beginning"}:
            end = last if outcome == "whole" else tear
            file[first:end] = self.content[: end - first]
        elif outcome == "end":
            file[tear:last] = self.content[tear - first :]


@attrs.define(eq=False)
class Cutting:
    """A file that is cut, or extended with zeros."""

    begun: int
    node: Node
    size: int
    safe: float = math.inf
    outcomes: ClassVar = ("whole",)

    def apply(self, file: bytearray, _: str) -> None:
        file.extend(bytes(max(0, self.size - len(file))))
        del file[self.size :]


Change = Naming | Writing | Cutting
Outcomes = Mapping[Change, str]


class History:
    """All that happened to a folder, from a trace.

    ``begin`` has what stood in the folder, and on the disk, before: of each path its inode, and its content (None for a
    folder).
    """

    def __init__(self, begin: Mapping[str, tuple[int, bytes | None]], trace: bytes, folder: Path) -> None:
        self._prefix = str(folder)
        self.root = Node(is_folder=True)
        self.changes: list[Change] = []
        self.marks: list[tuple[int, str]] = []
        self.calls: list[str] = []
        self._inodes: dict[int, Node] = {folder.stat().st_ino: self.root}
        self._entries: dict[tuple[Node, str], Node | None] = {}
        for path, (inode, content) in sorted(begin.items()):
            node = self._inodes.setdefault(inode, Node(is_folder=content is None))
            self._name(-1, {self._place(f"{folder}/{path}"): node})
            if content is not None:
                self.changes.append(Writing(-1, node, 0, content))
        for change in self.changes:
            change.safe = -1
        at = 0
        while at < len(trace):
            kind, truncates, inode, position, length = ENTRY.unpack_from(trace, at)
            at += ENTRY.size
            self._take(KINDS[kind], trace[at : at + length], inode, position, bool(truncates))
            at += length

    def __len__(self) -> int:
        """Return the number of calls; a cut may come after any of them."""
        return len(self.calls)

    # -- reading the trace -------------------------------------------------------------------------

    def _take(self, kind: str, payload: bytes, inode: int, position: int, truncates: bool) -> None:
        now = len(self.calls)
        if kind == "mark":
            self.marks.append((now, payload.decode()))
            return
        paths = payload.decode().split("\0") if kind in {"open", "rename", "unlink"} or "folder" in kind else []
        self.calls.append(" ".join([kind, *(path.removeprefix(self._prefix) for path in paths)]))
        if kind == "open":
            place = self._place(paths[0])
            if self._entries.get(place) is None:
                self._inodes[inode] = Node()
                self._name(now, {place: self._inodes[inode]})
            elif truncates:
                self.changes.append(Cutting(now, self._inodes[inode], 0))
        elif kind == "write":
            self.changes.append(Writing(now, self._inodes[inode], position, payload))
        elif kind == "truncate":
            self.changes.append(Cutting(now, self._inodes[inode], position))
        elif kind == "rename":
            source, target = map(self._place, paths)
            self._name(now, {source: None, target: self._entries[source]})
        elif kind == "make_folder":
            self._inodes[inode] = Node(is_folder=True)
            self._name(now, {self._place(paths[0]): self._inodes[inode]})
        elif kind in {"unlink", "remove_folder"}:
            self._name(now, {self._place(paths[0]): None})
        elif kind == "sync":
            self._sync(now, inode, payload)
        else:
            raise AssertionError(f"{kind} is not reckoned with")

    def _sync(self, now: int, inode: int, content: bytes) -> None:
        node = self._inodes[inode]
        for change in self.changes:
            touched = [folder for folder, _ in change.entries] if isinstance(change, Naming) else [change.node]
            if node in touched:
                change.safe = min(change.safe, now)
        if not node.is_folder:
            assert self._content(node, self.changes, {}) == content, f"{self.calls[-1]}: writes went past the trace"

    def _name(self, now: int, entries: dict[tuple[Node, str], Node | None]) -> None:
        self.changes.append(Naming(now, entries))
        self._entries.update(entries)

    def _place(self, path: str) -> tuple[Node, str]:
        folder, (*above, name) = self.root, path.removeprefix(f"{self._prefix}/").split("/")
        for part in above:
            found = self._entries[folder, part]
            assert found is not None
            folder = found
        return folder, name

    @functools.cached_property
    def telling_cuts(self) -> list[int]:
        """Cuts just before what makes changes safe or names others: there the most is at stake; and the end."""
        kinds = {"sync", "rename", "unlink", "link"}
        return [*(at for at, call in enumerate(self.calls) if call.split()[0] in kinds), len(self)]

    # -- what a disk may hold ----------------------------------------------------------------------

    def marked(self, cut: int) -> list[str]:
        """Return what had been said when so many calls had returned."""
        return [text for at, text in self.marks if at <= cut]

    def disk(self, cut: int, outcomes: Outcomes) -> Disk:
        """Return what the disk holds after so many calls, where of the changes that were not safe these stand."""
        standing = [change for change in self.changes if change.safe < cut or change in outcomes]
        entries: dict[tuple[Node, str], Node | None] = {}
        for change in standing:
            if isinstance(change, Naming):
                entries.update(change.entries)
        found: dict[str, bytes | None] = {}

        def descend(folder: Node, path: str) -> None:
            for (above, name), node in entries.items():
                if above is folder and node is not None:
                    found[path + name] = None if node.is_folder else self._content(node, standing, outcomes)
                    if node.is_folder:
                        descend(node, f"{path}{name}/")

        descend(self.root, "")
        return found

    def now(self, cut: int) -> Disk:
        """Return what a program sees after so many calls."""
        return self.disk(cut, dict.fromkeys(self._happened(cut), "whole"))

    def disks(self, cut: int, *, samples: int, generator: np.random.Generator) -> Iterator[Disk]:
        """Give disks that a cut after so many calls may leave: the telling ones, then some by chance."""
        loose = [change for change in self._happened(cut) if change.safe >= cut]
        names = [change for change in loose if isinstance(change, Naming)]
        data = [change for change in loose if not isinstance(change, Naming)]
        yield self.disk(cut, dict.fromkeys(loose, "whole"))
        yield self.disk(cut, {})
        yield self.disk(cut, dict.fromkeys(names, "whole"))
        yield self.disk(cut, dict.fromkeys(data, "whole"))
        yield self.disk(cut, dict.fromkeys(names, "whole") | {change: change.outcomes[-1] for change in data})
        yield self.disk(cut, {change: change.outcomes[min(1, len(change.outcomes) - 1)] for change in loose})
        for outcome in ("size", "beginning", "end"):
            if data and outcome in data[-1].outcomes:
                yield self.disk(cut, dict.fromkeys(loose, "whole") | {data[-1]: outcome})
        if samples and cut in self.telling_cuts:
            for one in loose if len(loose) <= MOST_ONE_BY_ONE else names:
                yield self.disk(cut, {one: "whole"})
                yield self.disk(cut, {change: "whole" for change in loose if change is not one})
            for count in range(1, len(loose)):
                yield self.disk(cut, dict.fromkeys(loose[:count], "whole"))
        if len(loose) <= math.log2(samples + 1):
            for chosen in itertools.product((False, True), repeat=len(loose)):
                yield self.disk(cut, dict.fromkeys(itertools.compress(loose, chosen), "whole"))
            return
        for _ in range(samples):
            kept = generator.random() ** 0.5
            yield self.disk(
                cut,
                {change: str(generator.choice(change.outcomes)) for change in loose if generator.random() < kept},
            )

    def _happened(self, cut: int) -> list[Change]:
        return [change for change in self.changes if change.begun < cut]

    @staticmethod
    def _content(node: Node, changes: list[Change], outcomes: Outcomes) -> bytes:
        file = bytearray()
        for change in changes:
            if not isinstance(change, Naming) and change.node is node:
                change.apply(file, outcomes.get(change, "whole"))
        return bytes(file)


def recorded(library: ctypes.CDLL, folder: Path, action: Callable[[Callable[[str], None]], None]) -> History:
    """Do something in a forked process, and record what it asks of a folder; where that fails it is an AssertionError.

    The action is given a function that marks in the trace what a user could know to be done by then.
    """
    begin = {str(path.relative_to(folder)): (path.stat().st_ino, _bytes(path)) for path in folder.rglob("*")}
    into = folder.with_name(f"{folder.name}.trace")
    child = os.fork()
    if not child:
        code = 1
        try:
            library.trace_begin(os.fsencode(folder), os.fsencode(into))
            action(lambda text: library.trace_mark(text.encode()))
            library.trace_end()
            code = 0
        except Exception as error:  # noqa: BLE001 - handed to the parent
            library.trace_end()
            into.write_text(repr(error), encoding="utf-8")
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    assert status == 0, into.read_text(encoding="utf-8")
    history = History(begin, into.read_bytes(), folder)
    into.unlink()
    left = {str(path.relative_to(folder)): _bytes(path) for path in folder.rglob("*")}
    assert history.now(len(history)) == left, "something went past the trace"
    return history


def put(disk: Disk, folder: Path) -> None:
    """Make a folder of what a disk holds."""
    folder.mkdir(parents=True)
    for path, content in sorted(disk.items()):
        if content is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(content)


def digest(disk: Disk) -> bytes:
    """Return what tells disks apart.

    A file that is unfinished by its name counts as there, whatever it holds: nobody reads it.
    """
    found = hashlib.sha256()
    for path, content in sorted(disk.items()):
        read = b"" if content is None or path.endswith(UNFINISHED) else content
        found.update(f"{path}\0{-1 if content is None else len(read)}\0".encode())
        found.update(read)
    return found.digest()


def _bytes(path: Path) -> bytes | None:
    return None if path.is_dir() else path.read_bytes()
