"""Yielding: the load that summits carry on first loading beyond their elastic limit."""

import abc
import math
from typing import Any, ClassVar, Self

import attrs
import numpy as np

from historysim.asperities.law import YIELDING_LAWS, Law, copy_array, put
from historysim.basics.arguments import Floats
from historysim.basics.fields import Number, Pressure, at_least
from historysim.basics.library import lib, pointer
from historysim.basics.units import as_float, is_number, pascals, quantity_text
from historysim.contact import hertz
from historysim.contact.materials import HARDNESS_OF_YIELD, MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check

__all__ = ["JacksonGreen", "KogutEtsion", "Thornton", "YieldingLaw", "register"]


def __dir__() -> list[str]:
    return sorted(__all__)


# Peak pressure at which a sphere begins to yield, over the yield stress (Johnson 1985, section 6.1;
# ν = 0.3).
PEAK_AT_ONSET = 1.6
# relative difference from Hertz at the onset up to which a law is continuous there
CONTINUOUS = 1e-3
POISSONS_RATIO = 0.3  # of a pair that is known by its moduli alone

register = YIELDING_LAWS.register


class YieldingLaw(Law):
    """A law of first loading: load and contact radius of a summit at an approach, beyond the onset of yield.

    Elastic unloading follows from it, for all laws: the Hertz contact through the largest load N,
    with the contact radius a there (Tabor 1948). The summit then has the radius R' = 4 E* a³/(3 N),
    and is lowered by the approach in excess of a²/R'. Unloading, reloading up to that load, and all
    tangential quantities refer to this summit. It is a model: the pressure under a summit that
    yields is flatter than Hertz's, unloading is not quite elastic (finite elements leave 6 to 23 %
    more of the approach, Etsion, Kligerman and Kadin 2005), and asperities yield alone.

    A user-defined law implements `critical_approach` and `first_loading`, for arrays.
    """

    registry = YIELDING_LAWS
    struct, answers = "yielding", "first_loading"

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_yielding``."""
        return {}

    def of(self, pair: MaterialPair) -> Self:
        """Return the law with missing parameters taken from the materials."""
        return self

    @abc.abstractmethod
    def critical_approach(self, summit_radius: Floats, pair: MaterialPair) -> Floats:
        """Return the approach up to which virgin summits are elastic [m] (summit), > 0; radii in m."""

    def first_loading(
        self, approach: Floats, summit_radius: Floats, pair: MaterialPair
    ) -> tuple[Floats, Floats]:
        """Return load [N] and contact radius [m] (summit) of virgin summits at an approach [m] on first loading.

        Up to the critical approach they are Hertz's, and continuous there. Beyond it the load
        rises, and is no more than Hertz's of that contact radius. Approaches and radii are arrays
        (summit) [m], > 0.
        """
        law, _ = self.in_library(pair)
        load, radius = np.empty(np.size(approach)), np.empty(np.size(approach))
        arguments = [
            np.ascontiguousarray(values, dtype=np.float64) for values in (approach, summit_radius)
        ]
        modulus = pair.contact_modulus
        check(
            lib.hs_first_loading(
                law, modulus, load.size, *map(pointer, arguments), pointer(load), pointer(radius)
            )
        )
        return load, radius

    def answer(self, pair: MaterialPair, *numbers: Any) -> None:
        """Answer ``hs_yielding_function``."""
        count, approach, radius, load, contact_radius = numbers
        loads, radii = self.first_loading(
            copy_array(approach, count), copy_array(radius, count), pair
        )
        put(load, count, loads, "loads of first loading")
        put(contact_radius, count, radii, "contact radii of first loading")


def _a_ratio(law: object, attribute: "attrs.Attribute[Any]", value: Any) -> None:
    if value is not None and not (is_number(value) and 0 <= value <= 0.5):
        raise InputError(
            f"{type(law).__name__}: {attribute.name} is {value!r}; expected a number from 0 to 0.5"
        )


@attrs.frozen(kw_only=True)
class HardnessLaw(YieldingLaw):
    """A law with the hardness and Poisson's ratio of the softer material.

    Parameters
    ----------
    hardness : float, optional
        H > 0 [Pa]; by default the hardness of the pair's softer material, or 2.8 times its yield
        stress.
    poissons_ratio : float, optional
        ν from 0 to 0.5; by default Poisson's ratio of the material with this hardness, or 0.3 for a
        pair given by moduli.
    """

    hardness: Pressure | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(pascals),
        validator=attrs.validators.optional(at_least(0.0, above=True)),
    )
    poissons_ratio: Number | None = attrs.field(
        default=None, converter=attrs.converters.optional(as_float), validator=_a_ratio
    )

    source: ClassVar[str]  #: its publication
    how: ClassVar[str]  #: description of the chosen parameters

    def of(self, pair: MaterialPair) -> Self:
        """Return the law with missing hardness and Poisson's ratio taken from a pair."""
        hardness = self.hardness or pair.hardness
        if hardness is None and pair.yield_stress is not None:
            hardness = HARDNESS_OF_YIELD * pair.yield_stress
        if hardness is None:
            raise InputError(
                f"yielding by {self.kind!r}: no material has a hardness or a yield stress; expected one, "
                "or a hardness of the law"
            )
        ratio = self.poissons_ratio
        if ratio is None:
            materials = [material for material in (pair.first, pair.second) if material is not None]
            softest = min(
                materials,
                key=lambda material: material.hardness or material.yield_stress or math.inf,
                default=None,
            )
            ratio = POISSONS_RATIO if softest is None else softest.poissons_ratio
        return attrs.evolve(self, hardness=hardness, poissons_ratio=ratio)

    def critical_strain(self, pair: MaterialPair) -> float:
        """Return the ratio of approach to radius at which a summit begins to yield: (π p0/(2 E*))²."""
        return (math.pi * self.peak_at_onset / (2 * pair.contact_modulus)) ** 2

    def critical_approach(self, summit_radius: Floats, pair: MaterialPair) -> Floats:
        """Return the approach up to which virgin summits are elastic [m] (summit)."""
        return self.critical_strain(pair) * summit_radius

    def core(self, pair: MaterialPair) -> dict[str, Any]:
        """Return the fields of ``hs_yielding``."""
        hardness, _ = self._parameters
        strain = hardness / HARDNESS_OF_YIELD / pair.contact_modulus
        return {
            "critical_strain": self.critical_strain(pair),
            "hardness": hardness,
            "yield_strain": strain,
        }

    @property
    @abc.abstractmethod
    def peak_at_onset(self) -> float:
        """Peak pressure p0 at which a summit begins to yield [Pa]."""

    @property
    def _parameters(self) -> tuple[float, float]:
        if self.hardness is None or self.poissons_ratio is None:
            raise InputError(
                f"{type(self).__name__} has no hardness yet; expected one, or of(pair)"
            )
        return self.hardness, self.poissons_ratio

    @property
    def text(self) -> str:
        """The law in a line."""
        hardness = (
            "of the softer material"
            if self.hardness is None
            else quantity_text(self.hardness, "Pa")
        )
        return f"{self.source}, hardness {hardness}{self.how}; elastic afterwards as Hertz"


@YIELDING_LAWS.register
@attrs.frozen(kw_only=True)
class KogutEtsion(HardnessLaw):
    """First loading by finite elements of a sphere (Kogut and Etsion 2002).

    *J. Appl. Mech.* 69 (2002) 657-662.

    With x = δ/δ_c and δ_c = (πKH/(2E*))² R, K = 0.454 + 0.41 ν, the load is N_c f(x) and the area
    πRδ_c g(x), N_c and πRδ_c those at x = 1. They print f = 1.03 x^1.425, g = 0.93 x^1.136 for 1 ≤
    x < 6; 1.40 x^1.263, 0.94 x^1.146 for 6 ≤ x < 110; then N = HA, A = 2πRδ. These jump by 3 and 7
    % at 1, by 2 and 3 % at 6, and by 7 to 15 % at 110. Here they are continuous: between 1 and 6,
    and between 100 and 110, by the power of x through the values at both ends, 1 and those that are
    printed beyond. From 6 to 100, and from 110 on, they are as printed. Where the mean pressure
    would be more than H, which it is below x = 110 for ν > 0.32, the load is HA.

    Examples
    --------
    [surface]
    kind = "random"
    shape = [256, 256]
    pixel_size = "1 µm"
    rms_height = "300 nm"
    autocorrelation_length = "20 µm"
    seed = 1
    yielding = { law = "kogut-etsion", hardness = "5.5 GPa" }
    """

    kind, library_kind = "kogut-etsion", "HS_KOGUT_ETSION"
    source, how = "Kogut and Etsion (2002)", "; joined continuously"

    @property
    def peak_at_onset(self) -> float:
        """Peak pressure p0 = KH at which a summit begins to yield [Pa]."""
        hardness, ratio = self._parameters
        return (0.454 + 0.41 * ratio) * hardness


@YIELDING_LAWS.register
@attrs.frozen(kw_only=True)
class Thornton(HardnessLaw):
    """First loading with Hertz's pressure cut off at a limit p_y (Thornton 1997).

    *J. Appl. Mech.* 64 (1997) 383-386.

    a² = Rδ as for Hertz, N/N_c = 1 + 1.5 (x - 1) with x = δ/δ_c, δ_c = (πp_y/(2E*))² R, N_c = π³p_y³R²/(6E*²). The
    limit is the peak pressure at which a sphere begins to yield, p_y = 1.6 Y = 1.6/2.8 H: with H =
    1.75 p_y any other limit is chosen. The mean pressure tends to p_y.
    """

    kind, library_kind = "thornton", "HS_THORNTON"
    source, how = "Thornton (1997)", ", pressure up to 1.6/2.8 of it"

    @property
    def peak_at_onset(self) -> float:
        """Peak pressure p_y, at which a summit begins to yield [Pa]."""
        return PEAK_AT_ONSET / HARDNESS_OF_YIELD * self._parameters[0]


@YIELDING_LAWS.register
@attrs.frozen(kw_only=True)
class JacksonGreen(HardnessLaw):
    """First loading by finite elements of a sphere (Jackson and Green 2005).

    *J. Tribology* 127 (2005) 343-354.

    With S_y = H/2.8, x = ω/ω_c and ω_c = (πCS_y/(2E*))² R, C = 1.295 exp(0.736 ν): Hertz up to x =
    1.9, then A/A_c = x (x/1.9)^B, B = 0.14 exp(23 S_y/E*), and N/N_c = exp(-x^(5/12)/4) x^1.5 + 4
    H_G/(C S_y) [1 - exp(-x^(5/9)/25)] x, H_G/S_y = 2.84 [1 - exp(-0.82 (a/R)^-0.7)]: the hardness
    falls as the contact becomes wide. The printed load jumps by some 0.5 % at x = 1.9: here that
    jump is taken away there, and 1.9/x of it beyond.
    """

    kind, library_kind = "jackson-green", "HS_JACKSON_GREEN"
    source, how = "Jackson and Green (2005)", "; joined continuously"

    @property
    def peak_at_onset(self) -> float:
        """Peak pressure p0 = C S_y at which a summit begins to yield [Pa]."""
        hardness, ratio = self._parameters
        return 1.295 * math.exp(0.736 * ratio) * hardness / HARDNESS_OF_YIELD


def law_on_summits(
    yielding: YieldingLaw | str | None, pair: MaterialPair, summit_radius: Floats
) -> YieldingLaw | None:
    """Resolve a yielding law, or its name, for summits of a pair of materials; None if there is none."""
    if yielding is None:
        return None
    law = YieldingLaw.from_settings({"law": yielding}) if isinstance(yielding, str) else yielding
    if not isinstance(law, YieldingLaw):
        raise InputError(
            f"yielding is {yielding!r}; expected a YieldingLaw, such as KogutEtsion(hardness=…)"
        )
    law = law.of(pair)
    _check_law(law, summit_radius, pair)
    return law


def _check_law(law: YieldingLaw, summit_radius: Floats, pair: MaterialPair) -> None:
    """Check a law on summits of the smallest and the largest radius, from the onset of yield."""
    name = type(law).__name__
    for radius in (float(summit_radius.min()), float(summit_radius.max())):
        onset = np.asarray(law.critical_approach(np.array([radius]), pair), dtype=np.float64)
        if onset.shape != (1,) or not (np.isfinite(onset[0]) and onset[0] > 0):
            raise InputError(
                f"{name}.critical_approach is {onset!r} at R = {radius:g} m; expected numbers above 0"
            )
        approach = onset[0] * np.geomspace(1.0, 1e4, 60)
        loading = law.first_loading(approach, np.full(60, radius), pair)
        load, contact = (np.asarray(values, dtype=np.float64) for values in loading)
        elastic = hertz.normal_load(
            onset[0], summit_radius=radius, contact_modulus=pair.contact_modulus
        )
        if (
            not load.shape == contact.shape == approach.shape
            or not np.isfinite([load, contact]).all()
            or (np.diff(load) <= 0).any()
            or (np.diff(contact) <= 0).any()
            or abs(load[0] - elastic) > CONTINUOUS * elastic
            or abs(contact[0] ** 2 - radius * onset[0]) > CONTINUOUS * contact[0] ** 2
            or (load > 4 * pair.contact_modulus * contact**3 / (3 * radius) * (1 + 1e-9)).any()
        ):
            raise InputError(
                f"{name}.first_loading from the onset δ = {approach[0]:g} m on gives {load.ravel()[:3]}… N and radii "
                f"{contact.ravel()[:3]}… m at R = {radius:g} m; expected arrays that rise from Hertz's {elastic:g} N, "
                f"{math.sqrt(radius * onset[0]):g} m, with no more than Hertz's load at each radius"
            )
