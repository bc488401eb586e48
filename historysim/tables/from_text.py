"""Read text tables: one row per line, values separated by commas, semicolons, tabs, bars or white space."""

import codecs
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from attrs import evolve

from historysim.basics.arguments import Integers
from historysim.basics.limits import at_most, most
from historysim.basics.wording import count_text
from historysim.errors import InputError
from historysim.tables.blocks import Block, survey
from historysim.tables.clock import clock_seconds
from historysim.tables.columns import Column, FileColumn, Format, Listing
from historysim.tables.head import SEARCHED, Head, Heading
from historysim.tables.lines import (
    brief,
    split_quantity,
)
from historysim.tables.text_rows import MOST_NAMED, BadRowError, RowParser

WINDOWS = "cp1252"  # the encoding of most texts that are not UTF-8


def read_lines(path: Path, encoding: str, most_rows: int, *, head_only: bool = False) -> list[str]:
    """Return the lines of a text, or the first ones that are searched for a header.

    InputError with the byte if the encoding does not fit, or for too many rows.
    """
    _check_lines(path)
    try:
        with path.open(encoding=encoding) as stream:
            lines = list(islice(stream, SEARCHED + (0 if head_only else most_rows + 1)))
    except UnicodeError as error:
        # cp1252 is the fallback for texts that are not UTF-8
        expected = "utf-8" if encoding == WINDOWS else encoding
        raise InputError(_undecodable(path.read_bytes(), expected)) from error
    if len(lines) > most_rows + SEARCHED:
        raise InputError(f"has more than {most_rows:,} rows; thin or split it")
    lines[:1] = [line.removeprefix("\ufeff") for line in lines[:1]]
    return lines


def detect_encoding(path: Path) -> str:
    """Detect the encoding of a text: by its byte order mark, else UTF-8 if it is valid, else cp1252."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    with path.open("rb") as stream:
        head = stream.peek(64)[:64]
        if head[:2] in {codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE}:
            return "utf-16"
        # zero bytes occur only in UTF-16 without a byte order mark
        for encoding, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[::2])):
            if 2 * zeros.count(0) > len(zeros) and zeros.count(0) == head.count(0):
                return encoding
        try:
            while piece := stream.read(1 << 20):
                decoder.decode(piece)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return WINDOWS
    return "utf-8"


def decode_file(path: Path, encoding: str) -> str:
    """Return the text of a file without its byte order mark; InputError with the byte if the encoding does not fit."""
    content = path.read_bytes()
    try:
        return content.decode(encoding).removeprefix("\ufeff")
    except UnicodeError as error:
        raise InputError(_undecodable(content, encoding)) from error


def _check_lines(path: Path) -> None:
    """Refuse a text with a very long line before it is read into memory."""
    longest = most("LINE_BYTES")
    line = 1
    length = 0
    if path.stat().st_size <= longest:
        return
    with path.open("rb") as stream:
        while piece := stream.read(1 << 20):
            ends = piece.count(b"\n") or piece.count(b"\r")
            line = line + ends
            length = 0 if ends else length + len(piece)
            if length > longest:
                raise InputError(
                    f"line {line} has {length:,} bytes or more; {at_most('LINE_BYTES')}"
                )


def _undecodable(content: bytes, encoding: str) -> str:
    where = ""
    try:
        content.decode(encoding)
    except UnicodeDecodeError as error:
        byte = f"0x{content[error.start]:02x}, " if error.start < len(content) else ""
        line = content.count(b"\n", 0, error.start) + 1
        where = f" ({byte}byte {error.start + 1} of the file, line {line}: {error.reason})"
    except UnicodeError as error:
        where = f" ({error})"
    name = "UTF-8" if encoding.lower() in {"utf-8", "utf8"} else encoding
    return f'is not {name} text{where}; save it as UTF-8, or set its encoding, such as encoding = "utf-16"'


def read(
    text: Sequence[str],
    columns: Mapping[str, Column],
    layout: Format,
    *,
    missing: bool,
    most_rows: int,
) -> tuple[dict[str, FileColumn], Integers, list[str]]:
    """Return columns of one table of a text, the line numbers of its rows, and notices.

    Errors as for `historysim.tables.read_table`.
    """
    row_error = None
    if layout.block is None and layout.broken == "refuse":
        try:
            head = Head.from_lines(text, layout)
            return RowParser.from_head(text, head, columns, missing=missing).read(most_rows)
        except BadRowError as error:
            # either the text has several tables, or the row is broken
            row_error = error
    try:
        blocks, footer = survey(text, layout)
    except InputError as error:
        raise row_error or error from None
    index, header = _choose_block(blocks, columns, layout, row_error)
    block = blocks[index]
    head = Head.from_lines(text, evolve(layout, header=header), block.start, block.last_line)
    rows = RowParser.from_head(text, head, columns, missing=missing, stop=block.last_line)
    file_columns, lines, notices = rows.read_or_advise(most_rows)
    return file_columns, lines, [*_notices_of_rest(blocks, footer, index), *notices]


def _choose_block(
    blocks: Sequence[Block],
    columns: Mapping[str, Column],
    layout: Format,
    row_error: InputError | None,
) -> tuple[int, int | None]:
    """Return the index of the block to read, and the line of its header if given.

    InputError if several blocks have the columns, or the block does not exist.
    """
    count = len(blocks)
    no_header = 0 if layout.header == 0 else None
    if layout.header and (layout.block is None or count == 1):
        # the line of the header selects the table below it
        below = [index for index, block in enumerate(blocks) if block.first_line > layout.header]
        return below[0] if below else count - 1, layout.header
    if layout.block is not None:
        if layout.block > count:
            raise InputError(f"there is no block {layout.block}; {_blocks_text(blocks)}")
        return layout.block - 1, no_header
    fitting = [index for index, block in enumerate(blocks) if _has_columns(block.heading, columns)]
    if count > 1 and len(fitting) != 1:
        raise InputError(
            f"has {count} blocks; choose one, as in block = 2; {_blocks_text(blocks)}"
        ) from row_error
    return (fitting or [0])[0], no_header


def _has_columns(heading: Heading, columns: Mapping[str, Column]) -> bool:
    try:
        for column in columns.values():
            heading.find(column)
    except InputError:
        return False
    return True


def _notices_of_rest(blocks: Sequence[Block], footer: Sequence[str], index: int) -> Iterator[str]:
    """Yield notices of the blocks and lines of a text that are not read."""
    if len(blocks) > 1:
        rows = count_text(sum(block.rows for block in blocks) - blocks[index].rows, "row", "rows")
        other_blocks = count_text(len(blocks) - 1, "block", "blocks")
        yield (
            f"block {index + 1} is read, {other_blocks} with {rows} left out: choose another with block = …, or remove "
            "the lines between blocks to join them"
        )
    if footer:
        yield f"the lines below the table are left out: {brief(footer[0])}"


def _blocks_text(blocks: Sequence[Block]) -> str:
    """List the blocks of a text for a message: lines, names, units and first row."""
    texts = [
        "block {} in lines {} to {}: {} (first row: {})".format(
            number, block.first_line, block.last_line, *block.describe()
        )
        for number, block in enumerate(blocks[:MOST_NAMED], 1)
    ]
    more = [f"and {len(blocks) - MOST_NAMED} more"] if len(blocks) > MOST_NAMED else []
    return "seen: " + "; ".join([*texts, *more])


def summarise(text: Sequence[str], layout: Format) -> tuple[list[str], int]:
    """Summarise the tables of a text in lines, and return their number. Errors as for `historysim.tables.describe`."""
    blocks, footer = survey(text, layout)
    lines = []
    for index, block in enumerate(blocks):
        names, row = block.describe()
        lines_above = "; ".join(brief(line)[1:-1] for line in block.preamble[:3])
        rows = count_text(block.rows, "row", "rows")
        lines.append(
            f"block {index + 1}: {rows} in lines {block.first_line} to {block.last_line}"
            + (f", below {lines_above}" if lines_above else "")
        )
        if not index or block.heading.names != blocks[index - 1].heading.names:
            lines.append(f"  names and units: {names}")
        lines.append(f"  first row: {row}")
    if footer:
        lines.append(f"below: {'; '.join(brief(line)[1:-1] for line in footer[:3])}")
    return lines, len(blocks)


def describe(text: Sequence[str], layout: Format) -> list[Listing]:
    """List the columns of a table of a text. Errors as for `historysim.tables.describe`."""
    blocks, _ = survey(text, layout)
    block = blocks[min(layout.block or 1, len(blocks)) - 1]
    heading = block.heading
    listings = []
    for index, (reference, cell) in enumerate(zip(heading.references(), block.row, strict=True)):
        _, *cell_unit = split_quantity(cell) or ("",)
        units = (
            ["s"]
            if clock_seconds(cell) is not None
            else dict.fromkeys([*heading.units(index), *cell_unit])
        )
        listings.append(Listing(reference, ", ".join(units), str(block.rows), cell.strip()))
    return listings
