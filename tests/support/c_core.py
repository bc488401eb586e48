"""The memory's C taken out of the package, and compiled by itself with C programs of the tests."""

import functools
import importlib.util
import shutil
import subprocess
import tempfile
from pathlib import Path

from historysim.basics.compiler import SAME_BITS

SUPPORT = Path(__file__).parent
ROOT = SUPPORT.parents[1]
SPEC = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
hatch_build = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(hatch_build)

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Werror"]
PROGRAM = ("-D", "-shared", "-Wl,")  # options that leave the core as it is
# not optimised: sanitizers make optimised compilation four times as long, and find as much without it
SANITIZED = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


_MADE = tempfile.TemporaryDirectory()


@functools.cache
def core_objects(command, options, standard):
    """Compile the memory's C, taken out of the package; return the folder of its headers and its objects."""
    folder = Path(tempfile.mkdtemp(dir=_MADE.name))
    for file in (ROOT / "historysim" / "memory").glob("*.[ch]"):
        shutil.copy(file, folder)
    same_bits = [flag for flag in SAME_BITS if not flag.startswith("-std")]
    language = ["-x", "c++" if "++" in standard else "c"]
    build = [*command, standard, *options, *same_bits, f"-I{folder}", *language]
    subprocess.run([*build, "-c", *sorted(folder.glob("*.c"))], check=True, cwd=folder)
    return build, sorted(folder.glob("*.o"))


def compiled(command, program, folder, *options, name="program", standard="-std=c11"):
    """Compile a C program with the memory's C by a compiler, in a folder; return what was made."""
    own = [option for option in options if option.startswith(PROGRAM)]
    shared = tuple(option for option in options if option not in own)
    build, objects = core_objects(tuple(command), shared, standard)
    made = folder / name
    sources = [program] if program else []
    subprocess.run([*build, *own, *sources, "-x", "none", *objects, "-lm", "-o", made], check=True)
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
