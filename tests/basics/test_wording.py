"""Words of messages, lines and tables of texts, and progress."""

import io
import sys
import threading

import pytest
import tqdm.std
from pytest import mark

import historysim as hs
from historysim.basics.wording import columns, format_value, nearest, printable, progress_bar


def test_the_nearest_word_is_meant_or_any():
    assert nearest("normal_laod", ["normal_load", "friction"]) == "did you mean 'normal_load'?"
    assert nearest("x", ["normal_load", "friction"]) == "expected one of normal_load, friction"
    assert nearest("x", []) == "none is expected here"


@mark.parametrize(
    "value, text",
    [
        ("abc", "'abc'"),
        ("a" * 50, f"{'a' * 40!r}…"),
        ({"a": 1}, "a table"),
    ],
)
def test_what_came_is_shown_in_brief(value, text):
    assert format_value(value) == text


def test_an_integer_that_python_refuses_to_print_is_shown_all_the_same():
    assert format_value(10**5000) == "an integer of 16610 bits"


LINES = [("steps", "11"), ("peak normal load", "50 mN"), ("", ""), ("title", "")]


def test_labels_and_texts_stand_in_columns():
    assert columns(LINES) == "steps             11\npeak normal load  50 mN\n\ntitle"
    assert columns([]) == ""


@mark.parametrize(
    "text, written",
    [
        ("plain, µm ≥ 3\u00a0%", "plain, µm ≥ 3\u00a0%"),
        ("\x1b[31mred\x07", "\\x1b[31mred\\x07"),
        ("\u202eturned\ufffe", "\\u202eturned\\ufffe"),
    ],
)
def test_what_steers_a_terminal_is_shown_as_what_it_is(text, written):
    assert printable(text) == written
    assert columns([("title", text)]) == f"title  {written}"
    assert columns([(text,)]) == written


def test_objects_show_themselves_as_tables_in_a_notebook(tmp_path):
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ensemble = hs.Ensemble(pair, [0.0, -30e-9], 10e-6, 0.2)
    path = tmp_path / "s.toml"
    path.write_text(
        'title = "A < B"\n[materials]\nfirst = "silicon"\nsecond = "float glass"\n[friction]\ncoefficient = 0.2\n'
        '[surface]\nkind = "sphere"\nradius = "1 mm"\n[[loading.waypoints]]\ntime = 0.0\nnormal_load = "5 mN"\n',
        encoding="utf-8",
    )
    found = {
        "112 GPa": pair.first,
        "silicon on float glass": pair,
        "-30 nm to 0 m": ensemble,
        "1 event over 0 s": hs.Replay(ensemble, [hs.NormalLoad(0.0, 1e-3)]),
        "2 × 3": hs.Surface([[0.0, 1e-9, 0.0], [0.0, 0.0, 0.0]], 1e-6),
        "A &lt; B": hs.load(path),
    }
    for text, what in found.items():
        html = what._repr_html_()
        assert html.startswith("<table>")
        assert text in html


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def _neither_locks_nor_threads(monkeypatch):
    """A lock of processes, or a thread, in addition to the bar is an error."""

    def refuse(*_, **__):
        raise AssertionError("made in addition to the bar")

    monkeypatch.setattr(tqdm.std.TqdmDefaultWriteLock, "__init__", refuse)
    monkeypatch.setattr(threading.Thread, "start", refuse)


def progress_shown(monkeypatch, terminal, *, asked):
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_bar(asked, "step", 3, mininterval=0) as done:
        for count in (1, 2):
            done(count)
    return "" if terminal is None else terminal.getvalue()


@mark.usefixtures("_neither_locks_nor_threads")
def test_a_terminal_shows_how_much_is_done(monkeypatch):
    text = progress_shown(monkeypatch, Terminal(), asked=True)
    assert "1/3" in text
    assert "3/3" in text


@mark.usefixtures("_neither_locks_nor_threads")
@mark.parametrize("terminal, asked", [(Terminal(), False), (io.StringIO(), True), (None, True)])
def test_elsewhere_nothing_is_shown_and_no_bar_made(monkeypatch, terminal, asked):
    monkeypatch.setattr(tqdm.std.tqdm, "__init__", lambda *_, **__: pytest.fail("a bar was made"))
    assert progress_shown(monkeypatch, terminal, asked=asked) == ""
