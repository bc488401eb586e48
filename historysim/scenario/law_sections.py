"""``[friction]``, ``[wear]`` and ``surface.yielding``: coefficients, or laws by their names with what they need."""

from typing import TYPE_CHECKING

import attrs
from cattrs import Converter

from historysim.basics.fields import Numbers, fields_of
from historysim.basics.places import misfit
from historysim.scenario.friction_course_section import AnyCourse
from historysim.scenario.schema import kind_from_toml, table

if TYPE_CHECKING:
    from historysim.asperities.laws import FrictionLaw
    from historysim.asperities.wear import WearLaw
    from historysim.asperities.yielding import YieldingLaw


@attrs.frozen
class Coefficients:
    """Of ``[friction]``: one coefficient and its course, or one for each asperity.

    Attributes
    ----------
    coefficient
        Coefficient of friction μ, or an array with one for each asperity.
    course
        A coefficient that changes over time or distance, as below.
    """

    coefficient: Numbers
    course: AnyCourse | None = None


@attrs.frozen
class FrictionSection:
    """``[friction]``: one coefficient and its course, or one for each asperity, or a law.

    Attributes
    ----------
    of : Coefficients or FrictionLaw
        Whose fields are the keys of the section.
    """

    of: "Coefficients | FrictionLaw"

    @property
    def friction(self) -> "float | tuple[float, ...] | FrictionLaw":
        """The coefficients, or the law."""
        return self.of.coefficient if isinstance(self.of, Coefficients) else self.of

    @property
    def law(self) -> "FrictionLaw | None":
        """The law, where it is one."""
        return None if isinstance(self.of, Coefficients) else self.of

    @property
    def course(self) -> AnyCourse | None:
        """The course of the coefficient, where it has one."""
        return self.of.course if isinstance(self.of, Coefficients) else None


@attrs.frozen
class WearSection:
    """``[wear]``: what sliding takes from the asperities.

    Attributes
    ----------
    of : WearLaw
        Whose fields are the keys of the section.
    """

    of: "WearLaw"


@attrs.frozen
class YieldingSection:
    """``surface.yielding``: how summits yield on first loading.

    Attributes
    ----------
    of : YieldingLaw
        Whose fields are the keys of the section.
    """

    of: "YieldingLaw"


def friction_from_toml(converter: Converter, value: object, _: object) -> FrictionSection:
    """Return what ``[friction]`` says.

    Raises InputError: no such law, or keys that are neither of a coefficient nor of the law.
    """
    from historysim.asperities.laws import LAWS

    entry = table(value)
    if "law" in entry:
        return FrictionSection(kind_from_toml(converter, entry, LAWS, "law"))
    for key in set(entry) - {"coefficient", "course"}:
        if any(key == field.name for law in LAWS.values() for field in fields_of(law)):
            raise misfit(f"belongs to a law; expected law, one of {', '.join(LAWS)}", key)
    if not entry:
        raise misfit("missing; expected a coefficient, or law with what it needs", "coefficient")
    return FrictionSection(converter.structure(entry, Coefficients))


def wear_from_toml(converter: Converter, value: object, _: object) -> WearSection:
    """Return what ``[wear]`` says; errors as for `friction_from_toml`."""
    from historysim.asperities.wear import WEAR_LAWS

    return WearSection(kind_from_toml(converter, value, WEAR_LAWS, "law"))


def yielding_from_toml(converter: Converter, value: object, _: object) -> YieldingSection:
    """Return what ``surface.yielding`` says, if only the name of a law; errors as for `friction_from_toml`."""
    from historysim.asperities.yielding import YIELDING_LAWS

    entry = {"law": value} if isinstance(value, str) else value
    return YieldingSection(kind_from_toml(converter, entry, YIELDING_LAWS, "law"))
