import sys
from concurrent.futures import ThreadPoolExecutor

import numba  # noqa: F401 - a test takes it away
import numpy as np
import pytest

from historysim.basics import compiled as module
from historysim.basics.compiled import compiled, compiled_for_more_than
from historysim.basics.kept_code import KeptCode


@pytest.mark.parametrize("error", [RuntimeError("no locator available"), OSError("read-only")])
def test_a_function_is_compiled_where_nothing_can_be_kept(monkeypatch, error):
    asked = []

    def refuse(_, function):
        asked.append(function)
        raise error

    monkeypatch.setattr(KeptCode, "__init__", refuse)
    assert compiled(lambda value: value + 1.0)(1.0) == 2.0
    assert len(asked) == 1


def test_a_function_is_compiled_once_whoever_calls_it_first(monkeypatch):
    made = []
    monkeypatch.setattr(module, "_made", lambda function: made.append(function) or function)
    function = compiled(lambda value: value + 1.0)
    assert not made
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(function, range(20))) == [value + 1.0 for value in range(20)]
    assert len(made) == 1


def test_few_items_are_left_to_python_until_numba_is_there(monkeypatch):
    made = []
    monkeypatch.setattr(module, "_made", lambda function: made.append(function) or function)
    total = compiled_for_more_than(3)(lambda items: items.sum() * 1e308)
    monkeypatch.delitem(sys.modules, "numba")
    assert total(np.array([1.0, 2.0])) == np.inf
    assert not made
    with np.errstate(over="ignore"):
        assert total(np.arange(4.0)) == np.inf
    assert len(made) == 1
    monkeypatch.setitem(sys.modules, "numba", None)
    assert total(np.array([0.5])) == 0.5e308
