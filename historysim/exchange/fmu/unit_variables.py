"""The variables of a unit of co-simulation: one table, which its description and its C are made from."""

import attrs


@attrs.frozen
class UnitVariable:
    """One variable.

    Attributes
    ----------
    name : str
    key : str
        What its C calls it, after ``V_``; its place in the table is its value reference.
    causality, variability : str
        As the standard has them.
    unit : str
        Empty for a number without one.
    text : str
    kind : {"real", "integer", "boolean"}
    differentiable : bool
        Whether there is a derivative in the inputs.
    """

    name: str
    key: str
    causality: str
    variability: str
    unit: str
    text: str
    kind: str = "real"
    differentiable: bool = False


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
    UnitVariable("normal_load", "NORMAL_LOAD", "output", "continuous", "N", "total normal load", differentiable=True),
    UnitVariable(
        "tangential_load", "TANGENTIAL_LOAD", "output", "continuous", "N", "total tangential load", differentiable=True
    ),
    UnitVariable(
        "approach",
        "APPROACH",
        "output",
        "continuous",
        "m",
        "approach of the highest summit from first touch; negative is a gap",
        differentiable=True,
    ),
    UnitVariable(
        "tangential_displacement",
        "TANGENTIAL_DISPLACEMENT",
        "output",
        "continuous",
        "m",
        "rigid tangential displacement of the contact",
        differentiable=True,
    ),
    UnitVariable(
        "drive_displacement",
        "DRIVE_DISPLACEMENT",
        "output",
        "continuous",
        "m",
        "displacement of the instrument's drive, U + T/k; that of the contact where the instrument is rigid",
        differentiable=True,
    ),
    UnitVariable(
        "tangential_stiffness",
        "TANGENTIAL_STIFFNESS",
        "output",
        "continuous",
        "N/m",
        "dT/dU of the contact at a held approach, on the side of the last step",
    ),
    UnitVariable(
        "coupling_stiffness",
        "COUPLING_STIFFNESS",
        "output",
        "continuous",
        "N/m",
        "dT/dd at a held displacement, d the approach, on the side of the last step",
    ),
    UnitVariable("normal_stiffness", "NORMAL_STIFFNESS", "output", "continuous", "N/m", "dN/dd, d the approach"),
    UnitVariable(
        "dissipated_energy",
        "DISSIPATED_ENERGY",
        "output",
        "continuous",
        "J",
        "energy that friction has taken since nothing touched",
    ),
    UnitVariable(
        "slipping_share",
        "SLIPPING_SHARE",
        "output",
        "continuous",
        "",
        "share of the contact area outside the stick radii",
    ),
    UnitVariable(
        "contact_count", "CONTACT_COUNT", "output", "discrete", "", "asperities, or patches, that touch", "integer"
    ),
    UnitVariable(
        "saturated",
        "SATURATED",
        "output",
        "discrete",
        "",
        "whether a tangential load is held at the friction limit, since more was asked for",
        "boolean",
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
    inputs = [
        UnitVariable(name, key, "input", "continuous", unit, text)
        for (name, unit, text), key in (
            (NORMAL[normal], "PRESCRIBED_NORMAL"),
            (tangential_input, "PRESCRIBED_TANGENTIAL"),
        )
    ]
    factor = UnitVariable(
        "friction_factor",
        "FRICTION_FACTOR",
        "parameter",
        "tunable",
        "",
        "factor on all friction coefficients of the start state, 0 or more",
    )
    time = UnitVariable("time", "TIME", "independent", "continuous", "s", "time")
    outputs = [each for each in OUTPUTS if areas or each.key != "SLIPPING_SHARE"]
    return (*inputs, factor, *outputs, time)
