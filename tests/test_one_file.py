"""Adding is one file: a copy of the package gets one of each kind, and runs, verifies, tables, draws and reports it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import historysim

ADDED = {
    "asperities/laws/warming.py": '''
"""A law."""
import attrs
from historysim.asperities.laws import LAWS, FrictionLaw
from historysim.basics.fields import Force, Number, at_least


@LAWS.register
@attrs.frozen
class Warming(FrictionLaw):
    """Friction that falls with the load of the asperity."""

    cold: Number = attrs.field(validator=at_least(0.0))
    half_load: Force = attrs.field(validator=at_least(0.0, above=True))

    kind, depends_on, same_bits = "warming", "own", True

    def coefficients(self, loaded):
        return self.cold / (1 + loaded.normal_load / self.half_load)

    @property
    def text(self):
        return f"warming: {self.cold:g}"
''',
    "loads/greasing.py": '''
"""An event."""
import attrs
from historysim.basics.fields import Number, Time
from historysim.loads.events import EVENTS, Event


@EVENTS.register
@attrs.frozen
class Grease(Event):
    """Each summit is lifted by a part of the lowest one's distance from the datum."""

    time: Time
    part: Number

    name, changes_geometry = "grease", True

    def act(self, ensemble, state, *, saturate, instrument):
        height = ensemble.summit_height * self.part
        return ensemble.with_geometry(state, saturate=saturate, summit_height=height, instrument=instrument)
''',
    "scenario/surface_kinds/stairs.py": '''
"""A kind of surface."""
import attrs
import numpy as np
from historysim.basics.fields import Length
from historysim.scenario.surface_kinds import SURFACES, BuiltSurface, SurfaceKind
from historysim.surfaces.summits import Summits


@SURFACES.register
@attrs.frozen
class Stairs(SurfaceKind):
    """Summits on the steps of a stair."""

    step: Length
    radius: Length

    kind = "stairs"

    def build(self, folder):
        return BuiltSurface(Summits(-self.step * np.arange(4), self.radius))
''',
    "surfaces/preparation/flipping.py": '''
"""A step that prepares a map."""
import attrs
from historysim.surfaces.preparation import PREPARATIONS, Preparation


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Flipped(Preparation):
    """What was up is down.

    Attributes
    ----------
    flipped
        Whether heights change their signs.
    """

    flipped: bool = False

    kind, order = "flipped", 1000.0

    def prepare(self, surface, notify):
        return type(surface)(-surface.heights, surface.pixel_size, surface.periodic) if self.flipped else surface
''',
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
    "results/plots/gaps.py": '''
"""A picture."""
import attrs
from historysim.results.plots.pictures import PICTURES, Picture


@PICTURES.register
@attrs.frozen(kw_only=True)
class Gaps(Picture):
    """How far the flat is above the datum of the summits, over time."""

    kind, caption, of = "gaps", "How far the flat is above the datum.", ("history",)

    def draw(self, page, what):
        page.axes().plot(what["time"], what["separation"])
''',
    "tables/from_semicolons.py": '''
"""A reader of tables that are text."""
from contextlib import contextmanager
from historysim.tables.readers import READERS, LineReader


@READERS.register
class Semicolons(LineReader):
    kind, endings = "semicolons", (".semi",)

    @contextmanager
    def opened(self, path, layout):
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
    def opened(self, path, layout):
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
flipped = true
[friction]
coefficient = 0.2
[loading]
file = "loads.semi"
columns = { time = "t", normal_load = { column = "N", unit = "mN" } }
"""
USED = """
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
called("log", "a.history", "--csv", "events.csv")
assert "grease" in Path("events.csv").read_text(encoding="utf-8")
called("table", "a.nc", "largest-gap")
called("plot", "a.nc", "-o", "a.png", "--picture", "gaps")
called("report", "a.nc")
assert "How far the flat is above the datum." in Path("a_report.html").read_text(encoding="utf-8")
history = hs.open("a.nc")
assert history.mean_load.attrs["units"] == "N"
assert abs(float(history.mean_load[-1]) - 1e-3) < 1e-12
plain, flipped = (hs.load("m.toml", {"surface.flipped": each}).surface() for each in (False, True))
assert (plain.surface.heights == -flipped.surface.heights).all()
called("run", "m.toml", "-o", "m.nc", "-q")
called("run", "m.toml", "-o", "n.nc", "-q", "--set", "loading.file=loads.numbers")
assert hs.open("m.nc").total_normal_load.equals(hs.open("n.nc").total_normal_load)
assert called("greet", "all") == "good day, all\\n"
assert "Greet NAME." in called("--help")
"""


def test_one_file_adds_one_of_each(tmp_path):
    package = tmp_path / "historysim"
    shutil.copytree(Path(historysim.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    for name, source in ADDED.items():
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
