"""Lines and tables of texts."""

import pytest

from historysim.basics.display import Lines, columns, html_table, printable, two_columns

LINES = [("steps", "11"), ("peak normal load", "50 mN"), ("", ""), ("title", "")]


def test_labels_and_texts_stand_in_two_columns():
    assert two_columns(LINES) == "steps             11\npeak normal load  50 mN\n\ntitle"
    assert two_columns([]) == ""


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
    assert repr(lines) == str(lines) == two_columns(LINES)
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
    assert two_columns([("title", text)]) == f"title  {shown}"
    assert columns([(text,)]) == shown
