"""The package: its public names, and what importing it costs."""

import subprocess
import sys

import pytest

import historysim as hs

CONTRACT = {
    *("MaterialPair", "Material", "material", "Ensemble", "EnsembleState", "Asperity", "SlipState"),
    *("NormalLoad", "TangentialLoad", "NormalDisplacement", "TangentialDisplacement", "FrictionChange"),
    *("Surface", "Summits", "random_surface", "read_surface", "textured_summits", "drawn_summits", "quantile_summits"),
    *("GreenwoodWilliamson", "Instrument", "EventLog"),
    *(
        "Replay",
        "replay",
        "run",
        "verify",
        "HistorySimError",
        "InputError",
        "LoadError",
        "FrictionLimitError",
        "__version__",
    ),
}


@pytest.mark.parametrize("name", sorted(CONTRACT))
def test_the_contract_stands_on_the_package(name):
    assert getattr(hs, name) is not None
    assert name in dir(hs)
    assert name in hs.__all__


def test_everything_that_is_listed_is_there():
    assert sorted(set(hs.__all__)) == sorted(hs.__all__)
    for name in dir(hs):
        getattr(hs, name)


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"module 'historysim' has no attribute 'rplay'"):
        hs.rplay  # noqa: B018 - looking it up is the test
    assert not hasattr(hs, "asperty")


def test_importing_the_package_imports_nothing_heavy():
    code = (
        "import sys, historysim; historysim.InputError, dir(historysim); "
        "print(sorted({'numpy', 'numba', 'xarray', 'scipy', 'netCDF4', 'matplotlib', 'cf_units', 'tqdm'} "
        "& set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
