"""`ReducedModel`: springs in place of a contact, which go to files for other programs and come back from JSON."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Self

import attrs
import numpy as np

from historysim._version import __version__
from historysim.basics.arguments import Floats
from historysim.basics.files import beginning, replacing
from historysim.basics.targets import Output, check_outputs, check_place, marked
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table, listed
from historysim.errors import InputError
from historysim.exchange.reduced.springs import FORMAT, Springs
from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import Picture, figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, scaled, zero_lines
from historysim.results.report.page import Section, page, page_of, paragraph, picture, table
from historysim.results.result_files import FILES, FileKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


# What is written, by name: the ending that chooses it, and the text of a model for a file of a name.
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
    return ReducedPicture().figure(model, place)


@page_of.register(ReducedModel)
def _page(model: ReducedModel) -> str:
    return reduced_page(model)


SPRINGS = STATE_COLOURS[2]
NO_BREAK = "\u00a0"
CAPTION = (
    "The virgin curve and a loop of the contact and of its springs at the normal load of the model, the band in which "
    "the springs are for every history there, and the force at which each spring slides."
)
AMPLITUDE = 0.8  # of the loop, over the displacement at which everything slides


@attrs.frozen(kw_only=True)
class ReducedPicture(Picture):
    """The virgin curve and a loop of a contact and of its reduced model, the band of the bound, and the springs.

    Loads stand over the displacement at the normal load of the model; below them the force at which each spring slides
    over the displacement at which it does.
    """

    kind, of, size, alone = "reduced", (Springs,), (COLUMN, 120.0), True

    def draw(self, canvas: Canvas, data: Springs) -> None:
        """Draw both, or the loop alone."""
        loop, spectrum = canvas.two(("loop", "springs"), 1.5, stacked=1.6)
        _draw_loop(loop, data)
        canvas.legend(loop)
        canvas.heading(data.title, f"at a normal load of {quantity_text(data.normal_load, 'N')}")
        if spectrum is not None:
            _draw_springs(spectrum, data)


def _branches(model: Springs) -> tuple[list[Floats], list[Floats]]:
    """Return displacements [m] and loads [N] of the contact on the virgin curve and on both branches of a loop."""
    within = model.virgin_displacement <= AMPLITUDE * model.virgin_displacement[-1]
    way, load = model.virgin_displacement[within], model.virgin_load[within]
    # at a constant normal load a branch is the virgin curve, twice as large (Masing)
    return [way, way[-1] - 2 * way, 2 * way - way[-1]], [load, load[-1] - 2 * load, 2 * load - load[-1]]


def _draw_loop(axes: "Axes", model: Springs) -> None:
    ways, exact = _branches(model)
    reduced, band = model.force(np.concatenate(ways)), model.bound * model.friction_limit
    along, length_unit = scaled(np.concatenate(ways), "m")
    loads, load_unit = scaled(np.stack([np.concatenate(exact), reduced, np.full(reduced.size, band)]), "N")
    zero_lines(axes)
    # each branch by itself: a band is a function of the displacement there
    for part, name in zip(np.split(np.arange(along.size), 3), ("bound", None, None), strict=True):
        low, high = loads[0, part] - loads[2, part], loads[0, part] + loads[2, part]
        axes.fill_between(along[part], low, high, color=FAINT, alpha=0.3, linewidth=0, label=name, zorder=1)
    axes.plot(along, loads[0], color=INK, linewidth=0.9, label="contact")
    axes.plot(along, loads[1], color=SPRINGS, linewidth=0.7, linestyle="--", label=f"{len(model)} springs")
    axes.set(xlabel=f"tangential displacement $U$ ({length_unit})", ylabel=f"tangential load $T$ ({load_unit})")


def _draw_springs(axes: "Axes", model: Springs) -> None:
    slip, slip_unit = scaled(model.slip_displacement, "m")
    force, force_unit = scaled(model.limit, "N")
    axes.vlines(slip, 0, force, color=SPRINGS, linewidth=0.8)
    axes.plot(slip, force, "o", color=SPRINGS, markersize=2)
    axes.set(xlabel=f"slip displacement of a spring ({slip_unit})", ylabel=f"its limit ({force_unit})")
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=0)


def reduced_page(model: Springs) -> str:
    """Return a reduced model as one HTML page that fetches nothing."""
    columns = ((model.stiffness, "N/m"), (model.limit, "N"), (model.slip_displacement, "m"))
    texts = [[quantity_text(value, unit).replace(" ", NO_BREAK) for value in values] for values, unit in columns]
    rows = [(str(number), *row) for number, row in enumerate(zip(*texts, strict=True), start=1)]
    bounded = "At a constant normal load the bounds hold for every history, nested reversals and all."
    unbounded = "Where the normal load varies no bound is known; the errors that were found are no bounds."
    warning = [] if model.scaling is None else [paragraph(unbounded, "warning")]
    return page(
        model.title or "Reduced model",
        [
            Section("Summary", (table(model.summary()),)),
            Section("Validity", (paragraph(bounded), *warning)),
            Section("Picture", (picture(ReducedPicture().figure(model), CAPTION),)),
            Section("Springs", (table(rows, ("spring", "stiffness", "limit", "slip displacement")),)),
        ],
    )
