"""What histories cost that are computed when they are read: the table "lazy" of ``scale.md``.

    PYTHONPATH=tests/support python tests/benchmarks/lazy_histories.py [--size ASPERITIES STEPS]... [--page]

Each size is a process of its own, so that its peak memory is its own. Times are of the processor.
"""

import argparse
import datetime as dt
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PAGE = Path(__file__).with_name("scale.md")
# smaller in steps than the histories of the page, which go on in the same way
SIZES = ((100_000, 2_000), (1_000_000, 500), (10_000_000, 50))
PICTURED = 100  # asperities of a picture
HEAD = (
    "asperities × steps",
    "written, GB",
    "log, MB",
    "with snapshots, MB",
    "run with totals, s",
    "100 asperities at all steps, s",
    "all at one step, s",
    "of it replay from the snapshot, s",
    "peak memory, GB",
)


def seconds(action):
    """Return the time of the processor that an action takes [s]."""
    start = time.process_time()
    action()
    return time.process_time() - start


def one_size(count, steps):
    """Measure one size, and print what it took as JSON."""
    import resource

    import numpy as np
    import xarray as xr
    from replay_speed import ensemble, history

    import historysim as hs
    from historysim.log.lazy_history import LogReference

    contact = ensemble(count, one_coefficient=True)
    events = history(contact, steps, "displacement", 0.1)
    log = Path("run.history")
    hs.EventLog.create(log, contact, events, record="all").close()
    took = {"log": log.stat().st_size}
    del contact
    took["totals"] = seconds(lambda: hs.run(log, "run.nc", record="totals", threads=1).close())
    took["snapshots"] = log.stat().st_size
    lazy = xr.open_dataset(log, engine="historysim")
    chosen = lazy[["tangential_load", "slip_state"]].isel(asperity=np.linspace(0, count - 1, PICTURED).astype(int))
    took["picture"] = seconds(chosen.load)
    replay = LogReference.of(log.absolute()).history
    replay._states.clear()
    step = steps - 2
    took["step"] = seconds(lambda: lazy["normal_load"].isel(step=step).load())
    replay._states.clear()
    took["distance"] = seconds(lambda: replay._start(step))
    took["peak"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps(took))


def main():
    """Measure, print the table, and write it into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help=f"write the table into {PAGE.name}")
    parser.add_argument("--size", nargs=2, type=int, action="append", metavar=("ASPERITIES", "STEPS"))
    parser.add_argument("--one", nargs=2, type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        one_size(*options.one)
        return
    # after the measurement of one size, whose process does not have the folder of the support on its path
    from compared import processor, table, with_block

    rows = []
    for count, steps in options.size or SIZES:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, Path(__file__).resolve(), "--one", str(count), str(steps)]
            done = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=True)
        took = json.loads(done.stdout)
        times = [f"{took[name]:.3g}" for name in ("totals", "picture", "step", "distance")]
        sizes = [f"{41 * count * steps / 1e9:.3g}", *(f"{took[name] / 1e6:.3g}" for name in ("log", "snapshots"))]
        rows.append([f"{count:,} × {steps:,}", *sizes, *times, f"{took['peak'] / 1e9:.2g}"])
        print(rows[-1], file=sys.stderr)
    from historysim.recording.provenance import made_with

    shown = table(list(HEAD), rows)
    shown += f"\n\n{processor()}, one thread; {dt.datetime.now(tz=dt.UTC):%Y-%m-%d}; {made_with()}."
    print(shown)
    if options.page:
        PAGE.write_text(with_block(PAGE.read_text(encoding="utf-8"), "lazy", shown), encoding="utf-8")


if __name__ == "__main__":
    main()
