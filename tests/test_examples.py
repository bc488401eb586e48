"""Examples in the docstrings of public names print what they say."""

import doctest
import inspect
from pathlib import Path

import numpy as np
import pytest

import historysim as hs

ROOT = Path(__file__).parents[1]


def documented():
    """Yield the public names whose docstrings have examples."""
    for name in dir(hs):
        what = getattr(hs, name)
        text = inspect.getdoc(what) if inspect.isclass(what) or inspect.isfunction(what) else None
        if text and ">>>" in text:
            yield pytest.param(text, id=name)


@pytest.mark.parametrize("text", list(documented()))
def test_an_example_prints_the_shown_output(text, tmp_path, monkeypatch):
    for name in ("scenarios", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTestParser().get_doctest(text, {"hs": hs, "np": np}, "example", None, 0)
    told = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=told.append)
    assert result.attempted, "no example"
    assert result.failed == 0, "".join(told)


def test_functions_for_beginners_have_an_example():
    begun = "run load open validate show plot loops compare sweep Ensemble EventLog random_surface"
    assert [name for name in begun.split() if ">>>" not in (getattr(hs, name).__doc__ or "")] == []
