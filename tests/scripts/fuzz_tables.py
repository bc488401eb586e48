"""Look for files of numbers that the readers trip over, guided by what the code does with them.

    pip install atheris
    python tests/scripts/fuzz_tables.py text.tsv -max_total_time=600

The first argument is one of the files of `support/number_files.py`; further arguments are passed to
libFuzzer. Findings are written to the folder it runs in, as ``crash-…`` or ``timeout-…``.
"""

import sys
import tempfile
from importlib import import_module
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["historysim.tables", "nptdms", "scipy.io"]):
    from number_files import WRITERS, columns_of, read_or_refuse

    for reader in ("array_files", "from_text"):
        import_module(f"historysim.tables.{reader}")


def main(name: str, arguments: list[str]) -> None:
    """Fuzz the reader of one format."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz_tables_"))
    seeds = folder / "seeds"
    seeds.mkdir()
    WRITERS[name](seeds / name)
    path, columns = folder / name, columns_of(name)

    def read(content: bytes) -> None:
        path.write_bytes(content)
        read_or_refuse(path, columns, missing=bool(len(content) % 2))

    atheris.Setup([sys.argv[0], "-timeout=20", "-max_len=20000", *arguments, str(seeds)], read)
    atheris.Fuzz()


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in WRITERS:
        sys.exit(f"expected one of {', '.join(WRITERS)}")
    main(sys.argv[1], sys.argv[2:])
