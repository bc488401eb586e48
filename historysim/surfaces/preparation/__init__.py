"""Steps that prepare a height map before the summit search; the fields of their classes are keys of ``[surface]``."""

import abc
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import attrs

from historysim.basics.arguments import Booleans, Floats
from historysim.basics.fields import Key, Length, Lengths, Number, QuantityFields
from historysim.basics.registry import Registry
from historysim.basics.wording import Notify, count_text
from historysim.errors import error_path, field_error
from historysim.surfaces.filters import outliers, spikes
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
class Preparation(QuantityFields, abc.ABC):
    """A step that prepares a map: an attrs class; its fields are keys of ``[surface]``, all with a default."""

    kind: ClassVar[str]  #: its name
    order: ClassVar[float]  #: steps act from the lowest to the highest
    maps: ClassVar[tuple[str, ...]] = ()  #: kinds of map that have its keys; all kinds, if empty
    #: True if `historysim show` compares the map before and after this step
    compared: ClassVar[bool] = True

    @abc.abstractmethod
    def prepare(self, surface: Surface, notify: Notify) -> Surface:
        """Return the prepared map; the map itself if no key selects this step.

        ``notify`` reports a sentence to the user.

        Raises
        ------
        InputError
            If a key does not suit the map; `historysim.errors.at` names the key.
        """

    def after(
        self, key: str, method: Callable[..., Surface], surface: Surface, **options: Any
    ) -> Surface:
        """Apply a method of the map with the value of a key; return the map itself if the key is not set.

        Errors of the method name the key.
        """
        value = getattr(self, key)
        if value is None:
            return surface
        with error_path(key):
            return method(surface, value, **options)


def select_steps(
    map_kind: str | None, steps: Iterable[type["Preparation"]]
) -> list[type["Preparation"]]:
    """Return the preparation steps that a map kind supports, in the order in which they act."""
    return sorted(
        (step for step in steps if not step.maps or map_kind in step.maps),
        key=lambda step: step.order,
    )


def registered_steps() -> tuple[type["Preparation"], ...]:
    """Return the steps of this package and the steps registered by this process."""
    PREPARATIONS.import_own()
    return tuple(PREPARATIONS.own().values())


def list_keys(steps: Iterable[type["Preparation"]]) -> "list[attrs.Attribute[Any]]":
    """Return the keys of preparation steps, with resolved types."""
    return [key for step in steps for key in attrs.fields(attrs.resolve_types(step))]


def _without(
    surface: Surface,
    deviations: float,
    *,
    find: Callable[[Floats, float], Booleans],
    notify: Notify,
) -> Surface:
    """Return the map without points that deviate by more than this number of robust standard deviations."""
    wrong = find(surface.heights, deviations)
    notify(f"{count_text(int(wrong.sum()), 'point', 'points')} removed as {find.__name__}")
    return surface.without(wrong)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Crop(Preparation):
    """Crops the map; its heights are unchanged."""

    kind, order, maps = "crop", 10, ("random", "measured")

    #: The points between two positions along x; the first point is at 0.
    crop_x: Lengths | None = None
    crop_y: Lengths | None = None  #: Likewise along y.

    def prepare(self, surface: Surface, notify: Notify) -> Surface:  # noqa: ARG002 - no notice
        """Return the points between two positions."""
        surface = self.after("crop_x", Surface.cropped, surface)
        return self.after("crop_y", lambda map_, ends: map_.cropped(y=ends), surface)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Spikes(Preparation):
    """Removes spikes of the instrument."""

    kind, order, maps = "spikes", 20, ("measured",)

    #: Points that stand off the median of the 24 around them by more than so many robust standard
    #: deviations become missing.
    spikes: Number | None = attrs.field(default=None, validator=_DEVIATIONS)

    def prepare(self, surface: Surface, notify: Notify) -> Surface:
        """Return the map with its spikes missing."""
        return self.after("spikes", _without, surface, find=spikes, notify=notify)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class TakenForm(Preparation):
    """Removes the form of the map."""

    kind, order, maps, compared = "form", 30, ("measured",), False

    #: Taken off: ``"mean"``, ``"plane"``, ``"quadratic"``, ``"polynomial"`` or ``"sphere"``.
    form: str = "plane"
    degree: int | None = None  #: Of ``"polynomial"``, 0 to 12.

    def prepare(self, surface: Surface, notify: Notify) -> Surface:  # noqa: ARG002 - no notice
        """Return the map without its form."""
        return self.after("form", Surface.detrended, surface, degree=self.degree)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Outliers(Preparation):
    """Removes dirt and other points far above or below all others."""

    kind, order, maps = "outliers", 40, ("measured",)

    #: Points farther from the median height than so many robust standard deviations become missing.
    outliers: Number | None = attrs.field(default=None, validator=_DEVIATIONS)

    def prepare(self, surface: Surface, notify: Notify) -> Surface:
        """Return the map with its outliers missing."""
        return self.after("outliers", _without, surface, find=outliers, notify=notify)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Filters(Preparation):
    """Filters the map by wavelength and resamples it."""

    kind, order = "filters", 50

    #: Keeps what is longer than this cut-off, two pixels or more (ISO 16610-21).
    s_filter: Length | None = None
    l_filter: Length | None = None  #: Takes off what is longer than this cut-off.
    robust: bool = False  #: Both filters by ISO 16610-71.
    #: Pixel size on which the map is laid after ``s_filter``, by splines.
    resolution: Lengths | None = None

    def prepare(self, surface: Surface, notify: Notify) -> Surface:  # noqa: ARG002 - no notice
        """Apply the S-filter, the resolution and the L-filter, in this order."""
        if self.robust and self.s_filter is None and self.l_filter is None:
            raise field_error("no filter is given; expected s_filter or l_filter as well", "robust")
        surface = self.after("s_filter", Surface.smoothed, surface, robust=self.robust)
        surface = self.after("resolution", Surface.at_resolution, surface)
        return self.after("l_filter", Surface.roughness, surface, robust=self.robust)


@PREPARATIONS.register
@attrs.frozen(kw_only=True)
class Scaled(Preparation):
    """Stretches the heights, and reverses x."""

    kind, order, maps, compared = "scaled", 60, ("measured",), False

    rms_height: Length | None = None  #: The heights are stretched to it, after the filters.
    mirrored: bool = False  #: ``true`` reverses x.

    def prepare(self, surface: Surface, notify: Notify) -> Surface:  # noqa: ARG002 - no notice
        """Scale the map to an rms height and mirror it."""
        surface = self.after("rms_height", Surface.scaled, surface)
        return surface.mirrored() if self.mirrored else surface
