import io
import re
import sys
import warnings
import zipfile
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from golden import refused
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx, fixture, importorskip
from records_shared import SHARED

from historysim.errors import InputError, UnlikelyValueWarning
from historysim.surfaces import map_files
from historysim.surfaces.reading import read_surface

HEIGHTS = SHARED / "heights"
EPS = np.finfo(float).eps
PLAIN = {"pixel_size": "1 µm", "height_unit": "nm"}
METRES = {"pixel_size": 1.0, "height_unit": "m"}

measured_files = pytest.mark.skipif(
    not HEIGHTS.is_dir(), reason="the folder of measured height maps is not there"
)


@fixture(scope="module")
def library():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of parallel computers that it does not find
        return importorskip("SurfaceTopography")


@fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def rough(shape, *, missing=0.0, seed=1):
    rng = np.random.default_rng(seed)
    heights = rng.normal(size=shape)
    heights[rng.random(shape) < missing] = np.nan
    return heights


# measured files, against their raw content


def nanoscope(path):
    """The first image of a Nanoscope file, line by line [nm], and its scan size [nm], by its header."""
    content = path.read_bytes()
    header = content[: content.index(b"\\*File list end")].decode("latin-1")
    image = header.split("\\*Ciao image list")[1]
    sensor, volts = re.search(r"\\@2:Z scale: V \[(.*?)\] \(.*?\) ([\d.]+) V", image).groups()
    sensitivity = float(re.search(rf"\\@{re.escape(sensor)}: V ([\d.]+) nm/V", header).group(1))
    offset, columns, lines = (
        int(re.search(rf"\\{key}: (\d+)", image).group(1))
        for key in ("Data offset", "Samps/line", "Number of lines")
    )
    size = float(re.search(r"\\Scan Size: (\d+) nm", header).group(1))
    raw = np.frombuffer(content, "<i2", count=columns * lines, offset=offset).reshape(
        lines, columns
    )
    # the Z scale is what the 2¹⁶ steps span together
    return raw * (float(volts) / 2**16 * sensitivity), size


@measured_files
def test_atomic_force_map_against_its_raw_numbers(library):  # noqa: ARG001 - skips where it is not installed
    surface = read_surface(HEIGHTS / "di-4.di")
    lines, size = nanoscope(HEIGHTS / "di-4.di")
    assert surface.shape == (512, 512)
    assert surface.pixel_size == approx((size * 1e-9 / 512,) * 2, rel=8 * EPS)
    assert surface.size == approx((10e-6, 10e-6), rel=8 * EPS)
    assert not surface.periodic
    assert not surface.missing.any()
    # the first line of the file is the lowest of the picture, and y is counted from the top
    assert_allclose(surface.heights, lines[::-1].T * 1e-9, rtol=8 * EPS)
    assert surface.heights.std() == approx(82e-9, abs=0.5e-9)


@measured_files
def test_optical_map_against_its_raw_numbers(library):  # noqa: ARG001 - skips where it is not installed
    surface = read_surface(HEIGHTS / "x3p-2.x3p")
    with zipfile.ZipFile(HEIGHTS / "x3p-2.x3p") as archive:
        index = ET.fromstring(archive.read("main.xml"))  # noqa: S314 - of a file that is known
        raw = np.frombuffer(archive.read("bindata/data.bin"), "<f8").reshape(650, 650)
    steps = [float(index.find(f"Record1/Axes/{axis}/Increment").text) for axis in ("CX", "CY")]
    assert surface.shape == (650, 650)
    assert surface.pixel_size == approx(steps, rel=8 * EPS)
    assert surface.size == approx((83e-6, 204e-6), rel=5e-3)
    assert_array_equal(surface.heights, raw.T)
    assert surface.heights.std() == approx(77e-9, abs=0.5e-9)


@measured_files
def test_channels_of_a_measured_file(library):  # noqa: ARG001 - skips where it is not installed
    path = HEIGHTS / "di-4.di"
    default = read_surface(path)
    for channel in (0, "ZSensor"):
        assert_array_equal(read_surface(path, channel=channel).heights, default.heights)
    listed = r"0 ZSensor, 1 AmplitudeError \(no heights\), and 1 more"
    # the amplitude error is in nm, and still no height
    for channel in (1, "AmplitudeError", 2, "Phase"):
        with refused(rf"di-4.di: channel {channel!r} holds no heights; .* {listed}"):
            read_surface(path, channel=channel)
    for channel in (3, -1, "Height", True):
        with refused(rf"has no channels {channel!r}; .* {listed}"):
            read_surface(path, channel=channel)


@measured_files
@pytest.mark.parametrize("name", ["di-4.di", "x3p-2.x3p"])
def test_a_measured_file_cut_short_is_refused(library, scratch, name):  # noqa: ARG001 - skips where it is not there
    content = (HEIGHTS / name).read_bytes()
    # the last but one leaves as many bytes as a square of 16-bit numbers has, which one format
    # consists of
    for length in (300, 2 * 512**2, len(content) - 1):
        path = scratch / name
        path.write_bytes(content[:length])
        with refused(f"^{name}: (holds no heights, or )?is damaged, or of no format"):
            read_surface(path, **PLAIN)


# formats that SurfaceTopography writes


WRITERS = {"nc": "to_netcdf", "x3p": "to_x3p", "gwy": "to_gwy", "txt": "to_matrix"}


@pytest.mark.parametrize("ending", WRITERS)
def test_units_and_missing_points_come_through(library, tmp_path, ending):
    unit = "Å"
    heights = rough((12, 7), missing=0.31)
    path = tmp_path / f"map.{ending}"
    topography = library.Topography(np.ma.masked_invalid(heights), (6.0, 14.0), unit=unit)
    getattr(topography, WRITERS[ending])(str(path))
    surface = read_surface(path)
    assert surface.shape == (12, 7)
    # two conversions on the way there and back, and the digits of the text formats (15 after the
    # point)
    assert surface.pixel_size == approx((0.5e-10, 2e-10), rel=1e-14)
    assert_array_equal(surface.missing, np.isnan(heights))
    assert surface.missing.any()
    assert_allclose(surface.heights, heights * 1e-10, rtol=8 * EPS)


def test_arrays_that_may_be_anything_have_to_be_chosen(library, tmp_path):  # noqa: ARG001 - skips where it is not there
    from scipy.io import savemat

    path = tmp_path / "maps.mat"
    savemat(path, {"x": np.ones((4, 3)), "z": np.arange(12.0).reshape(4, 3)})
    with refused("does not state which are heights; give channel: 0 x, 1 z"):
        read_surface(path, **METRES)
    surface = read_surface(path, channel="z", pixel_size=(1.0, 2.0), height_unit="m")
    assert_array_equal(surface.heights, np.arange(12.0).reshape(4, 3))
    assert surface.pixel_size == (1.0, 2.0)
    with refused("does not state the distance between its points; give pixel_size"):
        read_surface(path, channel="z", height_unit="m")


# texts with a header


HEADER = "# Channel: Z\n# Breite: 8 µm\n# Höhe: 1.5 µm\n# Einheiten: nm\n"
ROWS = "1 2 3 4\n5 6 nan 8\n9 10 11 12\n"


def test_a_header_says_size_and_unit(library, tmp_path):  # noqa: ARG001 - skips where it is not installed
    surface = read_surface(written(tmp_path / "map.txt", HEADER + ROWS))
    assert surface.pixel_size == approx((2e-6, 0.5e-6), rel=8 * EPS)
    assert_allclose(
        surface.heights,
        np.array([[1, 5, 9], [2, 6, 10], [3, np.nan, 11], [4, 8, 12]]) * 1e-9,
        rtol=4 * EPS,
    )
    with refused("its heights are in nm, but height_unit is 'µm'"):
        read_surface(tmp_path / "map.txt", height_unit="µm")


@pytest.mark.parametrize("broken", ["1.O 2 3 4", "5 6 7,5 8"])
@pytest.mark.parametrize("place", [0, 3])
def test_no_line_under_a_header_is_passed_over(library, tmp_path, broken, place):  # noqa: ARG001 - skips where not there
    rows = ROWS.splitlines()
    rows.insert(place, broken)
    path = written(tmp_path / "map.txt", HEADER + "\n".join(rows) + "\n")
    with refused(rf"line {place + 5} contains a value that is not a number|different|damaged"):
        read_surface(path)


def test_what_needs_the_extra_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    hint = re.escape('pip install "historysim[surfaces]"')
    (tmp_path / "map.spm").write_bytes(b"\\*File list\r\n")
    with refused(f"map.spm: needs SurfaceTopography, .*{hint}$"):
        read_surface(tmp_path / "map.spm")
    path = written(tmp_path / "map.txt", HEADER + ROWS)
    with refused(f"{hint}; or remove line 2: '# Breite: 8 µm', and give pixel_size"):
        read_surface(path, **PLAIN)
    assert read_surface(written(tmp_path / "plain.txt", ROWS), **PLAIN).shape == (4, 3)
    np.save(tmp_path / "map.npy", np.ones((3, 4)))
    assert read_surface(tmp_path / "map.npy", **PLAIN).shape == (3, 4)


# lists of coordinates


def coordinates(heights, step_x, step_y):
    points = [(i * step_x, j * step_y, z) for (i, j), z in np.ndenumerate(heights)]
    return "".join(" ".join(map(repr, map(float, point))) + "\n" for point in points)


def test_coordinates_of_a_map(library, tmp_path):  # noqa: ARG001 - skips where it is not installed
    heights = rough((5, 4), missing=0.2)
    path = written(tmp_path / "map.xyz", coordinates(heights, 0.5, 0.25))
    with refused("does not name the unit of its heights; give height_unit"):
        read_surface(path)
    with refused("does not name the unit of its distances; give lateral_unit"):
        read_surface(path, height_unit="nm")
    surface = read_surface(path, height_unit="nm", lateral_unit="µm")
    assert surface.pixel_size == approx((0.5e-6, 0.25e-6), rel=8 * EPS)
    assert_allclose(surface.heights, heights * 1e-9, rtol=4 * EPS)
    assert surface.missing.any()


def test_coordinates_of_a_profile(library, tmp_path):  # noqa: ARG001 - skips where it is not installed
    units = {"height_unit": "nm", "lateral_unit": "mm"}
    surface = read_surface(written(tmp_path / "even.xyz", "0 1\n0.5 2\n1 4\n1.5 3\n"), **units)
    assert_allclose(surface.heights[:, 0], np.array([1, 2, 4, 3]) * 1e-9, rtol=4 * EPS)
    assert surface.pixel_size[0] == approx(0.5e-3, rel=8 * EPS)
    with refused("uneven distances"):
        read_surface(written(tmp_path / "uneven.xyz", "0 1\n0.5 2\n1.1 4\n1.5 3\n"), **units)
    # uneven by a third, but by less than SurfaceTopography sees
    with refused("steps too small to check that they are even"):
        read_surface(written(tmp_path / "small.xyz", "0 1\n1e-7 2\n2e-7 4\n3.3e-7 3\n"), **units)


# matrices as text


MISSING = ("nan", "NaN", "-nan", "NA", "n/a", "bad", "***", "-", "--", "1.#QNAN", "-1.#IND")
DELIMITERS = (" ", "   ", "\t", ",", ", ", ";", " ; ")


@st.composite
def matrices(draw):
    """A matrix, and the text of it in one of many ways."""
    columns = draw(st.integers(4, 7))
    lines = draw(st.integers(1, 6))
    numbers = st.floats(-1e9, 1e9) | st.integers(-1000, 1000).map(float) | st.just(np.nan)
    matrix = np.array(draw(st.lists(numbers, min_size=columns * lines, max_size=columns * lines)))
    # a last column of nothing would be none
    matrix[[0, 1, 2, columns - 1]] = [1.0, -2.5, 3e-7, 5.0]
    matrix = matrix.reshape(lines, columns)
    delimiter = draw(st.sampled_from(DELIMITERS))
    marks = st.sampled_from(
        MISSING if delimiter.isspace() and delimiter != "\t" else (*MISSING, "")
    )
    comma = ";" in delimiter and draw(st.booleans())

    def cell(number):
        if np.isnan(number):
            return draw(marks.filter(lambda mark: not comma or "." not in mark))
        return repr(float(number)).replace(".", "," if comma else ".")

    text = ""
    for row in matrix:
        text += draw(
            st.sampled_from(("", "", "\n", "# a comment\n", "% another, 1;2\n", "  # and one\n"))
        )
        text += delimiter.join(map(cell, row))
        text += draw(st.sampled_from(("", " ", "  # the first"))) + draw(
            st.sampled_from(("\n", "\r\n"))
        )
    return matrix, text


@pytest.mark.filterwarnings("ignore::historysim.errors.UnlikelyValueWarning")
@given(matrices())
def test_a_matrix_in_many_spellings(scratch, case):
    matrix, text = case
    path = scratch / "matrix.txt"
    path.write_bytes(text.encode())
    surface = read_surface(path, **METRES)
    assert_array_equal(surface.heights, matrix.T)


def test_a_delimiter_at_the_end_of_each_line_adds_no_column(tmp_path):
    surface = read_surface(written(tmp_path / "map.csv", "1,2,3,4,\n5,,7,8,\n"), **METRES)
    assert_array_equal(surface.heights, np.array([[1, 5], [2, np.nan], [3, 7], [4, 8]]))
    for text, last in [
        ("1,2,3,4,\n5,6,7,8,9\n", [np.nan, 9]),
        ("1,2,3,4,9\n5,6,7,8,\n", [9, np.nan]),
    ]:
        surface = read_surface(written(tmp_path / "map.csv", text), **METRES)
        assert_array_equal(surface.heights[4], last)


@pytest.mark.parametrize(
    "text, message",
    [
        (
            "1 2 3 4\n\n5 6 7\n",
            "line 3: 3 values where line 1 has 4; expected as many in each line",
        ),
        ("1\t2,5\t3\t4\n", "line 1, column 2: '2,5'; .*; write the decimal comma as a point"),
        ("nan - ***\nbad nan nan\n", "has 0 points with a height, of 6; expected 3 or more"),
    ],
)
def test_texts_that_are_no_matrix(tmp_path, text, message):
    with refused(rf"^map\.csv: {message}"):
        read_surface(written(tmp_path / "map.csv", text), **PLAIN)


# arrays of numpy


@pytest.mark.parametrize("kind", [">f8", "<f4", "<i2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_numpy_arrays_keep_their_axes(tmp_path, kind, order):
    heights = np.asarray(np.arange(12).reshape(4, 3), dtype=kind, order=order)
    np.save(tmp_path / "map.npy", heights)
    np.savez_compressed(tmp_path / "map.npz", heights)
    for name in ("map.npy", "map.npz"):
        surface = read_surface(tmp_path / name, pixel_size=(1.0, 2.0), height_unit="m")
        assert surface.heights.tolist() == np.arange(12.0).reshape(4, 3).tolist()
        assert surface.pixel_size == (1.0, 2.0)


def test_size_limits(tmp_path, monkeypatch):
    monkeypatch.setattr(map_files, "MOST_POINTS", 20)
    np.save(tmp_path / "map.npy", np.ones((3, 7)))
    written(tmp_path / "map.txt", "1 2 3 4 5 6 7\n" * 3)
    for name in ("map.npy", "map.txt"):
        with refused(f"^{name}: has 21 points; expected 20 or fewer: thin or cut it"):
            read_surface(tmp_path / name, **METRES)
    np.save(tmp_path / "map.npy", np.ones((4, 5)))
    assert read_surface(tmp_path / "map.npy", **METRES).shape == (4, 5)


def test_archives_of_arrays(tmp_path):
    path = tmp_path / "maps.npz"
    np.savez(path, first=np.zeros((2, 3)), second=np.ones((3, 2)))
    with refused(r"^maps.npz: holds 2 arrays; choose one with channel: first, second"):
        read_surface(path, **METRES)
    with refused("has no array 'third'; expected channel to be one of first, second"):
        read_surface(path, **METRES, channel="third")
    assert read_surface(path, **METRES, channel="second").heights.tolist() == [[1, 1]] * 3
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme", "nothing here")
    with refused("holds 0 arrays; choose one with channel: none"):
        read_surface(path, **METRES)
    with refused("has no array 'first'"):
        read_surface(path, **METRES, channel="first")


# any file


def attempt(path, **arguments):
    """Only an InputError may come, or a surface with heights that are finite or missing."""
    try:
        surface = read_surface(path, **arguments)
    except InputError as error:
        message = str(error)
    else:
        assert np.isfinite(surface.heights[~surface.missing]).all()
        assert (~surface.missing).sum() >= 3
        return
    assert message.startswith(f"{path.name}: ")


@settings(max_examples=20)
@given(st.text(alphabet="0123456789.,;-+eE#%*naib \t\n\r_:=µmx", max_size=60))
def test_any_text(scratch, text):
    attempt(written(scratch / "any.txt", text), **PLAIN)


def numpy_bytes(write):
    stream = io.BytesIO()
    write(stream, np.arange(12.0).reshape(3, 4))
    return stream.getvalue()


SAMPLES = {"npy": numpy_bytes(np.save), "npz": numpy_bytes(np.savez)}


@st.composite
def damaged(draw, content):
    """The bytes of a file, some of them changed, and cut short."""
    changed = bytearray(content)
    for place, byte in draw(
        st.lists(st.tuples(st.integers(0, len(content) - 1), st.integers(0, 255)), max_size=5)
    ):
        changed[place] = byte
    return bytes(changed[: draw(st.integers(0, len(content)))] if draw(st.booleans()) else changed)


@pytest.mark.parametrize("ending", SAMPLES)
@given(st.data())
def test_damaged_arrays(scratch, ending, data):
    path = scratch / f"any.{ending}"
    path.write_bytes(data.draw(damaged(SAMPLES[ending])))
    attempt(path, **METRES)


@fixture(scope="module")
def small_files(library, scratch):
    """Small files of SurfaceTopography's formats, by their endings."""
    topography = library.Topography(
        np.ma.masked_less(np.arange(30.0).reshape(5, 6), 4), (5.0, 6.0), unit="nm"
    )
    found = {}
    for ending, writer in WRITERS.items():
        getattr(topography, writer)(str(scratch / f"small.{ending}"))
        found[ending] = (scratch / f"small.{ending}").read_bytes()
    return found


@pytest.mark.parametrize("ending", ["x3p", "gwy"])
@settings(max_examples=2)  # each damaged file is shown to some forty readers
@given(st.data())
def test_damaged_files(small_files, scratch, ending, data):
    path = scratch / f"any.{ending}"
    path.write_bytes(data.draw(damaged(small_files[ending])))
    attempt(path)
    attempt(path, height_unit="nm", lateral_unit="nm")


def test_what_an_archive_unpacks_to_has_a_bound(tmp_path, monkeypatch):
    np.savez_compressed(tmp_path / "zeros.npz", heights=np.zeros((1000, 1000)))
    (tmp_path / "zeros.x3p").write_bytes((tmp_path / "zeros.npz").read_bytes())
    monkeypatch.setenv("HISTORYSIM_MOST_UNPACKED_BYTES", "1e6")
    for name in ("zeros.npz", "zeros.x3p"):
        with refused(r"unpack to .*UNPACKED_BYTES"):
            read_surface(tmp_path / name, pixel_size=1e-6, height_unit="m")


# netCDF by CF, lists of points in any text, and implausible numbers


def cf_map(path, units, *, dimensions=("x", "y"), key="units"):
    """Write a map of 40 × 50 points, 2 µm apart, with lengths in the given units, and return its heights [m]."""
    xr = importorskip("xarray")
    heights = 1e-6 * rough((40, 50))
    per = {"m": 1.0, "mm": 1e3, "um": 1e6, "µm": 1e6, "nm": 1e9, None: 1e6}
    attributes = {name: {key: unit} if unit else {} for name, unit in units.items()}
    positions = {
        axis: (axis, np.arange(points) * 2e-6 * per[units[axis]], attributes[axis])
        for axis, points in zip("xy", heights.shape, strict=True)
    }
    stored = xr.DataArray(
        heights * per[units["heights"]], dims=("x", "y"), attrs=attributes["heights"]
    )
    xr.Dataset({"heights": stored.transpose(*dimensions)}, positions).to_netcdf(
        path, engine="netcdf4"
    )
    return heights


@pytest.mark.parametrize(
    "units, dimensions, key",
    [
        (("mm", "mm", "um"), ("y", "x"), "units"),
        (("m", "m", "m"), ("x", "y"), "unit"),
        (("mm", "um", "nm"), ("x", "y"), "units"),
    ],
)
def test_a_netcdf_map_states_its_units(tmp_path, units, dimensions, key):
    path = tmp_path / "map.nc"
    heights = cf_map(
        path, dict(zip(("x", "y", "heights"), units, strict=True)), dimensions=dimensions, key=key
    )
    surface = read_surface(path)
    assert surface.pixel_size == approx((2e-6, 2e-6), rel=1e-12)
    assert_allclose(surface.heights, heights, rtol=1e-12)


@pytest.mark.parametrize(
    "units, given, message",
    [
        (("mm", "mm", None), {}, "does not name the unit of its heights; give height_unit"),
        (("mm", None, "um"), {}, "names the unit of one of its coordinates only"),
        (
            ("mm", "mm", "um"),
            {"height_unit": "nm"},
            "states that its heights are in um, but height_unit is 'nm'",
        ),
    ],
)
def test_a_netcdf_map_without_units_or_with_others(tmp_path, units, given, message):
    path = tmp_path / "map.nc"
    cf_map(path, dict(zip(("x", "y", "heights"), units, strict=True)))
    with refused(message):
        read_surface(path, **given)


@pytest.mark.parametrize(
    "name, delimiter", [("list.csv", ","), ("list.txt", "\t"), ("list.xyz", " ")]
)
def test_a_list_of_points_in_any_text(library, tmp_path, name, delimiter):  # noqa: ARG001 - skips where it is missing
    heights = rough((5, 6)).round(6)
    text = "\n".join(
        delimiter.join(f"{v:g}" for v in (2 * i, 2 * j, heights[i, j]))
        for j in range(6)
        for i in range(5)
    )
    path = written(tmp_path / name, text)
    with refused("does not name the unit of its heights; give height_unit"):
        read_surface(path)
    surface = read_surface(path, height_unit="nm", lateral_unit="µm")
    assert surface.pixel_size == approx((2e-6, 2e-6), rel=1e-9)
    assert_allclose(surface.heights, heights * 1e-9, rtol=1e-5)


def test_a_profile_with_a_header_of_its_instrument(library, tmp_path):  # noqa: ARG001 - skips where it is missing
    heights = [-0.01, 0.02, -0.01, 0.015, -0.012]
    rows = "\n".join(f"{i:.1f},{z}" for i, z in enumerate(heights))
    path = written(
        tmp_path / "profile.csv",
        f"Scan Parameters\nLength,5 um\n\nLateral um,Raw Micrometer\n{rows}\n",
    )
    surface = read_surface(path)
    assert surface.pixel_size[0] == approx(1e-6, rel=1e-9)
    assert_allclose(surface.heights[:, 0], np.array(heights) * 1e-6, rtol=1e-12)


@pytest.mark.parametrize("placeholders", [[-9999.0, 1e10]])
def test_placeholders_of_missing_points_are_reported(tmp_path, placeholders):
    heights = rough((40, 50))
    for index, value in enumerate(placeholders):
        heights[3 + index, 4:7] = value
    path = tmp_path / "map.txt"
    np.savetxt(path, heights)
    options = {"pixel_size": "2 µm", "height_unit": "µm"}
    with pytest.warns(
        UnlikelyValueWarning, match=r"heights are .*all others are between .* give missing = "
    ):
        read_surface(path, **options)
    surface = read_surface(path, **options, missing=placeholders)
    assert_array_equal(surface.missing, np.isin(heights.T, placeholders))
    with refused("missing is 7, but no height equals it"):
        read_surface(path, **options, missing=7)


def test_a_particle_is_no_placeholder(tmp_path):
    heights = rough((40, 50))
    heights[10:15, 10:15] += 400 * np.hanning(5)[:, None] * np.hanning(5)
    np.savetxt(tmp_path / "map.txt", heights)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_surface(tmp_path / "map.txt", pixel_size="2 µm", height_unit="nm")


@pytest.mark.parametrize(
    "pixel_size, height_unit, implausible",
    [
        ("4 m", "nm", True),
        ("1 µm", "nm", False),
    ],
)
def test_an_implausible_scale_is_reported(tmp_path, pixel_size, height_unit, implausible):
    np.savetxt(tmp_path / "map.txt", 4 * rough((40, 50)))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        read_surface(tmp_path / "map.txt", pixel_size=pixel_size, height_unit=height_unit)
    assert ["which is implausible; check the units" in str(each.message) for each in found] == [
        True
    ] * implausible
