"""A package of somebody else adds laws, a surface, a loading, a reader and a picture, from TOML to the report."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from installed import install

import historysim as hs
from historysim.cli import main
from historysim.errors import InputError, MissingPackageError
from historysim.scenario.kinds import registries

PROJECT = Path(__file__).parent / "stranger"
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


@pytest.fixture
def site(tmp_path, monkeypatch):
    folder = tmp_path / "site"
    folder.mkdir()
    install(PROJECT, folder)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
    yield folder
    sys.modules.pop("stranger", None)


@pytest.fixture
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
    assert "How far the flat is above the datum." in Path("a_report.html").read_text(encoding="utf-8")
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
    assert history.summit_height.values == pytest.approx(-20e-9 * np.arange(3), abs=1e-20)
    load, friction = history.normal_load.values, history.present_friction.values
    touching = load > 0
    assert friction[touching] == pytest.approx((0.3 / (1 + load / 2e-3))[touching], rel=1e-9)
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
    with pytest.raises(MissingPackageError, match=r"friction law 'warming' is of stranger 1.2, which is not there"):
        hs.verify("a.nc")
    with pytest.raises(InputError, match=r"surface.kind: 'stairs'; "):
        hs.load(path)
    with pytest.raises(InputError, match=r"the scenario in the result: picture: \[0\].kind: 'gaps'; expected"):
        hs.plot("a.nc")
    with pytest.raises(InputError, match="picture is 'gaps'; expected one of"):
        hs.plot(xr.open_dataset("a.nc"), picture="gaps")


def test_another_version_of_a_package_is_reported(path, site):
    hs.run(path, "a.nc").close()
    info = next(site.glob("*.dist-info"))
    metadata = (info / "METADATA").read_text(encoding="utf-8")
    info.rename(site / "stranger-1.3.dist-info")
    (site / "stranger-1.3.dist-info" / "METADATA").write_text(metadata.replace("1.2", "1.3"), encoding="utf-8")
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
        SCENARIO.replace('"10 µm"', '"10 µm"\nyielding = { law = "soft", onset = "2 nm" }'), encoding="utf-8"
    )
    hs.run(path, "yielded.nc").close()
    assert "bit-identical" in called("verify", "yielded.nc")
    with hs.open("yielded.nc") as history:
        # Hertz's at the onset, and its tangent beyond: below Hertz's there, so that the summits stay flattened
        load, depth = history.normal_load.values.max(axis=0), history.yielded_depth.values.max(axis=0)
        assert (depth > 0).tolist() == (load > 4 / 3 * history.contact_modulus * np.sqrt(1e-5 * 2e-9**3)).tolist()
        assert (depth > 0).any()
        assert '"package": ["stranger", "1.2"], "onset": 2e-09' in history.attrs["yielding_law_settings"]
    (tmp_path / "a.stairs").write_text("5 8", encoding="utf-8")
    surface = hs.read_surface(tmp_path / "a.stairs")
    assert surface.heights.shape == (5, 5)
    assert surface.heights[-1, -1] == pytest.approx(8e-9)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("half_load", "half_lode", "friction.half_lode: unknown key; did you mean 'half_load'"),
        ('"10 µm"', '"10 µm"\nyielding = { law = "soft", onse = 1 }', "surface.yielding.onse: unknown key; did you"),
    ],
)
def test_keys_of_an_extension_are_checked(path, before, after, said):
    path.write_text(SCENARIO.replace(before, after), encoding="utf-8")
    with pytest.raises(InputError, match=said):
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
    assert [line.split() for line in lines[1:]] == [["cold", "≥", "0"], ["half_load", "[N]", ">", "0"]]
    groups = {"laws", "wear", "yielding", "events", "surfaces", "loadings", "readers", "files", "plots", "preparations"}
    assert set(registries()) == groups
    assert "gaps" in called("plot", "--help")


def test_a_package_that_cannot_be_loaded_is_named(path, site):
    (site / "stranger.py").write_text("1/0", encoding="utf-8")
    sys.modules.pop("stranger", None)
    with pytest.raises(InputError, match=r"of the package stranger cannot be loaded from stranger:Stairs \(division"):
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
        pytest.raises(MissingPackageError, match=r"holds an event 'grease' of stranger 1.2, which is not there"),
    ):
        log.events()
    with pytest.raises(InputError, match=r"loading.waypoints\[2\].grease: unknown key"):
        hs.load(path)


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ("{ part = -1 }", r"loading.waypoints\[2\].grease: Grease: part is -1.0; expected a number of 0 or more"),
    ],
)
def test_keys_of_its_event_are_checked(path, told, said):
    with pytest.raises(InputError, match=said):
        hs.load(greased(path, WAYPOINTS.replace("{ part = 0.5 }", told)))
