"""``[picture]``: what a scenario's figure shows. `historysim plot` of its result or sweep, and the gallery, draw it."""

from collections.abc import Mapping
from typing import Annotated, Any

import attrs
from cattrs import Converter

from historysim.basics.fields import Quantity
from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.scenario.schema import array_of, table, text


@attrs.frozen(kw_only=True)
class Picture:
    """What every kind of picture has.

    Attributes
    ----------
    title : str
        A heading above this picture, beside the title of the scenario.
    labels : tuple of str
        What its lines, or surfaces, are called.
    where : dict, optional
        Of a sweep, only the cells with these values of swept keys.
    """

    title: str = ""
    labels: tuple[str, ...] = ()
    where: dict[str, Any] | None = None


@attrs.frozen(kw_only=True)
class LoopsPicture(Picture):
    """Friction loops over one another: of the run, or of the cells of a sweep."""

    steps: tuple[str, ...] | None = None
    first_loading: Annotated[tuple[float, ...], Quantity("N")] = ()
    work: bool = False
    drift: bool = False
    drive: bool = False
    loads: bool = False


@attrs.frozen(kw_only=True)
class TractionPicture(Picture):
    """The traction of an asperity at several states."""

    steps: tuple[str, ...] | None = None
    asperity: int | None = None
    across: str = "radius"
    limit: bool = True
    fronts: bool = False
    change_from: str | None = None


@attrs.frozen(kw_only=True)
class SummitsPicture(Picture):
    """Radius over height of all summits: of the surface, or of the surfaces of a sweep."""

    apart: bool = False


@attrs.frozen(kw_only=True)
class MapPicture(Picture):
    """The height map."""


@attrs.frozen(kw_only=True)
class CurvePicture(Picture):
    """A number of a sweep over what was swept, or over another number."""

    quantity: str
    over: str | None = None
    each: str | None = None
    spread: str = "deviation"
    fit: str | None = None
    logarithmic: bool | None = None


@attrs.frozen(kw_only=True)
class BarsPicture(Picture):
    """A number of the cells of a sweep as bars in groups, with the difference within each."""

    quantity: str
    groups: dict[str, Any]

    def __attrs_post_init__(self) -> None:
        """Check that groups are lists of names."""
        for name, bars in self.groups.items():
            if not isinstance(bars, list) or not bars or not all(isinstance(bar, str) for bar in bars):
                raise misfit(f"{shown(bars)}; expected an array with the names of its bars", "groups", name)


AnyPicture = LoopsPicture | TractionPicture | SummitsPicture | MapPicture | CurvePicture | BarsPicture
Pictures = tuple[AnyPicture, ...]
PICTURE_KINDS: Mapping[str, type] = {
    "loops": LoopsPicture,
    "traction": TractionPicture,
    "summits": SummitsPicture,
    "map": MapPicture,
    "curve": CurvePicture,
    "bars": BarsPicture,
}


def pictures_from_toml(converter: Converter, value: object, _: object) -> Pictures:
    """Return the pictures that ``[picture]``, or each ``[[picture]]``, says.

    Raises
    ------
    InputError
        An unknown kind, or keys that do not fit it.
    """

    def structured(each: object) -> AnyPicture:
        entry = dict(table(each))
        if "kind" not in entry:
            raise misfit(f"missing; expected one of {', '.join(PICTURE_KINDS)}", "kind")
        kind = text(entry.pop("kind"))
        if kind not in PICTURE_KINDS:
            raise misfit(f"{shown(kind)}; {nearest(kind, PICTURE_KINDS)}", "kind")
        picture: AnyPicture = converter.structure(entry, PICTURE_KINDS[kind])
        return picture

    return array_of(value, structured) if isinstance(value, list) else (structured(value),)
