"""Files of reduced models for other programs: the springs in the language of each program."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from historysim._version import __version__
from historysim.basics.arguments import Floats
from historysim.basics.targets import OutputFormat, check_place, signed_format
from historysim.basics.wording import join_words
from historysim.errors import InputError

# reduced_model imports this module, so the type is not imported here
ReducedModel = Any


def select_format(output: Path) -> OutputFormat:
    """Return the format of an output by its extension; InputError for an unknown extension."""
    extension = output.suffix.lower()
    if extension not in FORMATS:
        check_place(output)
        raise InputError(f"{output}: {output.suffix or 'no'} ending; expected one of {join_words(FORMATS)}")
    return signed_format("a reduced model of historysim", extension)


def _head(model: ReducedModel, comment: str) -> str:
    """Return the comment lines at the head of a file."""
    lines = [
        f"Reduced model of a rough frictional contact, made by historysim {__version__}.",
        f"{model.title}",
        f"{len(model)} springs in parallel that slide, for a normal load of {model.normal_load:.9g} N.",
        f"Error of the tangential load of every history at that load: at most {model.bound:.3g} of the friction limit,",
        f"{model.bound * model.friction_limit:.6g} of {model.friction_limit:.6g} N.",
        f"Error of the energy of a closed loop: at most {model.energy_bound:.6g} J.",
    ]
    if model.scaling is not None:
        lines.append("Where the normal load varies no bound is known; found, over the friction limit:")
        lines += [f"  {name}: {value:.3g}" for name, value in model.errors.items()]
    return "".join(f"{comment} {' '.join(line.split())}\n" for line in lines)


def _json(model: ReducedModel, _: str) -> str:
    return json.dumps({"generator": f"historysim {__version__}", **model.as_dict()}, indent=1, allow_nan=False) + "\n"


def _rows(*columns: Floats) -> list[tuple[float, ...]]:
    """Transpose columns (spring) into rows."""
    return [*zip(*(column.tolist() for column in columns), strict=True)]


def _opensees(model: ReducedModel, _: str) -> str:
    rows = [*enumerate(_rows(model.stiffness, model.slip_displacement), start=1)]
    lines = "".join(f"uniaxialMaterial ElasticPP [expr $tag + {i}] {k!r} {r!r}\n" for i, (k, r) in rows)
    tags = " ".join(f"[expr $tag + {i}]" for i, _ in rows)
    return f"""{_head(model, "#")}\
# Set tag before; the tags above it, one for each spring, have to be free. Force in N, deformation in m.
if {{![info exists tag]}} {{ set tag 1 }}
{lines}uniaxialMaterial Parallel $tag {tags}
"""


def _openseespy(model: ReducedModel, _: str) -> str:
    rows = "".join(f"    ({k!r}, {slip!r}),\n" for k, slip in _rows(model.stiffness, model.slip_displacement))
    return f'''{_head(model, "#")}"""Make the contact a uniaxial material of OpenSees: force in N, deformation in m."""

SPRINGS = [  # stiffness [N/m], displacement at which it slides [m]
{rows}]


def contact(ops, tag):
    """Define material `tag`; the tags above it, one for each spring, have to be free."""
    for number, (stiffness, slip) in enumerate(SPRINGS, start=1):
        ops.uniaxialMaterial("ElasticPP", tag + number, stiffness, slip)
    ops.uniaxialMaterial("Parallel", tag, *range(tag + 1, tag + 1 + len(SPRINGS)))
'''


def _modelica(model: ReducedModel, name: str) -> str:
    if not name.isidentifier() or not name.isascii():
        raise InputError(f"{name} is not a name of a Modelica model; expected a file name of letters, digits and _")
    stiffness, limit = ("{" + ", ".join(map(repr, values.tolist())) + "}" for values in (model.stiffness, model.limit))
    return f"""{_head(model, "//")}\
model {name} "Springs in parallel that slide, in place of a rough frictional contact"
  extends Modelica.Mechanics.Translational.Interfaces.PartialCompliantWithRelativeStates;
  parameter Modelica.Units.SI.TranslationalSpringConstant k[:] = {stiffness} "of each spring";
  parameter Modelica.Units.SI.Force limit[size(k, 1)] = {limit} "at which each slides";
  Modelica.Units.SI.Force force[size(k, 1)](each start = 0, each fixed = true) "of each spring";
equation
  for i in 1:size(k, 1) loop
    der(force[i]) = if (force[i] >= limit[i] and v_rel > 0) or (force[i] <= -limit[i] and v_rel < 0)
      then 0 else k[i]*v_rel;
  end for;
  f = sum(force);
end {name};
"""


# Formats by file extension: the function that returns the content of a file for a model and the stem of its path.
FORMATS: dict[str, Callable[[ReducedModel, str], str]] = {
    ".json": _json,
    ".mo": _modelica,
    ".tcl": _opensees,
    ".py": _openseespy,
}
