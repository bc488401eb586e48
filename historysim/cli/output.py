"""What the commands share: what they print, and the files that they write."""

import csv
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.display import columns, two_columns
from historysim.basics.files import replacing
from historysim.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


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


def save_dataset(dataset: "xr.Dataset", path: Path) -> None:
    """Write a table with a first dimension, as netCDF or as CSV with one row for each of its members.

    The header of a CSV has names, the member of a second dimension, and units: ``friction forward [1]``.
    """
    with replacing(path) as unfinished:
        if path.suffix.lower() == ".csv":
            with unfinished.open("w", encoding="utf-8", newline="") as stream:
                csv.writer(stream).writerows(_csv_rows(dataset))
        else:
            dataset.to_netcdf(unfinished)


def _csv_rows(dataset: "xr.Dataset") -> Iterable[Sequence[object]]:
    header, columns = [], []
    along = next(iter(dataset.data_vars.values())).dims[0]
    for name, variable in dataset.variables.items():
        if variable.dims[:1] != (along,) or variable.ndim > 2:
            continue
        unit = variable.attrs.get("units", "")
        suffix = f" [{unit}]" if unit and unit != "1" else ""
        if variable.ndim == 1:
            header.append(f"{name}{suffix}")
            columns.append(variable.values.tolist())
            continue
        second = variable.dims[1]
        members = dataset[second].values if second in dataset.coords else range(variable.shape[1])
        for index, member in enumerate(members):
            header.append(f"{name} {member}{suffix}")
            columns.append(variable.values[:, index].tolist())
    return [header, *zip(*columns, strict=True)]


def save(figure: "Figure", picture: Path) -> None:
    """Write a figure to a file, in the format that its ending names."""
    known = figure.canvas.get_supported_filetypes()
    kind = picture.suffix.removeprefix(".").lower()
    if kind not in known:
        raise InputError(f"{picture}: {kind or 'no'} ending; expected one of {', '.join(sorted(known))}")
    with replacing(picture) as unfinished, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(unfinished, format=kind, dpi=200)
