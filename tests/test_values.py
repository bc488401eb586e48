"""Every error, state and value can be pickled and copied, and is then what it was: each bit, and arrays read-only."""

import copy
import importlib
import inspect
import itertools
import pickle
import pkgutil
import re

import attrs
import numpy as np
import synthetic
import xarray as xr
from pairs import GLASS as PAIR
from pytest import approx, mark, raises

import historysim as hs
from historysim import errors
from historysim.asperities import laws, wear
from historysim.basics.wording import Finding
from historysim.errors import field_error
from historysim.loads import schedule
from historysim.loads.event_sequence import SampledLoads
from historysim.loads.friction_course import FrictionCourse
from historysim.log.event_log import Verdict
from historysim.log.header import LogHeader
from historysim.log.verification import Difference, Verification
from historysim.measured import loop_values, sliding
from historysim.measured.comparison import Comparison
from historysim.measured.observation import observe
from historysim.measured.response import compute_response
from historysim.recording.variables import COORDINATES, Changes
from historysim.studies.workers import BrokenError, Processes
from historysim.surfaces.distribution import Gaussian, Tabulated
from historysim.tables.columns import Column, Format, MissingValueError
from historysim.tables.text_rows import BadRowError

EVENTS = (
    hs.NormalLoad(0.0, 50e-3),
    hs.NormalDisplacement(1.0, 1e-7),
    hs.TangentialLoad(1.0, 1e-3),
    hs.TangentialDisplacement(2.0, -1e-8),
    hs.FrictionChange(3.0, (0.1, 0.2, 0.15)),
    hs.FrictionChange(3.0, (0.1, 0.15), asperities=(0, 2)),
    hs.FrictionRamp(4.0, 0.3),
    hs.GeometryChange(5.0, asperities=(1,), summit_height=(1e-9,), summit_radius=None),
)
SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [16, 12]
pixel_size = "1 µm"
rms_height = "10 nm"
autocorrelation_length = "4 µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "1 mN" }, { time = 1, tangential_displacement = "5 nm" }]
"""


def ensemble():
    return hs.Ensemble(
        PAIR, np.array([0.0, -1e-8, -2e-8]), 1e-4, 0.2, x=np.arange(3.0), y=np.zeros(3)
    )


def stepped():
    made = ensemble()
    return made.advance(made.initial_state(), normal_load=0.05, tangential_displacement=1e-8)


def surface():
    heights = np.random.default_rng(1).normal(0.0, 1e-8, (24, 20))
    return hs.Surface(np.where(heights > 2.5e-8, np.nan, heights), (1e-6, 2e-6))


WHOLE = hs.Surface(np.random.default_rng(1).normal(0.0, 1e-8, (24, 20)), (1e-6, 2e-6))
SOLVED = (np.array([1e-9, 2e-9]), np.arange(4), np.full((2, 4), 1e-3), np.zeros(4, int))


def scenario(folder):
    path = folder / "rough.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return hs.load(path)


def compared():
    observed = observe(synthetic.measured("ball", 0), skip=0)
    response = compute_response(
        *synthetic.model("ball")({"friction": 0.19, "lateral_stiffness": 3e5}), observed
    )
    return Comparison(observed, response)


def ended():
    state = stepped()
    return schedule.Start(state, schedule.Cursor(2, 4, 1.5, (-1, 2, -2)))


STICKY = {"summit_radius": 1e-6, "contact_modulus": 1e9, "work_of_adhesion": 0.05, "max_load": 1e-6}
SLID = (
    np.arange(200.0),
    np.minimum(np.arange(200.0) / 40, 1.0),
    np.full(200, 5.0),
    np.arange(200.0) * 1e-6,
)

ERRORS = {
    "HistorySimError": lambda: hs.HistorySimError("what came"),
    "InstallationError": lambda: errors.InstallationError("the compiled library cannot be loaded"),
    "InputError": lambda: field_error("0; expected more", "loading", "waypoints", 3, "time"),
    "LoadError": lambda: hs.LoadError("event 3 at t = 1 s: too much"),
    "FrictionLimitError": lambda: hs.FrictionLimitError(8e-3, 7.5e-3, 2),
    "MissingPackageError": lambda: errors.MissingPackageError(
        "the friction law 'a' is of b, which is not there"
    ),
    "PullOffError": lambda: errors.PullOffError(-2e-3, -1e-3, 1),
    "CurveEndError": lambda: errors.CurveEndError("a load of 2 N", "1 N and 10 nm", 4),
    "BadRowError": lambda: BadRowError("line 3: has a value too many"),
    "MissingValueError": lambda: MissingValueError("line 3: misses a value"),
    "NoLoopError": lambda: loop_values.NoLoopError("no whole loop"),
    "BrokenError": lambda: BrokenError("a process was killed"),
}
VALUES = {
    "Material": lambda: hs.Material("steel", 210e9, 0.3, hardness=2e9),
    "MaterialPair": lambda: PAIR,
    "Instrument": lambda: hs.Instrument(3.3e5, displacement_resolution=1e-9),
    "events": lambda: EVENTS,
    "SampledLoads": lambda: SampledLoads(np.arange(3.0), np.ones(3), np.zeros(3)),
    "FrictionCourse": lambda: FrictionCourse(time=[0.0, 1.0], coefficient=[0.1, 0.2]),
    "Start": ended,
    "Surface": surface,
    "Summits": lambda: surface().summits(),
    "Form": lambda: surface().form("quadratic"),
    "statistics": lambda: [getattr(WHOLE, name)() for name in ("statistics", "autocorrelation")],
    "distributions": lambda: (Gaussian(1e-8), Tabulated([0.0, 1e-8, 2e-8], [1.0, 0.5, 0.0])),
    "GreenwoodWilliamson": lambda: hs.GreenwoodWilliamson(1e11, 1e-4, 1e-8, 1e10, 1e-6),
    "NormalSolutions": lambda: hs.NormalSolutions(
        *SOLVED, np.array([np.nan, 1.0]), (4, 5), (1e-6, 1e-6), 2e-8, (0.01, 0.02)
    ),
    "Ensemble": ensemble,
    "InclinedEnsemble": lambda: hs.InclinedEnsemble(
        PAIR, [0.0, -1e-8], 1e-4, 0.2, slope=[0.1, -0.1]
    ),
    "State": stepped,
    "state in a plane": lambda: ensemble().advance(stepped(), tangential_displacement=(1e-9, 2e-9)),
    "laws": lambda: (laws.ShearStrength(3e8), wear.ArchardWear(coefficient=1e-4, hardness=1e9)),
    "SlipState": lambda: tuple(hs.SlipState),
    "Replay": lambda: hs.Replay(
        ensemble(), EVENTS[:4], substeps=2, record=[0, 2], instrument=hs.Instrument(1e5)
    ),
    "history": lambda: hs.replay(ensemble(), EVENTS[:4]),
    "Changes": lambda: Changes(friction=True),
    "Variable": lambda: COORDINATES,
    "LogHeader": lambda: LogHeader.from_replay(hs.Replay(ensemble(), ()), title="a run", seeds=[1]),
    "Verdict": lambda: Verdict(3, "abc", "batch 2 cannot be read"),
    "Verification": lambda: Verification(
        "out.nc", 3, "abc", differences=(Difference("speed", 2, largest=np.nan),)
    ),
    "Finding": lambda: Finding("slope", 0.3, 0.1, "too steep"),
    "records": compared,
    "Sliding": lambda: sliding.sliding_of_channels(*SLID),
    "table": lambda: (Column("N", unit="mN"), Format(delimiter=";")),
}


# Of these, or of contents, it is not asked yet whether arrays stay read-only.
OF_ASPERITIES = {
    "Ensemble",
    "InclinedEnsemble",
    "State",
    "state in a plane",
    "Start",
    "Replay",
    "LogHeader",
}
# They look into an ensemble, change at each step, and hold an open file; or have tests of their own.
NO_VALUES = {
    "RampWarning",
    "UnlikelyValueWarning",
    "Asperity",
    "ContactBatch",
    "EventLog",
    "Fit",
    "LineContact",
    "Patches",
    "Scenario",
    "Stepper",
}


def taken_apart(value, met=None, *, hard=True):
    """What a value holds, as numbers, texts and bytes that compare; `met` takes the names of all classes in it."""

    def apart(value):
        if met is not None:
            met.add(type(value))
        if isinstance(value, np.ndarray):
            held = value.dtype.str, value.shape, value.tobytes(), hard and value.flags.writeable
        elif isinstance(value, BaseException):
            held = str(value), apart(value.args), apart(vars(value))
        elif isinstance(value, xr.Dataset):
            held = {
                name: (one.dims, apart(one.values), apart(one.attrs))
                for name, one in value.variables.items()
            }
        elif attrs.has(type(value)) and not isinstance(value, hs.State):
            held = {one.name: apart(getattr(value, one.name)) for one in attrs.fields(type(value))}
        elif isinstance(value, dict):
            held = {key: apart(one) for key, one in value.items()}
        elif isinstance(value, tuple | list):
            held = [apart(one) for one in value]
        elif isinstance(value, float | np.generic):
            held = np.asarray(value).tobytes()
        else:
            held = value
        return type(value), held

    return apart(value)


WAYS = {
    "pickled": lambda value: pickle.loads(pickle.dumps(value)),
    "deep": copy.deepcopy,
    "shallow": copy.copy,
}


@mark.parametrize("way", WAYS)
@mark.parametrize("name", [*ERRORS, *VALUES])
def test_pickles_and_copies_are_equal(name, way):
    value, hard = (ERRORS | VALUES)[name](), name not in OF_ASPERITIES
    found = WAYS[way](value)
    assert type(found) is type(value)
    assert taken_apart(found, hard=hard) == taken_apart(value, hard=hard)


@mark.parametrize("way", WAYS)
def test_a_scenario_that_is_pickled_or_copied_gives_the_same_history(way, tmp_path):
    loaded = scenario(tmp_path)
    found = WAYS[way](loaded)
    assert taken_apart(found) == taken_apart(loaded)
    assert found.replay().dataset().identical(loaded.replay().dataset())


def test_an_error_of_a_process_comes_with_its_numbers():
    made = ensemble()
    state = made.advance(made.initial_state(), normal_load=0.05)
    with (
        Processes(1) as executor,
        raises(hs.FrictionLimitError, match="beyond the friction limit") as caught,
    ):
        executor.submit(made.advance, state, tangential_load=1.0).result()
    assert caught.value.request == approx(1.0)
    assert caught.value.limit == approx(0.01)


def modules(packages):
    for name in packages:
        package = importlib.import_module(f"historysim.{name}")
        yield package
        for found in pkgutil.walk_packages(
            getattr(package, "__path__", []), f"{package.__name__}."
        ):
            # the compiled library is next to its module and is not a module
            if (
                not found.name.rpartition(".")[2].startswith("lib")
                or found.ispkg
                or found.name.endswith(".library")
            ):
                yield importlib.import_module(found.name)


def test_no_error_is_forgotten():
    list(
        modules(
            [
                "basics",
                "tables",
                "contact",
                "surfaces",
                "asperities",
                "loads",
                "log",
                "measured",
                "studies",
            ]
        )
    )

    def kinds(of):
        return {of}.union(*map(kinds, of.__subclasses__()))

    own = {
        one.__name__
        for one in kinds(hs.HistorySimError)
        if one.__module__.startswith("historysim.")
    }
    assert {name for name in own if not name.startswith("_")} == set(ERRORS)


def filled(kind):
    """Something of a class of plain numbers, texts and arrays, whatever they mean."""
    made = kind.__new__(kind)
    samples = itertools.cycle([np.arange(3.0), 0.1, "text", (1, None), np.ones((2, 2), np.int8)])
    for field, value in zip(attrs.fields(kind), samples, strict=False):
        object.__setattr__(made, field.name, value)
    return made


def test_no_value_is_forgotten():
    met = set()
    for make in VALUES.values():
        taken_apart(make(), met)
    kinds = [
        one
        for name in hs.__all__
        if isinstance(one := getattr(hs, name), type) and name not in ERRORS
    ]
    assert {one.__name__ for one in kinds} - {one.__name__ for one in met} == NO_VALUES
    packages = [
        "basics",
        "tables",
        "contact",
        "surfaces",
        "interaction",
        "loads",
        "log",
        "measured",
    ]
    for module in modules([*packages, "recording.variables"]):
        for kind in vars(module).values():
            if (
                not (
                    isinstance(kind, type)
                    and attrs.has(kind)
                    and kind.__module__ == module.__name__
                )
                or kind in met
            ):
                continue
            if inspect.isabstract(kind):
                continue
            value = filled(kind)
            for way in WAYS.values():
                assert taken_apart(way(value), hard=False) == taken_apart(value, hard=False)


@mark.parametrize(
    "request_, limit, texts",
    [(3e-4, 2e-4, ("0.0003", "0.0002")), (3e-4 * (1 + 1e-9), 3e-4, ("0.0003000000003", "0.0003"))],
)
def test_a_load_beyond_the_limit_is_not_printed_like_it(request_, limit, texts):
    message = str(hs.FrictionLimitError(request_, limit))
    assert f"of {texts[0]} N is beyond the friction limit of {texts[1]} N" in message
    nearest = str(hs.FrictionLimitError(float(np.nextafter(limit, 1)), limit))
    assert len(set(re.findall(r"of (\S+) N", nearest))) == 2
