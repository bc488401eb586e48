"""Leaf rooms: what nothing else needs is taken away in a copy of the package, and what is left runs."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from import_graph import ROOT, package_imports

LEAVES = {
    "FMU": ["exchange/fmu"],
    "reduced models": ["exchange/reduced"],
    "report": ["results/report"],
    "gallery": ["studies/gallery.py"],
    "design studies": ["studies/design.py"],
    "adhesion theory": ["contact/adhesion*", "asperities/adhering.py", "results/plots/adhesion*.py"],
    "controllers and batches": ["coupling.py", "asperities/contact_batch.py"],
}
COMMANDS = "cli"  # may import any room where a command is called
# How modules begin that import a leaf where it is asked for, beside commands.
CALLERS = {
    # types register their pages
    "report": ("verbs", "scenario.fit", "studies.gallery", "exchange.reduced."),
    "design studies": ("studies.validation",),
    "adhesion theory": ("scenario.built", "scenario.figure", "scenario.picture_section"),
}
SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [16, 16]
pixel_size = "1 µm"
rms_height = "10 nm"
autocorrelation_length = "5 µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "5 mN" }, { time = 1, tangential_displacement = "5 nm" }]
"""
USED = """
import sys
import historysim as hs
from click.testing import CliRunner
from historysim.cli import main

assert hs.__file__.startswith(sys.argv[1]), hs.__file__
for command in (["validate", "s.toml"], ["run", "s.toml", "-o", "r.nc"], ["show", "r.nc"], ["verify", "r.nc"],
                ["table", "r.nc", "slip-shares"], ["plot", "r.nc"], ["--help"]):
    done = CliRunner().invoke(main, command, catch_exceptions=False)
    assert done.exit_code == 0, (command, done.output)
"""


def files_of(leaf):
    found = [path for pattern in LEAVES[leaf] for path in ROOT.glob(pattern)]
    assert len(found) >= len(LEAVES[leaf]), f"{leaf} has moved"
    return found


def run_without(leaves, folder):
    """Run a scenario, and what users do with its result, in a copy of the package without some of its rooms."""
    gone = {path for leaf in leaves for path in files_of(leaf)}

    def left_out(parent, names):
        return [name for name in names if Path(parent, name) in gone or name == "__pycache__"]

    shutil.copytree(ROOT, folder / "historysim", ignore=left_out)
    (folder / "s.toml").write_text(SCENARIO, encoding="utf-8")
    command = [sys.executable, "-c", USED, str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_rest_runs_without_any_leaf(tmp_path):
    run_without(LEAVES, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("leaf", LEAVES)
def test_the_rest_runs_without_a_leaf(tmp_path, leaf):
    run_without([leaf], tmp_path)


@pytest.mark.parametrize("leaf", LEAVES)
def test_nothing_in_the_core_imports_a_leaf(leaf):
    inside = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in files_of(leaf)}

    def is_inside(name):
        return any(name == one or name.startswith(f"{one}.") for one in inside)

    allowed = (f"{COMMANDS}.", *CALLERS.get(leaf, ()))
    found = [name for name, (own, _) in package_imports().items() if not is_inside(name) and any(map(is_inside, own))]
    assert [name for name in found if not name.startswith(allowed)] == []
