"""What the commands share: what they print, and the files that they write."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from historysim.basics.files import replacing
from historysim.basics.targets import OutputFormat, csv_table, netcdf
from historysim.basics.wording import columns, printable, two_columns

if TYPE_CHECKING:
    import xarray as xr

    from historysim.results.plots.printed import PrintedFigure

TABLES_OF_LOOPS = (
    netcdf("a table of friction loops", "friction loops"),
    csv_table("a table of friction loops", "loop,start_time"),
)
TABLES_OF_LEVELS = (
    netcdf("a table of loads", "statistics of friction loops"),
    csv_table("a table of loads", "level,loops"),
)
TABLES_OF_SLIDING = (
    netcdf("a table of friction", "friction over time or distance"),
    csv_table("a table of friction", "distance,coefficient", "time,coefficient"),
)
TABLE_OF_SWEEP = netcdf("a sweep", "sweep")  # what is written, and how an earlier one is known; see `targets`


def csv_of_sweep(keys: Iterable[str]) -> OutputFormat:
    """Return the form of the table of a sweep over keys, with a row for each cell."""
    from historysim.scenario.grid import variable_name

    return csv_table("a sweep over the same keys", *map(variable_name, keys))


class Answer(NamedTuple):
    """What a command has found."""

    lines: Sequence[tuple[str, str]] = ()
    tables: Sequence[Sequence[tuple[str, ...]]] = ()  #: rows of texts; the first row of each has the headings
    files: Sequence[Path] = ()  #: what was written
    data: "Callable[[], xr.Dataset] | None" = None  #: gives all numbers as a Dataset, with units
    below: Sequence[tuple[str, str]] = ()  #: lines that stand below the tables


def write_answer(answer: Answer, *, as_json: bool = False) -> None:
    """Print what was found: lines, tables and the names of files, or one object of JSON."""
    if as_json:
        click.echo(_json(answer))
        return
    for text in (
        two_columns(answer.lines),
        *map(columns, answer.tables),
        two_columns(answer.below),
        *map(str, answer.files),
    ):
        if text:
            click.echo(text)


def _json(answer: Answer) -> str:
    import json

    document: dict[str, Any] = {
        "lines": [_line(label, text) for label, text in (*answer.lines, *answer.below) if label],
        "tables": [{"columns": rows[0], "rows": rows[1:]} for rows in answer.tables if rows],
        "files": [str(path) for path in answer.files],
    }
    if answer.data is not None:
        document["data"] = answer.data().to_dict()
    return json.dumps(_plain(document), ensure_ascii=False, indent=1)


def _line(label: str, text: str) -> dict[str, Any]:
    quantity = {name: getattr(text, name) for name in ("value", "unit") if hasattr(text, name)}
    return {"label": label, "text": str(text), **quantity}


def _plain(value: object) -> object:
    """Return what JSON can hold: it has no number that is none."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        # JSON has no NaN
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def notice(text: str) -> None:
    """Print a note for the user on standard error."""
    click.echo(f"Note: {printable(text)}", err=True)


def save_dataset(dataset: "xr.Dataset", path: Path, *, measured: bool = False) -> None:
    """Write a table with a first dimension, as netCDF or as CSV with one row for each of its members."""
    if path.suffix.lower() == ".csv":
        from historysim.results.tables import write_csv

        write_csv(dataset, path)
        return
    from historysim.results.tables import CALCULATED, MEASURED, write_netcdf

    write_netcdf(dataset, path, origin=MEASURED if measured else CALCULATED)


def save_table(
    dataset: "xr.Dataset", path: Path, picture: Callable[["xr.Dataset"], "PrintedFigure"], *, measured: bool
) -> None:
    """Write a table as its ending says: netCDF, CSV, or else a picture of it."""
    if path.suffix.lower() in {".nc", ".csv"}:
        save_dataset(dataset, path, measured=measured)
    else:
        save(picture(dataset), path)


def save(figure: "PrintedFigure", picture: Path) -> None:
    """Write a figure to a file, in the format that its ending names; what is to be known of it goes to stderr."""
    with replacing(picture) as unfinished:
        figure.savefig(unfinished, format=picture.suffix.removeprefix(".").lower())
    for text in figure.notices:
        notice(f"{picture}: {text}")
