"""Every numbered scenario runs, and numbers from it agree with closed forms that the engine does not use."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import historysim as hs
from historysim import analysis

ROOT = Path(__file__).parents[1]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))

# silicon on float glass, Table B.1 of the source
CONTACT_MODULUS = 1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)
SHEAR_MODULUS = 1 / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9)
RATIO = CONTACT_MODULUS / (4 * SHEAR_MODULUS)
FRICTION = 0.2
LEVELS = (50e-3, 70e-3, 90e-3)


@pytest.fixture(scope="module")
def histories():
    return {path.stem: hs.run(path) for path in SCENARIOS}


def summits():
    with (ROOT / "data" / "summits_200.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return np.array([float(row["height_nm"]) for row in rows]) * 1e-9, np.array(
        [float(row["radius_um"]) for row in rows]
    ) * 1e-6


def approaches(load):
    """Approach and normal load of each summit under a total load, by bisection on Hertz's law."""
    height, radius = summits()
    low, high = height.min() - 1e-6, height.max()
    for _ in range(200):
        middle = (low + high) / 2
        approach = np.maximum(height - middle, 0.0)
        loads = 4 / 3 * CONTACT_MODULUS * np.sqrt(radius) * approach**1.5
        low, high = (middle, high) if loads.sum() > load else (low, middle)
    return approach, loads


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
    return at_time(history, end, "total_dissipated_energy") - at_time(history, start, "total_dissipated_energy")


def test_they_are_numbered():
    assert [path.stem[:2] for path in SCENARIOS] == [f"{number:02}" for number in range(1, len(SCENARIOS) + 1)]


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_each_says_what_it_shows_and_balances(path, histories):
    assert path.read_text(encoding="utf-8").startswith("# ")
    history = histories[path.stem]
    assert history.attrs["title"]
    force = history.tangential_load
    assert force.sum("asperity").values == pytest.approx(history.total_tangential_load.values, abs=1e-14)
    assert (np.diff(history.total_dissipated_energy) >= 0).all()


@pytest.mark.parametrize(("name", "levels"), [("01_load_steps_up", LEVELS), ("02_load_steps_down", LEVELS[::-1])])
def test_01_02_loops_at_each_load(histories, name, levels):
    history = histories[name]
    for turn, load in enumerate(levels):
        end = 66.0 * (turn + 1)
        approach, _ = approaches(load)
        # the last reading of a level carries the noise of the load, 6 µN
        assert at_time(history, end, "contact_count") == pytest.approx(np.count_nonzero(approach), abs=1)
        # the first of the four loops begins at another load, so the last three are compared
        assert energy_between(history, end - 48.0, end) == pytest.approx(3 * loop_energy(load, 100e-9), rel=0.01)
        plateau = np.abs(history.total_tangential_load.values[history.time.values < end]).max()
        assert plateau == pytest.approx(FRICTION * max(levels[: turn + 1]), rel=1e-3)
    approach, _ = approaches(90e-3)
    peak = int(history.total_normal_load.values.argmax())
    found = analysis.preliminary_displacement(history).values[peak]
    assert found == pytest.approx(RATIO * FRICTION * approach.max(), rel=1e-3)


def test_03_loops_at_constant_load_repeat(histories):
    history = histories["03_constant_load"]
    loops = [energy_between(history, 2.0 + 8.0 * loop, 10.0 + 8.0 * loop) for loop in range(5)]
    # where a loop is cut, the noise of 1 nm under gross slip is 10 pJ
    assert loops[1:] == pytest.approx([loop_energy(50e-3, 50e-9)] * 4, abs=5e-11)
    assert sum(loops[1:]) == pytest.approx(4 * loop_energy(50e-3, 50e-9), rel=0.01)
    assert loops[0] < loops[1]
    assert {0, 1, 2, 3} == set(np.unique(history.slip_state))


def test_04_both_rising_ends_in_the_virgin_state(histories):
    history = histories["04_normal_up_tangential_up"]
    assert at_time(history, 6.0, "tangential_displacement") == pytest.approx(virgin(70e-3, 5e-3), rel=1e-9)


def test_05_less_normal_load_is_virgin_loading_there(histories):
    history = histories["05_normal_down_tangential_up"]
    assert at_time(history, 6.0, "tangential_displacement") == pytest.approx(virgin(30e-3, 5e-3), rel=1e-9)


def test_06_a_fresh_edge_is_sheared_back(histories):
    # the new contact grows with dT = -μ dN, so U falls by θ μ times the growth of the approach
    approach = [(9 * load**2 / (16 * 2.5e-3 * CONTACT_MODULUS**2)) ** (1 / 3) for load in (50e-3, 70e-3)]
    expected = virgin(50e-3, 5e-3) - RATIO * FRICTION * (approach[1] - approach[0])
    history = histories["06_normal_up_tangential_down"]
    assert at_time(history, 6.0, "tangential_displacement") == pytest.approx(expected, rel=1e-9)


def test_07_what_leaves_takes_its_share(histories):
    history = histories["07_normal_down_tangential_down"]
    assert at_time(history, 6.0, "tangential_displacement") == pytest.approx(virgin(30e-3, 1e-3), rel=1e-9)


def test_04_to_07_the_second_round_repeats_the_first(histories):
    for name in (path.stem for path in SCENARIOS[3:7]):
        history = histories[name]
        first, second = (at_time(history, time, "tangential_displacement") for time in (8.0, 12.0))
        assert second == pytest.approx(first, rel=1e-9)


def test_08_mixed_control(histories):
    history = histories["08_mixed_control"]
    assert analysis.critical_asperity(history).values[0] == 3
    assert at_time(history, 20.0, "separation") == pytest.approx(-50e-9, rel=1e-12)
    assert at_time(history, 20.0, "tangential_displacement") == pytest.approx(10e-9, rel=1e-12)
    assert at_time(history, 23.0, "total_tangential_load") == 0
    assert at_time(history, 23.0, "contact_count") == 0
    # at the lower coefficient all that touch slide at last
    assert at_time(history, 24.0, "total_tangential_load") == pytest.approx(0.1 * 40e-3, rel=1e-9)
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
                assert energy == pytest.approx(loop_energy(load, 100e-9), rel=1e-8)


def test_the_data_are_made_again_byte_for_byte(tmp_path):
    script = tmp_path / "make_sequences.py"
    script.write_bytes((ROOT / "data" / "make_sequences.py").read_bytes())
    subprocess.run([sys.executable, script], check=True, capture_output=True)
    made = {path.name: path.read_bytes() for path in tmp_path.glob("*.csv")}
    assert made == {path.name: path.read_bytes() for path in (ROOT / "data").glob("*.csv")}
    assert all(len(content) < 300_000 for content in made.values())
