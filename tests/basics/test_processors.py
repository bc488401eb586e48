import pytest

from historysim.basics import processors
from historysim.basics.processors import threads_of
from historysim.errors import InputError


@pytest.mark.parametrize(("there", "expected"), [(1, 1), (3, 3), (64, processors.MOST_THREADS)])
def test_by_default_there_is_a_thread_for_each_processor_up_to_a_few(monkeypatch, there, expected):
    monkeypatch.setattr(processors, "processors", lambda: there)
    assert threads_of(None) == expected
    assert threads_of(7) == 7


@pytest.mark.parametrize("given", [0, -1, 2.0, True, "two"])
def test_what_is_no_number_of_threads_is_refused(given):
    with pytest.raises(InputError, match=r"threads is .*; expected a whole number of 1 or more"):
        threads_of(given)
