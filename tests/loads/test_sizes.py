"""Numbers beyond what is computed with are refused wherever they come in; smaller ones are as good as 0."""

import math

import numpy as np
import pytest
from golden import refused
from pytest import mark, raises

import historysim as hs
from historysim.basics.limits import MOST_FRICTION
from historysim.loads.event_sequence import SampledLoads
from historysim.log.canonical import from_columns, to_columns

PAIR = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
LOADED = BALL.advance(BALL.initial_state(), normal_load=0.05)
BEYOND = [1.0000001e60, 1e308]
KINDS = [hs.NormalLoad, hs.NormalDisplacement, hs.TangentialLoad, hs.TangentialDisplacement]


@mark.parametrize("number", BEYOND)
@mark.parametrize("kind", [*KINDS, hs.FrictionChange, hs.FrictionRamp])
def test_events_name_themselves_and_their_time(kind, number):
    is_friction = "Friction" in kind.__name__
    field, most = (
        ("friction", "10000 at most") if is_friction else ("value", "at most 1e+60 in size, in SI")
    )
    with raises(hs.InputError) as caught:
        kind(2.0, number)
    assert str(caught.value).startswith(
        f"{kind.__name__}: {field} is {number!r} at t = 2 s; expected "
    )
    assert most in str(caught.value)
    for time in (number, -number):
        with refused(rf"{kind.__name__}: time is .*; expected a number of at most 1e\+60"):
            kind(time, 0.1)
    for fine in (1e60, 1e-70, 5e-324, 0.0):
        assert kind(-fine, min(fine, MOST_FRICTION) if is_friction else fine).time == -fine


@mark.parametrize("number", BEYOND)
def test_every_other_way_in(number):
    ways = {
        "geometry": lambda: hs.GeometryChange(0.0, summit_radius=[1e-6, number]),
        "a height": lambda: hs.GeometryChange(0.0, summit_height=-number),
        "advance": lambda: BALL.advance(LOADED, normal_load=number),
        "advance aside": lambda: BALL.advance(LOADED, tangential_displacement=-number),
        "advance friction": lambda: BALL.advance(LOADED, friction=number),
        "many": lambda: BALL.advance_many(LOADED, normal_displacement=[1e-9, number]),
        "stepper": lambda: BALL.stepper(LOADED).step(tangential_load=number),
        "stepper of an integer": lambda: BALL.stepper(LOADED).step(tangential_load=int(number)),
        "batch": lambda: hs.ContactBatch(PAIR, 1e-3, 0.2, 2).step([1e-9, number], [0.0, 0.0]),
        "batch aside": lambda: hs.ContactBatch(PAIR, 1e-3, 0.2, 1).step([1e-9], [-number]),
        "batch radius": lambda: hs.ContactBatch(PAIR, number, 0.2, 1),
        "batch friction": lambda: hs.ContactBatch(PAIR, 1e-3, number, 1),
        "stiffness": lambda: hs.Instrument(lateral_stiffness=number),
        "soft": lambda: hs.Instrument(lateral_stiffness=1 / number),
        "resolution": lambda: hs.Instrument(displacement_resolution=number),
        "friction": lambda: hs.Ensemble(PAIR, 0.0, 1e-3, number),
        "heights": lambda: hs.Ensemble(PAIR, [0.0, -number], 1e-3, 0.2),
        "radii": lambda: hs.Ensemble(PAIR, 0.0, [1e-3, number], 0.2),
        "small radii": lambda: hs.Ensemble(PAIR, 0.0, 1 / number, 0.2),
        "summits": lambda: hs.Summits([0.0, number], 1e-3),
        "with friction": lambda: BALL.with_friction(LOADED, number),
        "with geometry": lambda: BALL.with_geometry(LOADED, summit_radius=number),
        "approach": lambda: BALL.approach_at(number),
        "modulus": lambda: hs.MaterialPair.from_moduli(contact_modulus=number, shear_modulus=1e10),
        "soft modulus": lambda: hs.MaterialPair.from_moduli(
            contact_modulus=5e10, shear_modulus=1 / number
        ),
        "hardness": lambda: hs.MaterialPair.from_moduli(
            contact_modulus=1, shear_modulus=1, hardness=number
        ),
        "law": lambda: hs.laws.ShearStrength(number),
        "samples": lambda: SampledLoads(np.array([0.0, number]), np.ones(2), np.zeros(2)),
    }
    for name, way in ways.items():
        with raises(hs.InputError):
            pytest.fail(f"{name} gave {way()}")
    columns = to_columns([hs.TangentialLoad(0.0, 0.1)])
    forged = type(columns)(
        columns.kind, columns.time, np.array([number]).tobytes(), columns.coefficients
    )
    with refused("a value"):
        from_columns(forged)


def test_more_rows_than_are_allowed_are_refused_before_they_are_made():
    job = hs.Replay(BALL, [hs.NormalLoad(0.0, 0.05), hs.TangentialLoad(1.0, 1e-3)], substeps=10**9)
    with refused("2,000,000,000 steps; expected 100,000,000 at most"):
        job.dataset()


@mark.parametrize("load", [1e-70, 1e-100, 1e-200])
def test_a_small_load_is_carried_as_any_other(load):
    """Mindlin (1949): U = (3 μN / 16 G* a)(1 - (1 - T/μN)^(2/3)), to scale."""
    events = [hs.NormalLoad(0.0, load), hs.TangentialLoad(1.0, 0.1 * load)]
    state = hs.Replay(BALL, events).state()
    expected = PAIR.displacement_ratio * 0.2 * state.approach * (1 - 0.5 ** (2 / 3))
    assert state.tangential_displacement == pytest.approx(expected, rel=1e-12)
    assert math.isclose(state.normal_load, load, rel_tol=1e-12)


SCENARIO = """
[materials]
contact_modulus = "50 GPa"
shear_modulus = "10 GPa"
[surface]
kind = "sphere"
radius = "1 mm"
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = 0.05 }, { time = 1, tangential_displacement = 1e-9 }]
"""


def test_a_record_names_its_line(tmp_path):
    (tmp_path / "r.csv").write_text(
        "t,N,U\n0,0.05,0\n1,0.05,1e-9\n2,1e300,1e-9\n", encoding="utf-8"
    )
    loading = 'file = "r.csv"\ncolumns = { time = "t", normal_load = "N", tangential_displacement = "U" }\n'
    text = SCENARIO[: SCENARIO.index("waypoints")] + loading
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    with refused(r"^s\.toml: loading\.columns\.normal_load: r\.csv: line 4: 1e\+300; expected"):
        hs.validate(tmp_path / "s.toml")
