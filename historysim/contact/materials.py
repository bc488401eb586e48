"""Materials, pairs of them, and the built-in table."""

import csv
import math
import unicodedata
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final, Self

import attrs
import numpy as np
from attrs.converters import optional

from historysim.basics.arguments import ArrayLike, Floats, as_floats
from historysim.basics.fields import (
    FractureToughness,
    Length,
    Number,
    Pressure,
    Quantity,
    SurfaceEnergy,
    at_least,
)
from historysim.basics.units import (
    as_float,
    joules_per_area,
    metres,
    newtons,
    pascals,
    pascals_root_metre,
    quantity_text,
    to_si,
    warn_large_radius,
    warn_unlikely,
)
from historysim.basics.wording import html_table, nearest
from historysim.errors import InputError

HARDNESS_OF_YIELD = 2.8  # hardness over yield stress in tension (Tabor 1951)


def _metres_each(value: Any) -> Any:
    return tuple(map(as_float, to_si(value, "m"))) if isinstance(value, list | tuple) else value


def _is(
    fits: Callable[[Any], bool], expected: str
) -> Callable[[object, "attrs.Attribute[Any]", Any], None]:
    """Return the validator of a field with values that fit."""

    def check(owner: object, attribute: "attrs.Attribute[Any]", value: object) -> None:
        if not fits(value):
            raise InputError(
                f"{type(owner).__name__}: {attribute.name} is {value!r}; expected {expected}"
            )

    return check


def _is_range(value: Any) -> bool:
    floats = (
        isinstance(value, tuple)
        and len(value) == 2
        and all(isinstance(end, float) for end in value)
    )
    return floats and 0 <= value[0] <= value[1] < math.inf


_TEXT = _is(lambda value: isinstance(value, str), "a string")
_POISSON = _is(
    lambda ratio: isinstance(ratio, float) and -1 < ratio <= 0.5,
    "a number greater than -1 and at most 0.5",
)
_RANGE = _is(_is_range, "the lower and the upper end of a range [m], both finite and 0 or more")
_POSITIVE = at_least(0.0, above=True)
_ISOTROPIC: Any = None  # the shear modulus that follows from the other two
_POSITIVE_IF_KNOWN = attrs.validators.optional(_POSITIVE)

# Range of Young's modulus and hardness [Pa]: from a soft gel to a practically rigid body.
_LEAST_MODULUS, _LARGEST_MODULUS = 1e3, 1e18


@attrs.frozen(repr=False)
class Material:
    """An elastic, isotropic material.

    Raises
    ------
    InputError
        A number that is not finite or out of its range, a unit of something else, or a name or
        source that is not a string.

    Warns
    -----
    UnlikelyValueWarning
        A Young's modulus or a hardness that no material has, as where GPa were meant. Models
        without dimensions are pairs `MaterialPair.from_moduli`, of which nothing is expected.

    Examples
    --------
    >>> glass = hs.Material("my glass", youngs_modulus="64 GPa", poissons_ratio=0.2)
    >>> glass.shear_modulus
    26666666666.666668
    """

    name: str = attrs.field(validator=_TEXT)  #: as it appears in output
    #: Young's modulus E [Pa], > 0
    youngs_modulus: Pressure = attrs.field(converter=pascals, validator=_POSITIVE)
    #: ν [1], -1 < ν ≤ 0.5
    poissons_ratio: Number = attrs.field(converter=as_float, validator=_POISSON)
    #: Shear modulus G [Pa], > 0; E / (2 (1 + ν)) where it is not given. Tabulated values of
    #: anisotropic or rounded data need not agree with that relation.
    shear_modulus: Pressure = attrs.field(
        default=_ISOTROPIC, converter=optional(pascals), validator=_POSITIVE_IF_KNOWN
    )
    #: Surface energy γ [J/m²], > 0.
    surface_energy: SurfaceEnergy | None = attrs.field(
        default=None, converter=optional(joules_per_area), validator=_POSITIVE_IF_KNOWN
    )
    #: Lower and upper end of the rms roughness Rq of the samples [m].
    roughness: Annotated[tuple[float, float], Quantity("m")] | None = attrs.field(
        default=None, converter=optional(_metres_each), validator=attrs.validators.optional(_RANGE)
    )
    #: Radius of the sample ball [m], > 0; None for a flat.
    ball_radius: Length | None = attrs.field(
        default=None, converter=optional(metres), validator=_POSITIVE_IF_KNOWN
    )
    #: Where the numbers come from; two materials that differ in nothing else are equal.
    source: str = attrs.field(default="", validator=_TEXT, eq=False, repr=False)
    #: Indentation hardness H [Pa], > 0, with which it is checked whether the asperities are
    #: elastic.
    hardness: Pressure | None = attrs.field(
        default=None, converter=optional(pascals), validator=_POSITIVE_IF_KNOWN
    )
    #: Yield stress in tension Y [Pa], > 0, likewise.
    yield_stress: Pressure | None = attrs.field(
        default=None, converter=optional(pascals), validator=_POSITIVE_IF_KNOWN
    )
    #: K_Ic [Pa √m], > 0, with which it is checked whether a brittle material cracks.
    fracture_toughness: FractureToughness | None = attrs.field(
        default=None, converter=optional(pascals_root_metre), validator=_POSITIVE_IF_KNOWN
    )

    @property
    def cracking_load(self) -> float | None:
        """Load of a sharp contact at which median cracks begin [N], of its order: 2.2e4 K_Ic⁴/H³; None where not known.

        Lawn and Evans, *J. Mater. Sci.* 12 (1977) 2195-2199.
        """
        if self.hardness is None or self.fracture_toughness is None:
            return None
        # K⁴ and H³ alone might leave the range of floats
        return 2.2e4 * self.fracture_toughness * (self.fracture_toughness / self.hardness) ** 3

    def __repr__(self) -> str:
        values = {
            field.name: getattr(self, field.name)
            for field in attrs.fields(type(self))
            if field.repr
        }
        values = {name: value for name, value in values.items() if value is not None}
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in values.items())})"

    def _repr_html_(self) -> str:
        units = {"surface_energy": "J/m²", "ball_radius": "m", "fracture_toughness": "Pa √m"}
        numbers = [
            (field.name, getattr(self, field.name))
            for field in attrs.fields(type(self))
            if field.name not in {"name", "roughness", "source", "poissons_ratio"}
        ]
        lines = [
            (name, quantity_text(value, units.get(name, "Pa")))
            for name, value in numbers
            if value is not None
        ]
        texts = [
            ("poissons_ratio", f"{self.poissons_ratio:.4g}"),
            *([("source", self.source)] if self.source else []),
        ]
        return html_table(
            [(name.replace("_", " "), text) for name, text in [("name", self.name), *lines, *texts]]
        )

    def __attrs_post_init__(self) -> None:
        if self.shear_modulus is _ISOTROPIC:
            object.__setattr__(
                self, "shear_modulus", self.youngs_modulus / (2 * (1 + self.poissons_ratio))
            )
        for name in ("youngs_modulus", "hardness"):
            value = getattr(self, name)
            if value is not None and not _LEAST_MODULUS <= value <= _LARGEST_MODULUS:
                warn_unlikely(
                    f"Material: {name} is {quantity_text(value, 'Pa')}",
                    "Pa",
                    sample=value if value < _LEAST_MODULUS else 50,
                    stacklevel=3,
                )
        if self.ball_radius is not None:
            warn_large_radius("Material: ball_radius", self.ball_radius, stacklevel=3)


def _key(name: str) -> str:
    """Return the lookup key of a name: case, underscores, hyphens and subscripts do not matter."""
    plain = unicodedata.normalize("NFKC", name).lower()
    return " ".join(plain.replace("_", " ").replace("-", " ").split())


def _load_materials() -> tuple[Mapping[str, Material], Mapping[str, Material]]:
    """Read the built-in materials: by name, and by the keys of names and aliases; unknown values are empty cells."""
    materials: dict[str, Material] = {}
    by_key: dict[str, Material] = {}
    with Path(__file__).with_name("materials.csv").open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            name, aliases, source = row.pop("name"), row.pop("aliases"), row.pop("source")
            values = {key: float(value) for key, value in row.items() if value}
            ends = tuple(
                values.pop(name_of_end)
                for name_of_end in ("least_roughness", "largest_roughness")
                if name_of_end in values
            )
            materials[name] = Material(name=name, source=source, roughness=ends or None, **values)
            by_key |= dict.fromkeys(map(_key, [name, *aliases.split(";")]), materials[name])
    return MappingProxyType(materials), MappingProxyType(by_key)


# The built-in materials by name, from the table next to this module. The first six are Table B.1 of
# Winogrodzka's thesis, in which alumina and sapphire are one row, with hardness of other sources.
# The rest are rounded typical values from the stated source; batches differ by some per cent in E and
# by a quarter in hardness. Toughness is rounded from manufacturers' data: an order of magnitude.
_BY_NAME, _BY_KEY = _load_materials()
MATERIALS: Final = _BY_NAME


def material(name: str) -> Material:
    """Return a built-in material, by its name, formula or a common alias, such as ``"SiC"``.

    Case does not matter; underscores and hyphens are equivalent to spaces. Raises InputError: an
    unknown or ambiguous name.

    Examples
    --------
    >>> hs.material("silicon").youngs_modulus
    112000000000.0
    """
    key = _key(name) if isinstance(name, str) else ""
    if key in _BY_KEY:
        return _BY_KEY[key]
    other = "any other one has name, youngs_modulus and poissons_ratio, as { … } in a scenario, or as Material(…)"
    # part of a name or of several, such as "steel"
    words = set(key.split())
    matching = dict.fromkeys(
        row.name for full, row in _BY_KEY.items() if words and words <= set(full.split())
    )
    if len(matching) > 1:
        raise InputError(
            f"{name!r} is not one built-in material; expected one of {', '.join(matching)}; {other}"
        )
    near = f"did you mean {next(iter(matching))!r}?" if matching else nearest(key, [*MATERIALS])
    if near.startswith("expected"):
        near = nearest(key, [*_BY_KEY])
    hint = "" if near.startswith("expected") else f"{near} "
    raise InputError(
        f"{name!r} is not a built-in material; {hint}expected one of {', '.join(MATERIALS)}; {other}"
    )


def work_of_adhesion(
    first: ArrayLike, second: ArrayLike, interfacial: ArrayLike | None = None
) -> Floats:
    """Return the work of adhesion W [J/m²] of two surfaces: W = γ1 + γ2 - γ12, or 2√(γ1 γ2).

    γ1, γ2 > 0 [J/m²] are surface energies, γ12 that of the interface (Dupré). If it is not
    known, the geometric mean of the works of cohesion 2γ1 and 2γ2 is taken, which is good for
    dispersion forces (Girifalco and Good, *J. Phys. Chem.* 61 (1957) 904-909, with Φ = 1). An
    interface with more energy than the surfaces is an InputError.
    """
    energies = as_floats("first", first, above=0), as_floats("second", second, above=0)
    if interfacial is None:
        return 2 * np.sqrt(energies[0] * energies[1])
    energy = as_floats("interfacial", interfacial, least=0)
    work = energies[0] + energies[1] - energy
    if np.any(work <= 0):
        raise InputError(
            f"interfacial is {interfacial!r} J/m² between surfaces of {first!r} and {second!r} J/m², which do not "
            "adhere; expected an interfacial energy less than the sum of the two"
        )
    return work


def _least(*values: float | None) -> float | None:
    return min((value for value in values if value is not None), default=None)


@attrs.frozen(init=False, repr=False)
class MaterialPair:
    """The elastic constants of two materials in contact; `from_moduli` makes a pair without materials.

    Parameters
    ----------
    first, second : Material
        The order does not change the moduli. None where the pair is made from its moduli.

    Notes
    -----
    Hertz (1882); Mindlin, *J. Appl. Mech.* 16 (1949) 259-268; Johnson, *Contact Mechanics* (1985),
    sections 4.2 and 7.2.

    Examples
    --------
    >>> pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    >>> print(f"E* = {pair.contact_modulus:.4g} Pa, G* = {pair.shear_modulus:.4g} Pa")
    E* = 4.305e+10 Pa, G* = 9.232e+09 Pa
    """

    first: Material | None
    second: Material | None
    #: E* [Pa], > 0, with 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2.
    contact_modulus: float = attrs.field(converter=pascals, validator=_POSITIVE)
    #: G* [Pa], > 0, with 1/G* = (2 - ν1)/G1 + (2 - ν2)/G2: the convention in which the tangential
    #: stiffness of a circle of radius a is 8 G* a.
    shear_modulus: float = attrs.field(converter=pascals, validator=_POSITIVE)
    #: H and Y [Pa] of the softer material, as far as they are known.
    hardness: float | None = attrs.field(
        default=None, converter=optional(pascals), validator=_POSITIVE_IF_KNOWN
    )
    yield_stress: float | None = attrs.field(
        default=None, converter=optional(pascals), validator=_POSITIVE_IF_KNOWN
    )
    #: W = 2√(γ1 γ2) [J/m²] (Girifalco and Good); None where a surface energy is not known. The replay has no adhesion.
    work_of_adhesion: float | None = attrs.field(
        default=None, converter=optional(joules_per_area), validator=_POSITIVE_IF_KNOWN
    )
    #: The lower one of the two materials (`Material.cracking_load`) [N].
    cracking_load: float | None = attrs.field(
        default=None, converter=optional(newtons), validator=_POSITIVE_IF_KNOWN
    )

    def __init__(self, first: Material, second: Material) -> None:
        pair = (first, second)
        for member in pair:
            if not isinstance(member, Material):
                raise InputError(
                    f"MaterialPair: {member!r} is not a Material; expected one, as material('silicon'); a pair "
                    "with known moduli is MaterialPair.from_moduli(contact_modulus=..., shear_modulus=...)"
                )
        energies = [member.surface_energy for member in pair if member.surface_energy is not None]
        self.__attrs_init__(
            first,
            second,
            1 / sum((1 - member.poissons_ratio**2) / member.youngs_modulus for member in pair),
            1 / sum((2 - member.poissons_ratio) / member.shear_modulus for member in pair),
            _least(first.hardness, second.hardness),
            _least(first.yield_stress, second.yield_stress),
            2 * math.sqrt(energies[0] * energies[1]) if len(energies) == 2 else None,
            _least(first.cracking_load, second.cracking_load),
        )

    @classmethod
    def from_moduli(
        cls,
        *,
        contact_modulus: float,
        shear_modulus: float,
        hardness: float | None = None,
        yield_stress: float | None = None,
        work_of_adhesion: float | None = None,
        cracking_load: float | None = None,
    ) -> Self:
        """Return the pair that has these moduli and limits, all > 0, in the units and conventions of the class."""
        limits = (hardness, yield_stress, work_of_adhesion, cracking_load)
        return cls._made(None, None, contact_modulus, shear_modulus, *limits)

    def with_work_of_adhesion(self, work_of_adhesion: float) -> Self:
        """Return the pair with a measured work of adhesion W [J/m²], > 0, in place of the calculated one."""
        limits = (self.hardness, self.yield_stress, work_of_adhesion, self.cracking_load)
        return self._made(
            self.first, self.second, self.contact_modulus, self.shear_modulus, *limits
        )

    @classmethod
    def _made(cls, *values: Any) -> Self:
        pair = cls.__new__(cls)
        pair.__attrs_init__(*values)
        return pair

    @property
    def limits(self) -> dict[str, float]:
        """Which of `hardness`, `yield_stress`, `work_of_adhesion` and `cracking_load` are known, by their names."""
        names = ("hardness", "yield_stress", "work_of_adhesion", "cracking_load")
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    @property
    def displacement_ratio(self) -> float:
        """θ = E* / (4 G*) [1]: the tangential deflection of a spring over its normal deflection at equal force.

        In the row of springs that replaces the contact (method of dimensionality reduction), a
        spring has the normal stiffness E* and the tangential stiffness 4 G* per unit length of the
        row. The preliminary displacement of a Hertz contact is θ times the friction coefficient
        times the approach.
        """
        return self.contact_modulus / (4 * self.shear_modulus)

    @property
    def dundurs_beta(self) -> float | None:
        """Dundurs' second parameter β [1], which couples normal and tangential deflections; None for given moduli.

        β = ½ [(1 - 2ν1)/G1 - (1 - 2ν2)/G2] / [(1 - ν1)/G1 + (1 - ν2)/G2], positive where the first material is the more
        compliant. It is 0 for one material on itself and for two incompressible ones. The model
        takes it as 0: normal loads cause no tangential traction and tangential loads no pressure.
        For silicon on float glass it is -0.14.

        Dundurs, *J. Appl. Mech.* 36 (1969) 650-652; Johnson, *Contact Mechanics* (1985), section
        5.1, with this sign.
        """
        if self.first is None or self.second is None:
            return None
        pair = (self.first, self.second)
        slide = [(1 - 2 * member.poissons_ratio) / member.shear_modulus for member in pair]
        return (slide[0] - slide[1]) / (
            2 * sum((1 - member.poissons_ratio) / member.shear_modulus for member in pair)
        )

    def __str__(self) -> str:
        name = f"{self.first.name} on {self.second.name}" if self.first and self.second else "pair"
        contact, shear = (
            quantity_text(modulus, "Pa") for modulus in (self.contact_modulus, self.shear_modulus)
        )
        return f"{name}: E* = {contact}, G* = {shear}"

    def _repr_html_(self) -> str:
        name, _, moduli = str(self).partition(": ")
        return html_table([("pair", name), ("moduli", moduli)])

    def __repr__(self) -> str:
        if self.first is None:
            values = {
                "contact_modulus": self.contact_modulus,
                "shear_modulus": self.shear_modulus,
                **self.limits,
            }
            arguments = ", ".join(f"{key}={value!r}" for key, value in values.items())
            return f"{type(self).__name__}.from_moduli({arguments})"
        members = (
            f"material({member.name!r})"
            if member is not None and MATERIALS.get(member.name) == member
            else repr(member)
            for member in (self.first, self.second)
        )
        return f"{type(self).__name__}({', '.join(members)})"
