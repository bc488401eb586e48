"""What a run costs at three sizes, and what two dask workers gain: the tables and the picture of ``scale.md``.

    PYTHONPATH=tests/support python tests/benchmarks/scale.py [--page]

Each run is a separate process, so that its peak memory is its own. Times are of the processor;
those of the sweep are on the wall, the shortest of three.
"""

import argparse
import datetime as dt
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from compared import processor, table, with_block

PAGE = Path(__file__).with_name("scale.md")
STEPS = 2000
SIZES = (100, 1_000, 10_000)
SWEEP = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [256, 256]
pixel_size = "1 µm"
rms_height = "50 nm"
autocorrelation_length = "10 µm"
seed = 1
[friction]
coefficient = 0.2
[wear]
law = "archard"
coefficient = 1e-6
hardness = "6 GPa"
[loading]
waypoints = [
    { time = 0, normal_load = "500 mN" },
    { time = 1, tangential_displacement = "300 nm" },
    { time = 2, tangential_displacement = "-300 nm" },
]
substeps = 100
[sweep]
outputs = ["final_dissipated_energy"]
[sweep.over]
surface.seed = { from = 1, count = 24 }
"""


def one_run(count, record):
    """Replay loops of so many asperities to a file, and print what that took as JSON."""
    import resource

    from replay_speed import ensemble, history

    import historysim as hs

    contact = ensemble(count, one_coefficient=True)
    events = history(contact, STEPS, "displacement", 0.1)
    resting = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    hs.Replay(contact, events, record=record).write("run.nc")
    seconds = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    size = Path("run.nc").stat().st_size
    print(
        json.dumps(
            {"seconds": seconds, "bytes": size, "resting": 1024 * resting, "peak": 1024 * peak}
        )
    )


def costs():
    """Yield (asperities, what is recorded, costs) of all sizes."""
    for count in SIZES:
        for record in ("totals", "all"):
            with tempfile.TemporaryDirectory() as folder:
                command = [sys.executable, Path(__file__).resolve(), "--one", str(count), record]
                done = subprocess.run(
                    command, cwd=folder, capture_output=True, text=True, check=True
                )
            yield count, record, json.loads(done.stdout)


def two_workers():
    """Wall times [s] of a sweep of 24 cells by one process and by two, and whether all results are the same."""
    import distributed

    import historysim as hs

    took, found = {}, []
    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder, "sweep.toml")
        scenario.write_text(SWEEP, encoding="utf-8")

        def timed(name, **options):
            for _ in range(3):
                start = time.perf_counter()
                found.append(hs.sweep(scenario, **options))
                took.setdefault(name, []).append(time.perf_counter() - start)

        timed("one process")
        timed("two processes, `--workers 2`", workers=2)
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=None
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            timed("two dask workers", executor=client)
    return {name: min(each) for name, each in took.items()}, all(
        each.identical(found[0]) for each in found
    )


def draw(rows, path):
    """Draw time, file and memory over the size."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({"font.size": 8, "legend.frameon": False}):
        figure = Figure(figsize=(6.6, 2.3), layout="constrained")
        panels = (
            ("time of the processor (s)", "seconds", 1),
            ("file (MB)", "bytes", 1e6),
            ("peak memory (MB)", "peak", 1e6),
        )
        for axes, (label, key, unit) in zip(figure.subplots(1, 3), panels, strict=True):
            for record, style in (("all", "k-o"), ("totals", "k--s")):
                chosen = [(count, each[key] / unit) for count, kind, each in rows if kind == record]
                axes.loglog(*zip(*chosen, strict=True), style, ms=3, label=record)
            axes.set(xlabel="asperities", ylabel=label)
            if key == "peak":
                axes.set(yscale="linear", ylim=(0, None))
        axes.legend(title="recorded")
        figure.savefig(path, dpi=130)


def main():
    """Measure, print the tables, and write them into the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--page", action="store_true", help=f"write the tables into {PAGE.name}, and its picture"
    )
    parser.add_argument("--one", nargs=2, metavar=("COUNT", "RECORD"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        one_run(int(options.one[0]), options.one[1])
        return
    rows = list(costs())
    head = [
        "asperities",
        "recorded",
        "seconds",
        "ns per asperity and step",
        "file, MB",
        "peak memory, MB",
        "before, MB",
    ]
    shown = table(head, [
        [
            f"{count:,}", record, f"{each['seconds']:.2g}", f"{1e9 * each['seconds'] / count / STEPS:.3g}",
            f"{each['bytes'] / 1e6:.3g}", f"{each['peak'] / 1e6:.0f}", f"{each['resting'] / 1e6:.0f}",
        ]
        for count, record, each in rows
    ])  # fmt: skip
    from historysim.recording.provenance import made_with

    shown += f"\n\n{processor()}; {dt.datetime.now(tz=dt.UTC):%Y-%m-%d}; {made_with()}."
    took, same = two_workers()
    sweep = table(
        ["a sweep of 24 random maps of 256² points, with wear", "s on the wall"],
        [[name, f"{s:.2g}"] for name, s in took.items()],
    )
    sweep += f"\n\nThe results are {'the same, bit by bit' if same else 'NOT the same'}."
    print(shown, sweep, sep="\n\n")
    if options.page:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(
            with_block(with_block(page, "costs", shown), "sweep", sweep), encoding="utf-8"
        )
        draw(rows, PAGE.with_suffix(".png"))


if __name__ == "__main__":
    main()
