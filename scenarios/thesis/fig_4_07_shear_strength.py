"""Fig. 4.7: mean shear stress at which a silicon ball slides on glass, over the normal load.

τ = μN/A with μ = 0.12. By the area of Hertz it rises as N^(1/3); by that of JKR it is lower and rises faster, since
adhesion keeps an area without load. The source lets it rise with the load (4.4.3) and be high at low load (4.6): with
one coefficient neither area gives the latter.
"""

# historysim gallery: example

import numpy as np
import xarray as xr

import historysim as hs
from historysim.contact import adhesion, hertz

RADIUS = 2.5e-3
FRICTION = 0.12


def calculated() -> xr.Dataset:
    """Return the shear stress [Pa] over the normal load [N], by either area."""
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    load = np.linspace(10e-3, 90e-3, 9)
    approach = hertz.approach(load, summit_radius=RADIUS, contact_modulus=pair.contact_modulus)
    radius = [
        hertz.contact_radius(approach, summit_radius=RADIUS),
        adhesion.jkr_contact_radius(
            load,
            summit_radius=RADIUS,
            contact_modulus=pair.contact_modulus,
            work_of_adhesion=pair.work_of_adhesion,
        ),
    ]
    stress = FRICTION * load / (np.pi * np.square(radius))
    return xr.Dataset(
        {"shear_stress": (("area", "normal_load"), stress, {"units": "Pa"})},
        {"area": ["Hertz", "JKR"], "normal_load": ("normal_load", load, {"units": "N"})},
    )


if __name__ == "__main__":
    print(calculated().to_dataframe().unstack("area"))
