"""What the commands take: files, quantities with units, and the options that several of them share."""

import contextlib
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics import system
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.scenario.scenario import Scenario
    from historysim.tables import Format

# A key, in which what stands in quotes may hold any character, and a value.
_SETTING = re.compile(r"""((?:[^="']|"(?:[^"\\]|\\.)*"|'[^']*')*)=(.*)""", re.DOTALL)


class PathType(click.Path):
    """The name of a file, in the encoding of the system: the libraries for SQLite and netCDF take no other."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        path, encoding = super().convert(value, param, ctx), sys.getfilesystemencoding()
        try:
            str(path).encode(encoding)
        except UnicodeEncodeError:
            self.fail(f"{str(path)!r} is no name in {encoding}, the encoding of file names here; rename it", param, ctx)
        return path


def _size(_ctx: click.Context, _param: click.Parameter, text: str | None) -> tuple[float, float] | None:
    """Return width and height of a picture [mm]."""
    try:
        width, height = map(float, text.lower().split("x")) if text else (0.0, 0.0)
    except ValueError as error:
        raise InputError(f"--size {text}: expected width and height in millimetres, as 90x70") from error
    return (width, height) if text else None


def _keep(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    ctx.meta[f"{__name__}.{param.name}"] = value


def given(flag: str) -> bool:
    """Return whether one of the flags that commands share is given: quiet, json, force."""
    return bool(click.get_current_context().meta.get(f"{__name__}.{flag}"))


def _flag(*names: str, help: str) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    return click.option(*names, is_flag=True, expose_value=False, callback=_keep, help=help)


def _values(_ctx: click.Context, _param: click.Parameter, settings: tuple[str, ...]) -> dict[str, Any]:
    return dict(map(_setting, settings))


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


path_type = PathType(path_type=Path)

# What several commands take, by the names with which `shared` adds it.
SHARED = {
    "scenario": click.argument("scenario", type=path_type),
    "file": click.argument("file", type=path_type),
    "log": click.argument("log", type=path_type),
    "size": click.option(
        "--size",
        callback=_size,
        metavar="WIDTHxHEIGHT",
        help="Of the picture, in millimetres, as 90x70; panels for which there is no room are left out, and named.",
    ),
    "workers": click.option(
        "--workers",
        type=click.IntRange(1),
        default=lambda: system.processors(),  # noqa: PLW0108 - looked up when it is needed
        show_default="one for each processor",
        help="Processes that compute.",
    ),
    "quiet": _flag("-q", "--quiet", help="Print nothing."),
    "json": _flag("--json", help="Print one object of JSON, with numbers in SI."),
    "force": _flag(
        "--force", help="Also replace files that are not earlier outputs of this kind; never a file that is read."
    ),
    "set": click.option(
        "--set",
        "values",
        multiple=True,
        callback=_values,
        metavar="KEY=VALUE",
        help="Override a scenario key, such as friction.coefficient=0.3; may be given several times.",
    ),
    "sheet": click.option("--sheet", help="The sheet of an Excel file, by name or number. [default: the only one]"),
    "encoding": click.option("--encoding", help="The encoding of a text file.  [default: found]"),
    "header": click.option(
        "--header", type=int, help="The line of a text file with the column names. [default: found]"
    ),
    "decimal": click.option("--decimal", default=".", show_default=True, help="The decimal sign of a text file."),
    "delimiter": click.option("--delimiter", help="The sign between two values of a text file. [default: found]"),
}
TEXT = "delimiter", "decimal", "header", "encoding", "sheet"  # how a text file is written


def shared(*names: str) -> Callable[[Callable[..., Any]], Any]:
    """Give a command arguments and options of `SHARED`."""

    def add(command: Callable[..., Any]) -> Any:
        for name in reversed(names):
            command = SHARED[name](command)
        return command

    return add


def path_option(*names: str, help: str, **options: Any) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return an option that names a file."""
    return click.option(*names, type=path_type, help=help, **options)


def output_option(help: str, **options: Any) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return the option ``-o``."""
    return path_option("-o", "--output", help=help, **options)


def quantity_option(name: str, unit: str, help: str, **options: Any) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return an option that takes a number in SI, or one with a unit."""

    def read(_ctx: click.Context, _param: click.Parameter, value: Any) -> float | None:
        from historysim.basics.units import quantity

        with contextlib.suppress(ValueError):
            return None if value is None else float(value)
        try:
            return quantity(value, unit)
        except InputError as error:
            raise InputError(f"{name}: {error}") from error

    return click.option(name, type=str, callback=read, metavar="QUANTITY", help=help, **options)


def _pairs(_ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if not (name and value):
            raise InputError(f"--with {text!r}: expected {param.metavar}")
        found[name] = value
    return found


def with_option(metavar: str, help: str) -> Callable[[Any], Any]:  # noqa: A002 - click's word
    """Return the option ``--with``, which gives others by their names, as ``choices``."""
    return click.option("--with", "choices", multiple=True, callback=_pairs, metavar=metavar, help=help)


def layout_of(sheet: str | None, **text: Any) -> "Format":
    """Return how a text file is written, from the options `TEXT`."""
    from historysim.tables import Format

    try:
        return Format(**text, sheet=int(sheet) if sheet and sheet.isdigit() else sheet)
    except InputError as error:
        raise InputError(f"--{error}") from error


def check_drawn(size: object, drawn: Iterable[Path | None]) -> None:
    """Check that something is drawn where a size is given for it."""
    if size is not None and not any(path is not None and path.suffix.lower() not in {".nc", ".csv"} for path in drawn):
        raise InputError("--size: nothing is drawn; expected the file of a picture, as -o loops.pdf")


def files_read(what: "Scenario | Path") -> tuple[Path, ...]:
    """Return the files that a command reads for a scenario, or another file."""
    if isinstance(what, Path) and what.suffix == ".toml":
        from historysim.scenario.scenario import load

        what = load(what)
    return (what,) if isinstance(what, Path) else what.files


def scenario_or_file(file: Path, values: dict[str, Any]) -> "Scenario | Path":
    """Return the scenario of a file with other values, or the file itself where there are none."""
    if not values:
        return file
    if file.suffix != ".toml":
        raise InputError(f"{file}: is not a scenario (.toml), so --set does not apply; leave it out")
    from historysim.scenario.scenario import load

    return load(file, values)
