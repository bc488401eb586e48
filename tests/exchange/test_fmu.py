"""Units of co-simulation, judged by FMPy, which validates, simulates and rolls them back."""

import itertools
import math

import numpy as np
from c_core import ROOT
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, fixture, importorskip, mark, raises

import historysim as hs
from historysim.basics.compiler import compiler

fmpy = importorskip("fmpy", reason="needs FMPy: pip install historysim[exchange]")
pytestmark = mark.skipif(not compiler(), reason="needs a C compiler")

from fmpy import read_model_description, simulate_fmu  # noqa: E402
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.fmi2 import FMU2Slave  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

PAIR = hs.MaterialPair.from_moduli(contact_modulus=7e10, shear_modulus=2e10)
DISCARD = 2


def rough(friction=0.2, count=40, **options):
    rng = np.random.default_rng(3)
    return hs.Ensemble(
        PAIR, rng.normal(0.0, 30e-9, count), rng.uniform(20e-6, 60e-6, count), friction, **options
    )


def patches(rows=30):
    """Two patches of a contact whose load rises as a^1.5 and a^1.7."""
    approach = np.linspace(0, 200e-9, rows + 1)[1:]
    load = np.stack([1e9 * approach**1.5, 4e10 * approach**1.7 * (approach > 50e-9)], axis=1)
    load[:, 1] -= np.where(approach > 50e-9, 4e10 * (50e-9) ** 1.7, 0.0)
    return hs.Patches.from_normal_curves(PAIR, approach, load, load * 1e-9, 0.3)


def job(ensemble, **options):
    events = [
        hs.NormalLoad(0.0, 0.02),
        hs.TangentialLoad(0.0, 0.0),
        hs.TangentialLoad(1.0, 2e-3),
        hs.TangentialLoad(2.0, -1e-3),
    ]
    return hs.Replay(ensemble, events, **options)


class Host:
    """A unit that was unpacked, and is stepped by FMPy."""

    def __init__(self, path, folder):
        self.messages = []
        self.described = read_model_description(path, validate=True)
        self.reference = {each.name: each.valueReference for each in self.described.modelVariables}
        self.kind = {each.name: each.type for each in self.described.modelVariables}
        fmpy.extract(path, folder)
        self.slave = FMU2Slave(
            guid=self.described.guid,
            unzipDirectory=str(folder),
            modelIdentifier=self.described.coSimulation.modelIdentifier,
            instanceName="contact",
        )
        self.slave.instantiate(callbacks=self.callbacks())
        self.time = 0.0
        self.inputs = [
            each.name for each in self.described.modelVariables if each.causality == "input"
        ]
        self.outputs = [
            each.name for each in self.described.modelVariables if each.causality == "output"
        ]

    def callbacks(self):
        from fmpy.fmi2 import (
            fmi2CallbackAllocateMemoryTYPE,
            fmi2CallbackFreeMemoryTYPE,
            fmi2CallbackFunctions,
            fmi2CallbackLoggerTYPE,
            fmi2StepFinishedTYPE,
        )

        def log(_environment, _name, _status, _category, _format):
            # the formatted arguments are not available in Python: the message is looked for in C
            self.messages.append((_status, _category))

        made = fmi2CallbackFunctions()
        made.logger = fmi2CallbackLoggerTYPE(log)
        made.allocateMemory = fmi2CallbackAllocateMemoryTYPE(lambda *_: None)
        made.freeMemory = fmi2CallbackFreeMemoryTYPE(lambda _: None)
        made.stepFinished = fmi2StepFinishedTYPE(lambda *_: None)
        made.componentEnvironment = None
        return made

    def begin(self, **values):
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.set(**values)
        self.slave.exitInitializationMode()
        return self

    def set(self, **values):
        self.slave.setReal([self.reference[name] for name in values], list(values.values()))

    def get(self, name):
        how = {
            "Real": self.slave.getReal,
            "Integer": self.slave.getInteger,
            "Boolean": self.slave.getBoolean,
        }
        return how[self.kind[name]]([self.reference[name]])[0]

    def step(self, *values, length=0.01):
        self.set(**dict(zip(self.inputs, values, strict=True)))
        self.slave.doStep(self.time, length)
        self.time += length

    def state_bytes(self):
        state = self.slave.getFMUstate()
        found = self.slave.serializeFMUstate(state)
        self.slave.freeFMUstate(state)
        return found

    def derivative(self, unknown, known):
        return self.slave.getDirectionalDerivative(
            [self.reference[unknown]], [self.reference[known]], [1.0]
        )[0]


@fixture(scope="module")
def written(tmp_path_factory):
    """Write a unit of a replay, unless one of the same name was written before."""
    folder, names = tmp_path_factory.mktemp("units"), {}

    def write(source, name, **options):
        key = (name, *sorted(options.items()))
        if name is None or key not in names:
            names[key] = folder / f"{len(names)}.fmu"
            hs.write_fmu(source, names[key], force=True, **options)
            assert validate_fmu(str(names[key])) == []
        return names[key]

    return write


@fixture(autouse=True)
def quickly(monkeypatch):
    # the bits do not depend on it, and it takes a third of the time
    monkeypatch.setenv("CFLAGS", "-O0")


@fixture
def hosted(tmp_path, written):
    """Host a unit of a replay."""
    hosts = []

    def make(source, name=None, **options):
        path = written(source, name, **options)
        hosts.append(Host(str(path), tmp_path / f"unpacked {len(hosts)} µ"))
        return hosts[-1]

    yield make
    for host in hosts:
        host.slave.freeInstance()


CONTACTS = {
    "one coefficient": (rough, {}),
    "many coefficients": (lambda: rough(np.linspace(0.1, 0.4, 40)), {}),
    "an instrument": (rough, {"instrument": hs.Instrument(lateral_stiffness=3e5)}),
    "patches": (patches, {}),
}


WAYS = [
    ("one coefficient", "load", "load"),
    ("one coefficient", "displacement", "displacement"),
    ("many coefficients", "load", "displacement"),
    ("an instrument", "displacement", "load"),
    ("patches", "load", "displacement"),
]


def check_equal(host, stepper, ensemble):
    content = stepper.save().to_bytes()
    assert host.state_bytes()[-len(content) :] == content
    slopes = stepper.slopes()
    for name, value in {
        "normal_load": stepper.normal_load,
        "tangential_load": stepper.tangential_load,
        "approach": stepper.approach,
        "tangential_displacement": stepper.tangential_displacement,
        "dissipated_energy": stepper.dissipated_energy,
        "tangential_stiffness": slopes.tangential,
        "coupling_stiffness": slopes.coupling,
        "normal_stiffness": slopes.normal,
    }.items():
        assert host.get(name) == value, name
    if ensemble.has_radii:
        assert host.get("contact_count") == (stepper.approach > ensemble.first_touch).sum()


# random steps turn round at each step, and are meant to
@mark.filterwarnings("ignore:the stepper went back and forth")
@mark.parametrize("kind, normal, tangential", WAYS)
def test_random_steps_and_rollbacks_agree_with_a_stepper(hosted, kind, normal, tangential):
    make, options = CONTACTS[kind]
    ensemble = make()
    replay = job(ensemble, **options)
    host = hosted(replay, kind, at=1.0, normal=normal, tangential=tangential).begin()
    state = replay.state(until=1.0)
    stepper = ensemble.stepper(state, **options)
    rng, kept, refused = np.random.default_rng(1), [], 0
    for number in range(300):
        if kept and rng.random() < 0.2:
            host_state, time, saved = kept[rng.integers(len(kept))]
            host.slave.setFMUstate(host_state)
            host.time = time
            stepper.restore(saved)
        elif rng.random() < 0.1:
            kept.append((host.slave.getFMUstate(), host.time, stepper.save()))
        to = (
            rng.uniform(0, 0.05) if normal == "load" else rng.uniform(-5e-9, 8e-8),
            rng.uniform(-4e-3, 4e-3) if tangential == "load" else rng.uniform(-4e-8, 4e-8),
        )
        try:
            stepper.step(**{f"normal_{normal}": to[0], f"tangential_{tangential}": to[1]})
        except hs.FrictionLimitError:
            refused += 1
            with raises(FMICallException) as raised:
                host.step(*to)
            assert raised.value.status == DISCARD
            continue
        host.step(*to, length=rng.choice([1e-6, 1.0, 1e3]))
        if number % 10 == 0:
            check_equal(host, stepper, ensemble)
    assert (refused > 0) == (tangential == "load")
    for host_state, _, saved in kept:
        content = saved.to_bytes()
        assert host.slave.serializeFMUstate(host_state)[-len(content) :] == content
        host.slave.freeFMUstate(host_state)


@mark.parametrize(
    "kind, normal, tangential",
    WAYS,
)
def test_derivatives_agree_with_the_step(hosted, kind, normal, tangential):
    make, options = CONTACTS[kind]
    ensemble = make()
    replay = job(ensemble, **options)
    host = hosted(replay, kind, at=1.0, normal=normal, tangential=tangential).begin()
    state = replay.state(until=1.0)
    names = {
        "normal_load": 1e-7,
        "tangential_load": 1e-7,
        "approach": 1e-13,
        "tangential_displacement": 1e-13,
    }
    reached = state.approach
    to = (0.03 if normal == "load" else 1.1 * reached, 1e-3 if tangential == "load" else 3e-9)
    kept = host.slave.getFMUstate()
    host.step(*to)
    found = {(name, known): host.derivative(name, known) for name in names for known in host.inputs}
    for channel, known in enumerate(host.inputs):
        there = {}
        for side in (1, -1):
            host.slave.setFMUstate(kept)
            moved = list(to)
            moved[channel] += side * 1e-5 * abs(to[channel])
            host.step(*moved)
            there[side] = {name: host.get(name) for name in names}
        for name in names:
            secant = (there[1][name] - there[-1][name]) / (2e-5 * abs(to[channel]))
            scale = abs(secant) + abs(found[name, known])
            # a secant over 1e-5 of the way is off by its square, and by rounding
            assert math.isclose(found[name, known], secant, rel_tol=1e-5, abs_tol=1e-12 * scale), (
                name,
                known,
            )
    host.slave.freeFMUstate(kept)


PLANE = hs.TangentialDisplacement(0.0, (0.0, 0.0))


@mark.parametrize(
    "normal, tangential, options",
    [
        ("load", "displacement", {}),
        ("displacement", "load", {}),
        ("load", "displacement", {"instrument": hs.Instrument(lateral_stiffness=(3e5, 6e5))}),
    ],
)
def test_two_directions_with_rollbacks_agree_with_a_replay(hosted, normal, tangential, options):
    ensemble = rough(np.repeat([0.2, 0.3], 6), 12, rings=hs.Rings(height_classes=2, rings=8))
    host = hosted(
        hs.Replay(ensemble, [PLANE], **options), normal=normal, tangential=tangential
    ).begin()
    names = {
        "load": (hs.NormalLoad, hs.TangentialLoad),
        "displacement": (hs.NormalDisplacement, PLANE.__class__),
    }
    rng, kept, walked, found, refused = np.random.default_rng(4), [], [], [], 0
    for _ in range(60):
        if kept and rng.random() < 0.1:
            state, host.time, *before = kept[rng.integers(-3, 0) % len(kept)]
            host.slave.setFMUstate(state)
            walked, found = map(list, before)
        elif rng.random() < 0.2:
            kept.append((host.slave.getFMUstate(), host.time, list(walked), list(found)))
        up = rng.uniform(0.005, 0.05) if normal == "load" else rng.uniform(2e-8, 8e-8)
        push = rng.uniform(-1, 1, 2) * (4e-3 if tangential == "load" else 3e-8)
        # along one line at first
        push[1] *= len(walked) > 2
        try:
            host.step(up, *push, length=1.0)
        except FMICallException:
            refused += 1
            continue
        walked.append((up, tuple(push)))
        found.append([host.get(name) for name in host.outputs])
    assert len(walked) > 12
    assert (refused > 0) == (tangential == "load" and not options)
    events = [
        event
        for time, (up, push) in enumerate(walked)
        for event in (names[normal][0](float(time), up), names[tangential][1](float(time), push))
    ]
    replay = hs.Replay(ensemble, events, record="all", **options)
    state = before = ensemble.initial_state()
    for up, push in walked:
        before = state
        to = {f"normal_{normal}": up, f"tangential_{tangential}": push}
        state = ensemble.advance(state, **to, **options)
    content = state.to_bytes()
    assert host.state_bytes()[-len(content) :] == content
    history, got = replay.dataset(), dict(zip(host.outputs, np.transpose(found), strict=True))
    for place, end in enumerate("xy"):
        assert_array_equal(got[f"tangential_load_{end}"], history.total_tangential_load[:, place])
        assert_array_equal(
            got[f"tangential_displacement_{end}"], history.tangential_displacement[:, place]
        )
        if options.get("instrument"):
            assert_allclose(
                got[f"drive_displacement_{end}"], history.drive_displacement[:, place], 1e-12
            )
    assert_array_equal(got["normal_load"], history.total_normal_load)
    assert_array_equal(got["dissipated_energy"], history.total_dissipated_energy)
    assert_array_equal(got["contact_count"], history.contact_count)
    assert_array_equal(got["saturated"], history.saturated)
    shares = hs.analysis.slip_shares(history)["slipping_area"].values
    assert_allclose(got["slipping_share"], shares, atol=1e-9)
    stiffness = state.stiffness(
        tuple(state.tangential_displacement - before.tangential_displacement)
    )
    ends = ("xx", "xy", "yy")
    there = [host.get(f"tangential_stiffness_{end}") for end in ends]
    assert_allclose(there, stiffness[[0, 0, 1], [0, 1, 1]], 1e-6, 1e-6 * stiffness.max())
    with raises(FMICallException) as raised:
        host.derivative("tangential_load_x", host.inputs[1])
    assert raised.value.status == DISCARD
    for state, *_ in kept:
        host.slave.freeFMUstate(state)


def test_beyond_the_limit_it_refuses_or_holds(hosted):
    refusing, holding = (
        hosted(
            job(rough()), "one coefficient", at=1.0, tangential="load", saturate=saturate
        ).begin()
        for saturate in (False, True)
    )
    before = refusing.state_bytes()
    with raises(FMICallException) as raised:
        refusing.step(0.02, 5e-3)
    assert raised.value.status == DISCARD
    assert refusing.messages == [(DISCARD, b"logStatusDiscard")]
    refusing.set(prescribed_tangential_load=2e-3)
    after = refusing.state_bytes()
    size = len(job(rough()).state(until=1.0).to_bytes())
    assert before[-size:] == after[-size:]
    refusing.step(0.02, 1e-3)
    assert not holding.get("saturated")
    holding.step(0.02, 5e-3)
    assert holding.get("saturated")
    assert holding.get("tangential_load") == approx(0.2 * 0.02, rel=1e-12)
    assert holding.get("tangential_stiffness") == 0.0
    holding.step(0.02, 1e-3)
    assert not holding.get("saturated")


def test_nonsense_is_refused_and_changes_nothing(hosted):
    directions = 2
    host = hosted(job(rough()), "one coefficient", at=1.0, directions=directions).begin()
    before, nonsense = host.state_bytes(), (math.nan, math.inf, -math.inf)
    for name, value in itertools.product((*host.inputs, "friction_factor"), nonsense):
        with raises(FMICallException) as raised:
            host.set(**{name: value})
        assert raised.value.status == DISCARD
    for name in ("prescribed_normal_load", "friction_factor"):
        with raises(FMICallException):
            host.set(**{name: -1.0})
    wrong = [pair for value in nonsense for pair in ((0.0, value), (value, 1.0))]
    for time, length in (*wrong, (0.0, -1.0), (0.0, 0.0)):
        with raises(FMICallException) as raised:
            host.slave.doStep(time, length)
        assert raised.value.status == DISCARD
    assert host.state_bytes() == before
    host.step(0.02, *[1e-9] * directions)


def test_states_of_another_unit_and_damaged_ones_are_refused(hosted):
    host, other = (hosted(job(rough(friction)), at=1.0).begin() for friction in (0.2, 0.3))
    content = host.state_bytes()
    made = host.slave.deSerializeFMUstate(content)
    host.step(0.03, 5e-9)
    host.slave.setFMUstate(made)
    host.slave.freeFMUstate(made)
    assert host.state_bytes() == content
    rng = np.random.default_rng(5)
    damaged = [
        content[:40],
        content[:-1],
        b"",
        *(_flipped(content, place) for place in rng.integers(len(content), size=60)),
    ]
    for wrong in (*damaged, other.state_bytes()):
        with raises(FMICallException) as raised:
            host.slave.deSerializeFMUstate(wrong)
        assert raised.value.status == DISCARD
    assert host.state_bytes() == content


def _flipped(content, place):
    return content[:place] + bytes([content[place] ^ 16]) + content[place + 1 :]


def test_the_factor_on_friction_agrees_with_the_ensemble(hosted):
    ensemble = rough(np.linspace(0.1, 0.4, 40))
    replay = job(ensemble)
    state = replay.state(until=1.0)
    host = hosted(replay, at=1.0, tangential="load")
    # set twice before the start: the last one counts
    host.slave.setupExperiment(startTime=0.0)
    host.slave.enterInitializationMode()
    host.set(friction_factor=0.3)
    host.set(friction_factor=0.8)
    host.slave.exitInitializationMode()
    less = ensemble.with_friction(state, 0.8 * state.friction)
    assert host.state_bytes().endswith(less.to_bytes())
    host.step(0.02, 1e-3)
    stepper = ensemble.stepper(less)
    stepper.step(normal_load=0.02, tangential_load=1e-3)
    host.set(friction_factor=1.2)
    after = ensemble.with_friction(stepper.save(), 1.2 * state.friction)
    assert host.state_bytes().endswith(after.to_bytes())


def test_the_share_that_slips_agrees_with_a_history(hosted):
    ensemble = patches()
    replay = hs.Replay(
        ensemble,
        [*job(ensemble).events, hs.NormalLoad(3.0, 0.03)],
        record="all",
        substeps=7,
        hold=False,
    )
    history = replay.dataset()
    expected = hs.analysis.slip_shares(history)["slipping_area"].values
    host = hosted(replay, tangential="load").begin()
    got, counts = [], []
    for normal, tangential in zip(
        history.total_normal_load.values, history.total_tangential_load.values, strict=True
    ):
        host.step(normal, tangential)
        got.append(host.get("slipping_share"))
        counts.append(host.get("contact_count"))
    assert counts == history.contact_count.values.tolist()
    assert max(got) > 0.1
    assert_allclose(got, expected, atol=1e-9)


def test_fmpy_simulates_a_shipped_scenario(tmp_path):
    path = tmp_path / "contact.fmu"
    hs.write_fmu(ROOT / "scenarios" / "15_instrument_in_series.toml", path)
    time = np.linspace(0, 1, 101)
    signal = np.zeros(
        101,
        dtype=[
            ("time", float),
            ("prescribed_normal_load", float),
            ("prescribed_drive_displacement", float),
        ],
    )
    signal["time"] = time
    signal["prescribed_normal_load"] = 0.05
    signal["prescribed_drive_displacement"] = 100e-9 * np.sin(2 * np.pi * time)
    found = simulate_fmu(str(path), stop_time=1.0, output_interval=0.01, input=signal)
    replay = hs.load(ROOT / "scenarios" / "15_instrument_in_series.toml").replay()
    stepper = replay.ensemble.stepper(instrument=replay.instrument)
    for row in range(100):
        stepper.step(
            normal_load=0.05,
            tangential_displacement=float(signal["prescribed_drive_displacement"][row]),
        )
        # FMPy interpolates its signal at times that it sums up
        assert found["tangential_load"][row + 1] == approx(
            stepper.tangential_load, rel=1e-9, abs=1e-12
        )
    assert np.ptp(found["tangential_load"]) > 0


def test_the_same_contact_gives_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        hs.write_fmu(job(rough()), tmp_path / f"{name}.fmu", platforms=[])
    assert (tmp_path / "a.fmu").read_bytes() == (tmp_path / "b.fmu").read_bytes()
