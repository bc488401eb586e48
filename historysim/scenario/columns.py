"""Files of numbers in a scenario: a section that names one, and the columns of it."""

from collections.abc import Callable, Mapping
from pathlib import Path

import attrs
from cattrs import Converter
from cattrs.gen import override

from historysim.basics.files import is_file
from historysim.basics.places import misfit
from historysim.basics.wording import nearest, shown
from historysim.errors import InputError
from historysim.scenario.schema import table_hook, text
from historysim.tables import Column, Format, Table, read_table


# a section that names a file inherits this beside others, and two bases with slots do not mix
@attrs.frozen(kw_only=True, slots=False)
class NumbersFile(Format):
    """A file of numbers, and how it is written."""

    file: str

    def table(
        self,
        folder: Path,
        columns: Mapping[str, Column],
        units: Mapping[str, str | tuple[str, ...]],
        *,
        missing: bool = False,
    ) -> Table:
        """Return columns of it, as `historysim.tables.read_table` does; its path is relative to the folder."""
        path = folder / self.file
        if not is_file(path):
            problem = f"there is no such file in {path.parent}; expected a path relative to the scenario"
            raise misfit(f"{path.name}: {problem}", "file")
        try:
            return read_table(path, columns, units, self, missing=missing)
        except InputError as error:
            # what is wrong with no value of the scenario is wrong with the file
            error.place = error.place or ("file",)
            raise


def column_from_toml(value: object, _: object = Column) -> Column:
    """Return the column that is ``"name"`` or ``{ column = "name", unit = "mN" }``.

    Raises
    ------
    InputError
        Anything else.
    """
    if not isinstance(value, dict):
        return Column(text(value))
    known = [field.name for field in attrs.fields(Column)]
    for key in value:
        if key not in known:
            raise misfit(f"unknown key; {nearest(key, known)}", key)
    if "column" not in value:
        raise misfit("missing; expected the name of a column in the file", "column")
    return Column(**value)


def column_hooks(converter: Converter) -> None:
    """Teach a converter columns, and that white space counts in what says how a file is written."""
    converter.register_structure_hook(Column, column_from_toml)
    converter.register_structure_hook_factory(_says_how_a_file_is_written, _format_hook)


def _says_how_a_file_is_written(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Format)


def _format_hook(kind: type, converter: Converter) -> Callable[[object, object], object]:
    as_it_stands = override(struct_hook=_characters)
    as_given = override(struct_hook=_as_given)
    return table_hook(
        kind,
        converter,
        delimiter=as_it_stands,
        comment=as_it_stands,
        blocks=as_given,
        sheet=as_given,
        broken=as_it_stands,
    )


def _as_given(value: object, _: object) -> object:
    """Take a key that may be of several kinds, which its class checks."""
    return tuple(value) if isinstance(value, list) else value


def _characters(value: object, _: object) -> str:
    if not isinstance(value, str):
        raise InputError(f"{shown(value)}; expected a text")
    return value
