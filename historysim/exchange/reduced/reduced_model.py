"""`ReducedModel`: springs in place of a contact, with the bound of their error; its JSON, picture and page."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import attrs
import numpy as np
import xarray as xr

from historysim.basics.arguments import ArrayLike, Floats, checked, scalar
from historysim.basics.files import beginning, replacing
from historysim.basics.targets import Output, check_outputs
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.exchange.reduced.model_texts import FORMATS, format_of
from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import Picture, figure_of
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, label_loop
from historysim.results.report.page import Section, page, page_of, paragraph, picture, table
from historysim.results.result_files import FILES, FileKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from historysim.results.plots.canvas import FigureOrAxes, Place

FORMAT = "historysim reduced model 2"  # what the key ``format`` of its JSON says
SCALED = ("normal_load_N", "stiffness_N_per_m", "limit_N")  # the columns of `Scaling` in its JSON


@attrs.frozen(eq=False)
class Scaling:
    """How springs change with the normal load [N], ascending from 0; straight between the rows."""

    normal_load: Floats
    stiffness: Floats = attrs.field(repr=False)  #: (row, spring) [N/m]
    limit: Floats = attrs.field(repr=False)  #: (row, spring) [N]

    def at(self, normal_load: Floats) -> tuple[Floats, Floats]:
        """Return stiffnesses and limits (step, spring) at normal loads (step) [N] in the table."""
        row = np.clip(np.searchsorted(self.normal_load, normal_load) - 1, 0, self.normal_load.size - 2)
        low, high = self.normal_load[row], self.normal_load[row + 1]
        part = np.clip((normal_load - low) / (high - low), 0.0, 1.0)[:, np.newaxis]
        stiffness, limit = ((1.0 - part) * each[row] + part * each[row + 1] for each in (self.stiffness, self.limit))
        return stiffness, limit


@attrs.frozen(eq=False)
class ReducedModel:
    """Springs in parallel, each of which slides at a limit (Jenkins, Maxwell slip, discrete Iwan), for a contact.

    Attributes
    ----------
    normal_load : float
        At which the springs are placed [N].
    stiffness : array (spring)
        [N/m], > 0; springs stand by ascending displacement at which they slide.
    limit : array (spring)
        Force at which each slides [N]; their sum is the friction limit of the contact.
    bound : float
        Largest error of the tangential load, over the friction limit, of any history at that normal load.
    energy_bound : float
        Largest error of the energy that a closed loop takes [J], at that normal load.
    virgin_displacement, virgin_load : array (point)
        Points on the virgin curve of the contact itself, from 0 to where all of it slides [m], [N].
    title : str
    scaling : Scaling, optional
        How the springs change with the normal load, where it varies.
    errors : dict of str to float
        Largest errors that were found on histories, over the largest friction limit of each; no bounds.
    """

    normal_load: float
    stiffness: Floats = attrs.field(repr=False)
    limit: Floats = attrs.field(repr=False)
    bound: float
    energy_bound: float
    virgin_displacement: Floats = attrs.field(repr=False)
    virgin_load: Floats = attrs.field(repr=False)
    title: str = ""
    scaling: Scaling | None = attrs.field(default=None, repr=False)
    errors: dict[str, float] = attrs.field(factory=dict)

    def __len__(self) -> int:
        """Return the number of springs."""
        return int(self.stiffness.size)

    @property
    def friction_limit(self) -> float:
        """Largest tangential load [N]."""
        return float(self.limit.sum())

    @property
    def slip_displacement(self) -> Floats:
        """Displacement at which each spring slides, from rest [m] (spring)."""
        return self.limit / self.stiffness

    def force(self, displacement: ArrayLike, normal_load: ArrayLike | None = None) -> Floats:
        """Return the tangential load at the end of each of several steps, from rest [N].

        In a step all springs are strained by the way, with their mean stiffness on the way, and slide at their limit at
        its end.

        Parameters
        ----------
        displacement : array_like (step)
            [m]; it begins at 0.
        normal_load : array_like (step), optional
            [N], within the table of `scaling`; by default that of the model throughout.

        Raises
        ------
        InputError
            Numbers that are not finite, or normal loads where the model has none.
        """
        way = np.atleast_1d(checked("displacement", displacement))
        stiffness, limit = (np.broadcast_to(each, (way.size, len(self))) for each in (self.stiffness, self.limit))
        if normal_load is not None:
            stiffness, limit = self._scaled(np.atleast_1d(checked("normal_load", normal_load, least=0.0)), way.shape)
        force, found = np.zeros(len(self)), np.empty(way.size)
        # the mean stiffness of each step, from rest
        means = 0.5 * (np.concatenate([stiffness[:1], stiffness[:-1]]) + stiffness)
        for step, moved in enumerate(np.diff(way, prepend=0.0)):
            force = np.clip(force + means[step] * moved, -limit[step], limit[step])
            found[step] = force.sum()
        return found

    def _scaled(self, loads: Floats, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Return stiffnesses and limits (step, spring) at normal loads."""
        if self.scaling is None:
            raise InputError("the model is one at a single normal load; expected none, or one made for a range")
        if loads.shape != shape:
            raise InputError(f"normal_load has shape {loads.shape}; expected that of displacement, {shape}")
        if loads.size and loads.max() > self.scaling.normal_load[-1] * (1 + 1e-9):
            raise InputError(
                f"normal_load reaches {loads.max():g} N; expected at most {self.scaling.normal_load[-1]:g} N, "
                "where the table of the model ends"
            )
        return self.scaling.at(loads)

    def dataset(self) -> xr.Dataset:
        """Return the springs as a table along ``spring``, with the bounds as attributes."""
        units = {"stiffness": "N m-1", "limit": "N", "slip_displacement": "m"}
        bounds = {
            "normal_load": self.normal_load,
            "bound": self.bound,
            "bound_of_load": self.bound * self.friction_limit,
            "bound_of_energy": self.energy_bound,
        }
        errors = {f"error of {name}": value for name, value in self.errors.items()}
        columns = {name: ("spring", getattr(self, name), {"units": unit}) for name, unit in units.items()}
        return xr.Dataset(columns, attrs=bounds | errors)

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): the springs, and how far they may be from the contact."""
        limit = self.friction_limit
        bound = f"{self.bound:.3g} of the friction limit ({quantity_text(self.bound * limit, 'N')})"
        found = [
            (f"found on {name}", f"{value:.3g} of the largest friction limit") for name, value in self.errors.items()
        ]
        lines = [
            ("springs", str(len(self))),
            ("normal load", quantity_text(self.normal_load, "N")),
            ("friction limit", quantity_text(limit, "N")),
            ("stiffness at rest", quantity_text(float(self.stiffness.sum()), "N/m")),
            ("slides as a whole from", quantity_text(float(self.slip_displacement[-1]), "m")),
            ("bound of the tangential load", f"{bound}, for every history at that normal load"),
            ("bound of the energy of a loop", quantity_text(self.energy_bound, "J")),
            *found,
        ]
        if self.scaling is not None:
            lines.append(("normal load varies", "springs go with it by a table; the errors found there are no bounds"))
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain lists and numbers, with units in the names."""
        found: dict[str, Any] = {
            "format": FORMAT,
            "title": self.title,
            "law": "T = sum of F_i; each step F_i goes by stiffness_i times the displacement, and stays within limit_i",
            "normal_load_N": self.normal_load,
            "friction_limit_N": self.friction_limit,
            "bound_of_load_N": self.bound * self.friction_limit,
            "bound_of_load_over_friction_limit": self.bound,
            "bound_of_energy_of_a_closed_loop_J": self.energy_bound,
            "errors_found_over_friction_limit": self.errors,
            "stiffness_N_per_m": self.stiffness.tolist(),
            "limit_N": self.limit.tolist(),
            "virgin_curve_of_the_contact": {
                "displacement_m": self.virgin_displacement.tolist(),
                "tangential_load_N": self.virgin_load.tolist(),
            },
        }
        if self.scaling is not None:
            columns = attrs.astuple(self.scaling, recurse=False)
            found["with_normal_load"] = {name: each.tolist() for name, each in zip(SCALED, columns, strict=True)}
        return found

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Self:
        """Return the model of what `as_dict` gave; what is missing, or no number, or uneven, is an InputError."""
        try:
            if given["format"] != FORMAT:
                raise InputError(f"is {given['format']!r}; expected {FORMAT!r}: make it again")
            curve, table = given["virgin_curve_of_the_contact"], given.get("with_normal_load")
            found = cls(
                normal_load=scalar("normal_load_N", given["normal_load_N"], above=0.0),
                stiffness=checked("stiffness_N_per_m", given["stiffness_N_per_m"], above=0.0),
                limit=checked("limit_N", given["limit_N"], above=0.0),
                bound=scalar("bound", given["bound_of_load_over_friction_limit"], least=0.0),
                energy_bound=scalar("energy bound", given["bound_of_energy_of_a_closed_loop_J"], least=0.0),
                virgin_displacement=checked("displacement_m", curve["displacement_m"], least=0.0),
                virgin_load=checked("tangential_load_N", curve["tangential_load_N"], least=0.0),
                title=str(given["title"]),
                scaling=table and Scaling(*(checked(name, table[name], least=0.0) for name in SCALED)),
                errors={name: scalar(name, value) for name, value in given["errors_found_over_friction_limit"].items()},
            )
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(f"no reduced model as this version writes it ({error}); make it again") from error
        row = found.stiffness.shape
        pairs = [(found.limit, row), (found.virgin_load, found.virgin_displacement.shape)]
        if found.scaling is not None:
            rows = found.scaling.normal_load.shape + row
            pairs += [(found.scaling.stiffness, rows), (found.scaling.limit, rows)]
        if not found.stiffness.size or any(column.shape != shape for column, shape in pairs):
            raise InputError("lists are empty or of unequal lengths; make it again")
        return found

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

    def write(self, output: str | Path, *, force: bool = False) -> None:
        """Write the model for another program.

        Parameters
        ----------
        output : path
            Its extension selects the program: .json, .mo (Modelica), .tcl (OpenSees), .py (OpenSeesPy).
        force : bool
            Replace a file that is none of historysim, too.

        Raises
        ------
        InputError
            An unknown extension, or a file of somebody else.
        OSError
            It cannot be written.
        """
        path = Path(output)
        check_outputs([Output(path, (format_of(path),))], [], force=force)
        with replacing(path) as unfinished:
            content = FORMATS[path.suffix.lower()](self, path.stem)
            unfinished.write_text(content, encoding="utf-8", newline="\n")


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

    kind, of, size, alone = "reduced", (ReducedModel,), (COLUMN, 120.0), True

    def draw(self, canvas: Canvas, data: ReducedModel) -> None:
        """Draw both, or the loop alone."""
        loop, spectrum = canvas.two(("loop", "springs"), 1.5, stacked=1.6)
        _draw_loop(loop, data)
        canvas.legend(loop)
        canvas.heading(data.title, f"at a normal load of {quantity_text(data.normal_load, 'N')}")
        if spectrum is not None:
            _draw_springs(spectrum, data)


def _branches(model: ReducedModel) -> tuple[list[Floats], list[Floats]]:
    """Return displacements [m] and loads [N] of the contact on the virgin curve and on both branches of a loop."""
    within = model.virgin_displacement <= AMPLITUDE * model.virgin_displacement[-1]
    way, load = model.virgin_displacement[within], model.virgin_load[within]
    # at a constant normal load a branch is the virgin curve, twice as large (Masing)
    return [way, way[-1] - 2 * way, 2 * way - way[-1]], [load, load[-1] - 2 * load, 2 * load - load[-1]]


def _draw_loop(axes: "Axes", model: ReducedModel) -> None:
    ways, exact = _branches(model)
    reduced, band = model.force(np.concatenate(ways)), model.bound * model.friction_limit
    along, load = np.concatenate(ways), np.concatenate(exact)
    label_loop(axes)
    # each branch by itself: a band is a function of the displacement there
    for part, name in zip(np.split(np.arange(along.size), 3), ("bound", None, None), strict=True):
        low, high = load[part] - band, load[part] + band
        axes.fill_between(along[part], low, high, color=FAINT, alpha=0.3, linewidth=0, label=name, zorder=1)
    axes.plot(along, load, color=INK, linewidth=0.9, label="contact")
    axes.plot(along, reduced, color=SPRINGS, linewidth=0.7, linestyle="--", label=f"{len(model)} springs")


def _draw_springs(axes: "Axes", model: ReducedModel) -> None:
    axes.vlines(model.slip_displacement, 0, model.limit, color=SPRINGS, linewidth=0.8)
    axes.plot(model.slip_displacement, model.limit, "o", color=SPRINGS, markersize=2)
    axes.set(xlabel="slip displacement of a spring (m)", ylabel="its limit (N)")
    axes.set_ylim(bottom=0)
    axes.set_xlim(left=0)


@page_of.register(ReducedModel)
def reduced_page(model: ReducedModel) -> str:
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
