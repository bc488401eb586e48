"""Units of co-simulation under masters: FMPy by FMI 3.0, the Open Simulation Platform, a controlled stage."""

import numpy as np
from pytest import approx, fixture, importorskip, mark, raises

import historysim as hs
from historysim.basics.compiler import compiler

fmpy = importorskip("fmpy", reason="needs FMPy: pip install historysim[exchange]")
pytestmark = mark.skipif(not compiler(), reason="needs a C compiler")

from fmpy import read_model_description, simulate_fmu  # noqa: E402
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=2e10)


@fixture(autouse=True)
def quickly(monkeypatch):
    monkeypatch.setenv("CFLAGS", "-O0")


def pressed(ensemble, load=0.02):
    return hs.Replay(ensemble, [hs.NormalLoad(0.0, load), hs.TangentialDisplacement(0.0, 0.0)])


def ball(radius=1e-3):
    return hs.Ensemble(PAIR, 0.0, radius, 0.2)


def unpacked(kind, path, folder):
    described = read_model_description(str(path), validate=True)
    fmpy.extract(str(path), str(folder))
    names = {each.name: each.valueReference for each in described.modelVariables}
    slave = kind(
        guid=described.guid,
        unzipDirectory=str(folder),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName="contact",
    )
    slave.instantiate()
    return slave, names


# random steps turn round at each step, and are meant to
@mark.filterwarnings("ignore:the stepper went back and forth")
def test_a_unit_by_fmi_3_is_the_same(tmp_path):
    replay = pressed(ball())
    path = tmp_path / "three.fmu"
    hs.write_fmu(replay, path, at=0.0, fmi=3)
    assert validate_fmu(str(path)) == []
    unit, names = unpacked(FMU3Slave, path, tmp_path / "three")
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    inputs = [names["prescribed_normal_load"], names["prescribed_tangential_displacement"]]
    stepper = replay.ensemble.stepper(replay.state(until=0.0))
    rng, kept, time = np.random.default_rng(1), [], 0.0
    for _ in range(500):
        if kept and rng.random() < 0.2:
            state, saved = kept[rng.integers(len(kept))]
            unit.setFMUState(state)
            stepper.restore(saved)
        elif rng.random() < 0.05:
            kept.append((unit.getFMUState(), stepper.save()))
        load, place = rng.uniform(0, 0.05), rng.uniform(-4e-8, 4e-8)
        unit.setFloat64(inputs, [load, place])
        unit.doStep(time, 0.1)
        time += 0.1
        stepper.step(normal_load=load, tangential_displacement=place)
        assert unit.getFloat64([names["tangential_load"]]) == [stepper.tangential_load]
    slope = unit.getDirectionalDerivative([names["tangential_load"]], inputs[1:], [1.0])
    assert slope == [stepper.slopes().tangential]
    assert unit.getInt32([names["contact_count"]]) == [1]
    assert unit.getBoolean([names["saturated"]]) == [False]
    for state, saved in kept:
        content = unit.serializeFMUState(state)
        assert content.endswith(saved.to_bytes())
        again = unit.deserializeFMUState(content)
        unit.setFMUState(again)
        unit.freeFMUState(again)
        unit.freeFMUState(state)
    with raises(FMICallException):
        unit.getFloat64([names["contact_count"]])
    unit.freeInstance()
    found = simulate_fmu(str(path), stop_time=1.0, output_interval=0.1)
    assert found["normal_load"][-1] == approx(0.02, rel=1e-12)
