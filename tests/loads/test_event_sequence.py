"""Sequences of events: their digest, and what they are as arrays."""

import hashlib
import json
import pickle

import numpy as np
import pytest

import historysim as hs
from historysim.loads.event_sequence import Events, digest, to_loads
from historysim.loads.events import LOAD_KINDS


def test_the_digest_of_loads_is_over_their_json_line_by_line():
    rng = np.random.default_rng(8)
    hard = [
        0.0,
        -0.0,
        5e-324,
        -2.2e-308,
        1.0,
        -1.0,
        2.0**-1022,
        1e60,
        -1e60,
        *rng.normal(size=20) ** 9,
    ]
    kinds = list(LOAD_KINDS.values())
    pairs = enumerate(zip(sorted(hard), hard, strict=True))
    events = [
        kinds[k % 4](time, abs(value) if kinds[k % 4] is hs.NormalLoad else value)
        for k, (time, value) in pairs
    ]
    lines = [
        json.dumps([type(event).__name__, event.time.hex(), event.value.hex()]) + "\n"
        for event in events
    ]
    expected = hashlib.sha256("".join(lines).encode()).hexdigest()
    assert digest(events) == digest(iter(events)) == digest(Events(events)) == expected
    change = json.dumps(["FrictionChange", (2.0).hex(), [(0.1).hex(), (0.3).hex()]]) + "\n"
    expected = hashlib.sha256("".join([*lines, change]).encode()).hexdigest()
    assert digest([*events, hs.FrictionChange(2.0, (0.1, 0.3))]) == expected


def test_arrays_of_loads_say_what_the_events_say_and_others_have_none():
    events = [
        hs.NormalLoad(0.0, 1e-3),
        hs.TangentialDisplacement(0.0, -1e-9),
        hs.NormalDisplacement(1.0, -1e-9),
    ]
    loads = to_loads(events)
    assert [list(LOAD_KINDS.values())[kind] for kind in loads.kind] == [
        type(event) for event in events
    ]
    assert loads.time.tolist() == [0.0, 0.0, 1.0]
    assert loads.value.tolist() == [1e-3, -1e-9, -1e-9]
    assert to_loads([*events, hs.FrictionChange(2.0, 0.1)]) is None
    assert to_loads([*events, "event"]) is None
    assert pickle.loads(pickle.dumps(Events(events))) == tuple(events)


def test_events_of_arrays_agree_with_objects():
    objects = Events(
        [hs.NormalLoad(0.0, 0.5), hs.TangentialLoad(0.5, -0.1), hs.NormalDisplacement(2.0, 1e-9)]
    )
    arrays = Events(loads=objects.loads)
    assert (arrays, len(arrays), repr(arrays)) == (objects, 3, repr(list(objects)))
    assert [arrays[0], arrays[-1]] == [objects[0], objects[2]]
    assert "_objects" not in vars(arrays[1:])
    assert arrays[1:] == objects[1:]
    with pytest.raises(IndexError):
        Events(loads=objects.loads)[3]
    assert pickle.loads(pickle.dumps(arrays)) == objects
    change = Events([hs.FrictionChange(3.0, 0.1)])
    joined = Events.join([arrays, objects, change])
    assert joined == [*objects, *objects, *change]
    assert (Events.join([arrays, arrays]).loads.time == [0.0, 0.5, 2.0] * 2).all()
    assert (joined.loads, Events.join([])) == (None, [])
    assert digest(arrays) == digest(list(objects))
