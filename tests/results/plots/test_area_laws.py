"""Area laws of a height map: curves with the loads at which they hold."""

import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError

pytestmark = pytest.mark.ci

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
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
