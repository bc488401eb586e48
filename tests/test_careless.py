"""What users get wrong, by the shell, in files of numbers, and in Python: the message says what to write instead."""

import numpy as np
import xarray as xr
from click.testing import CliRunner
from golden import check_messages
from pytest import fixture, mark

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


@mark.usefixtures("folder")
@mark.parametrize(
    "words, mend",
    [
        ("rnu my.toml", "'rnu'; did you mean 'run'?"),
        ("help run", "Expected historysim run --help"),
        ("my.toml", "my.toml is a file; expected a command before it: historysim run"),
        ("-o out.nc run my.toml", "Options of a command follow its name."),
        ("run my.toml out.nc", "a file to write as -o out.nc"),
        ("run my.toml --substeps 10", "A key of the scenario is set by --set KEY=VALUE."),
        (
            "run my.toml --set friction.coefficient 0.3",
            "expected KEY=VALUE, such as friction.coefficient=0.3",
        ),
        ("run my.toml --set substeps=3", "substeps: unknown key; did you mean loading.substeps?"),
        (
            "run my.toml --set friction.law=stribeck",
            "one of your own is an entry point of 'historysim.laws'",
        ),
        (
            "run my.toml --set friction=0.3",
            "friction: 0.3; expected a table, such as [friction] with its keys below",
        ),
        (
            "validate m.toml --set loading.normal_load=3",
            "expected columns.normal_load = { constant = … }",
        ),
        (
            "validate my.toml --set loading.normal_load=3",
            "expected it in a waypoint, as { time = 0, normal_load = … }",
        ),
        ("validate my.toml m.toml", "Expected only SCENARIO"),
        ("state my.history 1.5", "a time is given as --at 1.5"),
        ("log state my.history", "Expected historysim state, without log before it."),
        (
            "show r.csv",
            'is a record with the columns "t", "N_mN", "x", not a height map; expected historysim col',
        ),
        ("show map.txt", "in the shell --height-unit nm"),
        (
            "columns map.txt",
            "32 columns without names; if this is a height map: historysim show map.txt",
        ),
        ("loops r.csv", "`historysim columns r.csv -o my.toml` writes a scenario"),
        (
            "validate m.toml --set loading.file=bare.csv",
            "set header = 0, and give columns by position",
        ),
        (
            "validate m.toml --set loading.columns.normal_load.unit=V",
            "the value of 1 V, as '2.5 mN'",
        ),
        (
            'validate m.toml --set loading.delimiter=";"',
            "expected the delimiter ',', which occurs in the header",
        ),
        (
            'validate m.toml --set loading.columns.normal_load="50 mN"',
            "a value that does not change is { constant =",
        ),
        (
            "validate m.toml --set loading.columns.time=\"'1'\"",
            "a position has no quotes, as { column = 1 }",
        ),
        (
            "validate m.toml --set loading.columns.normal_load=N_mN",
            "column 'N_mN': taken in N; did you mean unit =",
        ),
        (
            "validate m.toml --set loading.sheet=1",
            "loading.sheet: r.csv: belongs to a workbook (.xlsx, .ods)",
        ),
        (
            "validate m.toml --set loading.file=p.png",
            "p.png: is a picture; expected a file of numbers",
        ),
    ],
)
def test_a_command_suggests_the_right_arguments(words, mend):
    import shlex

    assert mend in said(*shlex.split(words))


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
