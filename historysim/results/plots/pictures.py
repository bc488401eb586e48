"""What a picture is, pictures by their names, and which picture is drawn of what."""

import functools
import inspect
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, get_args, get_origin

import attrs
import xarray as xr

from historysim.basics.arguments import DIRECTION
from historysim.basics.fields import list_fields
from historysim.basics.registry import Registry
from historysim.basics.wording import nearest, read_findings
from historysim.errors import InputError
from historysim.results.asking import check_direction
from historysim.results.layout import is_history, missing_variables_reported, standard_layout
from historysim.results.plots.canvas import Canvas, FigureOrAxes, Place, Size, drawn

# The pictures by their names in ``[picture]`` and ``--picture``.
PICTURES: Registry[type["Picture"]] = Registry(
    "historysim.plots", "historysim.results.plots.pictures:Picture", "picture", "historysim.results.plots"
)
register = PICTURES.register

PLACES = ("size", "figure", "ax")  # arguments that say where a picture is drawn
HISTORY, SWEEP, SCENARIO = "history", "sweep", "scenario"  # what a picture of ``[picture]`` is drawn of


@attrs.frozen(kw_only=True)
class Picture:
    """A picture: its fields are its options, in ``[picture]``, with ``--picture``, and in Python.

    The picture ``traction`` is ``hs.plot(x, picture="traction", steps=…)`` and ``hs.plots.traction(x, steps=…)``.
    """

    registry: ClassVar[Registry[Any]] = PICTURES
    kind: ClassVar[str]  #: its name
    #: What it is drawn of: ``"history"``, ``"sweep"``, ``"scenario"``, and types.
    of: ClassVar[tuple[str | type, ...]] = (HISTORY,)
    size: ClassVar[Size] = (90.0, 78.0)  #: width and height [mm] where no other is asked for
    #: What stands below it in the report of a history, which leaves out what has none; see `caption_of`.
    caption: ClassVar[str] = ""
    found: ClassVar[tuple[str, ...]] = ()  #: lines of the summary of a history that the caption ends with
    needs: ClassVar[str] = "slip_state"  #: the variable of a history without which the report leaves it out
    order: ClassVar[int] = 100  #: it stands in the report before those of a greater number
    #: Whether several histories can be in it: `draw` then takes a sequence of them, too.
    several: ClassVar[bool] = False
    alone: ClassVar[bool] = False  #: whether it fills a figure of its own, and cannot stand beside others
    headed: ClassVar[bool] = False  #: whether the title of what is drawn stands above it, if it has no other
    planar: ClassVar[bool] = False  #: whether it can be drawn of a history with two tangential directions, too
    only_planar: ClassVar[bool] = False  #: whether it is of a history with two tangential directions alone

    def draw(self, canvas: Canvas, data: Any) -> None:
        """Draw a Dataset, or what else it is of, on a canvas, which is a figure, a part of one, or axes.

        ``canvas.axes()`` are those of a picture with one panel, ``canvas.several(count)`` is the figure of one with
        more. What is drawn is in SI units, with them in the labels of axes, "load (N)", which get readable prefixes.
        What has a label is named below the picture.
        """
        raise NotImplementedError(f"{type(self).__name__} has no draw")

    def figure(self, what: Any, place: Place | None = None) -> FigureOrAxes:
        """Return a figure of it alone, or what was given to draw into."""
        data = data_for(what, self)
        with missing_variables_reported(*(data if isinstance(data, list) else [data])):
            return drawn(place or {}, self.size_of(data), lambda canvas: self.draw_named(canvas, data))

    def draw_named(self, canvas: Canvas, data: Any) -> None:
        """Draw it, with its title and a legend of what has a label."""
        self.draw(canvas, data)
        canvas.legend()
        title = str(getattr(self, "title", ""))
        if self.headed and not canvas.beside_others:
            title = title or str(getattr(data, "attrs", {}).get("title", ""))
        canvas.heading(title, canvas.caption)

    def size_of(self, data: Any) -> Size:  # noqa: ARG002 - what others go by
        """Return width and height [mm] where no other is asked for."""
        return self.size

    @property
    def beside(self) -> float:
        """Width that it needs in ``[picture]`` beside that of every picture [mm]."""
        return 0.0

    @property
    def called(self) -> str:
        """What it is called beside others."""
        return str(getattr(self, "title", "") or self.kind)

    @classmethod
    def caption_of(cls, history: xr.Dataset) -> str:  # noqa: ARG003 - what others go by
        """Return the caption of the picture of a history, where that depends on what is in it."""
        return cls.caption

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether the report of a history shows it."""
        fits = cls.planar or cls.only_planar == (DIRECTION in history.sizes)
        return bool(cls.caption) and cls.needs in history and fits


@attrs.frozen(kw_only=True)
class Titled(Picture):
    """A picture with a heading of its own.

    Attributes
    ----------
    title : str
        A heading; by default that of what is drawn, if it has one.
    """

    title: str = ""


@attrs.frozen(kw_only=True)
class Panel(Titled):
    """What pictures in the figure of a scenario have.

    Attributes
    ----------
    title : str
        A heading above this picture, beside the title of the scenario.
    labels : tuple of str
        What its lines, or surfaces, are called.
    where : dict, optional
        Of a sweep, only the cells with these values of swept keys.
    """

    labels: tuple[str, ...] = ()
    where: dict[str, Any] | None = None

    def called_as(self, names: Sequence[str], what: str) -> list[str]:
        """Return the labels of some lines, or else their own names."""
        if self.labels and len(self.labels) != len(names):
            raise InputError(f"labels has {len(self.labels)}; expected one for each of {len(names)} {what}")
        return list(self.labels or names)


def data_for(what: Any, picture: Picture) -> Any:
    """Return what a picture draws of a thing: the thing itself; of a scenario its surface, summits or record."""
    made = getattr(what, "picture_data", None)
    if isinstance(what, list | tuple):
        what = [standard_layout(each) if is_history(each) else each for each in what]
    elif is_history(what):
        what = standard_layout(what)
    for each in what if isinstance(what, list | tuple) else (what,):
        if picture.only_planar and DIRECTION not in getattr(each, "sizes", ()):
            raise InputError(
                "the history has one tangential direction; expected loads or displacements in x and y, such as "
                'tangential_displacement = ["10 nm", "5 nm"]'
            )
        if not (picture.planar or picture.only_planar):
            check_direction(each, f"the picture {picture.kind}")
    return what if made is None else made(picture.kind)


def draw(what: Any, name: str, place: Place | None = None, *, of: str | type = HISTORY, **options: Any) -> FigureOrAxes:
    """Return a picture by its name, of a history or several, of a sweep or a scenario; options are its fields."""
    one = not isinstance(what, list | tuple)
    known = {each: kind for each, kind in PICTURES.items() if of in kind.of and (one or kind.several)}
    if name not in known:
        raise InputError(
            f"picture is {name!r}; {'' if one else 'of several results '}expected one of {', '.join(known)}"
        )
    return made(known[name], options, known).figure(what, place)


def made(kind: type[Picture], options: Mapping[str, Any], others: Mapping[str, type[Picture]]) -> Picture:
    """Return a picture with options; errors name which other pictures take an option."""
    own = [field.name for field in list_fields(kind)]
    for option in (each for each in options if each not in own):
        takers = [name for name, other in others.items() if option in attrs.fields_dict(other)]
        mend = f"it applies to {', '.join(takers)}" if takers else nearest(option, [*own, "picture", *PLACES])
        raise InputError(f"{option} does not apply to the picture {kind.kind}; {mend}")
    if needed := [field.name for field in list_fields(kind) if field.needed and field.name not in options]:
        raise InputError(f"the picture {kind.kind} needs {', '.join(needed)}")
    attrs.resolve_types(kind)
    types = {field.name: field.type for field in attrs.fields(kind)}
    return kind(**{name: _value(name, types[name], value) for name, value in options.items()})


def _value(name: str, kind: Any, value: Any) -> Any:
    """Return an option as its field has it: a list as a tuple, and a string, as the shell gives it, as its value."""
    members = {*get_args(kind)} if isinstance(kind, UnionType) else {kind}
    if any(get_origin(each) is Annotated for each in members):
        members = {get_args(each)[0] for each in members}
    members.discard(NoneType)
    arrays = [each for each in members if get_origin(each) is tuple]
    if arrays and isinstance(value, str):
        value = [_value(name, get_args(arrays[0])[0], part.strip()) for part in value.split(",")]
        if "" in value:
            raise InputError(f"{name}: expected values with one comma between each two")
    elif isinstance(value, str) and members != {str}:
        with suppress(tomllib.TOMLDecodeError):
            value = tomllib.loads(f"value = {value}")["value"]
    if bool in members and not isinstance(value, bool | NoneType):
        raise InputError(f"{name} is {value!r}; expected true or false")
    return tuple(value) if isinstance(value, list) else value


@functools.singledispatch
def figure_of(
    what: Any, *, picture: str | None = None, name: str = "", place: Place | None = None, **options: Any
) -> FigureOrAxes:
    """Return the picture of an object, by default the first of its type; InputError without one, or without this one.

    A type for which there is more to choose or to prepare registers its own with ``@figure_of.register(type)``. `name`
    is the path that it was read from, if any; `options` are fields of the picture.
    """
    called = name or f"this {type(what).__name__}"
    known = {
        each: kind
        for each, kind in PICTURES.items()
        if any(isinstance(of, type) and isinstance(what, of) for of in kind.of)
    }
    if not known:
        raise InputError(
            f"{called} has no picture; expected a history, a scenario, a surface, loops, a comparison or an asperity"
        )
    # the one that is of this type first of all goes before those of other things, too
    first = picture or min(known, key=lambda each: [isinstance(of, str) for of in known[each].of])
    return _of_one(what, first, known, called, place, options, name)


def _of_one(
    what: Any,
    picture: str,
    known: Mapping[str, type[Picture]],
    called: str,
    place: Place | None,
    options: Mapping[str, Any],
    name: str,
) -> FigureOrAxes:
    """Draw one of the pictures of a thing, below the name of its file, if it has one."""
    if picture not in known:
        raise InputError(f"picture {picture}: {called} has no such picture; expected {', '.join(known)}")
    titled = {"title": Path(name).name} if name and "title" in attrs.fields_dict(known[picture]) else {}
    return made(known[picture], titled | dict(options), known).figure(what, place)


@figure_of.register(list)
@figure_of.register(tuple)
def _of_several(
    what: Sequence[Any], *, picture: str | None = None, name: str = "", place: Place | None = None, **options: Any
) -> FigureOrAxes:
    """Draw several histories over one another."""
    for each in what:
        if not _is_history(each):
            raise InputError(
                f"{name or f'this {type(each).__name__}'} is no history; expected results of historysim run alone, or "
                "one other file"
            )
    return draw(what, picture or "loops", place, **options)


@figure_of.register(xr.Dataset)
def _of_dataset(
    what: xr.Dataset, *, picture: str | None = None, name: str = "", place: Place | None = None, **options: Any
) -> FigureOrAxes:
    """Draw a history, a sweep, a surface, a table, or loops that were written to a file."""
    content, called = what.attrs.get("content"), name or "this Dataset"
    # the rows of a sweep may be loads, too
    if content == SWEEP:
        return _of_sweep(what, picture, place, options)
    if _is_history(what) and content not in TABLES:
        return draw(what, picture or ("contact-map" if "step" in options else "history"), place, **options)
    kinds = {"fretting": content == "fretting report", "table": content in TABLES, "surface": "summit_height" in what}
    kinds |= {"loop-trends": "loop" in what.dims, "loop-levels": "loops" in what.coords}
    for kind, found in kinds.items():
        if found:
            titled = name if kind == "table" else ""
            return _of_one(what, picture or kind, {kind: PICTURES[kind]}, called, place, options, titled)
    raise InputError(f"{called} is no history; expected a Dataset from historysim, with its variables")


TABLES = ("table", "history over time")  # contents of files that are tables


def _is_history(what: Any) -> bool:
    return isinstance(what, xr.Dataset) and "total_normal_load" in what and what.attrs.get("content") != SWEEP


def _of_sweep(what: xr.Dataset, picture: str | None, place: Place | None, options: dict[str, Any]) -> FigureOrAxes:
    """Draw loops of the cells where these have rows and no numbers; else a number, by its name or the first one."""
    numbers = [str(each) for each in what.data_vars if not {"step", "asperity"} & set(what[each].dims)]
    if picture is None and not numbers:
        picture = "loops"
    if picture is not None and picture not in what.data_vars and picture in PICTURES:
        return draw(what, picture, place, of=SWEEP, **options)
    # what was asked for first, else what a sweep is mostly about; of others, such as a design, the first number
    asked = [*str(what.attrs.get("outputs", "")).split(), "preliminary_displacement"]
    known = [each for name in asked for each in (name, f"{name}_mean") if each in numbers]
    return draw(what, "curve", place, of=SWEEP, quantity=picture or [*known, *numbers][0], **options)


ACROSS, NARROWEST = 3, 55.0  # panels in a row, and the width that each has at least [mm]
PANEL, HEIGHT, TITLE = 90.0, 78.0, 8.0  # width and height of a panel, height of the title [mm]


# What the findings of the checks are called in a line.
BEYOND = {
    "steep": "steep asperities",
    "yield": "pressures beyond yield",
    "area": "a large contact area",
    "overlap": "overlapping contacts",
    "adhesion": "adhesion",
    "outliers": "a few high summits",
}


def draw_figure(what: Any, pictures: Sequence[Picture], title: str = "", place: Place | None = None) -> FigureOrAxes:
    """Return pictures of a result, a sweep or a scenario side by side, in a narrow figure below one another."""
    place = place or {}
    if len(pictures) == 1 and (pictures[0].alone or place.get("ax") is not None):
        return pictures[0].figure(what, place)
    across = min(len(pictures), ACROSS)
    width = PANEL * across + max(each.beside for each in pictures)

    def draw(canvas: Canvas) -> None:
        figure = canvas.several(len(pictures))
        fitting = pictures[: len(canvas.fitting([each.called for each in pictures]))]
        across = min(len(fitting), ACROSS, max(int(canvas.width / NARROWEST), 1))
        # also of one picture: what stands below it, and the line above all, then differ
        parts = figure.subfigures(-(-len(fitting) // across), across, squeeze=False).ravel()
        for part, picture in zip(parts, fitting, strict=False):
            picture.draw_named(canvas.part(part), data_for(what, picture))
        canvas.heading(title)
        if isinstance(what, xr.Dataset):
            found = [each.name for each in read_findings(str(what.attrs.get("validity", "[]")))]
            if names := [BEYOND[name] for name in found if name in BEYOND]:
                canvas.notice(f"beyond the model's assumptions: {', '.join(names)}")

    return drawn(place, (width, HEIGHT * -(-len(pictures) // across) + TITLE), draw)


DRAWN_IN = """size : (float, float), optional
    Width and height of a new figure [mm].
figure, ax : optional
    Draw into this figure, or these axes, of matplotlib."""


def as_function(kind: type[Picture]) -> Callable[..., FigureOrAxes]:
    """Return a picture as a function of what it is drawn of, its fields, and where it is drawn."""

    def function(
        data: Any, *, size: Size | None = None, figure: Any = None, ax: Any = None, **options: Any
    ) -> FigureOrAxes:
        return made(kind, options, {}).figure(data, {"size": size, "figure": figure, "ax": ax})

    first, *where, _ = inspect.signature(function).parameters.values()
    own = []
    for field in list_fields(kind):
        default = inspect.Parameter.empty if field.needed else field.default
        own.append(inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default))
    function.__name__ = function.__qualname__ = kind.kind.replace("-", "_")
    function.__signature__ = inspect.Signature([first, *own, *where])  # type: ignore[attr-defined] # as help() reads it
    about, examples, shown = (inspect.getdoc(kind) or "").partition("\n\nExamples\n")
    function.__doc__ = f"{about}\n\n{DRAWN_IN}{examples}{shown}"
    return function


def several_of(histories: Any) -> list[xr.Dataset]:
    """Return one history, or several, as a list."""
    return [histories] if isinstance(histories, xr.Dataset) else list(histories)
