"""Slips in TOML: the message shows the line, and how to mend it."""

from pytest import mark, raises

from historysim.errors import InputError
from historysim.scenario.document import parse_toml


@mark.parametrize(
    "line, mend",
    [
        ("radius = 2.5 mm", 'a value with a unit needs quotes; expected radius = "2.5 mm"'),
        (
            "w = { time = 0, load = 50mN }",
            'a value with a unit needs quotes; expected load = "50 mN"',
        ),
        ("coefficient = 20 %", "a fraction is a plain number; expected coefficient = 0.2"),
        ("coefficient = 0,2", "the decimal sign is a point; expected coefficient = 0.2"),
        (
            "coefficient = .2",
            "a decimal point needs digits on both sides; expected coefficient = 0.2",
        ),
        ("coefficient = 1/3", "expected newline or end of document after a statement"),
        ("first = silicon", 'a string needs quotes; expected first = "silicon"'),
        ("first = “silicon”", 'curly quotation marks; expected straight ones: first = "silicon"'),
        ('first = "silicon', "the quotation mark is not closed"),
        ("saturate = True", "True is not a value of TOML; expected saturate = true"),
        ("wear = None", "TOML has no None; leave the key out"),
        (
            r'file = "C:\data\a.csv"',
            "a backslash in quotes starts an escape sequence; expected / between folders",
        ),
        ("w = { time = 0 load = 1 }", "expected a comma between keys, and } on the same line"),
        (
            "[loading columns]",
            "expected the name of a section in brackets, with a point between its parts",
        ),
        ("title = 'again'", "appears for the second time; expected it once"),
        ("w = [\n[friction]\ncoefficient = 0.2", "not a value of TOML; expected one, as 2.5e-3"),
    ],
)
def test_a_slip_is_shown_with_its_line_and_its_mend(line, mend):
    with raises(InputError) as caught:
        parse_toml(f"title = 'a'\n{line}\n")
    number, _, shown = str(caught.value).removeprefix("is not TOML: line ").partition(": ")
    assert shown.startswith(f"{line.splitlines()[int(number) - 2].strip()}: {mend}")


@mark.parametrize(
    "source",
    [
        "a = " + "[" * 100_000,
        "a" * 900_000,
        "a = " + "x " * 400_000,
        "[[[" + "\n[" * 200_000,
        '"""' + "'" * 9,
    ],
)
def test_any_other_text_is_refused_in_brief_and_at_once(source):
    with raises(InputError) as caught:
        parse_toml(source)
    assert len(str(caught.value)) < 250
