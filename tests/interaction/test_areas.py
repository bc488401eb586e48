"""The laws for the contact area beside the summits and the whole solution of one map."""

import numpy as np
import pytest

import historysim as hs
from historysim.errors import InputError

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
LOADS = (0.02, 0.1)


@pytest.fixture(scope="module")
def surface():
    return hs.random_surface(
        shape=(128, 128),
        pixel_size=1e-6,
        rms_height=24e-9,
        autocorrelation_length=20e-6,
        autocorrelation="gaussian",
        seed=1,
    )


def test_summits_have_the_area_of_an_ensemble(surface):
    found = hs.area_laws(surface, PAIR, LOADS, whole_map=False).real_contact_area.sel(law="summits")
    ensemble = hs.Ensemble.from_summits(PAIR, surface.summits(), friction=0.2)
    history = hs.replay(ensemble, [hs.NormalLoad(float(k), load) for k, load in enumerate(LOADS)])
    assert found.to_numpy() == pytest.approx(history.real_contact_area.to_numpy(), rel=1e-3)


def test_laws_enclose_the_whole_map(surface):
    found = hs.area_laws(surface, PAIR, LOADS, hardness=5e9)
    area = found.real_contact_area
    assert list(found.law.values)[-1] == "whole map"
    assert (area.sel(law="Persson") < area.sel(law="whole map")).all()
    assert (area.sel(law="summits") < area.sel(law="whole map")).all()
    assert area.sel(law="Bowden–Tabor").to_numpy() == pytest.approx(np.array(LOADS) / 5e9)
    assert found.holds.sel(law="summits").all()
    assert not found.holds.sel(law="Bowden–Tabor").any()


def test_a_profile_is_refused():
    with pytest.raises(InputError, match="a profile has no contact area"):
        hs.area_laws(hs.Surface(np.arange(9.0), 1e-6), PAIR, 0.1)
