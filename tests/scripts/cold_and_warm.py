"""Run each scenario where nothing is compiled yet, and again from what was kept, and compare all bits.

    python tests/scripts/cold_and_warm.py [--only 01 08]

Each run is a process of its own, with a copy of the package. The last scenario also runs after an edit of the memory's
source that changes nothing in it, and after all files were replaced, as by an upgrade in place: what was kept is then
compiled anew, to the same bits. Prints how long each process took; compiling is some 20 s of it.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))


def variables(path):
    """Every bit of every variable of a result."""
    import xarray as xr

    with xr.open_dataset(path, decode_times=False) as history:
        return {name: np.ascontiguousarray(values.values).tobytes() for name, values in history.variables.items()}


def installed(site):
    """Copy the package, without anything compiled, over one that may be there."""
    nothing_kept = shutil.ignore_patterns("__pycache__")
    return Path(shutil.copytree(ROOT / "historysim", site / "historysim", ignore=nothing_kept, dirs_exist_ok=True))


def run(package, scenario, output):
    """Run a scenario in a process; the bits of its result, and the seconds."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "historysim", "run", "--quiet", str(scenario), "-o", str(output)],
        cwd=package.parent,
        env=inherited | {"PYTHONPATH": str(package.parent)},
        check=True,
    )
    seconds = time.perf_counter() - start
    return variables(output), seconds


def newest_kept(package):
    """When a file of compiled code was last written."""
    return max(file.stat().st_mtime_ns for file in (package / "memory" / "__pycache__").glob("*.nbc"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=[""], help="numbers with which the scenarios' names begin")
    options = parser.parse_args()
    chosen = [path for path in SCENARIOS if path.name.startswith(tuple(options.only))]
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        site, output = Path(folder) / "site", Path(folder) / "out.nc"

        def compared(name, package, scenario, expected, *, compiles):
            before = newest_kept(package)
            found, seconds = run(package, scenario, output)
            wrong = [key for key in expected if found[key] != expected[key]]
            if (newest_kept(package) > before) != compiles:
                wrong.append("it compiled" if not compiles else "it did not compile")
            print(f"{scenario.stem}: {name} {seconds:.1f} s: {', '.join(wrong) or 'the same bits'}", flush=True)
            return bool(wrong)

        for scenario in chosen:
            shutil.rmtree(site, ignore_errors=True)
            package = installed(site)
            cold, seconds = run(package, scenario, output)
            print(f"{scenario.stem}: cold {seconds:.1f} s", flush=True)
            different += compared("warm", package, scenario, cold, compiles=False)
        with (package / "memory" / "layout.py").open("a", encoding="utf-8") as source:
            source.write("\n# edited\n")
        different += compared("after an edit", package, scenario, cold, compiles=True)
        installed(site)
        different += compared("after an upgrade", package, scenario, cold, compiles=True)
        different += compared("warm", package, scenario, cold, compiles=False)
    print(f"{len(chosen)} scenarios, {different} of the comparisons failed")
    return different > 0


if __name__ == "__main__":
    sys.exit(main())
