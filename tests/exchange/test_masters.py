"""Units of co-simulation under masters: FMPy by FMI 3.0, the Open Simulation Platform, a controlled stage."""

import numpy as np
import positioning_stage as stage
import pytest

import historysim as hs
from historysim.basics.compiler import compiler

fmpy = pytest.importorskip("fmpy", reason="needs FMPy: pip install historysim[exchange]")
pytestmark = pytest.mark.skipif(not compiler(), reason="needs a C compiler")

from fmpy import read_model_description, simulate_fmu  # noqa: E402
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.fmi3 import FMU3Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=2e10)


@pytest.fixture(autouse=True)
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
@pytest.mark.filterwarnings("ignore:the stepper went back and forth")
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
    with pytest.raises(FMICallException):
        unit.getFloat64([names["contact_count"]])
    unit.freeInstance()
    found = simulate_fmu(str(path), stop_time=1.0, output_interval=0.1)
    assert found["normal_load"][-1] == pytest.approx(0.02, rel=1e-12)


def test_a_controlled_stage_moves_as_in_python(tmp_path):
    ensemble, duration = stage.rough_contact(100), 0.03
    expected = stage.controlled(ensemble, duration)
    path = tmp_path / "stage.fmu"
    hs.write_fmu(pressed(ensemble, stage.NORMAL_LOAD), path, at=-1.0, normal="displacement")
    start = ensemble.advance(ensemble.initial_state(), normal_load=stage.NORMAL_LOAD)
    unit, names = unpacked(FMU2Slave, path, tmp_path / "stage")
    unit.setupExperiment()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    inputs, force = (
        [names["prescribed_approach"], names["prescribed_tangential_displacement"]],
        [names["tangential_load"]],
    )

    def step(time, length, place):
        unit.setReal(inputs, [start.approach, place])
        unit.doStep(time, length)
        return unit.getReal(force)[0]

    # the worked case, with the unit in the place of the contact
    pause = stage.SAMPLE / stage.SUBSTEPS
    contact = step(0.0, pause, 0.0)
    place = velocity = integral = 0.0
    before, record = stage.wanted(0.0), []
    for sample in range(round(duration / stage.SAMPLE)):
        error = stage.wanted(sample * stage.SAMPLE + 0.0) - place
        integral += error * stage.SAMPLE
        motor = (
            stage.PROPORTIONAL * error + stage.INTEGRAL * integral + stage.DERIVATIVE * (error - before) / stage.SAMPLE
        )
        before = error
        for part in range(stage.SUBSTEPS):
            velocity += pause / stage.MASS * (motor - contact)
            place += pause * velocity
            contact = step(sample * stage.SAMPLE + part * pause, pause, place)
        record.append((place, contact, motor))
    unit.freeInstance()
    found = np.array(record).T
    for mine, theirs in zip(found, (expected.place, expected.contact_force, expected.motor_force), strict=True):
        # the normal load is put on in one path less, so that rounding differs
        np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.slow
def test_the_open_simulation_platform_steps_two_units(tmp_path):
    pytest.importorskip("libcosimpy", reason="needs libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    first, second = pressed(ball()), pressed(ball(2e-3), 0.03)
    hs.write_fmu(first, tmp_path / "first.fmu", at=0.0)
    hs.write_fmu(second, tmp_path / "second.fmu", at=0.0, tangential="load", saturate=True)
    names = [
        {
            each.name: each.valueReference
            for each in read_model_description(str(tmp_path / f"{name}.fmu")).modelVariables
        }
        for name in ("first", "second")
    ]
    execution = CosimExecution.from_step_size(int(1e7))
    slaves = [
        CosimLocalSlave(fmu_path=str(tmp_path / f"{name}.fmu"), instance_name=name) for name in ("first", "second")
    ]
    one, other = (execution.add_local_slave(slave) for slave in slaves)
    handing = one, names[0]["tangential_load"], other, names[1]["prescribed_tangential_load"]
    assert execution.connect_real_variables(*handing) == 0
    by_hand, seen = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(by_hand)
    execution.add_observer(seen)
    steppers = [
        first.ensemble.stepper(first.state(until=0.0)),
        second.ensemble.stepper(second.state(until=0.0), saturate=True),
    ]
    handed = 0.0
    for number in range(200):
        place = 25e-9 * np.sin(0.1 * number) * (1 + 0.3 * np.sin(0.037 * number))
        by_hand.slave_real_values(one, [names[0]["prescribed_tangential_displacement"]], [place])
        execution.step()
        steppers[1].step(normal_load=0.03, tangential_load=handed)
        steppers[0].step(normal_load=0.02, tangential_displacement=place)
        # what the first one has reached goes to the second one's next step
        handed = steppers[0].tangential_load
        assert seen.last_real_values(one, [names[0]["tangential_load"]]) == [steppers[0].tangential_load]
        assert seen.last_real_values(other, [names[1]["tangential_displacement"]]) == [
            steppers[1].tangential_displacement
        ]
