"""What the commands share: what they print, and the files that they write."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.display import columns, printable, two_columns
from historysim.basics.files import replacing
from historysim.basics.targets import OutputFormat, csv_table, netcdf

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

TABLES_OF_QUESTIONS = (
    netcdf("a table of historysim", "table", "history over time"),
    csv_table(
        "a table of historysim",
        "asperity,summit_height",
        "elapsed_time,total_normal_load",
        "loop,start_time",
        "radius,pressure",
        "reversal,radius",
        *(
            f"time,{name}"
            for name in (
                "critical_asperity",
                "mean_pressure",
                "peak_pressure",
                "preliminary_displacement",
                "presliding_work",
                "share_of_contacts",
                "stick_ratio",
                "tangential_stiffness",
                "total_mean_pressure",
                "virgin",
            )
        ),
    ),
)
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
TABLE_OF_SWEEP = netcdf("a sweep", "sweep")
"""What is written, and how an earlier one is known; see `targets`."""


def csv_of_sweep(keys: Iterable[str]) -> OutputFormat:
    """Return the form of the table of a sweep over keys, with a row for each cell."""
    from historysim.scenario.grid import variable_name

    return csv_table("a sweep over the same keys", *map(variable_name, keys))


def print_lines(lines: Iterable[tuple[str, str]]) -> None:
    """Print labels with what belongs to them, in two columns."""
    if text := two_columns(lines):
        click.echo(text)


def print_table(rows: Sequence[tuple[str, ...]]) -> None:
    """Print a table of texts, column under column."""
    if text := columns(rows):
        click.echo(text)


def notice(text: str) -> None:
    """Print a note for the user on standard error."""
    click.echo(f"Note: {printable(text)}", err=True)


def save_dataset(dataset: "xr.Dataset", path: Path, *, measured: bool = False) -> None:
    """Write a table with a first dimension, as netCDF or as CSV with one row for each of its members."""
    if path.suffix.lower() == ".csv":
        from historysim.results.csv_table import write_csv

        write_csv(dataset, path)
        return
    from historysim.results.netcdf_table import CALCULATED, MEASURED, write_netcdf

    write_netcdf(dataset, path, origin=MEASURED if measured else CALCULATED)


def save_table(
    dataset: "xr.Dataset", path: Path, picture: Callable[["xr.Dataset"], "Figure"], *, measured: bool
) -> None:
    """Write a table as its ending says: netCDF, CSV, or else a picture of it."""
    if path.suffix.lower() in {".nc", ".csv"}:
        save_dataset(dataset, path, measured=measured)
    else:
        save(picture(dataset), path)


def save(figure: "Figure", picture: Path) -> None:
    """Write a figure to a file, in the format that its ending names."""
    with replacing(picture) as unfinished:
        figure.savefig(unfinished, format=picture.suffix.removeprefix(".").lower())
