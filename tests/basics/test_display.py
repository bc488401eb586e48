"""Lines and tables of texts."""

import pytest

import historysim as hs
from historysim.basics.wording import Lines, columns, html_table, printable

LINES = [("steps", "11"), ("peak normal load", "50 mN"), ("", ""), ("title", "")]


def test_labels_and_texts_stand_in_columns():
    assert columns(LINES) == "steps             11\npeak normal load  50 mN\n\ntitle"
    assert columns([]) == ""


def test_columns_are_as_wide_as_their_longest_text():
    assert columns([("quantity", "both"), ("energy", "1 nJ")]) == "quantity  both\nenergy    1 nJ"
    assert columns([]) == ""


def test_html_is_escaped():
    assert "<td" in html_table([("a < b", "x & y")])
    assert "a &lt; b" in html_table([("a < b", "x & y")])
    assert "<thead>" not in html_table([("a", "b")])
    assert html_table([("a", "b")], ("what", "how")).count("<th") == 4


def test_lines_show_themselves():
    lines = Lines(LINES)
    assert repr(lines) == str(lines) == columns(LINES)
    assert lines._repr_html_().count("<tr>") == 4
    assert dict(lines)["steps"] == "11"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain, µm ≥ 3\u00a0%", "plain, µm ≥ 3\u00a0%"),
        ("two\nlines\tand tabs", "two\nlines\tand tabs"),
        ("\x1b[31mred\x07", "\\x1b[31mred\\x07"),
        ("\u202eturned\ufffe", "\\u202eturned\\ufffe"),
        ("half \udc80", "half \\udc80"),
        ("\r", "\\r"),
    ],
)
def test_what_steers_a_terminal_is_shown_as_what_it_is(text, shown):
    assert printable(text) == shown
    assert columns([("title", text)]) == f"title  {shown}"
    assert columns([(text,)]) == shown


def test_objects_show_themselves_as_tables_in_a_notebook(tmp_path):
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ensemble = hs.Ensemble(pair, [0.0, -30e-9], 10e-6, 0.2)
    path = tmp_path / "s.toml"
    path.write_text(
        'title = "A < B"\n[materials]\nfirst = "silicon"\nsecond = "float glass"\n[friction]\ncoefficient = 0.2\n'
        '[surface]\nkind = "sphere"\nradius = "1 mm"\n[[loading.waypoints]]\ntime = 0.0\nnormal_load = "5 mN"\n',
        encoding="utf-8",
    )
    shown = {
        "112 GPa": pair.first,
        "silicon on float glass": pair,
        "-30 nm to 0 m": ensemble,
        "1 event over 0 s": hs.Replay(ensemble, [hs.NormalLoad(0.0, 1e-3)]),
        "2 × 3": hs.Surface([[0.0, 1e-9, 0.0], [0.0, 0.0, 0.0]], 1e-6),
        "A &lt; B": hs.load(path),
    }
    for text, what in shown.items():
        html = what._repr_html_()
        assert html.startswith("<table>")
        assert text in html
