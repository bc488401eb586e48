"""Contacts in other programs."""

from pathlib import Path

import numpy as np
import pytest
from reduced_contacts import job, rough, worst_history

import historysim as hs
from historysim.basics.compiler import compiler
from historysim.exchange.reduced.reducing import VirginCurve


def test_reduced_model(page):
    """A few springs in place of a contact, and their adversary

    Compared with **the history that is worst**: it turns where the error of the virgin curve rises
    and falls, and reaches the bound that the model states. 200 random histories stay below it.

    The model ends where the normal load changes: then there is no bound, and the error is told on
    histories of one's own.
    """

    def adversary(contact, events, way, random):
        model = hs.reduce(hs.Replay(contact, events), elements=16)
        rest = contact.advance(contact.initial_state(), normal_load=0.05)
        errors = []
        for path in (way(model), *random):
            _, totals = contact.advance_many(rest, tangential_displacement=path)
            errors.append(totals.tangential_load - model.force(path))
        return model, errors

    contact = rough()
    curve = VirginCurve(contact, 0.05)
    rng = np.random.default_rng(1)
    random = [
        curve.end * rng.uniform(-1.3, 1.3, 60) * rng.uniform(0.9, 1) ** np.arange(60)
        for _ in range(200)
    ]
    model, errors = page.shows(
        adversary,
        contact,
        job(contact).events,
        lambda m: worst_history(curve, m.slip_displacement),
        random,
    )
    bound, limit = model.bound * model.friction_limit, model.friction_limit
    page.row("error of the adversary [N]", bound, errors[0][-1], 1e-8, of="μN", scale=limit)
    beyond = max(max(np.abs(each).max() for each in errors[1:]) - bound, 0.0)
    page.row("random histories beyond the bound [N]", 0.0, beyond, 1e-9, of="μN", scale=limit)

    @page.picture
    def draw(axes):
        axes.hist([np.abs(each).max() / bound for each in errors[1:]], bins=20, color="0.6")
        axes.axvline(1, color="k")
        axes.set(xlabel="largest error over the bound", ylabel="random histories")


# random steps turn round at each step, and are meant to
@pytest.mark.filterwarnings("ignore:the stepper went back and forth")
def test_fmu(page, monkeypatch):
    """A unit of co-simulation with rollbacks

    Compared with **a replay by hand**: 400 random steps of an FMU under FMPy, a fifth of which go
    back to a state that was saved before, give the same bits as `Stepper`, which returns as well.

    The model ends where the contact evolves (wear, yielding, laws of friction): such a unit is
    refused.
    """
    monkeypatch.setenv("CFLAGS", "-O0")
    pytest.importorskip("fmpy", reason="needs FMPy: pip install historysim[exchange]")
    if not compiler():
        pytest.skip("needs a C compiler")

    def rollbacks(contact, host_of, steps, kept_at, back_at):
        replay = hs.Replay(contact, [hs.NormalLoad(0.0, 0.02), hs.TangentialDisplacement(0.0, 0.0)])
        hs.write_fmu(replay, "contact.fmu", normal="load", tangential="displacement")
        host, stepper = host_of("contact.fmu"), contact.stepper(replay.state())
        kept, found = [], []
        for k, (load, displacement) in enumerate(steps):
            if k in kept_at:
                kept.append((host.slave.getFMUstate(), stepper.save()))
            if k in back_at and kept:
                host.slave.setFMUstate(kept[-1][0])
                stepper.restore(kept[-1][1])
            stepper.step(normal_load=load, tangential_displacement=displacement)
            host.step(load, displacement)
            found.append((stepper.tangential_load, host.get("tangential_load")))
        return np.array(found)

    rng = np.random.default_rng(6)
    steps = np.column_stack([rng.uniform(0, 0.05, 400), rng.uniform(-4e-8, 4e-8, 400)])
    kept_at, back_at = (set(rng.choice(400, count, replace=False).tolist()) for count in (40, 80))
    found = page.shows(rollbacks, rough(), Host, steps, kept_at, back_at)
    page.row("tangential load [N]", found[:, 0], found[:, 1], 0.0, "the same bits")

    @page.picture
    def draw(axes):
        axes.plot(1e3 * found[:60, 0], lw=0.8, label="Stepper")
        axes.plot(1e3 * found[:60, 1], "k.", ms=2, label="FMU")
        axes.set(xlabel="step", ylabel="tangential load (mN)")


class Host:
    """A unit, stepped by FMPy."""

    def __init__(self, path):
        import fmpy
        from fmpy.fmi2 import FMU2Slave

        described = fmpy.read_model_description(path, validate=True)
        self.reference = {each.name: each.valueReference for each in described.modelVariables}
        self.inputs = [each.name for each in described.modelVariables if each.causality == "input"]
        folder = fmpy.extract(path, str(Path("unpacked").resolve()))
        self.slave = FMU2Slave(
            guid=described.guid, unzipDirectory=folder,
            modelIdentifier=described.coSimulation.modelIdentifier, instanceName="contact",
        )  # fmt: skip
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = 0.0

    def step(self, *values):
        self.slave.setReal([self.reference[name] for name in self.inputs[:2]], list(values))
        self.slave.doStep(self.time, 0.01)
        self.time += 0.01

    def get(self, name):
        return self.slave.getReal([self.reference[name]])[0]
