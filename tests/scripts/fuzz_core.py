"""Look for serialised states that harm the memory's C, guided by what it does with them.

    PYTHONPATH=tests/support python tests/scripts/fuzz_core.py -max_total_time=600

needs clang with libFuzzer (Debian: clang and libclang-rt-dev). Further arguments are passed to
libFuzzer, which begins with states of random histories. What is found is written to the folder it
runs in, as ``crash-…`` or ``timeout-…``; given as the first word, such a file is tried alone.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from c_core import SANITIZED, SUPPORT, compiled, walked


def main():
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        states = folder / "states"
        states.mkdir()
        for steps in (1, 5, 50):
            (states / str(steps)).mkdir()
            first = 1000 * steps
            program = compiled(
                ["clang"], SUPPORT / "random_histories.c", folder, "-O2", name="histories"
            )
            walked(program, first, first + 60, steps, states / str(steps))
        fuzzer = compiled(
            ["clang"],
            SUPPORT / "fuzz_state.c",
            folder,
            *SANITIZED,
            "-O2",
            "-fsanitize=fuzzer",
            name="fuzzer",
        )
        alone = any(not word.startswith("-") for word in sys.argv[1:])
        # new inputs are saved in the first folder
        words = [
            "-max_len=4096",
            "-len_control=0",
            "-timeout=120",
            *([] if alone else states.iterdir()),
            *sys.argv[1:],
        ]
        sys.exit(subprocess.run([fuzzer, *words], check=False).returncode)


if __name__ == "__main__":
    main()
