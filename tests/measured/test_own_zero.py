"""Files of records: a stage with a separate zero, in parallel with a flexure, a damper, spoilt channels."""

import itertools

import numpy as np
from clean_records import BODIES, FRICTION, LOAD, PAIR, SLIPS, loaded
from numpy.testing import assert_allclose
from pytest import approx, mark, raises
from records import scenario_text, write_columns

import historysim as hs
from historysim.measured.loops import loops_of_channels

pytestmark = mark.ci

TIME = np.arange(601) * 0.01
MOVED = 0.5 * SLIPS["sphere"] * np.sin(2 * np.pi * TIME)
STICKS = (
    BODIES["sphere"]
    .advance_many(loaded("sphere"), tangential_displacement=MOVED)[1]
    .tangential_load
)
BALL = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
"""
RESPONSE = {"tangential_load": '"T"'}


def write(folder, moved=MOVED, load=STICKS, normal=LOAD, name="s.toml", **keys):
    """Write a record of SI columns with the displacement in nm, and a scenario of it."""
    write_columns(folder / "m.csv", t=TIME, N=normal + 0 * TIME, u=1e9 * moved, T=load)
    (folder / name).write_text(
        scenario_text(**{"response": RESPONSE, "base": BALL, **keys}), encoding="utf-8"
    )
    return folder / name


# -- the zero
# ---------------------------------------------------------------------------------------


def test_a_record_that_begins_at_zero_within_its_noise_stays(tmp_path):
    noisy = MOVED + np.random.default_rng(0).normal(0, 1e-10, TIME.size)
    measurement = hs.load(write(tmp_path, noisy)).measurement()
    assert not measurement.remarks
    assert_allclose(measurement["tangential_displacement"], noisy, rtol=1e-12)


def test_the_zero_is_the_first_reading_of_the_file(tmp_path):
    found = hs.load(write(tmp_path, MOVED + 1e-6, loading='start = "0.25 s"')).measurement()
    assert found["tangential_displacement"][0] == approx(MOVED[25], abs=1e-14)


def test_a_raw_stage_height_is_not_an_approach(tmp_path):
    columns = {"normal_load": None, "tangential_displacement": None}
    for entry, refused in (
        ('{ column = "u", unit = "nm" }', True),
        ('{ column = "u", unit = "nm", offset = 0 }', False),
    ):
        path = write(
            tmp_path,
            5e-6 + 0 * MOVED,
            columns={**columns, "normal_displacement": entry},
            response={},
        )
        if refused:
            with raises(hs.InputError, match=r'starts at 5 µm.*offset = "-5 µm".*offset = 0'):
                hs.load(path).events()
        else:
            assert hs.load(path).events()


@mark.parametrize("offset", ["0", "0.0", '"0 nm"', '"1e-12 nm"'])
def test_an_offset_of_zero_is_an_offset(offset, tmp_path):
    """The contact is pressed at displacement 0, and moves to its first sample along Mindlin's first branch."""
    radius = (0.75 * 2.5e-3 * LOAD / PAIR.contact_modulus) ** (1 / 3)
    slip = 3 * FRICTION * LOAD / (16 * radius * PAIR.shear_modulus)
    moved = slip * np.linspace(0.4, 0.9, TIME.size)
    right = FRICTION * LOAD * (1 - (1 - moved / slip) ** 1.5)
    column = f'{{ column = "u", unit = "nm", offset = {offset} }}'
    scenario = hs.load(write(tmp_path, moved, right, columns={"tangential_displacement": column}))
    loads = hs.run(scenario).total_tangential_load, hs.compare(scenario).response.tangential_load
    for load in loads:
        assert_allclose(load, right, rtol=1e-9)


def write_mid_stroke(folder, zero=5e-6, phase=0.13, stroke=1.0, column='"u"', **keys):
    """Write a record in partial slip that begins in mid-stroke, on a stage with another zero; give its first place."""
    moved = stroke * 0.5 * SLIPS["sphere"] * np.sin(2 * np.pi * (TIME[:201] + phase))
    load = (
        BODIES["sphere"]
        .advance_many(loaded("sphere"), tangential_displacement=moved)[1]
        .tangential_load
    )
    load = load + np.random.default_rng(0).normal(0, 2e-5, load.size)
    write_columns(folder / "m.csv", t=TIME[:201], N=LOAD + 0 * moved, u=moved + zero, T=load)
    columns = {"tangential_displacement": column}
    more = '[fit]\nparameters = ["friction", "displacement_offset"]\n'
    base = BALL.replace("0.2", "0.3")
    text = scenario_text(
        **{"response": RESPONSE, "base": base, "columns": columns, "more": more, **keys}
    )
    (folder / "s.toml").write_text(text, encoding="utf-8")
    return folder / "s.toml", moved


def test_the_offset_of_the_displacement_is_fitted(tmp_path):
    zero = 5e-6
    path, moved = write_mid_stroke(tmp_path, zero)
    found = hs.fit(path)
    for name, truth in (("friction", FRICTION), ("displacement_offset", -zero)):
        (parameter,) = (each for each in found.parameters if each.name == name)
        assert parameter.low < truth < parameter.high
        assert parameter.high - parameter.low < 0.015 * abs(
            {"friction": FRICTION}.get(name, np.ptp(moved))
        )
    assert not any("does not begin at rest" in note for note in found.estimates.notes)
    assert found.comparison.residuals.rms < 2.2e-5
    # the written scenario has it, and means the same in run and compare
    found.write(tmp_path / "fitted.toml")
    again = hs.load(tmp_path / "fitted.toml")
    assert again.measurement()["tangential_displacement"] == approx(moved, abs=1e-10)
    compared = hs.compare(again)
    assert compared.residuals.rms < 2.2e-5
    history = hs.run(again).total_tangential_load
    assert_allclose(history, compared.response.tangential_load, atol=1e-2 * FRICTION * LOAD)
    assert_allclose(history[:20], compared.response.tangential_load[:20], rtol=1e-9)


def test_a_fitted_offset_is_written_where_the_column_is(tmp_path):
    path, _ = write_mid_stroke(tmp_path, column='{ column = "u", offset = "-5 µm" }')
    text = hs.fit(path).scenario_text(tmp_path / "f.toml")
    (line,) = (each for each in text.splitlines() if each.startswith("tangential_displacement = "))
    assert "offset = -" in line
    assert "# offset fitted, 95 %: -" in line


def test_an_offset_that_sliding_forgets_is_not_determined(tmp_path):
    found = hs.fit(write_mid_stroke(tmp_path, stroke=6.0)[0])
    assert "95 %: not determined" in dict(found.summary())["displacement_offset"]
    assert any("does not remember where it began" in note for note in found.estimates.notes)


# -- records that begin amid a test


@mark.parametrize("guess", ["0.3", "2.0"])
def test_a_record_from_the_middle_of_a_test_is_fitted(tmp_path, guess):
    """The advice of the note is followed; before it the estimate is off."""
    base = BALL.replace("0.2", guess)
    path, moved = write_mid_stroke(tmp_path, stroke=3.0, base=base)
    path.write_text(path.read_text(encoding="utf-8").replace(', "displacement_offset"', ""))
    (note,) = (text for text in hs.fit(path).estimates.notes if "begin at rest" in text)
    assert 'past = "unknown" in [loading]' in note
    path.write_text(
        path.read_text(encoding="utf-8").replace("[loading]", '[loading]\npast = "unknown"')
    )
    found = hs.fit(path)
    (friction,) = found.parameters
    assert friction.low < FRICTION < friction.high
    assert friction.high - friction.low < 0.01 * FRICTION
    assert not found.estimates.notes
    left_out = moved.size - found.comparison.difference.size
    assert f"{left_out} samples before are not compared" in dict(found.summary())["past"]
    # sphere: the past is forgotten after a stroke of twice the displacement at full slip
    reach = 2 * SLIPS["sphere"]
    turn = int(np.argmax(moved[:50]))
    expected = turn + int(np.flatnonzero(moved[turn] - moved[turn:] >= reach)[0])
    assert abs(left_out - expected) <= 3
    found.write(tmp_path / "fitted.toml")
    assert hs.compare(tmp_path / "fitted.toml").difference.size == moved.size - left_out


def test_a_record_that_never_forgets_its_past_is_refused(tmp_path):
    path, _ = write_mid_stroke(tmp_path, loading='past = "unknown"')
    for verb in (hs.compare, hs.fit):
        with raises(hs.InputError, match=r"loading.past: .*expected strokes that slide"):
            verb(path)
    with raises(hs.InputError, match=r"loading.past: .*creep has no bounds"):
        hs.creep(path)


# -- a spring in parallel with the contact, a damper
# -----------------------------------------------------------


LONG = 5e-7 * np.sin(2 * np.pi * TIME)
NOISE = 2e-5 * np.random.default_rng(0).normal(size=TIME.size)
BEHIND = (
    BODIES["sphere"]
    .advance_many(
        loaded("sphere"),
        tangential_displacement=LONG,
        instrument=hs.Instrument(lateral_stiffness=5e5),
    )[1]
    .tangential_load
)
IN_PARALLEL = BEHIND + 1e4 * LONG + NOISE
SERIES = '[instrument]\nlateral_stiffness = "500 kN/m"\n'


def test_a_spring_in_parallel_is_fitted(tmp_path):
    more = (
        SERIES
        + 'parallel_stiffness = "7 kN/m"\n[fit]\nparameters = ["friction", "parallel_stiffness"]\n'
    )
    found = hs.fit(write(tmp_path, LONG, IN_PARALLEL, more=more))
    assert found.values["parallel_stiffness"] == approx(1e4, rel=0.02)
    assert found.values["friction"] == approx(0.2, rel=0.02)
    assert (
        "parallel_stiffness = "
        in found.scenario_text(tmp_path / "f.toml").partition("[instrument]")[2]
    )
    assert found.comparison.measured.statistics("friction_coefficient").mean == approx(
        0.2, rel=0.02
    )


def test_terms_of_a_difference_have_a_scale(tmp_path):
    terms = '{ difference = ["T", { column = "u", scale = 1e-5, unit = "N" }] }'
    found = hs.loops(write(tmp_path, LONG, IN_PARALLEL, response={"tangential_load": terms}))
    assert found.statistics("friction_coefficient").mean == approx(0.2, rel=0.01)
    for scale, expected in (
        ("0", "a number other than 0"),
        ('"2"', "a number, or one with the unit of the channel"),
    ):
        terms = f'{{ sum = ["T", {{ column = "u", scale = {scale}, unit = "N" }}] }}'
        with raises(hs.InputError, match=rf"sum\[1\]\.scale: .*expected {expected}"):
            hs.load(write(tmp_path, response={"tangential_load": terms}))


def test_energy_proportional_to_the_squared_amplitude_is_not_friction():
    """In triangles a damper makes parallelograms, as friction in parallel with a spring does."""
    phase = np.arange(2400) / 200
    speed = np.where(np.abs(phase % 1 - 0.5) < 0.25, -1, 1)
    size = np.array([1, 0.4, 0.15])[np.minimum(phase // 4, 2).astype(int)]
    moved = 1e-6 * size * np.interp(phase % 1, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    found = loops_of_channels(phase, moved, 0.01 * size * speed, 0.05)
    assert "energy is proportional to the square of the amplitude" in found.no_friction[0][1]
    friction = loops_of_channels(phase, moved, 0.01 * speed, 0.05)
    assert friction.no_friction == ()


# -- spoilt channels
# ----------------------------------------------------------------------------------


# -- the load replayed, or the load and the normal load together
# --------------------------------------------------


def mindlin_displacement(load, turns):
    """Displacement along a load between turning points, by Mindlin's first branch and Masing's rule [m]."""
    radius = (0.75 * 2.5e-3 * LOAD / PAIR.contact_modulus) ** (1 / 3)
    slip = 3 * FRICTION * LOAD / (16 * radius * PAIR.shear_modulus)

    def first(change):
        return np.sign(change) * slip * (1 - (1 - np.abs(change) / (FRICTION * LOAD)) ** (2 / 3))

    moved = first(load)
    for start, stop in itertools.pairwise([*turns, load.size - 1]):
        part = slice(start, stop + 1)
        moved[part] = moved[start] + 2 * first((load[part] - load[start]) / 2)
    return moved


@mark.parametrize("stiffness", [np.inf, 5e5])
def test_with_the_load_replayed_residuals_are_displacements(stiffness, tmp_path):
    load = (
        0.9
        * FRICTION
        * LOAD
        * np.interp(np.arange(601), [0, 60, 180, 300, 420, 540, 600], [0, 1, -1, 1, -1, 1, 0])
    )
    moved = mindlin_displacement(load, [60, 180, 300, 420, 540]) + load / stiffness
    error = 2e-10 * np.where(np.arange(601) % 2, 1, -1)
    error[0] = 0
    columns = {"tangential_displacement": None, "tangential_load": '"T"'}
    response = {"tangential_displacement": '{ column = "u", unit = "nm" }'}
    more = "" if np.isinf(stiffness) else f"[instrument]\nlateral_stiffness = {stiffness}\n"
    compared = hs.compare(
        write(tmp_path, moved + error, load, columns=columns, response=response, more=more)
    )
    assert_allclose(compared.displacement_difference, error, rtol=0, atol=1e-13)
    text = dict(compared.summary())["rms difference"]
    assert text.startswith("199.8 pm, ")
    assert "% of the range of the displacement" in text


def test_a_fit_and_the_comparison_of_its_scenario_print_one_number(tmp_path):
    """N and U vary together, each over many samples: the fit follows the record."""
    index = np.arange(TIME.size)
    normal, moved = (
        LOAD * (1 + 0.3 * np.sin(np.pi * index / 20)),
        60e-9 * np.sin(np.pi * index / 15),
    )
    noise = np.random.default_rng(1).normal(0, 2e-5, index.size)
    events = [
        (hs.NormalLoad(t, n), hs.TangentialDisplacement(t, u))
        for t, n, u in zip(TIME, normal, moved, strict=True)
    ]
    history = hs.replay(BODIES["sphere"], [event for pair in events for event in pair], hold=False)
    load = history.total_tangential_load.values + noise
    path = write(
        tmp_path,
        moved,
        load,
        normal,
        base=BALL.replace("0.2", "0.3"),
        more='[fit]\nparameters = ["friction"]\n',
    )
    found = hs.fit(path)
    found.write(tmp_path / "f.toml")
    rms = float(np.sqrt(np.mean(noise**2)))
    assert found.comparison.residuals.rms == approx(rms, rel=0.02)
    lines = (
        dict(found.summary())["rms difference"],
        dict(hs.compare(tmp_path / "f.toml").summary())["rms difference"],
    )
    assert lines[0] == lines[1]
    (friction,) = found.parameters
    assert friction.low <= FRICTION <= friction.high
    assert friction.low <= friction.noise_low
    assert friction.high >= friction.noise_high
