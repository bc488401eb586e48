"""Files of numbers in a scenario: a section that names one, and the columns of it."""

import re
from collections.abc import Mapping
from pathlib import Path

import attrs
from cattrs import Converter
from cattrs.gen import override

from historysim.basics.fields import Key
from historysim.basics.files import is_file, what_is_there
from historysim.basics.wording import nearest
from historysim.errors import InputError, at, misfit
from historysim.scenario.schema import table_hook, text
from historysim.tables import Column, Format, Table, join_tables, read_table


# a section that names a file inherits this beside others, and two bases with slots do not mix
@attrs.frozen(kw_only=True, slots=False)
class NumbersFile(Format):
    """A file of numbers, or several that go on one after the other, and how they are written."""

    #: Path, relative to the scenario; an array of paths is one record in several files, in their order.
    file: str | tuple[str, ...] = attrs.field(
        validator=Key(lambda files: files != (), "the path of a file, or of several that follow one another")
    )

    @property
    def files(self) -> tuple[str, ...]:
        """The paths in the scenario."""
        return self.file if isinstance(self.file, tuple) else (self.file,)

    @property
    def name(self) -> str:
        """The names of its files, for messages."""
        return ", ".join(Path(file).name for file in self.files)

    def table(
        self,
        folder: Path,
        columns: Mapping[str, Column],
        units: Mapping[str, str | tuple[str, ...]],
        *,
        missing: bool = False,
    ) -> Table:
        """Return its columns, in their units, by `read_table`; its path is relative to the folder."""
        tables = []
        for path in (folder / file for file in self.files):
            if not is_file(path):
                problem = f"{what_is_there(path)} in {path.absolute().parent}; expected a path relative to the scenario"
                if re.search(r"[\\\x00-\x1f]", str(path)):
                    problem += ", with / between folders"
                raise misfit(f"{path.name}: {problem}", "file")
            try:
                tables.append(read_table(path, columns, units, self, missing=missing))
            except InputError as error:
                # an error of no key belongs to the file
                error.place = error.place or ("file",)
                raise
        if len(tables) == 1:
            return tables[0]
        with at("file"):
            return join_tables([_of_file(table, file) for table, file in zip(tables, self.files, strict=True)])


def _of_file(table: Table, file: str) -> Table:
    """Return a table whose parts and notices name its file, without line numbers, which other files have, too."""
    name = Path(file).name
    parts = tuple(attrs.evolve(part, label=f"{name}: {part.label}") for part in table.parts)
    notices = tuple(f"{name}: {notice}" for notice in table.notices)
    return attrs.evolve(table, lines=None, parts=parts, notices=notices)


def column_from_toml(value: object, _: object = Column) -> Column:
    """Return the column that is ``"name"`` or ``{ column = "name", unit = "mN" }``; anything else is an InputError."""
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
    """Let a converter structure columns, and keys of a format, which the class itself checks: white space counts."""
    converter.register_structure_hook(Column, column_from_toml)
    as_given = override(struct_hook=lambda value, _: tuple(value) if isinstance(value, list) else value)
    keys = {field.name: as_given for field in attrs.fields(Format)}
    converter.register_structure_hook_factory(
        lambda kind: isinstance(kind, type) and issubclass(kind, Format),
        lambda kind, within: table_hook(kind, within, **keys),
    )
