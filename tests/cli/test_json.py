"""What the commands print as JSON, and what they say that they do."""

import json
import logging
from pathlib import Path

from click.testing import CliRunner
from pytest import fixture, mark

import historysim as hs
from historysim.cli import main
from historysim.cli.exit_codes import GROUPS

SCENARIO = """
title = "two"
materials = { contact_modulus = "40 GPa", shear_modulus = "8 GPa" }
friction = { coefficient = 0.2 }

[surface]
kind = "summits"
height = ["0 nm", "-20 nm"]
radius = "10 µm"

[loading]
substeps = 10
waypoints = [
    { time = 0.0, normal_load = "4 mN" },
    { time = 1.0, tangential_displacement = "30 nm" },
    { time = 2.0, tangential_displacement = "-30 nm" },
    { time = 3.0, tangential_displacement = "30 nm" },
]
"""
COMMANDS = {
    "show a scenario": ["show", "s.toml"],
    "show a result": ["show", "s.nc"],
    "validate": ["validate", "s.toml"],
    "run": ["run", "s.toml", "-o", "again.nc"],
    "verify": ["verify", "s.nc"],
    "loops": ["loops", "s.nc"],
    "state": ["state", "s.history", "--at", "1.5 s"],
    "state of an asperity": ["state", "s.history", "--asperity", "0"],
    "log": ["log", "s.history"],
    "table": ["table", "s.nc", "slip-onset"],
}


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    (folder / "s.toml").write_text(SCENARIO, encoding="utf-8")
    hs.run(folder / "s.toml", folder / "s.nc").close()
    return folder


@fixture(autouse=True)
def folder(made, monkeypatch):
    monkeypatch.chdir(made)


def asked(*arguments):
    done = CliRunner().invoke(main, [*arguments, "--json"])
    assert done.exit_code == 0, done.output

    def refused(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(done.stdout, parse_constant=refused)


@mark.parametrize("arguments", COMMANDS.values(), ids=COMMANDS)
def test_each_command_prints_one_object_of_one_schema(arguments):
    found = asked(*arguments)
    assert set(found) - {"data"} == {"lines", "tables", "files"}
    for line in found["lines"]:
        assert set(line) in ({"label", "text"}, {"label", "text", "value", "unit"})
    for table in found["tables"]:
        assert set(table) == {"columns", "rows"}
        assert all(len(row) == len(table["columns"]) for row in table["rows"])
    assert all(Path(name).exists() for name in found["files"])


def test_quantities_keep_their_numbers():
    lines = {line["label"]: line for line in asked("state", "s.history", "--at", "1.5 s")["lines"]}
    with hs.EventLog("s.history") as log:
        state = log.state(at=1.5)
    assert (lines["normal load"]["value"], lines["normal load"]["unit"]) == (state.normal_load, "N")
    assert lines["tangential load"]["value"] == state.tangential_load
    assert lines["normal load"]["text"] == "4 mN"


def test_all_numbers_come_with_their_units():
    data = asked("loops", "s.nc")["data"]
    found = hs.loops("s.nc").to_dataset()
    assert (
        data["data_vars"]["dissipated_energy"]["data"] == found["dissipated_energy"].values.tolist()
    )
    assert data["data_vars"]["dissipated_energy"]["attrs"]["units"] == "J"


def test_progress_is_logged_on_request(caplog):
    with caplog.at_level(logging.INFO, logger="historysim"):
        assert CliRunner().invoke(main, ["-v", "run", "s.toml", "-o", "v.nc", "-q"]).exit_code == 0
    said = [record.getMessage() for record in caplog.records]
    assert "s.toml: the surface is made, 4 events are read" in said
    assert any(line.startswith("v.nc: written, ") for line in said)


def test_the_program_without_arguments_shows_first_steps():
    done = CliRunner().invoke(main, [])
    assert done.exit_code == 0
    assert "a measured record      historysim columns record.csv" in done.output


def test_help_lists_the_commands_in_the_order_of_use():
    lines = CliRunner().invoke(main, ["-h"]).output.splitlines()
    assert "  Exit codes: 0 done, 1 the loads cannot be carried out, 2 bad input, 130" in lines
    titles = [line for line in lines if line and not line.startswith(" ") and line.endswith(":")]
    assert titles == [f"{title}:" for title in ("Options", *GROUPS)]
    listed = [line for line in lines[lines.index("Begin:") :] if line.startswith("  ")][:-2]
    # one whole line each
    assert len(listed) == len(main.sources)
    assert all(line.endswith(".") for line in listed)
