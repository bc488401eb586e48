"""Every argument of a public function with a unit, by its name or its docstring, takes a string with that unit."""

import inspect
import pickle
import re
from functools import cache

import numpy as np
import pytest
import xarray as xr

import historysim as hs
from historysim.basics.units import UNIT_OF
from historysim.recording.recorder import StateOnly
from historysim.surfaces.distribution import Gaussian

# As docstrings write them, and as a text is understood.
UNITS = {
    "N": "N",
    "m": "m",
    "s": "s",
    "Pa": "Pa",
    "Pa √m": "Pa √m",
    "J": "J",
    "J/m²": "J m-2",
    "N/m": "N m-1",
    "m²": "m2",
    "1/m²": "m-2",
    "m³/J": "m3 J-1",
    "rad": "rad",
    "kg": "kg",
}

PAIR = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=8e9)
LOADED = {"normal_load": 1e-3, "tangential_displacement": 1e-9}


@cache
def ball():
    return hs.Ensemble(PAIR, [0.0, -1e-9], 1e-5, 0.2)


@cache
def pressed():
    return ball().advance(ball().initial_state(), normal_load=1e-3)


@cache
def asperity():
    return ball().asperity(0, pressed())


@cache
def single():
    return hs.Asperity(PAIR, 1e-5, 0.2).advance(normal_load=1e-3)


@cache
def events():
    turns = [4e-9, -4e-9] * 4
    return [
        hs.NormalLoad(0.0, 1e-3),
        *(hs.TangentialDisplacement(1.0 + i, u) for i, u in enumerate(turns)),
    ]


@cache
def job():
    return hs.Replay(ball(), events(), substeps=10)


@cache
def history():
    return job().dataset()


def surface():
    return hs.Surface(np.random.default_rng(1).normal(size=(12, 12)) * 1e-9, 1e-6)


def placed():
    return hs.Summits([0.0, 1e-9], [1e-5, 1e-5], [0.0, 1e-6], [0.0, 1e-6], nominal_area=1e-9)


def hills():
    return hs.random_surface(
        shape=(32, 32), pixel_size=1e-6, rms_height=1e-9, autocorrelation_length=4e-6, seed=1
    )


@cache
def rough():
    return hs.theory.GreenwoodWilliamson(4e10, 1e-5, 1e-8, 1e10, 1e-8)


def drawn(**options):
    return hs.surfaces.drawn_summits(Gaussian(1e-8), seed=1, **options)


def integrated(**options):
    return hs.coupling.solve_ivp(
        lambda *_: [1e-9],
        y0=[0.0],
        ensemble=ball(),
        place=lambda *_: {},
        state=pressed(),
        **options,
    )


def patches():
    return hs.Patches.from_normal_curves(PAIR, **CURVE)


def cylinder():
    return hs.LineContact(PAIR, 1e-2, 5e-3, 0.2, 1e-2)


def cylinder_state():
    pressed = cylinder().advance(cylinder().initial_state(), normal_load=1.0)
    return cylinder().advance(pressed, tangential_load=0.1)


MODULI = {"contact_modulus": 4e10, "shear_modulus": 8e9, "hardness": 6e9, "yield_stress": 2e9}
CURVE = {
    "approach": [1e-9, 2e-9, 3e-9, 4e-9],
    "load": [1e-4, 3e-4, 6e-4, 1e-3],
    "area": [1e-14, 2e-14, 3e-14, 4e-14],
    "noise": [1e-9] * 4,
}
# How each is called, with numbers.
CALLS = {
    "Asperity": (
        lambda **size: hs.Asperity(**size).ensemble,
        {"pair": PAIR, "radius": 1e-5, "friction": 0.2},
    ),
    "Asperity.advance": (lambda **load: single().advance(**load).state, LOADED),
    "Asperity.advance#2": (
        lambda **load: single().advance(**load).state,
        {"normal_displacement": 1e-8, "tangential_load": 1e-5},
    ),
    "Asperity.stress": (
        lambda x, y, z: asperity().stress(x, y, z, poissons_ratio=0.3),
        {"x": [1e-9], "y": [2e-9], "z": [3e-9]},
    ),
    "Asperity.traction": (lambda radius: asperity().traction(radius), {"radius": [1e-9, 2e-9]}),
    "Ensemble": (
        hs.Ensemble,
        {
            "pair": PAIR,
            "summit_height": [0.0, 1e-9],
            "summit_radius": 1e-5,
            "friction": 0.2,
            "x": [0.0, 1e-6],
            "y": [0.0, 1e-6],
            "nominal_area": 1e-9,
        },
    ),
    "Ensemble.advance": (lambda **load: ball().advance(pressed(), **load), LOADED),
    "Ensemble.advance#2": (
        lambda **load: ball().advance(pressed(), **load),
        {"normal_displacement": 1e-8, "tangential_load": 1e-5},
    ),
    "Patches.from_normal_curves": (
        hs.Patches.from_normal_curves,
        {"pair": PAIR, **CURVE, "x": 1e-6, "y": 2e-6, "highest_summit": 1e-6},
    ),
    "Patches.advance": (
        lambda **load: patches().advance(patches().initial_state(), **load),
        LOADED,
    ),
    "Patches.advance#2": (
        lambda **load: patches().advance(
            patches().advance(patches().initial_state(), normal_load=1e-4), **load
        ),
        {"normal_displacement": 2e-9, "tangential_load": 1e-6},
    ),
    "LineContact": (
        hs.LineContact,
        {"pair": PAIR, "radius": 1e-2, "length": 5e-3, "friction": 0.2, "reference_depth": 1e-2},
    ),
    "LineContact.advance": (
        lambda **load: cylinder().advance(cylinder().initial_state(), **load),
        LOADED,
    ),
    "LineContact.advance#2": (
        lambda **load: cylinder().advance(
            cylinder().advance(cylinder().initial_state(), normal_load=1.0), **load
        ),
        {"normal_displacement": 1e-8, "tangential_load": 1e-5},
    ),
    "LineContact.half_width": (
        lambda normal_load: cylinder().half_width(normal_load),
        {"normal_load": [1.0, 2.0]},
    ),
    "LineContact.pressure": (
        lambda x: cylinder().pressure(x, cylinder_state()),
        {"x": [0.0, 1e-6]},
    ),
    "LineContact.traction": (
        lambda x: cylinder().traction(x, cylinder_state()),
        {"x": [0.0, 1e-6]},
    ),
    "Ensemble.with_geometry": (
        lambda **shape: ball().with_geometry(pressed(), **shape),
        {"summit_height": [0.0, -2e-9], "summit_radius": 2e-5},
    ),
    "FrictionChange": (hs.FrictionChange, {"time": 1.0, "friction": 0.2}),
    "Instrument": (
        hs.Instrument,
        {
            "lateral_stiffness": 3e5,
            "parallel_stiffness": 2e4,
            "displacement_resolution": 1e-9,
            "load_resolution": 1e-6,
        },
    ),
    "Material": (
        hs.Material,
        {
            "name": "mine",
            "youngs_modulus": 1e11,
            "poissons_ratio": 0.2,
            "shear_modulus": 4e10,
            "surface_energy": 0.1,
            "roughness": (1e-9, 2e-9),
            "ball_radius": 1e-3,
            "hardness": 6e9,
            "yield_stress": 2e9,
            "fracture_toughness": 7e5,
        },
    ),
    "MaterialPair.from_moduli": (
        hs.MaterialPair.from_moduli,
        {**MODULI, "work_of_adhesion": 0.1, "cracking_load": 1e-3},
    ),
    "Replay.walk": (
        lambda until: job().walk(job().recorder(StateOnly, until=until), until=until),
        {"until": 2.5},
    ),
    "Summits": (
        hs.Summits,
        {
            "height": [0.0, 1e-9],
            "radius": [1e-5, 1e-5],
            "x": [0.0, 1e-6],
            "y": [0.0, 1e-6],
            "nominal_area": 1e-9,
        },
    ),
    "Summits.meeting": (
        lambda shift: placed().meeting(placed(), shift=shift),
        {"shift": (1e-7, 2e-7)},
    ),
    "Surface": (hs.Surface, {"heights": [[0.0, 1e-9], [2e-9, 0.0]], "pixel_size": 1e-6}),
    "Surface.combined": (
        lambda **place: surface().combined(surface(), **place),
        {"shift": (1e-6, 0.5e-6), "rotation": 0.1},
    ),
    "Surface.cropped": (
        lambda **part: surface().cropped(**part),
        {"x": (1e-6, 8e-6), "y": (0.0, 9e-6)},
    ),
    "loops": (
        lambda dead_band: hs.loops(history(), dead_band=dead_band).summary(),
        {"dead_band": 1e-9},
    ),
    "area_laws": (
        lambda **given: hs.area_laws(hills(), PAIR, whole_map=False, **given),
        {"normal_load": [1e-6, 2e-6], "hardness": 6e9},
    ),
    "random_surface": (
        hs.random_surface,
        {
            "shape": (16, 16),
            "pixel_size": 1e-6,
            "rms_height": 1e-9,
            "autocorrelation_length": 4e-6,
            "seed": 1,
        },
    ),
    "reduce": (
        lambda **load: hs.reduce(job(), elements=2, **load).as_dict(),
        {"normal_load": 1e-3},
    ),
    "analysis.asperity": (
        lambda time: hs.analysis.asperity(history(), 0, time=time).state,
        {"time": 2.0},
    ),
    "analysis.energy_per_cycle": (
        lambda dead_band: hs.analysis.energy_per_cycle(history(), dead_band=dead_band),
        {"dead_band": 1e-9},
    ),
    "analysis.friction_loops": (
        lambda dead_band: hs.analysis.friction_loops(history(), dead_band=dead_band).summary(),
        {"dead_band": 1e-9},
    ),
    "analysis.nominal_pressure": (
        lambda nominal_area: hs.analysis.nominal_pressure(history(), nominal_area),
        {"nominal_area": 1e-9},
    ),
    "theory.GreenwoodWilliamson": (
        hs.theory.GreenwoodWilliamson,
        {
            "contact_modulus": 4e10,
            "summit_radius": 1e-5,
            "height_deviation": 1e-8,
            "summit_density": 1e10,
            "nominal_area": 1e-9,
            "mean_height": 1e-9,
        },
    ),
    "theory.GreenwoodWilliamson.contact_count": (
        lambda separation: rough().contact_count(separation),
        {"separation": [1e-8, 2e-8]},
    ),
    "theory.GreenwoodWilliamson.separation_at": (
        lambda normal_load: rough().separation_at(normal_load),
        {"normal_load": 1e-3},
    ),
    "theory.GreenwoodWilliamson.of_summits": (
        hs.theory.GreenwoodWilliamson.from_summits,
        {
            "summits": hs.Summits(np.linspace(0, 1e-8, 9), np.full(9, 1e-5), nominal_area=1e-9),
            "contact_modulus": 4e10,
        },
    ),
    "coupling.solve_ivp": (integrated, {"t_span": (0.0, 1.0)}),
    "drift.disturbance_at_rest": (
        lambda normal_load: hs.drift.disturbance_at_rest(ball(), pressed(), normal_load),
        {"normal_load": 2e-3},
    ),
    "events.FrictionRamp": (hs.events.FrictionRamp, {"time": 1.0, "friction": 0.2}),
    "events.GeometryChange": (
        hs.events.GeometryChange,
        {"time": 1.0, "summit_height": [0.0, 1e-9], "summit_radius": [1e-5, 1e-5]},
    ),
    "laws.PowerLaw": (
        hs.laws.PowerLaw,
        {"coefficient": 0.2, "reference_load": 1e-3, "exponent": -0.1},
    ),
    "laws.ShearStrength": (
        hs.laws.ShearStrength,
        {"shear_strength": 1e8, "area": "jkr", "work_of_adhesion": 0.1},
    ),
    "laws.SlidFriction": (
        hs.laws.SlidFriction,
        {"distance": (0.0, 1e-6), "coefficient": (0.1, 0.2)},
    ),
    "surfaces.drawn_summits": (
        drawn,
        {"radius": 1e-5, "summit_density": 1e10, "nominal_area": 1e-9},
    ),
    "surfaces.textured_summits": (
        hs.surfaces.textured_summits,
        {"count": (2, 2), "pitch": 1e-5, "radius": 1e-6, "height_scatter": 1e-9, "seed": 1},
    ),
    "wear.ArchardWear": (hs.wear.ArchardWear, {"coefficient": 1e-3, "hardness": 6e9}),
    "wear.EnergyWear": (hs.wear.EnergyWear, {"volume_per_energy": 1e-15}),
}

# What takes none, or is not called here, and why.
NUMBERS_ALONE = {
    "ContactBatch": "a loop over arrays of numbers",
    "ContactBatch.step": "a loop over arrays of numbers",
    "CoupledSolution": "a result",
    "EventLog": "its times are checked as those of a replay",
    "FrictionLimitError": "an error",
    "drive_displacement": "a formula of what was computed",
    "Loaded": "what a law is asked with",
    "slip_onset": "what another function has found",
    "slides_first": "what another function has found",
    "summary": "what another function has found",
    "volume": "what a law is asked with",
    "first_loading": "what a law is asked with",
    "read_surface": "needs a file; its pixel_size is that of Surface",
    "write_fmu": "needs a compiler; tried by the command",
}
# Functions and other things whose description names a unit.
NOT_A_QUANTITY = {"motion", "summits", "options", "friction"}


def public():
    """Yield the names of functions, classes and their methods, as they are reached from the package."""
    seen = set()
    modules = [name for name in dir(hs) if inspect.ismodule(getattr(hs, name))]
    for prefix, space in [("", hs), *((f"{name}.", getattr(hs, name)) for name in modules)]:
        for name in (name for name in dir(space) if not name.startswith("_")):
            found = getattr(space, name)
            if inspect.ismodule(found) or not str(getattr(found, "__module__", "")).startswith(
                "historysim"
            ):
                continue
            if id(found) in seen:
                continue
            seen.add(id(found))
            if callable(found):
                yield f"{prefix}{name}", found
            if inspect.isclass(found):
                for method, function in inspect.getmembers(found, callable):
                    if not method.startswith("_") and hasattr(function, "__code__"):
                        yield f"{prefix}{name}.{method}", function


def documented(function):
    """Yield each argument of a function that its docstring has in a unit, with the unit."""
    text = inspect.cleandoc(function.__doc__ or "")
    section = re.search(
        r"(?:^|\n)(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n\w[^\n]*\n-+\n|\Z)", text, re.DOTALL
    )
    try:
        known = set(inspect.signature(function).parameters)
    except (TypeError, ValueError):
        return
    for entry in re.split(r"\n(?=\S)", section[1]) if section else ():
        names = [
            name.strip(" *") for name in entry.partition("\n")[0].partition(" : ")[0].split(",")
        ]
        units = [unit for unit in re.findall(r"\[([^\]]+)\]", entry) if unit in UNITS]
        if units:
            for place, name in enumerate(names):
                if name in known - NOT_A_QUANTITY:
                    yield name, units[min(place, len(units) - 1)]


FOUND = {(name, *each) for name, function in public() for each in documented(function)}


def texts(value, unit):
    if isinstance(value, list | tuple):
        return type(value)(texts(one, unit) for one in value)
    return f"{value!r} {unit}"


def same(one, other):
    if isinstance(one, xr.Dataset | xr.DataArray):
        return one.drop_attrs().identical(other.drop_attrs())
    return pickle.dumps(one) == pickle.dumps(other)


@pytest.mark.parametrize("name", CALLS)
def test_texts_with_units_are_taken_where_numbers_are(name):
    function, given = CALLS[name]
    units = {argument: unit for argument, unit in UNIT_OF.items() if argument in given}
    units |= {argument: UNITS[unit] for of, argument, unit in FOUND if of == name.partition("#")[0]}
    units = {
        name: unit
        for name, unit in units.items()
        if name in given and not isinstance(given[name], str)
    }
    assert units
    expected = function(**given)
    for argument, unit in units.items():
        found = function(**{**given, argument: texts(given[argument], unit)})
        assert same(found, expected), argument


def test_every_documented_quantity_is_tried():
    tried = {
        (name.partition("#")[0], argument)
        for name, (_, given) in CALLS.items()
        for argument in given
    }
    left = {
        (name, argument)
        for name, argument, _ in FOUND
        if (name, argument) not in tried and not NUMBERS_ALONE.keys() & set(name.split("."))
    }
    assert left == set()
