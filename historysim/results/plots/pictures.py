"""What a picture is, and pictures by their names: of a history, a sweep or a scenario."""

import functools
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import attrs

from historysim.basics.fields import fields_of
from historysim.basics.registry import Registry
from historysim.errors import InputError
from historysim.results.plots.paper import Drawn, Page, Place, Size, paper

if TYPE_CHECKING:
    import xarray as xr

PICTURES: Registry[type["Picture"]] = Registry(
    "historysim.plots", "historysim.results.plots.pictures:Picture", "picture", "historysim.results.plots"
)
"""The pictures by their names in ``[picture]`` and ``--picture``."""
register = PICTURES.register

HISTORY, SWEEP, SCENARIO = "history", "sweep", "scenario"
"""What a picture is drawn of."""


@attrs.frozen(kw_only=True)
class Picture:
    """A picture: its fields are its options, which stand in ``[picture]`` or come with ``--picture``.

    One has `draw`, and can stand beside others in ``[[picture]]``, or `drawn`, and fills a figure of its own, or both.
    """

    registry: ClassVar[Registry[Any]] = PICTURES
    kind: ClassVar[str]
    """Its name."""
    of: ClassVar[tuple[str, ...]] = (HISTORY,)
    """What it is drawn of, of ``"history"``, ``"sweep"`` and ``"scenario"``."""
    size: ClassVar[Size] = (90.0, 78.0)
    """Width and height [mm] where no other is asked for."""
    caption: ClassVar[str] = ""
    """What stands below it in the report of a history, which leaves out what has none."""
    place: ClassVar[int] = 100
    """Its place in the report: before those of greater numbers."""
    totals: ClassVar[bool] = False
    """Whether it can be drawn of a history of totals alone."""
    several: ClassVar[bool] = False
    """Whether several histories can be in it: `drawn` then takes a sequence of them, too."""

    def draw(self, page: Page, what: Any) -> None:
        """Draw a Dataset, or of a scenario a Scenario, on a page, which is a figure, a part of one, or axes.

        ``page.axes()`` are those of a picture with one panel, ``page.several(count)`` is the figure of one with more;
        ``page.legend(axes)`` names what is drawn, and ``page.heading(text)`` is its title.
        """
        raise NotImplementedError(f"{type(self).__name__} has neither draw nor drawn, or fills a figure of its own")

    def drawn(self, what: Any, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone, or what was given to draw into."""
        with paper(self.drawn, self.size, place) as page:
            self.draw(page, what)
        return page.drawn

    @classmethod
    def fits_beside(cls) -> bool:
        """Return whether it can be a part of a figure."""
        return cls.draw is not Picture.draw

    @property
    def beside(self) -> float:
        """Width that it needs in ``[picture]`` beside that of every picture [mm]."""
        return 0.0

    @classmethod
    def reported(cls, history: "xr.Dataset") -> bool:
        """Return whether the report of a history shows it."""
        return bool(cls.caption) and (cls.totals or "slip_state" in history)


def draw(what: Any, name: str, place: Place | None = None, *, of: str = HISTORY, **options: Any) -> Drawn:
    """Return a picture by its name.

    Parameters
    ----------
    what : xarray.Dataset, Scenario, or sequence of Datasets
        A history, or several; or what ``of`` says.
    name : str
        A key of `PICTURES`.
    of : {"history", "sweep", "scenario"}
    place : Place, optional
        Where it is drawn: ``size`` [mm], ``figure`` or ``ax``.
    **options
        Fields of the picture.

    Raises
    ------
    InputError
        Another name, an option that the picture does not take, or as for its class.
    """
    one = not isinstance(what, list | tuple)
    known = {each: kind for each, kind in PICTURES.items() if of in kind.of and (one or kind.several)}
    if name not in known:
        whose = "" if one else "of several results "
        raise InputError(f"picture is {name!r}; {whose}expected one of {', '.join(known)}")
    for option, value in options.items():
        own = attrs.fields_dict(known[name])
        if f"{option}s" in own:
            raise InputError(f"{option} {value}: the picture {name} takes several; expected {option}s")
        if option not in own:
            others = ", ".join(each for each, kind in known.items() if option in attrs.fields_dict(kind))
            with_it = f"with {others}" if others else "none"
            raise InputError(f"{option} {value}: the picture {name} takes none; expected {with_it}")
    needed = [field.name for field in fields_of(known[name]) if field.needed and field.name not in options]
    if needed:
        raise InputError(f"the picture {name} needs {', '.join(needed)}; expected it as [picture] of the scenario")
    return known[name](**options).drawn(what, **(place or {}))


@functools.singledispatch
def figure_of(what: Any, **options: Any) -> Drawn:
    """Return the figure of a thing that has one picture; ``title``, ``name`` and ``place`` are for what takes them.

    What draws a type says so with ``@figure_of.register(type)``.

    Raises
    ------
    InputError
        It has none; it is called by its name.
    """
    raise InputError(
        f"{options.get('name', f'this {type(what).__name__}')} has no picture; expected a history, a scenario, a "
        "surface, loops, a comparison or an asperity"
    )
