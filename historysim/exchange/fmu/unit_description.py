"""The variables of a unit of co-simulation, and `modelDescription.xml` by FMI 2.0 and 3.0, which lists them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

import attrs

from historysim._version import __version__
from historysim.basics.compiler import SAME_BITS

DIMENSIONS = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "m": {"m": 1},
    "N/m": {"kg": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "s": {"s": 1},
}
TYPES = {
    2: {"real": "Real", "integer": "Integer", "boolean": "Boolean"},
    3: {"real": "Float64", "integer": "Int32", "boolean": "Boolean"},
}
ABILITIES = {
    2: {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    },
    3: {
        "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
    },
}


@attrs.frozen
class UnitVariable:
    """One variable; its place in the table is its value reference; causality and variability are as in the standard."""

    name: str
    unit: str
    """Empty for a number without one."""
    text: str
    causality: str = "output"
    variability: str = "continuous"
    kind: str = "real"
    """Or "integer", "boolean"."""
    key: str = attrs.Factory(lambda self: self.name.upper(), takes_self=True)
    """What C calls it, after ``V_``."""


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
    """Return all variables of a unit by how its channels are controlled.

    An instrument in series makes it ``driven``; the share that slips is there where contact areas are known.
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


class Unit(NamedTuple):
    """What a description is made from."""

    identifier: str
    """Of C, and name of the binaries."""
    name: str
    text: str
    token: str
    """Which has to be the same in description and binary."""
    variables: Sequence[UnitVariable]
    starts: Mapping[str, float]
    """Of inputs and parameters, by name."""
    sources: Sequence[str]
    """C files to compile."""


def model_description(unit: Unit, version: int) -> bytes:
    """Return the description of a unit by version 2 or 3 of the standard."""
    head = {
        "fmiVersion": f"{version}.0",
        "modelName": unit.name,
        "guid" if version == 2 else "instantiationToken": unit.token,
        "description": unit.text,
        "generationTool": f"historysim {__version__}",
        "variableNamingConvention": "flat",
    }
    root = ET.Element("fmiModelDescription", head)
    interface = ET.SubElement(root, "CoSimulation", {"modelIdentifier": unit.identifier, **ABILITIES[version]})
    if version == 2:
        files = ET.SubElement(interface, "SourceFiles")
        for name in unit.sources:
            ET.SubElement(files, "File", name=name)
    units = ET.SubElement(root, "UnitDefinitions")
    for symbol, powers in DIMENSIONS.items():
        one = ET.SubElement(units, "Unit", name=symbol)
        ET.SubElement(one, "BaseUnit", {name: str(power) for name, power in powers.items()})
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusDiscard", "logStatusError", "logStatusFatal"):
        ET.SubElement(categories, "Category", name=name)
    if version == 2:
        _variables_of_2(root, unit)
    else:
        _variables_of_3(root, unit)
    return _written(root)


def build_description(unit: Unit) -> bytes:
    """Return ``sources/buildDescription.xml``, which FMI 3.0 asks for."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    one = ET.SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    options = " ".join(SAME_BITS[1:])  # but for the language
    files = ET.SubElement(one, "SourceFileSet", language="C11", compilerOptions=options)
    for name in unit.sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _written(root)


def _attributes(variable: UnitVariable, reference: int, starts: Mapping[str, float]) -> dict[str, str]:
    """Return what both versions say of a variable in the same way, but its type and start."""
    found = {"name": variable.name, "valueReference": str(reference), "description": variable.text}
    found |= {"causality": variable.causality, "variability": variable.variability}
    if variable.name in starts:
        # an input or parameter is exact by itself
        found["start"] = repr(float(starts[variable.name]))
    return found


def _typed(variable: UnitVariable) -> dict[str, str]:
    limits = {"min": "0"} if variable.name in {"friction_factor", "prescribed_normal_load"} else {}
    return limits | ({"unit": variable.unit} if variable.unit else {})


def _variables_of_2(root: ET.Element, unit: Unit) -> None:
    shown = ET.SubElement(root, "ModelVariables")
    place: dict[str, str] = {}
    outputs: list[UnitVariable] = []
    for reference, variable in enumerate(unit.variables):
        if variable.causality == "independent":
            continue
        attributes = _attributes(variable, reference, unit.starts)
        start = {"start": attributes.pop("start")} if "start" in attributes else {}
        one = ET.SubElement(shown, "ScalarVariable", attributes)
        ET.SubElement(one, TYPES[2][variable.kind], start | _typed(variable))
        place[variable.name] = str(len(place) + 1)
        if variable.causality == "output":
            outputs.append(variable)
    structure = ET.SubElement(root, "ModelStructure")
    inputs = " ".join(place[each.name] for each in unit.variables if each.causality == "input")
    listed = ET.SubElement(structure, "Outputs")
    for variable in outputs:
        ET.SubElement(listed, "Unknown", index=place[variable.name], dependencies=inputs)
    initial = ET.SubElement(structure, "InitialUnknowns")
    for variable in outputs:
        ET.SubElement(initial, "Unknown", index=place[variable.name], dependencies=place["friction_factor"])


def _variables_of_3(root: ET.Element, unit: Unit) -> None:
    shown = ET.SubElement(root, "ModelVariables")
    references = {variable.name: str(reference) for reference, variable in enumerate(unit.variables)}
    for reference, variable in enumerate(unit.variables):
        attributes = _attributes(variable, reference, unit.starts) | _typed(variable)
        ET.SubElement(shown, TYPES[3][variable.kind], attributes)
    structure = ET.SubElement(root, "ModelStructure")
    inputs = " ".join(references[each.name] for each in unit.variables if each.causality == "input")
    outputs = [each.name for each in unit.variables if each.causality == "output"]
    for name in outputs:
        ET.SubElement(structure, "Output", valueReference=references[name], dependencies=inputs)
    for name in outputs:
        factor = references["friction_factor"]
        ET.SubElement(structure, "InitialUnknown", valueReference=references[name], dependencies=factor)


def _written(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"
