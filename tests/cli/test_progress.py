"""What a terminal shows of commands that take long: what is done, of how much, and how long it takes yet."""

import itertools
import os
import pty
import re
import sys
import termios

import pytest
from swept import BALL

from historysim.basics.wording import progress_bar
from historysim.cli import main
from historysim.exchange.fmu import unit_file
from historysim.scenario import fit

SWEPT = BALL + '[sweep.over]\n"friction.coefficient" = [0.1, 0.2, 0.3]\n'
WANTED = BALL + (
    '[design]\nkey = "friction.coefficient"\nbetween = [0.05, 0.5]\noutput = "preliminary_displacement"\n'
    'target = "20 nm"\nover = { "surface.radius" = ["1 mm", "2 mm"] }\n'
)
LOADING = '[loading]\nfile = "m.csv"\ncolumns = { time = "t", normal_load = "N", tangential_displacement = "U" }\n'
FITTED = (
    BALL[: BALL.index("[loading]")]
    + LOADING
    + 'response = { tangential_load = "T" }\n[fit]\nparameters = ["friction"]\n'
)
COMMANDS = {
    "sweep": (SWEPT, ["-o", "out.nc", "--workers", "1"], "sweep", 3),
    "design": (WANTED, ["--workers", "1"], "searching", 2),
    "fit": (FITTED, [], "fitting", None),
    "gallery": (BALL, ["--workers", "1"], "drawing", 1),
    "fmu": (BALL, ["--platforms", "x86_64-linux,x86_64-windows"], "compiling", 2),
}


# cells that are there already would not be computed again
QUIETLY = {"sweep": ["--store", "other.cells"]}


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    turns = [0, 40, -40, 40, -40]
    moved = [a + (b - a) * step / 20 for a, b in itertools.pairwise(turns) for step in range(20)]
    loads = [max(-10.0, min(10.0, u)) for u in moved]
    rows = (f"{i},0.05,{u}e-9,{t}e-3" for i, (u, t) in enumerate(zip(moved, loads, strict=True)))
    (tmp_path / "m.csv").write_text("t,N,U,T\n" + "\n".join(rows) + "\n", encoding="utf-8")
    # what takes less than two seconds is not shown
    at_once = lambda *values, **options: progress_bar(*values, **options | {"delay": 0})  # noqa: E731
    monkeypatch.setattr(fit, "progress_bar", at_once)
    monkeypatch.setattr(unit_file, "compile_unit", lambda *_: b"")

    def written(text):
        (tmp_path / "s.toml").write_text(text, encoding="utf-8")
        return "s.toml"

    return written


def on_terminal(arguments, monkeypatch):
    """Return what a command writes to standard error where that is a pseudo-terminal."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 120))
    with os.fdopen(theirs, "w", encoding="utf-8") as terminal:
        with monkeypatch.context() as patched:
            patched.setattr(sys, "stderr", terminal)
            main.main(arguments, standalone_mode=False)
        terminal.flush()
        os.set_blocking(ours, False)
        shown = b""
        while True:
            try:
                shown += os.read(ours, 65536)
            except BlockingIOError:
                break
    os.close(ours)
    return shown.decode()


@pytest.mark.ci
@pytest.mark.parametrize("command", COMMANDS)
def test_a_terminal_shows_how_far_a_command_is(command, scenario, monkeypatch):
    text, options, doing, count = COMMANDS[command]
    file = scenario(text)
    arguments = [command, "." if command == "gallery" else file, *options]
    if command in {"sweep", "fmu"}:
        assert "%|" not in on_terminal(
            [*arguments, "--quiet", *QUIETLY.get(command, [])], monkeypatch
        )
    shown = on_terminal(arguments, monkeypatch)
    # what is done, of how much, and the time that it took and that is left
    bars = re.findall(rf"{doing}: +\d+%\|.*?\| (\d+)/(\d+) \[\d\d:\d\d<", shown)
    assert bars, shown
    assert {int(total) for _, total in bars} == {count} or count is None
    assert all(int(done) <= int(total) for done, total in bars)
