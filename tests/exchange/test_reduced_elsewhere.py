"""Reduced models in the programs that they are written for, where those are installed."""

import csv
import importlib.util
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from reduced_contacts import LOAD, job, rough

import historysim as hs
from historysim.exchange.reduced.model_texts import FORMS
from historysim.exchange.reduced.reducing import VirginCurve


@pytest.fixture(scope="module")
def model():
    return hs.reduce(job(rough()), elements=8)


@pytest.fixture(scope="module")
def way():
    return VirginCurve(rough(), LOAD).end * np.random.default_rng(4).uniform(-1.3, 1.3, 40)


def test_json_and_csv_have_all_numbers(model, tmp_path):
    model.write(tmp_path / "a.json")
    found = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert found["stiffness_N_per_m"] == model.stiffness.tolist()
    assert found["limit_N"] == model.limit.tolist()
    assert found["bound_of_load_N"] == model.bound * model.friction_limit
    model.write(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    rows = [*csv.DictReader(line for line in lines if not line.startswith("#"))]
    assert [float(row["stiffness [N/m]"]) for row in rows] == model.stiffness.tolist()
    assert [float(row["limit [N]"]) for row in rows] == model.limit.tolist()
    assert f"{model.bound:.3g} of the friction limit" in "".join(lines)


@pytest.mark.parametrize("name", FORMS)
def test_every_form_says_its_bound_and_is_replaced_only_by_its_like(model, tmp_path, name):
    path = tmp_path / f"contact{FORMS[name][0]}"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(hs.InputError, match="is there already"):
        model.write(path, form=name)
    model.write(path, form=name, force=True)
    model.write(path, form=name)
    assert f"{model.bound:.3g}"[:4] in path.read_text(encoding="utf-8")


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="needs Octave")
@pytest.mark.parametrize("varies", [False, True])
def test_octave_steps_it(tmp_path, way, varies):
    model = hs.reduce(job(rough(), varies=varies), elements=8)
    loads = np.random.default_rng(5).uniform(0.2, 1.0, way.size) * LOAD
    model.write(tmp_path / "contact.m")
    third = ", N(i)" if varies else ""
    script = f"U = {way.tolist()}; N = {loads.tolist()}; s = [];\n"
    script += f"for i = 1:numel(U) [T, s] = contact(U(i), s{third}); printf('%.17g\\n', T); end\n"
    done = subprocess.run(
        [shutil.which("octave-cli"), "--no-gui", "--quiet", "--eval", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    expected = model.force(way, loads if varies else None)
    np.testing.assert_allclose([float(line) for line in done.stdout.split()], expected, atol=1e-12 * LOAD)


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


PYHARM = """
import json, sys
import numpy as np
import pandas as pd
sys.path.insert(0, {folder!r})
from contact import ELEMENTS
from pyHarm.Elements.NodeToNodeElements.Jenkins import JenkinsCorLoop
n = 400
time = np.arange(n) * 2 * np.pi / n
place = {amplitude!r} * np.sin(time)
total = np.zeros(n)
for one in ELEMENTS.values():
    limit = one["mu"] * one["N0"] * np.ones(n)
    found = JenkinsCorLoop(place[None, :], one["k"], np.zeros((1, 1, n, 1)), np.zeros((1, n)), limit)
    z = found[0] if isinstance(found, tuple) else found
    total += one["k"] * (place - z[0])
print(json.dumps(total.tolist()))
"""


def test_pyharm_has_its_loop(model, tmp_path):
    if importlib.util.find_spec("pyHarm") is None:
        pytest.skip("needs pyharm-os")
    model.write(tmp_path / "contact.py", form="pyharm")
    amplitude = 0.8 * VirginCurve(rough(), LOAD).end
    # its loop begins by itself, and is closed after a period; in a process of its own, for its warnings
    script = PYHARM.format(folder=str(tmp_path), amplitude=amplitude)
    command = [sys.executable, "-W", "ignore", "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    place = amplitude * np.sin(np.arange(400) * 2 * np.pi / 400)
    expected = model.force(np.tile(place, 3))[-400:]
    np.testing.assert_allclose(found, expected, atol=1e-9 * LOAD)
