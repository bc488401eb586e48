"""What the commands share: what they print, and the files that they write."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.display import columns, two_columns
from historysim.basics.files import replacing
from historysim.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

PICTURES = ".png", ".pdf", ".svg"
"""Endings of pictures that are promised; matplotlib knows more."""


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
    click.echo(f"Note: {text}", err=True)


def check_ending(path: Path, *known: str) -> None:
    """Check that the ending of an output is one of those that can be written."""
    if path.suffix.lower() not in known:
        raise InputError(f"{path}: {path.suffix or 'no'} ending; expected {' or '.join(known)}, by which it is written")


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
    known = figure.canvas.get_supported_filetypes()
    kind = picture.suffix.removeprefix(".").lower()
    if kind not in known:
        raise InputError(f"{picture}: {kind or 'no'} ending; expected one of {', '.join(sorted(known))}")
    with replacing(picture) as unfinished:
        figure.savefig(unfinished, format=kind)
