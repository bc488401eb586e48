"""`ReducedModel`: springs in place of a contact, which go to files for other programs and come back from JSON."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Self

import attrs

from historysim._version import __version__
from historysim.basics.arguments import Floats
from historysim.basics.files import beginning, replacing
from historysim.basics.targets import Output, check_outputs, check_place, marked
from historysim.basics.wording import html_table, listed
from historysim.errors import InputError
from historysim.exchange.reduced.springs import FORMAT, Springs
from historysim.results.plots.pictures import figure_of
from historysim.results.report.page import page_of
from historysim.results.result_files import FILES, FileKind

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place


def write_springs(model: Springs, output: Path, *, form: str | None, force: bool) -> None:
    """Write springs for another program; see `ReducedModel.write`."""
    name = form_of(output, form)
    check_outputs([output_of(output, name)], [], force=force)
    with replacing(output) as unfinished:
        unfinished.write_text(FORMS[name][1](model, output.stem), encoding="utf-8", newline="\n")


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


def output_of(output: Path, form: str) -> Output:
    """Return what is written, as `check_outputs` takes it."""
    return Output(output, (marked("a reduced model of historysim", FORMS[form][0]),))


# ---- texts ----------------------------------------------------------------------------------------------------------


def _head(model: Springs, comment: str) -> str:
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


def _json(model: Springs, _: str) -> str:
    return json.dumps({"generator": f"historysim {__version__}", **model.as_dict()}, indent=1, allow_nan=False) + "\n"


def _csv(model: Springs, _: str) -> str:
    lines = ["spring,stiffness [N/m],limit [N],slip_displacement [m]"]
    rows = _rows(model.stiffness, model.limit, model.slip_displacement)
    lines += [f"{number},{k!r},{f!r},{r!r}" for number, (k, f, r) in enumerate(rows)]
    return _head(model, "#") + "\n".join(lines) + "\n"


def _rows(*columns: Floats) -> list[tuple[float, ...]]:
    """Return the rows of columns (spring)."""
    return [*zip(*(column.tolist() for column in columns), strict=True)]


def _python_rows(what: str, *columns: Floats) -> str:
    """Return the rows of columns (spring) as a list in Python."""
    rows = "".join(f"    ({', '.join(map(repr, row))}),\n" for row in _rows(*columns))
    return f"SPRINGS = [  # {what}\n{rows}]\n\n\n"


def _opensees(model: Springs, _: str) -> str:
    rows = [*enumerate(_rows(model.stiffness, model.slip_displacement), start=1)]
    lines = [f"uniaxialMaterial ElasticPP [expr $tag + {i}] {k!r} {r!r}" for i, (k, r) in rows]
    tags = " ".join(f"[expr $tag + {i}]" for i, _ in rows)
    return (
        _head(model, "#")
        + "# Set tag before; the tags above it, one for each spring, have to be free. Force in N, deformation in m.\n"
        + "if {![info exists tag]} { set tag 1 }\n"
        + "\n".join(lines)
        + f"\nuniaxialMaterial Parallel $tag {tags}\n"
    )


def _openseespy(model: Springs, _: str) -> str:
    return (
        _head(model, "#")
        + '"""Make the contact a uniaxial material of OpenSees: force in N, deformation in m."""\n\n'
        + _python_rows("stiffness [N/m], displacement at which it slides [m]", model.stiffness, model.slip_displacement)
        + "def contact(ops, tag):\n"
        + '    """Define material `tag`; the tags above it, one for each spring, have to be free."""\n'
        + "    for number, (stiffness, slip) in enumerate(SPRINGS, start=1):\n"
        + '        ops.uniaxialMaterial("ElasticPP", tag + number, stiffness, slip)\n'
        + '    ops.uniaxialMaterial("Parallel", tag, *range(tag + 1, tag + 1 + len(SPRINGS)))\n'
    )


def _pyharm(model: Springs, _: str) -> str:
    elements = {
        f"contact_{number}": {"type": "Jenkins", "k": k, "mu": 1.0, "N0": limit}
        for number, (k, limit) in enumerate(_rows(model.stiffness, model.limit), start=1)
    }
    return (
        _head(model, "#")
        + '"""The contact as elements of pyHarm. Give each of them `connect` and `dirs` of your structure."""\n\n'
        + "ELEMENTS = "
        + json.dumps(elements, indent=4)
        + "\n\n\n"
        + "def contact(connect, dirs):\n"
        + '    """Return the elements between two nodes, for the dictionary `elements` of pyHarm\'s input."""\n'
        + '    return {name: {**one, "connect": connect, "dirs": dirs} for name, one in ELEMENTS.items()}\n'
    )


def _tmdsimpy(model: Springs, _: str) -> str:
    return (
        _head(model, "#")
        + '"""The contact as nonlinear forces of TMDSimPy."""\n\n'
        + _python_rows("kt [N/m], Fs [N]", model.stiffness, model.limit)
        + "def contact(force, Q, T):\n"
        + '    """Return nonlinear forces, to be added to a VibrationSystem; `force` is TMDSimPy\'s JenkinsForce."""\n'
        + "    return [force(Q, T, stiffness, limit) for stiffness, limit in SPRINGS]\n"
    )


def _matlab(model: Springs, name: str) -> str:
    if not name.isidentifier() or not name.isascii():
        raise InputError(f"{name}.m: is no name of a function of MATLAB; expected letters, digits and _")
    scaling, more = model.scaling, model.scaling is not None
    tables = f"k = [{_matlab_row(model.stiffness)}];\nf = [{_matlab_row(model.limit)}];\n"
    if scaling is not None:
        tables = (
            f"load = [{_matlab_row(scaling.normal_load)}];\nstiffness = {_matlab_table(scaling.stiffness)};\n"
            f"limit = {_matlab_table(scaling.limit)};\n"
            "k = interp1(load, stiffness, normal_load);\nf = interp1(load, limit, normal_load);\n"
        )
    return (
        f"function [T, state] = {name}(U, state{', normal_load' if more else ''})\n"
        + _head(model, "%")
        + f"% [T, state] = {name}(U, state{', N' if more else ''}) carries the contact to the displacement U [m]"
        + (" at the normal load N [N]" if more else "")
        + ".\n% Begin with state = []. To try a step, keep the state of before. T is the tangential load [N].\n"
        + tables
        + "if isempty(state)\n  state = struct('U', 0, 'F', zeros(1, numel(k)), 'k', k);\nend\n"
        + "state.F = max(min(state.F + 0.5*(state.k + k) .* (U - state.U), f), -f);\n"
        + "state.U = U;\nstate.k = k;\nT = sum(state.F);\nend\n"
    )


def _matlab_table(rows: Floats) -> str:
    return "[\n" + "".join(f"  {_matlab_row(row)}\n" for row in rows) + "]"


def _matlab_row(values: Floats) -> str:
    return " ".join(map(repr, values.tolist()))


def _modelica(model: Springs, name: str) -> str:
    if not name.isidentifier() or not name.isascii():
        raise InputError(f"{name}.mo: is no name of a model of Modelica; expected letters, digits and _")
    stiffness, limit = ("{" + ", ".join(map(repr, each.tolist())) + "}" for each in (model.stiffness, model.limit))
    return (
        _head(model, "//")
        + f'model {name} "Springs in parallel that slide, in place of a rough frictional contact"\n'
        + "  extends Modelica.Mechanics.Translational.Interfaces.PartialCompliantWithRelativeStates;\n"
        + f'  parameter Modelica.Units.SI.TranslationalSpringConstant k[:] = {stiffness} "of each spring";\n'
        + f'  parameter Modelica.Units.SI.Force limit[size(k, 1)] = {limit} "at which each slides";\n'
        + '  Modelica.Units.SI.Force force[size(k, 1)](each start = 0, each fixed = true) "of each spring";\n'
        + "equation\n"
        + "  for i in 1:size(k, 1) loop\n"
        + "    der(force[i]) = if (force[i] >= limit[i] and v_rel > 0) or (force[i] <= -limit[i] and v_rel < 0)\n"
        + "      then 0 else k[i]*v_rel;\n"
        + "  end for;\n"
        + "  f = sum(force);\n"
        + f"end {name};\n"
    )


FORMS: dict[str, tuple[str, Callable[[Springs, str], str]]] = {
    "json": (".json", _json),
    "csv": (".csv", _csv),
    "modelica": (".mo", _modelica),
    "matlab": (".m", _matlab),
    "opensees": (".tcl", _opensees),
    "openseespy": (".py", _openseespy),
    "pyharm": (".py", _pyharm),
    "tmdsimpy": (".py", _tmdsimpy),
}
"""What is written, by name: the ending that chooses it, and the text of a model for a file of a name."""


@attrs.frozen(eq=False)
class ReducedModel(Springs):
    """Springs in parallel that slide, in place of a contact; see `Springs` for what stands in it."""

    def _repr_html_(self) -> str:
        return html_table(self.summary())

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a model from the JSON file that `write` has written.

        Raises
        ------
        InputError
            The file is damaged, or from another version.
        """
        try:
            return cls.from_dict(json.loads(Path(path).read_text(encoding="utf-8")))
        except (OSError, ValueError, RecursionError, InputError) as error:
            raise InputError(f"{path}: {error}") from error

    def write(self, output: str | Path, *, form: str | None = None, force: bool = False) -> None:
        """Write the model for another program.

        Parameters
        ----------
        output : path
            Its ending says for which: .json, .csv, .m (MATLAB), .mo (Modelica), .tcl (OpenSees), .py (OpenSeesPy).
        form : str, optional
            ``"pyharm"`` or ``"tmdsimpy"`` for a .py of these programs.
        force : bool
            Replace a file that is none of historysim, too.

        Raises
        ------
        InputError
            An ending or form that is not known, or a file of somebody else.
        OSError
            It cannot be written.
        """
        write_springs(self, Path(output), form=form, force=force)


@FILES.register
class ReducedFile(FileKind):
    """A reduced model (JSON), as ``historysim reduce`` writes it."""

    kind = "reduced model"

    @classmethod
    def is_one(cls, path: Path) -> bool:
        """Return whether a file says that it is one."""
        return path.suffix.lower() == ".json" and FORMAT[:-1].encode() in beginning(path, 1024)

    @classmethod
    def read(cls, path: Path) -> ReducedModel:
        """Return the model."""
        return ReducedModel.read(path)


@figure_of.register(ReducedModel)
def _figure(model: ReducedModel, *, place: "Place", **_: object) -> "FigureOrAxes":
    from historysim.exchange.reduced.reduced_picture import ReducedPicture

    return ReducedPicture().figure(model, place)


@page_of.register(ReducedModel)
def _page(model: ReducedModel) -> str:
    from historysim.exchange.reduced.reduced_picture import reduced_page

    return reduced_page(model)
