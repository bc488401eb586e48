"""Whatever a path names, opened as what it is, and what Python writes is read again."""

import pytest
import xarray as xr

import historysim as hs

PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
ENSEMBLE = hs.Ensemble(PAIR, [0.0, -1e-8], 1e-3, 0.2)
EVENTS = [hs.NormalLoad(0.0, 0.1), *(hs.TangentialDisplacement(float(t), (-1) ** t * 1e-6) for t in (1, 2, 3))]


@pytest.fixture
def history():
    return hs.replay(ENSEMBLE, EVENTS, substeps=4)


def test_a_history_that_python_has_written_is_a_result(history, tmp_path):
    path = tmp_path / "h.nc"
    hs.write_netcdf(history, path)
    with hs.open(path) as found:
        xr.testing.assert_equal(found, history)
        assert found.contact.slip_shares().equals(history.contact.slip_shares())
    # closed once, and closed again without ado
    found.close()
    assert dict(hs.show(path))["steps"] == "13 over 3 s"
    assert len(hs.plot(path).axes) > 1


def test_a_table_of_a_question_is_opened_shown_and_drawn(history, tmp_path):
    path = tmp_path / "f.nc"
    table = history.contact.first_slips()
    hs.write_netcdf(table, path)
    xr.testing.assert_equal(hs.open(path), table)
    told = dict(hs.show(path))
    assert told["size"] == "2 along asperity"
    assert told["slip_time"] == "250 ms; when the asperity first slips"
    assert hs.plot(path).axes


def test_a_unit_with_a_power_gets_no_prefix(history, tmp_path):
    hs.write_netcdf(history.contact.time_series(), tmp_path / "t.nc")
    area = history.real_contact_area.values
    assert dict(hs.show(tmp_path / "t.nc"))["real_contact_area"].startswith(f"{area.max():.4g} m2;")
