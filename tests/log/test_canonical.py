"""The digest of a history: what it sees."""

import hashlib
import itertools
import json
import math

import numpy as np
import pytest

import historysim as hs
from historysim.basics.limits import MOST_FRICTION
from historysim.loads.event_sequence import Events, digest
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


def test_the_digest_of_loads_covers_lines_of_json():
    numbers = [0.0, -0.0, 5e-324, -1e-310, 0.1, -0.5, 1.0, 1e16, -1.7e59]
    kinds = (hs.NormalDisplacement, hs.TangentialDisplacement)
    loads = [kind(time, value) for time, value in itertools.product(numbers, numbers) for kind in kinds]
    lines = [json.dumps([type(event).__name__, event.time.hex(), event.value.hex()]) + "\n" for event in loads]
    assert Events(loads).loads is not None
    assert digest(Events(loads)) == hashlib.sha256("".join(lines).encode()).hexdigest()


def test_kind_order_and_sign_matter():
    kinds = (hs.NormalLoad, hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement, hs.FrictionChange)
    assert len({digest([kind(0.0, 0.1)]) for kind in kinds}) == len(kinds)
    some = EVENTS[:4]
    assert len({digest(order) for order in itertools.permutations(some)}) == math.factorial(len(some))
    assert digest([hs.FrictionChange(0, [0.1, 0.2])]) != digest([hs.FrictionChange(0, [0.2, 0.1])])
    assert digest([hs.TangentialLoad(0.0, 0.1)]) != digest([hs.TangentialLoad(0.0, -0.1)])
    assert digest([hs.TangentialLoad(0.0, 0.0)]) != digest([hs.TangentialLoad(0.0, -0.0)])


@pytest.mark.parametrize("number", [0.0, 5e-324, 0.01, 1.0, 1e16, 1e59])
def test_every_bit_matters(number):
    after = math.nextafter(number, math.inf)
    for kind in (hs.NormalLoad, hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement):
        assert digest([kind(number, 0.1)]) != digest([kind(after, 0.1)])
        assert digest([kind(0.0, number)]) != digest([kind(0.0, after)])
    if after <= MOST_FRICTION:
        assert digest([hs.FrictionChange(0.0, number)]) != digest([hs.FrictionChange(0.0, after)])
        assert digest([hs.FrictionChange(0.0, [0.1, number])]) != digest([hs.FrictionChange(0.0, [0.1, after])])


def test_the_number_of_events_and_of_coefficients_matters():
    first = EVENTS[0]
    assert len({digest([first] * count) for count in range(4)}) == 4
    frictions = (0.1, [0.1], [0.1, 0.1])
    assert len({digest([hs.FrictionChange(0.0, friction)]) for friction in frictions}) == len(frictions)
    split = [hs.FrictionChange(0.0, [0.1]), hs.FrictionChange(0.0, [0.1])]
    assert digest(split) != digest([hs.FrictionChange(0.0, [0.1, 0.1])])


def test_types_of_the_numbers_do_not_matter():
    assert digest([hs.NormalLoad(1, 2)]) == digest([hs.NormalLoad(np.float64(1.0), np.float32(2.0))])
    assert digest([hs.FrictionChange(0, (1, 0.5))]) == digest([hs.FrictionChange(0.0, np.array([1.0, 0.5]))])
    assert digest(iter(EVENTS)) == digest(tuple(EVENTS)) == digest(EVENTS)


def test_the_numbers_of_the_kinds_in_a_log_stay_as_they_are():
    events = [kind(0.0, 0.1) for kind in (*LOAD_KINDS.values(), hs.FrictionChange)]
    events += [hs.FrictionChange(0.0, [0.1, 0.2]), hs.FrictionChange(0.0, 0.1, [2]), hs.FrictionRamp(0.0, 0.1)]
    events += [hs.GeometryChange(0.0, 0.1)]
    assert list(to_columns(events).kind) == [0, 1, 2, 3, 4, 5, 6, 7, 8]
    assert [type(event) for event in events[:5]] == [
        hs.NormalLoad,
        hs.NormalDisplacement,
        hs.TangentialLoad,
        hs.TangentialDisplacement,
        hs.FrictionChange,
    ]
