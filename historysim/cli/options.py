"""Arguments and options of the commands: files, quantities with units, common options, arguments of functions.

`from_function` builds options from the signature and the docstring of the function that a command
calls.
"""

import ast
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

    Decorator = Callable[[Any], Any]

# KEY=VALUE; quoted parts of the key may contain any character.
_SETTING = re.compile(r"""((?:[^="']|"(?:[^"\\]|\\.)*"|'[^']*')*)=(.*)""", re.DOTALL)
# Entry of a numpydoc section "Parameters": names, type, description.
_ENTRY = re.compile(r"^([a-z][\w, ]*) : (.+)\n((?: {4}.*\n)+)", re.MULTILINE)
_EXAMPLES = {"s": "12.5 s", "m": "5 nm", "N": "50 mN"}  # quantities by SI unit


class PathType(click.Path):
    """Name of a file in the encoding of the system, which the libraries for SQLite and netCDF require."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        path, encoding = super().convert(value, param, ctx), sys.getfilesystemencoding()
        try:
            str(path).encode(encoding)
        except UnicodeEncodeError:
            self.fail(
                f"{str(path)!r} is not a name in {encoding}, the encoding of file names; rename it",
                param,
                ctx,
            )
        return path


def _read_size(
    _ctx: click.Context, _param: click.Parameter, text: str | None
) -> tuple[float, float] | None:
    """Parse width and height of a picture [mm]."""
    try:
        width, height = map(float, text.lower().split("x")) if text else (0.0, 0.0)
    except ValueError as error:
        raise InputError(
            f"--size {text}: expected width and height in millimetres, as 90x70"
        ) from error
    return (width, height) if text else None


def _store_flag(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    ctx.meta[f"{__name__}.{param.name}"] = value


def has_flag(name: str) -> bool:
    """Return True if a common flag of the current command is set: quiet, json or force."""
    return bool(click.get_current_context().meta.get(f"{__name__}.{name}"))


def _common_flag(*names: str, help: str) -> "Decorator":  # noqa: A002 - click's word
    return click.option(*names, is_flag=True, expose_value=False, callback=_store_flag, help=help)


def flag(*names: str, help: str) -> "Decorator":  # noqa: A002 - click's word
    """Return an option without a value."""
    return click.option(*names, is_flag=True, help=help)


def _read_settings(
    _ctx: click.Context, _param: click.Parameter, settings: tuple[str, ...]
) -> dict[str, Any]:
    return dict(map(_read_setting, settings))


def _read_setting(text: str) -> tuple[str, Any]:
    """Parse KEY=VALUE, with a value of TOML, or else a string without quotation marks."""
    import tomllib

    match = _SETTING.fullmatch(text)
    key, value = (group.strip() for group in match.groups()) if match else ("", "")
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


def path_option(*names: str, help: str, **options: Any) -> "Decorator":  # noqa: A002 - click's word
    """Return an option for the path of a file."""
    return click.option(*names, type=path_type, help=help, **options)


def output_option(help: str, **options: Any) -> "Decorator":  # noqa: A002 - click's word
    """Return the option ``-o``."""
    return path_option("-o", "--output", help=help, **options)


def outputs_option(help: str, default: str = "") -> "Decorator":  # noqa: A002 - click's word
    """Return the option ``-o`` for a file and pictures of it, passed as ``outputs``."""
    return path_option(
        "-o",
        "--output",
        "outputs",
        multiple=True,
        help=f"{help} A picture if it ends with .png, .pdf or .svg; may be given several times."
        + (f" [default: {default}]" if default else ""),
    )


def quantity_option(name: str, unit: str, help: str, **options: Any) -> "Decorator":  # noqa: A002 - click's word
    """Return an option for a number in SI, or a number with a unit."""

    def read(_ctx: click.Context, _param: click.Parameter, value: Any) -> float | None:
        from historysim.basics.units import quantity

        with contextlib.suppress(ValueError):
            return None if value is None else float(value)
        try:
            return quantity(value, unit)
        except InputError as error:
            raise InputError(f"{name}: {error}") from error

    return click.option(name, type=str, callback=read, metavar="QUANTITY", help=help, **options)


def from_function(function: str, *names: str, **settings: dict[str, Any]) -> "Decorator":
    """Return a decorator that adds arguments of a function of this package, as ``"scenario.run:run"``, as options.

    Type, default and help come from its signature and its docstring (the first sentence).
    ``settings`` by name replace those of click, or add ``short`` names. The function is read from
    its source, because its import takes as long as a small run.
    """
    module, _, name = function.partition(":")
    path = Path(__file__).parents[1].joinpath(*module.split("."))
    source = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(
        encoding="utf-8"
    )
    # up to the end of its docstring: a whole module takes long to parse
    head: Any = re.search(rf'^def {name}\(.*?""".*?"""', source, re.MULTILINE | re.DOTALL)
    definition: Any = ast.parse(head[0]).body[0]
    defaults = zip(definition.args.kwonlyargs, definition.args.kw_defaults, strict=True)
    values = {
        argument.arg: value.value for argument, value in defaults if isinstance(value, ast.Constant)
    }
    docstring = f"{ast.get_docstring(definition)}\n"
    entries = {
        argument: (type_text, " ".join(text.split()))
        for argument_names, type_text, text in _ENTRY.findall(docstring)
        for argument in argument_names.split(", ")
    }

    def add(command: Any) -> Any:
        for name in reversed(names):
            command = _option(name, *entries[name], values.get(name), settings.get(name, {}))(
                command
            )
        return command

    return add


def _option(
    name: str, type_text: str, text: str, default: object, settings: dict[str, Any]
) -> "Decorator":
    """Return the option of an argument, from the type and the description in a docstring."""
    description = re.split(r"\.(?: |$)|; by default ", text.replace("``", ""), maxsplit=1)[0]
    default_text = re.search(r"[;.] [Bb]y default ([^.;]*)", text)
    unit = re.search(r" \[(\w+)\]", description)
    words = re.findall(r'"(\w+)"', type_text)
    numbers = [int(digits) for digits in re.findall(r"\d+", type_text)]
    options: dict[str, Any] = {"help": f"{description[:1].upper()}{description[1:]}."}
    if default is not None and default is not False:
        options |= {"default": default, "show_default": True}
    elif default_text:
        options["help"] += f" [default: {default_text[1]}]"
    flags = (*settings.pop("short", ()), f"--{name.replace('_', '-')}")
    if type_text.startswith("bool"):
        return click.option(*flags, **options, is_flag=True, **settings)
    if unit and type_text == "float, optional":
        options["help"] = options["help"].replace(unit[0], f', as "{_EXAMPLES[unit[1]]}"', 1)
        return quantity_option(flags[-1], unit[1], **options | settings)
    if words or numbers:
        options["type"] = (
            click.Choice(words) if words else click.IntRange(min(numbers), max(numbers))
        )
    else:
        options["type"] = str if "str" in type_text else int
    return click.option(*flags, **options | settings)


# Arguments and options of several commands, by the names that `common` accepts.
COMMON = {
    "scenario": click.argument("scenario", type=path_type),
    "file": click.argument("file", type=path_type),
    "log": click.argument("log", type=path_type),
    "size": click.option(
        "--size",
        callback=_read_size,
        metavar="WIDTHxHEIGHT",
        help="Size of the picture in millimetres, as 90x70; panels that do not fit are left out, and named.",
    ),
    "workers": click.option(
        "--workers",
        type=click.IntRange(1),
        default=lambda: system.processors(),  # noqa: PLW0108 - evaluated on use
        show_default="one for each processor",
        help="Processes that compute.",
    ),
    "quiet": _common_flag("-q", "--quiet", help="Print nothing."),
    "json": _common_flag("--json", help="Print one object of JSON, with numbers in SI."),
    "force": _common_flag(
        "--force",
        help="Also replace files that are not earlier outputs of this kind; never a file that is read.",
    ),
    "set": click.option(
        "--set",
        "values",
        multiple=True,
        callback=_read_settings,
        metavar="KEY=VALUE",
        help="Override a scenario key, such as friction.coefficient=0.3; may be given several times.",
    ),
    "sheet": click.option(
        "--sheet", help="Sheet of an Excel file, by name or number. [default: the only one]"
    ),
    "encoding": click.option("--encoding", help="Encoding of a text file. [default: detected]"),
    "header": click.option(
        "--header", type=int, help="Line of a text file with the column names. [default: detected]"
    ),
    "decimal": click.option(
        "--decimal", default=".", show_default=True, help="Decimal sign of a text file."
    ),
    "delimiter": click.option(
        "--delimiter", help="Separator of values in a text file. [default: detected]"
    ),
}
TEXT_FORMAT = "delimiter", "decimal", "header", "encoding", "sheet"


def common(*names: str) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that adds arguments and options of `COMMON`."""

    def add(command: Callable[..., Any]) -> Any:
        for name in reversed(names):
            command = COMMON[name](command)
        return command

    return add


def _read_choices(
    _ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]
) -> dict[str, str]:
    choices = {}
    for text in texts:
        name, _, value = (word.strip() for word in text.partition("="))
        if not (name and value):
            raise InputError(f"--with {text!r}: expected {param.metavar}")
        choices[name] = value
    return choices


def with_option(metavar: str, help: str) -> "Decorator":  # noqa: A002 - click's word
    """Return the option ``--with`` for further options by name, passed as ``choices``."""
    return click.option(
        "--with", "choices", multiple=True, callback=_read_choices, metavar=metavar, help=help
    )


def text_format(sheet: str | None, **text: Any) -> "Format":
    """Return the format of a text file from the options `TEXT_FORMAT`."""
    from historysim.tables import Format

    try:
        return Format(**text, sheet=int(sheet) if sheet and sheet.isdigit() else sheet)
    except InputError as error:
        raise InputError(f"--{error}") from error


def check_size(size: object, outputs: Iterable[Path | None]) -> None:
    """Raise InputError if a size is given but no picture is written."""
    if size is not None and not any(
        path is not None and path.suffix.lower() not in {".nc", ".csv"} for path in outputs
    ):
        raise InputError(
            "--size: no picture is written; expected the file of a picture, as -o loops.pdf"
        )


def list_inputs(source: "Scenario | Path") -> tuple[Path, ...]:
    """Return the files that a command reads for a scenario or another file."""
    if isinstance(source, Path) and source.suffix == ".toml":
        from historysim.scenario.scenario import load

        source = load(source)
    return (source,) if isinstance(source, Path) else source.files


def load_if_changed(file: Path, values: dict[str, Any]) -> "Scenario | Path":
    """Return a scenario with replaced values, or the file itself if there are none."""
    if not values:
        return file
    if file.suffix != ".toml":
        raise InputError(
            f"{file}: is not a scenario (.toml), so --set does not apply; leave it out"
        )
    from historysim.scenario.scenario import load

    return load(file, values)
