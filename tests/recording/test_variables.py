"""The table of outputs: consistent in itself, and the contract that other programs rely on."""

import keyword

import cf_units
import numpy as np
import pytest

from historysim.asperities.asperity import SlipState
from historysim.recording.variables import (
    BEHIND_A_SPRING,
    COORDINATES,
    PER_ASPERITY,
    PRESENT_FRICTION,
    TOTALS,
    WHERE_FRICTION_CHANGES,
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
    "coordinates": {"friction": (ASPERITY, "1")},
    "totals": {"friction_limit": (STEP, "N"), "saturated": (STEP, "")},
    "behind a spring": {"drive_displacement": (STEP, "m")},
    "where friction changes": {"largest_traction_ratio": (STEP, "1"), "present_friction": (STEP, "1")},
    "per asperity": {},
}

TABLES = {
    "coordinates": COORDINATES,
    "totals": TOTALS,
    "behind a spring": BEHIND_A_SPRING,
    "where friction changes": (*WHERE_FRICTION_CHANGES, PRESENT_FRICTION),
    "per asperity": PER_ASPERITY,
}
VARIABLES = [*COORDINATES, *TOTALS, *BEHIND_A_SPRING, *WHERE_FRICTION_CHANGES, PRESENT_FRICTION, *PER_ASPERITY]
FLAGS = [variable for variable in VARIABLES if "flag_values" in variable.attributes]

each = pytest.mark.parametrize("variable", VARIABLES, ids=lambda variable: variable.name)
each_flag = pytest.mark.parametrize("variable", FLAGS, ids=lambda variable: variable.name)


@pytest.mark.parametrize("part", TABLES)
def test_the_table_is_the_contract_and_its_known_extensions(part):
    found = {variable.name: (variable.dimensions, variable.units) for variable in TABLES[part]}
    assert found == CONTRACT.get(part, {}) | EXTENSIONS[part]


def test_names_are_unique():
    names = [variable.name for variable in VARIABLES]
    assert sorted(set(names)) == sorted(names)


@each
def test_names_can_be_attributes_of_a_dataset(variable):
    assert variable.name.isidentifier()
    assert variable.name.islower()
    assert not keyword.iskeyword(variable.name)


@each
def test_dimensions_are_step_and_asperity_in_that_order(variable):
    assert variable.dimensions in {STEP, ASPERITY, BOTH}


@each
def test_units_are_known_and_stand_in_the_attributes_unless_it_is_a_flag(variable):
    if variable in FLAGS:
        assert variable.units == ""
        assert "units" not in variable.attributes
    else:
        unit = cf_units.Unit(variable.attributes["units"])
        assert not unit.is_unknown()
        assert not unit.is_no_unit()
        assert unit.is_dimensionless() == (variable.units == "1")


@each
def test_everything_is_said_in_words(variable):
    assert variable.attributes["long_name"].strip()
    assert "standard_name" not in variable.attributes
    assert "_FillValue" not in variable.attributes


def test_flags_are_those_that_the_contract_names():
    assert {variable.name for variable in FLAGS} == {"slip_state", "saturated"}


@each_flag
def test_flags_are_bytes_with_a_meaning_for_each_value(variable):
    values = variable.attributes["flag_values"]
    meanings = variable.attributes["flag_meanings"].split(" ")
    assert variable.dtype == "int8"
    assert values.dtype == np.int8
    assert len(set(values.tolist())) == len(values) == len(set(meanings)) == len(meanings)
    assert all(meaning.isidentifier() for meaning in meanings)


def test_slip_states_are_numbered_from_separated_to_gross_slip():
    flags = next(variable for variable in FLAGS if variable.name == "slip_state").attributes
    assert flags["flag_meanings"] == "separated full_stick partial_slip gross_slip"
    assert flags["flag_values"].tolist() == [0, 1, 2, 3] == [int(state) for state in SlipState]


@each
def test_types_are_whole_for_counts_and_labels_and_double_for_measures(variable):
    whole = {"asperity": "int64", "contact_count": "int64", "slip_state": "int8", "saturated": "int8"}
    assert variable.dtype == whole.get(variable.name, "float64")
