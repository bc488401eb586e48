"""A result that is read from its file without xarray says what its Dataset does."""

import h5py
import numpy as np
import pytest

import historysim as hs
from historysim.asperities.wear import ArchardWear
from historysim.recording.compression import compress
from historysim.results import analysis, recorded_file

PAIR = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9)
HEIGHT = [0.0, -5e-9, -9e-9]
LOADS = [
    hs.NormalLoad(0.0, 1e-3),
    hs.TangentialDisplacement(1.0, 8e-9),
    hs.FrictionChange(2.0, [0.2, 0.1, 0.3]),
    hs.TangentialDisplacement(3.0, 1e-9),
]
APPROACH = np.linspace(0.0, 1e-7, 9)
CURVE = hs.Ensemble.from_normal_curves(PAIR, APPROACH, 1e9 * APPROACH**1.5, friction=0.2)

JOBS = {
    "friction that changes": hs.Replay(hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2), LOADS, substeps=3),
    "one friction": hs.Replay(hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2), LOADS[:2], substeps=3),
    "shapes that change": hs.Replay(
        hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2, wear=ArchardWear(coefficient=1e-4, hardness=6e9)), LOADS[:2]
    ),
    "totals alone": hs.Replay(hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2), LOADS[:2], record="totals"),
    "some of all": hs.Replay(hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2), LOADS[:2], record=[1]),
    "patches": hs.Replay(CURVE, LOADS[:2]),
    "nothing touches": hs.Replay(hs.Ensemble(PAIR, HEIGHT, 1e-5, 0.2), [hs.NormalDisplacement(0.0, -1e-9)]),
}


@pytest.mark.parametrize("job", JOBS.values(), ids=JOBS)
def test_the_summary_of_a_file_is_that_of_its_dataset(tmp_path, job):
    job.write(tmp_path / "out.nc")
    with recorded_file.opened(tmp_path / "out.nc") as recorded:
        assert analysis.summary(recorded) == analysis.summary(job.dataset())


def test_parts_of_a_variable_are_those_of_the_dataset(tmp_path):
    job = JOBS["one friction"]
    job.write(tmp_path / "out.nc")
    history = job.dataset()
    with recorded_file.opened(tmp_path / "out.nc") as recorded:
        for step in (0, -1, slice(1, 3)):
            part, expected = recorded["normal_load"].isel(step=step), history["normal_load"].isel(step=step)
            assert part.dims == expected.dims
            assert np.array_equal(part.values, expected.values)
        assert "normal_load" in recorded
        assert "nothing" not in recorded
        assert recorded.sizes == dict(history.sizes)


def test_damage_that_is_met_while_reading_is_told(tmp_path):
    path = tmp_path / "out.nc"
    JOBS["one friction"].write(tmp_path / "whole.nc")
    # whose chunks have checksums
    compress(tmp_path / "whole.nc", path, "zlib")
    with h5py.File(path) as file:
        _, chunk = file["slip_state"].id.read_direct_chunk((0, 0))
    content = bytearray(path.read_bytes())
    content[content.index(chunk)] ^= 1
    path.write_bytes(content)
    damaged = pytest.raises(hs.InputError, match=r"out\.nc: is damaged \(NetCDF: .*\); make it again")
    with damaged, recorded_file.opened(path) as recorded:
        analysis.summary(recorded)
