"""What the commands share: what they print, and the files that they write."""

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.display import columns, two_columns
from historysim.basics.files import replacing
from historysim.errors import InputError

if TYPE_CHECKING:
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


def save(figure: "Figure", picture: Path) -> None:
    """Write a figure to a file, in the format that its ending names."""
    known = figure.canvas.get_supported_filetypes()
    kind = picture.suffix.removeprefix(".").lower()
    if kind not in known:
        raise InputError(f"{picture}: {kind or 'no'} ending; expected one of {', '.join(sorted(known))}")
    with replacing(picture) as unfinished, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(unfinished, format=kind, dpi=200)
