"""`ReducedModel`: springs that replace a contact, with their error bound; JSON file, picture and page."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import attrs
import numpy as np
import xarray as xr

from historysim._version import __version__
from historysim.basics.arguments import ArrayLike, Floats, as_floats, scalar
from historysim.basics.files import beginning, replacing
from historysim.basics.targets import Output, check_outputs, netcdf, signed_format
from historysim.basics.units import quantity_text
from historysim.basics.wording import html_table
from historysim.errors import InputError
from historysim.results.plots.canvas import COLUMN
from historysim.results.plots.chart import Chart, Curve, Item, Shape, Sheet
from historysim.results.plots.pictures import Picture, make_figure
from historysim.results.plots.style import FAINT, INK, LOOP_AXES, STATE_COLOURS
from historysim.results.report.page import Section, page, paragraph, picture, render_page, table
from historysim.results.result_files import FILES, FileKind
from historysim.results.tables import write_netcdf

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place

FORMAT = "historysim reduced model 2"  # value of the key ``format`` in its JSON
CONTENT = "reduced model"  # value of the attribute ``content`` in its netCDF file
# Formats of a model, by file extension.
MODEL_FORMATS = (
    signed_format("a reduced model of historysim", ".json"),
    netcdf("a reduced model of historysim", CONTENT),
)
SCALED = ("normal_load_N", "stiffness_N_per_m", "limit_N")  # the columns of `Scaling` in its JSON


@attrs.frozen(eq=False)
class Scaling:
    """Springs over the normal load [N], ascending from 0; linear between the rows."""

    normal_load: Floats
    stiffness: Floats = attrs.field(repr=False)  #: (row, spring) [N/m]
    limit: Floats = attrs.field(repr=False)  #: (row, spring) [N]

    def interpolate(self, normal_load: Floats) -> tuple[Floats, Floats]:
        """Interpolate stiffnesses and limits (step, spring) at normal loads (step) [N]."""
        row = np.clip(
            np.searchsorted(self.normal_load, normal_load) - 1, 0, self.normal_load.size - 2
        )
        low, high = self.normal_load[row], self.normal_load[row + 1]
        fraction = np.clip((normal_load - low) / (high - low), 0.0, 1.0)[:, np.newaxis]
        stiffness, limit = (
            (1.0 - fraction) * table[row] + fraction * table[row + 1]
            for table in (self.stiffness, self.limit)
        )
        return stiffness, limit


@attrs.frozen(eq=False)
class ReducedModel:
    """Sliding springs in parallel (Jenkins, Maxwell slip, discrete Iwan) that replace a contact.

    Attributes
    ----------
    normal_load : float
        Normal load of the model [N].
    stiffness : array (spring)
        [N/m], > 0; sorted by ascending slip displacement.
    limit : array (spring)
        Force at which each spring slides [N]; the sum is the friction limit of the contact.
    bound : float
        Largest error of the tangential load, over the friction limit, of any history at that normal
        load.
    energy_bound : float
        Largest error of the energy dissipated in a closed loop [J], at that normal load.
    virgin_displacement, virgin_load : array (point)
        Points on the virgin curve of the contact, from 0 to gross slip [m], [N].
    title : str
    scaling : Scaling, optional
        Dependence of the springs on the normal load, if it varies.
    errors : dict of str to float
        Largest errors measured on histories, over the largest friction limit of each; not bounds.
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
        """Return the tangential load at the end of each step, starting unstrained [N].

        In a step all springs are strained by the displacement increment, with their mean stiffness
        in the step, and are limited by their slip force at its end.

        Parameters
        ----------
        displacement : array_like (step)
            [m]; it starts at 0.
        normal_load : array_like (step), optional
            [N], within the table of `scaling`; by default the constant normal load of the model.

        Raises
        ------
        InputError
            If numbers are not finite, or normal loads are given for a model without `scaling`.
        """
        path = np.atleast_1d(as_floats("displacement", displacement))
        stiffness, limit = (
            np.broadcast_to(values, (path.size, len(self)))
            for values in (self.stiffness, self.limit)
        )
        if normal_load is not None:
            stiffness, limit = self._springs_at(
                np.atleast_1d(as_floats("normal_load", normal_load, least=0.0)), path.shape
            )
        force, total = np.zeros(len(self)), np.empty(path.size)
        # mean stiffness of each step
        means = 0.5 * (np.concatenate([stiffness[:1], stiffness[:-1]]) + stiffness)
        for step, increment in enumerate(np.diff(path, prepend=0.0)):
            force = np.clip(force + means[step] * increment, -limit[step], limit[step])
            total[step] = force.sum()
        return total

    def _springs_at(self, loads: Floats, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Return stiffnesses and limits (step, spring) at normal loads."""
        if self.scaling is None:
            raise InputError(
                "the model holds at a single normal load; expected no normal_load, or a model of a range of loads"
            )
        if loads.shape != shape:
            raise InputError(
                f"normal_load has shape {loads.shape}; expected the shape of displacement, {shape}"
            )
        if loads.size and loads.max() > self.scaling.normal_load[-1] * (1 + 1e-9):
            raise InputError(
                f"normal_load reaches {loads.max():g} N; expected at most {self.scaling.normal_load[-1]:g} N, "
                "the end of the table of the model"
            )
        return self.scaling.interpolate(loads)

    def dataset(self) -> xr.Dataset:
        """Return the springs as a Dataset along ``spring``, with the bounds as attributes.

        Springs that depend on the normal load also have a table along ``normal_load``.
        """
        units = {"stiffness": "N m-1", "limit": "N", "slip_displacement": "m"}
        bounds = {
            "normal_load": self.normal_load,
            "bound": self.bound,
            "bound_of_load": self.bound * self.friction_limit,
            "bound_of_energy": self.energy_bound,
        }
        errors = {f"error of {name}": value for name, value in self.errors.items()}
        columns = {
            name: ("spring", getattr(self, name), {"units": unit}) for name, unit in units.items()
        }
        identity = {"content": CONTENT, "title": self.title or "sliding springs in parallel"}
        springs = xr.Dataset(columns, attrs=identity | bounds | errors)
        if self.scaling is None:
            return springs
        dimensions = "normal_load", "spring"
        return springs.assign(
            normal_load=("normal_load", self.scaling.normal_load, {"units": "N"}),
            stiffness_at_load=(dimensions, self.scaling.stiffness, {"units": "N m-1"}),
            limit_at_load=(dimensions, self.scaling.limit, {"units": "N"}),
        )

    def summary(self) -> list[tuple[str, str]]:
        """Summarise the springs and their errors as lines of (label, text)."""
        limit = self.friction_limit
        bound = f"{self.bound:.3g} of the friction limit ({quantity_text(self.bound * limit, 'N')})"
        errors = [
            (f"found on {name}", f"{value:.3g} of the largest friction limit")
            for name, value in self.errors.items()
        ]
        lines = [
            ("springs", str(len(self))),
            ("normal load", quantity_text(self.normal_load, "N")),
            ("friction limit", quantity_text(limit, "N")),
            ("stiffness at rest", quantity_text(float(self.stiffness.sum()), "N/m")),
            ("slides as a whole from", quantity_text(float(self.slip_displacement[-1]), "m")),
            ("bound of the tangential load", f"{bound}, for every history at that normal load"),
            ("bound of the energy of a loop", quantity_text(self.energy_bound, "J")),
            *errors,
        ]
        if self.scaling is not None:
            lines.append(
                (
                    "normal load varies",
                    "springs go with it by a table; the errors found there are no bounds",
                )
            )
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Return the model as plain lists and numbers, with units in the names."""
        content: dict[str, Any] = {
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
            content["with_normal_load"] = {
                name: column.tolist() for name, column in zip(SCALED, columns, strict=True)
            }
        return content

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Build a model from the output of `as_dict`; InputError for missing, non-numeric or uneven entries."""
        try:
            if content["format"] != FORMAT:
                raise InputError(f"is {content['format']!r}; expected {FORMAT!r}: create it again")
            curve, table = content["virgin_curve_of_the_contact"], content.get("with_normal_load")
            model = cls(
                normal_load=scalar("normal_load_N", content["normal_load_N"], above=0.0),
                stiffness=as_floats("stiffness_N_per_m", content["stiffness_N_per_m"], above=0.0),
                limit=as_floats("limit_N", content["limit_N"], above=0.0),
                bound=scalar("bound", content["bound_of_load_over_friction_limit"], least=0.0),
                energy_bound=scalar(
                    "energy bound", content["bound_of_energy_of_a_closed_loop_J"], least=0.0
                ),
                virgin_displacement=as_floats("displacement_m", curve["displacement_m"], least=0.0),
                virgin_load=as_floats("tangential_load_N", curve["tangential_load_N"], least=0.0),
                title=str(content["title"]),
                scaling=table
                and Scaling(*(as_floats(name, table[name], least=0.0) for name in SCALED)),
                errors={
                    name: scalar(name, value)
                    for name, value in content["errors_found_over_friction_limit"].items()
                },
            )
        except (KeyError, TypeError, AttributeError) as error:
            raise InputError(
                f"not a reduced model of this version ({error}); create it again"
            ) from error
        row = model.stiffness.shape
        pairs = [(model.limit, row), (model.virgin_load, model.virgin_displacement.shape)]
        if model.scaling is not None:
            rows = model.scaling.normal_load.shape + row
            pairs += [(model.scaling.stiffness, rows), (model.scaling.limit, rows)]
        if not model.stiffness.size or any(column.shape != shape for column, shape in pairs):
            raise InputError("lists are empty or of unequal lengths; create it again")
        return model

    def _repr_html_(self) -> str:
        return html_table(self.summary())

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a model from a JSON file of `write`.

        Raises
        ------
        InputError
            If the file is damaged or from another version.
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
            Its extension selects the format: .json (`read` reads it again) or .nc, the `dataset`.
        force : bool
            Also replace a file that is not from historysim.

        Raises
        ------
        InputError
            If the extension is unknown, or the file is not from historysim.
        OSError
            If the file cannot be written.
        """
        path = Path(output)
        check_outputs([Output(path, MODEL_FORMATS)], [], force=force)
        if path.suffix.lower() == ".nc":
            write_netcdf(self.dataset(), path)
            return
        content = {"generator": f"historysim {__version__}", **self.as_dict()}
        with replacing(path) as unfinished:
            unfinished.write_text(
                json.dumps(content, indent=1, allow_nan=False) + "\n",
                encoding="utf-8",
                newline="\n",
            )


@FILES.register
class ReducedFile(FileKind):
    """File of a reduced model (JSON), written by ``historysim reduce``."""

    kind = "reduced model"

    @classmethod
    def is_one(cls, path: Path) -> bool:
        """Return True if the content of a file identifies it as a reduced model."""
        return path.suffix.lower() == ".json" and FORMAT[:-1].encode() in beginning(path, 1024)

    @classmethod
    def read(cls, path: Path) -> ReducedModel:
        """Read the model."""
        return ReducedModel.read(path)


@make_figure.register(ReducedModel)
def _figure(model: ReducedModel, *, target: "Place", **_: object) -> "FigureOrAxes":
    return ReducedPicture().figure(model, target)


SPRINGS = STATE_COLOURS[2]
NO_BREAK = "\u00a0"
CAPTION = (
    "The virgin curve and a loop of the contact and of its springs at the normal load of the model, the band in which "
    "the springs are for every history there, and the force at which each spring slides."
)
AMPLITUDE = 0.8  # amplitude of the loop over the displacement at gross slip


@attrs.frozen(kw_only=True)
class ReducedPicture(Picture):
    """The virgin curve and a loop of a contact and of its reduced model, the band of the bound, and the springs.

    Tangential load over displacement at the normal load of the model; below it, the slip force of
    each spring over its slip displacement.
    """

    kind, of, size, own_figure = "reduced", (ReducedModel,), (COLUMN, 120.0), True

    def sheet(self, data: ReducedModel) -> Sheet:
        """Return the loop and the springs."""
        stems = {"color": SPRINGS, "linewidth": 0.8}
        tips = {"marker": "o", "linestyle": "", "color": SPRINGS, "markersize": 2}
        springs = Chart(
            items=[
                Shape("vlines", (data.slip_displacement, 0, data.limit), stems),
                Curve(data.slip_displacement, data.limit, "", tips),
            ],
            x="slip displacement of a spring (m)",
            y="its limit (N)",
            name="springs",
            axes={"xlim": (0, None), "ylim": (0, None)},
        )
        caption = f"at a normal load of {quantity_text(data.normal_load, 'N')}"
        title = "\n".join(filter(None, (data.title, caption)))
        return Sheet({"L": _loop_chart(data), "S": springs}, wide="LLLSS", subtitle=title)


def _branches(model: ReducedModel) -> tuple[list[Floats], list[Floats]]:
    """Return displacements [m] and loads [N] of the contact on the virgin curve and on both branches of a loop."""
    within = model.virgin_displacement <= AMPLITUDE * model.virgin_displacement[-1]
    displacement, load = model.virgin_displacement[within], model.virgin_load[within]
    # at a constant normal load a branch is the virgin curve, twice as large (Masing)
    return [
        displacement,
        displacement[-1] - 2 * displacement,
        2 * displacement - displacement[-1],
    ], [
        load,
        load[-1] - 2 * load,
        2 * load - load[-1],
    ]


def _loop_chart(model: ReducedModel) -> Chart:
    displacements, exact = _branches(model)
    reduced, band = model.force(np.concatenate(displacements)), model.bound * model.friction_limit
    along, load, items = np.concatenate(displacements), np.concatenate(exact), list[Item]()
    # one band per branch, since a band is a function of the displacement
    for branch, name in zip(np.split(np.arange(along.size), 3), ("bound", None, None), strict=True):
        look = {"color": FAINT, "alpha": 0.3, "linewidth": 0, "label": name, "zorder": 1}
        items.append(
            Shape("fill_between", (along[branch], load[branch] - band, load[branch] + band), look)
        )
    items.append(Curve(along, load, "contact", {"color": INK, "linewidth": 0.9}))
    dashes = {"color": SPRINGS, "linewidth": 0.7, "linestyle": "--"}
    items.append(Curve(along, reduced, f"{len(model)} springs", dashes))
    return Chart(items=items, name="loop", height=40.0, **LOOP_AXES)


@render_page.register(ReducedModel)
def reduced_page(model: ReducedModel) -> str:
    """Render a reduced model as one self-contained HTML page."""
    columns = ((model.stiffness, "N/m"), (model.limit, "N"), (model.slip_displacement, "m"))
    texts = [
        [quantity_text(value, unit).replace(" ", NO_BREAK) for value in values]
        for values, unit in columns
    ]
    rows = [(str(number), *row) for number, row in enumerate(zip(*texts, strict=True), start=1)]
    bounded = (
        "At a constant normal load the bounds hold for every history, nested reversals and all."
    )
    unbounded = (
        "Where the normal load varies no bound is known; the errors that were found are no bounds."
    )
    warning = [] if model.scaling is None else [paragraph(unbounded, "warning")]
    return page(
        model.title or "Reduced model",
        [
            Section("Summary", (table(model.summary()),)),
            Section("Validity", (paragraph(bounded), *warning)),
            Section("Picture", (picture(ReducedPicture().figure(model), CAPTION),)),
            Section(
                "Springs", (table(rows, ("spring", "stiffness", "limit", "slip displacement")),)
            ),
        ],
    )
