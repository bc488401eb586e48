"""Every numbered scenario runs, and numbers from it agree with closed forms that the engine does not use."""

import csv
import runpy
from pathlib import Path

import numpy as np
import pytest
from half_space import HalfSpace
from numpy.testing import assert_allclose
from pytest import approx, mark
from scipy import integrate, interpolate, optimize, stats
from yielding_springs import kogut_etsion

import historysim as hs
from historysim.results import analysis

ROOT = Path(__file__).parents[1]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))

# silicon on float glass, Table B.1 of the source
CONTACT_MODULUS = 1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)
SHEAR_MODULUS = 1 / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9)
RATIO = CONTACT_MODULUS / (4 * SHEAR_MODULUS)
FRICTION = 0.2
LEVELS = (50e-3, 70e-3, 90e-3)


INTERACTING = "16_full_interaction"


@pytest.fixture(scope="module")
def histories(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HISTORYSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        return {path.stem: hs.run(path) for path in SCENARIOS}


def summits():
    with (ROOT / "data" / "summits_200.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return np.array([float(row["height_nm"]) for row in rows]) * 1e-9, np.array(
        [float(row["radius_um"]) for row in rows]
    ) * 1e-6


def approaches(load, height=None, radius=None):
    """Approach and normal load of each summit under a total load, by bisection on Hertz's law."""
    if height is None:
        height, radius = summits()
    low, high = height.min() - 1e-6, height.max()
    for _ in range(200):
        middle = (low + high) / 2
        approach = np.maximum(height - middle, 0.0)
        loads = 4 / 3 * CONTACT_MODULUS * np.sqrt(radius) * approach**1.5
        low, high = (middle, high) if loads.sum() > load else (low, middle)
    return approach, loads


def nine_point_summits(heights, pixel, periodic):
    """Height and radius of the points above all eight neighbours, one by one."""
    count_x, count_y = heights.shape
    found = []
    for i in range(count_x):
        for j in range(count_y):
            if not periodic and (i in {0, count_x - 1} or j in {0, count_y - 1}):
                continue
            patch = heights[
                np.ix_([i - 1, i, (i + 1) % count_x], [j - 1, j, (j + 1) % count_y])
            ].ravel()
            around = np.delete(patch, 4)
            if (around < patch[4]).all():
                curvature = (4 * patch[4] - patch[[1, 3, 5, 7]].sum()) / (2 * pixel**2)
                found.append((patch[4], 1 / curvature))
    return np.array(found).T


def check_preliminary_displacement(history, load, height, radius, friction=FRICTION):
    approach, _ = approaches(load, height, radius)
    peak = int(history.total_normal_load.values.argmax())
    assert history.total_normal_load.values[peak] == approx(load, rel=1e-12)
    assert history.contact_count.values[peak] == np.count_nonzero(approach)
    found = analysis.preliminary_displacement(history).values[peak]
    assert found == approx(RATIO * friction * approach.max(), rel=1e-6)


def loop_energy(load, amplitude):
    """Energy of a closed loop ±amplitude in which every asperity ends in gross slip.

    Per asperity 4 μ N A, less 16/5 μ N δ_t,max for the two half cycles that begin with sticking.
    """
    approach, loads = approaches(load)
    return float(np.sum(FRICTION * loads * (4 * amplitude - 16 / 5 * RATIO * FRICTION * approach)))


def virgin(normal, tangential, radius=2.5e-3):
    """Tangential displacement of one asperity on first loading at constant normal load."""
    limit = FRICTION * normal
    contact_radius = (3 * normal * radius / (4 * CONTACT_MODULUS)) ** (1 / 3)
    full = 3 * limit / (16 * contact_radius * SHEAR_MODULUS)
    return full * (1 - (1 - tangential / limit) ** (2 / 3))


def at_time(history, time, name):
    return history[name].values[np.flatnonzero(np.isclose(history.time.values, time))[-1]]


def energy_between(history, start, end):
    return at_time(history, end, "total_dissipated_energy") - at_time(
        history, start, "total_dissipated_energy"
    )


def test_they_are_numbered():
    numbers = [
        path.name[:2]
        for path in sorted((ROOT / "scenarios").glob("[0-9]*.*"))
        if path.suffix in {".toml", ".py"}
    ]
    assert numbers == [f"{number:02}" for number in range(1, len(numbers) + 1)]


@mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_each_has_a_title_and_balances(path, histories):
    assert path.read_text(encoding="utf-8").startswith("# ")
    history = histories[path.stem]
    assert history.attrs["title"]
    force = history.tangential_load
    if "slope" in history.coords:
        force = (force + history.normal_load * history.slope) / np.hypot(1.0, history.slope)
    # a patch has its share of a table
    error = 1e-3 * float(history.friction_limit.max()) if path.stem == INTERACTING else 1e-14
    if "direction" in history.dims:
        # nodes that hardly matter, some 1e-5 each, are left out after a step: a tenth of the
        # tolerance of the load
        error = 1e-4 * float(history.friction_limit.max())
    assert force.sum("asperity").values == approx(history.total_tangential_load.values, abs=error)
    assert (np.diff(history.total_dissipated_energy) >= 0).all()


@mark.parametrize(
    "name, levels", [("01_load_steps_up", LEVELS), ("02_load_steps_down", LEVELS[::-1])]
)
def test_01_02_loops_at_each_load(histories, name, levels):
    history = histories[name]
    for turn, load in enumerate(levels):
        end = 66.0 * (turn + 1)
        approach, _ = approaches(load)
        # the last reading of a level carries the noise of the load, 6 µN
        assert at_time(history, end, "contact_count") == approx(np.count_nonzero(approach), abs=1)
        # the first of the four loops begins at another load, so the last three are compared
        assert energy_between(history, end - 48.0, end) == approx(
            3 * loop_energy(load, 100e-9), rel=0.01
        )
        plateau = np.abs(history.total_tangential_load.values[history.time.values < end]).max()
        assert plateau == approx(FRICTION * max(levels[: turn + 1]), rel=1e-3)
    approach, _ = approaches(90e-3)
    peak = int(history.total_normal_load.values.argmax())
    found = analysis.preliminary_displacement(history).values[peak]
    assert found == approx(RATIO * FRICTION * approach.max(), rel=1e-3)


def test_03_loops_at_constant_load_repeat(histories):
    history = histories["03_constant_load"]
    loops = [energy_between(history, 2.0 + 8.0 * loop, 10.0 + 8.0 * loop) for loop in range(5)]
    # where a loop is cut, the noise of 1 nm under gross slip is 10 pJ
    assert loops[1:] == approx([loop_energy(50e-3, 50e-9)] * 4, abs=5e-11)
    assert sum(loops[1:]) == approx(4 * loop_energy(50e-3, 50e-9), rel=0.01)
    assert loops[0] < loops[1]
    assert {0, 1, 2, 3} == set(np.unique(history.slip_state))


def test_04_both_rising_ends_in_the_virgin_state(histories):
    history = histories["04_normal_up_tangential_up"]
    assert at_time(history, 6.0, "tangential_displacement") == approx(virgin(70e-3, 5e-3), rel=1e-9)


def test_05_less_normal_load_is_virgin_loading_there(histories):
    history = histories["05_normal_down_tangential_up"]
    assert at_time(history, 6.0, "tangential_displacement") == approx(virgin(30e-3, 5e-3), rel=1e-9)


def test_06_a_fresh_edge_is_sheared_back(histories):
    # the new contact grows with dT = -μ dN, so U falls by θ μ times the growth of the approach
    approach = [
        (9 * load**2 / (16 * 2.5e-3 * CONTACT_MODULUS**2)) ** (1 / 3) for load in (50e-3, 70e-3)
    ]
    expected = virgin(50e-3, 5e-3) - RATIO * FRICTION * (approach[1] - approach[0])
    history = histories["06_normal_up_tangential_down"]
    assert at_time(history, 6.0, "tangential_displacement") == approx(expected, rel=1e-9)


def test_07_what_leaves_takes_its_share(histories):
    history = histories["07_normal_down_tangential_down"]
    assert at_time(history, 6.0, "tangential_displacement") == approx(virgin(30e-3, 1e-3), rel=1e-9)


def test_08_mixed_control(histories):
    history = histories["08_mixed_control"]
    assert analysis.critical_asperity(history).values[0] == 3
    assert at_time(history, 20.0, "separation") == approx(-50e-9, rel=1e-12)
    assert at_time(history, 20.0, "tangential_displacement") == approx(10e-9, rel=1e-12)
    assert at_time(history, 23.0, "total_tangential_load") == 0
    assert at_time(history, 23.0, "contact_count") == 0
    # at the lower coefficient all that touch slide at last
    assert at_time(history, 24.0, "total_tangential_load") == approx(0.1 * 40e-3, rel=1e-9)
    assert (history.slip_state.sel(asperity=4) == hs.SlipState.SEPARATED).all()


def test_09_loops_without_noise_take_the_closed_form_of_energy(histories):
    history = histories["09_loops_in_a_few_lines"]
    for turn, load in enumerate(LEVELS):
        approach, _ = approaches(load)
        for loop in range(4):
            start = 66.0 * turn + 2.0 + 16.0 * loop
            assert at_time(history, start, "contact_count") == np.count_nonzero(approach)
            if loop:
                energy = energy_between(history, start, start + 16.0)
                assert energy == approx(loop_energy(load, 100e-9), rel=1e-8)


def test_10_a_random_surface(histories):
    surface = hs.random_surface((256, 256), 1e-6, 100e-9, 20e-6, seed=1)
    assert np.sqrt(np.mean((surface.heights - surface.heights.mean()) ** 2)) == approx(
        100e-9, rel=1e-12
    )
    height, radius = nine_point_summits(surface.heights, 1e-6, periodic=True)
    history = histories["10_random_rough_surface"]
    check_preliminary_displacement(history, history.total_normal_load.values.max(), height, radius)


def test_11_a_measured_map_of_a_tilted_ball(histories):
    heights = np.genfromtxt(ROOT / "data" / "heights_128.txt").T * 1e-9
    present = np.isfinite(heights)
    assert 0.01 < 1 - present.mean() < 0.03
    x, y = np.meshgrid(*[1e-6 * np.arange(128)] * 2, indexing="ij")

    def misfit(unknowns):
        along, across, level, radius = unknowns
        return level + np.sqrt(radius**2 - (x - along) ** 2 - (y - across) ** 2) - radius - heights

    start = [64e-6, 64e-6, 0.0, 2e-3]
    found = optimize.least_squares(
        lambda unknowns: misfit(unknowns)[present],
        start,
        x_scale=[1e-6, 1e-6, 1e-7, 1e-3],
        xtol=1e-14,
    )
    assert found.x[3] == approx(2.5e-3, rel=0.05)
    height, radius = nine_point_summits(-misfit(found.x), 1e-6, periodic=False)
    check_preliminary_displacement(
        histories["11_measured_map"], 60e-3, height, radius, friction=0.15
    )


def test_12_a_texture_has_the_contact_area_of_the_one_ball(histories):
    history = histories["12_textured_surface"]
    approach = (9 * 50e-3**2 / (16 * 2.5e-3 * CONTACT_MODULUS**2)) ** (1 / 3)
    assert history.real_contact_area.values[-1] == approx(np.pi * 2.5e-3 * approach, rel=1e-9)
    found = analysis.preliminary_displacement(history).values[-1]
    assert found == approx(RATIO * FRICTION * approach / 8, rel=1e-9)
    # a loop of ±T takes 8 (T U/2 - ∫ U dT) of the virgin curve U = θ μ δ (1 - (1 - t)^(2/3)), t =
    # T/(μ N)
    limit, share = FRICTION * 50e-3, 0.8
    integral = limit * found * (share + 3 / 5 * ((1 - share) ** (5 / 3) - 1))
    turn = found * (1 - (1 - share) ** (2 / 3))
    expected = 8 * (share * limit * turn / 2 - integral)
    assert energy_between(history, 1.0, 5.0) == approx(expected, rel=1e-9)


def test_13_quantiles_are_greenwood_and_williamson(histories):
    history = histories["13_height_statistics"]
    count, deviation, radius = 10_000, 100e-9, 20e-6

    def load(separation):
        density = stats.norm(scale=deviation)
        mean, _ = integrate.quad(
            lambda z: (z - separation) ** 1.5 * density.pdf(z),
            separation,
            8 * deviation,
            epsabs=0,
            epsrel=1e-10,
        )
        return count * 4 / 3 * CONTACT_MODULUS * np.sqrt(radius) * mean

    separation = optimize.brentq(lambda d: load(d) - 1.0, 0, 3 * deviation)
    # the summits above a flat at 1.8 σ are some hundreds, so that quantiles leave an error of some
    # thousandths
    assert history.separation.values[-1] == approx(separation, abs=0.01 * deviation)
    assert history.contact_count.values[-1] == approx(
        count * stats.norm.sf(separation / deviation), rel=0.01
    )
    assert history.total_tangential_load.values[-1] == approx(FRICTION, rel=1e-12)


def test_14_two_rough_surfaces_are_their_sum(histories):
    first = hs.random_surface((256, 256), 1e-6, 80e-9, (60e-6, 15e-6), seed=7).heights
    second = hs.random_surface((400, 400), 1e-6, 60e-9, 20e-6, seed=8).heights
    x, y = np.meshgrid(*[np.arange(256) - 127.5] * 2, indexing="ij")
    x, y = x - 10, y + 5
    cosine, sine = np.cos(np.pi / 6), np.sin(np.pi / 6)
    spline = interpolate.RectBivariateSpline(*[np.arange(400) - 199.5] * 2, second)
    heights = first + spline(cosine * x + sine * y, cosine * y - sine * x, grid=False)
    height, radius = nine_point_summits(heights, 1e-6, periodic=False)
    check_preliminary_displacement(histories["14_rough_on_rough"], 80e-3, height, radius)


def test_15_the_drives_loops_agree_with_a_ball_behind_a_spring(histories):
    history = histories["15_instrument_in_series"]
    stiffness, limit = 334e3, FRICTION * 30e-3
    drive, force = history.drive_displacement.values, history.total_tangential_load.values
    assert_allclose(
        drive, history.tangential_displacement.values + force / stiffness, rtol=0, atol=1e-18
    )
    # the first reversal, at 14 s and 300 nm, ends gross slip under 30 mN; noise moves the turning
    # points by some nm
    turn = int(np.flatnonzero(history.time.values <= 14.0)[-1])
    assert force[turn] == approx(limit, rel=1e-3)
    approach = (9 * 30e-3**2 / (16 * 2.5e-3 * CONTACT_MODULUS**2)) ** (1 / 3)
    down = np.flatnonzero(
        (history.time.values > 14.0) & (history.time.values < 38.0) & (np.abs(force) < 0.9 * limit)
    )
    share = (limit - force[down]) / (2 * limit)
    contact = drive[turn] - 2 * RATIO * FRICTION * approach * (1 - (1 - share) ** (2 / 3))
    # on the way down, by Masing's rule, behind the spring; the waypoints' normal load is noisy by
    # nothing
    assert_allclose(drive[down], contact - (limit - force[down]) / stiffness, rtol=0, atol=1e-12)


def test_16_whatever_presses_on_one_another_slides_as_a_front_of_normal_loads(histories):
    history = histories[INTERACTING]
    surface = hs.random_surface((128, 128), 1e-6, 0.1e-6, 20e-6, seed=1, autocorrelation="gaussian")
    brute = HalfSpace(surface.heights * 1e6, 128.0)
    row = history.sel(step=10)
    approach = (surface.heights.max() - float(row["separation"])) * 1e6
    moved = float(row["tangential_displacement"]) * 1e6
    # T = μ [P(d) - P(d - U/(θμ))]: the stick zone is the contact under a lighter load
    pressure = brute.pressure(approach, np.zeros(surface.shape), 1e-5)
    assert pressure.sum() * 1e-12 * CONTACT_MODULUS == approx(0.3, rel=2e-3)
    assert (pressure > 0).sum() * 1e-12 == approx(float(row["real_contact_area"]), rel=2e-2)
    inner = brute.pressure(approach - moved / (RATIO * FRICTION), pressure, 1e-5)
    assert inner.sum() * 1e-12 * CONTACT_MODULUS == approx(0.3 - 0.05 / FRICTION, rel=2e-2)
    assert (inner > 0).sum() * 1e-12 == approx(float(row["stick_area"].sum()), rel=0.1)
    assert 4 < history.sizes["asperity"] < 10


def test_24_loops_at_three_loads_of_a_second_instrument(histories):
    history = histories["24_second_instrument"]
    table = hs.loops(history).by_load()
    assert_allclose(table.value, [30e-3, 60e-3, 90e-3], rtol=1e-3)
    assert [members.size for members in table.members] == [4, 4, 4]
    line = table.friction_line()
    assert line.slope == approx(0.12, rel=1e-3)
    assert line.intercept == approx(0, abs=8e-6)
    peak = int(history.total_normal_load.values.argmax())
    approach, _ = approaches(float(history.total_normal_load[peak]))
    assert analysis.preliminary_displacement(history).values[peak] == approx(
        RATIO * 0.12 * approach.max()
    )


def test_25_wear_shares_the_load_and_the_displacement_drifts(histories):
    """Archard: all four slide under the whole load together, each loses K N s/H, and the unevenness falls."""
    history = histories["25_wear"].isel(step=slice(None, None, 25))
    slid, worn = history.slid_distance.values[-1], history.worn_volume.values[-1]
    displacement = analysis.preliminary_displacement(history).values
    # the last to slide sticks for δ on the first branch and for 2 δ on the five others
    assert 1.2e-6 - slid[0] == approx(11 * displacement.mean(), rel=0.02)
    assert 1e-3 * 2e-3 * slid.min() / 12e9 <= worn.sum() <= 1e-3 * 2e-3 * slid.max() / 12e9
    lost = history.summit_height.values - history.present_summit_height.values[-1]
    assert lost == approx(np.sqrt(worn / (np.pi * 10e-6)), rel=2e-3)
    assert (np.diff(lost) < 0).all()
    assert (np.diff(displacement) < 0).all()
    assert (np.diff(np.ptp(history.normal_load.values, axis=1)) < 0).all()


def test_26_a_surface_that_was_run_in_displaces_less(histories):
    """First loading is the law's sum over the virgin summits; unloading is Hertz's over those that 90 mN has left."""
    history = histories["26_running_in"]
    ensemble = hs.load(next(path for path in SCENARIOS if path.stem == "26_running_in")).ensemble()
    height, radius, hardness = ensemble.summit_height, ensemble.summit_radius, 5.9e9
    peak = (0.454 + 0.41 * 0.2) * hardness
    critical = (np.pi * peak / (2 * CONTACT_MODULUS)) ** 2 * radius
    unit = 4 / 3 * CONTACT_MODULUS * np.sqrt(radius) * critical**1.5

    def first_loading(level):
        load, area = kogut_etsion((height - level) / critical, 1.5 * hardness / peak)
        return load * unit, np.sqrt(area * radius * critical)

    def level_at(load, of):
        return optimize.brentq(
            lambda level: of(level).sum() - load, height.max() - 2e-6, height.max()
        )

    displacement = analysis.preliminary_displacement(history).values
    time, energy = history.time.values, history.total_yielding_energy.values
    for load, when in ((50e-3, 1.0), (70e-3, 5.0), (90e-3, 8.0)):
        level = level_at(load, lambda level: first_loading(level)[0])
        carried, contact = first_loading(level)
        left = 0.75 * carried / (CONTACT_MODULUS * np.maximum(contact, 1e-30))
        row = int(np.argmin(np.abs(time - when)))
        assert displacement[row] == approx(RATIO * FRICTION * left.max(), rel=1e-6)
    touched = carried > 0
    own = np.where(touched, left, 1e-12)
    lowered = np.where(touched, height - level - own, 0.0)
    flattened = np.where(touched, contact**2 / own, radius)

    def unloading(level):
        approach = np.maximum(height - lowered - level, 0.0)
        return 4 / 3 * CONTACT_MODULUS * np.sqrt(flattened) * approach**1.5

    level = level_at(50e-3, unloading)
    assert displacement[-1] == approx(RATIO * FRICTION * (height - lowered - level).max(), rel=1e-6)
    assert displacement[-1] < 0.95 * displacement[np.argmin(np.abs(time - 1.0))]
    assert (energy[time > 8.0] == energy[-1]).all()
    assert (np.diff(energy) >= 0).all()
    # the reversals with tractions in them did not come through unstrained
    assert float(history.total_dissipated_energy[-1]) > 0
    assert float(history.yielded_load_share[-1]) > 0.95


def test_29_slopes_make_a_loop_that_is_not_symmetric(histories):
    history = histories["29_summits_that_meet"]
    load, slope = history.normal_load.values, history.slope.values
    uphill, downhill = (int(np.flatnonzero(history.time.values == time)[0]) for time in (1.0, 3.0))
    for step, way in ((uphill, 1), (downhill, -1)):
        # all of them slide
        angle = np.arctan(slope)
        expected = load[step] * (way * FRICTION * np.cos(angle) + np.sin(angle))
        assert float(history.total_tangential_load[step]) == approx(expected.sum(), rel=1e-9)
        carried = load[step] * (np.cos(angle) - way * FRICTION * np.sin(angle))
        assert carried.sum() == approx(4e-3, rel=1e-9)
    limits = history.total_tangential_load.values[[uphill, downhill]]
    assert limits == approx([867.4e-6, -747.2e-6], rel=1e-3)
    assert float(history.separation[uphill] - history.separation[downhill]) == approx(
        1.77e-9, rel=0.01
    )


@mark.ci
def test_the_data_are_made_again_byte_for_byte(tmp_path):
    for name in ("make_sequences.py", "make_heights.py", "make_loops.py"):
        script = tmp_path / name
        script.write_bytes((ROOT / "data" / name).read_bytes())
        runpy.run_path(str(script), run_name="__main__")
    made = {
        path.name: path.read_bytes()
        for path in tmp_path.iterdir()
        if path.suffix in {".csv", ".txt"}
    }
    kept = {
        path.name: path.read_bytes()
        for path in (ROOT / "data").iterdir()
        if path.suffix in {".csv", ".txt"}
    }
    assert made == kept
    assert all(len(content) < 400_000 for content in made.values())


def test_28_a_stage_drifts_to_where_less_load_would_have_let_it(histories):
    """T = μ [P(d) - P(d + U/(θμ))]: the places of 8 mN under 100 and 65 mN, by bisection."""
    history = histories["28_drift_of_a_stage"]
    ensemble = hs.load(
        next(path for path in SCENARIOS if path.stem == "28_drift_of_a_stage")
    ).ensemble()
    height, radius = (
        ensemble.summit_height,
        np.broadcast_to(ensemble.summit_radius, ensemble.summit_height.shape),
    )
    moved = []
    for load in (0.1, 0.065):
        (whole, _), (stuck, _) = (
            approaches(part, height, radius) for part in (load, load - 8e-3 / FRICTION)
        )
        moved.append(RATIO * FRICTION * (whole.max() - stuck.max()))
    ends = history.tangential_displacement.to_numpy()[::20]
    # moved, held, unloaded, loaded, unloaded, loaded
    assert_allclose(ends[1:], np.repeat(moved, [2, 4]), rtol=1e-9)


def test_34_a_cylinder_slides_at_two_loads_and_sticks_at_the_third(histories):
    """Energy of a cycle of ±u at a constant load: the virgin curve doubled, and what slides beyond it."""
    history, reach, radius, length, depth, friction = (
        histories["34_fretting_cylinder"],
        1.9e-6,
        10e-3,
        5e-3,
        10e-3,
        0.5,
    )
    modulus = 210e9 / (2 * (1 - 0.3**2))

    def approach(load):
        per_length = np.maximum(load, 1e-300) / length
        width = np.sqrt(4 * per_length * radius / (np.pi * modulus))
        return 2 / (np.pi * modulus) * per_length * (np.log(2 * depth / width) + 0.5)

    for level, (load, slides) in enumerate([(250.0, True), (500.0, True), (750.0, False)]):

        def displacement(force, load=load):
            return friction * (approach(load) - approach(load - force / friction))

        limit = friction * load
        assert (displacement(limit) < reach) == slides
        force = (
            limit
            if slides
            else optimize.brentq(lambda force, u=displacement: u(force) - reach, 0, limit)
        )
        rise = integrate.quad(displacement, 0, force, epsrel=1e-10)[0]
        energy = (
            4 * force * displacement(force) - 8 * rise + 4 * force * (reach - displacement(force))
        )
        start = 13.0 * level + 5.0
        assert energy_between(history, start, start + 4.0) == approx(energy, rel=1e-6)
        widths = history.contact_half_width, history.stick_half_width
        contact, stick = (
            float(width.sel(step=history.time == start + 1.0)[0, 0]) for width in widths
        )
        assert (stick == 0) == slides
        assert contact == approx(np.sqrt(4 * load * radius / (np.pi * modulus * length)), rel=1e-12)
