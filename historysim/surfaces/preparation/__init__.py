"""Steps that prepare a height map before its summits are found: a class each; its fields are keys of ``[surface]``."""

import abc
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, ClassVar

import attrs

from historysim.basics.fields import Key, Length, Lengths, Number
from historysim.basics.registry import Registry
from historysim.basics.wording import Notify, counted
from historysim.errors import at, misfit

if TYPE_CHECKING:
    from historysim.basics.arguments import Booleans, Floats
    from historysim.surfaces.heights import Surface

# The steps by their names.
PREPARATIONS: Registry[type["Preparation"]] = Registry(
    "historysim.preparations",
    "historysim.surfaces.preparation:Preparation",
    "step of preparation",
    "historysim.surfaces.preparation",
)

_DEVIATIONS = Key(lambda number: number > 0, "a number of standard deviations, greater than 0")


@attrs.frozen(kw_only=True)
class Preparation(abc.ABC):
    """A step that prepares a map: an attrs class; its fields are keys of ``[surface]``, all with a default."""

    kind: ClassVar[str]  #: its name
    order: ClassVar[float]  #: steps act from the lowest to the highest
    maps: ClassVar[tuple[str, ...]] = ()  #: kinds of map that have its keys; all kinds, if empty
    compared: ClassVar[bool] = True  #: whether `historysim show` compares the map with how it is without this step

    @abc.abstractmethod
    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":
        """Return the map after this step, the same one where no key asks for it.

        ``notify`` takes a sentence for the user.

        Raises
        ------
        InputError
            A key that does not fit the map; `historysim.errors.at` names the key.
        """


def steps_for(map_kind: str | None, steps: Iterable[type["Preparation"]]) -> list[type["Preparation"]]:
    """Return those of some steps that a kind of map has, in the order in which they act."""
    return sorted((step for step in steps if not step.maps or map_kind in step.maps), key=lambda step: step.order)


def own_steps() -> tuple[type["Preparation"], ...]:
    """Return the steps of this package, and those registered in this process."""
    PREPARATIONS.import_own()
    return tuple(PREPARATIONS.own().values())


def keys_of(steps: Iterable[type["Preparation"]]) -> "list[attrs.Attribute[Any]]":
    """Return the keys of some steps, with their types."""
    return [key for step in steps for key in attrs.fields(attrs.resolve_types(step))]


def _without(
    surface: "Surface", find: Callable[["Floats", float], "Booleans"], deviations: float | None, notify: Notify
) -> "Surface":
    """Return the map without the points that stand off by so many robust standard deviations."""
    if deviations is None:
        return surface
    wrong = find(surface.heights, deviations)
    notify(f"{counted(int(wrong.sum()), 'point', 'points')} taken off as {find.__name__}")
    return surface.without(wrong)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Crop(Preparation):
    """Takes a part of the map; its heights stay as they are.

    Attributes
    ----------
    crop_x
        The points between two positions along x; the first point is at 0.
    crop_y
        Likewise along y.
    """

    kind, order, maps = "crop", 10, ("random", "measured")

    crop_x: Lengths | None = None
    crop_y: Lengths | None = None

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":  # noqa: ARG002 - nothing to notice
        """Return the points between two positions."""
        with at("crop_x"):
            surface = surface if self.crop_x is None else surface.cropped(x=self.crop_x)
        with at("crop_y"):
            return surface if self.crop_y is None else surface.cropped(y=self.crop_y)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Spikes(Preparation):
    """Takes off spikes of the instrument.

    Attributes
    ----------
    spikes
        Points that stand off the median of the 24 around them by more than so many robust standard deviations
        become missing.
    """

    kind, order, maps = "spikes", 20, ("measured",)

    spikes: Number | None = attrs.field(default=None, validator=_DEVIATIONS)

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":
        """Return the map with its spikes missing."""
        from historysim.surfaces.filters import spikes

        return _without(surface, spikes, self.spikes, notify)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class TakenForm(Preparation):
    """Takes off the form of the map.

    Attributes
    ----------
    form
        Taken off: ``"mean"``, ``"plane"``, ``"quadratic"``, ``"polynomial"`` or ``"sphere"``.
    degree
        Of ``"polynomial"``, 0 to 12.
    """

    kind, order, maps, compared = "form", 30, ("measured",), False

    form: str = "plane"
    degree: int | None = None

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":  # noqa: ARG002 - nothing to notice
        """Return the map without its form."""
        with at("form"):
            return surface.detrended(self.form, self.degree)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Outliers(Preparation):
    """Takes off dirt and what else stands far above or below all other points.

    Attributes
    ----------
    outliers
        Points farther from the median height than so many robust standard deviations become missing.
    """

    kind, order, maps = "outliers", 40, ("measured",)

    outliers: Number | None = attrs.field(default=None, validator=_DEVIATIONS)

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":
        """Return the map with its outliers missing."""
        from historysim.surfaces.filters import outliers

        return _without(surface, outliers, self.outliers, notify)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Filters(Preparation):
    """Keeps waves of some lengths, and lays the map on other points.

    Attributes
    ----------
    s_filter
        Keeps what is longer than this cut-off, two pixels or more (ISO 16610-21).
    l_filter
        Takes off what is longer than this cut-off.
    robust
        Both filters by ISO 16610-71.
    resolution
        Pixel size on which the map is laid after ``s_filter``, by splines.
    """

    kind, order = "filters", 50

    s_filter: Length | None = None
    l_filter: Length | None = None
    robust: bool = False
    resolution: Lengths | None = None

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":  # noqa: ARG002 - nothing to notice
        """Return the map after its S-filter, on the points of the resolution, after its L-filter."""
        if self.robust and self.s_filter is None and self.l_filter is None:
            raise misfit("there is no filter; expected s_filter or l_filter beside it", "robust")
        if self.s_filter is not None:
            with at("s_filter"):
                surface = surface.smoothed(self.s_filter, robust=self.robust)
        if self.resolution is not None:
            with at("resolution"):
                surface = surface.at_resolution(self.resolution)
        if self.l_filter is not None:
            with at("l_filter"):
                surface = surface.roughness(self.l_filter, robust=self.robust)
        return surface


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Scaled(Preparation):
    """Stretches the heights, and reverses x.

    Attributes
    ----------
    rms_height
        The heights are stretched to it, after the filters.
    mirrored
        ``true`` reverses x.
    """

    kind, order, maps, compared = "scaled", 60, ("measured",), False

    rms_height: Length | None = None
    mirrored: bool = False

    def prepare(self, surface: "Surface", notify: Notify) -> "Surface":  # noqa: ARG002 - nothing to notice
        """Return the map at another rms height, or seen from behind."""
        if self.rms_height is not None:
            with at("rms_height"):
                surface = surface.scaled(self.rms_height)
        return surface.mirrored() if self.mirrored else surface
