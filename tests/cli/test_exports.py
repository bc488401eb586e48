"""The commands fmu and reduce."""

import contextlib
import json
import re
import zipfile

from c_core import ROOT
from click.testing import CliRunner

import historysim as hs
from historysim.cli import main
from historysim.exchange.fmu import unit_file

SCENARIO = ROOT / "scenarios" / "03_constant_load.toml"


def said(folder, *words, code=0):
    with contextlib.chdir(folder):
        done = CliRunner().invoke(main, [*map(str, words)])
    assert done.exit_code == code, done.output
    assert "Traceback" not in done.stderr
    return done.stdout if code == 0 else done.stderr


def test_reduce_tells_its_bound_and_writes_all_files(tmp_path):
    files = ["model.json", "model.nc"]
    options = [word for name in files for word in ("-o", name)]
    told = said(tmp_path, "reduce", SCENARIO, "--elements", 8, *options, "-o", "model.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*files, "model.png"])
    assert "for every history at that normal load" in told
    model = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert f"{model['bound_of_load_over_friction_limit']:.3g} of the friction limit" in told
    answer = json.loads(said(tmp_path, "reduce", SCENARIO, "--elements", 8, "--json"))
    assert answer["data"]["data_vars"]["stiffness"]["data"] == model["stiffness_N_per_m"]
    assert (tmp_path / "model.png").stat().st_size > 1000


def test_fmu_starts_from_a_state_of_a_log(tmp_path, monkeypatch):
    monkeypatch.setattr(unit_file, "compile_unit", lambda *_: b"")
    said(tmp_path, "run", SCENARIO, "-o", "out.nc", "-q")
    for number, name in enumerate((SCENARIO, "out.nc", "out.history")):
        assert f"{number}.fmu" in said(
            tmp_path, "fmu", name, "--at", "12.5 s", "-o", f"{number}.fmu"
        )
    states = {
        zipfile.ZipFile(tmp_path / f"{number}.fmu").read("resources/contact.bin")
        for number in range(3)
    }
    assert len(states) == 1
    notes = []
    hs.write_fmu(tmp_path / "out.nc", tmp_path / "late.fmu", at="1 h", notify=notes.append)
    assert [re.sub(r"at \S+ s", "at … s", note) for note in notes] == [
        "out: its last event is at … s; the unit starts from the state after it"
    ]
