"""``[picture]``: what a scenario's figure shows. `historysim plot` of its result or sweep, and the gallery, draw it."""

from collections.abc import Mapping
from typing import Annotated, Any

import attrs
from cattrs import Converter

from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.scenario.schema import Quantity, array_of, table, text


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
    """Friction loops over one another: of the run, or of the cells of a sweep.

    Attributes
    ----------
    steps
        Names of states that are marked; by default all.
    first_loading
        Normal loads whose curves of first loading are drawn.
    work
        Shades the closed loop between ±δ. Of a sweep it needs ``preliminary_displacement`` among the outputs.
    drift
        Draws it between the δ of two loops; needs the same.
    drive
        Behind an instrument the loop of the drive, too.
    loads
        Both loads along the named states, beside the loop.

    Examples
    --------
    [[picture]]
    kind = "loops"
    loads = true
    """

    steps: tuple[str, ...] | None = None
    first_loading: Annotated[tuple[float, ...], Quantity("N")] = ()
    work: bool = False
    drift: bool = False
    drive: bool = False
    loads: bool = False


@attrs.frozen(kw_only=True)
class TractionPicture(Picture):
    """The traction of an asperity at several states.

    Attributes
    ----------
    steps
        Names of states; by default all.
    asperity
        Which; by default the one that carries most.
    across
        ``"radius"`` or ``"diameter"``.
    limit
        Draws ±μp of each state.
    fronts
        Marks where slip ends.
    change_from
        A state from which on changes are drawn.

    Examples
    --------
    [[picture]]
    kind = "traction"
    across = "diameter"
    """

    steps: tuple[str, ...] | None = None
    asperity: int | None = None
    across: str = "radius"
    limit: bool = True
    fronts: bool = False
    change_from: str | None = None


@attrs.frozen(kw_only=True)
class SummitsPicture(Picture):
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


@attrs.frozen(kw_only=True)
class MapPicture(Picture):
    """The height map."""


@attrs.frozen(kw_only=True)
class CurvePicture(Picture):
    """A number of a sweep over what was swept, or over another number.

    Attributes
    ----------
    quantity
        The number of the sweep.
    over
        A dimension, or another number, such as ``peak_nominal_pressure``.
    each
        The dimension of the lines.
    spread
        ``"deviation"``, ``"quantiles"`` or ``"none"``.
    fit
        ``"straight"`` (with R²) or ``"power"`` (with the exponent).
    logarithmic
        Both axes.

    Examples
    --------
    [[picture]]
    kind = "curve"
    quantity = "presliding_work"
    over = "loading_waypoints[0]_normal_load"
    fit = "power"
    """

    quantity: str
    over: str | None = None
    each: str | None = None
    spread: str = "deviation"
    fit: str | None = None
    logarithmic: bool | None = None


@attrs.frozen(kw_only=True)
class BarsPicture(Picture):
    """A number of the cells of a sweep as bars in groups, with the difference within each.

    Attributes
    ----------
    quantity
        The number of the sweep.
    groups
        A table of lists with the name of each bar.

    Examples
    --------
    [[picture]]
    kind = "bars"
    quantity = "preliminary_displacement"
    groups = { "1 N" = ["100 m", "1000 m"] }
    """

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
