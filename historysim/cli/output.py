"""Printed answers and written files of the commands."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics import targets
from historysim.basics.files import replacing
from historysim.basics.targets import Output, OutputFormat, csv_table, netcdf
from historysim.basics.wording import columns, printable
from historysim.cli.options import has_flag
from historysim.errors import HistorySimError, InputError

if TYPE_CHECKING:
    import xarray as xr

    from historysim.results.plots.figure_output import PrintedFigure

    Lines = Sequence[tuple[str, str]]
    Outputs = Sequence[tuple[Path, Callable[[], object]]]

TABLES_OF_LOOPS = (
    netcdf("a table of friction loops", "friction loops"),
    csv_table("a table of friction loops", "loop,start_time"),
)
TABLES_OF_LEVELS = (
    netcdf("a table of loads", "statistics of friction loops"),
    csv_table("a table of loads", "level,loops"),
)
TABLES_OF_FRETTING = (
    netcdf("a fretting report", "fretting report"),
    csv_table("a fretting report", "loop,regime", "run,regime"),
)
TABLES_OF_SLIDING = (
    netcdf("a table of friction", "friction over time or distance"),
    csv_table("a table of friction", "distance,coefficient", "time,coefficient"),
)


def check_outputs(
    reads: Iterable[Path], *outputs: tuple[Path | None, *tuple[OutputFormat, ...]]
) -> list[Path]:
    """Return the requested output files; InputError if one must not be written.

    Each output is a path, or None if it is not requested, with its formats; no output is a file
    that the command reads.
    """
    requested = [Output(path, tuple(forms)) for path, *forms in outputs if path is not None]
    targets.check_outputs(requested, reads, force=has_flag("force"))
    return [output.path for output in requested]


def split_outputs(outputs: Sequence[Path], default: Path) -> tuple[Path, list[Path]]:
    """Return the one output that is not a picture, or else a default, and the pictures."""
    pictures = [path for path in outputs if path.suffix.lower() in targets.PICTURE.endings]
    others = [path for path in outputs if path not in pictures]
    if len(others) > 1:
        endings = ", ".join(targets.PICTURE.endings)
        raise InputError(
            f"-o {others[1]}: no picture by its ending; expected one of {endings} besides the result"
        )
    return (others[0] if others else default), pictures


def write_answer(
    lines: "Lines" = (),
    tables: Sequence[Sequence[tuple[str, ...]]] = (),
    files: Iterable[Path | None] = (),
    *,
    data: "Callable[[], xr.Dataset] | None" = None,
    below: "Lines" = (),
    outputs: "Outputs" = (),
    width: int = 0,
) -> None:
    """Print the results of a command, with --json as one object, with --quiet nothing; then write its outputs.

    The first row of each table has its headings; ``files`` were written, ``data`` returns all
    numbers as a Dataset with units, and the lines ``below`` follow the tables. Each of the
    ``outputs``, a path and a function that writes it, is written whether the others can be or not;
    the first error is raised at the end. Tables are laid out for lines of ``width`` characters if
    given.
    """
    written = [str(path) for path in files if path is not None]
    _print_answer(lines, tables, written, data, below, outputs, width)
    write_outputs(outputs, named=not has_flag("json"))


def write_outputs(outputs: "Outputs", *, named: bool = False) -> None:
    """Write outputs, each whether the others can be or not, and print their names; raise the first error at the end."""
    errors: list[OSError | HistorySimError] = []
    for path, write in outputs:
        try:
            write()
        except (OSError, HistorySimError) as error:
            errors.append(error)
        else:
            if named and not has_flag("quiet"):
                click.echo(path)
    for problem in errors[1:]:
        notice(str(problem))
    if errors:
        raise errors[0]


def _print_answer(
    lines: "Lines",
    tables: Sequence[Sequence[tuple[str, ...]]],
    written: list[str],
    data: "Callable[[], xr.Dataset] | None",
    below: "Lines",
    outputs: "Outputs",
    width: int,
) -> None:
    if has_flag("quiet"):
        return
    if has_flag("json"):
        written = [*written, *(str(path) for path, _ in outputs)]
        document: dict[str, Any] = {
            "lines": [_line(label, text) for label, text in (*lines, *below) if label],
            "tables": [{"columns": rows[0], "rows": rows[1:]} for rows in tables if rows],
            "files": written,
            **({"data": data().to_dict()} if data else {}),
        }
        click.echo(_json(document))
        return
    for text in (
        columns(lines),
        *(columns(table, width) for table in tables),
        columns(below),
        *written,
    ):
        if text:
            click.echo(text)


def _line(label: str, text: str) -> dict[str, Any]:
    quantity = {name: getattr(text, name) for name in ("value", "unit") if hasattr(text, name)}
    return {"label": label, "text": str(text), **quantity}


def _json(document: dict[str, Any]) -> str:
    """Format a document as JSON, with null for NaN and infinite numbers."""
    text = json.dumps(
        document, default=lambda value: value.tolist() if hasattr(value, "tolist") else str(value)
    )
    return json.dumps(json.loads(text, parse_constant=lambda _: None), ensure_ascii=False, indent=1)


def notice(text: str) -> None:
    """Print a note for the user on standard error."""
    click.echo(f"Note: {printable(text)}", err=True)


def save_table(
    dataset: "xr.Dataset",
    path: Path,
    picture: "Callable[[xr.Dataset], PrintedFigure] | None" = None,
    *,
    measured: bool = False,
) -> None:
    """Write a table in the format of its suffix: netCDF, CSV, or a picture of it."""
    from historysim.results.tables import CALCULATED, MEASURED, write_csv, write_netcdf

    if path.suffix.lower() == ".csv":
        write_csv(dataset, path)
    elif path.suffix.lower() == ".nc" or picture is None:
        write_netcdf(dataset, path, origin=MEASURED if measured else CALCULATED)
    else:
        save(picture(dataset), path)


def save(figure: "PrintedFigure", picture: Path) -> None:
    """Write a figure to a file in the format of its suffix; print its notices on standard error."""
    with replacing(picture) as unfinished:
        figure.savefig(unfinished, format=picture.suffix.removeprefix(".").lower())
    for text in figure.notices:
        notice(f"{picture}: {text}")
