"""The table of outputs: consistent in itself, and the contract that other programs rely on."""

import itertools
import keyword

import attrs
import cf_units
import numpy as np
from pairs import UNIT
from pytest import mark

import historysim as hs
from historysim.asperities.asperity import SlipState
from historysim.recording import variables
from historysim.recording.variables import (
    COORDINATES,
    VARIABLES,
    Changes,
    Variable,
    recorded_variables,
    register,
)

STEP, ASPERITY, BOTH = ("step",), ("asperity",), ("step", "asperity")

CONTRACT = {
    "coordinates": {
        "time": (STEP, "s"),
        "asperity": (ASPERITY, "1"),
        "summit_height": (ASPERITY, "m"),
        "summit_radius": (ASPERITY, "m"),
        "x": (ASPERITY, "m"),
        "y": (ASPERITY, "m"),
    },
    "totals": {
        "total_normal_load": (STEP, "N"),
        "total_tangential_load": (STEP, "N"),
        "separation": (STEP, "m"),
        "tangential_displacement": (STEP, "m"),
        "contact_count": (STEP, "1"),
        "real_contact_area": (STEP, "m2"),
        "tangential_stiffness": (STEP, "N m-1"),
        "total_dissipated_energy": (STEP, "J"),
    },
    "per asperity": {
        "normal_load": (BOTH, "N"),
        "tangential_load": (BOTH, "N"),
        "contact_radius": (BOTH, "m"),
        "stick_radius": (BOTH, "m"),
        "slip_state": (BOTH, ""),
        "dissipated_energy": (BOTH, "J"),
    },
}
EXTENSIONS = {
    "coordinates": {"friction": (ASPERITY, "1"), "slope": (ASPERITY, "1")},
    "totals": {"friction_limit": (STEP, "N"), "saturated": (STEP, "")},
    "per asperity": {},
}
ALL = (*COORDINATES, *VARIABLES)
FLAGS = [variable for variable in ALL if "flag_values" in variable.attributes]

each = mark.parametrize(
    "variable", ALL, ids=lambda variable: f"{variable.name} {variable.dimensions}"
)


@mark.parametrize("part", CONTRACT)
def test_the_table_is_the_contract_and_its_known_extensions(part):
    totals, per_asperity = recorded_variables(Changes())
    table = {"coordinates": COORDINATES, "totals": totals, "per asperity": per_asperity}[part]
    found = {variable.name: (variable.dimensions, variable.units) for variable in table}
    assert found == CONTRACT[part] | EXTENSIONS[part]


def test_names_are_unique_in_every_history():
    for given in itertools.product((False, True), repeat=len(attrs.fields(Changes))):
        names = [
            variable.name
            for variable in (*COORDINATES, *itertools.chain(*recorded_variables(Changes(*given))))
        ]
        assert sorted(set(names)) == sorted(names)


@each
def test_a_variable_is_named_and_typed_and_has_units_and_words(variable):
    assert variable.name.isidentifier()
    assert variable.name.islower()
    assert not keyword.iskeyword(variable.name)
    assert variable.dimensions in {STEP, ASPERITY, BOTH}
    assert variable.attributes["long_name"].strip()
    assert not {"standard_name", "_FillValue"} & set(variable.attributes)
    whole = dict.fromkeys(("asperity", "contact_count", "erased_memories", "jumps"), "int64")
    assert variable.dtype == (whole | {"slip_state": "int8", "saturated": "int8"}).get(
        variable.name, "float64"
    )
    if variable in FLAGS:
        assert variable.units == ""
        assert "units" not in variable.attributes
    else:
        unit = cf_units.Unit(variable.attributes["units"])
        assert not unit.is_unknown()
        assert unit.is_dimensionless() == (variable.units == "1")


def test_flags_are_bytes_with_a_meaning_for_each_value():
    assert {variable.name for variable in FLAGS} == {"slip_state", "saturated"}
    for variable in FLAGS:
        values, meanings = (
            variable.attributes["flag_values"],
            variable.attributes["flag_meanings"].split(" "),
        )
        assert variable.dtype == values.dtype == np.int8
        assert len(set(values.tolist())) == len(values) == len(set(meanings)) == len(meanings)
        assert all(meaning.isidentifier() for meaning in meanings)
    flags = next(variable for variable in FLAGS if variable.name == "slip_state").attributes
    assert flags["flag_meanings"] == "separated full_stick partial_slip gross_slip"
    assert flags["flag_values"].tolist() == [0, 1, 2, 3] == [int(state) for state in SlipState]


def test_another_quantity_is_one_declaration(tmp_path, monkeypatch):
    monkeypatch.setattr(variables, "_added", [])
    register(
        Variable(
            "mean_pressure",
            STEP,
            "Pa",
            "normal load over the contact area",
            when=lambda changes: changes.areas,
            derived=lambda rows, *_: rows.totals["normal_load"] / rows.totals["real_contact_area"],
        )
    )
    job = hs.Replay(
        hs.Ensemble(UNIT, 0.0, 1.0, 0.5), [hs.NormalLoad(0.0, 0.03), hs.NormalLoad(1.0, 0.02)]
    )
    job.write(tmp_path / "out.nc")
    found = hs.open(tmp_path / "out.nc")
    assert found.mean_pressure.attrs["units"] == "Pa"
    assert (found.mean_pressure == found.total_normal_load / found.real_contact_area).all()
    recorded_variables.cache_clear()
