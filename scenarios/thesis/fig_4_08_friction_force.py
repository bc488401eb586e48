"""Fig. 4.8: friction force of a silicon ball on glass of one shear strength (Bowden and Tabor), over the normal load.

T = τ0 A. By Hertz it goes as N^(2/3), by JKR as N^0.519 from 10 to 90 mN. Assumed: τ0 is what gives μ = 0.12 at
90 mN by either area.
"""

import numpy as np
import xarray as xr

import historysim as hs
from historysim.contact import adhesion, hertz

RADIUS = 2.5e-3
FRICTION, AT = 0.12, 90e-3


def calculated() -> xr.Dataset:
    """Return the friction force [N] over the normal load [N], by either area."""
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    load = np.linspace(10e-3, AT, 9)
    approach = hertz.approach(load, summit_radius=RADIUS, contact_modulus=pair.contact_modulus)
    radius = np.stack(
        [
            hertz.contact_radius(approach, summit_radius=RADIUS),
            adhesion.jkr_contact_radius(
                load,
                summit_radius=RADIUS,
                contact_modulus=pair.contact_modulus,
                work_of_adhesion=pair.work_of_adhesion,
            ),
        ]
    )
    force = FRICTION * AT * (radius / radius[:, -1:]) ** 2
    return xr.Dataset(
        {"friction_force": (("area", "normal_load"), force, {"units": "N"})},
        {"area": ["Hertz", "JKR"], "normal_load": ("normal_load", load, {"units": "N"})},
    )


if __name__ == "__main__":
    print(calculated().to_dataframe().unstack("area"))
