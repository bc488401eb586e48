import pytest

from historysim.basics.limits import LIMITS, at_most, most


def test_the_environment_raises_a_limit(monkeypatch):
    assert most("STEPS") == LIMITS["STEPS"]
    for given, taken in (("1e9", 10**9), ("12", 12), ("many", LIMITS["STEPS"]), ("inf", LIMITS["STEPS"])):
        monkeypatch.setenv("HISTORYSIM_MOST_STEPS", given)
        assert most("STEPS") == taken
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", "12")
    assert at_most("STEPS") == "expected 12 at most (the environment variable HISTORYSIM_MOST_STEPS raises it)"


def test_an_unknown_limit_is_a_mistake():
    with pytest.raises(KeyError):
        most("NONE")
