"""Questions to a history as methods of it."""

import inspect
import re

import xarray as xr
from pairs import STIFF as PAIR
from pytest import fixture, mark, raises

import historysim as hs
from historysim.results import accessor, queries
from historysim.results.accessor import Queries
from historysim.results.queries import all_queries, earlier_names

EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(t), (-1) ** t * 1e-6) for t in (1, 2, 3)),
]


def test_every_query_is_a_method_and_a_function_with_one_docstring():
    assert {*all_queries()} <= {*dir(Queries)}
    assert dir(hs.analysis) == sorted(all_queries())
    for name, asked in all_queries().items():
        method, function = getattr(Queries, name), getattr(hs.analysis, name)
        assert function is asked.function
        assert method.__doc__ == function.__doc__
        assert (
            list(inspect.signature(method).parameters)[1:]
            == list(inspect.signature(function).parameters)[1:]
        )


def test_earlier_names_are_the_same_queries_and_are_not_listed():
    assert {*earlier_names()} == {"first_slips", "preliminary_displacements"}
    for earlier, name in earlier_names().items():
        assert getattr(Queries, earlier) is getattr(Queries, name)
        assert getattr(hs.analysis, earlier) is getattr(hs.analysis, name)
        assert earlier not in all_queries()
    assert hs.contact is hs.theory


@fixture
def history():
    return hs.replay(hs.Ensemble(PAIR, [0.0, -1e-8], 1e-3, 0.2), EVENTS, substeps=4)


@mark.parametrize("name", ["slip_shares", "stick_ratio", "mean_pressure", "branch_displacements"])
def test_one_step_answers_as_the_whole_history_does_there(history, name):
    one, whole = (getattr(each.contact, name)() for each in (history.isel(step=5), history))
    xr.testing.assert_equal(one, whole.isel(step=5))


@mark.parametrize(
    "name", ["slip_onset", "slides_first", "friction_loops", "summary", "tangential_stiffness"]
)
def test_one_step_is_not_enough_for_some_questions(history, name):
    with raises(
        hs.InputError, match=f"{name}: needs the steps before, and the history has one step"
    ):
        getattr(history.isel(step=-1).contact, name)()


def test_type_checkers_know_every_query():
    source = inspect.getsource(accessor.Queries)
    typed = re.findall(r"^ +(\w+) = _type\(\w+\.(\w+)\)$", source, re.MULTILINE)
    assert dict(typed) == {name: query.function.__name__ for name, query in all_queries().items()}


def test_a_query_of_a_script_is_a_method(monkeypatch):
    monkeypatch.setattr(queries, "_declared", dict(queries._declared))
    history = hs.replay(
        hs.Ensemble(PAIR, 0.0, 1e-5, 0.2), [hs.NormalLoad(0.0, 1e-3), hs.NormalLoad(1.0, 3e-3)]
    )

    @queries.query(unit="N")
    def largest_normal_load(history):
        return float(history.total_normal_load.max())

    assert history.contact.largest_normal_load() == largest_normal_load(history) == 3e-3
    with raises(AttributeError, match=r"has no query smallest; "):
        history.contact.smallest  # noqa: B018 - looking it up is the test
