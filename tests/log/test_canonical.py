"""The digest of a history: what it sees."""

import itertools
import math

import numpy as np

import historysim as hs
from historysim.loads.event_sequence import digest
from historysim.loads.events import LOAD_KINDS
from historysim.log.canonical import to_columns

EVENTS = [
    hs.NormalLoad(0.0, 0.01),
    hs.TangentialLoad(1.0, 0.003),
    hs.FrictionChange(2.0, [0.25, 0.5]),
    hs.NormalDisplacement(2.0, -0.125),
    hs.TangentialDisplacement(2.5, 1e-9),
    hs.FrictionChange(3.0, 0.5),
]
DIGEST = "2b36a8acef8555c412094439cfc45e63416d0ed8c345c8456fa442d3826f3517"


def test_the_canonical_form_stays_as_it_is():
    assert digest(EVENTS) == DIGEST


def test_kind_order_and_sign_matter():
    kinds = (
        hs.NormalLoad,
        hs.NormalDisplacement,
        hs.TangentialLoad,
        hs.TangentialDisplacement,
        hs.FrictionChange,
    )
    assert len({digest([kind(0.0, 0.1)]) for kind in kinds}) == len(kinds)
    some = EVENTS[:4]
    assert len({digest(order) for order in itertools.permutations(some)}) == math.factorial(
        len(some)
    )
    assert digest([hs.FrictionChange(0, [0.1, 0.2])]) != digest([hs.FrictionChange(0, [0.2, 0.1])])
    assert digest([hs.TangentialLoad(0.0, 0.1)]) != digest([hs.TangentialLoad(0.0, -0.1)])
    assert digest([hs.TangentialLoad(0.0, 0.0)]) != digest([hs.TangentialLoad(0.0, -0.0)])


def test_the_number_of_events_and_of_coefficients_matters():
    first = EVENTS[0]
    assert len({digest([first] * count) for count in range(4)}) == 4
    frictions = (0.1, [0.1], [0.1, 0.1])
    assert len({digest([hs.FrictionChange(0.0, friction)]) for friction in frictions}) == len(
        frictions
    )
    split = [hs.FrictionChange(0.0, [0.1]), hs.FrictionChange(0.0, [0.1])]
    assert digest(split) != digest([hs.FrictionChange(0.0, [0.1, 0.1])])


def test_types_of_the_numbers_do_not_matter():
    assert digest([hs.NormalLoad(1, 2)]) == digest(
        [hs.NormalLoad(np.float64(1.0), np.float32(2.0))]
    )
    assert digest([hs.FrictionChange(0, (1, 0.5))]) == digest(
        [hs.FrictionChange(0.0, np.array([1.0, 0.5]))]
    )
    assert digest(iter(EVENTS)) == digest(tuple(EVENTS)) == digest(EVENTS)


def test_the_numbers_of_the_kinds_in_a_log_stay_as_they_are():
    events = [kind(0.0, 0.1) for kind in (*LOAD_KINDS.values(), hs.FrictionChange)]
    events += [
        hs.FrictionChange(0.0, [0.1, 0.2]),
        hs.FrictionChange(0.0, 0.1, [2]),
        hs.FrictionRamp(0.0, 0.1),
    ]
    events += [hs.GeometryChange(0.0, 0.1)]
    assert list(to_columns(events).kind) == [0, 1, 2, 3, 4, 5, 6, 7, 8]
    assert [type(event) for event in events[:5]] == [
        hs.NormalLoad,
        hs.NormalDisplacement,
        hs.TangentialLoad,
        hs.TangentialDisplacement,
        hs.FrictionChange,
    ]
