"""One elastic contact of a sphere and a flat that adhere, after JKR, DMT and Maugis, and which of them holds when.

Arguments are scalars or arrays that broadcast; a result has their common shape, and is a scalar for scalars. A normal
load N [N] presses the surfaces together when it is positive and pulls when it is negative; pull-off loads are negative.
The approach δ [m] is 0 where the undeformed surfaces touch. A contact has ``summit_radius`` R [m], ``contact_modulus``
E* [Pa], ``work_of_adhesion`` W [J/m²] and ``equilibrium_separation`` z0 [m], all > 0; W may be 0 in JKR and DMT, where
the contact is then Hertz's. Contact radii a [m] are ≥ 0. Maugis is solved for parameters λ from 1e-12 to 1e12.

In JKR adhesion acts inside the contact only, in DMT outside it only. In Maugis a constant attraction acts outside it up
to a certain gap. That holds for any Maugis parameter λ, with DMT at λ → 0 and JKR at λ → ∞.

Every function raises `InputError` for a number that is not finite or out of its range, and `LoadError` for a load
beyond pull-off.
"""

from historysim.contact.adhesion.equilibria import (
    DMT_BELOW,
    JKR_ABOVE,
    NEGLIGIBLE,
    Branch,
    Point,
    Regime,
    branch,
    hertz_boundary,
    regime,
    rigid_boundary,
)
from historysim.contact.adhesion.theories import (
    MAUGIS_OVER_TABOR,
    Control,
    dmt_approach,
    dmt_contact_radius,
    dmt_normal_load,
    dmt_pull_off_load,
    jkr_approach,
    jkr_contact_radius,
    jkr_normal_load,
    jkr_pull_off_load,
    load_parameter,
    maugis_adhesive_zone_radius,
    maugis_approach,
    maugis_contact_radius,
    maugis_normal_load,
    maugis_parameter,
    maugis_pull_off_load,
    tabor_parameter,
)
from historysim.contact.materials import work_of_adhesion

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
