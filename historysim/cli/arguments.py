"""What the commands take: files, and quantities with units."""

from pathlib import Path

import click

from historysim.errors import InputError

path_type = click.Path(path_type=Path)


def check_target(path: Path, *sources: Path) -> None:
    """Check that a file can be written, and is none of those that it is made from."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    if any(
        path.absolute() == source.absolute() or (path.exists() and source.exists() and path.samefile(source))
        for source in sources
    ):
        raise InputError(f"{path}: would overwrite what it is made from; choose another name")


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
