"""The variables of a unit of co-simulation, and `modelDescription.xml` by FMI 2.0 and 3.0, which lists them."""

from collections.abc import Iterator, Mapping, Sequence
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
    unit: str  #: empty for a number without one
    text: str
    causality: str = "output"
    variability: str = "continuous"
    kind: str = "real"  #: or "integer", "boolean"
    key: str = attrs.Factory(lambda self: self.name.upper(), takes_self=True)  #: what C calls it, after ``V_``


_END = "at the end of the next step"
_APPROACH = "approach of the highest summit from first touch"
NORMAL = {
    "load": ("prescribed_normal_load", "N", f"total normal load {_END}, 0 or more"),
    "displacement": ("prescribed_approach", "m", f"{_APPROACH} {_END}; negative is a gap"),
}
TANGENTIAL = {
    "load": ("prescribed_tangential_load", "N", f"total tangential load {_END}"),
    "displacement": ("prescribed_tangential_displacement", "m", f"rigid tangential displacement {_END}"),
}
DRIVEN = ("prescribed_drive_displacement", "m", f"displacement of the instrument's drive, U + T/k, {_END}")
FACTOR = ("friction_factor", "", "factor on all friction coefficients of the start state, 0 or more")
_DRIVE = "displacement of the instrument's drive, U + T/k; that of the contact where the instrument is rigid"
_SIDE = "on the side of the last step"
_HELD = "whether a tangential load is held at the friction limit, since more was asked for"

OUTPUTS = (
    UnitVariable("normal_load", "N", "total normal load"),
    UnitVariable("tangential_load", "N", "total tangential load"),
    UnitVariable("approach", "m", f"{_APPROACH}; negative is a gap"),
    UnitVariable("tangential_displacement", "m", "rigid tangential displacement of the contact"),
    UnitVariable("drive_displacement", "m", _DRIVE),
    UnitVariable("tangential_stiffness", "N/m", f"dT/dU of the contact at a held approach, {_SIDE}"),
    UnitVariable("coupling_stiffness", "N/m", f"dT/dd at a held displacement, d the approach, {_SIDE}"),
    UnitVariable("normal_stiffness", "N/m", "dN/dd, d the approach"),
    UnitVariable("dissipated_energy", "J", "energy that friction has taken since nothing touched"),
    UnitVariable("slipping_share", "", "share of the contact area outside the stick radii"),
    UnitVariable("contact_count", "", "asperities, or patches, that touch", variability="discrete", kind="integer"),
    UnitVariable("saturated", "", _HELD, variability="discrete", kind="boolean"),
)


def variables(
    normal: str, tangential: str, *, driven: bool, areas: bool, directions: int = 1
) -> tuple[UnitVariable, ...]:
    """Return all variables of a unit by how its channels are controlled, and how many tangential directions it has.

    An instrument in series makes it ``driven``; the share that slips is there where contact areas are known.
    """
    moved = DRIVEN if driven and tangential == "displacement" else TANGENTIAL[tangential]
    table = (
        UnitVariable(*NORMAL[normal], "input", key="PRESCRIBED_NORMAL"),
        UnitVariable(*moved, "input", key="PRESCRIBED_TANGENTIAL"),
        UnitVariable(*FACTOR, "parameter", "tunable"),
        *(each for each in OUTPUTS if areas or each.name != "slipping_share"),
        UnitVariable("time", "s", "time", "independent"),
    )
    return table if directions == 1 else tuple(each for one in table for each in _in_plane(one))


def _in_plane(one: UnitVariable) -> Iterator[UnitVariable]:
    """Yield what a variable is in two tangential directions: itself, its components, or nothing."""
    if one.name == "tangential_stiffness":
        for ends, what in (("xx", "dTx/dUx"), ("xy", "dTx/dUy, which is dTy/dUx,"), ("yy", "dTy/dUy")):
            key = one.key if ends == "xx" else f"{one.key}_{ends.upper()}"
            yield attrs.evolve(one, name=f"{one.name}_{ends}", key=key, text=one.text.replace("dT/dU", what))
    elif "tangential" in one.name or "drive" in one.name:
        yield attrs.evolve(one, name=f"{one.name}_x", text=f"{one.text}; in x")
        yield attrs.evolve(one, name=f"{one.name}_y", key=f"{one.key}_Y", text=f"{one.text}; in y")
    elif one.name != "coupling_stiffness":
        yield one


class Unit(NamedTuple):
    """What a description is made from."""

    identifier: str  #: of C, and name of the binaries
    name: str
    text: str
    token: str  #: which has to be the same in description and binary
    variables: Sequence[UnitVariable]
    starts: Mapping[str, float]  #: of inputs and parameters, by name
    sources: Sequence[str]  #: C files to compile
    directions: int = 1  #: tangential ones


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
    able = {
        name: value
        for name, value in ABILITIES[version].items()
        if unit.directions == 1 or not name.startswith("providesDirectional")
    }
    interface = ET.SubElement(root, "CoSimulation", {"modelIdentifier": unit.identifier, **able})
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
    _list_variables(root, unit, version)
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


def _list_variables(root: ET.Element, unit: Unit, version: int) -> None:
    """List the variables, and which outputs depend on which inputs."""
    shown, structure = (ET.SubElement(root, name) for name in ("ModelVariables", "ModelStructure"))
    # version 2 counts variables from 1, and has none of the time, which is the last
    listed = [each for each in unit.variables if version == 3 or each.causality != "independent"]
    number = {each.name: str(place) for place, each in enumerate(listed, start=1 if version == 2 else 0)}
    for reference, variable in enumerate(listed):
        attributes = {"name": variable.name, "valueReference": str(reference), "description": variable.text}
        attributes |= {"causality": variable.causality, "variability": variable.variability}
        # an input or parameter is exact by itself
        typed = {"start": repr(float(unit.starts[variable.name]))} if variable.name in unit.starts else {}
        typed |= {"min": "0"} if variable.name in {"friction_factor", "prescribed_normal_load"} else {}
        typed |= {"unit": variable.unit} if variable.unit else {}
        if version == 2:
            ET.SubElement(ET.SubElement(shown, "ScalarVariable", attributes), TYPES[2][variable.kind], typed)
        else:
            ET.SubElement(shown, TYPES[3][variable.kind], attributes | typed)
    inputs, outputs = (
        [number[v.name] for v in listed if v.causality == causality] for causality in ("input", "output")
    )
    for tag, needed in (("Output", " ".join(inputs)), ("InitialUnknown", number["friction_factor"])):
        parent = ET.SubElement(structure, f"{tag}s") if version == 2 else structure
        name, of = ("Unknown", "index") if version == 2 else (tag, "valueReference")
        for output in outputs:
            ET.SubElement(parent, name, {of: output, "dependencies": needed})


def _written(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"
