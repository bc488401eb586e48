"""Adding is one file: a copy of the package gets one of each kind, and runs, verifies, tables, draws and reports it."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import historysim

STRANGER = Path(__file__).parent / "stranger" / "stranger.py"
# Files with a class of the stranger's each, below the decorator that registers it.
OF_THE_STRANGER = {
    "asperities/laws/warming.py": ("Warming", "historysim.asperities.laws", "LAWS"),
    "loads/greasing.py": ("Grease", "historysim.loads.events", "EVENTS"),
    "scenario/surface_kinds/stairs.py": ("Stairs", "historysim.scenario.surface_kinds", "SURFACES"),
    "surfaces/preparation/filling.py": ("Filled", "historysim.surfaces.preparation", "PREPARATIONS"),
    "results/plots/gaps.py": ("Gaps", "historysim.results.plots.pictures", "PICTURES"),
}
ADDED = {
    "recording/pressing.py": '''
"""A recorded quantity."""
from historysim.recording.variables import Variable, register

register(
    Variable(
        "mean_load",
        ("step",),
        "N",
        "mean load of the contacts",
        derived=lambda rows, ensemble, instrument: rows.totals["normal_load"] / len(ensemble),
    )
)
''',
    "results/analysis/resting.py": '''
"""A question."""
from historysim.results.asking import question


@question()
def largest_gap(history):
    """Return the largest separation over time: how far the flat was above the datum."""
    return history.separation.cumulative("step").max()
''',
    "tables/from_semicolons.py": '''
"""A reader of tables that are text."""
from contextlib import contextmanager
from historysim.tables.readers import READERS, LineReader


@READERS.register
class Semicolons(LineReader):
    kind, endings = "semicolons", (".semi",)

    @contextmanager
    def open(self, path, layout):
        yield iter(path.read_text(encoding="utf-8").replace(";", "\\t").splitlines())
''',
    "tables/from_numbers.py": '''
"""A reader of arrays."""
from contextlib import contextmanager
import numpy as np
from historysim.tables.arrays import Array, Contents
from historysim.tables.readers import READERS, TableReader


@READERS.register
class Numbers(TableReader):
    kind, endings = "numbers", (".numbers",)

    @contextmanager
    def open(self, path, layout):
        rows = np.loadtxt(path)
        columns = zip("tN", rows.T)
        yield Contents([Array(name, (len(rows),), lambda part, of=each: of[part]) for name, each in columns])
''',
    "cli/greeting.py": '''
"""A command."""
import click


@click.command()
@click.argument("name")
def greet(name):
    """Greet NAME."""
    click.echo(f"good day, {name}")
''',
}
SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "stairs"
step = "20 nm"
radius = "10 µm"
[friction]
law = "warming"
cold = 0.3
half_load = "2 mN"
[loading]
substeps = 5
waypoints = [
    { time = 0, normal_load = "4 mN" },
    { after = 1, tangential_displacement = "40 nm" },
    { after = 1, tangential_displacement = "-40 nm", grease = 0.5 },
    { after = 1, tangential_displacement = "40 nm" },
]
[[picture]]
kind = "gaps"
"""
MAP = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [16, 16]
pixel_size = "1 µm"
rms_height = "20 nm"
autocorrelation_length = "3 µm"
seed = 1
floor = "-1 nm"
[friction]
coefficient = 0.2
[loading]
file = "loads.semi"
columns = { time = "t", normal_load = { column = "N", unit = "mN" } }
"""
USED = """
import numpy as np
import sys
from pathlib import Path
from click.testing import CliRunner
import historysim as hs
from historysim.cli import main


def called(*arguments):
    done = CliRunner().invoke(main, list(arguments))
    assert done.exit_code == 0, (arguments, done.output, done.exception)
    return done.output


assert str(Path(hs.__file__).parent.parent) == sys.argv[1]
called("run", "s.toml", "-o", "a.nc", "-q")
assert "bit for bit" in called("verify", "a.nc")
assert "grease" in called("log", "a.history")
called("table", "a.nc", "largest-gap")
called("plot", "a.nc", "-o", "a.png", "--picture", "gaps")
called("report", "a.nc")
assert "How far the flat is above the datum." in Path("a_report.html").read_text(encoding="utf-8")
history = hs.open("a.nc")
assert history.mean_load.attrs["units"] == "N"
assert abs(float(history.mean_load[-1]) - 1e-3) < 1e-12
plain, filled = (hs.load("m.toml", {"surface.floor": each}).surface() for each in (-1.0, -1e-9))
assert (np.maximum(plain.surface.heights, -1e-9) == filled.surface.heights).all()
called("run", "m.toml", "-o", "m.nc", "-q")
called("run", "m.toml", "-o", "n.nc", "-q", "--set", "loading.file=loads.numbers")
assert hs.open("m.nc").total_normal_load.equals(hs.open("n.nc").total_normal_load)
assert called("greet", "all") == "good day, all\\n"
assert "Greet NAME." in called("--help")
"""


def of_the_stranger(name, module, registry):
    """Return the source of a file with one class of the stranger's, and the imports that it needs."""
    whole = STRANGER.read_text(encoding="utf-8")
    tree = ast.parse(whole)
    (found,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    used = {each.id for each in ast.walk(found) if isinstance(each, ast.Name)}
    imports = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    needed = [ast.unparse(node) for node in imports if used & {alias.asname or alias.name for alias in node.names}]
    source = whole.splitlines()[found.decorator_list[0].lineno - 1 : found.end_lineno]
    return "\n".join(
        [f'"""{name}."""', *needed, f"from {module} import {registry}", "", f"@{registry}.register", *source]
    )


def test_one_file_adds_one_of_each(tmp_path):
    package = tmp_path / "historysim"
    shutil.copytree(Path(historysim.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    made = {name: of_the_stranger(*given) for name, given in OF_THE_STRANGER.items()}
    for name, source in {**ADDED, **made}.items():
        assert not (package / name).exists()
        (package / name).write_text(source.lstrip(), encoding="utf-8")
    (tmp_path / "s.toml").write_text(SCENARIO, encoding="utf-8")
    (tmp_path / "m.toml").write_text(MAP, encoding="utf-8")
    (tmp_path / "loads.semi").write_text("t;N\n0;1\n1;5\n2;3\n", encoding="utf-8")
    (tmp_path / "loads.numbers").write_text("0 1\n1 5\n2 3\n", encoding="utf-8")
    command = [sys.executable, "-c", USED, str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
