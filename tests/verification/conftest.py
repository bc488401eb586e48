"""The verification page: each test here is a case of it, writes its section, and compares it with the page.

`python -m pytest tests/verification --page` writes the page and its pictures anew, with the slow
cases.
"""

import inspect
import itertools
import pprint
import re
import textwrap
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from matplotlib.figure import Figure

FOLDER = Path(__file__).parent
PAGE = FOLDER / "README.md"
GROUPS = {
    "test_one_asperity": "One asperity",
    "test_histories": "Any history of loads",
    "test_adhesion": "Adhesion",
    "test_rough": "Rough surfaces",
    "test_interaction": "Asperities that press on one another",
    "test_evolving": "Asperities that yield, wear and change their friction",
    "test_directions": "Two tangential directions",
    "test_measured": "Experiments and measured records",
    "test_exchange": "In other programs",
}
HEAD = """# Verification

Each case compares what the package calculates with a number that does not come from it: a closed
form, a brute force that shares no code with it, another program, a paper, or an experiment. Every
number is asserted by a test, and this page is written by these tests:

```sh
python -m pytest tests/verification --page    # all cases; writes this page and its pictures
python -m pytest tests/verification           # the quick cases; compares them with this page
```

The lines of Python are those that run; the test below them has what is made for them elsewhere.
They begin with

```python
import numpy as np
import historysim as hs
```

An error is the largest difference over the quantity in the column "of". Its bound is known
beforehand, for the stated reason. "Rounding" is that of numbers of 16 digits along the way.
Brute forces and other helpers are in `tests/support`.

"""
NUMBERS = slice(1, 4)  # columns of a table that hold numbers: expected, found, error
MOST_NUMBERS, MOST_CHARACTERS = 8, 700  # of an argument that is shown whole
WRITTEN, FAILED = pytest.StashKey(), pytest.StashKey()


class Row(NamedTuple):
    """One compared quantity."""

    name: str
    expected: float
    found: float
    error: float
    of: str
    bound: float
    why: str

    def cells(self):
        bound = f"{self.bound:.2g}, {self.why}"
        return [
            self.name,
            f"{self.expected:.6g}",
            f"{self.found:.6g}",
            f"{self.error:.0e}",
            self.of,
            bound,
        ]


class Case:
    """A case of the page, as its test makes it.

    The docstring of the test is its title, then paragraphs in Markdown: one says with what it is
    compared ("Compared with **…**") and one where the model ends ("The model ends where …").
    """

    def __init__(self, item):
        title, _, text = inspect.cleandoc(item.function.__doc__).partition("\n")
        self.name, self.title, self.text = item.name.removeprefix("test_"), title, text.strip()
        self.place = f"{item.path.name}::{item.name}"
        assert "Compared with **" in self.text, (
            f"{item.name}: its docstring does not say with what it is compared"
        )
        assert "The model ends " in self.text, (
            f"{item.name}: its docstring does not say where the model ends"
        )
        self.code, self.rows, self.drawn = "", [], None

    def shows(self, function, *arguments):
        """Run a function, and show its body on the page as what the reader types; arguments are helpers of the test."""
        body = textwrap.dedent("".join(inspect.getsourcelines(function)[0][1:]))
        given = zip(inspect.signature(function).parameters, arguments, strict=True)
        self.code = "\n".join(
            [
                *(given_as(*one) for one in given),
                re.sub(r"^return .*\n", "", body, flags=re.MULTILINE).rstrip(),
            ]
        )
        return function(*arguments)

    def row(self, name, expected, found, bound, why="rounding", *, of="itself", scale=None):
        """Compare numbers, or arrays at their place of the largest difference, over a scale [in their unit]."""
        expected, found = (
            each.ravel() for each in np.broadcast_arrays(*map(np.asarray, (expected, found)))
        )
        scale = np.abs(expected).max() if scale is None else scale
        off = np.abs(found - expected) / scale
        worst = int(np.argmax(off)) if off.max() > bound / 10 else int(np.argmax(np.abs(expected)))
        row = Row(
            name, float(expected[worst]), float(found[worst]), float(off.max()), of, bound, why
        )
        assert np.all(np.isfinite([*expected, *found])), f"{self.name}: {name} is not finite"
        assert row.error <= bound, (
            f"{self.name}: {name} is {row.error:.2g} of {of} off, more than {bound:g}"
        )
        self.rows.append((row, scale))

    def picture(self, draw):
        """Register a function that draws the picture of the case on axes; labels get a legend."""

        def drawn(axes):
            draw(axes)
            if axes.get_legend() is None and axes.get_legend_handles_labels()[1]:
                axes.legend()

        self.drawn = drawn

    def section(self):
        """The section of the page."""
        assert self.code, f"{self.name}: no input is shown"
        assert self.rows, f"{self.name}: nothing is compared"
        head = ["quantity", "expected", "found", "error", "of", "bound"]
        table = [head, ["---"] * len(head), *(row.cells() for row, _ in self.rows)]
        lines = ["| " + " | ".join(cells) + " |" for cells in table]
        # a line that began with % would be a comment of the site
        words = [
            textwrap.fill(each.replace(" %", "\u00a0%"), 100, break_long_words=False).replace(
                "\u00a0", " "
            )
            for each in self.text.split("\n\n")
        ]
        picture = f"![{self.title}](pictures/{self.name}.png)"
        code, place = f"```python\n{self.code}\n```", f"(`{self.place}`)"
        return "\n\n".join(
            [f"### {self.title}", *words[:-1], code, place, "\n".join(lines), picture, words[-1]]
        )

    def compare(self, page):
        """Check that the page has the section, with the same words and code, and with these numbers to their digits."""
        again = "run python -m pytest tests/verification --page"
        found = re.search(
            rf"^### {re.escape(self.title)}\n.*?(?=^##|\Z)", page, re.MULTILINE | re.DOTALL
        )
        assert found, f"{self.title} is not on the page; {again}"
        shown, own = found[0].strip(), self.section()
        assert blanked(shown) == blanked(own), again
        for (row, scale), cells in zip(self.rows, rows_of(shown), strict=True):
            # six digits are printed, and another processor rounds otherwise
            near = min(2 * row.bound, 1e-3) * scale + 1e-5 * abs(row.expected)
            assert float(cells[0]) == pytest.approx(row.expected, abs=near), f"{row.name}: {again}"
            assert float(cells[1]) == pytest.approx(row.found, abs=near), f"{row.name}: {again}"
            assert float(cells[2]) <= 1.5 * row.bound, f"{row.name}: {again}"
        assert (FOLDER / "pictures" / f"{self.name}.png").is_file(), again


def given_as(name, value):
    """What the reader is told of an argument: its value, where it is short, else what it is."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, np.ndarray) and value.size <= MOST_NUMBERS:
        return f"{name} = np.array({value.tolist()})"
    if (
        isinstance(value, str | float | int | tuple | list | dict)
        and len(repr(value)) <= MOST_CHARACTERS
    ):
        return f"{name} = {pprint.pformat(value, width=90, sort_dicts=False)}"
    size = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
    return f"# {name}: {'an array' if size else 'made'}{size} by the test"


def rows_of(section):
    """The numbers of each row of the table of a section."""
    rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return [row[NUMBERS] for row in rows[2:]]


def blanked(section):
    """A section without the numbers of its table, and with those of its code as far as any processor has them."""
    lines = []
    for line in re.sub(r"\d+\.\d{12,}", lambda long: f"{float(long[0]):.9g}", section).splitlines():
        cells = line.split(" | ")
        if line.startswith("| ") and "---" not in line:
            cells[NUMBERS] = ["", "", ""]
        lines.append(" | ".join(cells))
    return "\n".join(lines)


def pytest_addoption(parser):
    parser.addoption(
        "--page", action="store_true", help="write the verification page and its pictures anew"
    )


def pytest_configure(config):
    config.stash[WRITTEN] = {}
    if config.getoption("page", default=False):
        if config.getoption("numprocesses", None):
            raise pytest.UsageError("--page writes one page; expected no -n")
        config.option.markexpr = ""


@pytest.fixture(autouse=True)
def nothing_is_kept(monkeypatch, tmp_path):
    monkeypatch.setenv("HISTORYSIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def page(request):
    """The case that a test makes; at its end it is written, or compared with the page."""
    case = Case(request.node)
    yield case
    if case.drawn is not None:
        # the picture shows its data, as every figure of a test
        case.drawn(Figure().add_subplot())
    if request.node.stash.get(FAILED, True):
        return
    if not request.config.getoption("page", default=False):
        case.compare(PAGE.read_text(encoding="utf-8"))
        return
    group = GROUPS[request.node.path.stem]
    request.config.stash[WRITTEN].setdefault(group, {})[case.title] = case.section()
    draw_picture(case)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if call.when == "call":
        item.stash[FAILED] = report.failed or report.skipped
    return report


def draw_picture(case):
    """Draw a case, small."""
    import matplotlib as mpl

    with mpl.rc_context({"font.size": 8, "lines.linewidth": 1.2, "legend.frameon": False}):
        figure = Figure(figsize=(3.6, 2.4), layout="constrained")
        case.drawn(figure.add_subplot())
        (FOLDER / "pictures").mkdir(exist_ok=True)
        figure.savefig(FOLDER / "pictures" / f"{case.name}.png", dpi=110)


def pytest_sessionfinish(session, exitstatus):
    written = session.config.stash[WRITTEN]
    if not written or exitstatus:
        return
    # cases skipped for lack of another program stay unchanged
    before = PAGE.read_text(encoding="utf-8") if PAGE.is_file() else ""
    for group, text in re.findall(
        r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", before, re.MULTILINE | re.DOTALL
    ):
        for section in re.findall(r"^### .*?(?=^### |\Z)", text, re.MULTILINE | re.DOTALL):
            title = section[4:].split("\n", 1)[0]
            if group in written and title in skipped(session):
                written[group].setdefault(title, section.strip())
    PAGE.write_text(HEAD + contents(written) + body(written), encoding="utf-8")


def skipped(session):
    return {
        inspect.cleandoc(item.function.__doc__).split("\n")[0]
        for item in session.items
        if item.stash.get(FAILED, True)
    }


def contents(written):
    """A table of all cases, with the error of each that is nearest to its bound."""
    lines = ["| case | compared with | error | bound |", "| --- | --- | --- | --- |"]
    for title, section in itertools.chain.from_iterable(
        group.items() for group in ordered(written).values()
    ):
        against = re.search(r"Compared with \*\*(.*?)\*\*", section.replace("\n", " "))[1]
        rows = [
            line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")
        ][2:]
        *_, error, of, bound = max(
            rows, key=lambda row: float(row[3]) / (float(row[5].split(",")[0]) or 1)
        )
        anchor = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        lines.append(f"| [{title}](#{anchor}) | {against} | {error} of {of} | {bound} |")
    return "\n".join(lines) + "\n"


def body(written):
    return "".join(
        f"\n## {group}\n\n" + "\n\n".join(cases.values()) + "\n"
        for group, cases in ordered(written).items()
    )


def ordered(written):
    return {group: written[group] for group in GROUPS.values() if group in written}
