"""Questions to a history, against closed forms of one contact and against rows of springs for many."""

import re

import numpy as np
import xarray as xr
from golden import refused
from pytest import approx, fixture, importorskip, mark
from springs import Contact, SpringRow

import historysim as hs
from historysim.results import analysis, recompute
from historysim.results.analysis import history_summary, recorded, slips

E, G, MU = 40e9, 8e9, 0.2
PAIR = hs.MaterialPair.from_moduli(contact_modulus=E, shear_modulus=G)
THETA = E / (4 * G)
LOAD, RADIUS = 1e-3, 1e-5
APPROACH = (3 * LOAD / (4 * E * np.sqrt(RADIUS))) ** (2 / 3)
DELTA = THETA * MU * APPROACH

# summits of several heights, radii and coefficients
HEIGHTS = np.array([0.0, -20e-9, -35e-9, -60e-9, -1e-6])
RADII = np.array([10e-6, 30e-6, 15e-6, 40e-6, 10e-6])
FRICTION = np.array([0.2, 0.12, 0.25, 0.2, 0.2])
DEPTH = 100e-9
SWING = 30e-9
TURNS = [SWING, -SWING, SWING, -0.4 * SWING]
SUBSTEPS = 8


@fixture(scope="module")
def ball():
    """One asperity that goes once round between ±0.6 of its limit, in closed form."""
    swing = [
        hs.TangentialLoad(float(time), sign * 0.6 * MU * LOAD)
        for time, sign in ((1, 1), (2, -1), (3, 1))
    ]
    return hs.replay(
        hs.Ensemble(PAIR, 0.0, RADIUS, MU), [hs.NormalLoad(0.0, LOAD), *swing], substeps=6
    )


@fixture(scope="module")
def events():
    moves = [hs.TangentialDisplacement(float(time + 1), value) for time, value in enumerate(TURNS)]
    return [hs.NormalDisplacement(0.0, DEPTH), *moves]


@fixture(scope="module")
def history(events):
    return hs.replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), events, substeps=SUBSTEPS, record="all"
    )


@fixture(scope="module")
def springs():
    """What a row of springs says at each step: stick radius, slid or not, dissipated energy, all of each asperity."""
    row = SpringRow(Contact.build(E, G, HEIGHTS, RADII, FRICTION), DEPTH, 800)
    row.apply(("displacement", DEPTH), ("displacement", 0.0))
    rows = {"stick_radius": [row.stick_radius], "dissipated_energy": [row.dissipated_energy]}
    for start, end in zip([0.0, *TURNS], TURNS, strict=False):
        for share in np.arange(1, SUBSTEPS + 1) / SUBSTEPS:
            row.apply(("displacement", DEPTH), ("displacement", start + share * (end - start)), 1)
            rows["stick_radius"].append(row.stick_radius)
            rows["dissipated_energy"].append(row.dissipated_energy)
    return {name: np.array(values) for name, values in rows.items()} | {"row": row}


def test_displacements_of_each_definition_agree_with_the_closed_form(ball):
    found = analysis.branch_displacements(ball).isel(step=-1)
    expected = {
        "virgin": DELTA,
        "reversal_to_slip": 2 * DELTA,
        "zero_load_to_slip": 2 ** (1 / 3) * DELTA,
        "residual": (2 ** (1 / 3) - 1) * DELTA,
    }
    assert {name: found[name].item() for name in found.data_vars} == approx(expected, rel=1e-12)


def test_displacements_of_an_ensemble_agree_with_its_loop(history):
    """Between its extremes the branch is in full slip, so that the recorded curve itself says where zero load is."""
    swing = [hs.TangentialDisplacement(1.0, SWING), hs.TangentialDisplacement(2.0, -SWING)]
    pressed = hs.NormalDisplacement(0.0, DEPTH)
    rough = hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION)
    fine = hs.replay(rough, [pressed, *swing], substeps=2000, record="totals")
    found = analysis.branch_displacements(history).isel(step=-1)
    u, load, limit = (
        fine[name].values[2000:]
        for name in ("tangential_displacement", "total_tangential_load", "friction_limit")
    )
    # each is located between two steps
    step = 2 * SWING / 2000
    zero = np.interp(0.0, -load, u)
    slides = u[np.argmax(load <= -limit * (1 - 1e-12))]
    assert found["reversal_to_slip"].item() == approx(SWING - slides, abs=step)
    assert found["zero_load_to_slip"].item() == approx(zero - slides, abs=step)
    assert found["residual"].item() == approx(found["virgin"].item() - (SWING - zero), abs=step)


def test_the_work_of_presliding_equals_the_energy_of_a_closed_loop(ball, history):
    assert analysis.presliding_work(ball).values[-1] == approx(0.8 * MU * LOAD * DELTA, rel=1e-12)
    delta = analysis.preliminary_displacement(history).values[-1]
    row = SpringRow(Contact.build(E, G, HEIGHTS, RADII, FRICTION), DEPTH, 800)
    row.apply(("displacement", DEPTH), ("displacement", 0.0))
    row.apply(("displacement", DEPTH), ("displacement", delta))
    before = row.dissipated_energy.sum()
    row.apply(("displacement", DEPTH), ("displacement", -delta))
    row.apply(("displacement", DEPTH), ("displacement", delta))
    error = 2 * row.dissipated_energy_error.sum()
    work = row.dissipated_energy.sum() - before
    assert error < 1e-3 * work
    assert analysis.presliding_work(history).values[-1] == approx(work, abs=error)


def test_nothing_slides_without_contact_or_without_friction():
    apart = hs.replay(
        hs.Ensemble(PAIR, HEIGHTS, RADII, FRICTION), [hs.NormalDisplacement(0.0, -1e-9)]
    )
    smooth = hs.replay(hs.Ensemble(PAIR, HEIGHTS, RADII, 0.0), [hs.NormalLoad(0.0, LOAD)])
    for history in (apart, smooth):
        assert analysis.presliding_work(history).values.tolist() == [0.0]
        assert analysis.branch_displacements(history)["zero_load_to_slip"].values.tolist() == [0.0]


def test_the_friction_of_each_step_counts():
    events = [
        hs.NormalLoad(0.0, LOAD),
        hs.FrictionChange(1.0, 2 * MU),
        hs.FrictionChange(2.0, 3 * MU),
    ]
    changing = hs.replay(hs.Ensemble(PAIR, 0.0, RADIUS, MU), events)
    assert analysis.branch_displacements(changing)["residual"].values == approx(
        (2 ** (1 / 3) - 1) * DELTA * np.array([1, 2, 3]), rel=1e-12
    )
    assert analysis.presliding_work(changing).values == approx(
        0.8 * MU * LOAD * DELTA * np.array([1, 4, 9])
    )


def test_energy_per_cycle_agrees_with_the_closed_form(ball):
    f = 0.6
    a = np.sqrt(RADIUS * APPROACH)
    work = (
        9
        * MU**2
        * LOAD**2
        / (10 * a * G)
        * (1 - (1 - f) ** (5 / 3) - 5 * f / 6 * (1 + (1 - f) ** (2 / 3)))
    )
    found = analysis.energy_per_cycle(ball)
    assert found["total_energy"].values == approx([work], rel=1e-9)
    assert found["energy"].dims == ("loop", "asperity")
    assert found["energy"].values[0] == approx(found["total_energy"].values, rel=1e-12)
    assert (found["start_time"].values, found["end_time"].values) == ([1.0], [3.0])


def test_energy_per_cycle_of_each_asperity_agrees_with_springs(history, springs):
    found = analysis.energy_per_cycle(history)
    (start,), (end,) = (
        np.searchsorted(history.time, found[name]) for name in ("start_time", "end_time")
    )
    work = springs["dissipated_energy"][end] - springs["dissipated_energy"][start]
    assert (
        np.abs(found["energy"].values[0] - work).max()
        <= 2 * springs["row"].dissipated_energy_error.max()
    )
    assert found["total_energy"].values[0] == approx(found["energy"].values.sum(), rel=1e-12)
    names = [
        "total_normal_load",
        "total_tangential_load",
        "tangential_displacement",
        "total_dissipated_energy",
    ]
    assert list(analysis.energy_per_cycle(history[names]).data_vars) == ["total_energy"]


def test_shares_are_counted_asperity_by_asperity(history):
    found = analysis.slip_shares(history)
    weights = {
        "share_of_contacts": lambda _step, _i: 1.0,
        "share_of_area": lambda step, i: history.contact_radius.values[step, i] ** 2,
        "share_of_normal_load": lambda step, i: history.normal_load.values[step, i],
        "share_of_tangential_load": lambda step, i: abs(history.tangential_load.values[step, i]),
    }
    states = history.slip_state.values
    for step in (0, 3, 8, 12, 32):
        for name, weight in weights.items():
            sums = [0.0, 0.0, 0.0]
            for i, state in enumerate(states[step]):
                if state:
                    sums[state - 1] += weight(step, i)
            total = sum(sums) or 1.0
            assert found[name].values[step] == approx([part / total for part in sums], rel=1e-12)


def test_the_slipping_area_is_that_outside_the_stick_radii_of_the_springs(history, springs):
    a2 = RADII * np.maximum(HEIGHTS + DEPTH, 0.0)
    expected = 1 - (springs["stick_radius"] ** 2).sum(axis=1) / a2.sum()
    # a stick radius of springs is known to a spacing
    error = 2 * (np.sqrt(a2) * springs["row"].spacing).sum() / a2.sum()
    assert (
        np.abs(analysis.slip_shares(history)["slipping_area"].values - expected).max()
        < error
        < 0.01
    )


def test_the_order_of_sliding_agrees_with_springs(history, springs):
    """In virgin loading at a constant approach an asperity slides at θμδ: none of the steps has two of these."""
    found = slips.slip_onset(history)
    slid = springs["stick_radius"] == 0
    touching = HEIGHTS + DEPTH > 0
    expected = np.where(touching, slid.argmax(axis=0), -1)
    assert found["slide_step"].values.tolist() == expected.tolist()
    reach = THETA * FRICTION * np.where(touching, HEIGHTS + DEPTH, np.nan)
    order = np.argsort(reach)[: touching.sum()]
    assert slips.slides_first(history).tolist() == order.tolist()
    assert found["slide_rank"].values[-1] == -1
    assert np.isnan(found["slide_time"].values[-1])
    # the annulus begins with the first load, in all of them
    assert found["slip_step"].values.tolist() == [1, 1, 1, 1, -1]
    assert found["slip_rank"].values.tolist() == [0, 0, 0, 0, -1]
    summary = dict(history_summary.summary(history))
    assert re.fullmatch(
        rf"asperity {order[0]} at \S+ s; asperity {order[-1]} last at \S+ s; 4 of 5 slide",
        summary["first to slide"],
    )


def test_the_stiffness_of_asperities_is_the_slope_of_the_curve(ball, history):
    onward, reversed_ = (
        analysis.tangential_stiffness(history, way) for way in ("onward", "reversed")
    )
    assert onward.sum("asperity").values == approx(history.tangential_stiffness.values, rel=1e-9)
    a = np.sqrt(RADII * np.maximum(HEIGHTS + DEPTH, 0.0))
    assert reversed_.values[5] == approx(8 * G * a, rel=1e-9)
    # virgin loading: 8 G* a (1 - T/μN)^(1/3)
    load = ball.total_tangential_load.values[:7]
    expected = 8 * G * np.sqrt(RADIUS * APPROACH) * (1 - load / (MU * LOAD)) ** (1 / 3)
    assert analysis.tangential_stiffness(ball).values[:7, 0] == approx(expected, rel=1e-9)
    with refused("expected 'onward' or 'reversed'"):
        analysis.tangential_stiffness(history, "back")


def test_stick_ratio_and_pressures_are_hertz_and_mindlin_s(ball, history):
    load = ball.total_tangential_load.values[:7]
    assert analysis.stick_ratio(ball).values[:7, 0] == approx(
        (1 - load / (MU * LOAD)) ** (1 / 3), rel=1e-9
    )
    mean = LOAD / (np.pi * RADIUS * APPROACH)
    assert analysis.mean_pressure(ball).values == approx(np.full((19, 1), mean), rel=1e-9)
    assert analysis.peak_pressure(ball)[3, 0].item() == approx(
        2 * E / np.pi * np.sqrt(APPROACH / RADIUS), rel=1e-9
    )
    assert analysis.total_mean_pressure(ball).values[-1] == approx(mean, rel=1e-9)
    assert np.isnan(analysis.stick_ratio(history).values[:, -1]).all()
    assert (analysis.mean_pressure(history).values[:, -1] == 0).all()


def test_the_nominal_pressure_needs_an_area(ball):
    assert analysis.nominal_pressure(ball, 1e-6).values == approx(
        np.full(19, LOAD / 1e-6), rel=1e-9
    )
    with refused("has no nominal area"):
        analysis.nominal_pressure(ball)
    with refused("nominal_area"):
        analysis.nominal_pressure(ball, -1.0)
    of_a_map = ball.assign_attrs(nominal_area=2e-6)
    assert analysis.nominal_pressure(of_a_map).values[0] == approx(LOAD / 2e-6, rel=1e-9)


def test_the_power_of_sliding_is_friction_times_speed_and_sums_up_to_the_energy(history):
    slides = [
        hs.NormalLoad(0.0, LOAD),
        hs.TangentialDisplacement(2.0, 1e-6),
        hs.TangentialDisplacement(6.0, -1e-6),
    ]
    ball = hs.replay(hs.Ensemble(PAIR, 0.0, 2.5e-3, MU), slides, substeps=50)
    power = ball.contact.dissipated_power()
    assert power.attrs["units"] == "W"
    # 0.5 µm/s there, and back again
    assert power.values[[50, -1], 0] == approx(MU * LOAD * 0.5e-6, rel=1e-9)
    assert power.values[0, 0] == 0
    durations = np.diff(history["time"], prepend=history["time"][0])
    total = (history.contact.dissipated_power() * durations[:, None]).sum()
    gained = history["dissipated_energy"][-1].sum() - history["dissipated_energy"][0].sum()
    assert float(total) == approx(float(gained), rel=1e-12)


QUESTIONS = [
    analysis.energy_per_cycle,
    slips.slip_onset,
    analysis.dissipated_power,
    analysis.mean_pressure,
    analysis.peak_pressure,
    analysis.branch_displacements,
    analysis.presliding_work,
    analysis.slip_shares,
    analysis.stick_ratio,
    analysis.tangential_stiffness,
    analysis.total_mean_pressure,
    lambda history: recompute.profiles(history, 1, [3, 9]),
]


def test_answers_read_in_blocks_equal_those_in_memory(history, tmp_path, monkeypatch):
    history.to_netcdf(tmp_path / "h.nc")
    monkeypatch.setattr(recorded, "CELLS_AT_ONCE", 7 * history.sizes["asperity"])
    for question in QUESTIONS:
        with xr.open_dataset(tmp_path / "h.nc", decode_times=False) as opened:
            lazy, expected = question(opened), question(history)
            if isinstance(lazy, xr.DataArray) and lazy.ndim == 2:
                # a part of it reads a part of the file
                np.testing.assert_array_equal(lazy[5:7, [0, 3]], expected.values[5:7][:, [0, 3]])
                np.testing.assert_array_equal(lazy[-1], expected.values[-1])
            xr.testing.assert_identical(lazy.load(), expected.load())


@mark.parametrize(
    "question",
    [analysis.mean_pressure, analysis.slip_shares, slips.slip_onset, analysis.dissipated_power],
)
def test_answers_for_dask_arrays_are_equal_and_lazy(history, question):
    dask = importorskip("dask")
    cut = history.chunk({"step": 5, "asperity": 2})
    with dask.config.set(scheduler="synchronous"):
        answer = question(cut)
        if isinstance(answer, xr.DataArray):
            assert answer.chunksizes == cut["normal_load"].chunksizes
        xr.testing.assert_identical(answer.compute(), question(history).load())


def test_a_query_reads_one_block_at_a_time(history, tmp_path, monkeypatch):
    """No more steps of a variable at a time than a block has."""
    history.to_netcdf(tmp_path / "h.nc")
    monkeypatch.setattr(recorded, "CELLS_AT_ONCE", 4 * history.sizes["asperity"])
    with xr.open_dataset(tmp_path / "h.nc", decode_times=False, cache=False) as opened:
        read, kind = [], type(opened["slip_state"].variable._data)
        original = kind.get_duck_array
        monkeypatch.setattr(
            kind, "get_duck_array", lambda self: read.append(self.shape) or original(self)
        )
        analysis.slip_shares(opened)
        assert max(shape[0] for shape in read if len(shape) == 2) == 4


def test_first_loading_is_the_sum_of_cattaneos_curves():
    """Three unlike summits: T = Σ μN [1 - (1 - u/θμδ)^(3/2)] at the approach under the load."""
    from scipy import optimize

    from historysim.results.analysis.preliminary import first_loading

    height, radius = np.array([0.0, -2e-8, -5e-8]), np.array([1e-4, 2e-4, 1e-4])
    friction = np.array([0.1, 0.3, 0.2])
    pair = hs.MaterialPair.from_moduli(contact_modulus=40e9, shear_modulus=12e9)
    ensemble = hs.Ensemble(pair, height, radius, friction=friction)
    history = hs.replay(ensemble, [hs.NormalLoad(0.0, 1e-2)], record="all")

    def loads(depth):
        return 4 / 3 * 40e9 * np.sqrt(radius) * np.maximum(height + depth, 0) ** 1.5

    for load in (1e-4, 3e-3):
        depth = optimize.brentq(lambda d, load=load: loads(d).sum() - load, 0, 1e-5, xtol=1e-22)
        reach = 40e9 / (4 * 12e9) * friction * np.maximum(height + depth, 1e-300)
        u, t = first_loading(history, load, points=31)
        expected = (
            friction * loads(depth) * (1 - np.clip(1 - u[:, np.newaxis] / reach, 0, None) ** 1.5)
        )
        assert u[-1] == approx(reach.max(), rel=1e-9)
        assert t == approx(expected.sum(axis=1), rel=1e-9, abs=1e-15)
    with refused("normal_load"):
        first_loading(history, 0.0)
