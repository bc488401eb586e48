import os
import re
import sys
from decimal import getcontext
from pathlib import Path

import matplotlib as mpl
import numpy as np
from browser import opened  # noqa: F401 - a fixture
from drawn_data import hidden_data
from hypothesis import settings
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from pytest import fixture

from historysim.results import queries
from historysim.results.plots import canvas, figure_output
from historysim.results.report import page
from historysim.scenario.kinds import registries

# the first example of a property may wait for a library to load or for code to be compiled
settings.register_profile("thorough", deadline=None, max_examples=500)
# the same examples each time: what a change is tested with does not depend on luck
settings.register_profile("unhurried", deadline=None, max_examples=20, derandomize=True)
settings.load_profile("unhurried")


@fixture
def alone(monkeypatch):
    """The clock of the tests is a thread that holds no lock of a library: a copy of the process is enough."""
    monkeypatch.setattr("threading.active_count", lambda: 1)


# what tests import is compiled once, also for the processes that they start
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Variables that pytest, and a cluster of dask with its allocator and linear algebra, set for a process.
OF_LIBRARIES = re.compile("PYTEST|__DASK|MALLOC_|[A-Z]+_NUM_THREADS|PYTHONHASHSEED")


def process_state():
    """Return what a test shares with those that run later in its process."""
    names = {name: value for name, value in os.environ.items() if not OF_LIBRARIES.match(name)}
    # the backend is resolved when it is first asked for
    settings = {name: value for name, value in dict.items(mpl.rcParams) if name != "backend"}
    return Path.cwd(), names, settings, np.geterr(), getcontext().prec


def own_queries():
    """Return the names of queries that this package does not declare."""
    return {
        name
        for name, query in queries._declared.items()
        if not query.function.__module__.startswith("historysim.")
    }


@fixture(autouse=True)
def clean_process():  # by its name set up before the others, and left after them
    """Remove classes and queries that a test registers; it leaves its process as it was."""
    before = process_state()
    classes = {group: registry.own() for group, registry in registries().items()}
    declared = own_queries()
    yield
    for group, registry in registries().items():
        for name, kind in registry.own().items():
            if name not in classes[group] and not kind.__module__.startswith("historysim."):
                registry.forget(name)
    for name in own_queries() - declared:
        del queries._declared[name]
    assert process_state() == before


@fixture(autouse=True)
def quick_pictures(request, monkeypatch):
    """Draw pictures without layout and at a low resolution, except where they are checked, or kept."""
    if "plots" in request.path.parts or request.config.getoption("--page", default=False):
        return
    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", lambda *_: {})
    monkeypatch.setattr(canvas, "_fits", lambda _: True)
    for module in (figure_output, page):
        monkeypatch.setattr(module, "DOTS_PER_INCH", 40)


@fixture(autouse=True)
def every_picture_shows_its_data(request, monkeypatch):
    """Whatever a test draws shows its data, unless the test is marked `hides_data`: it draws something else."""
    figures, create = [], Figure.__init__

    def remember(figure, *args, **options):
        create(figure, *args, **options)
        figures.append(figure)

    monkeypatch.setattr(Figure, "__init__", remember)
    yield
    if request.node.get_closest_marker("hides_data") is None:
        assert [fault for figure in figures for fault in hidden_data(figure)] == []
