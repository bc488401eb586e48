"""``[picture]``: what a scenario's figure shows. `historysim plot` of its result or sweep, and the gallery, draw it."""

from typing import TYPE_CHECKING, Any, Unpack

import attrs
from cattrs import Converter

from historysim.basics.places import misfit
from historysim.errors import InputError
from historysim.results.plots.panels import Panel
from historysim.results.plots.paper import Drawn, Page, Place
from historysim.results.plots.pictures import PICTURES, SCENARIO, Picture
from historysim.scenario.schema import array_of, kind_from_toml

if TYPE_CHECKING:
    from collections.abc import Mapping

    from historysim.surfaces.summits import Summits

APART, TOGETHER = 90.0, 35.0
"""What summits add to the width, side by side and over one another [mm]."""


@PICTURES.register
@attrs.frozen(kw_only=True)
class SummitsPicture(Panel):
    """Radius over height of all summits: of the surface, or of the surfaces of a sweep.

    Attributes
    ----------
    apart
        Several surfaces side by side.

    Examples
    --------
    [[picture]]
    kind = "summits"
    """

    apart: bool = False

    kind, of = "summits", (SCENARIO,)

    @property
    def beside(self) -> float:
        """Width of several surfaces [mm]."""
        return APART if self.apart else TOGETHER

    def draw(self, page: Page, what: Any) -> None:  # noqa: ANN401 - a scenario, as `of` says
        """Draw on a page."""
        from historysim.results.plots.summit_scatter import draw_summit_scatter

        summits = _summits(what)
        labels = self.labels or tuple(summits)
        draw_summit_scatter(page, list(summits.values()), labels, apart=self.apart, title=self.title)


@PICTURES.register
@attrs.frozen(kw_only=True)
class MapPicture(Panel):
    """The height map."""

    kind, of = "map", (SCENARIO,)

    def draw(self, page: Page, what: Any) -> None:  # noqa: ANN401 - a scenario, as `of` says
        """Draw on a page."""
        from historysim.results.plots.summit_scatter import draw_heights

        surface = what.surface().surface
        if surface is None:
            raise InputError(f"{what.path.name}: picture: the surface is no height map; expected one for the kind map")
        draw_heights(page, surface, self.title)


@PICTURES.register
@attrs.frozen(kw_only=True)
class RecordPicture(Picture):
    """The channels of a measured file as they were read, beside what conditioning left of them."""

    kind, of = "record", (SCENARIO,)

    def drawn(self, what: Any, **place: Unpack[Place]) -> Drawn:  # noqa: ANN401 - likewise
        """Return a figure of it alone."""
        from historysim.results.plots.record import plot_record

        return plot_record(what.measurement(), title=what.title or what.path.stem, **place)


Pictures = tuple[Picture, ...]


def pictures_from_toml(converter: Converter, value: object, _: object) -> Pictures:
    """Return the pictures that ``[picture]``, or each ``[[picture]]``, says.

    Raises InputError: an unknown kind, or keys that do not fit it.
    """

    def structured(each: object) -> Picture:
        picture: Picture = kind_from_toml(converter, each, PICTURES)
        return picture

    pictures = array_of(value, structured) if isinstance(value, list) else (structured(value),)
    for index, each in enumerate(pictures):
        if len(pictures) > 1 and not each.fits_beside():
            raise misfit(f"{each.kind!r} fills a figure of its own; expected it alone", index, "kind")
    return pictures


def _summits(scenario: Any) -> "dict[str, Summits]":  # noqa: ANN401 - a scenario, which knows its pictures
    """Return the summits of the surface, or of those of the sweep, by what each is called."""
    section = scenario.sections.sweep
    points: list[Mapping[str, Any]] = [{}] if section is None else list(section.grid().points())
    by_name: dict[str, Summits] = {}
    for point in points:
        summits = scenario.at(point).surface().summits
        if summits is None:
            raise InputError(f"{scenario.path.name}: picture: the surface has no summits; expected one that has")
        by_name[", ".join(_said(key, value) for key, value in point.items()) or "summits"] = summits
    return by_name


def _said(key: str, value: object) -> str:
    from historysim.results.plots.words import WORDS

    words, sign = WORDS.get(key.rsplit(".", 1)[-1], (key, ""))
    return f"{sign} = {value}" if sign else f"{words} {value}"
