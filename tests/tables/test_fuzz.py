"""Whatever is done to a file of numbers, it is read or refused."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from number_files import FORCE, TIME, UNITS, WRITERS, broken, columns_of, read_or_refuse

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table

pytestmark = pytest.mark.usefixtures("alone")
fuzz = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    if not (folder := tmp_path_factory.getbasetemp() / "good").exists():
        folder.mkdir()
    return folder


def written(folder, name):
    if name.endswith(".tdms"):
        pytest.importorskip("nptdms")
    path = folder / name
    if not path.exists():
        WRITERS[name](path)
    return path


@pytest.mark.parametrize("name", WRITERS)
def test_the_good_files_hold_what_was_written(good, name):
    layout = Format(decimal="," if name == "text.csv" else ".")
    table = read_table(written(good, name), columns_of(name), UNITS, layout)
    factor = 1.0 if name in {"text.csv", "plain.mat", "compressed.mat", "new.mat"} else 1000.0
    # the netCDF files hold integers of 0.001 kN
    error = 0.5 if name.endswith(".nc") else 0.0
    np.testing.assert_array_equal(table.columns["time"], TIME)
    np.testing.assert_allclose(table.columns["force"], FORCE * factor, rtol=1e-15, atol=1.001 * error)
    assert table.units == UNITS


@pytest.mark.parametrize("name", WRITERS)
def test_broken_files_are_read_or_refused(good, tmp_path, name):
    content = written(good, name).read_bytes()
    path = tmp_path / name

    @fuzz
    @given(change=broken(content) | st.binary(max_size=200), missing=st.booleans())
    def check(change, missing):
        path.write_bytes(change)
        read_or_refuse(path, columns_of(name), missing=missing)

    check()


@fuzz
@given(
    lines=st.lists(
        st.lists(
            st.sampled_from(
                ["1", "-2.5", "1e3", "", "nan", "x", "1,5", '"3"', '"', "#", "t", "F", "(s)", "2 3", "0x1", "٣"]
            ),
            max_size=4,
        ),
        max_size=8,
    ),
    delimiter=st.sampled_from([",", ";", "\t", " ", "|", " ; "]),
    columns=st.sampled_from([["t", "F"], ["t"], [1, 2], [2]]),
    missing=st.booleans(),
    layout=st.sampled_from([{}, {"decimal": ","}, {"header": 1}, {"header": 0}, {"delimiter": ";"}, {"comment": ""}]),
)
def test_lines_of_any_kind_are_read_or_refused(tmp_path_factory, lines, delimiter, columns, missing, layout):
    path = tmp_path_factory.getbasetemp() / "lines.txt"
    path.write_text("\n".join(delimiter.join(line) for line in lines), encoding="utf-8")
    wanted = {str(column): Column(column) for column in columns}
    form = Format(**layout)
    table = allowed(lambda: read_table(path, wanted, dict.fromkeys(wanted, "s"), form, missing=missing))
    allowed(lambda: describe(path, form))
    rows = path.read_text(encoding="utf-8").split("\n")
    for key, values in table.columns.items() if table else ():
        for number, value in zip(table.lines, values, strict=True):
            assert (missing and np.isnan(value)) or shown_in(rows[number - 1], value), (key, number)


def allowed(read):
    """What a reader gives, or None if it refuses with a message about the file."""
    try:
        return read()
    except InputError as error:
        if not str(error).startswith("lines.txt: "):
            raise AssertionError(str(error)) from error
        return None


def shown_in(line, value):
    """Whether a line holds a number, however it is written."""
    texts = {1.0: ["1"], -2.5: ["-2.5"], 1000.0: ["1e3"], 3.0: ["3"], 1.5: ["1,5"]}.get(value, ["2", "5"])
    return any(text in line for text in texts)
