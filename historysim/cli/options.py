"""What the commands take: files, how texts are written, and quantities with units."""

import functools
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.errors import InputError

if TYPE_CHECKING:
    import os

    from historysim.scenario.scenario import Scenario

_SETTING = re.compile(r"""((?:[^="']|"(?:[^"\\]|\\.)*"|'[^']*')*)=(.*)""", re.DOTALL)
"""A key, in which what stands in quotes may hold any character, and a value."""


class PathType(click.Path):
    """The name of a file, in the encoding of the system: the libraries for SQLite and netCDF take no other."""

    def convert(
        self, value: "str | os.PathLike[str]", param: click.Parameter | None, ctx: click.Context | None
    ) -> "str | bytes | os.PathLike[str]":
        """Return the path."""
        path = super().convert(value, param, ctx)
        try:
            str(path).encode(sys.getfilesystemencoding())
        except UnicodeEncodeError:
            self.fail(
                f"{str(path)!r} is no name in {sys.getfilesystemencoding()}, the encoding of file names here; rename "
                "it, or choose another locale, such as LC_ALL=C.UTF-8",
                param,
                ctx,
            )
        return path


path_type = PathType(path_type=Path)


force_option = click.option(
    "--force",
    is_flag=True,
    help="Also replace files that are not earlier outputs of this kind; never a file that is read.",
)


json_option = click.option("--json", "as_json", is_flag=True, help="Print one object of JSON, with numbers in SI.")


def files_read(what: "Scenario | Path") -> tuple[Path, ...]:
    """Return the files that a command reads which is given a scenario, or another file."""
    if isinstance(what, Path) and what.suffix == ".toml":
        from historysim.scenario.scenario import load

        what = load(what)
    return (what,) if isinstance(what, Path) else what.files


def quantity_option(option: str, text: str, unit: str) -> float:
    """Return the value of an option in SI: a number, or a number with a unit."""
    from historysim.basics.units import quantity

    try:
        return float(text)
    except ValueError:
        pass
    try:
        return quantity(text, unit)
    except InputError as error:
        raise InputError(f"{option}: {error}") from error


def set_option(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the option that puts other values into a scenario; it takes them as ``values``, by key."""

    @functools.wraps(command)
    def with_values(*, settings: tuple[str, ...], **others: object) -> None:
        command(values=dict(map(_setting, settings)), **others)

    return click.option(
        "--set",
        "settings",
        multiple=True,
        metavar="KEY=VALUE",
        help="Override a scenario key, such as friction.coefficient=0.3; may be given several times.",
    )(with_values)


def _setting(text: str) -> tuple[str, Any]:
    """Return the key and the value of an option: a value of TOML, or else a text without its quotation marks."""
    import tomllib

    parts = _SETTING.fullmatch(text)
    key, value = (part.strip() for part in parts.groups()) if parts else ("", "")
    if not (key and value):
        raise InputError(
            f'--set {text!r}: expected KEY=VALUE, such as friction.coefficient=0.3 or "surface.radius=2 mm"'
        )
    try:
        table = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        return key, value
    return key, table["value"] if set(table) == {"value"} else value


def scenario_or_file(file: Path, values: dict[str, Any]) -> "Scenario | Path":
    """Return the scenario of a file with other values, or the file itself where there are none."""
    if not values:
        return file
    if file.suffix != ".toml":
        raise InputError(f"{file}: is no scenario (.toml), so that --set has nothing to change; leave it out")
    from historysim.scenario.scenario import load

    return load(file, values)


def text_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say how a text is written; it takes them as one ``layout``."""

    @functools.wraps(command)
    def with_layout(
        *, delimiter: str | None, decimal: str, header: int | None, encoding: str | None, **others: object
    ) -> None:
        from historysim.tables import Format

        try:
            layout = Format(delimiter=delimiter, decimal=decimal, header=header, encoding=encoding)
        except InputError as error:
            raise InputError(f"--{error}") from error
        command(layout=layout, **others)

    for option in (
        click.option("--encoding", help="The encoding of a text.  [default: found]"),
        click.option("--header", type=int, help="The line of a text that names the columns. [default: found]"),
        click.option("--decimal", default=".", show_default=True, help="The decimal sign of a text."),
        click.option("--delimiter", help="The sign between two values of a text. [default: found]"),
    ):
        with_layout = option(with_layout)
    return with_layout
