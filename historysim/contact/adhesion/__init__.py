"""One elastic contact of a sphere and a flat that adhere, after JKR, DMT and Maugis, and which of them holds when.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for scalars. A normal
load N presses the surfaces together when it is positive and pulls when it is negative; pull-off loads are negative.
The approach δ is 0 where the undeformed surfaces touch. R is the summit radius, E* the contact modulus of the pair,
W the work of adhesion and z0 the equilibrium separation of the surfaces.

In JKR adhesion acts inside the contact only, in DMT outside it only. In Maugis a constant attraction acts outside it up
to a certain gap. That holds for any Maugis parameter λ, with DMT at λ → 0 and JKR at λ → ∞. Each theory has a file of
its own, with its source.
"""

from historysim.contact.adhesion.dmt import dmt_approach, dmt_contact_radius, dmt_normal_load, dmt_pull_off_load
from historysim.contact.adhesion.equilibria import Branch, Point, branch
from historysim.contact.adhesion.jkr import jkr_approach, jkr_contact_radius, jkr_normal_load, jkr_pull_off_load
from historysim.contact.adhesion.maugis import (
    maugis_adhesive_zone_radius,
    maugis_approach,
    maugis_contact_radius,
    maugis_normal_load,
    maugis_pull_off_load,
)
from historysim.contact.adhesion.parameters import (
    MAUGIS_OVER_TABOR,
    load_parameter,
    maugis_parameter,
    tabor_parameter,
    work_of_adhesion,
)
from historysim.contact.adhesion.pull_off import Control
from historysim.contact.adhesion.regimes import (
    DMT_BELOW,
    JKR_ABOVE,
    NEGLIGIBLE,
    Regime,
    hertz_boundary,
    regime,
    rigid_boundary,
)

__all__ = [
    "DMT_BELOW",
    "JKR_ABOVE",
    "MAUGIS_OVER_TABOR",
    "NEGLIGIBLE",
    "Branch",
    "Control",
    "Point",
    "Regime",
    "branch",
    "dmt_approach",
    "dmt_contact_radius",
    "dmt_normal_load",
    "dmt_pull_off_load",
    "hertz_boundary",
    "jkr_approach",
    "jkr_contact_radius",
    "jkr_normal_load",
    "jkr_pull_off_load",
    "load_parameter",
    "maugis_adhesive_zone_radius",
    "maugis_approach",
    "maugis_contact_radius",
    "maugis_normal_load",
    "maugis_parameter",
    "maugis_pull_off_load",
    "regime",
    "rigid_boundary",
    "tabor_parameter",
    "work_of_adhesion",
]
