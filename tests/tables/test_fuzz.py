"""Damaged files and random texts are read or refused with a message: one fuzz for each reader."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from number_files import FORCE, TIME, UNITS, WRITERS, broken, columns_of, read_or_refuse
from pytest import importorskip, mark

from historysim.errors import InputError
from historysim.tables import Column, Format, describe, read_table

pytestmark = mark.usefixtures("alone")
fuzz = settings(deadline=None, max_examples=8, suppress_health_check=[HealthCheck.too_slow])
ENDINGS = sorted({name.rpartition(".")[2] for name in WRITERS} - {"tsv"})


def written(folder, name):
    if name.endswith(".tdms"):
        importorskip("nptdms")
    path = folder / name
    WRITERS[name](path)
    return path


@mark.parametrize("name", WRITERS)
def test_the_intact_files_hold_the_written_values(tmp_path, name):
    layout = Format(decimal="," if name == "text.csv" else ".")
    table = read_table(written(tmp_path, name), columns_of(name), UNITS, layout)
    factor = 1.0 if name in {"text.csv", "plain.mat", "compressed.mat", "new.mat"} else 1000.0
    # the netCDF files hold integers of 0.001 kN
    error = 0.5 if name.endswith(".nc") else 0.0
    np.testing.assert_array_equal(table.columns["time"], TIME)
    np.testing.assert_allclose(
        table.columns["force"], FORCE * factor, rtol=1e-15, atol=1.001 * error
    )
    assert table.units == UNITS


@mark.parametrize("ending", ENDINGS)
def test_damaged_files_are_read_or_refused(tmp_path, ending):
    contents = {
        name: written(tmp_path, name).read_bytes()
        for name in WRITERS
        if name.endswith((ending, "tsv") if ending == "csv" else ending)
    }
    damaged = st.sampled_from(sorted(contents)).flatmap(
        lambda name: st.tuples(st.just(name), broken(contents[name]) | st.binary(max_size=200))
    )

    @fuzz
    @given(file=damaged, missing=st.booleans())
    def check(file, missing):
        name, content = file
        (tmp_path / name).write_bytes(content)
        read_or_refuse(tmp_path / name, columns_of(name), missing=missing)

    check()


CELLS = [
    "1",
    "-2.5",
    "1e3",
    "",
    "nan",
    "x",
    "1,5",
    '"3"',
    '"',
    "#",
    "t",
    "F",
    "(s)",
    "2 3",
    "0x1",
    "٣",
]
#: texts that show each value of `CELLS`; values of other columns are 2 or 5
NOTATIONS = {1.0: ["1"], -2.5: ["-2.5"], 1000.0: ["1e3"], 3.0: ["3"], 1.5: ["1,5"]}


@fuzz
@given(
    lines=st.lists(st.lists(st.sampled_from(CELLS), max_size=4), max_size=8),
    delimiter=st.sampled_from([",", ";", "\t", " ", "|", " ; "]),
    columns=st.sampled_from([["t", "F"], ["t"], [1, 2], [2]]),
    missing=st.booleans(),
    layout=st.sampled_from(
        [{}, {"decimal": ","}, {"header": 1}, {"header": 0}, {"delimiter": ";"}, {"comment": ""}]
    ),
)
def test_random_lines_are_read_or_refused(
    tmp_path_factory, lines, delimiter, columns, missing, layout
):
    path = tmp_path_factory.getbasetemp() / "lines.txt"
    path.write_text("\n".join(delimiter.join(line) for line in lines), encoding="utf-8")
    wanted = {str(column): Column(column) for column in columns}
    table = None
    try:
        table = read_table(
            path, wanted, dict.fromkeys(wanted, "s"), Format(**layout), missing=missing
        )
        describe(path, Format(**layout))
    except InputError as error:
        assert str(error).startswith("lines.txt: ")  # noqa: PT017 - any other outcome is a table
    rows = path.read_text(encoding="utf-8").split("\n")
    for values in table.columns.values() if table else ():
        for number, value in zip(table.lines, values, strict=True):
            notations = NOTATIONS.get(value, ["2", "5"])
            assert (missing and np.isnan(value)) or any(
                text in rows[number - 1] for text in notations
            )
