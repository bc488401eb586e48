"""``[friction]`` and ``[wear]``: coefficients, or laws by their names with what they need."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.basics.places import misfit
from historysim.basics.wording import nearest
from historysim.scenario.friction_course_section import AnyCourse
from historysim.scenario.schema import Force, Number, Numbers, Pressure, Quantity, SurfaceEnergy, given

if TYPE_CHECKING:
    from historysim.asperities.laws import FrictionLaw
    from historysim.asperities.wear import WearLaw

LAW_KEYS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "power": (("coefficient", "reference_load", "exponent"), ("load",)),
    "shear strength": (("shear_strength",), ("area", "work_of_adhesion")),
    "shifted load": (("coefficient", "work_of_adhesion"), ()),
    "slid distance": (("distance", "coefficient"), ()),
    "drawn": (("mean", "deviation", "seed"), ("distribution",)),
}
WEAR_KEYS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "archard": (("coefficient", "hardness"), ("shape",)),
    "energy": (("volume_per_energy",), ("shape",)),
}
"""By law: the keys that it needs, and those that it may have."""


@attrs.frozen
class FrictionSection:
    """``[friction]``: one coefficient and its course, or one for each asperity, or a law with what it needs.

    Attributes
    ----------
    coefficient
        Coefficient of friction μ, or an array with one for each asperity. Left out where the summit table has a
        column of friction. With ``law = "slid distance"`` the array that belongs to ``distance``.
    course
        A coefficient that changes over time or distance, as below.
    law
        ``"power"``, ``"shear strength"``, ``"shifted load"``, ``"slid distance"`` or ``"drawn"``, in place of a
        coefficient.
    reference_load
        N_ref of ``"power"``, μ = coefficient (N/N_ref)^exponent.
    exponent
        Of ``"power"``.
    load
        Of ``"power"``: ``"own"``, the load of the asperity, by default, or ``"total"``.
    shear_strength
        τ0 of ``"shear strength"``, T_max = τ0 A.
    area
        Of ``"shear strength"``: ``"hertz"`` by default, or ``"jkr"`` with ``work_of_adhesion``.
    work_of_adhesion
        W of ``"shifted load"``, T_max = μ (N + 2πWR), and of the area of JKR.
    distance
        Of ``"slid distance"``: slid distances of an asperity, rising from 0.
    mean
        Of ``"drawn"``: one coefficient is drawn for each asperity.
    deviation
        Of ``"drawn"``: standard deviation.
    seed
        Of ``"drawn"``.
    distribution
        Of ``"drawn"``: ``"lognormal"`` by default, or ``"uniform"``.

    Examples
    --------
    [friction]
    law = "shear strength"
    shear_strength = "11.4 MPa"
    """

    coefficient: Numbers | None = None
    course: AnyCourse | None = None
    law: str | None = None
    reference_load: Force | None = None
    exponent: Number | None = None
    load: str | None = None
    shear_strength: Pressure | None = None
    area: str | None = None
    work_of_adhesion: SurfaceEnergy | None = None
    distance: Annotated[tuple[float, ...], Quantity("m")] | None = None
    mean: Number | None = None
    deviation: Number | None = None
    seed: int | None = None
    distribution: str | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it is one or the other."""
        if self.law is not None:
            self.friction()
            return
        for key in given(self):
            if key not in {"coefficient", "course"}:
                raise misfit(f"belongs to a law; expected law, one of {', '.join(LAW_KEYS)}", key)
        if self.coefficient is None:
            raise misfit("missing; expected a coefficient, or law with what it needs", "coefficient")

    def friction(self) -> "float | tuple[float, ...] | FrictionLaw":
        """Return the coefficients, or the law.

        Raises
        ------
        InputError
            No such law, or what it does not have.
        """
        if self.coefficient is not None and self.law is None:
            return self.coefficient
        from historysim.asperities.laws import law_from

        law: FrictionLaw = _built(law_from, LAW_KEYS, self)
        return law


@attrs.frozen
class WearSection:
    """``[wear]``: what sliding takes from the asperities.

    Attributes
    ----------
    law
        ``"archard"``, dV = K N ds/H, or ``"energy"``, dV = α dE.
    coefficient
        K of ``"archard"``.
    hardness
        H of ``"archard"``.
    volume_per_energy
        α of ``"energy"``.
    shape
        ``"truncated"`` by default: the cap of the volume is cut off, the radius stays. ``"blunted"``: a blunter
        paraboloid.

    Examples
    --------
    [wear]
    law = "archard"
    coefficient = 1e-4
    hardness = "6 GPa"
    """

    law: str
    coefficient: Number | None = None
    hardness: Pressure | None = None
    volume_per_energy: Annotated[float, Quantity("m3 J-1")] | None = None
    shape: str | None = None

    def __attrs_post_init__(self) -> None:
        """Check that it is a law."""
        self.wear()

    def wear(self) -> "WearLaw":
        """Return the law; errors as for `FrictionSection.friction`."""
        from historysim.asperities.wear import wear_law_from

        law: WearLaw = _built(wear_law_from, WEAR_KEYS, self)
        return law


def _built(
    make: Callable[[Mapping[str, Any]], Any],
    keys: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]],
    section: FrictionSection | WearSection,
) -> Any:
    """Return the law of a section, whose keys have to be those of the law."""
    law, told = str(section.law), given(section)
    if law not in keys:
        raise misfit(f"{law!r}; {nearest(law, keys)}", "law")
    needed, more = keys[law]
    for key in told:
        if key not in {"law", *needed, *more}:
            raise misfit(f"is no key of the law {law!r}; expected {', '.join((*needed, *more))}", key)
    for key in needed:
        if key not in told:
            raise misfit(f"missing; the law {law!r} needs it", key)
    return make(told)
