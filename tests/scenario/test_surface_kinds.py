"""The kinds of ``[surface]``: the summits that each gives, and what is said about those that give none."""

import attrs
import numpy as np
from pytest import approx, fixture, mark, raises
from sections import (
    AMOUNT,
    DENSITY,
    LINES,
    OTHER,
    RADIUS,
    ROUGH,
    SECTIONS,
    SHORT,
    TABLE_HEIGHTS,
    loaded,
    section,
    write_files,
)

import historysim as hs
from historysim.errors import InputError
from historysim.scenario import scenario, surface_kinds
from historysim.studies.sweep_table import find_unit
from historysim.surfaces.distribution import (
    Gaussian,
    Tabulated,
    drawn_summits,
    quantile_summits,
    textured_summits,
)
from historysim.surfaces.preparation import list_keys, registered_steps
from historysim.surfaces.random import random_surface
from historysim.surfaces.reading import read_surface
from historysim.surfaces.summits import Summits
from historysim.tables import Format


@fixture
def folder(tmp_path):
    write_files(tmp_path)
    return tmp_path


def built(folder, entry):
    return loaded(folder, entry).surface()


def refusal(folder, entry):
    with raises(InputError) as refused:
        loaded(folder, entry).build()
    message = str(refused.value)
    assert all(line.startswith(("s.toml: surface", "…")) for line in message.splitlines())
    return message


def bits(summits):
    columns = (summits.height, summits.radius, summits.x, summits.y, summits.slope)
    return [None if column is None else column.tobytes() for column in columns] + [
        summits.nominal_area
    ]


# -- each gives what the function behind it gives
# ---------------------------------------------------


def found_on(surface, rule=9):
    return surface.summits(rule), surface


def met(first, second, shift):
    """Summits of both, the second centre over centre and then moved."""
    sides = [
        (size - 1) / 2 * pixel
        for one in (first, second)
        for size, pixel in zip(one.shape, one.pixel_size, strict=True)
    ]
    over = sides[0] - sides[2] + shift[0], sides[1] - sides[3] + shift[1]
    return first.summits().meeting(second.summits(), shift=over)


def rough_map(folder, pixel_size):
    return read_surface(folder / "maps" / "rough.txt", pixel_size=pixel_size, height_unit="nm")


# the summits and the map of each section, by the functions of the package
BY_FUNCTIONS = {
    "sphere": lambda _: (Summits(0.0, RADIUS), None),
    "inline summits": lambda _: (
        Summits([0.0, -1e-8], [1e-6, 2e-6], [0.0, 1e-5], [0.0, 0.0]),
        None,
    ),
    "summit table": lambda _: (
        Summits([0.0, 12.5 * 1e-9], [1e-5, 2e-5], [0.0, 3e-6], [1e-6, 0.0]),
        None,
    ),
    "textured": lambda _: (
        textured_summits(
            (3, 4), (1e-5, 2e-5), RADIUS * 12**-0.5, height_scatter=1e-9, radius_scatter=0.2, seed=5
        ),
        None,
    ),
    "gaussian statistics": lambda _: (
        drawn_summits(Gaussian(1e-8), RADIUS, **AMOUNT, seed=2),
        None,
    ),
    "inline statistics": lambda _: (
        drawn_summits(Tabulated(TABLE_HEIGHTS, DENSITY), RADIUS, **AMOUNT, seed=2),
        None,
    ),
    "statistics of gaps": lambda _: (
        quantile_summits(Tabulated.from_gaps([0.0, 1e-8], [1.0, 0.0]), RADIUS, **AMOUNT),
        None,
    ),
    "statistics table": lambda _: (
        drawn_summits(
            Tabulated([0 * 1e-9, 10 * 1e-9, 40 * 1e-9], [1, 4, 0.5]), RADIUS, **AMOUNT, seed=2
        ),
        None,
    ),
    "random": lambda _: found_on(random_surface(**ROUGH, autocorrelation="gaussian"), 5),
    "measured": lambda folder: found_on(
        rough_map(folder, (1e-6, 2e-6)).detrended("quadratic").scaled(2e-8).mirrored(), 5
    ),
    "sum": lambda _: found_on(
        random_surface(**ROUGH).combined(random_surface(**OTHER), shift=(1e-6, 3e-6), rotation=0.3),
        5,
    ),
    "inclined summits": lambda _: (Summits([0.0, -1e-8], 1e-6, slope=[0.1, -0.2]), None),
    "meeting": lambda _: (
        met(random_surface(**ROUGH), random_surface(**OTHER), (1e-6, 3e-6)),
        None,
    ),
}
# and of each short one, which has the defaults
BY_FUNCTIONS_IN_SHORT = {
    "inline summits": lambda _: (Summits([0.0, -1e-8], [RADIUS, RADIUS]), None),
    "summit table": lambda _: (Summits([-1e-8, 0.0], [1e-5, 2e-5]), None),
    "textured": lambda _: (textured_summits((3, 4), 1e-5, RADIUS), None),
    "gaussian statistics": lambda _: (quantile_summits(Gaussian(1e-8), RADIUS, **AMOUNT), None),
    "inline statistics": lambda _: (
        quantile_summits(Tabulated(TABLE_HEIGHTS, DENSITY), RADIUS, **AMOUNT),
        None,
    ),
    "statistics table": lambda _: (
        quantile_summits(Tabulated.from_gaps([0, 10, 40], [1, 4, 0.5]), RADIUS, **AMOUNT),
        None,
    ),
    "random": lambda _: found_on(random_surface((24, 17), 1e-6, 1e-8, 4e-6, seed=3)),
    "measured": lambda folder: found_on(rough_map(folder, 1e-6).detrended("plane")),
    "sum": lambda _: found_on(random_surface(**ROUGH) + random_surface(**OTHER)),
}


NAMES = [*SECTIONS, *(f"{name}, in short" for name in SHORT)]
CASES = [
    *((entry, BY_FUNCTIONS[name]) for name, entry in SECTIONS.items()),
    *((entry, BY_FUNCTIONS_IN_SHORT[name]) for name, entry in SHORT.items()),
]


@mark.parametrize("entry, by_functions", CASES, ids=NAMES)
def test_a_kind_equals_its_function_bit_for_bit(folder, entry, by_functions):
    summits, surface = by_functions(folder)
    found = built(folder, entry)
    assert len(summits) > 0
    assert bits(found.summits) == bits(summits)
    history = hs.run(folder / "s.toml")
    coordinates = {
        "summit_height": "height",
        "summit_radius": "radius",
        "x": "x",
        "y": "y",
        "slope": "slope",
    }
    for name, column in coordinates.items():
        values = getattr(summits, column)
        assert (name in history.coords) == (values is not None)
        assert values is None or history[name].values.tobytes() == values.tobytes()
    assert found.friction is None
    if surface is None:
        assert found.surface is None
    else:
        assert found.surface.heights.tobytes() == surface.heights.tobytes()
        assert found.surface.pixel_size == surface.pixel_size
        assert found.surface.periodic == surface.periodic


def test_the_sections_are_of_every_kind_and_have_every_key():
    # a normal curve and a cylinder have no summits, and separate tests
    assert {entry["kind"] for entry in SECTIONS.values()} == set(surface_kinds.SURFACES) - {
        "normal_curve",
        "cylinder",
    }
    kinds = {surface_kinds.SURFACES[entry["kind"]].chosen(entry) for entry in SECTIONS.values()}
    for kind in kinds:
        keys = {
            key
            for entry in SECTIONS.values()
            if surface_kinds.SURFACES[entry["kind"]].chosen(entry) is kind
            for key in entry
        }
        # two belong to files that know their distances or channels, the others to all files of
        # numbers; what prepares a map is tested by itself
        preparing = {key.name for key in list_keys(registered_steps())} | {"prune", "ball_radius"}
        assert {field.name for field in attrs.fields(kind)} - keys <= {
            "lateral_unit",
            "channel",
            "missing",
        } | FORMAT | preparing


FORMAT = {field.name for field in attrs.fields(Format)}
# -- what the keys do
# -------------------------------------------------------------------------------


def test_paths_are_relative_to_the_scenario(folder, monkeypatch, tmp_path_factory):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    expected = bits(built(folder, SECTIONS["measured"]).summits)
    (folder / "below").mkdir()
    for path in ("../maps/rough.txt", str(folder / "maps" / "rough.txt")):
        entry = {**SECTIONS["measured"], "file": path}
        (folder / "below" / "s.toml").write_text(section(entry) + LINES, encoding="utf-8")
        assert bits(scenario.load(folder / "below" / "s.toml").surface().summits) == expected


def shifted_sum(**keys):
    first, second = ({"kind": "random", **OTHER, "seed": seed} for seed in (1, 2))
    return {"kind": "sum", "first": first, "second": second, "shift": [0.5e-6, 1.5e-6], **keys}


@mark.parametrize("interpolation", ["fourier", "none"])
def test_the_second_surface_of_a_sum_by_another_interpolation(folder, interpolation):
    found = built(folder, shifted_sum(interpolation=interpolation))
    first, second = (random_surface(**{**OTHER, "seed": seed}) for seed in (1, 2))
    expected = first.combined(second, shift=(0.5e-6, 1.5e-6), interpolation=interpolation)
    assert found.surface.heights.tobytes() == expected.heights.tobytes()


@mark.parametrize("name", ["random", "measured", "sum"])
def test_a_height_scale_stretches_the_map_with_its_summits(folder, name):
    plain, stretched = (
        built(folder, SECTIONS[name]),
        built(folder, {**SECTIONS[name], "height_scale": 2.5}),
    )
    mean = plain.summits.height.mean()
    for before, after in (
        (plain.summits.height, stretched.summits.height),
        (plain.surface.heights, stretched.surface.heights),
    ):
        assert after - mean == approx(2.5 * (before - mean), rel=1e-12, abs=1e-20, nan_ok=True)
    # each summit is still on the map
    top = stretched.summits.height.max()
    assert np.abs(stretched.surface.heights - top).min() <= 1e-12 * abs(top)
    assert stretched.surface.pixel_size == plain.surface.pixel_size
    assert stretched.surface.periodic == plain.surface.periodic


@mark.parametrize(
    "change", [{"yielding": "kogut-etsion"}, {"interaction": "none", "height_scale": 2.0}]
)
def test_a_changed_surface_has_the_keys_of_its_kind(folder, change):
    plain = loaded(folder, {**SECTIONS["random"], "s_filter": 4e-6})
    changed = loaded(folder, {**SECTIONS["random"], "s_filter": 4e-6, **change})
    assert find_unit(changed.sections, "surface.rms_height") == "m"
    assert np.array_equal(
        changed.raw_surface().surface.heights, plain.raw_surface().surface.heights
    )


@mark.parametrize(
    "entry, seeds",
    [
        (SECTIONS["random"], 3),
        ({**SECTIONS["sum"], "height_scale": 2.0}, [3, 4]),
    ],
)
def test_all_seeds_are_in_the_result_and_its_log(folder, entry, seeds):
    of = loaded(folder, entry)
    assert of.seeds == ([] if seeds is None else [seeds] if isinstance(seeds, int) else seeds)
    with hs.run(of.path, folder / "s.nc") as result, hs.EventLog(folder / "s.history") as log:
        assert log.settings["seed"] == seeds
        found = result.attrs.get("seed")
        assert (found.tolist() if isinstance(found, np.ndarray) else found) == seeds
    assert hs.run(of.path).attrs.get("seed") == seeds
    assert hs.verify(folder / "s.nc")


# -- summits of awkward maps
# ------------------------------------------------------------------------


NO_SUMMIT = {
    "a bowl": np.add.outer(np.linspace(-1, 1, 7) ** 2, np.linspace(-1, 1, 9) ** 2),
}


@mark.parametrize("name", NO_SUMMIT)
def test_a_map_without_summits_is_refused(folder, name):
    np.savetxt(folder / "map.txt", NO_SUMMIT[name])
    lines, columns = NO_SUMMIT[name].shape
    entry = {
        "kind": "measured",
        "file": "map.txt",
        "pixel_size": 1e-6,
        "height_unit": "nm",
        "form": "mean",
    }
    assert refusal(folder, entry) == (
        f"s.toml: surface: the 9-point rule finds no summit among {columns} × {lines} points; expected a point with "
        "only lower neighbours, none of them missing or beyond the border"
    )


# -- what is said about those that cannot be used
# ---------------------------------------------------


# -- sums
# -------------------------------------------------------------------------------------------

BAD_PARTS = [
    ({"kind": "randon"}, ".kind: 'randon'; did you mean 'random'?"),
    ({"kind": "measured", "file": "maps/none.txt"}, ".file: none.txt: there is no such file in"),
]


@mark.parametrize("part, said", BAD_PARTS)
def test_errors_in_a_sum_have_the_whole_path(folder, part, said):
    where = "second.second.first"
    good = {"kind": "random", **ROUGH}
    for key in reversed(where.split(".")):
        part = {"kind": "sum", "first": good, "second": good, key: part}
    message = refusal(folder, part)
    assert message.startswith(f"s.toml: surface.{where}{said}")
    assert len(message.splitlines()) == 1


def nested(levels):
    entry = {"kind": "random", **ROUGH}
    for _ in range(levels):
        entry = {"kind": "sum", "first": entry, "second": {"kind": "random", **OTHER}}
    return entry


def test_sums_within_sums_have_a_deepest_one(folder):
    one, other = random_surface(**ROUGH), random_surface(**OTHER)
    expected = one
    for _ in range(surface_kinds.DEEPEST):
        expected = expected + other
    found = built(folder, nested(surface_kinds.DEEPEST))
    assert found.surface.heights.tobytes() == expected.heights.tobytes()
    said = "s.toml: surface: sums within sums, more than 20 deep; expected fewer"
    assert refusal(folder, nested(surface_kinds.DEEPEST + 1)) == said
    path = folder / "s.toml"
    levels = [".first" * level for level in range(60)]
    path.write_text(
        "".join(f'[surface{level}]\nkind = "sum"\n' for level in levels) + LINES, encoding="utf-8"
    )
    with raises(InputError) as refused:
        scenario.load(path)
    assert str(refused.value) == said


INDENTED = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "normal_curve"
file = "indented.csv"
columns = { approach = "h", load = "F" }
[friction]
coefficient = 0.5
[loading]
waypoints = [{ time = 0, normal_load = 0.01 }, { time = 1, tangential_load = 0.003 }]
"""


def indented(folder, text=INDENTED, load=lambda approach: 4 / 3 * approach**1.5):
    rows = "".join(f"{0.002 * index},{load(0.002 * index)}\n" for index in range(41))
    (folder / "indented.csv").write_text("h,F\n" + rows, encoding="utf-8")
    (folder / "s.toml").write_text(text, encoding="utf-8")
    return folder / "s.toml"


def test_an_indentation_curve_is_a_contact(tmp_path):
    history = hs.run(indented(tmp_path))
    # theory, section 3: a ball of E* = R = 1
    assert float(history["tangential_displacement"][-1]) == approx(8.757317e-3, rel=1e-6)
    assert float(history["total_dissipated_energy"][-1]) == approx(1.310944e-6, rel=1e-5)
    result = hs.run(tmp_path / "s.toml", tmp_path / "s.nc")
    assert result["normal_load"].shape == (2, 1)
    result.close()


ON_A_BALL = """
[materials]
first = "silicon"
second = "float glass"

[surface]
kind = "random"
shape = [64, 64]
pixel_size = "1 µm"
rms_height = "1 nm"
autocorrelation_length = "20 µm"
seed = 1
ball_radius = "2.5 mm"

[friction]
coefficient = 0.2

[loading]
hold = true
waypoints = [{ time = 0, normal_load = "50 mN" }]
"""


def test_the_nominal_area_of_a_rough_ball_agrees_with_the_ball(tmp_path):
    """50 mN on silicon of 2.5 mm on glass: a = 12.962 µm by Hertz, 94.7 MPa."""
    (tmp_path / "ball.toml").write_text(ON_A_BALL, encoding="utf-8")
    with hs.run(tmp_path / "ball.toml", tmp_path / "ball.nc") as history:
        assert history.contact.nominal_pressure().values == approx([94.7e6], abs=0.05e6)
    by_approach = {"loading.waypoints[0].normal_load": "0 N"}
    assert hs.load(tmp_path / "ball.toml", by_approach).surface().summits.nominal_area == approx(
        64**2 * 1e-12
    )


def test_with_full_interaction_a_ball_that_is_hardly_rough_is_a_hertz_contact(tmp_path):
    (tmp_path / "ball.toml").write_text(ON_A_BALL, encoding="utf-8")
    values = {"surface.interaction": "full", "surface.rms_height": "0.01 nm"}
    history = hs.run(hs.load(tmp_path / "ball.toml", values))
    # the edge is known to a pixel
    radius = np.sqrt(history.real_contact_area.values[0] / np.pi)
    assert radius == approx(12.962e-6, abs=0.5e-6)


def test_a_random_map_may_be_cut_out_of_a_larger_one(tmp_path):
    (tmp_path / "ball.toml").write_text(ON_A_BALL, encoding="utf-8")
    values = {
        "surface.ball_radius": "0.4 m",
        "surface.crop_x": ["0 µm", "31 µm"],
        "surface.rms_height": "1 µm",
    }
    cut = hs.load(tmp_path / "ball.toml", values).surface().surface
    whole = hs.random_surface((64, 64), 1e-6, 1e-6, 20e-6, seed=1)
    assert cut.shape == (32, 64)
    # heights are as they fall, not centred anew
    assert cut.heights.mean() == approx(whole.heights[:32].mean(), abs=1e-9)
    assert abs(cut.heights.mean()) > 1e-8
    message = "surface.first.ball_radius: belongs to the surface as a whole"
    twice = {
        "surface": {
            "kind": "sum",
            "first": {"kind": "random", "ball_radius": 1},
            "second": {"kind": "random"},
        }
    }
    with raises(InputError, match=message):
        hs.load(tmp_path / "ball.toml", twice)
