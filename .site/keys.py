"""``scenarios/keys.md``: every section and key of a scenario, from the classes that read them.

The classes say what a key is: its type and unit, its default, and in their docstrings what it means and how it looks.
``python .site/keys.py`` writes the page; a test asks whether it is up to date.
"""

import inspect
import sys
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

import attrs
from numpydoc.docscrape import NumpyDocString

from historysim.contact.materials import MATERIALS
from historysim.scenario import friction_course_section, law_sections, picture_kinds, sections
from historysim.scenario.loading_kinds import channels, from_file, written
from historysim.scenario.surface_kinds import distributions, given_summits, interacting, map_kinds, normal_curve, scaled
from historysim.tables import Column, Format

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = Path(__file__).resolve().parent.parent / "scenarios" / "keys.md"

INTRODUCTION = """\
# Keys of a scenario

Every section and key. A number is in SI, or a text with a unit that converts to the one that stands here:
`normal_load = "50 mN"`. Keys in **bold** are needed; those without a default may be left out. [Scenarios](README.md)
tells how they go together.

This page is made from the program by `python .site/keys.py`.
"""

FILES = """\
Keys beside `file`. Most are found out ([files of numbers](../historysim/tables/README.md)). A column
is a name, or a table with the keys below."""

SECTIONS: dict[str, tuple[str, tuple[tuple[str, type], ...]]] = {
    "`title`": ("", (("", sections.Sections),)),
    "`[materials]`": ("", (("", sections.MaterialsSection), ("Your own material", sections.MaterialTable))),
    "`[surface]`": (
        "`kind` says which surface it is. [Surfaces](../historysim/surfaces/README.md) tells what they are for.",
        (
            ('`kind = "sphere"`', given_summits.Sphere),
            ('`kind = "summits"`, written out', given_summits.InlineSummits),
            ('`kind = "summits"`, from a file', given_summits.SummitTable),
            ("`columns` of a file of summits", given_summits.SummitColumns),
            ('`kind = "textured"`', given_summits.Textured),
            ('`kind = "statistics"`, Gaussian', distributions.GaussianHeights),
            ('`kind = "statistics"`, a density written out', distributions.InlineDistribution),
            ('`kind = "statistics"`, a density from a file', distributions.DistributionTable),
            ("`columns` of a file with a density", distributions.DensityColumns),
            ('`kind = "random"`', map_kinds.RandomMap),
            ('`kind = "measured"`', map_kinds.MeasuredMap),
            ('`kind = "sum"`', map_kinds.SumOfMaps),
            ('`kind = "normal_curve"`', normal_curve.NormalCurveTable),
            ("`columns` of a file with a normal curve", normal_curve.CurveColumns),
            ("Of any surface with summits", scaled.Scaled),
            ("Of any height map", interacting.Interacting),
        ),
    ),
    "`[friction]`": (
        "",
        (
            ("", law_sections.FrictionSection),
            ("`[friction.course]`, written out", friction_course_section.WrittenCourse),
            ("`[friction.course]`, from a file", friction_course_section.CourseFile),
            ("`columns` of a file with a course", friction_course_section.CourseColumns),
        ),
    ),
    "`[loading]`": (
        "Exactly one of `waypoints`, `blocks`, `file`.",
        (
            ("Waypoints", written.Waypoints),
            ("A waypoint", written.Waypoint),
            ("`geometry` of a waypoint", written.GeometryTable),
            ("Blocks of waypoints", written.Blocks),
            ("A block", written.WaypointBlock),
            ("`each` of a block", written.Each),
            ("A measured file", from_file.MeasuredLoading),
            ("`[loading.columns]`", channels.LoadColumns),
            ("`[loading.response]`", channels.Channels),
            ("A channel that is a load", channels.ForceChannel),
            ("A channel that is a displacement", channels.LengthChannel),
            ("`[loading.dead_band]`", channels.DeadBand),
        ),
    ),
    "`[wear]`": ("", (("", law_sections.WearSection),)),
    "`[instrument]`": ("", (("", sections.InstrumentSection),)),
    "`[adhesion]`": ("", (("", sections.AdhesionSection),)),
    "`[record]`": ("", (("", sections.RecordSection),)),
    "`[fit]`": ("", (("", sections.FitSection),)),
    "`[sweep]`": ("", (("", sections.SweepSection),)),
    "`[design]`": ("", (("", sections.DesignSection),)),
    "`[picture]`": (
        "",
        (
            ("Of all kinds", picture_kinds.Picture),
            ('`kind = "loops"`', picture_kinds.LoopsPicture),
            ('`kind = "traction"`', picture_kinds.TractionPicture),
            ('`kind = "summits"`', picture_kinds.SummitsPicture),
            ('`kind = "map"`', picture_kinds.MapPicture),
            ('`kind = "curve"`', picture_kinds.CurvePicture),
            ('`kind = "bars"`', picture_kinds.BarsPicture),
        ),
    ),
    "`[metadata]`": (
        "By the names of ACDD 1.3. They become attributes of the result.",
        (("", sections.MetadataSection),),
    ),
    "Files of numbers": (
        FILES,
        (("", Format), ("A column", Column)),
    ),
}
"""The headings of the page; of each, what stands above its tables, and the classes with their headings."""

SHARED = (picture_kinds.Picture, Format)
"""Classes whose keys stand in a table of their own, and not with each class that has them."""


HEADING = ("| key | type or unit | default | meaning |", "| --- | --- | --- | --- |")


def meanings(kind: type) -> dict[str, str]:
    """Return what each key of a class means, as docstrings of the class and those that it derives from say."""
    found: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        parsed = NumpyDocString(inspect.cleandoc(each.__dict__.get("__doc__") or ""))
        for part in ("Parameters", "Attributes"):
            found |= {entry.name: " ".join(entry.desc) for entry in parsed[part]}
    return found


def example(kind: type) -> str:
    """Return the lines of TOML that the docstring of a class shows."""
    lines = NumpyDocString(inspect.cleandoc(kind.__doc__ or ""))["Examples"]
    return "\n".join(lines).strip()


def type_text(kind: Any) -> str:
    """Say the type of a key in words: ``"m"`` of a length, ``"m, one or several"``, ``"true or false"``."""
    if get_origin(kind) is Annotated:
        plain, quantity = get_args(kind)
        unit = "number" if quantity.unit == "1" else _unit(quantity.unit)
        if get_origin(plain) is tuple:
            return f"array, {unit}"
        return f"{unit}, one or several" if isinstance(plain, UnionType) else unit
    if get_origin(kind) in {Union, UnionType}:
        return " or ".join(dict.fromkeys(type_text(each) for each in get_args(kind) if each is not NoneType))
    if get_origin(kind) is tuple:
        return f"array of {_plural(type_text(get_args(kind)[0]))}"
    if get_origin(kind) is dict or attrs.has(kind):
        return "column" if kind is Column else "table"
    return {str: "text", int: "whole number", float: "number", bool: "true or false"}.get(kind, "any value")


def _unit(text: str) -> str:
    powers = {"-1": "⁻¹", "-2": "⁻²", "2": "²", "3": "³"}
    words = []
    for word in text.split():
        letters = word.rstrip("-0123456789")
        words.append(letters + powers.get(word[len(letters) :], ""))
    return " ".join(words)


def _plural(text: str) -> str:
    return {"text": "texts", "whole number": "whole numbers", "table": "tables", "column": "columns"}.get(text, text)


def _default(field: "attrs.Attribute[Any]") -> str:
    value = None if isinstance(field.default, attrs.Factory) else field.default  # type: ignore[arg-type]
    if field.default is attrs.NOTHING or value in {None, (), ""} or attrs.has(type(value)):
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f'`"{value}"`'
    return f"`{list(value)}`" if isinstance(value, tuple) else f"`{value:g}`"


def keys(kind: type) -> "Iterator[attrs.Attribute[Any]]":
    """Yield the keys of a class, those that are needed first, without those that have a table elsewhere."""
    attrs.resolve_types(kind)
    above = [other for other in SHARED if issubclass(kind, other) and kind is not other]
    elsewhere = {field.name for other in above for field in attrs.fields(other)}
    if kind is sections.Sections:
        elsewhere = {field.name for field in attrs.fields(kind)} - {"title"}
    if kind in {scaled.Scaled, interacting.Interacting}:
        elsewhere = {"kind"}
    yield from sorted(
        (field for field in attrs.fields(kind) if field.init and field.name not in elsewhere),
        key=lambda field: field.default is not attrs.NOTHING,
    )


def rows(kind: type) -> list[str]:
    """Return the rows of the table of a class."""
    told, found = meanings(kind), []
    for field in keys(kind):
        name = f"**`{field.name}`**" if field.default is attrs.NOTHING else f"`{field.name}`"
        meaning = told.get(field.name, "").replace("``", "`").replace("|", "\\|")
        found.append(f"| {name} | {type_text(field.type)} | {_default(field)} | {meaning} |")
    return found


def summary(kind: type) -> str:
    """Return the first paragraph of the docstring of a class."""
    return " ".join(inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0].split()).replace("``", "`")


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION.rstrip()]
    for heading, (text, classes) in SECTIONS.items():
        parts += [f"## {heading}"] + ([text] if text else [])
        if heading == "`[materials]`":
            parts.append(f"Built in: {', '.join(f'`{chr(34)}{name}{chr(34)}`' for name in MATERIALS)}.")
        for title, kind in classes:
            parts += [f"### {title}"] if title else []
            if kind is not sections.Sections:
                parts.append(summary(kind))
            if table := rows(kind):
                parts.append("\n".join((*HEADING, *table)))
            if shown := example(kind):
                parts.append(f"```toml\n{shown}\n```")
    return "\n\n".join(parts) + "\n"


def main() -> int:
    """Write the page, or with ``--check`` say whether it is up to date; return the exit code."""
    if "--check" not in sys.argv:
        PAGE.write_text(page(), encoding="utf-8")
    elif PAGE.read_text(encoding="utf-8") != page():
        sys.stderr.write(f"{PAGE} is not up to date; run python .site/keys.py\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
