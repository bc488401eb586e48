"""The package: its public names, and what importing it costs."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

from pytest import mark, raises

import historysim as hs
from historysim.basics import lazy

MOST_NAMES = 76
NAMESPACES = (
    "analysis",
    "contact",
    "theory",
    "coupling",
    "drift",
    "events",
    "laws",
    "plots",
    "surfaces",
    "wear",
    "yielding",
)
CONTRACT = {
    *("MaterialPair", "Material", "material", "Ensemble", "State", "Asperity", "SlipState"),
    *(
        "NormalLoad",
        "TangentialLoad",
        "NormalDisplacement",
        "TangentialDisplacement",
        "FrictionChange",
    ),
    *(
        "Surface",
        "Summits",
        "random_surface",
        "read_surface",
        "register_maps",
        "area_laws",
        "surfaces",
        "contact",
    ),
    *("coupling", "plots", "laws", "wear", "yielding"),
    *("drift", "events", "Instrument", "EventLog"),
    *(
        "Fit",
        "Loops",
        "Patches",
        "Scenario",
        "Stepper",
        "columns",
        "kinds",
        "sweep_statistics",
        "Replay",
        "replay",
        "run",
        "load",
        "open",
        "validate",
        "verify",
        "show",
        "plot",
        "report",
        "analysis",
    ),
    *("compare", "creep", "fit", "loops", "sliding", "sweep", "design", "get_include"),
    *("HistorySimError", "InputError", "LoadError", "FrictionLimitError", "__version__"),
}


@mark.parametrize("name", sorted(CONTRACT))
def test_the_contract_stands_on_the_package(name):
    assert getattr(hs, name) is not None
    assert name in dir(hs)
    assert name in hs.__all__


def test_what_is_listed_are_the_public_names_alone():
    assert dir(hs) == sorted(hs.__all__)
    assert not [name for name in dir(hs) if name.startswith("_") and name != "__version__"]
    assert {"importlib", "sys", "Any", "TYPE_CHECKING"}.isdisjoint(dir(hs))


@mark.parametrize("name", NAMESPACES)
def test_a_namespace_shows_its_public_names_alone(name):
    space = getattr(hs, name)
    assert dir(space) == sorted(space.__all__)
    assert all(
        not there.startswith("_") and getattr(space, there) is not None for there in dir(space)
    )
    assert "annotations" not in dir(space)


def test_the_names_are_few_enough_to_read():
    assert len(dir(hs)) <= MOST_NAMES


def test_earlier_places_of_names_still_have_them():
    stub = Path(hs.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    for line in stub.partition(lazy.EARLIER)[2].strip().splitlines():
        name = line.partition("#")[0].split()[-1]
        assert name not in dir(hs)
        assert getattr(hs, name) is not None


@mark.parametrize("stub", sorted(Path(hs.__file__).parent.rglob("__init__.pyi"), key=str))
def test_each_public_name_has_a_line_of_its_own(stub):
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    lines = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert len(lines) == len(tree.body)
    assert all(
        len(node.names) == 1 and node.names[0].asname and node.lineno == node.end_lineno
        for node in lines
    )


def test_everything_that_is_listed_is_there():
    assert sorted(set(hs.__all__)) == sorted(hs.__all__)
    for name in dir(hs):
        getattr(hs, name)


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with raises(AttributeError, match=r"module 'historysim' has no attribute 'rplay'"):
        hs.rplay  # noqa: B018 - looking it up is the test
    assert not hasattr(hs, "asperty")


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, historysim; historysim.InputError, dir(historysim); "
        "print(sorted({'numpy', 'xarray', 'scipy', 'netCDF4', 'matplotlib', 'pint', 'tqdm'} "
        "& set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@mark.parametrize("name", sorted(CONTRACT - {*NAMESPACES, "__version__", "design", "sweep"}))
def test_signatures_are_short_enough_to_read(name):
    thing = getattr(hs, name)
    if inspect.isclass(thing) and issubclass(thing, Exception | int):
        return
    signature = str(inspect.signature(thing))
    # the type of anything that numpy accepts is a page of types
    assert "_SupportsArray" not in signature
    assert all(": Any" not in part for part in signature.split(", "))


def test_what_is_cited_is_this_version():
    citation = (Path(__file__).parents[1] / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {hs.__version__}\n" in citation
