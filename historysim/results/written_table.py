"""A table that was written to a file, CSV or netCDF: of a question, of loops, of sliding or of a sweep."""

import csv
import re
from pathlib import Path
from typing import Self

import attrs
import numpy as np
import xarray as xr

from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.results.ranges import ranges

HEADING = re.compile(r"(?P<name>[a-z]\w*(?: [\w.+-]+)?)(?: \[(?P<unit>[^\]]+)\])?")
"""A name, the member of a second dimension, a unit."""


def is_table(path: Path) -> bool:
    """Return whether a file is a table (CSV) as `write_csv` writes it, by its first line."""
    if path.suffix.lower() != ".csv":
        return False
    with path.open("rb") as stream:
        line = stream.readline(1 << 20)
    if not line.endswith(b"\r\n"):
        return False
    cells = next(csv.reader([line.decode("utf-8", "replace")]), [])
    return bool(cells) and all(HEADING.fullmatch(cell) for cell in cells)


@attrs.frozen(eq=False)
class WrittenTable:
    """A table of a file.

    Attributes
    ----------
    name : str
        Of the file.
    columns : xarray.Dataset
        Along ``row``, each with its unit in SI; texts are texts.
    """

    name: str
    columns: xr.Dataset = attrs.field(repr=False)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a table from a CSV file.

        Raises
        ------
        InputError
            A row of another length than the header.
        """
        with path.open(encoding="utf-8", newline="") as stream:
            heading, *rows = csv.reader(stream)
        for number, row in enumerate(rows, start=2):
            if len(row) != len(heading):
                raise InputError(
                    f"{path}: line {number}: {counted(len(row), 'value', 'values')}; expected {len(heading)}, as in "
                    "the header: write the table again"
                )
        columns = {}
        for cell, values in zip(heading, zip(*rows, strict=True) if rows else [()] * len(heading), strict=True):
            parts = HEADING.fullmatch(cell)
            name, unit = (parts["name"], parts["unit"]) if parts else (cell, None)
            columns[name] = ("row", _values(values), {"units": unit} if unit else {})
        return cls(path.name, xr.Dataset(columns))

    @classmethod
    def of(cls, dataset: xr.Dataset, name: str) -> Self:
        """Return a Dataset as the table that `write_csv` would write of it."""
        (along, *_) = (dim for each in dataset.data_vars.values() for dim in each.dims)
        columns = {}
        for label, each in dataset.reset_coords().items():
            if each.dims == (along,):
                columns[str(label)] = ("row", each.values, each.attrs)
            elif each.dims[:1] == (along,) and each.ndim == 2:
                second = each.dims[1]
                members = dataset[second].values if second in dataset.coords else range(each.shape[1])
                for place, member in enumerate(members):
                    columns[f"{label} {member}"] = ("row", each.values[:, place], each.attrs)
        if along in dataset.coords:
            columns = {str(along): ("row", dataset[along].values, dataset[along].attrs), **columns}
        return cls(name, xr.Dataset(columns))

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): the number of rows, and the range of each column."""
        return [("table", self.name), ("rows", f"{self.columns.sizes.get('row', 0):,}"), *ranges(self.columns)]


def _values(texts: tuple[str, ...]) -> np.ndarray:
    try:
        return np.array([float(text) if text else np.nan for text in texts])
    except ValueError:
        return np.array(texts, dtype=object)
