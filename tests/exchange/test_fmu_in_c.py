"""Units of co-simulation by a host in C, under sanitizers, and what they are made of: nothing of this needs FMPy."""

import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile

import numpy as np
from c_core import SANITIZED, SUPPORT, WARNINGS, core_objects
from golden import refused
from pytest import importorskip, mark, param, skip

import historysim as hs
from historysim.basics.compiler import SAME_BITS, ZIG, compiler

pytestmark = mark.skipif(not compiler(), reason="needs a C compiler")
PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=2e10)
EVENTS = [hs.NormalLoad(0.0, 0.02), hs.TangentialLoad(0.0, 0.0), hs.TangentialLoad(1.0, 2e-3)]


def summits(friction):
    rng = np.random.default_rng(3)
    return hs.Ensemble(
        PAIR,
        rng.normal(0.0, 30e-9, 20),
        rng.uniform(20e-6, 60e-6, 20),
        friction,
        rings=hs.Rings(2, 12),
    )


def patches():
    approach = np.linspace(0, 200e-9, 21)[1:]
    load = np.stack([1e9 * approach**1.5, 2e9 * approach**1.5], axis=1)
    return hs.Patches.from_normal_curves(PAIR, approach, load, load * 1e-9, 0.3)


CONTACTS = {
    "one": lambda: summits(0.2),
    "many": lambda: summits(np.linspace(0.1, 0.4, 20)),
    "patches": patches,
}


def unpacked(source, folder, **options):
    hs.write_fmu(source, folder / "contact.fmu", platforms=[], **options)
    with zipfile.ZipFile(folder / "contact.fmu") as archive:
        archive.extractall(folder)
    return ET.parse(folder / "modelDescription.xml").getroot()  # noqa: S314 - our own


@mark.parametrize(
    "kind, normal, tangential, directions",
    [
        param("many", "load", "load", 1, marks=mark.ci),
        param("one", "load", "displacement", 2, marks=mark.ci),
    ],
)
def test_random_calls_neither_crash_nor_leak(tmp_path, kind, normal, tangential, directions):
    replay = hs.Replay(CONTACTS[kind](), EVENTS, instrument=hs.Instrument(lateral_stiffness=1e6))
    root = unpacked(
        replay, tmp_path, at=1.0, normal=normal, tangential=tangential, directions=directions
    )
    # the memory is the same in all units
    build, memory = core_objects(tuple(compiler()), (*SANITIZED, *WARNINGS), "-std=c11")
    own = [tmp_path / "sources" / name for name in ("unit.c", "fmi2.c")]
    program, host = tmp_path / "host", SUPPORT / "fmu_host.c"
    command = [*build, f"-I{tmp_path / 'sources'}", host, *own, "-x", "none", *memory, "-lm"]
    subprocess.run([*command, "-o", program], check=True)
    done = subprocess.run(
        [program, (tmp_path / "resources").as_uri(), root.get("guid"), "2000"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    done_calls, _, discarded, errors, fatal = map(int, done.stdout.splitlines()[-1].split())
    assert done_calls > 500
    assert discarded > 25
    assert errors > 25
    assert fatal == 0


def test_units_of_variables_are_declared(tmp_path):
    root = unpacked(hs.Replay(CONTACTS["one"](), EVENTS), tmp_path, at=1.0)
    units = {unit.get("name"): dict(unit[0].attrib) for unit in root.iter("Unit")}
    assert units["J"] == {"kg": "1", "m": "2", "s": "-2"}
    reals = {one.get("name"): one[0] for one in root.iter("ScalarVariable") if one[0].tag == "Real"}
    without = {name for name, real in reals.items() if real.get("unit") not in units}
    assert without == {"friction_factor", "slipping_share"}
    assert float(reals["prescribed_normal_load"].get("start")) == 0.02


def test_two_directions_are_refused_where_there_is_one(tmp_path):
    plane = hs.Replay(CONTACTS["one"](), [hs.TangentialDisplacement(0.0, (0.0, 0.0))])
    with refused("directions is 1, and "):
        hs.write_fmu(plane, tmp_path / "a.fmu", directions=1)
    with refused("sliding springs have one tangential direction"):
        hs.reduce(plane)
    assert not list(tmp_path.iterdir())


def test_asperities_that_evolve_are_refused(tmp_path):
    ensemble = hs.Ensemble(PAIR, 0.0, 1e-4, 0.2, follow_sliding=True)
    with refused("friction or summits change"):
        hs.write_fmu(hs.Replay(ensemble, EVENTS), tmp_path / "a.fmu")
    assert not list(tmp_path.iterdir())


MACHINES = {
    # where a library says for which machine it is, and what it says
    "x86_64-linux": (b"\x7fELF", 18, b"\x3e\x00"),
    "aarch64-linux": (b"\x7fELF", 18, b"\xb7\x00"),
    "x86_64-windows": (b"MZ", None, b"PE\x00\x00\x64\x86"),
    "x86_64-darwin": (b"\xcf\xfa\xed\xfe", 4, b"\x07\x00\x00\x01"),
    "aarch64-darwin": (b"\xcf\xfa\xed\xfe", 4, b"\x0c\x00\x00\x01"),
}


@mark.slow
def test_units_are_compiled_for_other_platforms(tmp_path):
    importorskip("ziglang", reason="needs ziglang")
    hs.write_fmu(
        hs.Replay(CONTACTS["one"](), EVENTS), tmp_path / "a.fmu", platforms=list(MACHINES), fmi=3
    )
    with zipfile.ZipFile(tmp_path / "a.fmu") as archive:
        files = {
            name.split("/")[1]: archive.read(name)
            for name in archive.namelist()
            if name.startswith("binaries/")
        }
    assert set(files) == set(MACHINES)
    for name, (magic, place, machine) in MACHINES.items():
        assert files[name].startswith(magic), name
        assert (
            (machine in files[name])
            if place is None
            else files[name][place : place + len(machine)] == machine
        ), name
        assert b"fmi3DoStep" in files[name]
        assert b"pthread_create" not in files[name]


@mark.slow
def test_another_processor_has_the_same_bits(tmp_path):
    importorskip("ziglang", reason="needs ziglang")
    emulator = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    if not emulator:
        skip("needs qemu")
    root = unpacked(hs.Replay(CONTACTS["many"](), EVENTS), tmp_path, at=1.0, tangential="load")
    sources = [tmp_path / "sources" / file.get("name") for file in root.iter("File")]
    words = [(tmp_path / "resources").as_uri(), root.get("guid"), "4000"]
    told = []
    for runner, command in (
        ([], compiler()),
        ([emulator], [*ZIG, "-target", "aarch64-linux-musl", "-static"]),
    ):
        program = tmp_path / f"host{len(told)}"
        flags = ["-O1", *SAME_BITS, f"-I{tmp_path / 'sources'}"]
        subprocess.run(
            [*command, *flags, SUPPORT / "fmu_host.c", *sources, "-lm", "-o", program], check=True
        )
        told.append(
            subprocess.run(
                [*runner, program, *words], capture_output=True, text=True, check=True
            ).stdout
        )
    assert told[0] == told[1]
    assert "state" in told[0]
