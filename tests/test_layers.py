"""Data flows one way: a module imports only from modules above it."""

import ast
import collections
import re
from pathlib import Path

from import_graph import ROOT, imports, modules, package_imports, parsed
from pytest import mark

# the packages, from the top down: each imports from those above it alone
PACKAGES = (
    "errors",
    "basics",
    "tables",
    "contact",
    "memory",
    "surfaces",
    "interaction",
    "asperities",
    "coupling",
    "loads",
    "recording",
    "replaying",
    "log",
    "measured",
    "results",
    "scenario",
    "verbs",
    "studies",
    "exchange",
    "cli",
)
ANYONE = "_version"
FREE = ("", "__main__")
READERS = ("results.analysis", "results.plots.swept")
ENGINE = {"memory", "asperities", "recording", "replaying", "log", "scenario"}
SCHEMA = "recording.variables"  # names, dimensions and types of the variables of a Dataset
LONGEST_LOOP = 200
HEAVY = {"numpy", "scipy", "xarray", "netCDF4", "matplotlib", "pint", "tqdm", "h5py", "nptdms"}


def package_of(name):
    """The package of a module."""
    return name.split(".")[0]


def circle(graph):
    """Modules that import one another in a circle, or none."""
    left = {name: set(targets) & set(graph) - {name} for name, targets in graph.items()}
    while free := {name for name, targets in left.items() if not targets}:
        left = {name: targets - free for name, targets in left.items() if name not in free}
    return sorted(left)


def complaints(root):
    """What is wrong with the imports of a package."""
    found = []
    graph = {name: own for name, (own, _) in imports(root).items() if name not in (*FREE, ANYONE)}
    for name, own in graph.items():
        if package_of(name) not in PACKAGES:
            found.append(
                f"{name} is in no package of the table; move it into one, below the packages it imports"
            )
            continue
        for target in sorted(own - {name, ANYONE}):
            if target in FREE:
                found.append(
                    f"{name} imports the package itself; import the module that defines the name"
                )
            elif package_of(target) in PACKAGES and PACKAGES.index(
                package_of(target)
            ) > PACKAGES.index(package_of(name)):
                found.append(f"{name} imports {target}, which is below it")
    for own_package in PACKAGES:
        inside_it = {name: own for name, own in graph.items() if package_of(name) == own_package}
        if names := circle(inside_it):
            found.append(f"{', '.join(names)} import one another in a circle")
    return found


def reachable(graph, start):
    """Modules that are imported by, or through, those to start from."""
    found, waiting = set(), list(start)
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        parents = {".".join(name.split(".")[:count]) for count in range(name.count(".") + 1)}
        waiting.extend(graph[name][0] | parents if name else graph[name][0])
    return found


def heavy_at_start(root):
    """Modules that the command line imports at its start, with the heavy packages that they import."""
    graph = imports(root, top_level=True)
    start = {name: graph[name][1] & HEAVY for name in reachable(graph, ["cli"])}
    return {name: heavy for name, heavy in start.items() if heavy}


def test_every_module_imports_only_from_above():
    assert complaints(ROOT) == []


def test_the_architecture_has_every_package_in_its_order():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text[text.index("| package |") :].split("\n\n")[0]
    listed = re.findall(r"^\| `([\w.]+?)(?:/|\.py)` \|", table, re.MULTILINE)
    assert listed == list(PACKAGES)


def test_all_modules_are_read():
    found = package_imports()
    assert {"", "cli", "replaying", "contact.hertz", "results.plots.histories"} <= set(found)
    assert {"loads.schedule", "asperities.body", "recording.recorder"} <= found["replaying"][0]
    assert {"loads.schedule", "log.file"} <= found["log.result"][0]


def test_every_package_has_its_tests():
    tests = Path(__file__).parent
    there = {name.removeprefix("test_") for name in (path.stem for path in tests.iterdir())}
    packages = {package_of(name) for name in modules(ROOT)} - {*FREE, ANYONE, "errors"}
    assert packages <= there


def test_the_replay_loop_is_short_and_knows_neither_logs_nor_scenarios():
    assert len((ROOT / "replaying.py").read_text(encoding="utf-8").splitlines()) < LONGEST_LOOP
    below = PACKAGES[PACKAGES.index("replaying") + 1 :]
    graph = package_imports()
    reached = reachable({**graph, "": (set(), set())}, ["replaying"])
    assert {package_of(name) for name in reached} & set(below) == set()


@mark.parametrize("name", READERS)
def test_readers_of_a_dataset_do_not_import_the_engine(name):
    # the declarations of the variables name types of the engine, but do not import them when they
    # run
    declarations = {SCHEMA: package_imports(top_level=True)[SCHEMA]}
    found = reachable({**package_imports(), **declarations, "": (set(), set())}, [name])
    assert {module for module in found if package_of(module) in ENGINE} <= {
        SCHEMA,
        package_of(SCHEMA),
        "recording.stored_units",
    }


def test_nothing_heavy_is_imported_before_the_command_line_answers():
    assert heavy_at_start(ROOT) == {}


def made(folder, **sources):
    for name, source in {"__init__": "", **sources}.items():
        path = folder.joinpath(*name.split("__in__")[::-1]).with_suffix(".py")
        path.parent.mkdir(exist_ok=True)
        path.write_text(source, encoding="utf-8")
    return folder


@mark.parametrize(
    "source",
    [
        "from historysim import cli",
        "import historysim.cli",
        "import historysim.cli as c",
        "from historysim.cli import main",
        "from .cli import main",
        "from . import cli",
        "def f():\n    from historysim import cli",
        "class A:\n    def f(self):\n        import historysim.cli",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from historysim.cli import main",
        "try:\n    from historysim.cli import main\nexcept ImportError:\n    pass",
    ],
)
def test_an_import_from_below_is_found_anywhere(tmp_path, source):
    assert complaints(made(tmp_path, loads=source, cli="")) == [
        "loads imports cli, which is below it"
    ]
    assert complaints(made(tmp_path, loads="", cli="from historysim import loads")) == []


@mark.parametrize(
    "source", ["import historysim", "from historysim import replay", "from . import replay"]
)
def test_an_import_of_the_whole_package_is_seen(tmp_path, source):
    found = complaints(made(tmp_path, loads=source))
    assert found == ["loads imports the package itself; import the module that defines the name"]
    assert (
        complaints(made(tmp_path, loads="from historysim._version import __version__", _version=""))
        == []
    )


def test_a_circle_inside_a_room_is_seen(tmp_path):
    above, below = "layout__in__memory", "walk__in__memory"
    empty = {"__init____in__memory": ""}
    good = made(tmp_path, **empty, **{above: "", below: "from historysim.memory import layout"})
    assert complaints(good) == []
    bad = made(
        tmp_path,
        **empty,
        **{above: "from . import walk", below: "from historysim.memory import layout"},
    )
    assert complaints(bad) == ["memory.layout, memory.walk import one another in a circle"]


def test_a_module_without_a_room_is_seen(tmp_path):
    found = complaints(made(tmp_path, wear="import historysim.errors", errors=""))
    assert found == [
        "wear is in no package of the table; move it into one, below the packages it imports"
    ]


@mark.parametrize(
    "source, seen",
    [
        ("import numpy as np", True),
        ("from numpy import typing", True),
        ("import numpy.typing as npt", True),
        ("try:\n    import numpy\nexcept ImportError:\n    pass", True),
        ("class A:\n    import numpy", True),
        ("def f():\n    import numpy", False),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import numpy", False),
    ],
)
def test_a_heavy_import_is_seen_where_it_runs_at_the_start(tmp_path, source, seen):
    folder = made(tmp_path, cli="from historysim.basics import quantity", basics=source)
    assert heavy_at_start(folder) == ({"basics": {"numpy"}} if seen else {})
    assert heavy_at_start(made(tmp_path, cli="def f():\n    import historysim.basics")) == {}


def test_no_two_modules_have_one_name():
    found = collections.Counter(path.stem for path in ROOT.rglob("*.py") if path.stem != "__init__")
    assert [name for name, count in found.items() if count > 1] == []


def test_no_two_public_classes_have_one_name():
    found = collections.Counter(
        node.name
        for path in ROOT.rglob("*.py")
        for node in parsed(path).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert [name for name, count in found.items() if count > 1] == []
