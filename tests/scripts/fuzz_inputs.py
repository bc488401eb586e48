"""Look for scenarios, logs, states and results that the program trips over, guided by what the code does with them.

    pip install atheris
    python tests/scripts/fuzz_inputs.py scenario -max_total_time=600

The first argument is ``scenario``, ``log``, ``state`` or ``result``; further arguments are passed
to libFuzzer. Findings are written to the folder it runs in, as ``crash-…`` or ``timeout-…``. Files
of numbers have `fuzz_tables`.
"""

import contextlib
import pkgutil
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import atheris

# what is compiled cannot be watched as well
for package in ("memory", "recording", "interaction"):
    for module in pkgutil.iter_modules(
        import_module(f"historysim.{package}").__path__, f"historysim.{package}."
    ):
        import_module(module.name)

with atheris.instrument_imports(include=["historysim"]):
    import hostile

    import historysim as hs
    from historysim.errors import HistorySimError
    from historysim.log import event_log  # noqa: F401
    from historysim.results import analysis, result_files
    from historysim.scenario import scenario as of_scenario  # noqa: F401


def scenario(path: Path) -> None:
    """Read a scenario, and make what it describes, as long as that is small."""
    loaded = hs.load(path)
    if loaded.sections.surface.__class__.__name__ in {"Sphere", "Summits"}:
        loaded.build()


def log(path: Path) -> None:
    """Ask a log what is asked of one."""
    with hs.EventLog(path) as opened:
        opened.summary()
        opened.state()


def result(path: Path) -> None:
    """Ask a result what is asked of one."""
    hs.show(path)
    with result_files.open_result(path) as history:
        analysis.summary(history)


def state(path: Path) -> None:
    """Read a state of the asperity of `hostile.SCENARIO`."""
    hs.Ensemble(PAIR, summit_height=0.0, summit_radius=1e-3, friction=0.5).load_state(path)


PAIR = hs.MaterialPair.from_moduli(contact_modulus=1e10, shear_modulus=2.5e9)
KINDS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "scenario": ("s.toml", scenario),
    "log": ("s.history", log),
    "result": ("s.nc", result),
    "state": ("s.npz", state),
}


def main(kind: str, arguments: list[str]) -> None:
    """Fuzz what reads one kind of file."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz_inputs_"))
    name, read = KINDS[kind]
    (folder / "s.toml").write_text(hostile.SCENARIO, encoding="utf-8")
    hs.run(folder / "s.toml", folder / "s.nc").close()
    ensemble = hs.Ensemble(PAIR, summit_height=0.0, summit_radius=1e-3, friction=0.5)
    ensemble.advance(ensemble.initial_state(), normal_load=0.01).save(folder / "s.npz")
    seeds = folder / "seeds"
    seeds.mkdir()
    (folder / name).rename(seeds / name)
    path = folder / f"fuzzed{Path(name).suffix}"

    def once(content: bytes) -> None:
        path.write_bytes(content)
        # what is refused is refused by an error of the program, or of the system
        with contextlib.suppress(HistorySimError, OSError):
            read(path)

    atheris.Setup([sys.argv[0], "-timeout=60", "-max_len=400000", *arguments, str(seeds)], once)
    atheris.Fuzz()


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in KINDS:
        sys.exit(f"expected one of {', '.join(KINDS)}")
    main(sys.argv[1], sys.argv[2:])
