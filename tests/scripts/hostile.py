"""Hostile and careless inputs, by class, with the message and the time that each is to have.

``python tests/scripts/hostile.py [CLASS …]`` carries each out in a separate process, with 2 GB of
memory and the processor time that its class allows, and fails where one ends with a traceback, by a
signal, with another message or exit code than it is to have, too late, or with any file changed
that was there before. POSIX only.
"""

import json
import multiprocessing
import os
import shutil
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

MEMORY = 2 << 30
PATIENCE = 20.0  # seconds on the wall that a process is given in addition to its processor time
WAITS = (0, "waits", "", 0.0)
SCENARIO = """
title = "A ball"
[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.5
[loading]
substeps = 2
waypoints = [
    { time = 0, normal_load = 0.01 },
    { time = 1, tangential_load = 0.003 },
    { time = 2, tangential_load = -0.003 },
    { time = 3, tangential_load = 0.003 },
    { time = 4, tangential_load = -0.003 },
]
"""
MEASURED = (
    SCENARIO[: SCENARIO.index("[loading]")]
    + """
[loading]
file = "{file}"
[loading.columns]
time = "t"
normal_load = {{ column = "F", unit = "mN" }}
"""
)


class Case(NamedTuple):
    """An input: what makes it, the arguments of the command, how it may end, what it then says, and in what time."""

    name: str
    make: Callable[[Path], None]
    arguments: list[str]
    codes: tuple[int, ...] = (2,)
    said: tuple[str, ...] = ()
    seconds: float = 10.0


def nothing(_: Path) -> None:
    """Make nothing further."""


def text(name: str, content: str | bytes) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / name).write_bytes(
            content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        )

    return make


# -- scenarios that are no scenario ----------------------------------------------------------------


def scenarios() -> Iterator[Case]:
    deep = ".".join(["a"] * 100_000)
    for name, content, said in (
        ("key of 100,000 parts", f"{deep} = 1\n", "parts"),
        ("table of 100,000 parts", f"[{deep}]\n", "parts"),
        ("quoted key of 100,000 parts", ".".join(['"a"'] * 100_000) + " = 1\n", "parts"),
        ("array 100,000 deep", "a = " + "[" * 100_000 + "]" * 100_000, "TOML"),
        ("array 100 deep", "a = " + "[" * 100 + "]" * 100, "deep"),
        ("tables 100,000 deep", "a = " + "{a=" * 100_000 + "1" + "}" * 100_000, "TOML"),
        ("unclosed text", 'a = "' + "x" * 1_000_000, "TOML"),
        ("60 MB", "# " + "x" * 60_000_000, "SCENARIO_BYTES"),
        ("a million keys", "".join(f"a{i} = 1\n" for i in range(200_000)), "unknown key"),
        ("empty", "", "is empty"),
        ("a NUL", SCENARIO + "\0", "TOML"),
        ("UTF-16", SCENARIO.encode("utf-16"), "UTF-8"),
        ("half a character", SCENARIO.encode() + b"# \xc3", "UTF-8"),
        ("binary", os.urandom(4096), ""),
        ("doubled table", SCENARIO + "[friction]\n", "TOML"),
        ("one word", "x" * 5_000_000, "TOML"),
    ):
        for command in ("validate", "run"):
            yield Case(
                f"{command} {name}",
                text("s.toml", content),
                [command, "s.toml"],
                (2,),
                (said,),
                30.0,
            )
    for name in (
        "/dev/zero",
        "/dev/null",
        "/dev/urandom",
        "fifo",
        "folder",
        "none.toml",
        "socket",
        "loop",
    ):
        for command in ("validate", "run", "show", "compare", "fit", "sweep", "design", "loops"):
            yield Case(
                f"{command} {name}", _strange, [command, name], (2,), (name.rpartition("/")[2],)
            )


def _strange(folder: Path) -> None:
    os.mkfifo(folder / "fifo")
    (folder / "folder").mkdir()
    (folder / "loop").symlink_to("loop")
    os.mknod(folder / "socket", 0o140600)


# -- tables ----------------------------------------------------------------------------------------


def _replayed(name: str, content: str | bytes) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        text(name, content)(folder)
        text("s.toml", MEASURED.format(file=name))(folder)

    return make


def tables() -> Iterator[Case]:
    blocks = "".join(f"Block {i}\nt,F\n0,1\n1,2\n2,3\n\n" for i in range(1500))
    line = "t,F\n0," + "1" * 200_000_000
    for name, content, said, seconds in (
        ("blocks", blocks, "blocks", 40.0),
        ("line of 200 MB", line, "LINE_BYTES", 10.0),
        (
            "10,000 columns",
            "t,F" + ",c" * 10_000 + "\n" + ("0,1" + ",2" * 10_000 + "\n") * 20,
            "",
            20.0,
        ),
        ("binary", os.urandom(100_000), "", 10.0),
        ("NULs", "t,F\n" + "\0" * 100_000, "", 10.0),
        ("quotes", 't,F\n"' + "0,1\n" * 100_000, "", 30.0),
        ("delimiters", "," * 1_000_000, "", 30.0),
        ("empty", "", "", 10.0),
        ("kinds of lines", "".join(f"K{i},1,2,{i}\n" for i in range(20_000)), "", 30.0),
        (
            "widths",
            "".join(",".join(["1"] * (i % 500 + 1)) + "\n" for i in range(20_000)),
            "",
            30.0,
        ),
        ("infinite", "t,F\n0,inf\n1,nan\n", "", 10.0),
        ("huge", "t,F\n0,1e400\n1,1e308\n", "", 10.0),
        ("falling time", "t,F\n1,1\n0,1\n", "", 10.0),
    ):
        for command in (["columns", "m.csv"], ["run", "s.toml"]):
            make = _replayed("m.csv", content)
            allowed = (0, 2) if command[0] == "columns" or not said else (2,)
            wanted = (said,) if allowed == (2,) else ()
            yield Case(f"{command[0]} {name}", make, command, allowed, wanted, seconds)
    for name, content in (
        ("kinds of records", json.dumps([{f"k{i}": 1, "t": i} for i in range(20_000)])),
        ("doubled keys", "{" + ",".join(f'"k{i}": 1' for i in range(100_000)) + ', "k99999": 2}'),
        ("deep", "[" * 100_000 + "]" * 100_000),
        ("deep objects", '{"a":' * 100_000 + "1" + "}" * 100_000),
        ("number of 100,000 digits", '{"t": [' + "1" * 100_000 + '], "F": [1]}'),
        ("nan", '{"t": [NaN, Infinity], "F": [1, 2]}'),
        ("half", '{"t": [1,'),
    ):
        for command in (["columns", "m.json"], ["run", "s.toml"]):
            yield Case(
                f"{command[0]} JSON {name}", _replayed("m.json", content), command, (0, 2), (), 30.0
            )


# -- HDF5 ------------------------------------------------------------------------------------------


def _hdf5(name: str, fill: Callable[[h5py.File, Path], None]) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / "secret").write_bytes(b"\x00" * 80)
        with h5py.File(folder / name, "w") as file:
            fill(file, folder)
        text("s.toml", MEASURED.format(file=name))(folder)

    return make


def _external(file: h5py.File, folder: Path) -> None:
    file["t"] = np.arange(10.0)
    file.create_dataset("F", (10,), "<f8", external=[(str(folder / "secret"), 0, 80)])


def _virtual(file: h5py.File, folder: Path) -> None:
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = np.arange(10.0)
    layout = h5py.VirtualLayout((10,), "<f8")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "x", (10,))
    file["t"] = np.arange(10.0)
    file.create_virtual_dataset("F", layout)


def _linked(file: h5py.File, folder: Path) -> None:
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = np.arange(10.0)
    file["t"] = np.arange(10.0)
    file["F"] = h5py.ExternalLink(str(folder / "other.h5"), "x")


def _fifo(file: h5py.File, folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    file["t"] = np.arange(10.0)
    file.create_dataset("F", (10,), "<f8", external=[(str(folder / "pipe"), 0, 80)])


def _nested(file: h5py.File, _: Path) -> None:
    group: h5py.Group = file
    for _i in range(3000):
        group = group.create_group("g")


def _circle(file: h5py.File, _: Path) -> None:
    file["a/t"] = np.arange(10.0)
    file["a/again"] = file["a"]


def _claims(file: h5py.File, _: Path) -> None:
    file.create_dataset("t", (10**12,), "<f8", chunks=(1000,))
    file.create_dataset("F", (10**12,), "<f8", chunks=(1000,))


def hdf5() -> Iterator[Case]:
    for fill, said in (
        (_external, ("is stored in other files",)),
        (_virtual, ("is stored in other files",)),
        (_fifo, ("is stored in other files",)),
        (_linked, ()),
        (_nested, ("HDF5_DEPTH",)),
        (_circle, ()),
        (_claims, ()),
    ):
        # h5py reads .h5; netCDF4 cannot tell what is stored in other files
        for name, named in (("m.h5", said), ("m.nc", ())):
            for command in (
                ["columns", name],
                ["run", "s.toml"],
                ["show", name],
                ["plot", name],
                ["report", name],
            ):
                told = named if command[0] == "columns" else ()
                codes = (2,) if told or command[0] not in {"columns", "run"} else (0, 2)
                yield Case(
                    f"{command[0]} {fill.__name__[1:]} {name}",
                    _hdf5(name, fill),
                    command,
                    codes,
                    told,
                )


# -- logs and results ------------------------------------------------------------------------------

FORGERIES = {
    "a view in the place of a table": "DROP TABLE snapshot; "
    "CREATE VIEW snapshot AS SELECT zeroblob(900000000) AS number",
    "a foreign trigger": "CREATE TRIGGER t AFTER INSERT ON batch BEGIN UPDATE batch SET value = x'00'; END",
    "another table": "CREATE TABLE notes (x)",
    "no table": "DROP TABLE batch",
    "a head of JSON": "DROP TRIGGER no_update_of_head; UPDATE head SET settings = '[]'",
    "a head that is deep": "DROP TRIGGER no_update_of_head; UPDATE head SET settings = "
    "replace(hex(zeroblob(50000)), '0', '[')",
    "a head of bytes": "DROP TRIGGER no_update_of_head; UPDATE head SET settings = x'ff00'",
    "NaN": "DROP TRIGGER no_update_of_batch; UPDATE batch SET value = x'000000000000f87f000000000000f87f'",
    "no batch": "DROP TRIGGER no_delete_of_batch; DELETE FROM batch",
    "no head": "DROP TRIGGER no_delete_of_head; DELETE FROM head",
    "shapes": "DROP TRIGGER no_update_of_array; UPDATE array SET shape = '[1000000000000]'",
    "arrays of text": "DROP TRIGGER no_update_of_array; UPDATE array SET content = 'text'",
    "a large array": "DROP TRIGGER no_update_of_array; UPDATE array SET content = zeroblob(50000000)",
}
FORGED_HEADS = {
    "substeps": 10**18,
    "contact_modulus": "much",
    "shear_modulus": 1e-320,
    "tolerance": None,
    "record": {"a": 1},
    "title": ["\x1b[31m"],
    "scenario": 3,
    "made_with": None,
    "metadata": {"a": 1},
    "surface_attributes": "none",
    "lateral_stiffness": "stiff",
    "saturate": "yes",
    "format": 99,
    "seed": {"x": 1},
    "friction_law": {"law": "none"},
}


def forged_log(path: Path, statements: str) -> None:
    """Carry statements out in a log."""
    connection = sqlite3.connect(path)
    connection.executescript(statements)
    connection.close()


def forged_head(path: Path, settings: dict[str, object]) -> None:
    """Write other settings into a log whose digests agree with them."""
    from historysim.log import canonical
    from historysim.log.header import LogHeader

    connection = sqlite3.connect(path)
    told = json.loads(connection.execute("SELECT settings FROM head").fetchone()[0]) | settings
    rows = connection.execute("SELECT name, shape, content FROM array").fetchall()
    arrays = {
        name: np.frombuffer(content, "<f8").reshape(json.loads(shape))
        for name, shape, content in rows
    }
    head = LogHeader(told, arrays)
    for trigger in ("no_update_of_head", "no_update_of_chain"):
        connection.execute(f"DROP TRIGGER {trigger}")
    connection.execute("UPDATE head SET settings = ?", (head.text,))
    connection.execute("UPDATE chain SET link = ? WHERE number = 0", (head.link,))
    link = head.link
    for number, *row in connection.execute("SELECT * FROM batch ORDER BY number").fetchall():
        link = canonical.link(link, row[0], canonical.Columns(*row[1:]))
        connection.execute("UPDATE chain SET link = ? WHERE number = ?", (link, number))
    connection.commit()
    connection.close()


def logs() -> Iterator[Case]:
    commands = (
        ["verify", "a.history"],
        ["show", "a.history"],
        ["log", "a.history"],
        ["state", "a.history"],
    )
    others = (["run", "a.history", "-o", "out.nc"],)
    for name, statements in FORGERIES.items():
        for command in (*commands, *others):
            yield Case(
                f"{command[0]} log with {name}",
                lambda at, s=statements: forged_log(at / "a.history", s),
                command,
                (2,),
            )
    for name, value in FORGED_HEADS.items():
        for command in (*commands, *others):
            make = lambda at, n=name, v=value: forged_head(at / "a.history", {n: v})  # noqa: E731
            yield Case(f"{command[0]} log with {name} forged", make, command, (2,), ("a.history",))
    for name, content in (
        ("empty", b""),
        ("half", b"SQLite format 3\x00"),
        ("noise", b"SQLite format 3\x00" * 500),
    ):
        for command in commands:
            yield Case(f"{command[0]} log {name}", text("a.history", content), command)


def results() -> Iterator[Case]:
    commands = (
        ["show", "a.nc"],
        ["plot", "a.nc", "-o", "x.svg"],
        ["report", "a.nc"],
        ["table", "a.nc", "slip-onset"],
    )
    for name in (
        "title",
        "validity",
        "contact_modulus",
        "source",
        "scenario",
        "historysim_version",
    ):
        for value in (3.5, [1, 2], "\x1b[31m", ""):
            for command in commands:

                def make(folder: Path, name: str = name, value: object = value) -> None:
                    with h5py.File(folder / "a.nc", "r+") as file:
                        file.attrs[name] = value

                yield Case(f"{command[0]} result with {name} = {value!r}", make, command, (0, 2))
    for name in ("time", "total_normal_load", "contact_count", "asperity", "separation"):
        for command in commands:

            def drop(folder: Path, name: str = name) -> None:
                with h5py.File(folder / "a.nc", "r+") as file:
                    file.move(name, "elsewhere")

            yield Case(f"{command[0]} result without {name}", drop, command, (2,))

    for command in (*commands, ["verify", "a.nc"], ["run", "s.toml", "-o", "a.nc"]):
        for mark, beyond in ((b"GCOL", 16), (b"TREE\x01", 7)):
            said = ("a.nc",) if mark == b"GCOL" else ()
            make = lambda at, m=mark, b=beyond: zeroed(at / "a.nc", m, b)  # noqa: E731
            yield Case(
                f"{command[0]} result with zeros after {mark!r}", make, command, (0, 2), said
            )


def zeroed(path: Path, mark: bytes, beyond: int) -> None:
    """Put 64 zeros into a file, so far behind the last mark."""
    content = bytearray(path.read_bytes())
    begin = content.rindex(mark) + beyond
    content[begin : begin + 64] = bytes(64)
    path.write_bytes(content)


CLASSES: dict[str, Callable[[], Iterator[Case]]] = {
    each.__name__: each for each in (scenarios, tables, hdf5, logs, results)
}


def carried_out(case: Case, folder: Path, answer: "multiprocessing.connection.Connection") -> None:
    """Carry a case out in this process, with what it may take, and tell how it ended."""
    import resource

    from click.testing import CliRunner

    from historysim.cli import main

    os.chdir(folder)
    seconds = int(case.seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    memory = MEMORY + pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    begin = time.process_time()
    done = CliRunner().invoke(main, case.arguments)
    spent = time.process_time() - begin
    unexpected = done.exception is not None and not isinstance(done.exception, SystemExit)
    answer.send(
        (done.exit_code, repr(done.exception) if unexpected else "", done.stderr[-2000:], spent)
    )


def wrong(case: Case, made: Path) -> str:
    """Return what is wrong with how a case ends; empty where nothing is."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(made, folder, dirs_exist_ok=True)
        case.make(folder)
        before = _content(folder)
        context = multiprocessing.get_context("fork")
        ours, theirs = context.Pipe()
        process = context.Process(target=carried_out, args=(case, folder, theirs))
        process.start()
        theirs.close()
        limit = 3 * case.seconds + PATIENCE
        answer = _received(ours) if ours.poll(limit) else WAITS
        process.join(5 if answer is not WAITS else 0)
        if process.is_alive():
            process.kill()
            return f"waits, or takes longer than {limit:g} s"
        if answer is None:
            return f"ends without an answer, by signal or exit code {process.exitcode}"
        code, raised, said, spent = answer
        after = _content(folder)
        changed = [path for path, there in before.items() if code and after.get(path) != there]
        checks = {
            f"ends with {raised[:300]}": bool(raised),
            f"ends with code {code}: {said[-200:]!r}": code not in case.codes,
            f"says {said[-200:]!r}": bool(code)
            and not said.startswith(("Error: ", "Usage: ", "Note: ")),
            "steers the terminal": "\x1b" in said,
            f"does not say {case.said}: {said[-300:]!r}": any(
                each not in said for each in case.said
            ),
            f"took {spent:.1f} s; {case.seconds:g} s allowed": spent > case.seconds,
            f"changed {changed}": bool(changed),
        }
        return next((problem for problem, is_wrong in checks.items() if is_wrong), "")


def _received(ours: "multiprocessing.connection.Connection") -> tuple[int, str, str, float] | None:
    try:
        return ours.recv()
    except EOFError:
        return None


def _content(folder: Path) -> dict[str, object]:
    return {
        path.name: path.read_bytes()
        if path.is_file() and path.stat().st_size < 1 << 24
        else path.lstat().st_size
        for path in folder.iterdir()
    }


def cases(chosen: list[str]) -> list[tuple[str, Case]]:
    """Return the cases of some classes, or of all."""
    return [(name, case) for name in chosen or CLASSES for case in CLASSES[name]()]


def main() -> int:
    """Carry all out, and return how many are wrong."""
    import historysim as hs
    from historysim.results import accessor  # noqa: F401 - imported once for all that are forked

    failures, chosen = 0, cases(sys.argv[1:])
    with tempfile.TemporaryDirectory() as name:
        made = Path(name)
        text("s.toml", SCENARIO)(made)
        hs.run(made / "s.toml", made / "a.nc").close()
        for kind, case in chosen:
            if problem := wrong(case, made):
                failures += 1
                print(f"{kind}: {case.name}: {problem}", flush=True)
    print(f"{len(chosen)} inputs, {failures} wrong")
    return failures


if __name__ == "__main__":
    sys.exit(1 if main() else 0)
