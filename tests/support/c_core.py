"""The memory's C taken out of the package, and compiled by itself with C programs of the tests."""

import importlib.util
import shutil
import subprocess
from pathlib import Path

SUPPORT = Path(__file__).parent
ROOT = SUPPORT.parents[1]
SPEC = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
hatch_build = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(hatch_build)

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Werror"]
SANITIZED = ["-O2", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def taken_out(folder):
    """Copy the C of the memory to a folder, alone, and return the files to compile."""
    for file in sorted((ROOT / "historysim" / "memory").glob("*.[ch]")):
        shutil.copy(file, folder)
    return sorted(folder.glob("*.c"))


def compiled(command, program, folder, *options, name="program", standard="-std=c11"):
    """Compile a C program with the memory's C by a compiler, in a folder; return what was made."""
    core = folder / "core"
    core.mkdir(exist_ok=True)
    sources = taken_out(core)
    language = "c++" if "++" in standard else "c"
    same_bits = [flag for flag in hatch_build.SAME_BITS if not flag.startswith("-std")]
    made = folder / name
    files = ["-x", language, *([program] if program else []), *sources, "-x", "none"]
    subprocess.run([*command, standard, *options, *same_bits, f"-I{core}", *files, "-lm", "-o", made], check=True)
    return made


def walked(program, first, last, steps, *words, runner=()):
    """Return the lines that random histories print; see `random_histories.c`.

    Raises
    ------
    AssertionError
        What has to hold after a step does not, with what the program says.
    """
    command = [*runner, program, *map(str, (first, last, steps)), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(map(str, command))}: {done.stderr}"
    return done.stdout.splitlines()
