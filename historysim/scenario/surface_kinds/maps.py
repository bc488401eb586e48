"""Surfaces given by a height map: random, measured, or the sum of two."""

import abc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import attrs

from historysim.basics.places import at
from historysim.errors import InputError
from historysim.scenario.schema import Length, Lengths, Number, Quantity
from historysim.scenario.surface_kinds.base import Ground

if TYPE_CHECKING:
    from historysim.surfaces.heights import Surface

Angle = Annotated[float, Quantity("rad")]


class MapKind(Protocol):
    """A surface that is a height map."""

    def surface(self, folder: Path) -> "Surface":
        """Return the map; paths are relative to the folder."""

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the map, and what the user should know about how it was made."""


@attrs.frozen(kw_only=True)
class HeightMap(abc.ABC):
    """What every kind with a height map has."""

    rule: int = 9

    @abc.abstractmethod
    def surface(self, folder: Path) -> "Surface":
        """Return the map."""

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the map, and nothing that the user should know."""
        return self.surface(folder), ()

    def ground(self, folder: Path) -> Ground:
        """Return the summits of the map, and the map."""
        from historysim.basics.arguments import representable

        with representable():
            surface, notices = self.noticed(folder)
            summits = surface.summits(self.rule)
        if not len(summits):
            points = " × ".join(map(str, surface.shape))
            raise InputError(
                f"the {self.rule}-point rule finds no summit among {points} points; expected a point with lower ones "
                "all around, none of them missing or beyond the border"
            )
        return Ground(summits, surface, notices=notices)


@attrs.frozen(kw_only=True)
class RandomMap(HeightMap):
    """Random heights with an autocorrelation function."""

    shape: tuple[int, ...]
    pixel_size: Lengths
    rms_height: Length
    autocorrelation_length: Lengths
    seed: int
    autocorrelation: str = "exponential"
    skewness: Number = 0.0
    kurtosis: Number = 3.0

    def surface(self, folder: Path) -> "Surface":  # noqa: ARG002 - it needs no file
        """Return the map."""
        from historysim.surfaces.random import random_surface

        return random_surface(
            self.shape,  # type: ignore[arg-type] # its length is checked there
            self.pixel_size,
            self.rms_height,
            self.autocorrelation_length,
            seed=self.seed,
            autocorrelation=self.autocorrelation,
            skewness=self.skewness,
            kurtosis=self.kurtosis,
        )


@attrs.frozen(kw_only=True)
class MeasuredMap(HeightMap):
    """A measured height map."""

    file: str
    pixel_size: Lengths | None = None
    height_unit: str | None = None
    lateral_unit: str | None = None
    channel: int | str | None = None
    form: str = "plane"
    rms_height: Length | None = None
    mirrored: bool = False

    def surface(self, folder: Path) -> "Surface":
        """Return the map of the file, without its form, and scaled."""
        from historysim.surfaces.reading import read_surface

        with at("file"):
            measured = read_surface(
                folder / self.file,
                pixel_size=self.pixel_size,  # type: ignore[arg-type] # its length is checked there
                height_unit=self.height_unit,
                lateral_unit=self.lateral_unit,
                channel=self.channel,
            )
        with at("form"):
            measured = measured.detrended(self.form)
        if self.rms_height is not None:
            with at("rms_height"):
                measured = measured.scaled(self.rms_height)
        return measured.mirrored() if self.mirrored else measured


@attrs.frozen(kw_only=True)
class SumOfMaps(HeightMap):
    """Two rough surfaces against each other, as the sum of both against a flat."""

    first: MapKind
    second: MapKind
    shift: Lengths = (0.0, 0.0)
    rotation: Angle = 0.0
    interpolation: str = "spline"

    def surface(self, folder: Path) -> "Surface":
        """Return the sum of both maps."""
        return self.noticed(folder)[0]

    def noticed(self, folder: Path) -> "tuple[Surface, tuple[str, ...]]":
        """Return the sum of both maps, and what splines take from the second one."""
        from historysim.surfaces.smoothing import smoothing_notice

        with at("first"):
            first, notices = self.first.noticed(folder)
        with at("second"):
            second, more = self.second.noticed(folder)
        total = first.combined(
            second,
            shift=self.shift,
            rotation=self.rotation,
            interpolation=self.interpolation,  # type: ignore[arg-type] # its value is checked there
        )
        smoothed = None
        if self.interpolation == "spline":
            smoothed = smoothing_notice(first, second, shift=self.shift, rotation=self.rotation)
        return total, (*notices, *more, *([f"second surface of the sum: {smoothed}"] if smoothed else []))
