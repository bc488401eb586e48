"""The surface in a result: contents of the group ``surface`` of a result."""

import netCDF4
import numpy as np
import xarray as xr
from click.testing import CliRunner
from conventions import conventions
from pytest import approx, fixture, mark
from sections import LINES, SECTIONS, loaded, write_files

import historysim as hs
from historysim.cli import main
from historysim.recording import surface_group
from historysim.recording.surface_group import GROUP, MOST_POINTS, SUMMITS, SURFACE
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

pytestmark = mark.ci

PRESSED = LINES.replace("normal_load = 0", "normal_load = 1e-6").replace('"all"', '"touching"')
COLUMNS = {"summit_height": "height", "summit_radius": "radius", "summit_x": "x", "summit_y": "y"}
CASES = SECTIONS


@fixture
def folder(tmp_path):
    write_files(tmp_path)
    return tmp_path


def run(folder, entry, lines=PRESSED, output="out.nc"):
    found = loaded(folder, entry, lines).surface()
    hs.run(folder / "s.toml", folder / output).close()
    return folder / output, found


def gapped(shape, share=0.31, seed=0):
    heights = np.random.default_rng(seed).normal(size=shape) * 1e-9
    heights[np.random.default_rng(seed + 1).random(shape) < share] = np.nan
    return Surface(heights, (1e-6, 2e-6))


# -- contents -----------------------------------------------------------------------------


@mark.parametrize("entry", CASES.values(), ids=CASES)
def test_every_kind_stores_its_summits_and_map_bit_for_bit(folder, entry):
    path, ground = run(folder, entry)
    with xr.open_dataset(path, group=GROUP) as group:
        assert group.sizes["summit"] == len(ground.summits)
        for name, column in COLUMNS.items():
            expected = getattr(ground.summits, column)
            assert (name in group) == (expected is not None)
            if expected is not None:
                assert group[name].values.tobytes() == expected.tobytes()
        assert group.attrs.get("nominal_area") == ground.summits.nominal_area
        assert ("height" in group) == (ground.surface is not None)
        if ground.surface is not None:
            assert group["height"].values.tobytes() == ground.surface.heights.tobytes()
            for axis, pixel in zip("xy", ground.surface.pixel_size, strict=True):
                assert group[axis].values.tolist() == [
                    index * pixel for index in range(group.sizes[axis])
                ]
            assert group.attrs["thinning"].tolist() == [1, 1]
        xr.testing.assert_identical(
            group.load(), surface_group.dataset(ground.summits, ground.surface)
        )
    with xr.open_dataset(path) as opened:
        history = opened.load()
    # an asperity is the index of its summit
    labels = history["asperity"].values
    assert labels.size > 0
    assert history.attrs["number_of_asperities"] == group.sizes["summit"]
    for name in ("summit_height", "summit_radius"):
        assert history[name].values.tobytes() == group[name].values[labels].tobytes()
    for axis in "xy":
        if f"summit_{axis}" in group:
            assert (
                history[axis].values.tobytes() == group[f"summit_{axis}"].values[labels].tobytes()
            )
    # only the file says when it was written
    assert history.attrs.pop("date_created").endswith("Z")
    xr.testing.assert_identical(history, hs.run(folder / "s.toml"))


def test_a_summit_stands_on_its_point_of_the_map(folder):
    path, _ = run(folder, SECTIONS["random"])
    with xr.open_dataset(path, group=GROUP) as group:
        on_map = group["height"].sel(x=group["summit_x"], y=group["summit_y"], method="nearest")
        assert (on_map.values == group["summit_height"].values).all()


@mark.parametrize("record", ['"totals"'])
def test_it_does_not_depend_on_what_is_recorded(folder, record):
    expected, _ = run(folder, SECTIONS["random"])
    path, _ = run(folder, SECTIONS["random"], PRESSED.replace('"touching"', record), "other.nc")
    with xr.open_dataset(expected, group=GROUP) as one, xr.open_dataset(path, group=GROUP) as other:
        xr.testing.assert_identical(one.load(), other.load())


def test_missing_heights_are_nan_and_nothing_else_is(folder):
    surface = gapped((20, 30))
    np.save(folder / "gaps.npy", surface.heights)
    entry = {
        "kind": "measured",
        "file": "gaps.npy",
        "pixel_size": 1e-6,
        "height_unit": "m",
        "form": "mean",
    }
    path, ground = run(folder, entry)
    with netCDF4.Dataset(path) as file:
        height = file[GROUP]["height"]
        assert np.isnan(height._FillValue)
        assert (np.ma.getmaskarray(height[:]) == surface.missing).all()
        for name, variable in file[GROUP].variables.items():
            assert ("_FillValue" in variable.ncattrs()) == (name == "height")
    with xr.open_dataset(path, group=GROUP) as group:
        assert (np.isnan(group["height"].values) == ground.surface.missing).all()
        assert group["summit_height"].notnull().all()


@mark.parametrize(
    "shape, strides",
    [
        ((513, 512), (2, 1)),
        ((1024, 700), (2, 2)),
        ((1, 2000), (1, 1)),
        ((600_000, 1), (3, 1)),
    ],
)
def test_what_a_picture_cannot_show_of_a_map_is_left_out(shape, strides):
    heights = np.arange(np.prod(shape), dtype=float).reshape(shape)
    found = surface_group.dataset(Summits(0.0, 1.0), Surface(heights, (1e-6, 3e-6)))
    assert found.attrs["thinning"].tolist() == list(strides)
    assert found["height"].size <= MOST_POINTS**2
    kept = np.ix_(
        *(np.arange(0, size, stride) for size, stride in zip(shape, strides, strict=True))
    )
    assert (found["height"].values == heights[kept]).all()
    assert found["x"].values == approx(np.arange(found.sizes["x"]) * strides[0] * 1e-6)
    assert found["y"].values == approx(np.arange(found.sizes["y"]) * strides[1] * 3e-6)


def test_variables_agree_with_the_table(folder):
    path, _ = run(folder, SECTIONS["random"])
    with netCDF4.Dataset(path) as file:
        group = file[GROUP]
        assert set(group.variables) == {variable.name for variable in (*SURFACE, *SUMMITS)}
        for variable in (*SURFACE, *SUMMITS):
            found = group[variable.name]
            assert (found.dimensions, found.dtype) == (variable.dimensions, variable.dtype)
            assert {
                key: found.getncattr(key) for key in found.ncattrs() if key != "_FillValue"
            } == variable.attributes


# -- the file --------------------------------------------------------------------------------------


def raised_to_the_root(path, target):
    """Copy the group to the root of a separate file, byte by byte, since the checker looks nowhere else."""
    with netCDF4.Dataset(path) as file, netCDF4.Dataset(target, "w") as copy:
        group = file[GROUP]
        copy.setncatts(
            {key: file.getncattr(key) for key in ("Conventions", "title", "history", "source")}
        )
        copy.setncatts({key: group.getncattr(key) for key in group.ncattrs()})
        for name, dimension in group.dimensions.items():
            copy.createDimension(name, len(dimension))
        for name, variable in group.variables.items():
            attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
            fill = attributes.pop("_FillValue", False)
            made = copy.createVariable(name, variable.dtype, variable.dimensions, fill_value=fill)
            made.setncatts(attributes)
            made[:] = variable[:]


@mark.parametrize("name", ["random", "gaps"])
def test_the_group_follows_the_cf_conventions(folder, name):
    np.save(folder / "gaps.npy", gapped((20, 30)).heights)
    entry = CASES.get(name) or {
        "kind": "measured",
        "file": "gaps.npy",
        "pixel_size": 1e-6,
        "height_unit": "m",
    }
    path, _ = run(folder, entry)
    assert conventions(path) == ([], [])
    raised_to_the_root(path, folder / "group.nc")
    assert conventions(folder / "group.nc") == ([], [])


# -- damaged files
# -----------------------------------------------------------------------------------


def plot(path):
    return CliRunner().invoke(
        main, ["plot", str(path), "--step", "-1", "-o", str(path.parent / "picture.png")]
    )


@mark.parametrize("name", ["summit_height", "x"])
def test_a_group_that_lacks_something(folder, name):
    path, _ = run(folder, SECTIONS["random"])
    with netCDF4.Dataset(path, "a") as file:
        file[GROUP].renameVariable(name, "other")
    done = plot(path)
    assert done.exit_code in {0, 2}
    assert done.exit_code == 0 or done.stderr.startswith("Error: ")
    assert name not in {"summit_height", "summit_radius"} or "summits" in done.stderr
