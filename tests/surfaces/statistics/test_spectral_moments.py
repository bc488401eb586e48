import math

import numpy as np
import pytest
from rough_maps import EPS

from historysim.surfaces.statistics import SpectralMoments


def test_summits_of_a_gaussian_surface_against_drawn_hessians():
    # Kac and Rice: summits per area = p(no gradient) · E[|det H|; H negative definite], and means over the summits are
    # weighted by |det H|. The gradient is independent of height and Hessian, with p = 1/(2π m2) at 0. Covariances:
    # ⟨z²⟩ = m0, ⟨z z_xx⟩ = -m2, ⟨z_xx²⟩ = m4, ⟨z_xx z_yy⟩ = ⟨z_xy²⟩ = m4/3
    m0, m2, m4, count = 2.0, 3.0, 11.0, 2_000_000
    moments = SpectralMoments(m0, m2, m4)
    assert moments.alpha == pytest.approx(22 / 9, rel=4 * EPS)
    covariance = [[m0, -m2, -m2, 0], [-m2, m4, m4 / 3, 0], [-m2, m4 / 3, m4, 0], [0, 0, 0, m4 / 3]]
    z, xx, yy, xy = np.linalg.cholesky(covariance) @ np.random.default_rng(16).normal(size=(4, count))
    determinant = xx * yy - xy**2
    weight = np.where((determinant > 0) & (xx < 0), determinant, 0)
    for found, sample in (
        (moments.summit_density * 2 * math.pi * m2, weight),
        (0, weight * (z - moments.mean_summit_height)),
        (0, weight * (-(xx + yy) / 2 - moments.mean_summit_curvature)),
    ):
        error = sample.std() / math.sqrt(count)
        assert found == pytest.approx(sample.mean(), abs=5 * error)
        assert error < 0.003 * weight.mean() * max(moments.mean_summit_height, 1)
