"""What prepares a height map, as keys of ``[surface]``, and what is told of it and of the contact that it makes."""

import numpy as np
from pytest import fixture, mark
from sections import LINES, ROUGH, loaded, write_files

import historysim as hs
from historysim.results import analysis
from historysim.scenario.scenario_summary import summary
from historysim.surfaces.filters import outliers, spikes
from historysim.surfaces.random import random_surface

RANDOM = {
    "kind": "random",
    **ROUGH,
    "shape": [64, 64],
    "pixel_size": 1e-6,
    "autocorrelation_length": 8e-6,
}
PRESSED = LINES.replace("= 1e9", "= 50e9").replace("normal_load = 0", "normal_load = 0.02")
MAP = {"kind": "measured", "file": "map.npy", "pixel_size": 1e-6, "height_unit": "m"}


@fixture
def measured():
    """Roughness on a cubic form, with spikes, dirt and a hole."""
    surface = random_surface((64, 50), 1e-6, 1e-8, 8e-6, seed=1)
    x = np.linspace(-1, 1, 64)[:, None]
    heights = surface.heights + 2e-7 * x**3 + 1e-7 * x
    heights[[5, 30], [7, 40]] += 2e-6
    heights[50:55, 20:25] += 1e-6
    heights[20:24, 10:20] = np.nan
    return hs.Surface(heights, 1e-6)


@fixture
def folder(tmp_path, measured):
    write_files(tmp_path)
    np.save(tmp_path / "map.npy", measured.heights)
    return tmp_path


def same(found, surface, **options):
    summits = surface.summits(9, **options)
    assert found.surface.heights.tobytes() == surface.heights.tobytes()
    assert found.surface.pixel_size == surface.pixel_size
    assert found.summits.height.tobytes() == summits.height.tobytes()
    assert found.summits.radius.tobytes() == summits.radius.tobytes()


@mark.parametrize(
    "keys, by_functions",
    [
        ({"crop_x": ["10 µm", 40e-6]}, lambda s: s.cropped(x=(10e-6, 40e-6)).detrended()),
        ({"form": "polynomial", "degree": 3}, lambda s: s.detrended("polynomial", 3)),
        ({"spikes": 8}, lambda s: s.without(spikes(s.heights, 8)).detrended()),
        ({"outliers": 6}, lambda s: s.detrended().without(outliers(s.detrended().heights, 6))),
        ({"s_filter": "4 µm"}, lambda s: s.detrended().smoothed(4e-6)),
        (
            {
                "s_filter": 4e-6,
                "l_filter": 20e-6,
                "resolution": 2e-6,
                "rms_height": 1e-7,
                "mirrored": True,
            },
            lambda s: (
                s.detrended()
                .smoothed(4e-6)
                .at_resolution(2e-6)
                .roughness(20e-6)
                .scaled(1e-7)
                .mirrored()
            ),
        ),
    ],
    ids=lambda value: "" if callable(value) else ",".join(value),
)
def test_a_key_equals_its_function_bit_for_bit(folder, measured, keys, by_functions):
    same(loaded(folder, {**MAP, **keys}).surface(), by_functions(measured))


@mark.parametrize("prune, share", [(True, 0.05), (0.2, 0.2), (False, 0.0), (0, 0.0)])
def test_summits_are_pruned_by_a_share_of_the_height_range(folder, prune, share):
    surface = random_surface(**{key: value for key, value in RANDOM.items() if key != "kind"})
    found = loaded(folder, {**RANDOM, "prune": prune}).surface()
    same(found, surface, prominence=share * surface.statistics().height_range)
    assert (len(found.summits) < len(surface.summits(9))) == (share > 0)


def test_random_maps_and_sums_are_filtered_too(folder):
    surface = random_surface(**{key: value for key, value in RANDOM.items() if key != "kind"})
    same(loaded(folder, {**RANDOM, "s_filter": "3 µm"}).surface(), surface.smoothed(3e-6))
    entry = {
        "kind": "sum",
        "first": RANDOM,
        "second": {**RANDOM, "s_filter": "3 µm"},
        "l_filter": "30 µm",
    }
    same(loaded(folder, entry).surface(), (surface + surface.smoothed(3e-6)).roughness(30e-6))


def test_steps_too_coarse_for_radii_are_reported_and_a_filter_mends_it(folder):
    heights = random_surface(
        (64, 64), 1e-6, 1e-8, 20e-6, seed=2, autocorrelation="gaussian"
    ).heights
    step = 2e-9
    np.save(folder / "map.npy", np.rint(heights / step) * step)
    (notice,) = loaded(folder, MAP).surface().notices
    assert "heights come in steps of 2 nm" in notice
    assert loaded(folder, {**MAP, "s_filter": "4 µm"}).surface().notices == ()
    np.save(folder / "map.npy", heights)
    assert loaded(folder, MAP).surface().notices == ()


def test_a_scratch_whose_edge_carries_all_is_reported_and_spikes_mend_it(folder):
    surface = random_surface((128, 128), 1e-6, 1e-8, 8e-6, seed=3)
    heights = surface.heights.copy()
    heights[[40, 90], [40, 90]] += 2e-6
    np.save(folder / "map.npy", heights)
    names = [
        finding.name for finding in analysis.validity(hs.run(loaded(folder, MAP, PRESSED).path))
    ]
    assert "outliers" in names
    told = [text for label, text in summary(loaded(folder, MAP, PRESSED)) if label == "warning"]
    assert any(text.startswith("2 summits of ") for text in told)
    mended = analysis.validity(hs.run(loaded(folder, {**MAP, "spikes": 10}, PRESSED).path))
    assert "outliers" not in [finding.name for finding in mended]


def test_a_result_its_log_and_the_scenario_have_the_same_findings(folder, tmp_path):
    entry = {**RANDOM, "rms_height": 1e-6}
    path = loaded(folder, entry, PRESSED).path
    found = analysis.validity(hs.run(path))
    with hs.run(path, tmp_path / "out.nc") as written:
        assert analysis.validity(written) == found
        lines = analysis.summary(written)
    with hs.run(tmp_path / "out.history", tmp_path / "again.nc") as again:
        assert analysis.validity(again) == found
    warnings = [text for label, text in lines if label == "warning"]
    assert warnings == [
        text for label, text in summary(loaded(folder, entry, PRESSED)) if label == "warning"
    ]
    assert warnings == [finding.text for finding in found]
    assert "steep" in [finding.name for finding in found]


def test_statistics_are_told_before_and_after(folder):
    told = dict(summary(loaded(folder, {**MAP, "s_filter": "4 µm", "prune": True})))
    plain = loaded(folder, MAP).surface()
    assert f"{len(plain.summits):,} summits" in told["map as it comes"]
    after = loaded(folder, {**MAP, "s_filter": "4 µm", "prune": True}).surface()
    assert f"{len(after.summits):,} summits" in told["map as prepared"]
    assert "map as prepared" not in dict(summary(loaded(folder, MAP)))
