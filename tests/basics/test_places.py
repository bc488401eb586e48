"""Where an error belongs in what was given."""

import pickle

import pytest

import historysim as hs
from historysim.errors import error_path, field_error, path_text


def raised(error, *places):
    with pytest.raises(type(error)) as caught, error_path("loading"), error_path(*places):
        raise error
    return caught.value


def test_places_gather_from_inside_out():
    error = raised(field_error("0; expected more", "time"), "waypoints", 3)
    assert error.place == ("loading", "waypoints", 3, "time")
    assert str(error) == "loading.waypoints[3].time: 0; expected more"
    assert str(hs.InputError("0; expected more")) == "0; expected more"


def test_other_errors_pass_as_they_are():
    assert str(raised(KeyError("a"), "b")) == "'a'"


def test_a_place_goes_with_the_error_to_another_process():
    error = pickle.loads(pickle.dumps(field_error("0; expected more", "time")))
    assert (error.place, str(error)) == (("time",), "time: 0; expected more")


def test_names_that_toml_would_quote_are_quoted():
    assert path_text(["columns", "F (kN)", 0, "unit"]) == "columns.'F (kN)'[0].unit"
