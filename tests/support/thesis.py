"""What the tests of the thesis share: its files, what they give, and its page, which repeats the numbers.

With HISTORYSIM_PAGE=write in the environment the page takes what the tests find, in place of being
compared with it.
"""

import os
import re
import runpy
from functools import lru_cache
from pathlib import Path

import historysim as hs

FOLDER = Path(__file__).parents[2] / "scenarios" / "thesis"
PAGE = FOLDER / "README.md"
NANO = 1e9


def scenario(name):
    """The one file of a figure by the beginning of its name."""
    (path,) = FOLDER.glob(f"{name}*.toml")
    return path


@lru_cache
def _sweep(path):
    return hs.sweep(hs.load(path))


def swept(name):
    """Return the sweep of a file."""
    return _sweep(scenario(name))


@lru_cache
def _calculate(path):
    functions = runpy.run_path(str(path))
    return functions["calculated"](), functions


def calculated(name):
    """Return the result of a script, and its functions."""
    (path,) = FOLDER.glob(f"{name}*.py")
    return _calculate(path)


def listed(values, digits=0):
    """Numbers as the page has them: 1.2, 3.4, 5.6."""
    return ", ".join(f"{float(each):.{digits}f}" for each in values)


def repeats(row, gives, agrees=None):
    """The row of the page says what the model gives, and maybe in how far the source agrees, in these words."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    found = [number for number, line in enumerate(lines) if line.startswith(f"| {row} |")]
    assert len(found) == 1, f"{row}: {len(found)} rows of the page begin so"
    number = found[0]
    heading = max(n for n, line in enumerate(lines[:number]) if line.startswith("| --- ")) - 1
    names = lines[heading].strip("|").split("|")
    column = next(
        n for n, name in enumerate(names) if name.strip() in {"the model gives", "what it changes"}
    )
    cells = lines[number].split(" | ")
    wanted = cells[:]
    wanted[column] = _short(gives) + " |" * (column == len(cells) - 1)
    if agrees is not None:
        wanted[-1] = f"{_short(agrees)} |"
    if os.environ.get("HISTORYSIM_PAGE") == "write":
        lines[number] = " | ".join(wanted)
        PAGE.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return
    assert cells == wanted, (
        f"{row}: run HISTORYSIM_PAGE=write pytest {Path(__file__).parents[1].name}/test_thesis*.py"
    )


def _short(words):
    """Numbers without the zero before their point, as the page has them."""
    return re.sub(r"(?<![\d.])0(?=\.\d)", "", words)
