"""Logs of contacts that evolve: every kind of event and law comes back, and all that is asked of a log holds."""

import numpy as np
import xarray as xr
from numpy.testing import assert_array_equal
from pairs import UNIT as PAIR
from pytest import approx, fixture, mark

import historysim as hs
from historysim.asperities import laws
from historysim.asperities.wear import ArchardWear, EnergyWear
from historysim.asperities.yielding import KogutEtsion
from historysim.log.canonical import from_columns, to_columns
from historysim.log.header import LogHeader, parse_head

HEIGHT, RADIUS = np.array([0.0, -0.012, -0.03]), np.array([1.0, 0.7, 0.9])

OTHER = [
    hs.FrictionChange(1.0, 0.3, [2]),
    hs.FrictionChange(1.0, [0.3, 0.4], [0, 2]),
    hs.FrictionChange(1.0, [0.3], (1,)),
    hs.FrictionRamp(1.0, 0.25),
    hs.FrictionRamp(2.0, [0.1, 0.2, 0.3]),
    hs.GeometryChange(2.0, summit_height=-0.01),
    hs.GeometryChange(2.0, summit_radius=[0.8, 1.1], asperities=[0, 1]),
    hs.GeometryChange(2.0, [-0.01, -0.02, -0.03], [1.0, 2.0, 3.0]),
]
LAWS = [
    laws.PowerLaw(0.4, 0.01, -0.3),
    laws.ShearStrength(0.05),
    laws.ShearStrength(0.05, area="jkr", work_of_adhesion=1e-4),
    laws.SlidFriction([0.0, 0.1], [0.4, 0.3]),
]


def test_other_events_come_back_from_columns():
    events = [hs.NormalLoad(0.0, 0.01), *OTHER, hs.FrictionChange(3.0, [0.1, 0.2, 0.3])]
    assert from_columns(to_columns(events)) == events


@mark.parametrize("law", LAWS, ids=lambda law: law.text)
def test_a_head_keeps_law_and_wear(law):
    for wear in (
        None,
        ArchardWear(coefficient=0.01, hardness=1.0),
        EnergyWear(volume_per_energy=0.1, shape="blunted"),
    ):
        ensemble = hs.Ensemble(PAIR, HEIGHT, RADIUS, law, wear=wear, follow_sliding=True)
        head = LogHeader.from_replay(hs.Replay(ensemble, ()))
        again = parse_head(head.text, head.arrays).ensemble
        assert (again.law, again.wear, again.follow_sliding) == (law, wear, True)
        assert again.friction.tobytes() == ensemble.friction.tobytes()


def test_a_head_of_steady_contacts_agrees_with_earlier_versions():
    settings = LogHeader.from_replay(hs.Replay(hs.Ensemble(PAIR, HEIGHT, RADIUS, 0.5), ())).settings
    assert settings["format"] == 1
    assert not {"friction_law", "wear", "follow_sliding"} & set(settings)


SCENARIO = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25

[surface]
kind = "summits"
height = [0.0, -0.012, -0.03]
radius = [1.0, 0.7, 0.9]

[friction]
law = "power"
coefficient = 0.4
reference_load = 0.01
exponent = -0.2

[wear]
law = "archard"
coefficient = 0.02
hardness = 1.0

[record]
sliding = true

[loading]
waypoints = [
    { time = 0, normal_load = 0.01 },
    { time = 1, normal_load = 0.01, tangential_displacement = 0.03 },
    { time = 2, normal_load = 0.02, tangential_displacement = 0.0, friction = [0.3], asperities = [2] },
    { time = 3, normal_load = 0.02, tangential_displacement = 0.01, geometry = {asperities = [1], summit_radius = 0.8}},
    { time = 4, normal_load = 0.015, tangential_displacement = -0.03, friction_ramp = 0.4 },
    { time = 5, normal_load = 0.015, tangential_displacement = 0.0, friction_ramp = 0.3 },
]
"""


@fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evolving")
    (folder / "s.toml").write_text(SCENARIO)
    history = hs.run(folder / "s.toml", folder / "s.nc", snapshot_every=1)
    return folder, history


def test_a_result_tells_what_evolves_and_verifies(made):
    folder, history = made
    assert hs.verify(folder / "s.nc")
    assert hs.verify(folder / "s.history").snapshots >= 2
    assert "power law" in history.friction_law
    assert "Archard" in history.wear_law
    assert history.present_friction.values[-1].tolist() == approx([0.3, 0.3, 0.3])
    assert history.erased_memories.values.tolist() == [0, 0, 0, 1, 1, 1]
    assert history.erased_energy.values[3] > history.erased_energy.values[2]
    assert history.present_summit_radius.values[3, 1] == 0.8
    assert (np.diff(history.slid_distance.values, axis=0) >= 0).all()
    assert (np.diff(history.worn_volume.values, axis=0) >= 0).all()
    assert history.worn_volume.values[-1].max() > 0
    assert history.present_summit_height.values[-1, 0] < 0
    told = dict(hs.analysis.summary(history))
    assert told["erased memories"].startswith("1, with an elastic energy of ")
    assert (
        told["worn volume"]
        == f"{history.worn_volume.values[-1].sum():.4g} m³ of the recorded asperities"
    )
    assert told["summed sliding distance"].endswith("m")
    direct = hs.load(folder / "s.toml").replay().dataset()
    for name in direct.variables:
        assert direct[name].values.tobytes() == history[name].values.tobytes(), name


def test_states_at_any_moment_and_forks_agree_with_the_replay(made):
    folder, history = made
    with hs.EventLog(folder / "s.history") as log:
        state = log.state(4.5)
        assert state == hs.State.from_bytes(state.to_bytes(), log.ensemble.initial_state())
        whole = log.state()
        path = folder / "fork.history"
        with log.fork(4.5, path) as fork:
            again = fork.state()
            assert again.friction == approx(state.friction, rel=1e-12)
            fork.append(
                [
                    hs.NormalLoad(5.0, 0.015),
                    hs.TangentialDisplacement(5.0, 0.0),
                    hs.FrictionRamp(5.0, 0.3),
                ]
            )
            assert fork.state().tangential_load == approx(whole.tangential_load, rel=1e-3)
        one = log.state_dataset(4.0)
        assert one.sizes["step"] == 1
        for name in ("worn_volume", "slid_distance", "present_summit_height", "tangential_load"):
            assert one[name].values[0] == approx(history[name].values[4], rel=1e-12), name


def test_a_log_of_summits_that_yield_is_resumed_forked_and_verified(tmp_path):
    pair = hs.MaterialPair.from_moduli(
        contact_modulus=43e9, shear_modulus=9e9, hardness=5.5e9, cracking_load=0.04
    )
    law = KogutEtsion(hardness=5.5e9, poissons_ratio=0.25)
    ensemble = hs.Ensemble(pair, [0.0, -10e-9, -25e-9], [1e-6, 0.8e-6, 2e-6], 0.2, yielding=law)
    head = LogHeader.from_replay(hs.Replay(ensemble, ()))
    assert head.settings["format"] == 5
    again = parse_head(head.text, head.arrays).ensemble
    assert (again.yielding, again.pair.cracking_load) == (law, 0.04)
    loads = [hs.NormalLoad(float(k), n * 1e-3) for k, n in enumerate((0.5, 1.0, 0.3, 2.0, 1.5))]
    events = sorted(
        [*loads, *(hs.TangentialLoad(k + 0.5, (-1) ** k * 4e-5) for k in range(4))],
        key=lambda e: e.time,
    )
    whole = hs.replay(ensemble, events, substeps=3, hold=False)
    with hs.EventLog.create(
        tmp_path / "whole.history", ensemble, events[:5], substeps=3, hold=False
    ) as log:
        log.append(events[5:])
        history = log.replay()
        middle = log.state(at=1.5)
        log.fork(1.5, tmp_path / "fork.history").close()
        # an open log's own snapshots give the same bits
        assert log.state(at=1.5) == middle
    for name in whole.data_vars:
        assert_array_equal(history[name], whole[name], err_msg=str(name))
    assert middle.yielded.yielding_energy.sum() > 0
    with hs.EventLog(tmp_path / "fork.history") as fork:
        assert_array_equal(fork.state(at=1.5).yielded.summit_height, middle.yielded.summit_height)
    written = tmp_path / "out.nc"
    hs.Replay(ensemble, events, substeps=3, hold=False).write(written)
    with xr.open_dataset(written) as found:
        assert_array_equal(found.yielding_load, whole.yielding_load)
