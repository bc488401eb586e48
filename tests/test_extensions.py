"""A package of somebody else adds one of each class with an entry point; the page that explains it is followed."""

import importlib
import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path

import attrs
import numpy as np
import pages
import xarray as xr
from click.testing import CliRunner
from golden import refused
from installed import install
from pytest import approx, fixture, importorskip, mark, raises

import historysim as hs
from historysim.basics import fields
from historysim.basics.fields import field_unit
from historysim.cli import main
from historysim.errors import MissingPackageError
from historysim.scenario.kinds import registries
from historysim.tables import Column

PROJECT = Path(__file__).parent / "stranger"
PAGE = (Path(hs.__file__).parent / "README.md").read_text(encoding="utf-8")
HOW_TO = PAGE.split("## How to add …", 1)[1]
ROWS = [line.strip("| ").split(" | ") for line in HOW_TO.splitlines() if line.startswith("| a")]
BLOCKS = [body for _, language, body in pages.blocks(HOW_TO) if language == "python"]
SCENARIO = """
[materials]
first = "silicon"
second = "float glass"

[surface]
kind = "stairs"
step = "20 nm"
radius = "10 µm"

[friction]
law = "warming"
cold = 0.3
half_load = "2 mN"

[loading]
kind = "strokes"
load = "4 mN"
stroke = "40 nm"
count = 2
substeps = 20

[[picture]]
kind = "gaps"
colour = "red"

[[picture]]
kind = "loops"

[sweep.over]
friction.cold = [0.1, 0.3]
surface.step = ["10 nm", "20 nm"]
"""


WITHOUT = """
[materials]
first = "silicon"
second = "float glass"

[surface]
kind = "sphere"
radius = "10 µm"

[friction]
law = "shear strength"
shear_strength = "11 MPa"

[loading]
waypoints = [{ time = 0, normal_load = "1 mN" }]
"""


@fixture
def site(tmp_path, monkeypatch):
    folder = tmp_path / "site"
    folder.mkdir()
    install(PROJECT, folder)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
    yield folder
    sys.modules.pop("stranger", None)


@fixture
def path(site, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    assert site.exists()
    return path


def called(*arguments):
    done = CliRunner().invoke(main, list(arguments))
    assert done.exit_code == 0, done.output
    return done.output


def test_every_extension_runs_from_the_scenario_to_the_report(path):
    called("run", path.name, "-o", "a.nc", "-q")
    assert "bit-identical" in called("verify", "a.nc")
    called("plot", "a.nc", "-o", "a.png", "--picture", "gaps")
    called("report", "a.nc")
    assert "How far the flat is above the datum." in Path("a_report.html").read_text(
        encoding="utf-8"
    )
    called("sweep", path.name, "-o", "sweep.nc", "--workers", "1")
    with xr.open_dataset("sweep.nc") as sweep:
        assert sweep.preliminary_displacement.dims == ("friction_cold", "surface_step")
        assert sweep.surface_step.attrs["units"] == "m"
        assert np.isfinite(sweep.preliminary_displacement.values).all()


def test_a_kind_of_file_is_shown_and_reported(path):
    path.with_name("a.stamp").write_text("12.5", encoding="utf-8")
    assert "12.5 s" in called("show", "a.stamp")
    called("report", "a.stamp", "-o", "stamp.html")
    assert "<p>12.5 s</p>" in Path("stamp.html").read_text(encoding="utf-8")


def test_numbers_agree_with_the_law(path):
    history = hs.load(path).replay().dataset()
    assert history.summit_height.values == approx(-20e-9 * np.arange(3), abs=1e-20)
    load, friction = history.normal_load.values, history.present_friction.values
    touching = load > 0
    assert friction[touching] == approx((0.3 / (1 + load / 2e-3))[touching], rel=1e-9)
    assert friction[touching].max() > friction[touching].min()


def test_log_and_result_name_the_law_its_package_and_its_numbers(path):
    hs.run(path, "a.nc").close()
    written = {"law": "warming", "package": ["stranger", "1.2"], "cold": 0.3, "half_load": 0.002}
    with hs.EventLog(Path("a.history")) as log:
        assert log.settings["friction_law"] == written
    with hs.open("a.nc") as history:
        assert history.attrs["friction_law_settings"] == (
            '{"law": "warming", "package": ["stranger", "1.2"], "cold": 0.3, "half_load": 0.002}'
        )
        assert history.attrs["packages"] == "stranger 1.2"


def test_a_missing_package_is_named(path, site):
    hs.run(path, "a.nc").close()
    shutil.rmtree(next(site.glob("*.dist-info")))
    with raises(
        MissingPackageError, match=r"friction law 'warming' is of stranger 1.2, which is not there"
    ):
        hs.verify("a.nc")
    with refused(r"surface.kind: 'stairs'; "):
        hs.load(path)
    with refused(r"the scenario in the result: picture: \[0\].kind: 'gaps'; expected"):
        hs.plot("a.nc")
    with refused("picture is 'gaps'; expected one of"):
        hs.plot(xr.open_dataset("a.nc"), picture="gaps")


def test_another_version_of_a_package_is_reported(path, site):
    hs.run(path, "a.nc").close()
    info = next(site.glob("*.dist-info"))
    metadata = (info / "METADATA").read_text(encoding="utf-8")
    info.rename(site / "stranger-1.3.dist-info")
    (site / "stranger-1.3.dist-info" / "METADATA").write_text(
        metadata.replace("1.2", "1.3"), encoding="utf-8"
    )
    told = []
    found = hs.verify("a.nc", notify=told.append)
    assert found
    assert not found.differences
    assert "stranger 1.2; this is historysim" in told[0]
    assert "stranger 1.3" in told[0]


def test_the_rest_of_the_package_is_used(path, tmp_path):
    # a separate law on top of a separate law is asked very often
    plain = SCENARIO.replace('law = "warming"\ncold = 0.3\nhalf_load = "2 mN"', "coefficient = 0.3")
    worn = plain.replace("[loading]", '[wear]\nlaw = "squared"\nrate = 1e-9\n[loading]')
    path.write_text(worn, encoding="utf-8")
    history = hs.load(path).replay().dataset()
    assert history.worn_volume.values.max() > 0
    assert '"rate": 1e-09' in history.attrs["wear_law_settings"]
    path.write_text(
        SCENARIO.replace('"10 µm"', '"10 µm"\nyielding = { law = "soft", onset = "2 nm" }'),
        encoding="utf-8",
    )
    hs.run(path, "yielded.nc").close()
    assert "bit-identical" in called("verify", "yielded.nc")
    with hs.open("yielded.nc") as history:
        # Hertz's at the onset, and its tangent beyond: below Hertz's there, so that the summits
        # stay flattened
        load, depth = (
            history.normal_load.values.max(axis=0),
            history.yielded_depth.values.max(axis=0),
        )
        assert (depth > 0).tolist() == (
            load > 4 / 3 * history.contact_modulus * np.sqrt(1e-5 * 2e-9**3)
        ).tolist()
        assert (depth > 0).any()
        assert (
            '"package": ["stranger", "1.2"], "onset": 2e-09'
            in history.attrs["yielding_law_settings"]
        )
    (tmp_path / "a.stairs").write_text("5 8", encoding="utf-8")
    surface = hs.read_surface(tmp_path / "a.stairs")
    assert surface.heights.shape == (5, 5)
    assert surface.heights[-1, -1] == approx(8e-9)


def named_classes(cell):
    """The classes that a cell of the page names; a name without its module is of the module before."""
    module = None
    for name in re.findall(r"`([\w.]+)`", cell):
        if "." in name:
            module = importlib.import_module(f"historysim.{name.rpartition('.')[0]}")
        yield getattr(module, name.rpartition(".")[2])


@mark.parametrize("row", [row for row in ROWS if row[1].startswith("`")], ids=lambda row: row[0])
def test_the_page_names_methods_and_fields_that_exist(row):
    classes = [*named_classes(row[1])]
    bases = {base for kind in classes for base in inspect.getmro(kind)}
    members = {name for base in bases for name in (*dir(base), *inspect.get_annotations(base))}
    for code in re.findall(r"`([^`]+)`", row[2]):
        name, parenthesis, arguments = code.partition("(")
        if name in {"kind", "Chart", "Sheet", "HeightMap", "summary"}:
            continue
        assert name in members, code
        if parenthesis:
            method = next(getattr(kind, name) for kind in classes if hasattr(kind, name))
            stated = [
                argument.strip().removesuffix("=…") for argument in arguments.strip(")").split(",")
            ]
            assert stated == [
                name for name in inspect.signature(method).parameters if name != "self"
            ], code


def test_the_page_names_types_checks_and_groups_that_exist():
    introduction = HOW_TO.split("| to add |")[0]
    names = re.search(
        r"has types with\s+units\s+\((.*?), …\) and checks \((.*?)\)", introduction
    ).groups()
    names = re.findall(r"`(\w+)`", " ".join(names))
    assert len(names) > 3
    assert [name for name in names if not hasattr(fields, name)] == []
    groups = {row[4].strip("` ") for row in ROWS if len(row) > 4 and row[4].strip("` |")}
    assert groups == {registry.group for registry in registries().values()}


def test_the_package_has_one_of_each_and_the_examples_of_the_page(site):
    stranger = importlib.import_module("stranger")
    kinds = {
        kind
        for row in ROWS
        if len(row) > 4 and row[4].strip("` |")
        for kind in named_classes(row[1])
    }
    own = [
        value
        for value in vars(stranger).values()
        if inspect.isclass(value) and value.__module__ == "stranger"
    ]
    assert [kind for kind in kinds if not any(issubclass(value, kind) for value in own)] == []
    source = (site / "stranger.py").read_text(encoding="utf-8")
    law, picture, reader = (block[block.index("class ") :] for block in BLOCKS[:3])
    assert (law[:13], picture[:12], reader[:13]) == (
        "class Warming",
        "class Limits",
        "class Slashed",
    )
    assert all(text.strip() in source for text in (law, picture, reader))


STRINGS = {"N": "2 mN", "m": "3 nm", "s": "4 ms", "J m-2": "5 mJ/m2", "1": 0.5}
NUMBERS = {"N": 2e-3, "m": 3e-9, "s": 4e-3, "J m-2": 5e-3, "1": 0.5}


@mark.usefixtures("site")
@mark.parametrize(
    "name",
    ["Warming", "SquaredWear", "Halved", "Soft", "Grease", "Stairs", "Strokes", "Cone", "Filled"],
)
def test_its_classes_accept_units_in_python(name):
    kind = getattr(importlib.import_module("stranger"), name)
    units = {
        field.name: field_unit(field.type)
        for field in attrs.fields(kind)
        if field.name in kind.__annotations__
    }
    units = {key: unit for key, unit in units.items() if unit}
    assert units
    made = kind(**{key: STRINGS[unit] for key, unit in units.items()})
    assert made == kind(**{key: NUMBERS[unit] for key, unit in units.items()})
    assert {type(getattr(made, key)) for key in units} == {float}
    key, unit = next(iter(units.items()))
    others = {other: NUMBERS[units[other]] for other in units if other != key}
    said = (
        f"{name}: {key}: '5 K': 'K' is not a unit of"
        if unit != "1"
        else f"{name}: {key}: '5 K' is a string"
    )
    with refused(said):
        kind(**others, **{key: "5 K"})


def test_its_tables_map_and_picture_are_read_and_drawn(path, tmp_path):
    np.array([[1.0, 2.0], [3.0, 5.0]]).tofile(tmp_path / "a.doubles")
    (tmp_path / "a.slashed").write_text("load (mN)/stroke (nm)\n1/3\n2/5\n", encoding="utf-8")
    columns = {"load": Column("load"), "stroke": Column("stroke")}
    for name in ("a.doubles", "a.slashed"):
        table = hs.tables.read_table(tmp_path / name, columns, {"load": "N", "stroke": "m"})
        assert table.columns["load"].tolist() == [1e-3, 2e-3]
        assert table.columns["stroke"].tolist() == approx([3e-9, 5e-9])
    called("plot", *_result(path), "-o", "limits.png", "--picture", "limits")
    path.write_text(
        WITHOUT.replace('"sphere"\nradius = "10 µm"', '"cone"\nheight = "20 nm"'), encoding="utf-8"
    )
    built = hs.load(path).surface()
    assert built.summits.height.tolist() == [0.0]


def _result(path):
    hs.run(path, "a.nc").close()
    return ("a.nc",)


TYPED = """
from typing import assert_type
import historysim as hs
from historysim.results.accessor import Queries
from xarray import DataArray
pair = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=8e9)
for asperity in hs.Ensemble(pair, 0.0, 1e-5, 0.2):
    assert_type(asperity.stick_radius, float)
    assert_type(asperity.slip_state, hs.SlipState)
contact: Queries = hs.replay(asperity.ensemble, [hs.NormalLoad(0.0, 1e-3)]).contact
assert_type(contact.stick_ratio(), DataArray)
"""


@mark.ci
def test_type_checkers_accept_the_page_and_the_package(tmp_path):
    importorskip("mypy", reason="needs mypy: pip install -e '.[lint]'")
    shutil.copy(PROJECT / "stranger.py", tmp_path)
    for number, block in enumerate(BLOCKS):
        (tmp_path / f"block{number}.py").write_text(block, encoding="utf-8")
    (tmp_path / "typed.py").write_text(TYPED, encoding="utf-8")
    files = sorted(map(str, tmp_path.glob("*.py")))
    options = [
        "--config-file=",
        "--check-untyped-defs",
        "--ignore-missing-imports",
        "--follow-imports=silent",
    ]
    command = [sys.executable, "-m", "mypy", *options, *files]
    done = subprocess.run(
        command, cwd=PROJECT.parents[1], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


@mark.parametrize(
    "before, after, said",
    [
        ("half_load", "half_lode", "friction.half_lode: unknown key; did you mean 'half_load'"),
        (
            '"10 µm"',
            '"10 µm"\nyielding = { law = "soft", onse = 1 }',
            "surface.yielding.onse: unknown key; did you",
        ),
    ],
)
def test_keys_of_an_extension_are_checked(path, before, after, said):
    path.write_text(SCENARIO.replace(before, after), encoding="utf-8")
    with refused(said):
        hs.load(path)


def test_a_step_of_preparation_gives_maps_its_key(path):
    rough = "shape = [32, 32]\npixel_size = 1e-6\nrms_height = 1e-8\nautocorrelation_length = 4e-6\nseed = 1\n"
    section = f'kind = "random"\n{rough}floor = "5 nm"'
    path.write_text(WITHOUT.replace('kind = "sphere"\nradius = "10 µm"', section), encoding="utf-8")
    built = hs.load(path).surface()
    assert built.surface.heights.min() == 5e-9
    assert "filled up to 5e-09 m" in built.notices
    assert hs.load(path).raw_surface().surface.heights.min() < 0


def test_help_lists_it(path):
    assert "warming" in called("kinds", "laws")
    assert path.exists()
    lines = called("kinds", "laws", "warming").splitlines()
    assert lines[0].endswith("[stranger 1.2]")
    assert [line.split() for line in lines[1:]] == [
        ["cold", "≥", "0"],
        ["half_load", "[N]", ">", "0"],
    ]
    groups = {
        "laws",
        "wear",
        "attraction",
        "yielding",
        "events",
        "surfaces",
        "loadings",
        "readers",
        "files",
        "plots",
        "preparations",
    }
    assert set(registries()) == groups
    assert "gaps" in called("plot", "--help")


def test_a_package_that_cannot_be_loaded_is_named(path, site):
    (site / "stranger.py").write_text("1/0", encoding="utf-8")
    sys.modules.pop("stranger", None)
    with refused(r"of the package stranger cannot be loaded from stranger:Stairs \(division"):
        hs.load(path)
    # what does not need it works
    path.write_text(WITHOUT, encoding="utf-8")
    assert hs.load(path).replay().dataset().sizes["step"] == 1


GREASED = (
    WITHOUT.replace('law = "shear strength"\nshear_strength = "11 MPa"', "coefficient = 0.4")
    + """
[record]
asperities = "all"
"""
)
WAYPOINTS = """waypoints = [
    { time = 0, normal_load = "1 mN" },
    { time = 1, tangential_load = "0.1 mN" },
    { time = 2, grease = { part = 0.5 } },
    { time = 3, tangential_load = "0 N" },
]"""


def greased(path, waypoints=WAYPOINTS):
    before = 'waypoints = [{ time = 0, normal_load = "1 mN" }]'
    path.write_text(GREASED.replace(before, waypoints), encoding="utf-8")
    return path


def test_an_event_of_it_runs_and_is_in_the_log(path, site):
    hs.run(greased(path), "a.nc").close()
    with hs.open("a.nc") as history:
        assert history.present_friction.values.ravel().tolist() == [0.4, 0.4, 0.2, 0.2]
    assert "bit-identical" in called("verify", "a.nc")
    with hs.EventLog(Path("a.history")) as log:
        event = log.events()[2]
        assert (event.name, event.time, event.part) == ("grease", 2.0, 0.5)
        log.append([type(event)(4.0, 0.5)])
        assert log.replay().present_friction.values.ravel().tolist() == [0.4, 0.4, 0.2, 0.2, 0.1]
    assert "grease" in called("log", "a.history")
    shutil.rmtree(next(site.glob("*.dist-info")))
    with (
        hs.EventLog(Path("a.history")) as log,
        raises(
            MissingPackageError,
            match=r"holds an event 'grease' of stranger 1.2, which is not there",
        ),
    ):
        log.events()
    with refused(r"loading.waypoints\[2\].grease: unknown key"):
        hs.load(path)


@mark.parametrize(
    "told, said",
    [
        (
            "{ part = -1 }",
            r"loading.waypoints\[2\].grease: Grease: part is -1.0; expected a number of 0 or more",
        ),
    ],
)
def test_keys_of_its_event_are_checked(path, told, said):
    with refused(said):
        hs.load(greased(path, WAYPOINTS.replace("{ part = 0.5 }", told)))
