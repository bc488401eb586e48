"""Messages about unsuitable arguments: expressions and what is said of them, in a text next to a test module.

The texts are reviewed in diffs. A line that is not indented is an expression, in the names of the
module; ``HISTORYSIM_NEW_MESSAGES=1 pytest -k test_messages tests`` writes the messages below it
after an intended change.
"""

import os
import re
from pathlib import Path

import numpy as np
from pytest import raises

import historysim as hs


def refused(match):
    """Expect an `InputError` whose message has a match."""
    return raises(hs.InputError, match=match)


def message(expression, names):
    """Return what is said of an expression; the type of the error precedes it unless it is `InputError`."""
    with raises(hs.HistorySimError) as caught:
        eval(expression, names)  # noqa: S307 - of a file of the tests
    kind = type(caught.value).__name__
    said = f"{kind}: {caught.value}".removeprefix("InputError: ")
    return said.replace("\n", "\n    ")


def check_messages(module):
    """Compare messages with the text of a module, given by its globals."""
    path = Path(module["__file__"]).with_suffix(".txt")
    text, names = path.read_text(encoding="utf-8"), {"np": np, "hs": hs, **module}
    found = [
        f"{expression}\n    {message(expression, names)}\n"
        for expression in re.findall(r"^\S.*", text, re.MULTILINE)
    ]
    if os.environ.get("HISTORYSIM_NEW_MESSAGES"):
        path.write_text("\n".join(found), encoding="utf-8")
    assert "\n".join(found) == path.read_text(encoding="utf-8")
