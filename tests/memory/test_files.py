"""The order of the core's C files, read from their sources and from the table of files in the README of the memory."""

import re
from pathlib import Path

from historysim import get_include

CORE = Path(get_include())
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
# a function body starts at the beginning of a line, and its parameters hold no statement
DEFINED = re.compile(r"^(?!static\b)[A-Za-z_][\w \*]*?[ \*](hs_\w+)\([^;{]*?\)\s*\{", re.MULTILINE)
INCLUDED = re.compile(r'^#include "(\w+\.h)"', re.MULTILINE)


def code_of(path):
    return COMMENT.sub(" ", path.read_text(encoding="utf-8"))


def reading_order():
    """List the files in the order of the README's table."""
    table = (
        (CORE / "README.md")
        .read_text(encoding="utf-8")
        .partition("## Files")[2]
        .partition("\n## ")[0]
    )
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    return [name for row in rows for name in re.findall(r"`(\w+\.[ch])`", row)]


def calls():
    """Map each C file to the C files whose functions it uses."""
    code = {path.name: code_of(path) for path in sorted(CORE.glob("*.c"))}
    defined = {function: name for name, text in code.items() for function in DEFINED.findall(text)}
    assert len(defined) > 150
    return {
        name: {defined[word] for word in re.findall(r"\bhs_\w+\b", text) if word in defined}
        - {name}
        for name, text in code.items()
    }


def find_circle(edges):
    """Return files that need each other in a circle; None if there are none."""
    finished = set()

    def visit(name, path):
        if name in path:
            return [*path[path.index(name) :], name]
        if name not in finished:
            for target in sorted(edges[name]):
                if circle := visit(target, [*path, name]):
                    return circle
            finished.add(name)
        return None

    return next((circle for name in edges if (circle := visit(name, []))), None)


def test_a_circle_is_found():
    assert find_circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert find_circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) is None


def test_no_files_of_the_core_need_each_other():
    assert find_circle(calls()) is None


def test_the_reading_order_names_each_file_once():
    assert sorted(reading_order()) == sorted(path.name for path in CORE.glob("*.[ch]"))


def test_files_need_only_earlier_files():
    order, called = reading_order(), calls()
    for place, name in enumerate(order):
        needed = set(INCLUDED.findall(code_of(CORE / name))) | called.get(name, set())
        assert [other for other in needed if order.index(other) > place] == [], name
