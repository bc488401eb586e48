"""Adhesion regimes of the asperities of an ensemble, computed apart from the replay, which neglects adhesion."""

from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.asperity_set import AsperitySet
from historysim.basics.arguments import Floats, Integers, scalar
from historysim.contact import adhesion, hertz


@attrs.frozen(eq=False)
class AdheringAsperities:
    """Adhesion parameters of the asperities in contact, by descending normal load."""

    asperity: Integers  #: their indices
    normal_load: Floats
    load_parameter: Floats  #: N/(πWR)
    maugis_parameter: Floats  #: λ
    regime: npt.NDArray[np.object_]  #: their zone of the adhesion map
    pull_off_load: Floats  #: at which each would be pulled off, by Maugis [N], < 0

    def summary(self) -> list[tuple[str, str]]:
        """Summarise the adhesion regimes and the pull-off load relative to the normal load."""
        zones = list(self.regime)
        counts = ", ".join(f"{zones.count(zone):,} {zone.label}" for zone in dict.fromkeys(zones))
        pull_off_ratio = -self.pull_off_load.sum() / self.normal_load.sum()
        return [
            ("adhesion regimes", f"{counts}, where the asperities are pressed most"),
            (
                "adhesion left out",
                f"pull-off {100 * pull_off_ratio:.2g} % of the normal load at most",
            ),
        ]

    def examples(self) -> dict[str, tuple[float, float]]:
        """Return the Maugis and load parameters of the asperities with the greatest, median and least load."""
        size = self.asperity.size
        # if there are fewer than three asperities, one of them has the last of its labels
        ranks = {size - 1: "least load", size // 2: "median load", 0: "greatest load"}
        parameters = self.maugis_parameter.tolist(), self.load_parameter.tolist()
        return {
            f"asperity {self.asperity[rank]}, {name}": (parameters[0][rank], parameters[1][rank])
            for rank, name in sorted(ranks.items())
        }


def adhering_asperities(
    ensemble: AsperitySet,
    approach: float,
    *,
    work_of_adhesion: float,
    equilibrium_separation: float,
) -> AdheringAsperities:
    """Classify the asperities in contact by adhesion regime, at an approach computed without adhesion.

    The approach is in m, the work of adhesion W in J/m², the equilibrium separation z0 in m, all >
    0.
    """
    modulus = ensemble.pair.contact_modulus
    separation = ensemble.highest_summit - scalar("approach", approach, above=0)
    depth = ensemble.summit_height - separation
    touching = np.flatnonzero(depth > 0)
    radius = ensemble.summit_radius[touching]
    load = hertz.normal_load(depth[touching], summit_radius=radius, contact_modulus=modulus)
    order = np.argsort(-load, kind="stable")
    touching, radius, load = touching[order], radius[order], load[order]
    contact: dict[str, Any] = {
        "summit_radius": radius,
        "contact_modulus": modulus,
        "work_of_adhesion": work_of_adhesion,
        "equilibrium_separation": equilibrium_separation,
    }
    parameter = adhesion.maugis_parameter(**contact)
    relative = adhesion.load_parameter(
        load, summit_radius=radius, work_of_adhesion=work_of_adhesion
    )
    return AdheringAsperities(
        asperity=touching,
        normal_load=load,
        load_parameter=relative,
        maugis_parameter=parameter,
        regime=np.asarray(adhesion.regime(parameter, relative)),
        pull_off_load=adhesion.maugis_pull_off_load(**contact),
    )
