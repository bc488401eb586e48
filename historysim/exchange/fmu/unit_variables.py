"""The variables of a unit of co-simulation: one table, which its description and its C are made from."""

import attrs


@attrs.frozen
class UnitVariable:
    """One variable.

    Attributes
    ----------
    name : str
    unit : str
        Empty for a number without one.
    text : str
    causality, variability : str
        As the standard has them.
    kind : {"real", "integer", "boolean"}
    key : str
        What its C calls it, after ``V_``; its place in the table is its value reference.
    """

    name: str
    unit: str
    text: str
    causality: str = "output"
    variability: str = "continuous"
    kind: str = "real"
    key: str = attrs.Factory(lambda self: self.name.upper(), takes_self=True)


NORMAL = {
    "load": ("prescribed_normal_load", "N", "total normal load at the end of the next step, 0 or more"),
    "displacement": (
        "prescribed_approach",
        "m",
        "approach of the highest summit from first touch at the end of the next step; negative is a gap",
    ),
}
TANGENTIAL = {
    "load": ("prescribed_tangential_load", "N", "total tangential load at the end of the next step"),
    "displacement": (
        "prescribed_tangential_displacement",
        "m",
        "rigid tangential displacement at the end of the next step",
    ),
}
DRIVEN = (
    "prescribed_drive_displacement",
    "m",
    "displacement of the instrument's drive, U + T/k, at the end of the next step",
)

OUTPUTS = (
    UnitVariable("normal_load", "N", "total normal load"),
    UnitVariable("tangential_load", "N", "total tangential load"),
    UnitVariable("approach", "m", "approach of the highest summit from first touch; negative is a gap"),
    UnitVariable("tangential_displacement", "m", "rigid tangential displacement of the contact"),
    UnitVariable(
        "drive_displacement",
        "m",
        "displacement of the instrument's drive, U + T/k; that of the contact where the instrument is rigid",
    ),
    UnitVariable(
        "tangential_stiffness", "N/m", "dT/dU of the contact at a held approach, on the side of the last step"
    ),
    UnitVariable(
        "coupling_stiffness", "N/m", "dT/dd at a held displacement, d the approach, on the side of the last step"
    ),
    UnitVariable("normal_stiffness", "N/m", "dN/dd, d the approach"),
    UnitVariable("dissipated_energy", "J", "energy that friction has taken since nothing touched"),
    UnitVariable("slipping_share", "", "share of the contact area outside the stick radii"),
    UnitVariable("contact_count", "", "asperities, or patches, that touch", variability="discrete", kind="integer"),
    UnitVariable(
        "saturated",
        "",
        "whether a tangential load is held at the friction limit, since more was asked for",
        variability="discrete",
        kind="boolean",
    ),
)


def variables(normal: str, tangential: str, *, driven: bool, areas: bool) -> tuple[UnitVariable, ...]:
    """Return all variables; where one stands is its value reference.

    Parameters
    ----------
    normal, tangential : {"load", "displacement"}
        How the channels are controlled.
    driven : bool
        Whether an instrument is in series.
    areas : bool
        Whether contact areas are known, and so the share that slips.
    """
    tangential_input = DRIVEN if driven and tangential == "displacement" else TANGENTIAL[tangential]
    inputs = (
        UnitVariable(*NORMAL[normal], "input", key="PRESCRIBED_NORMAL"),
        UnitVariable(*tangential_input, "input", key="PRESCRIBED_TANGENTIAL"),
    )
    factor = UnitVariable(
        "friction_factor",
        "",
        "factor on all friction coefficients of the start state, 0 or more",
        "parameter",
        "tunable",
    )
    outputs = (each for each in OUTPUTS if areas or each.name != "slipping_share")
    return (*inputs, factor, *outputs, UnitVariable("time", "s", "time", "independent"))
