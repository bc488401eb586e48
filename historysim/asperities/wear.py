"""Wear laws: volume lost by a summit, and its worn shape."""

from typing import Annotated, Any, Self

import attrs
import numpy as np

from historysim.asperities.law import WEAR_LAWS, Law, copy_array, put
from historysim.basics.arguments import Floats, scalar
from historysim.basics.fields import Number, Pressure, Quantity, at_least, choice
from historysim.basics.library import lib, pointer
from historysim.basics.units import as_float, cubic_metres_per_joule, pascals, quantity_text
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check

__all__ = ["ArchardWear", "EnergyWear", "WearLaw", "register"]


def __dir__() -> list[str]:
    return sorted(__all__)


register = WEAR_LAWS.register


@attrs.frozen(kw_only=True)
class WearLaw(Law):
    """A wear law: volume lost by an asperity, and the worn shape.

    The shape follows from the volume while the asperity slides as a whole: then its springs are at
    the friction limit for any shape, and no memory is lost. Volume lost in partial slip is removed
    from the shape only then.

    Parameters
    ----------
    shape : {"truncated", "blunted"}
        "truncated": the cap of the volume lost is cut off, h = √(V/(πR)), and the new
        summit has the radius of the old one. "blunted": within the contact circle of
        radius a the depth falls as 1 - r²/a², so that a paraboloid is left: dh = 2 dV/(πa²), d(1/R)
        = -4 dV/(πa⁴).
    """

    shape: str = attrs.field(default="truncated", validator=choice("truncated", "blunted"))

    registry = WEAR_LAWS
    struct, answers = "wear", "volume"

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_wear``."""
        return {"shape": f"HS_{self.shape.upper()}"}

    def volume(
        self, normal_load: Floats, slid_distance: Floats, dissipated_energy: Floats
    ) -> Floats:
        """Return the volume that asperities lose [m³] (asperity); a user-defined law computes it here, on arrays.

        Arguments are the mean load [N], the slid distance [m] and the dissipated energy [J] of an
        interval: twice the distance and energy remove twice the volume.
        """
        law, _ = self.in_library(None)
        volumes = np.empty(normal_load.size)
        arguments = [
            np.ascontiguousarray(values)
            for values in (normal_load, slid_distance, dissipated_energy)
        ]
        check(lib.hs_lost_volumes(law, volumes.size, *map(pointer, arguments), pointer(volumes)))
        return volumes

    def answer(self, pair: MaterialPair, *numbers: Any) -> None:
        """Answer ``hs_wear_function``."""
        count, *arguments, volume = numbers
        put(
            volume,
            count,
            self.volume(*(copy_array(values, count) for values in arguments)),
            "volumes",
        )

    @property
    def _shape_text(self) -> str:
        truncated = "caps cut off, radius kept"
        shape = (
            truncated
            if self.shape == "truncated"
            else "blunted to a paraboloid in the contact circle"
        )
        return f"{shape}; takes shape while an asperity slides"


@WEAR_LAWS.register
@attrs.frozen(kw_only=True)
class ArchardWear(WearLaw):
    """Wear in proportion to load and slid distance, dV = K N ds / H (Archard 1953).

    Parameters
    ----------
    coefficient : float
        K ≥ 0.
    hardness : float
        H > 0 of the softer body [Pa].
    shape : {"truncated", "blunted"}
        "truncated" cuts the cap of the volume off and keeps the radius. "blunted" leaves a blunter
        paraboloid. `WearLaw` has the equations.

    Examples
    --------
    [wear]
    law = "archard"
    coefficient = 1e-4
    hardness = "6 GPa"
    """

    coefficient: Number = attrs.field(converter=as_float, validator=at_least(0.0))
    hardness: Pressure = attrs.field(converter=pascals, validator=at_least(0.0, above=True))

    kind, library_kind = "archard", "HS_ARCHARD"

    @classmethod
    def from_volume(
        cls,
        worn_volume: float | str,
        *,
        normal_load: float | str,
        sliding_distance: float | str,
        hardness: float | str,
        shape: str = "truncated",
    ) -> Self:
        """Return the law from a worn volume [m³] under a load [N] over a distance [m]: K = V H/(N s).

        The distance is that of gross slip in both directions. `hs.register_maps` gives a worn volume;
        K then has its relative error. InputError: a volume below 0, or a load or a distance
        that is not above it.
        """
        lost = scalar("worn_volume", worn_volume, least=0)
        load_distance = scalar("normal_load", normal_load, above=0) * scalar(
            "sliding_distance", sliding_distance, above=0
        )
        return cls(
            coefficient=lost * scalar("hardness", hardness, above=0) / load_distance,
            hardness=hardness,
            shape=shape,
        )

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_wear``."""
        return super().core(pair) | {"rate": self.coefficient / self.hardness}

    @property
    def text(self) -> str:
        """The law in a line."""
        hardness = quantity_text(self.hardness, "Pa")
        return f"Archard: K = {self.coefficient:g} in load times slid distance over {hardness}; {self._shape_text}"


@WEAR_LAWS.register
@attrs.frozen(kw_only=True)
class EnergyWear(WearLaw):
    """Wear in proportion to the energy that friction takes, dV = α dE (Fouvry and others 1996).

    Parameters
    ----------
    volume_per_energy : float
        α ≥ 0 [m³/J].
    shape : {"truncated", "blunted"}
        "truncated" cuts the cap of the volume off and keeps the radius. "blunted" leaves a blunter
        paraboloid. `WearLaw` has the equations.

    Examples
    --------
    [wear]
    law = "energy"
    volume_per_energy = "2e-13 m3/J"
    """

    volume_per_energy: Annotated[float, Quantity("m3 J-1")] = attrs.field(
        converter=cubic_metres_per_joule, validator=at_least(0.0)
    )

    kind, library_kind = "energy", "HS_ENERGY_WEAR"

    @classmethod
    def from_volume(
        cls, worn_volume: float | str, *, dissipated_energy: float | str, shape: str = "truncated"
    ) -> Self:
        """Return the law by which a volume [m³] is lost with an energy dissipated by friction [J]: α = V/E.

        The energy is the sum over the loops of a record (`hs.loops`), or the energy dissipated in a history.
        InputError: a volume below 0, or an energy that is not above it.
        """
        energy = scalar("dissipated_energy", dissipated_energy, above=0)
        return cls(
            volume_per_energy=scalar("worn_volume", worn_volume, least=0) / energy, shape=shape
        )

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_wear``."""
        return super().core(pair) | {"rate": self.volume_per_energy}

    @property
    def text(self) -> str:
        """The law in a line."""
        return f"energy wear: {self.volume_per_energy:g} m³/J of the dissipated energy; {self._shape_text}"


def check_wear(law: WearLaw) -> None:
    """Check that a user-defined law is additive: the volume over a distance is the sum over its parts."""
    if not isinstance(law, WearLaw):
        raise InputError(
            f"wear is {law!r}; expected a WearLaw, such as ArchardWear(coefficient=…, hardness=…)"
        )
    if law.library_kind is not None:
        return
    load, slid = np.array([1e-3, 0.1, 10.0]), np.full(3, 1e-7)
    full, half = (
        np.asarray(law.volume(load, fraction * slid, fraction * 0.2 * load * slid))
        for fraction in (1.0, 0.5)
    )
    good = full.shape == load.shape and (np.isfinite(full) & (full >= 0.0)).all()
    if not good or not np.allclose(2.0 * half, full, rtol=1e-6, atol=0.0):
        raise InputError(
            f"{type(law).__name__}: volume of three asperities is {full}, of half the distance and energy {half}; "
            "expected three volumes of 0 or more [m³], and half as much: the volume lost in an interval, such as "
            "rate * normal_load * slid_distance"
        )
