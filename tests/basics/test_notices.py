import io
import sys
import threading

import pytest
import tqdm.std

from historysim.basics.wording import progress_bar


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(autouse=True)
def _neither_locks_nor_threads(monkeypatch):
    """A lock of processes, or a thread, beside the bar is an error."""

    def refuse(*_, **__):
        raise AssertionError("made beside the bar")

    monkeypatch.setattr(tqdm.std.TqdmDefaultWriteLock, "__init__", refuse)
    monkeypatch.setattr(threading.Thread, "start", refuse)


def shown(monkeypatch, terminal, *, asked):
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_bar(asked, "step", 3, mininterval=0) as done:
        for count in (1, 2):
            done(count)
    return "" if terminal is None else terminal.getvalue()


def test_a_terminal_shows_how_much_is_done(monkeypatch):
    text = shown(monkeypatch, Terminal(), asked=True)
    assert "1/3" in text
    assert "3/3" in text


@pytest.mark.parametrize(("terminal", "asked"), [(Terminal(), False), (io.StringIO(), True), (None, True)])
def test_elsewhere_nothing_is_shown_and_no_bar_made(monkeypatch, terminal, asked):
    monkeypatch.setattr(tqdm.std.tqdm, "__init__", lambda *_, **__: pytest.fail("a bar was made"))
    assert shown(monkeypatch, terminal, asked=asked) == ""
