"""Random steps of every kind through the memory's C, with sanitizers.

    PYTHONPATH=tests/support python tests/scripts/core_soak.py --steps 10000000

`random_histories.c` draws the steps, `planar_histories.c` those in two tangential directions
(--planar); both say what has to hold after each. The sanitizers of addresses and of undefined
behaviour look on. A finding has the seed of its history, which is then walked alone:

    python tests/scripts/core_soak.py --steps 1000 --first SEED
"""

import argparse
import concurrent.futures
import os
import tempfile
import time
from pathlib import Path

from c_core import SANITIZED, SUPPORT, compiled, hatch_build, walked

STEPS = 1000  # of one history
AT_ONCE = 20  # histories of one process


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first history")
    parser.add_argument(
        "--planar", action="store_true", help="histories in two tangential directions"
    )
    parser.add_argument("--compiler", default=hatch_build.compiler()[0])
    wanted = parser.parse_args()
    last = wanted.first + -(-wanted.steps // STEPS)
    parts = [(begin, min(begin + AT_ONCE, last)) for begin in range(wanted.first, last, AT_ONCE)]
    start, done = time.monotonic(), 0
    with (
        tempfile.TemporaryDirectory() as folder,
        concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool,
    ):
        histories = SUPPORT / ("planar_histories.c" if wanted.planar else "random_histories.c")
        program = compiled([wanted.compiler], histories, Path(folder), *SANITIZED, "-O2")
        for lines in pool.map(lambda part: walked(program, *part, STEPS), parts):
            done += len(lines)
            if done % 1000 < AT_ONCE or done == last - wanted.first:
                print(
                    f"{done * STEPS} steps, {time.monotonic() - start:.0f} s: no finding",
                    flush=True,
                )


if __name__ == "__main__":
    main()
