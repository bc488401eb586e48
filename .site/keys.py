"""``scenarios/keys.md``: every section and key of a scenario, from the classes that read them.

The classes say what a key is: its type and unit, its default, below it what it means; docstrings show how it looks.
``python .site/keys.py`` writes the page; a test asks whether it is up to date.
"""

import inspect
import re
import sys
import textwrap
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

import attrs
from numpydoc.docscrape import NumpyDocString

from historysim.asperities.instrument import Instrument, Rings
from historysim.asperities.laws import LAWS
from historysim.asperities.wear import WEAR_LAWS
from historysim.asperities.yielding import YIELDING_LAWS
from historysim.basics.fields import OneOf, Quantity, markdown
from historysim.basics.registry import Registry
from historysim.contact.materials import MATERIALS, Material
from historysim.loads.events import EVENTS, Event
from historysim.loads.friction_course import FrictionCourse
from historysim.results.plots.pictures import PICTURES, Panel, Picture
from historysim.scenario import sections
from historysim.scenario.loading_kinds import LOADINGS, measured, written
from historysim.scenario.picture_section import IN_SCENARIOS
from historysim.scenario.schema import KindOf
from historysim.scenario.surface_kinds import SURFACES, ChangedSurface, Passes, SurfaceKind
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

Kinds = tuple[type | Registry[Any], ...]
LAW_REGISTRIES: Kinds = (LAWS, WEAR_LAWS, YIELDING_LAWS)

SECTIONS: dict[str, tuple[str, Kinds]] = {
    "`title`": ("", (sections.Sections,)),
    "`[materials]`": ("", (sections.MaterialsSection, Material)),
    "`[surface]`": (
        "`kind` says which surface it is. [Surfaces](../historysim/surfaces/README.md) tells what they are for.",
        (SURFACES, ChangedSurface),
    ),
    "`yielding`": (
        "Of any `[surface]` with summits, how they yield: the name of a law, or a table of `law` with its keys.",
        (YIELDING_LAWS,),
    ),
    "`[friction]`": (
        "A coefficient, or `law` with the keys of the law.",
        (sections.Coefficients, sections.CourseFile, LAWS),
    ),
    "`[loading]`": ("Exactly one of `waypoints`, `blocks`, `file`.", (LOADINGS,)),
    "`[wear]`": ("What sliding takes from the asperities: `law` with the keys of the law.", (WEAR_LAWS,)),
    "`[instrument]`": ("", (Instrument,)),
    "`[rings]`": ("", (Rings,)),
    "`[adhesion]`": ("", (sections.AdhesionSection,)),
    "`[record]`": ("", (sections.RecordSection,)),
    "`[fit]`": ("", (sections.FitSection,)),
    "`[sweep]`": ("", (sections.SweepSection,)),
    "`[design]`": ("", (sections.DesignSection,)),
    "`[picture]`": (
        "`kind` says which picture it is. One that can stand beside others may be one of several `[[picture]]`.",
        (Panel, PICTURES),
    ),
    "`[metadata]`": (
        "By the names of ACDD 1.3. They become attributes of the result.",
        (sections.MetadataSection,),
    ),
    "Files of numbers": (FILES, (Format, Column)),
}
"""The headings of the page; of each, what stands above its tables, and the classes, or all kinds of a registry."""

TITLES: dict[type, str] = {
    Material: "Your own material",
    sections.Coefficients: "Coefficients",
    FrictionCourse: "`course`, written out",
    sections.CourseFile: "`course`, from a file",
    written.Waypoint: "A waypoint",
    written.WaypointBlock: "A block",
    measured.ForceChannel: "A channel that is a load",
    measured.LengthChannel: "A channel that is a displacement",
    Panel: "Of all pictures that can stand beside others",
    Column: "A column",
    ChangedSurface: "Of any surface",
    Passes: "`passes` of any height map",
}
"""Headings of classes whose keys' names do not say what they are."""

EXAMPLES: dict[type, str] = {
    Material: 'second = { name = "my glass", youngs_modulus = "64 GPa", poissons_ratio = 0.2 }',
    Rings: "[rings]\nheight_classes = 1\nrings = 20",
    Instrument: '[instrument]\nlateral_stiffness = "334 mN/µm"\ndisplacement_resolution = "1 nm"',
}
"""Of classes whose docstrings show them in Python."""

SHARED = (Panel, Format)
"""Classes whose keys stand in a table of their own, and not with each class that has them."""

HEADING = ("| key | type or unit | default | meaning |", "| --- | --- | --- | --- |")


def meanings(kind: type) -> dict[str, str]:
    """Return what each key of a class means, as docstrings of the class and those that it derives from say."""
    found: dict[str, str] = {}
    # a height map has the keys of the steps that prepare it, too
    for each in (*getattr(kind, "preparations", ()), *reversed(kind.__mro__)):
        parsed = NumpyDocString(inspect.cleandoc(each.__dict__.get("__doc__") or ""))
        for part in ("Parameters", "Attributes"):
            for entry in parsed[part]:
                found |= dict.fromkeys(entry.name.split(", "), " ".join(entry.desc))
        found |= beside_fields(each)
    return found


def beside_fields(kind: type) -> dict[str, str]:
    """Return the comments ``#: …`` beside, or above, fields in the source of a class, by the names of the fields."""
    if not attrs.has(kind) or kind.__module__.partition(".")[0] != "historysim":
        return {}
    found: dict[str, str] = {}
    above: list[str] = []
    # a height map with the steps of other packages has no source of its own
    for line in textwrap.dedent(inspect.getsource(kind)).splitlines():
        code, mark, text = line.partition("#: ")
        field = re.match(r"    (\w+): ", code)
        if field and (mark or above):
            words = " ".join([*above, text]).strip()
            found[field[1]] = capitalised(words.removesuffix(".")) + "."
        above = [*above, text] if mark and not code.strip() else []
    return found


def capitalised(text: str) -> str:
    """Return a sentence with a capital first letter; symbols such as ``ν [1]`` and ``c/a`` are unchanged."""
    return re.sub(r"^[a-z]+(?=[\s,:;]|$)(?! \[)", lambda word: word[0].capitalize(), text)


def example(kind: type) -> str:
    """Return the lines of TOML that the docstring of a class shows."""
    lines = NumpyDocString(inspect.cleandoc(kind.__doc__ or ""))["Examples"]
    return EXAMPLES.get(kind) or "\n".join(lines).strip()


def type_text(kind: Any) -> str:
    """Say the type of a key in words: ``"m"`` of a length, ``"m, one or several"``, ``"true or false"``."""
    if get_origin(kind) is Annotated:
        return _marked(*get_args(kind))
    if get_origin(kind) in {Union, UnionType}:
        return " or ".join(dict.fromkeys(type_text(each) for each in get_args(kind) if each is not NoneType))
    if get_origin(kind) is tuple:
        return f"array of {_plural(type_text(get_args(kind)[0]))}"
    if get_origin(kind) is dict or attrs.has(kind):
        return "column" if kind is Column else "table"
    return {str: "text", int: "whole number", float: "number", bool: "true or false"}.get(kind, "any value")


def _marked(plain: Any, mark: object) -> str:
    if not isinstance(mark, Quantity):
        return "table" if isinstance(mark, KindOf) and not mark.alone else "text or table"
    unit = "number" if mark.unit == "1" else _unit(mark.unit)
    if mark.components:
        return f"{unit}, one, two, or `{{ {', '.join(f'{name} = …' for name in mark.components)} }}`"
    if get_origin(plain) is tuple and not mark.alone:
        return f"array, {unit}"
    return f"{unit}, one or several" if mark.alone or isinstance(plain, UnionType) else unit


def limited(field: "attrs.Attribute[Any]") -> str:
    """Say the type of a key with its limits, as its validator has them: ``"N, > 0"``."""
    words = type_text(field.type)
    limits = getattr(field.validator, "validator", field.validator)
    if isinstance(limits, OneOf):
        return " or ".join(f'`"{word}"`' for word in limits.words)
    told = getattr(limits, "text", "")
    return f"{words}, {told}" if told else words


def _unit(text: str) -> str:
    if text == "Pa m0.5":
        return "Pa √m"
    powers = {"-1": "⁻¹", "-2": "⁻²", "2": "²", "3": "³"}
    words = []
    for word in text.split():
        letters = word.rstrip("-0123456789")
        words.append(letters + powers.get(word[len(letters) :], ""))
    return " ".join(words)


def _plural(text: str) -> str:
    if text in {"text or whole number", "whole number or text"}:
        return "texts or whole numbers"
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
    attrs.resolve_types(kind, localns={"Picture": Picture})
    above = [other for other in SHARED if issubclass(kind, other) and kind is not other]
    elsewhere = {field.name for other in above for field in attrs.fields(other)}
    if kind is sections.Sections:
        elsewhere = {field.name for field in attrs.fields(kind)} - {"title"}
    elsewhere |= {"changes", "values", "preparations", "of"} & {field.name for field in attrs.fields(kind)}
    if issubclass(kind, Event):
        elsewhere = {"time"}
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
        found.append(f"| {name} | {limited(field)} | {_default(field)} | {meaning} |")
    if kind is written.Waypoint:
        for name, event in EVENTS.own().items():
            of = attrs.fields(event)[1].type if len(_alone(event)) else event
            found.append(f"| `{name}` | {type_text(of)} | | {summary(event)} |")
    return found


def _alone(event: type) -> list[str]:
    """Return what an event needs beside its time: where it is one thing, its value stands alone."""
    return [field.name for field in attrs.fields(event)[1:] if field.default is attrs.NOTHING]


def summary(kind: type) -> str:
    """Return the first paragraph of the docstring of a class."""
    return " ".join(inspect.cleandoc(kind.__doc__ or "").split("\n\n")[0].split()).replace("``", "`")


def title_of(kind: type, registry: "Registry[Any]") -> str:
    """Return the heading of a kind: what the section says to get it."""
    if registry is LOADINGS:
        return f"`{kind.kind}`"  # type: ignore[attr-defined]
    key = "law" if registry in LAW_REGISTRIES else "kind"
    return f'`{key} = "{kind.kind}"`'  # type: ignore[attr-defined]


def variants(kind: type) -> "Iterator[tuple[str, type]]":
    """Yield the other classes of a kind of surface, that it chooses by the keys, with the keys that choose them."""
    registered = {field.name for field in attrs.fields(kind)}
    # what slots have replaced may still be there
    for other in filter(attrs.has, _below(SurfaceKind)):
        own = [field.name for field in keys(other) if field.name not in registered]
        if inspect.isabstract(other) or not own:
            continue
        if other is not kind and kind.chosen(dict.fromkeys(own)) is other:  # type: ignore[attr-defined]
            needed = [field.name for field in keys(other) if field.name in own and field.default is attrs.NOTHING]
            yield needed[0], other


def _below(kind: type) -> "Iterator[type]":
    # attrs leaves the class behind from which it has made the one with slots, until its memory is freed
    for each in filter(attrs.has, kind.__subclasses__()):
        yield each
        yield from _below(each)


def own_kinds(registry: "Registry[Any]") -> dict[str, type]:
    """Return the kinds of a registry that come with the package."""
    kinds = {name: kind for name, kind in registry.items() if registry.provider(kind) is None}
    # pictures of Python objects are in no scenario
    return {name: kind for name, kind in kinds.items() if not issubclass(kind, Picture) or IN_SCENARIOS & {*kind.of}}


def titled(kinds: Kinds) -> "Iterator[tuple[str, type]]":
    """Yield the classes of a section with their headings, each followed by the tables that stand in it."""
    for kind in kinds:
        if not isinstance(kind, Registry):
            yield from with_tables(TITLES.get(kind, ""), kind)
            continue
        for each in own_kinds(kind).values():
            title = title_of(each, kind)
            yield from with_tables(title, each)
            if kind is SURFACES:
                for key, other in variants(each):
                    yield from with_tables(f"{title} with `{key}`", other)


def with_tables(title: str, kind: type) -> "Iterator[tuple[str, type]]":
    """Yield a class with its heading, and the classes of the tables that are values of its keys."""
    yield title, kind
    if kind is sections.Sections:
        return
    of = f" of {title[0].lower()}{title[1:]}" if title else ""
    if kind is written.Waypoint:
        tables = [(name, event) for name, event in EVENTS.own().items() if not _alone(event)]
        for name, event in tables:
            yield from with_tables(f"`{name}`{of}", event)
    for field in keys(kind):
        for table in tables_in(field.type):
            yield from with_tables(TITLES.get(table, f"`{field.name}`{of}"), table)


def tables_in(kind: Any) -> "Iterator[type]":
    """Yield the classes of tables in the type of a key; columns and laws have a section of their own."""
    apart = {Column, *SHARED}
    if isinstance(kind, type) and attrs.has(kind) and kind not in apart:
        if not inspect.isabstract(kind):
            yield kind
        return
    for each in get_args(kind):
        yield from tables_in(each)


def page() -> str:
    """Return the page."""
    parts = [INTRODUCTION.rstrip()]
    done: set[type] = set()
    for heading, (text, kinds) in SECTIONS.items():
        parts += [f"## {heading}"] + ([text] if text else [])
        if heading == "`[materials]`":
            parts.append(f"Built in: {', '.join(f'`{chr(34)}{name}{chr(34)}`' for name in MATERIALS)}.")
        parts += [markdown(own_kinds(each), "`law`") for each in LAW_REGISTRIES if each in kinds]
        for title, kind in titled(kinds):
            if kind in done:
                continue
            done.add(kind)
            parts += [f"### {title}"] if title else []
            if kind is not sections.Sections:
                parts.append(summary(kind))
            if issubclass(kind, Picture) and kind is not Panel and kind.own_figure:
                parts.append("It fills a figure of its own.")
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
