"""Columns of files of numbers, as a scenario asks for them."""

import tomllib

import attrs
import pytest

from historysim.errors import InputError
from historysim.scenario.schema import NumbersFile, column_from_toml
from historysim.tables import Column, describe, read_table


@pytest.fixture
def file(tmp_path):
    return tmp_path / "f.txt"


def test_listed_columns_can_be_selected(file):
    file.write_text('remark,t,t,"F ""N"""\nx,0,1,2\n,3,4,5\n', encoding="utf-8")
    for place, listing in enumerate(describe(file)[1:]):
        column = column_from_toml(tomllib.loads(f"column = {listing.column}")["column"])
        found = read_table(file, {"c": column}, {"c": "1"}).columns["c"]
        assert found.tolist() == [place, place + 3]


@attrs.frozen(kw_only=True, slots=False)
class Section(NumbersFile):
    columns: tuple[Column, ...] = ()


def refusal(folder, column, **keys):
    with pytest.raises(InputError) as refused:
        Section(file="f.txt", **keys).table(folder, {"load": column}, {"load": "N"})
    return refused.value.place, refused.value.args[0]


def test_an_error_in_the_file_names_the_file(file):
    place, problem = refusal(file.parent, Column("F"))
    assert place == ("file",)
    assert (
        problem
        == f"f.txt: there is no such file in {file.parent}; expected a path relative to the scenario"
    )
    file.write_text("t,F\n0,x\n", encoding="utf-8")
    place, problem = refusal(file.parent, Column("F"))
    assert place == ("file",)
    assert problem.startswith("f.txt: line 2, column 'F': 'x'; expected a finite number")


def test_a_wrong_unit_names_the_column(file):
    file.write_text("t,F (kN)\n0,1\n", encoding="utf-8")
    place, problem = refusal(file.parent, Column("F (kN)", "mm"))
    assert place == ("columns", "load", "unit")
    assert problem.startswith("'mm' is not a unit of a force")
