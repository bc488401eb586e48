"""Slips of the pen in TOML: the line of one, and how to mend it."""

import re
from collections.abc import Callable, Iterator

from historysim.basics.units import is_unit

_NAME = r"""(?:[\w-]+|"[^"]*"|'[^']*')"""
_KEY = rf"(?P<key>{_NAME}(?:\s*\.\s*{_NAME})*)"
_DIGITS = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_END = r"(?=\s*(?:[,}\]#]|$))"
_CURLY = str.maketrans("“”„«»‘’‚", '"""""\'\'\'')
_PLACE = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$")
# A bracket, or what hides one.
_SCAN = re.compile(
    r"""
    \"{3}[\s\S]*?(?:\"{3}|\Z) | "(?:\\.|[^"\\\n])*" | '{3}[\s\S]*?(?:'{3}|\Z) | '[^'\n]*' | [#].* | [\[\]{}]
    """,
    re.VERBOSE,
)
_CLOSING = {"[": "]", "{": "} on the same line"}
_SHOWN = 70
_LONGEST = 500  # characters of a line that is searched for slips: patterns take the square of it


def mended(source: str, problem: str) -> str:
    """Return where and why a string is no TOML, which the parser says as ``problem``, with the mend of a known slip."""
    match = _PLACE.search(problem)
    known = match is not None and match[1] is not None
    reason = problem[: match.start()] if match else problem
    lines = [line.rstrip("\r") for line in source.split("\n")]
    number, at = (int(match[1]), int(match[2]) - 1) if match and known else (len(lines), 0)
    line = lines[number - 1]
    opened = _open_bracket(source, number if known else number + 1)
    # a section or a key within an array is the first that the parser notices of it
    if opened and (not known or re.match(rf"\s*(?:\[|{_KEY}\s*=\s)", line)):
        number, sign = opened
        line, mend = lines[number - 1], f"this {sign} is not closed; expected {_CLOSING[sign]}"
    else:
        mend = _repeated(lines, number, reason) or next(_slips(line, at), "") or reason[:1].lower() + reason[1:]
    return f"line {number}: {_brief(line)}: {mend}"


def _brief(line: str) -> str:
    line = line.strip()
    return line if len(line) <= _SHOWN else f"{line[:_SHOWN]}…"


def _open_bracket(source: str, before: int) -> tuple[int, str] | None:
    """Return the line and the sign of the first bracket that is open above a line; None where all are closed."""
    stack: list[tuple[int, str]] = []
    number, counted = 1, 0
    for token in _SCAN.finditer(source):
        number, counted = number + source.count("\n", counted, token.start()), token.start()
        if number >= before:
            break
        if token[0] in _CLOSING:
            stack.append((number, token[0]))
        elif token[0] in {"]", "}"} and stack:
            stack.pop()
    return stack[0] if stack else None


def _repeated(lines: list[str], number: int, reason: str) -> str:
    """Return what is wrong with a key or a section that stands there twice; empty where none does."""
    line, above = lines[number - 1], list(enumerate(lines[: number - 1], 1))
    if reason.startswith("Cannot declare") and (head := re.match(r"\s*(\[[^\]]*\])", line)):
        first = next((f" and in line {n}" for n, other in above if other.strip().startswith(head[1])), "")
        return f"the section {head[1]} stands here{first}; expected it once, with all its keys"
    if reason.startswith(("Cannot overwrite", "Duplicate")) and (found := re.match(rf"\s*{_KEY}\s*=", line)):
        begin = max((n for n, other in above if re.match(r"\s*\[", other)), default=0)
        same = re.compile(rf"\s*{re.escape(found['key'])}\s*=")
        first = next((f" in line {n} and here" for n, other in above[begin:] if same.match(other)), " more than once")
        return f"{found['key']} is given{first}; expected it once"
    return ""


def _slips(line: str, at: int) -> Iterator[str]:
    """Yield the mends of slips in a line, the likeliest first; the parser has stopped at a column."""
    if len(line) > _LONGEST:
        return
    if (plain := line.translate(_CURLY)) != line:
        yield f"curly quotation marks; expected straight ones: {_brief(plain)}"
    for pattern, mend in _SLIPS:
        found = [(match, text) for match in pattern.finditer(line) if (text := mend(match))]
        # of several values in a line the one at which the parser has stopped
        found.sort(key=lambda each: not each[0].start() <= at <= each[0].end() + 1)
        yield from (text for _, text in found[:1])


def _with_unit(found: re.Match[str]) -> str:
    key, number, unit = found["key"], found["number"].replace(",", "."), found["unit"].strip()
    if unit == "%":
        return f"a share is a plain number; expected {key} = {float(number) / 100:g}"
    return f'a value with a unit stands in quotes; expected {key} = "{number} {unit}"' if is_unit(unit) else ""


def _with_comma(found: re.Match[str]) -> str:
    return f"the decimal sign is a point; expected {found['key']} = {found['number'].replace(',', '.')}"


def _bare_point(found: re.Match[str]) -> str:
    number = found["number"]
    if not (number.endswith(".") or number.lstrip("+-").startswith(".")):
        return ""
    return f"digits stand on both sides of a decimal point; expected {found['key']} = {float(number)!r}"


_WORDS = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}


def _word(found: re.Match[str]) -> str:
    key, word = found["key"], found["word"]
    if word in {"inf", "nan", "true", "false"}:
        return ""
    if word.lower() in {"none", "null", "nil"}:
        return f"TOML has no {word}; leave the key out"
    if word.lower() in _WORDS:
        return f"{word} is no value of TOML; expected {key} = {_WORDS[word.lower()]}"
    return f'a string stands in quotes; expected {key} = "{word}"'


def _ended(found: re.Match[str]) -> str:
    given = f"{found['key']} = {found['value']}"
    if found["sign"] == ";":
        return f"nothing stands behind a value; expected {given}"
    return f"a comment begins with #; expected {given}  # {line}" if (line := found["rest"].strip(" /()")) else ""


# Patterns of slips in a line, and the mend of each, which may be empty.
_SLIPS: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...] = tuple(
    (re.compile(pattern), mend)
    for pattern, mend in (
        (rf"{_KEY}\s*=\s*(?P<number>{_DIGITS}|\d+,\d+)\s*(?P<unit>[%°µμA-Za-z][^,}}\]#;()\"=]*?){_END}", _with_unit),
        (rf"{_KEY}\s*=\s*(?P<number>[+-]?\d+,\d+(?:[eE][+-]?\d+)?){_END}", _with_comma),
        (rf"{_KEY}\s*=\s*(?P<number>[+-]?(?:\d+\.|\.\d+)){_END}", _bare_point),
        (
            rf"^\s*{_KEY}\s*[\[(]\s*(?P<unit>[^\])]+?)\s*[\])]\s*=\s*(?P<number>{_DIGITS})",
            lambda found: (
                f'a unit stands beside the value; expected {found["key"]} = "{found["number"]} {found["unit"]}"'
            ),
        ),
        (
            r"^\s*\[(?P<first>[\w-]+)\s+(?P<second>[\w-]+)\s*\]",
            lambda found: f"a point joins the names of a section; expected [{found['first']}.{found['second']}]",
        ),
        (
            r'(?P<quoted>"[^"]*\\[^"]*")',
            lambda found: "a backslash in quotes begins an escape; expected " + re.sub(r"\\+", "/", found["quoted"]),
        ),
        (rf"{_KEY}\s*=\s*(?P<value>{_DIGITS}|\"[^\"]*\"|true|false)\s*(?P<sign>;|//|\(|--)(?P<rest>.*)", _ended),
        (rf"{_KEY}\s*=\s*(?P<word>[A-Za-z][\w -]*?){_END}", _word),
        (
            rf"{_KEY}\s*=\s*{_DIGITS}\s*[*/^·x].*?{_END}",
            lambda found: f"TOML does not calculate; expected {found['key']} = one number, such as 2.5e-3",
        ),
        (
            rf"{_KEY}\s*:\s*(?P<value>[^\s=][^,}}]*?)(?=\s*(?:[,}}#]|$))",
            lambda found: f"= stands between a key and its value; expected {found['key']} = {found['value']}",
        ),
        (
            rf"{_KEY}\s*=\s*(?:#.*)?$",
            lambda found: f"{found['key']} has no value; expected one on this line, where an array begins with [",
        ),
        (
            rf"=\s*(?:{_DIGITS}|\"[^\"]*\")\s+{_KEY}\s*=",
            lambda found: f"a comma is missing before {found['key']}; expected key = value, {found['key']} = …",
        ),
        (
            r"^\s*(?P<head>\[[\w.-]+)\s*(?:#.*)?$",
            lambda found: f"the name of a section stands in brackets; expected {found['head']}]",
        ),
        (
            r"=\s*(?P<open>\"[^\"]*|'[^']*)$",
            lambda found: f"the quotation mark is not closed; expected {found['open'].strip()}{found['open'][0]}",
        ),
        (r"\{[^}]*$", lambda _: "a table in { } stands on one line; expected } at its end"),
    )
)
