"""Variables of a co-simulation unit, and its `modelDescription.xml` by FMI 2.0 and 3.0."""

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
    """Variable of a unit; its index in the table is its value reference; causality and variability as in FMI."""

    name: str
    unit: str  #: empty for a number without a unit
    text: str
    causality: str = "output"
    variability: str = "continuous"
    kind: str = "real"  #: or "integer", "boolean"
    #: its C macro is ``V_`` and this key
    key: str = attrs.Factory(lambda self: self.name.upper(), takes_self=True)


_END = "at the end of the next step"
_APPROACH = "approach of the highest summit from first touch"
NORMAL = {
    "load": ("prescribed_normal_load", "N", f"total normal load {_END}, 0 or more"),
    "displacement": ("prescribed_approach", "m", f"{_APPROACH} {_END}; negative is a gap"),
}
TANGENTIAL = {
    "load": ("prescribed_tangential_load", "N", f"total tangential load {_END}"),
    "displacement": (
        "prescribed_tangential_displacement",
        "m",
        f"rigid tangential displacement {_END}",
    ),
}
DRIVEN = (
    "prescribed_drive_displacement",
    "m",
    f"displacement of the instrument's drive, U + T/k, {_END}",
)
FACTOR = (
    "friction_factor",
    "",
    "factor on all friction coefficients of the start state, 0 or more",
)
_DRIVE = "displacement of the instrument's drive, U + T/k; that of the contact where the instrument is rigid"
_SIDE = "on the side of the last step"
_HELD = "whether a tangential load is held at the friction limit, since more was asked for"

OUTPUTS = (
    UnitVariable("normal_load", "N", "total normal load"),
    UnitVariable("tangential_load", "N", "total tangential load"),
    UnitVariable("approach", "m", f"{_APPROACH}; negative is a gap"),
    UnitVariable("tangential_displacement", "m", "rigid tangential displacement of the contact"),
    UnitVariable("drive_displacement", "m", _DRIVE),
    UnitVariable(
        "tangential_stiffness", "N/m", f"dT/dU of the contact at a held approach, {_SIDE}"
    ),
    UnitVariable(
        "coupling_stiffness", "N/m", f"dT/dd at a held displacement, d the approach, {_SIDE}"
    ),
    UnitVariable("normal_stiffness", "N/m", "dN/dd, d the approach"),
    UnitVariable("dissipated_energy", "J", "energy that friction has taken since nothing touched"),
    UnitVariable("slipping_share", "", "share of the contact area outside the stick radii"),
    UnitVariable(
        "contact_count",
        "",
        "asperities, or patches, that touch",
        variability="discrete",
        kind="integer",
    ),
    UnitVariable("saturated", "", _HELD, variability="discrete", kind="boolean"),
)


def variables(
    normal: str, tangential: str, *, driven: bool, areas: bool, directions: int = 1
) -> tuple[UnitVariable, ...]:
    """Return all variables of a unit, by the control of its channels and its number of tangential directions.

    A unit with an instrument in series is ``driven``; the slipping fraction exists if contact areas
    are known.
    """
    tangential_input = DRIVEN if driven and tangential == "displacement" else TANGENTIAL[tangential]
    table = (
        UnitVariable(*NORMAL[normal], "input", key="PRESCRIBED_NORMAL"),
        UnitVariable(*tangential_input, "input", key="PRESCRIBED_TANGENTIAL"),
        UnitVariable(*FACTOR, "parameter", "tunable"),
        *(variable for variable in OUTPUTS if areas or variable.name != "slipping_share"),
        UnitVariable("time", "s", "time", "independent"),
    )
    return (
        table
        if directions == 1
        else tuple(component for entry in table for component in _split_into_components(entry))
    )


def _split_into_components(variable: UnitVariable) -> Iterator[UnitVariable]:
    """Yield the variables that replace a variable in two tangential directions: itself, components, or none."""
    if variable.name == "tangential_stiffness":
        for suffix, derivative in (
            ("xx", "dTx/dUx"),
            ("xy", "dTx/dUy, which is dTy/dUx,"),
            ("yy", "dTy/dUy"),
        ):
            key = variable.key if suffix == "xx" else f"{variable.key}_{suffix.upper()}"
            yield attrs.evolve(
                variable,
                name=f"{variable.name}_{suffix}",
                key=key,
                text=variable.text.replace("dT/dU", derivative),
            )
    elif "tangential" in variable.name or "drive" in variable.name:
        yield attrs.evolve(variable, name=f"{variable.name}_x", text=f"{variable.text}; in x")
        yield attrs.evolve(
            variable,
            name=f"{variable.name}_y",
            key=f"{variable.key}_Y",
            text=f"{variable.text}; in y",
        )
    elif variable.name != "coupling_stiffness":
        yield variable


class Unit(NamedTuple):
    """Contents of a unit description."""

    identifier: str  #: identifier in C, and name of the binaries
    name: str
    text: str
    token: str  #: has to be equal in description and binary
    variables: Sequence[UnitVariable]
    starts: Mapping[str, float]  #: start values of inputs and parameters, by name
    sources: Sequence[str]  #: C files to compile
    directions: int = 1  #: number of tangential directions


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
    capabilities = {
        name: value
        for name, value in ABILITIES[version].items()
        if unit.directions == 1 or not name.startswith("providesDirectional")
    }
    interface = ET.SubElement(
        root, "CoSimulation", {"modelIdentifier": unit.identifier, **capabilities}
    )
    if version == 2:
        files = ET.SubElement(interface, "SourceFiles")
        for name in unit.sources:
            ET.SubElement(files, "File", name=name)
    units = ET.SubElement(root, "UnitDefinitions")
    for symbol, powers in DIMENSIONS.items():
        definition = ET.SubElement(units, "Unit", name=symbol)
        ET.SubElement(definition, "BaseUnit", {name: str(power) for name, power in powers.items()})
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusDiscard", "logStatusError", "logStatusFatal"):
        ET.SubElement(categories, "Category", name=name)
    _list_variables(root, unit, version)
    return _serialise(root)


def build_description(unit: Unit) -> bytes:
    """Return ``sources/buildDescription.xml``, which FMI 3.0 requires."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    options = " ".join(SAME_BITS[1:])  # without the language
    files = ET.SubElement(configuration, "SourceFileSet", language="C11", compilerOptions=options)
    for name in unit.sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _serialise(root)


def _list_variables(root: ET.Element, unit: Unit, version: int) -> None:
    """Add the variables and the dependencies of outputs on inputs."""
    declarations, structure = (
        ET.SubElement(root, name) for name in ("ModelVariables", "ModelStructure")
    )
    # version 2 counts variables from 1 and does not list the time, which is last
    listed = [
        unit_variable
        for unit_variable in unit.variables
        if version == 3 or unit_variable.causality != "independent"
    ]
    number = {
        unit_variable.name: str(index)
        for index, unit_variable in enumerate(listed, start=1 if version == 2 else 0)
    }
    for reference, variable in enumerate(listed):
        attributes = {
            "name": variable.name,
            "valueReference": str(reference),
            "description": variable.text,
        }
        attributes |= {"causality": variable.causality, "variability": variable.variability}
        # the initial value of an input or parameter is exact by default
        typed = (
            {"start": repr(float(unit.starts[variable.name]))}
            if variable.name in unit.starts
            else {}
        )
        typed |= (
            {"min": "0"} if variable.name in {"friction_factor", "prescribed_normal_load"} else {}
        )
        typed |= {"unit": variable.unit} if variable.unit else {}
        if version == 2:
            ET.SubElement(
                ET.SubElement(declarations, "ScalarVariable", attributes),
                TYPES[2][variable.kind],
                typed,
            )
        else:
            ET.SubElement(declarations, TYPES[3][variable.kind], attributes | typed)
    inputs, outputs = (
        [number[v.name] for v in listed if v.causality == causality]
        for causality in ("input", "output")
    )
    for tag, dependencies in (
        ("Output", " ".join(inputs)),
        ("InitialUnknown", number["friction_factor"]),
    ):
        parent = ET.SubElement(structure, f"{tag}s") if version == 2 else structure
        name, index_name = ("Unknown", "index") if version == 2 else (tag, "valueReference")
        for output in outputs:
            ET.SubElement(parent, name, {index_name: output, "dependencies": dependencies})


def _serialise(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"
