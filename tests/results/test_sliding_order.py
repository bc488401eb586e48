"""At which displacement the k-th asperity slides: instants of a replay, Greenwood and Williamson, equal asperities."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import historysim as hs
from historysim.errors import InputError

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
PRESSED = hs.NormalLoad(0.0, 0.1)


def test_the_order_agrees_with_the_instants_of_sliding():
    """A displacement that grows evenly from rest, whose instants the core notes."""
    rng = np.random.default_rng(1)
    ensemble = hs.Ensemble(
        PAIR, rng.normal(0, 50e-9, 30), rng.uniform(5e-6, 20e-6, 30), rng.uniform(0.1, 0.3, 30)
    )
    events = [PRESSED, hs.TangentialDisplacement(0.0, 0.0), hs.TangentialDisplacement(1.0, 1e-6)]
    history = hs.replay(ensemble, events, substeps=10)
    found = history.contact.sliding_displacements()
    slides = history["slide_time"].sel(asperity=found["asperity"]).to_numpy() * 1e-6
    assert found.sizes["rank"] > 5
    assert_allclose(found["displacement"], slides, rtol=1e-9)
    assert (
        found["displacement"].to_numpy()[-1]
        == history.contact.preliminary_displacement().to_numpy()[-1]
    )
    assert int(found["asperity"][-1]) == int(history.contact.critical_asperity()[-1])


def test_many_gaussian_summits_slide_as_greenwood_and_williamson_have_it():
    heights = np.random.default_rng(2).normal(0, 50e-9, 40_000)
    history = hs.replay(hs.Ensemble(PAIR, heights, 5e-6, 0.2), [hs.NormalLoad(0.0, 10.0)])
    found = history.contact.sliding_displacements()
    part = slice(found.sizes["rank"] // 20, -found.sizes["rank"] // 20)
    assert found.sizes["rank"] > 5000
    assert_allclose(found["greenwood_williamson"][part], found["displacement"][part], rtol=0.08)


def test_equal_asperities_share_the_load():
    history = hs.replay(hs.Ensemble(PAIR, np.zeros(64), 5e-7, 0.5), [hs.NormalLoad(0.0, 1e-2)])
    found = history.contact.sliding_displacements()
    assert_allclose(found["displacement"], found.attrs["equal_asperities"], rtol=1e-9)
    assert "greenwood_williamson" not in found


def test_surfaces_are_drawn_with_their_spread():
    def pressed(seed):
        heights = np.random.default_rng(seed).normal(0, 50e-9, 200)
        return hs.replay(hs.Ensemble(PAIR, heights, 5e-6, 0.2), [PRESSED])

    axes = hs.plot(pressed(0), picture="sliding-order").axes[0]
    assert [line.get_label() for line in axes.lines][1:] == [
        "Greenwood and Williamson",
        "equal asperities",
    ]
    several = hs.plot([pressed(seed) for seed in range(3)], picture="sliding-order").axes[0]
    assert several.lines[0].get_label() == "median of 3 surfaces"
    lifted = hs.replay(
        hs.Ensemble(PAIR, [0.0, -1e-8], 5e-6, 0.2), [PRESSED, hs.NormalLoad(1.0, 0.0)]
    )
    assert not lifted.contact.sliding_displacements().sizes["rank"]
    with pytest.raises(InputError, match="nothing touches at that step"):
        hs.plot(lifted, picture="sliding-order", step=-1)
    with pytest.raises(InputError, match="step"):
        lifted.contact.sliding_displacements(7)


SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [24, 24]
pixel_size = "2 µm"
rms_height = "24 nm"
autocorrelation_length = "8 µm"
autocorrelation = "gaussian"
seed = 1
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "20 mN" }]
"""


def test_area_laws_are_drawn_with_the_loads_at_which_they_hold(tmp_path, monkeypatch):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path))
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    axes = hs.plot(path, picture="area-laws").axes[0]
    labels = dict(
        line.get_label().partition(": ")[::2] for line in axes.lines if line.get_label()[0] != "_"
    )
    scenario = hs.load(path)
    loads = np.geomspace(2e-4, 2e-2, 13)
    found = hs.area_laws(scenario.surface().surface, PAIR, loads, hardness=PAIR.second.hardness)
    for law in found["law"].to_numpy():
        assert (labels[law] == "nowhere") == (
            law != "whole map" and not found["holds"].sel(law=law).any()
        )
    assert "whole map" in labels
    ball = (
        SCENARIO[: SCENARIO.index("kind")]
        + 'kind = "sphere"\nradius = "1 mm"\n'
        + SCENARIO[SCENARIO.index("[fric") :]
    )
    path.write_text(ball, encoding="utf-8")
    with pytest.raises(InputError, match="not a height map"):
        hs.plot(path, picture="area-laws")
