"""One of each picture, of small things: what they look like is kept in `reference_pictures/`."""

from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from pairs import STIFF

import historysim as hs
from historysim.measured.comparison import Comparison
from historysim.measured.observation import observe
from historysim.measured.reduction import Measurement
from historysim.measured.response import compute_response

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
TITLE = (
    "Friction loops of silicon on rough float glass at 50 and 70 mN, before and after running in"
)
ROUGH = f"""
title = "{TITLE}"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [96, 96]
pixel_size = "1 µm"
rms_height = "30 nm"
autocorrelation_length = "12 µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
substeps = 20
waypoints = [
    {{ time = 0, normal_load = "20 mN" }},
    {{ time = 1, normal_load = "50 mN", name = "A" }},
    {{ time = 2, tangential_displacement = "60 nm", name = "B" }},
    {{ time = 4, tangential_displacement = "-60 nm", name = "C" }},
    {{ time = 5, tangential_displacement = "0 nm", normal_load = "70 mN" }},
    {{ time = 7, tangential_displacement = "60 nm", name = "D" }},
    {{ time = 9, tangential_displacement = "-60 nm" }},
    {{ time = 11, tangential_displacement = "60 nm" }},
]
"""
LOOPS = """
[[picture]]
kind = "loops"
loads = true
title = "Loop"
[[picture]]
kind = "traction"
across = "diameter"
fronts = true
title = "Traction"
"""
SWEPT = """
[sweep.over]
"friction.coefficient" = [0.1, 0.2, 0.3, 0.4]
"loading.waypoints[1].normal_load" = ["20 mN", "50 mN", "90 mN"]
"surface.seed" = [1, 2, 3]
"""


INTERACTING = (
    ROUGH.replace("seed = 1", 'seed = 1\ninteraction = "full"')
    .replace("[96, 96]", "[48, 48]")
    .replace("substeps = 20", "substeps = 4")
)
YIELDING = ROUGH.replace('rms_height = "30 nm"', 'rms_height = "300 nm"\nyielding = "kogut-etsion"')


@cache
def folder():
    return Path(mkdtemp(prefix="pictures-"))


def written(name, text):
    path = folder() / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


@cache
def rough():
    """Return a history with its surface, from its file."""
    return hs.run(written("rough", ROUGH), folder() / "rough.nc")


@cache
def totals():
    return hs.replay(_few(), _events(), substeps=20, record="totals").assign_attrs(title=TITLE)


def _few():
    return hs.Ensemble(
        PAIR, [0.0, -20e-9, -35e-9, -60e-9], [10e-6, 30e-6, 15e-6, 40e-6], [0.2, 0.12, 0.2, 0.2]
    )


def _events():
    turns = ((1, 1), (2, -1), (3, 1))
    return [
        hs.NormalLoad(0.0, 4e-3),
        *(hs.TangentialDisplacement(float(t), sign * 30e-9) for t, sign in turns),
    ]


@cache
def friction_changes():
    """Return a ball whose friction rises between the states."""
    start = ROUGH.index("[surface]")
    text = (
        ROUGH[:start].replace(TITLE, "Friction rises from 0.2 to 0.4")
        + """
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, tangential_load = "6 mN", name = "A" },
    { time = 2, friction = 0.4, name = "B" },
    { time = 3, tangential_load = "9 mN", name = "C" },
    { time = 4, tangential_load = "-9 mN", name = "D" },
]
"""
    )
    return hs.run(written("friction", text), folder() / "friction.nc")


@cache
def worn():
    text = (Path("scenarios") / "25_wear.toml").read_text(encoding="utf-8")
    return hs.run(written("wear", text), folder() / "wear.nc")


@cache
def height_map():
    return hs.random_surface(
        shape=(64, 64), pixel_size=1e-6, rms_height=30e-9, autocorrelation_length=8e-6, seed=2
    )


@cache
def ball():
    return hs.Ensemble(STIFF, 0.0, 1e-3, 0.2)


@cache
def compared():
    """Rectangular loops of two loads and the model of them behind an instrument."""
    turns = [0, 100, -100, 0, 100, -100, 0, 100, -100, 100]
    u = np.concatenate([[0.0], *(np.linspace(a, b, 21)[1:] for a, b in pairwise(turns))]) * 1e-9
    normal = np.where(np.arange(u.size) < 60, 0.05, 0.1)
    load = 0.2 * normal * np.sign(np.diff(u, prepend=-1e-9))
    record = Measurement(
        np.arange(float(u.size)),
        {"normal_load": normal, "tangential_displacement": u},
        {"tangential_load": load},
    )
    observed = observe(record)
    instrument = hs.Instrument(1e7)
    return record, Comparison(observed, compute_response(ball(), instrument, observed), instrument)


@cache
def loops():
    events = [
        hs.NormalLoad(0.0, 50e-3),
        *(hs.TangentialDisplacement(1.0 + i, 60e-9 * (-1) ** i) for i in range(12)),
    ]
    return hs.loops(hs.replay(hs.Ensemble(PAIR, 0.0, 2.5e-3, 0.12), events, substeps=50))


@cache
def levels():
    return hs.loops("scenarios/15_instrument_in_series.toml")


@cache
def slid():
    time = np.arange(0.0, 100.0, 0.05)
    noise = np.random.default_rng(1).normal(size=time.size)
    friction = 0.4 - 0.15 * np.exp(-time / 20) + 0.01 * noise
    channels = {"normal_load": np.full(time.size, 0.05), "tangential_displacement": 1e-6 * time}
    return hs.sliding(Measurement(time, channels, {"tangential_load": 0.05 * friction}))


@cache
def sweep():
    return hs.sweep(written("sweep", ROUGH.replace("[96, 96]", "[32, 32]") + SWEPT))


@cache
def interacting():
    return hs.run(written("interacting", INTERACTING), folder() / "interacting.nc")


@cache
def yielded():
    return hs.run(written("yielded", YIELDING))


@cache
def reduced():
    return hs.reduce(written("reduced", ROUGH), elements=12)


@cache
def cycled():
    random = np.random.default_rng(5)
    turns = zip(
        range(1, 30),
        random.uniform(-30e-9, 30e-9, 30),
        random.uniform(3e-3, 5e-3, 30),
        strict=False,
    )
    events = [
        event
        for t, u, load in turns
        for event in (hs.NormalLoad(t, load), hs.TangentialDisplacement(t, u))
    ]
    ensemble = hs.Ensemble(PAIR, [0.0, -20e-9, -35e-9], 30e-6, 0.2)
    return hs.replay(ensemble, events).assign_attrs(title=TITLE)


@cache
def attracted():
    """Asperities that attract are pressed, and pulled apart."""
    random = np.random.default_rng(1)
    ensemble = hs.Ensemble(
        PAIR,
        -random.uniform(0, 8e-9, 12),
        20e-6,
        0.2,
        attraction=hs.attraction.DMT(work_of_adhesion=0.05),
    )
    loads = (hs.NormalDisplacement(0.0, -1e-9), hs.NormalLoad(1.0, 50e-6))
    return hs.replay(ensemble, [*loads, hs.NormalDisplacement(2.0, -1e-9)], substeps=60)


PICTURES = {
    "cycles": lambda **p: hs.plots.cycles(cycled(), **p),
    "history": lambda **p: hs.plot(rough(), picture="history", **p),
    "history-totals": lambda **p: hs.plots.history(totals(), **p),
    "history-wear": lambda **p: hs.plots.history(worn(), **p),
    "panels": lambda **p: hs.plot(rough(), panels=["loop", "energy"], **p),
    "loop": lambda **p: hs.plot(rough(), picture="loop", **p),
    "loops-states": lambda **p: hs.plot(rough(), picture="loops", **p),
    "contact-map": lambda **p: hs.plot(rough(), picture="contact-map", **p),
    "full-interaction": lambda **p: hs.plot(interacting(), picture="contact-map", **p),
    "traction": lambda **p: hs.plot(rough(), picture="traction", **p),
    "traction-friction": lambda **p: hs.plot(friction_changes(), picture="traction", **p),
    "stress": lambda **p: hs.plot(rough(), picture="stress", poissons_ratio=0.28, **p),
    "pull-off": lambda **p: hs.plot(attracted(), picture="pull-off", **p),
    "stiffness": lambda **p: hs.plot(rough(), picture="stiffness", **p),
    "wear": lambda **p: hs.plots.wear(worn(), **p),
    "yielding": lambda **p: hs.plot(yielded(), picture="yielding", **p),
    "reduced": lambda **p: hs.plot(reduced(), **p),
    "surface": lambda **p: hs.plots.surface(height_map(), title=TITLE, **p),
    "profile": lambda **p: hs.plots.surface(
        hs.Surface(height_map().heights[:, :1], (1e-6, 1e-6)), **p
    ),
    "heights": lambda **p: hs.plots.map(height_map(), title=TITLE, **p),
    "summits": lambda **p: hs.plots.summits(_summits(), title=TITLE, **p),
    "summits-apart": lambda **p: hs.plots.summits(_summits(), apart=True, title=TITLE, **p),
    "measured-loops": lambda **p: hs.plots.measured_loops(loops(), title=TITLE, **p),
    "measured-levels": lambda **p: hs.plots.measured_loops(
        compared()[1].measured, model=compared()[1].model, **p
    ),
    "loop-trends": lambda **p: hs.plot(loops().to_dataset(), **p),
    "fretting": lambda **p: hs.plot(loops().fretting, **p),
    "loop-levels": lambda **p: hs.plot(levels().by_load(), **p),
    "comparison": lambda **p: hs.plots.comparison(compared()[1], title=TITLE, **p),
    "record": lambda **p: hs.plot(compared()[0], **p),
    "sliding": lambda **p: hs.plot(slid(), **p),
    "asperity": lambda **p: hs.plots.asperity(_asperity(), **p),
    "adhesion-map": lambda **p: hs.plots.adhesion_map(
        {"silicon": (0.5, 10.0), "glass": (8.0, 200.0), "pulled": (0.05, -0.2)}, **p
    ),
    "swept": lambda **p: hs.plots.curve(
        sweep(), quantity="preliminary_displacement", title=TITLE, **p
    ),
    "bars": lambda **p: hs.plots.bars(
        _pairs(),
        quantity="preliminary_displacement",
        groups={"smooth": ["a", "b"], "rough": ["a", "b"]},
        **p,
    ),
    "together": lambda **p: hs.plots.loops(
        rough(), loads=True, first_loading=(0.02, 0.05), title=TITLE, **p
    ),
    "figure": lambda **p: hs.plot(_figured(), **p),
}


def _summits():
    rough = {
        "shape": (64, 64),
        "pixel_size": 1e-6,
        "rms_height": 30e-9,
        "autocorrelation_length": 8e-6,
    }
    return {
        name: hs.random_surface(**rough, seed=seed).summits(rule=9)
        for seed, name in enumerate(("first", "second", "third"), 1)
    }


def _asperity():
    one = hs.Ensemble(PAIR, 0.0, 2.5e-3, 0.2)
    state = one.advance(one.initial_state(), normal_load=50e-3)
    state = one.advance(one.advance(state, tangential_load=8e-3), tangential_load=-2e-3)
    return one.asperity(0, state)


def _pairs():
    return sweep().isel(
        {next(name for name in sweep().preliminary_displacement.dims if "waypoints" in name): 0}
    )


@cache
def _figured():
    path = folder() / "figure.nc"
    hs.run(written("figure", ROUGH + LOOPS), path).close()
    return path
