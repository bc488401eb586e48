"""What users get wrong, by the shell, in files of numbers, and in Python: the message says what to write instead."""

import shlex

import numpy as np
import xarray as xr
from click.testing import CliRunner
from golden import check_messages
from pytest import fixture

import historysim as hs
from historysim.cli import main

BALL = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
"""
WAYPOINTS = (
    'waypoints = [{ time = 0, normal_load = "50 mN" }, { time = 1, tangential_load = "5 mN" }]\n'
)
MEASURED = """file = "r.csv"
[loading.columns]
time = "t"
normal_load = { column = "N_mN", unit = "mN" }
tangential_displacement = { column = "x", unit = "nm" }
"""
ROWS = [(0.1 * i, 50.0, 7.5 * i) for i in range(60)]
TABLE = "t,N_mN,x\n" + "".join(f"{t:g},{load:g},{x:g}\n" for t, load, x in ROWS)


@fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.toml").write_text(BALL + WAYPOINTS, encoding="utf-8")
    (tmp_path / "m.toml").write_text(BALL + MEASURED, encoding="utf-8")
    (tmp_path / "r.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "bare.csv").write_text(TABLE.partition("\n")[2], encoding="utf-8")
    (tmp_path / "p.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    np.savetxt(tmp_path / "map.txt", np.arange(1024.0).reshape(32, 32) % 7)
    return tmp_path


def said(*words):
    result = CliRunner().invoke(main, words, prog_name="historysim")
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return " ".join(result.output.split())


def shell(words):
    """Carry out a command, which is refused."""
    raise hs.InputError(said(*shlex.split(words)))


def test_files_of_numbers_that_are_written_in_other_ways(folder):
    (folder / "r.csv").write_bytes(TABLE.encode("utf-16-le"))
    assert "valid" in said("validate", "m.toml")
    columns = zip(*(line.split(",") for line in TABLE.splitlines()), strict=True)
    (folder / "r.csv").write_text(
        "\n".join(",".join(column) for column in columns), encoding="utf-8"
    )
    assert "expected one line for each sample: transpose the file" in said("validate", "m.toml")
    (folder / "r.csv").write_text(TABLE.replace("3,50,", "PAUSE,,", 1), encoding="utf-8")
    assert "remove the lines between blocks to join them" in said("validate", "m.toml")
    (folder / "r.csv").write_text("", encoding="utf-8")
    assert "it is empty" in said("columns", "r.csv")


def test_messages(folder):
    contact = hs.Ensemble(
        hs.MaterialPair(hs.material("silicon"), hs.material("silica")), 0.0, 1e-5, 0.2
    )
    history = hs.replay(contact, [hs.NormalLoad(0, 1e-3)])
    check_messages({**globals(), "contact": contact, "history": history, "xr": xr})
    assert (folder / "my.toml").read_text(encoding="utf-8") == BALL + WAYPOINTS
