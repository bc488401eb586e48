"""What messages have in common."""

import pytest

from historysim.basics.wording import counted, nearest, shown


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 asperities"), (1, "1 asperity"), (2, "2 asperities"), (40_000, "40,000 asperities")]
)
def test_one_is_not_several(count, text):
    assert counted(count, "asperity", "asperities") == text


def test_the_nearest_word_is_meant_or_any():
    assert nearest("normal_laod", ["normal_load", "friction"]) == "did you mean 'normal_load'?"
    assert nearest("x", ["normal_load", "friction"]) == "expected one of normal_load, friction"
    assert nearest("x", []) == "none is expected here"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (1.5, "1.5"),
        ("abc", "'abc'"),
        ("a" * 50, f"{'a' * 40!r}…"),
        ({"a": 1}, "a table"),
        ([1], "an array"),
    ],
)
def test_what_came_is_shown_in_brief(value, text):
    assert shown(value) == text


def test_an_integer_that_python_refuses_to_print_is_shown_all_the_same():
    assert shown(10**5000) == "an integer of 16610 bits"
