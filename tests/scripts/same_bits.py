"""Build the memory's C with several compilers, and compare the bits of long random histories of every kind of event.

    PYTHONPATH=tests/support python tests/scripts/same_bits.py --histories 1000

gcc without and with all optimisation for this processor, clang, zig (``pip install ziglang``), and
gcc for AArch64, whose program qemu runs (Debian: gcc-aarch64-linux-gnu and qemu-user-static), as
far as they are there. Digests of states' bytes and of all that is read from them have to be alike;
those of histories whose friction calls pow are told, but may differ.
"""

import argparse
import importlib.util
import platform
import shutil
import sys
import tempfile
from pathlib import Path

from c_core import SUPPORT, compiled, walked

from historysim.basics.compiler import ZIG

STEPS = 1000
NATIVE = "-mcpu=native" if platform.machine() in {"aarch64", "arm64"} else "-march=native"


def builds():
    """Return the name of each build with its compiler, its options and what runs it."""
    return {
        "gcc -O0": (["gcc"], ["-O0"], []),
        f"gcc -O3 {NATIVE}": (["gcc"], ["-O3", NATIVE], []),
        "clang -O2": (["clang"], ["-O2"], []),
        "zig cc -O3": (ZIG, ["-O3"], []),
        "aarch64 gcc -O3": (["aarch64-linux-gnu-gcc"], ["-O3", "-static"], ["qemu-aarch64-static"]),
    }


def is_there(compiler, runner):
    """Whether a build can be made and run here."""
    if "ziglang" in compiler:
        return importlib.util.find_spec("ziglang") is not None
    return all(shutil.which(name) for name in (compiler[0], *runner))


def digests(name, histories, folder, *, steps=STEPS):
    """Return what the histories of a build print: (seed, kind of friction, digest) of each."""
    compiler, options, runner = builds()[name]
    program = compiled(compiler, SUPPORT / "random_histories.c", folder, *options)
    return [tuple(line.split()) for line in walked(program, 0, histories, steps, runner=runner)]


def differing(one, other):
    """Return the seeds of histories that differ, without and with pow."""
    apart = [mine[:2] for mine, others in zip(one, other, strict=True) if mine != others]
    return tuple(
        [int(seed) for seed, kind in apart if kind == wanted] for wanted in ("exact", "pow")
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--histories", type=int, default=200, help=f"of {STEPS} steps each")
    wanted = parser.parse_args()
    first, failed = None, False
    for name, (compiler, _, runner) in builds().items():
        if not is_there(compiler, runner):
            print(f"{name}: is not there")
            continue
        with tempfile.TemporaryDirectory() as folder:
            found = digests(name, wanted.histories, Path(folder))
        first = first or found
        exact, powers = differing(first, found)
        failed = failed or bool(exact)
        told = f"differs in {exact[:5]} and {len(exact)} in all" if exact else "the same bits"
        with_pow = sum(kind == "pow" for _, kind, _ in found)
        print(f"{name}: {told}; of {with_pow} histories with pow {len(powers)} differ", flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
