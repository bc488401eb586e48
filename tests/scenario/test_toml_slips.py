"""Slips in TOML: the message shows the line, and how to mend it."""

import pytest

from historysim.errors import InputError
from historysim.scenario.document import parsed


@pytest.mark.parametrize(
    ("line", "mend"),
    [
        ("radius = 2.5 mm", 'a value with a unit stands in quotes; expected radius = "2.5 mm"'),
        ("w = { time = 0, load = 50mN }", 'a value with a unit stands in quotes; expected load = "50 mN"'),
        ("coefficient = 20 %", "a share is a plain number; expected coefficient = 0.2"),
        ("coefficient = 0,2", "the decimal sign is a point; expected coefficient = 0.2"),
        ("coefficient = .2", "digits stand on both sides of a decimal point; expected coefficient = 0.2"),
        ("radius [mm] = 2.5", 'a unit stands beside the value; expected radius = "2.5 mm"'),
        ("coefficient: 0.2", "= stands between a key and its value; expected coefficient = 0.2"),
        ("coefficient = 0.2;", "nothing stands behind a value; expected coefficient = 0.2"),
        ("coefficient = 0.2 // guess", "a comment begins with #; expected coefficient = 0.2  # guess"),
        ("coefficient = 1/3", "TOML does not calculate; expected coefficient = one number, such as 2.5e-3"),
        ("coefficient =", "coefficient has no value; expected one on this line, where an array begins with ["),
        ("first = silicon", 'a string stands in quotes; expected first = "silicon"'),
        ("first = “silicon”", 'curly quotation marks; expected straight ones: first = "silicon"'),
        ('first = "silicon', 'the quotation mark is not closed; expected "silicon"'),
        ("saturate = True", "True is no value of TOML; expected saturate = true"),
        ("wear = None", "TOML has no None; leave the key out"),
        (r'file = "C:\data\a.csv"', 'a backslash in quotes begins an escape; expected "C:/data/a.csv"'),
        ("w = { time = 0 load = 1 }", "a comma is missing before load; expected key = value, load = …"),
        ("w = { time = 0,", "a table in { } stands on one line; expected } at its end"),
        ("[loading columns]", "a point joins the names of a section; expected [loading.columns]"),
        ("[loading", "the name of a section stands in brackets; expected [loading]"),
        ("title = 'again'", "title is given in line 1 and here; expected it once"),
        ("[sweep]\n[sweep]", "the section [sweep] stands here and in line 2; expected it once, with all its keys"),
        ("w = [\n[friction]\ncoefficient = 0.2", "this [ is not closed; expected ]"),
        ("w = [1, 2,\n", "this [ is not closed; expected ]"),
    ],
)
def test_a_slip_is_shown_with_its_line_and_its_mend(line, mend):
    with pytest.raises(InputError) as caught:
        parsed(f"title = 'a'\n{line}\n")
    shown = line.splitlines()[0 if mend.startswith("this") else -1].strip()
    number = 3 if line.startswith("[sweep]") else 2
    assert str(caught.value) == f"is not TOML: line {number}: {shown}: {mend}"


@pytest.mark.parametrize(
    "source", ["a = " + "[" * 100_000, "a" * 900_000, "a = " + "x " * 400_000, "[[[" + "\n[" * 200_000, '"""' + "'" * 9]
)
def test_any_other_text_is_refused_in_brief_and_at_once(source):
    with pytest.raises(InputError) as caught:
        parsed(source)
    assert len(str(caught.value)) < 250
