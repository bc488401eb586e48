"""States of other ensembles, of other versions and forged ones, given to every entry in Python.

    CFLAGS="-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all" python hatch_build.py
    LD_PRELOAD="$(gcc -print-file-name=libasan.so)" ASAN_OPTIONS=detect_leaks=0 PYTHONPATH=tests/support \
        python tests/scripts/state_soak.py --calls 100000
    python hatch_build.py

A call that takes more than two minutes ends the script, with where it is.
"""

import argparse
import faulthandler
import time
import warnings

from foreign_states import Calls


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    wanted = parser.parse_args()
    warnings.simplefilter("ignore")
    calls, start = Calls(wanted.seed), time.process_time()
    for done in range(1, wanted.calls + 1):
        faulthandler.dump_traceback_later(120, exit=True)
        calls.one()
        if done % 1000 == 0:
            told = ", ".join(f"{count} {kind}" for kind, count in calls.counts.items())
            spent = time.process_time() - start
            print(f"{done} calls in {spent:.0f} s, the longest {calls.longest:.2f} s: {told}", flush=True)
    faulthandler.cancel_dump_traceback_later()


if __name__ == "__main__":
    main()
