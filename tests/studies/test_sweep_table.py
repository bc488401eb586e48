"""Spread over seeds against numpy, and drift along a swept quantity."""

import numpy as np
import pytest
import xarray as xr
from golden import refused
from matplotlib.text import Text
from numpy.testing import assert_allclose, assert_array_equal

import historysim as hs


@pytest.fixture
def found():
    values = np.random.Generator(np.random.PCG64(1)).normal(size=(3, 7))
    values[1, 2], values[2, 1:] = np.nan, np.nan
    attributes = {"units": "m", "long_name": "a length"}
    data = {
        "drift": (("load", "surface_seed"), values, attributes),
        "failure": (("load", "surface_seed"), values.astype(str)),
    }
    return xr.Dataset(data, {"surface_seed": np.arange(7), "load": [1.0, 2.0, 3.0]})


def test_spread_agrees_with_numpy_over_what_is_there(found):
    quantiles = (0, 0.05, 0.3, 0.5, 1)
    spread = hs.sweep_statistics(found, quantiles=quantiles)
    values = found.drift.values
    assert_allclose(spread.drift_mean, np.nanmean(values, axis=1), rtol=1e-14)
    assert_allclose(
        spread.drift_standard_deviation[:2], np.nanstd(values[:2], axis=1, ddof=1), rtol=1e-13
    )
    assert spread.drift_standard_deviation[2].isnull()
    assert_allclose(spread.drift_quantile, np.nanquantile(values, quantiles, axis=1).T, rtol=1e-13)
    assert spread.drift_count.values.tolist() == [7, 6, 1]
    assert spread.drift_quantile.dims == ("load", "quantile")
    assert spread.drift_mean.attrs == {"units": "m", "long_name": "mean of: a length"}
    assert "failure_mean" not in spread


def test_a_label_has_no_mean(found):
    spread = hs.sweep_statistics(found.assign(critical_asperity=found.drift))
    assert "drift_mean" in spread
    assert not [name for name in spread if str(name).startswith("critical_asperity")]


def test_drift_along_a_dimension(found):
    drift = hs.drift_along(found, "load", "drift")
    assert_array_equal(drift, np.abs(found.drift - found.drift[0]))
    assert drift.name == "drift_drift"
    assert drift.attrs["units"] == "m"


def test_what_is_not_there_is_reported(found):
    with refused("'lod' is not a dimension of this sweep; did you mean 'load'"):
        hs.sweep_statistics(found, "lod")
    with refused("'lod' is not a dimension"):
        hs.drift_along(found, "lod")
    with refused("'drfit' is not a number of this sweep along load; did you mean 'drift'"):
        hs.drift_along(found, "load", "drfit")
    with refused(r"quantiles are \(2,\); expected numbers from 0 to 1"):
        hs.sweep_statistics(found, quantiles=(2,))


def test_the_picture_of_a_spread_has_means_with_their_deviation(found):
    swept = found.assign(preliminary_displacement=2e-9 * found.drift).assign_attrs(content="sweep")
    figure = hs.plot(hs.sweep_statistics(swept))
    assert any("mean ± standard deviation" in text.get_text() for text in figure.findobj(Text))
