import numpy as np
from pytest import mark

import historysim as hs
from historysim.basics.library import lib
from historysim.memory.paths import Goals, blank_rows, straight_paths

PAIR = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1e10)


def recorded_and_read(ensemble, targets):
    """Rows recorded along all paths, and rows read from the state after each path."""
    approach, displacement = np.array(targets).T
    paths = straight_paths(Goals(lib.HS_DISPLACED, approach), Goals(lib.HS_DISPLACED, displacement))
    everyone = np.arange(ensemble.elements)
    rows, read = blank_rows(paths.size, everyone.size), blank_rows(paths.size, everyone.size)
    state = ensemble.initial_state()
    ensemble.advance_along(state, paths, rows=rows, asperities=everyone)
    for row in range(paths.size):
        state = ensemble.advance_along(state, paths[row : row + 1])
        assert lib.hs_read(state.memory, read.as_struct(everyone), row) == lib.HS_OK
    return rows, read


@mark.parametrize("friction", [0.3, [0.2, 0.4]])
@mark.parametrize("seed", range(2))
def test_a_row_does_not_depend_on_the_rows_before(friction, seed):
    # deep loops, loops that are wiped out, the approach held and moved, lift-off and new touch
    random = np.random.default_rng(seed)
    height, radius = -np.abs(random.normal(0.0, 20e-9, 40)), random.uniform(1e-6, 2e-6, 40)
    ensemble = hs.Ensemble(PAIR, height, radius, np.resize(friction, 40))
    targets, place = [], (40e-9, 0.0)
    for turn in range(60):
        amplitude = 10e-9 * (1.0 - turn / 80.0) * random.choice([1.0, 1.0, 1.0, 0.3, 1.6])
        approach = random.choice([place[0]] * 4 + [random.uniform(-5e-9, 60e-9)])
        targets += list(np.linspace(place, (approach, amplitude * (-1) ** turn), 4)[1:])
        place = targets[-1]
    rows, read = recorded_and_read(ensemble, targets)
    for name, recorded in rows.each.items():
        assert recorded.tobytes() == read.each[name].tobytes(), name
    assert rows.totals.tobytes() == read.totals.tobytes()
    assert rows.slip_state.min() == 0


@mark.parametrize("friction", ["one", "own"])
def test_rows_do_not_depend_on_the_order_of_asperities(friction):
    """Of asperities in any order, sorted, or a few of them, some twice: over several calls, as chunks of a file are."""
    random, count = np.random.default_rng(7), 700
    height, radius = -np.abs(random.normal(0.0, 20e-9, count)), random.uniform(1e-6, 2e-6, count)
    coefficient = np.full(count, 0.3) if friction == "one" else random.uniform(0.2, 0.4, count)
    rank = np.argsort(-height, kind="stable")
    targets = np.column_stack(
        [random.choice([40e-9, 41e-9], 24), random.uniform(-15e-9, 15e-9, 24)]
    )
    tables = []
    for order, columns in (
        (np.arange(count), np.arange(count)),
        (rank, np.argsort(rank)),
        (np.arange(count), np.repeat(random.permutation(count)[:40], 2)),
    ):
        ensemble = hs.Ensemble(PAIR, height[order], radius[order], coefficient[order])
        state, parts = ensemble.initial_state(), []
        for part in np.split(targets, 3):
            paths = straight_paths(
                Goals(lib.HS_DISPLACED, part[:, 0]), Goals(lib.HS_DISPLACED, part[:, 1])
            )
            rows = blank_rows(paths.size, columns.size)
            state = ensemble.advance_along(state, paths, rows=rows, asperities=columns)
            parts.append(rows.each)
        tables.append(
            (columns, {name: np.concatenate([each[name] for each in parts]) for name in parts[0]})
        )
    (_, every), (_, ranked), (few, chosen) = tables
    for name, values in every.items():
        assert values.tobytes() == ranked[name].tobytes(), name
        assert values[:, few].tobytes() == chosen[name].tobytes(), name
    assert np.count_nonzero(every["dissipated_energy"]) > 1000


def test_traction_ratio_of_deep_stacks_is_the_largest_of_dense_samples():
    # reversals that stay, then friction that falls: slopes beyond the cone at hundreds of vertices
    random = np.random.default_rng(3)
    ensemble = hs.Ensemble(PAIR, 0.0, 1e-3, 0.5)
    state = ensemble.advance(ensemble.initial_state(), normal_displacement=60e-9)
    for turn in range(200):
        shrunk = (1.0 - turn / 210.0) * random.uniform(0.999, 1.0)
        state = ensemble.advance(state, tangential_displacement=(-1) ** turn * 10e-9 * shrunk)
    state = ensemble.with_friction(state, 0.3)
    stack, read = state.vertices(), blank_rows(1, None)
    assert lib.hs_read(state.memory, read.as_struct(np.arange(0)), 0) == lib.HS_OK
    label, slope = stack["label"], stack["slope"]
    assert label.size > 150
    below = label[1:, None] - (np.linspace(1e-3, 1.0, 100) ** 2 * np.diff(label)[:, None])
    roots = np.sqrt(np.maximum(label - below[..., None], 0.0))
    ratio = np.abs((slope[1:] * np.diff(roots)).sum(axis=-1)) / (0.3 * roots[..., -1])
    assert ratio.max() > 1.02
    np.testing.assert_allclose(read.totals["traction_ratio"], ratio.max(), rtol=2e-4)
