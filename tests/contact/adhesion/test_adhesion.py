import math

import numpy as np
import pytest
from adhesive import ELASTIC, EPS, PULL, R, W, contact

from historysim.contact.adhesion import (
    branch,
    dmt_approach,
    dmt_contact_radius,
    dmt_normal_load,
    hertz_boundary,
    jkr_approach,
    jkr_contact_radius,
    jkr_pull_off_load,
    load_parameter,
    maugis_approach,
    maugis_contact_radius,
    maugis_normal_load,
    maugis_pull_off_load,
    regime,
    rigid_boundary,
    work_of_adhesion,
)
from historysim.errors import InputError, LoadError


def test_scalars_give_scalars_and_arrays_broadcast():
    arguments = contact(1.0)
    for value in (
        maugis_contact_radius(0, **arguments),
        maugis_approach(1e-8, **arguments),
        maugis_pull_off_load(**arguments),
        maugis_pull_off_load(**arguments, control="displacement"),
        maugis_pull_off_load(**contact(0.1), control="displacement"),
        jkr_contact_radius(0, **ELASTIC),
        dmt_normal_load(0, **ELASTIC),
        work_of_adhesion(1, 1),
        hertz_boundary(1),
    ):
        assert isinstance(value, float)
    several = contact(np.array([0.1, 1, 10]))
    loads = np.array([-1, 0, 5, 80])[:, None] * PULL
    together = maugis_contact_radius(loads, **several)
    assert together.shape == (4, 3)
    one = [[maugis_contact_radius(load, **contact(parameter)) for parameter in (0.1, 1, 10)] for load in loads[:, 0]]
    np.testing.assert_allclose(together, one, rtol=16 * EPS)
    held = maugis_pull_off_load(**several, control="displacement")
    one = [maugis_pull_off_load(**contact(parameter), control="displacement") for parameter in (0.1, 1, 10)]
    np.testing.assert_allclose(held, one, rtol=16 * EPS)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jkr_contact_radius(0, **{**ELASTIC, "summit_radius": 0}), "summit_radius is 0; expected .* greater"),
        (lambda: jkr_approach(-1, **ELASTIC), "contact_radius is -1; expected a finite number of 0 or more"),
        (lambda: dmt_normal_load(1, **{**ELASTIC, "work_of_adhesion": -1}), "work_of_adhesion is -1"),
        (lambda: dmt_approach(math.nan, summit_radius=R), "contact_radius is nan"),
        (lambda: jkr_pull_off_load(summit_radius=R, work_of_adhesion=W, control="both"), "control is 'both'; expected"),
        (lambda: maugis_pull_off_load(**contact(1), control="x"), "control is 'x'; expected 'load' or 'displacement'"),
        (lambda: maugis_normal_load(0, **{**contact(1), "work_of_adhesion": 0}), "work_of_adhesion is 0"),
        (lambda: maugis_normal_load(-1e-9, **contact(1)), "contact_radius is -1e-09"),
        (lambda: maugis_contact_radius(math.inf, **contact(1)), "normal_load is inf"),
        (lambda: maugis_approach(0, **{**contact(1), "equilibrium_separation": 0}), "equilibrium_separation is 0"),
        (
            lambda: maugis_approach(0, **contact(1e13)),
            "Maugis parameter is 1e.13; expected one between 1e-12 and 1e.12",
        ),
        (lambda: hertz_boundary([1, 1e-13]), "Maugis parameter is 1e-13"),
        (lambda: regime(0, 1), "maugis_parameter is 0; expected a finite number greater than 0"),
        (lambda: regime(1, math.nan), "load_parameter is nan"),
        (lambda: rigid_boundary(-1), "maugis_parameter is -1"),
        (
            lambda: load_parameter("x", summit_radius=R, work_of_adhesion=W),
            "normal_load: 'x' is not one number and its unit",
        ),
        (lambda: work_of_adhesion(0, 1), "first is 0"),
        (lambda: work_of_adhesion(1, 1, -1), "interfacial is -1"),
        (lambda: branch("jrk", **ELASTIC, max_load=1), "model is 'jrk'; expected one of dmt, hertz, jkr, maugis"),
        (lambda: branch("rigid", **ELASTIC, max_load=1), "spheres do not deform.*; expected one of dmt, hertz"),
        (lambda: branch("jkr", **ELASTIC, max_load=0), "max_load is 0"),
        (lambda: branch("jkr", **ELASTIC, max_load=[1, 2]), "max_load is an array; expected one number"),
        (lambda: branch("jkr", **ELASTIC, max_load=1, points=1), "points is 1; expected an integer of 2 or more"),
        (lambda: branch("jkr", **ELASTIC, max_load=1, points=2.5), "points is 2.5"),
        (lambda: branch("maugis", **ELASTIC, max_load=1), "equilibrium_separation is missing; expected z0"),
    ],
)
def test_arguments_out_of_range(call, message):
    with pytest.raises(InputError, match=message):
        call()


@pytest.mark.parametrize(("radius", "share"), [(jkr_contact_radius, -1.501), (dmt_contact_radius, -2.001)])
def test_loads_beyond_pull_off(radius, share):
    with pytest.raises(LoadError, match=r"normal_load of -\S+ N pulls harder .* pull-off load of -\S+ N"):
        radius([0, share * PULL], **ELASTIC)
    # rounding of the pull-off load itself is forgiven
    assert np.isfinite(radius(round(share, 1) * PULL * (1 + 4 * EPS), **ELASTIC))
