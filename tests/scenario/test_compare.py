"""A comparison in one call."""

import numpy as np
import pytest
import synthetic
from records import scenario_text, write_columns

import historysim as hs

BASE = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[instrument]
lateral_stiffness = "334 mN/µm"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("compare")
    record = synthetic.measured("ball", 7)
    write_columns(
        path / "m.csv",
        t=record.time,
        N=record["normal_load"],
        u=1e9 * record["tangential_displacement"],
        T=record["tangential_load"],
    )
    text = scenario_text(response={"tangential_load": '"T"'}, base=BASE)
    (path / "s.toml").write_text(text, encoding="utf-8")
    return path


def test_the_model_that_made_the_record_is_as_far_from_it_as_the_noise(folder):
    found = hs.compare(folder / "s.toml")
    # that of the displacement makes most of it, where the spring of the instrument carries it into the load
    assert np.sqrt(np.mean(found.difference**2)) < synthetic.STIFFNESS * synthetic.DISPLACEMENT_NOISE
    assert found.instrument.lateral_stiffness == 334e3
    assert len(found.measured) == len(found.model) == 4


def test_its_loops_are_those_that_are_found(folder):
    loaded = hs.load(folder / "s.toml")
    found, loops = hs.compare(loaded, skip=1), hs.loops(loaded, skip=1)
    assert found.measured.ends.tolist() == loops.ends.tolist()
    assert found.observation.dead_band == loops.dead_band
    assert dict(found.summary())["dead band"] == dict(loops.summary())["dead band"].split(",")[0]


def test_a_record_without_a_whole_loop_is_compared(folder, tmp_path):
    write_columns(tmp_path / "m.csv", t=range(4), N=np.ones(4), u=[0, 1, 2, 3], T=[0, 0.1, 0.15, 0.16])
    (tmp_path / "s.toml").write_text((folder / "s.toml").read_text(encoding="utf-8"), encoding="utf-8")
    found = hs.compare(tmp_path / "s.toml")
    assert found.measured is found.model is None
    assert dict(found.summary())["loops"] == "none"


@pytest.mark.parametrize("scenario", [None, 3, [], {}])
def test_what_is_no_scenario(scenario):
    for call in (hs.load, hs.compare, hs.fit):
        with pytest.raises(hs.InputError, match="is no scenario; expected the path of a TOML file"):
            call(scenario)


def test_a_scenario_that_is_written_out_cannot_be_compared(tmp_path):
    (tmp_path / "s.toml").write_text(
        BASE + "[loading]\nwaypoints = [{ time = 0, normal_load = 1 }]\n", encoding="utf-8"
    )
    with pytest.raises(hs.InputError, match=r"s\.toml: loading: is written out; expected a measured file"):
        hs.compare(tmp_path / "s.toml")
