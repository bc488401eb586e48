"""Pictures: base class, registry by name, and choice of the picture for an object."""

import functools
import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_args, get_origin

import attrs

from historysim.basics.arguments import DIRECTION
from historysim.basics.fields import QuantityFields, list_fields
from historysim.basics.registry import Registry
from historysim.basics.wording import brief, join_words, nearest, read_findings
from historysim.errors import InputError
from historysim.results.layout import (
    is_dataset,
    is_history,
    report_missing_variables,
    standard_layout,
)
from historysim.results.plots.canvas import Canvas, FigureOrAxes, Place, Size, draw_on_target
from historysim.results.plots.chart import Chart, Sheet
from historysim.results.queries import check_one_direction

if TYPE_CHECKING:
    import xarray as xr

# The pictures by their names in ``[picture]`` and ``--picture``.
PICTURES: Registry[type["Picture"]] = Registry(
    "historysim.plots",
    "historysim.results.plots.pictures:Picture",
    "picture",
    "historysim.results.plots",
)
register = PICTURES.register

# Names of earlier pictures, and the pictures that replace them.
REPLACED = {
    "distribution": "contact-map, or surface of a scenario, of which it is a panel",
    "loop": "loops with colour = slip",
    "sliding-order": "the query slip-onset",
    "slip-fronts": "traction with fronts = true",
    "slip-map": "history with panels = states",
}
PLACES = ("size", "figure", "ax")  # arguments of the drawing target
# subjects of the pictures of ``[picture]``
HISTORY, SWEEP, SCENARIO = "history", "sweep", "scenario"


@attrs.frozen(kw_only=True)
class Picture(QuantityFields):
    """A picture: its fields are its options, in ``[picture]``, with ``--picture``, and in Python.

    The picture ``traction`` is ``hs.plot(x, picture="traction", steps=…)`` and
    ``hs.plots.traction(x, steps=…)``.
    """

    registry: ClassVar[Registry[Any]] = PICTURES
    kind: ClassVar[str]  #: its name
    #: Its subjects: ``"history"``, ``"sweep"``, ``"scenario"``, and types.
    of: ClassVar[tuple[str | type, ...]] = (HISTORY,)
    size: ClassVar[Size] = (90.0, 78.0)  #: default width and height [mm]
    #: Caption in the report of a history, which omits pictures without one; see `report_caption`.
    caption: ClassVar[str] = ""
    #: lines of the summary of a history that the caption ends with
    caption_lines: ClassVar[tuple[str, ...]] = ()
    #: the variable of a history that the report requires for it
    needs: ClassVar[str] = "slip_state"
    order: ClassVar[int] = 100  #: its position in the report
    report_options: ClassVar[Mapping[str, Any]] = {}  #: its options in the report
    #: Whether it accepts several histories: `sheet` then receives a sequence.
    accepts_several: ClassVar[bool] = False
    #: whether it fills a figure, and cannot be combined with others
    own_figure: ClassVar[bool] = False
    headed: ClassVar[bool] = False  #: whether the title of its subject is its default title
    #: whether it also accepts a history with two tangential directions
    planar: ClassVar[bool] = False
    #: whether it needs a history with two tangential directions
    only_planar: ClassVar[bool] = False
    #: its counterpart for one direction, if it needs two
    in_one_direction: ClassVar[str] = "history"

    def sheet(self, data: Any) -> Sheet | Chart:
        """Return the charts of a Dataset, or of another supported object: curves, maps and notes in SI units."""
        raise NotImplementedError(f"{type(self).__name__} has neither sheet nor draw")

    def draw(self, canvas: Canvas, data: Any) -> None:
        """Draw the charts on a canvas: a figure, a part of a figure, or axes.

        A picture that draws by itself uses ``canvas.axes()`` or ``canvas.figure``, with SI units in
        the labels of axes, "load (N)", which get readable prefixes, and labels for the legend.
        """
        canvas.draw(self.sheet(data))

    def figure(self, subject: Any, target: Place | None = None) -> FigureOrAxes:
        """Return a figure with this picture only, or the figure or axes that were passed."""
        data = prepare_data(subject, self)
        with report_missing_variables(*(data if isinstance(data, list) else [data])):
            return draw_on_target(
                target or {}, self.default_size(data), lambda canvas: self.draw_named(canvas, data)
            )

    def draw_named(self, canvas: Canvas, data: Any) -> None:
        """Draw the picture with its title and a legend of labelled artists."""
        self.draw(canvas, data)
        canvas.legend()
        title = str(getattr(self, "title", ""))
        if self.headed and not canvas.is_part:
            title = title or str(getattr(data, "attrs", {}).get("title", ""))
        canvas.heading(title, canvas.caption)

    def default_size(self, data: Any) -> Size:  # noqa: ARG002 - for subclasses
        """Return the default width and height [mm]."""
        return self.size

    @property
    def extra_width(self) -> float:
        """Extra width in ``[picture]`` over the default width [mm]."""
        return 0.0

    @property
    def label(self) -> str:
        """Name of the picture in a figure with several pictures."""
        return str(getattr(self, "title", "") or self.kind)

    @classmethod
    def is_listed(cls) -> bool:
        """Return whether it can be selected by name, and is not just the picture of a type."""
        return any(isinstance(subject, str) for subject in cls.of)

    @classmethod
    def report_caption(cls, history: "xr.Dataset") -> str:  # noqa: ARG003 - for subclasses
        """Return the caption for the report of a history; it may depend on the contents of the history."""
        return cls.caption

    @classmethod
    def is_reported(cls, history: "xr.Dataset") -> bool:
        """Return whether the report of a history includes it."""
        fits = cls.planar or cls.only_planar == (DIRECTION in history.sizes)
        return bool(cls.caption) and cls.needs in history and fits


@attrs.frozen(kw_only=True)
class Titled(Picture):
    """A picture with a separate heading.

    Attributes
    ----------
    title : str
        A heading; by default the title of its subject, if it has one.
    """

    title: str = ""


@attrs.frozen(kw_only=True)
class Panel(Titled):
    """Options of pictures in the figure of a scenario.

    Attributes
    ----------
    title : str
        A heading above this picture, in addition to the title of the scenario.
    labels : tuple of str
        Names of its lines, or surfaces.
    where : dict, optional
        Of a sweep, only the cells with these values of swept keys.
    """

    labels: tuple[str, ...] = ()
    where: dict[str, Any] | None = None

    def resolve_labels(self, names: Sequence[str], noun: str) -> list[str]:
        """Return the given labels, or else the default names."""
        if self.labels and len(self.labels) != len(names):
            raise InputError(
                f"labels has {len(self.labels)}; expected one for each of {len(names)} {noun}"
            )
        return list(self.labels or names)


def prepare_data(subject: Any, picture: Picture) -> Any:
    """Return the data of a picture: the object itself, or the surface, summits or record of a scenario."""
    prepare = getattr(subject, "picture_data", None)
    if isinstance(subject, list | tuple):
        subject = [standard_layout(item) if is_history(item) else item for item in subject]
    elif is_history(subject):
        subject = standard_layout(subject)
    for item in subject if isinstance(subject, list | tuple) else (subject,):
        if picture.only_planar and DIRECTION not in getattr(item, "sizes", ()):
            raise InputError(
                f"the picture {picture.kind} needs two tangential directions, and the history has one; expected the "
                f"picture {picture.in_one_direction}, or loads or displacements in x and y, such as "
                'tangential_displacement = ["10 nm", "5 nm"]'
            )
        if not (picture.planar or picture.only_planar):
            alternatives = (
                _planar_alternatives if HISTORY in picture.of and is_history(item) else str
            )
            check_one_direction(item, f"the picture {picture.kind}", alternatives)
    return subject if prepare is None else prepare(picture.kind)


def _planar_alternatives() -> str:
    names = [
        name
        for name, kind in PICTURES.items()
        if HISTORY in kind.of and (kind.planar or kind.only_planar)
    ]
    return f"one of the pictures {', '.join(names)}, or "


def draw(
    subject: Any,
    name: str,
    target: Place | None = None,
    *,
    of: str | type = HISTORY,
    **options: Any,
) -> FigureOrAxes:
    """Return a picture by its name, of a history or several, of a sweep or a scenario; options are its fields."""
    if name == "loop":
        # a name of the public contract
        name = "loops"
        options = {"colour": "slip", **options}
    single = not isinstance(subject, list | tuple)
    available = {
        key: kind
        for key, kind in PICTURES.items()
        if of in kind.of and (single or kind.accepts_several)
    }
    if name not in available:
        several = "" if single else "of several results "
        raise InputError(
            removal_text(name)
            or f"picture is {name!r}; {several}expected one of {', '.join(available)}"
        )
    return made(available[name], options, available).figure(subject, target)


def removal_text(name: object) -> str:
    """Return the error for the name of an earlier picture; empty for other names."""
    if str(name) not in REPLACED:
        return ""
    return f"the picture {name!r} was removed; expected {REPLACED[str(name)]}"


def made(
    kind: type[Picture], options: Mapping[str, Any], available: Mapping[str, type[Picture]]
) -> Picture:
    """Return a picture with options; errors name the pictures that have an option."""
    field_names = [field.name for field in list_fields(kind)]
    for option in (name_ for name_ in options if name_ not in field_names):
        takers = [
            name for name, candidate in available.items() if option in attrs.fields_dict(candidate)
        ]
        mend = (
            f"it applies to {', '.join(takers)}"
            if takers
            else nearest(option, [*field_names, "picture", *PLACES])
        )
        raise InputError(f"{option} does not apply to the picture {kind.kind}; {mend}")
    if needed := [
        field.name for field in list_fields(kind) if field.needed and field.name not in options
    ]:
        raise InputError(f"the picture {kind.kind} needs {', '.join(needed)}")
    attrs.resolve_types(kind)
    types = {field.name: field.type for field in attrs.fields(kind)}
    return kind(**{name: _value(name, types[name], value) for name, value in options.items()})


def _value(name: str, kind: Any, value: Any) -> Any:
    """Convert an option to the type of its field: a list to a tuple, and a string of the shell to its value."""
    members = {*get_args(kind)} if isinstance(kind, UnionType) else {kind}
    if any(get_origin(member) is Annotated for member in members):
        members = {get_args(member)[0] for member in members}
    members.discard(NoneType)
    arrays = [member for member in members if get_origin(member) is tuple]
    if arrays and isinstance(value, str):
        value = [_value(name, get_args(arrays[0])[0], item.strip()) for item in value.split(",")]
        if "" in value:
            raise InputError(f"{name}: expected values with one comma between each two")
    elif isinstance(value, str) and members != {str}:
        with suppress(tomllib.TOMLDecodeError):
            value = tomllib.loads(f"value = {value}")["value"]
    if bool in members and not isinstance(value, bool | NoneType):
        raise InputError(f"{name} is {value!r}; expected true or false")
    return tuple(value) if isinstance(value, list) else value


@functools.singledispatch
def make_figure(
    subject: Any,
    *,
    picture: str | None = None,
    name: str = "",
    target: Place | None = None,
    **options: Any,
) -> FigureOrAxes:
    """Draw a picture of an object, by default the first one of its type; InputError if there is none.

    A type with more to choose or to prepare registers a function with
    ``@make_figure.register(type)``. `name` is the path that it was read from, if any; `options` are
    fields of the picture.
    """
    if is_dataset(subject):
        return _draw_dataset(subject, picture, name, target, options)
    called = name or f"this {type(subject).__name__}"
    available = {
        key: kind
        for key, kind in PICTURES.items()
        if any(isinstance(of, type) and isinstance(subject, of) for of in kind.of)
    }
    if not available:
        raise InputError(
            f"{called} has no picture; expected a history, a scenario, a surface, loops, a comparison or an asperity"
        )
    # a picture whose first subject is this type precedes those of other subjects
    chosen = picture or min(
        available, key=lambda key: [isinstance(of, str) for of in available[key].of]
    )
    return _draw_picture(subject, chosen, available, called, target, options, name)


def _draw_picture(
    subject: Any,
    picture: str,
    available: Mapping[str, type[Picture]],
    called: str,
    target: Place | None,
    options: Mapping[str, Any],
    name: str,
) -> FigureOrAxes:
    """Draw one of the pictures of an object, below the name of its file, if it has one."""
    if picture not in available:
        raise InputError(
            f"picture {picture}: {called} has no such picture; expected {', '.join(available)}"
        )
    titled = (
        {"title": Path(name).name}
        if name and "title" in attrs.fields_dict(available[picture])
        else {}
    )
    return made(available[picture], titled | dict(options), available).figure(subject, target)


@make_figure.register(list)
@make_figure.register(tuple)
def _draw_histories(
    histories: Sequence[Any],
    *,
    picture: str | None = None,
    name: str = "",
    target: Place | None = None,
    **options: Any,
) -> FigureOrAxes:
    """Draw several histories over one another."""
    for history in histories:
        if not _is_history(history):
            raise InputError(
                f"{name or f'this {type(history).__name__}'} is not a history; expected results of historysim run "
                "only, or one other file"
            )
    return draw(histories, picture or "loops", target, **options)


def _draw_dataset(
    dataset: "xr.Dataset",
    picture: str | None,
    name: str,
    target: Place | None,
    options: dict[str, Any],
) -> FigureOrAxes:
    """Draw a history, a sweep, a surface, a table, or loops that were written to a file."""
    content = dataset.attrs.get("content")
    called = name or "this Dataset"
    # the variables of a sweep may be loads, too
    if content == SWEEP:
        return _draw_sweep(dataset, picture, target, options)
    if _is_history(dataset) and content not in TABLES:
        return draw(
            dataset,
            picture or ("contact-map" if "step" in options else "history"),
            target,
            **options,
        )
    kinds = {
        "fretting": content == "fretting report",
        "table": content in TABLES,
        "surface": "summit_height" in dataset,
    }
    kinds |= {"loop-trends": "loop" in dataset.dims, "loop-levels": "loops" in dataset.coords}
    for kind, matches in kinds.items():
        if matches:
            titled = name if kind == "table" else ""
            return _draw_picture(
                dataset, picture or kind, {kind: PICTURES[kind]}, called, target, options, titled
            )
    raise InputError(
        f"{called} is not a history; expected a Dataset from historysim, with its variables"
    )


TABLES = ("table", "history over time")  # contents of files that are tables


def _is_history(subject: Any) -> bool:
    return (
        is_dataset(subject)
        and "total_normal_load" in subject
        and subject.attrs.get("content") != SWEEP
    )


def _draw_sweep(
    sweep: "xr.Dataset", picture: str | None, target: Place | None, options: dict[str, Any]
) -> FigureOrAxes:
    """Draw loops of the cells where these have rows and no numbers; else a number, by its name or the first one."""
    numbers = [
        str(key) for key in sweep.data_vars if not {"step", "asperity"} & set(sweep[key].dims)
    ]
    if picture is None and not numbers:
        picture = "loops"
    if picture is not None and picture not in sweep.data_vars and picture in PICTURES:
        return draw(sweep, picture, target, of=SWEEP, **options)
    # the first output, else the usual quantity of a sweep; of others, such as a design, the first
    # number
    preferred = [*str(sweep.attrs.get("outputs", "")).split(), "preliminary_displacement"]
    candidates = [key for name in preferred for key in (name, f"{name}_mean") if key in numbers]
    return draw(
        sweep, "curve", target, of=SWEEP, quantity=picture or [*candidates, *numbers][0], **options
    )


ACROSS, NARROWEST = 3, 55.0  # panels in a row, and the width that each has at least [mm]
PANEL, HEIGHT, TITLE = 90.0, 78.0, 8.0  # width and height of a panel, height of the title [mm]
LOWEST = 45.0  # least height of a panel [mm]


# Short names of the findings of the checks.
BEYOND = {
    "steep": "steep asperities",
    "yield": "pressures beyond yield",
    "area": "a large contact area",
    "overlap": "overlapping contacts",
    "adhesion": "adhesion",
    "outliers": "a few high summits",
}


def draw_figure(
    subjects: Sequence[Any],
    pictures: Sequence[Picture],
    title: str = "",
    target: Place | None = None,
) -> FigureOrAxes:
    """Draw pictures, each of its result, sweep or scenario, side by side, in a narrow figure stacked."""
    target = target or {}
    if len(pictures) == 1 and (pictures[0].own_figure or target.get("ax") is not None):
        return pictures[0].figure(subjects[0], target)
    across = min(len(pictures), ACROSS)
    width = PANEL * across + max(item.extra_width for item in pictures)

    def draw(canvas: Canvas) -> None:
        if canvas.target_axes is not None:
            raise InputError(
                f"ax: this picture has {len(pictures)} panels; expected figure= in place of ax="
            )
        across = min(len(pictures), ACROSS, max(int(canvas.width / NARROWEST), 1))
        fitting = pictures[: across * max(int((canvas.height - TITLE) / LOWEST), 1)]
        if omitted := [item.label for item in pictures[len(fitting) :]]:
            canvas.notice(
                f"at {canvas.width:.3g} × {canvas.height:.3g} mm there is no room for {join_words(omitted)}"
            )
        across = min(across, len(fitting))
        # one picture, too, has its title and the line above all in separate parts
        panels: Any = canvas.figure.subfigures(-(-len(fitting) // across), across, squeeze=False)
        for panel, picture, subject in zip(panels.ravel(), fitting, subjects, strict=False):
            picture.draw_named(canvas.part(panel), prepare_data(subject, picture))
        canvas.heading(title)
        if results := [subject for subject in subjects if is_dataset(subject)]:
            findings = [
                item.name for item in read_findings(str(results[0].attrs.get("validity", "[]")))
            ]
            if names := [BEYOND[name] for name in findings if name in BEYOND]:
                canvas.notice(f"beyond the model's assumptions: {', '.join(names)}")

    return draw_on_target(target, (width, HEIGHT * -(-len(pictures) // across) + TITLE), draw)


DRAWN_IN = """size : (float, float), optional
    Width and height of a new figure [mm].
figure, ax : optional
    Draw into this figure, or these axes, of matplotlib."""


def as_function(kind: type[Picture]) -> Callable[..., FigureOrAxes]:
    """Return a picture as a function of its data, its fields and the drawing target."""

    def function(
        data: Any, *, size: Size | None = None, figure: Any = None, ax: Any = None, **options: Any
    ) -> FigureOrAxes:
        return made(kind, options, {}).figure(data, {"size": size, "figure": figure, "ax": ax})

    data_parameter, *where, _ = inspect.signature(function).parameters.values()
    option_parameters = []
    for field in list_fields(kind):
        default = inspect.Parameter.empty if field.needed else field.default
        option_parameters.append(
            inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default)
        )
    function.__name__ = function.__qualname__ = kind.kind.replace("-", "_")
    function.__signature__ = inspect.Signature([data_parameter, *option_parameters, *where])  # type: ignore[attr-defined] # as help() reads it
    about, examples, example_text = (inspect.getdoc(kind) or "").partition("\n\nExamples\n")
    function.__doc__ = f"{about}\n\n{DRAWN_IN}{examples}{example_text}"
    return function


def as_history_list(histories: Any) -> "list[xr.Dataset]":
    """Return one history, or several, as a list; InputError for other objects."""
    listed = list(histories) if isinstance(histories, list | tuple) else [histories]
    for history in listed:
        if not is_dataset(history):
            raise InputError(
                f"{brief(history)} is not a history; expected a Dataset from historysim"
            )
    return listed
