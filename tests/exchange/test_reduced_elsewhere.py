"""Reduced models in the programs that they are written for, where those are installed."""

import importlib.util
import json

import numpy as np
import pytest
from reduced_contacts import LOAD, job, rough

import historysim as hs
from historysim.exchange.reduced.model_texts import FORMATS
from historysim.exchange.reduced.reducing import VirginCurve


@pytest.fixture(scope="module")
def model():
    return hs.reduce(job(rough()), elements=8)


@pytest.fixture(scope="module")
def way():
    return VirginCurve(rough(), LOAD).end * np.random.default_rng(4).uniform(-1.3, 1.3, 40)


def test_json_has_all_numbers(model, tmp_path):
    model.write(tmp_path / "a.json")
    found = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert found["stiffness_N_per_m"] == model.stiffness.tolist()
    assert found["limit_N"] == model.limit.tolist()
    assert found["bound_of_load_N"] == model.bound * model.friction_limit


@pytest.mark.parametrize("extension", FORMATS)
def test_every_format_states_its_bound_and_replaces_only_its_own_files(model, tmp_path, extension):
    path = tmp_path / f"contact{extension}"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(hs.InputError, match="exists already"):
        model.write(path)
    model.write(path, force=True)
    model.write(path)
    assert f"{model.bound:.3g}"[:4] in path.read_text(encoding="utf-8")


def imported(path):
    spec = importlib.util.spec_from_file_location("contact", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.filterwarnings("ignore")
def test_opensees_strains_it(model, tmp_path, way):
    try:
        import openseespy.opensees as ops
    except (ImportError, RuntimeError) as error:  # it raises the latter where a library of the system is missing
        pytest.skip(f"needs OpenSeesPy ({error})")
    model.write(tmp_path / "contact.py")
    ops.wipe()
    imported(tmp_path / "contact.py").contact(ops, 10)
    ops.testUniaxialMaterial(10)
    found = []
    for place in way:
        ops.setStrain(float(place))
        found.append(ops.getStress())
    ops.wipe()
    np.testing.assert_allclose(found, model.force(way), atol=1e-12 * LOAD)
