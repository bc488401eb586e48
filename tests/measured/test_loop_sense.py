"""Loops that are none of friction, and branches that end before they slide."""

import re

import numpy as np
import synthetic
from golden import check_messages
from pytest import approx, mark

from historysim.measured.branches import Definitions
from historysim.measured.loops import loops_of_channels, loops_of_measurement
from historysim.results.tables import loop_summary as summary

COUNT = 3200
TIME = np.linspace(0, 8, COUNT)
MOVED = 1e-6 * np.sin(2 * np.pi * TIME)


def jenkins():
    """Give the load of one spring of 1 N/µm that slides at 0.2 N."""
    load = np.zeros(COUNT)
    for sample in range(1, COUNT):
        load[sample] = np.clip(
            load[sample - 1] + 1e6 * (MOVED[sample] - MOVED[sample - 1]), -0.2, 0.2
        )
    return load


FRICTION, NOISE = jenkins(), np.random.default_rng(0).normal(size=(3, COUNT))
MEASURED = MOVED + 2e-9 * NOISE[0]
NORMAL = 1 + 0.01 * NOISE[1]
NONE = {
    "constant": (0.3 + 0 * TIME, "not clear of 0"),
    "spring": (2e5 * MOVED + 2e-3 * NOISE[2], "no energy"),
    "time": (TIME, "does not come back"),
}


@mark.parametrize("name", NONE)
def test_loops_without_friction_have_no_coefficient(name):
    load, reason = NONE[name]
    found = loops_of_channels(TIME, MEASURED, load, 1.0)
    ((members, text),) = found.no_friction
    assert members.tolist() == list(range(len(found)))
    assert re.search(reason, text)
    assert any(
        "is the column of the tangential load right? historysim columns FILE" in note
        for note in found.notes
    )
    rows = {row[0]: row[1:] for row in found.rows()}
    assert set(rows["friction coefficient"]) == set(rows["friction force"]) == {"–"}
    assert not any("coefficient drifts" in note or "lower bounds" in note for note in found.notes)
    assert dict(summary(found.to_dataset()))["no_friction"] == text


@mark.parametrize("offset", [0.0, 1.0])
def test_an_offset_does_not_hide_friction(offset):
    found = loops_of_channels(TIME, MEASURED, offset + FRICTION + 2e-3 * NOISE[2], NORMAL)
    assert found.no_friction == ()
    assert found.statistics("friction_coefficient").mean == approx(0.2, rel=5e-3)


def test_each_load_is_judged_by_itself():
    """At the second load the sensor was off."""
    normal = np.where(TIME < 4, 1.0, 2.0)
    load = np.where(TIME < 4, FRICTION, 1e-3 * NOISE[2])
    found = loops_of_channels(TIME, MEASURED, load, normal)
    ((_, text),) = found.no_friction
    assert re.match(r"\d loops at 2 N are no friction: ", text)
    rows = [row[-1] for row in found.by_load().rows() if row[0] == "  2 N"]
    assert rows[0] == "–"
    assert found.by_load().statistics("friction_coefficient")[0].mean == approx(0.2, rel=1e-2)
    # a line through one load is none
    assert found.by_load().laws() == []


# -- branches that do not slide
# ---------------------------------------------------------------------


def short(noise=1.0, **shape):
    """Give loops of ±50 nm behind the instrument: the ball slides at 2 θμδ and what the load bends, beyond ±55 nm."""
    return synthetic.measured(
        "ball", 0, amplitude=50e-9, loads=(0.05,), loops=4, noise=noise, **shape
    )


def slider(
    *, gap=40.0, stop=(2.0, 2.0), stiffness=5.0, samples=200, noise=0.0, rounded=1, **others
):
    """Give the loops of sliders of 10 N in all, in µm and N/µm, with stops behind a gap in strokes of ±50 µm."""
    phase = np.arange(int(5.25 * samples)) / samples
    wave, grow, tilt, position = (
        others.get(name, 0) for name in ("wave", "grow", "tilt", "position")
    )
    moved = 50 * (
        np.sin(2 * np.pi * phase) if wave else 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    )
    limit = np.arange(1.0, rounded + 1)
    limit *= 10 / limit.sum()
    held, load = np.zeros(rounded), np.zeros(moved.size)
    for index, step in enumerate(np.diff(moved), 1):
        most = limit * (1 + position * (moved[index] / 50) ** 2)
        held = np.clip(held + stiffness / rounded * step, -most, most)
        load[index] = held.sum()
    ends = stop[0] * np.clip(moved - gap, 0, None) - stop[1] * np.clip(-moved - gap, 0, None)
    load += ends * (phase / 5.25 if grow else 1) + tilt * moved + others.get("offset", 0)
    random = np.random.default_rng(0)
    load += noise * random.normal(size=load.size)
    return loops_of_channels(
        phase, 1e-6 * moved, load, 50 * (1 + 1e-3 * noise * random.normal(size=load.size))
    )


@mark.parametrize(
    "shape",
    [
        {},
        {"stop": (2.0, 0.0)},
        {"stop": (0.3, 0.3)},
        {"stop": (50.0, 20.0), "wave": True},
        {"rounded": 30},
        {"noise": 0.3, "wave": True},
        {"samples": 24},
        {"offset": 3.0},
        {"grow": True},
        {"gap": 8.0, "stop": (1.0, 1.0)},
    ],
)
def test_a_stop_leaves_the_friction_of_the_level_part(shape):
    loops = slider(**shape)
    assert loops.statistics("friction_coefficient").mean == approx(0.2, rel=0.01)
    assert (
        sum(
            "the load rises again at the ends of the stroke: a stop or interlocking" in n
            for n in loops.notes
        )
        == 1
    )
    assert not any("longer strokes" in note for note in loops.notes)
    # an elastic stop takes nothing
    if not (shape.get("grow") or shape.get("rounded")):
        # straight lines between samples cut the four corners of a loop
        accuracy = 0.06 if "samples" in shape else 0.03
        assert loops.statistics("dissipated_energy").mean == approx(
            4 * 10 * (50e-6 - 2e-6), rel=accuracy
        )
    assert loops.fretting.regime_text().startswith("gross slip")
    assert not slider(**{**shape, "stop": (0.0, 0.0)}).hooked_branches.any()


@mark.parametrize(
    "shape",
    [
        {"rounded": 30, "stiffness": 0.4},
        {"rounded": 30, "stiffness": 0.4, "noise": 0.3},
        {"tilt": 0.05},
        {"tilt": 0.02, "noise": 0.3},
        {"position": 0.08},
        {"position": 0.08, "noise": 0.2},
        {"position": 0.09, "noise": 0.5},
    ],
)
def test_rounded_tilted_and_uneven_branches_have_no_stop(shape):
    loops = slider(stop=(0.0, 0.0), **shape)
    assert not loops.hooked_branches.any()
    assert not any("rises again" in note for note in loops.notes)
    # friction that rises along a part that slides is no lower bound, and longer strokes raise it
    assert loops.rising_branches.any() == ("rounded" in shape)
    if "position" in shape:
        # the mean of 1 + p x² over the last quarter of the stroke, from x = 1/2 to 1, is 1 + 7/12 p
        coefficient = loops.statistics("friction_coefficient").mean
        assert coefficient == approx(0.2 * (1 + 7 / 12 * shape["position"]), rel=5e-3)


def test_branches_without_sliding_give_a_lower_bound():
    found = loops_of_measurement(short())
    assert found.rising_branches.all()
    # it is 0.20, and the means say 0.18
    assert found.friction_coefficient == approx(np.full((3, 2), 0.184), abs=2e-3)
    for name in ("friction_force", "friction_coefficient", "preliminary_displacement"):
        assert found.statistics(name).count == 0
        assert np.isnan(found.statistics(name).mean)
    assert found.text("friction_coefficient").startswith("≥ 0.184")
    (note,) = found.notes
    assert note.startswith(
        "6 of 6 branches do not reach sliding: the load still rises by more than 5 % where it should"
    )
    # what does not need sliding stays
    assert (
        found.statistics("dissipated_energy").count
        == found.statistics("tangential_stiffness").count
        == 3
    )
    assert found.by_load().laws() == []


def test_only_sliding_loops_count_in_the_mean():
    """At 20 mN they slide, at 50 mN they do not."""
    found = loops_of_measurement(
        synthetic.measured("ball", 0, amplitude=50e-9, loads=(0.02, 0.05), loops=3, noise=0.1)
    )
    slid = ~found.rising_branches & np.isfinite(found.friction_force)
    assert slid.any()
    assert found.rising_branches.any()
    assert found.statistics("friction_coefficient").mean == approx(0.2, rel=2e-3)
    assert found.statistics("friction_coefficient").count == slid.all(axis=1).sum()
    table = dict(
        zip(
            found.by_load().value.round(3),
            found.by_load().statistics("friction_coefficient"),
            strict=True,
        )
    )
    assert table[0.02].count > 0
    assert table[0.05].count == 0


def test_scatter_is_not_a_rise_and_the_threshold_is_an_option():
    random, way = (
        np.random.default_rng(0),
        np.concatenate([np.linspace(-1, 1, 400), np.linspace(1, -1, 400)]),
    )
    moved = np.tile(way, 4)
    force = np.where(np.tile(np.repeat([1, -1], 400), 4) > 0, 1.0, -1.0) + random.normal(
        0, 0.3, moved.size
    )
    assert not loops_of_channels(np.arange(moved.size), moved, force).rising_branches.any()
    time = np.arange(moved.size)
    # friction that rises evenly by 8 % over the last quarter, as that of a friction damper does,
    # and by 16 %
    for tilt, rising in ((0.16, False), (0.32, True)):
        tilted = np.where(np.tile(np.repeat([1, -1], 400), 4) > 0, 1.0, -1.0) + tilt * moved
        assert (loops_of_channels(time, moved, tilted).rising_branches == rising).all()
    wide = Definitions(still_rising=0.1)
    assert not loops_of_channels(time, moved, tilted, definitions=wide).rising_branches.any()


def test_messages():
    check_messages(globals())
