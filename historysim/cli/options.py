"""What the commands take: files, the format of text files, and quantities with units."""

import functools
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics import system
from historysim.errors import InputError

if TYPE_CHECKING:
    import os

    from historysim.scenario.scenario import Scenario

# A key, in which what stands in quotes may hold any character, and a value.
_SETTING = re.compile(r"""((?:[^="']|"(?:[^"\\]|\\.)*"|'[^']*')*)=(.*)""", re.DOTALL)


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


class QuantityType(click.ParamType):  # type: ignore[type-arg]
    """A number in SI, or a number with a unit."""

    name = "quantity"

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ARG002 - as click calls it
        """Return the number in SI."""
        from historysim.basics.units import quantity

        try:
            return float(value)
        except ValueError:
            pass
        try:
            return quantity(value, self.unit)
        except InputError as error:
            raise InputError(f"{param.opts[0] if param else ''}: {error}") from error


class SizeType(click.ParamType):  # type: ignore[type-arg]
    """Width and height of a picture in millimetres."""

    name = "size"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, float]:  # noqa: ARG002 - as click calls it
        """Return both [mm]."""
        try:
            width, height = map(float, str(value).lower().split("x"))
        except ValueError as error:
            raise InputError(f"--size {value}: expected width and height in millimetres, as 90x70") from error
        return width, height


path_type = PathType(path_type=Path)
scenario_argument = click.argument("scenario", type=path_type)
file_argument = click.argument("file", type=path_type)
log_argument = click.argument("log", type=path_type)

force_option = click.option(
    "--force",
    is_flag=True,
    help="Also replace files that are not earlier outputs of this kind; never a file that is read.",
)
size_option = click.option(
    "--size",
    type=SizeType(),
    metavar="WIDTHxHEIGHT",
    help="Of the picture, in millimetres, as 90x70; panels for which there is no room are left out, and named.",
)


def check_drawn(size: object, drawn: Iterable[Path | None]) -> None:
    """Check that something is drawn where a size is given for it."""
    if size is not None and not any(path is not None and path.suffix.lower() not in {".nc", ".csv"} for path in drawn):
        raise InputError("--size: nothing is drawn; expected the file of a picture, as -o loops.pdf")


json_option = click.option("--json", "as_json", is_flag=True, help="Print one object of JSON, with numbers in SI.")
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing.")
workers_option = click.option(
    "--workers",
    type=click.IntRange(1),
    default=lambda: system.processors(),  # noqa: PLW0108 - looked up when it is needed
    show_default="one for each processor",
    help="Processes that compute.",
)


def path_option(*names: str, help: str, **options: Any) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return an option that names a file."""
    return click.option(*names, type=path_type, help=help, **options)


def output_option(help: str, **options: Any) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return the option ``-o``."""
    return path_option("-o", "--output", help=help, **options)


def files_read(what: "Scenario | Path") -> tuple[Path, ...]:
    """Return the files that a command reads for a scenario, or another file."""
    if isinstance(what, Path) and what.suffix == ".toml":
        from historysim.scenario.scenario import load

        what = load(what)
    return (what,) if isinstance(what, Path) else what.files


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
    """Return the key and the value of an option: a value of TOML, or else a string without its quotation marks."""
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
    """Give a command the options for the format of a text file; it takes them as one ``layout``."""

    @functools.wraps(command)
    def with_layout(**others: Any) -> None:
        from historysim.tables import Format

        sheet = others.pop("sheet")
        try:
            given = {name: others.pop(name) for name in ("delimiter", "decimal", "header", "encoding")}
            layout = Format(**given, sheet=int(sheet) if sheet and sheet.isdigit() else sheet)
        except InputError as error:
            raise InputError(f"--{error}") from error
        command(layout=layout, **others)

    for option in (
        click.option("--sheet", help="The sheet of an Excel file, by name or number. [default: the only one]"),
        click.option("--encoding", help="The encoding of a text file.  [default: found]"),
        click.option("--header", type=int, help="The line of a text file with the column names. [default: found]"),
        click.option("--decimal", default=".", show_default=True, help="The decimal sign of a text file."),
        click.option("--delimiter", help="The sign between two values of a text file. [default: found]"),
    ):
        with_layout = option(with_layout)
    return with_layout
