"""Reduced models as texts for other programs: the springs, in the language of each."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from historysim._version import __version__
from historysim.basics.arguments import Floats
from historysim.basics.targets import OutputFormat, check_place, marked
from historysim.basics.wording import listed
from historysim.errors import InputError

# a reduced model imports this module: a text knows it by its fields
ReducedModel = Any


def form_of(output: Path, form: str | None) -> str:
    """Return the form of a file by its name, unless one is given; errors as for `ReducedModel.write`."""
    if form is not None:
        if form not in FORMS:
            raise InputError(f"form {form!r} is not known; expected one of {listed(FORMS)}")
        return form
    for name, (ending, _) in FORMS.items():
        if output.suffix.lower() == ending:
            return name
    check_place(output)
    endings = listed(list(dict.fromkeys(ending for ending, _ in FORMS.values())))
    raise InputError(f"{output}: {output.suffix or 'no'} ending; expected one of {endings}")


def format_of(form: str) -> OutputFormat:
    """Return what is written, as `check_outputs` takes it."""
    return marked("a reduced model of historysim", FORMS[form][0])


def _head(model: ReducedModel, comment: str) -> str:
    """Return lines that say what a file holds."""
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
    """Return the rows of columns (spring)."""
    return [*zip(*(column.tolist() for column in columns), strict=True)]


def _csv(model: ReducedModel, _: str) -> str:
    rows = enumerate(_rows(model.stiffness, model.limit, model.slip_displacement))
    lines = "".join(f"{number},{k!r},{f!r},{r!r}\n" for number, (k, f, r) in rows)
    return f"{_head(model, '#')}spring,stiffness [N/m],limit [N],slip_displacement [m]\n{lines}"


def _opensees(model: ReducedModel, _: str) -> str:
    rows = [*enumerate(_rows(model.stiffness, model.slip_displacement), start=1)]
    lines = "".join(f"uniaxialMaterial ElasticPP [expr $tag + {i}] {k!r} {r!r}\n" for i, (k, r) in rows)
    tags = " ".join(f"[expr $tag + {i}]" for i, _ in rows)
    return f"""{_head(model, "#")}\
# Set tag before; the tags above it, one for each spring, have to be free. Force in N, deformation in m.
if {{![info exists tag]}} {{ set tag 1 }}
{lines}uniaxialMaterial Parallel $tag {tags}
"""


def _in_python(model: ReducedModel, text: str, of_rows: str, second: Floats, function: str) -> str:
    """Return a module with the springs, a row of stiffness and a second number each, and a function of them."""
    rows = "".join(f"    ({k!r}, {value!r}),\n" for k, value in _rows(model.stiffness, second))
    return f'''{_head(model, "#")}"""{text}"""\n\nSPRINGS = [  # {of_rows}\n{rows}]\n\n\n{function}'''


def _openseespy(model: ReducedModel, _: str) -> str:
    text = "Make the contact a uniaxial material of OpenSees: force in N, deformation in m."
    of_rows = "stiffness [N/m], displacement at which it slides [m]"
    function = '''def contact(ops, tag):
    """Define material `tag`; the tags above it, one for each spring, have to be free."""
    for number, (stiffness, slip) in enumerate(SPRINGS, start=1):
        ops.uniaxialMaterial("ElasticPP", tag + number, stiffness, slip)
    ops.uniaxialMaterial("Parallel", tag, *range(tag + 1, tag + 1 + len(SPRINGS)))
'''
    return _in_python(model, text, of_rows, model.slip_displacement, function)


def _tmdsimpy(model: ReducedModel, _: str) -> str:
    function = '''def contact(force, Q, T):
    """Return nonlinear forces, to be added to a VibrationSystem; `force` is TMDSimPy's JenkinsForce."""
    return [force(Q, T, stiffness, limit) for stiffness, limit in SPRINGS]
'''
    text = "The contact as nonlinear forces of TMDSimPy."
    return _in_python(model, text, "kt [N/m], Fs [N]", model.limit, function)


def _pyharm(model: ReducedModel, _: str) -> str:
    elements = {
        f"contact_{number}": {"type": "Jenkins", "k": k, "mu": 1.0, "N0": limit}
        for number, (k, limit) in enumerate(_rows(model.stiffness, model.limit), start=1)
    }
    return f'''{_head(model, "#")}\
"""The contact as elements of pyHarm. Give each of them `connect` and `dirs` of your structure."""

ELEMENTS = {json.dumps(elements, indent=4)}


def contact(connect, dirs):
    """Return the elements between two nodes, for the dictionary `elements` of pyHarm's input."""
    return {{name: {{**one, "connect": connect, "dirs": dirs}} for name, one in ELEMENTS.items()}}
'''


def _check_name(name: str, what: str) -> None:
    if not name.isidentifier() or not name.isascii():
        raise InputError(f"{name} is no name of a {what}; expected a file called by letters, digits and _")


def _matlab(model: ReducedModel, name: str) -> str:
    _check_name(name, "function of MATLAB")
    scaling, extra, load, at = model.scaling, "", "", ""
    tables = f"k = [{_matlab_row(model.stiffness)}];\nf = [{_matlab_row(model.limit)}];\n"
    if scaling is not None:
        extra, load, at = ", normal_load", ", N", " at the normal load N [N]"
        tables = f"""load = [{_matlab_row(scaling.normal_load)}];
stiffness = {_matlab_table(scaling.stiffness)};
limit = {_matlab_table(scaling.limit)};
k = interp1(load, stiffness, normal_load);
f = interp1(load, limit, normal_load);
"""
    return f"""function [T, state] = {name}(U, state{extra})
{_head(model, "%")}\
% [T, state] = {name}(U, state{load}) carries the contact to the displacement U [m]{at}.
% Begin with state = []. To try a step, keep the state of before. T is the tangential load [N].
{tables}if isempty(state)
  state = struct('U', 0, 'F', zeros(1, numel(k)), 'k', k);
end
state.F = max(min(state.F + 0.5*(state.k + k) .* (U - state.U), f), -f);
state.U = U;
state.k = k;
T = sum(state.F);
end
"""


def _matlab_table(rows: Floats) -> str:
    return "[\n" + "".join(f"  {_matlab_row(row)}\n" for row in rows) + "]"


def _matlab_row(values: Floats) -> str:
    return " ".join(map(repr, values.tolist()))


def _modelica(model: ReducedModel, name: str) -> str:
    _check_name(name, "model of Modelica")
    stiffness, limit = ("{" + ", ".join(map(repr, each.tolist())) + "}" for each in (model.stiffness, model.limit))
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


# What is written, by name: the ending that chooses it, and the text of a model for a file of a name.
FORMS: dict[str, tuple[str, Callable[[ReducedModel, str], str]]] = {
    "json": (".json", _json),
    "csv": (".csv", _csv),
    "modelica": (".mo", _modelica),
    "matlab": (".m", _matlab),
    "opensees": (".tcl", _opensees),
    "openseespy": (".py", _openseespy),
    "pyharm": (".py", _pyharm),
    "tmdsimpy": (".py", _tmdsimpy),
}
