"""The pages of the documentation: contents runs, and they stand where they say."""

import ast
import inspect
import re
import shutil
from functools import lru_cache
from pathlib import Path

import pages
import pytest
import tomlkit
from pytest import mark

import historysim as hs

ROOT = Path(__file__).parents[1]
ROOM_PAGES = sorted(
    path for path in (ROOT / "historysim").glob("*/README.md") if path.parent.name != "memory"
)
KEYS = ROOT / "scenarios" / "keys.md"
PAGES = [*ROOM_PAGES, ROOT / "scenarios" / "README.md", ROOT / "historysim" / "README.md"]
WRITTEN = (
    path
    for folder in ("data", "historysim", "scenarios", "tests")
    for path in (ROOT / folder).rglob("*.md")
)
PROSE = [
    *sorted(path for path in WRITTEN if path != KEYS),
    *(ROOT / name for name in ("README.md", "CHANGELOG.md", ".github/CONTRIBUTING.md")),
]
LONGEST = 100


def test_the_loop_of_the_architecture_is_the_loop_of_the_code():
    """A schedule of events, and a loop whose lines are those of `Replay.walk`, in their order."""
    page = (ROOT / "historysim" / "README.md").read_text(encoding="utf-8")
    block = next(body for _, language, body in pages.blocks(page) if language == "text")
    first, *loop = (line.strip() for line in block.strip().splitlines())
    source = [line.strip() for line in inspect.getsource(hs.Replay.walk).splitlines()]
    assert first.startswith("plan = schedule.paths(")
    assert "plan = schedule.paths(" in source
    assert [line for line in source if line in loop] == loop


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def same(printed, shown):
    assert printed.strip() == shown.strip()


@pytest.fixture(scope="module")
def after_the_readme(tmp_path_factory):
    """The folder of somebody who has typed in the README."""
    folder = tmp_path_factory.mktemp("readme")
    for name in ("data", "scenarios"):
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("thesis", "tutorials", "*.py")
        )
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("historysim.basics.system.processors", lambda: 1)
        pages.type_in((ROOT / "README.md").read_text(encoding="utf-8"), same)
    return folder


def test_the_readme_runs_unchanged(after_the_readme):
    made = {path.name for path in after_the_readme.iterdir()}
    assert {
        "my.nc",
        "my.history",
        "my.png",
        "my_report.html",
        "my_fitted.toml",
        "history.png",
    } <= made


@mark.ci
@mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_runs_unchanged(page, after_the_readme, tmp_path, monkeypatch):
    shutil.copytree(after_the_readme, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("historysim.basics.system.processors", lambda: 1)
    monkeypatch.setattr("historysim.exchange.fmu.unit_file.compile_unit", lambda *_: b"")
    pages.type_in(page.read_text(encoding="utf-8"))


def test_the_readme_is_a_screen():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


@mark.parametrize("page", PROSE, ids=name_of)
def test_lines_of_prose_are_short(page):
    text = re.sub(
        r"^(```|\$\$).*?^\1$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    prose = [line for line in text.splitlines() if not re.match(r"\s*(\||!\[)|    ", line)]
    assert [line for line in prose if len(line) > LONGEST] == []
    # comments of MyST, which the site leaves out
    assert [line for line in prose if line.startswith("%")] == []


BASE = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
waypoints = [
    { time = 0, normal_load = "50 mN", tangential_displacement = 0 },
    { time = 1, tangential_displacement = "10 nm" },
]
"""


@mark.parametrize(
    "example", [body for _, _, body in pages.blocks(KEYS.read_text(encoding="utf-8"))]
)
def test_an_example_of_a_key_is_valid_in_a_scenario(example, tmp_path):
    (tmp_path / "data").symlink_to(ROOT / "data")
    if not example.startswith("["):
        example = f'[materials]\nfirst = "silicon"\n{example}'
    path = tmp_path / "example.toml"
    path.write_text(
        tomlkit.dumps({**tomlkit.parse(BASE), **tomlkit.parse(example)}), encoding="utf-8"
    )
    if "[fit]" not in example:
        # a fit needs a record
        hs.validate(path)
    assert hs.load(path).events()


# Documented modules that are not attributes of `historysim`: fields of extensions, the core for
# compiled callers.
DOCUMENTED = {
    f"historysim.{name}"
    for name in (
        *("asperities.running_in", "basics.fields", "basics.library", "results.queries"),
        # base classes of extensions
        *("results.plots.chart", "results.plots.pictures", "tables.readers"),
    )
}
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in (ROOT / "historysim").rglob("*.py")
}
SCRIPTS = sorted((ROOT / "scenarios").rglob("*.py"))
# pages of the tests import helpers of the tests
FOR_USERS = [path for path in (*PROSE, *SCRIPTS) if ROOT / "tests" not in path.parents]


@lru_cache
def public_modules(module=hs):
    """The names of the modules that users reach from `historysim` by public attributes."""
    parts = [getattr(module, name) for name in getattr(module, "__all__", ())]
    spaces = [
        part for part in parts if inspect.ismodule(part) and part.__name__.startswith("historysim.")
    ]
    return {module.__name__}.union(*map(public_modules, spaces))


def imported_modules(code):
    """The modules of the package that Python code imports: in `from a import b`, b where that is a module, else a."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (part if part in MODULES else node.module for part in parts)


@mark.parametrize("page", FOR_USERS, ids=name_of)
def test_pages_and_scripts_import_public_modules_alone(page):
    text = page.read_text(encoding="utf-8")
    blocks = (
        [text]
        if page.suffix == ".py"
        else re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    )
    imported = {
        name
        for block in blocks
        for name in imported_modules(block)
        if name.startswith("historysim")
    }
    assert imported - public_modules() - DOCUMENTED == set()


def test_sources_named_in_the_theory_have_an_entry():
    text, literature = (
        (ROOT / "historysim/contact/README.md").read_text(encoding="utf-8").split("## Literature")
    )
    named = re.findall(r"([A-Z]\w+)(?: and ([A-Z]\w+))?(?:'s \w+ | )\(?((?:18|19|20)\d\d)\b", text)
    assert len(named) > 6
    for first, second, year in named:
        entries = [
            entry for entry in re.split(r"(?<=\))\.|(?<=\d)\. ", literature) if first in entry
        ]
        assert any(year in entry and second in entry for entry in entries), (first, second, year)


def test_the_site_has_a_heading_for_the_tutorials():
    contents = (ROOT / ".site" / "contents.md").read_text(encoding="utf-8")
    trees = re.findall(r"```{toctree}\n:caption: (.*?)\n(.*?)```", contents, re.DOTALL)
    (tutorials,) = (tree for caption, tree in trees if caption == "Tutorials")
    files = sorted(path.stem for path in (ROOT / "scenarios" / "tutorials").glob("*.md"))
    assert re.findall(r"<scenarios/tutorials/(.*)>", tutorials) == files
    assert contents.count("scenarios/tutorials/") == len(files)


def test_symbols_of_keys_keep_their_case():
    """A meaning may begin with a symbol, ν or c/a, whose capital is another symbol."""
    cells = [
        line.split(" | ")[-1]
        for line in KEYS.read_text(encoding="utf-8").splitlines()
        if line.startswith("| ")
    ]
    assert [cell for cell in cells if re.match(r"[Α-Ω]|[A-Z]\w?(/\w+)? \[", cell)] == []
    assert any(cell.startswith("ν [1]") for cell in cells)


def test_every_key_has_a_description():
    lines = KEYS.read_text(encoding="utf-8").splitlines()
    rows = [
        line
        for line in lines
        if line.startswith(("| `", "| **`")) and not line.startswith("| `law` | keys |")
    ]
    assert len(rows) > 200
    assert [row for row in rows if row.split(" | ")[-1].strip(" |") == ""] == []
