import pytest
from numba.core.dispatcher import Dispatcher

from historysim.basics.compiled import compiled


@pytest.mark.parametrize("error", [RuntimeError("no locator available"), OSError("read-only")])
def test_a_function_is_compiled_where_nothing_can_be_kept(monkeypatch, error):
    def refuse(_):
        raise error

    monkeypatch.setattr(Dispatcher, "enable_caching", refuse)
    assert compiled(lambda value: value + 1.0)(1.0) == 2.0
