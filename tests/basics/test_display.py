"""Lines and tables of texts."""

from historysim.basics.display import Lines, columns, html_table, two_columns

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
