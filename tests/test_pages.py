"""The pages of the documentation: what stands in them runs, and they stand where they say."""

import re
import shutil
from pathlib import Path

import pages
import pytest

ROOT = Path(__file__).parents[1]
ROOM_PAGES = sorted(path for path in (ROOT / "historysim").glob("*/README.md") if path.parent.name != "memory")
PAGES = [*ROOM_PAGES, ROOT / "scenarios" / "README.md", ROOT / "historysim" / "README.md"]
PROSE = [*PAGES, ROOT / "README.md", ROOT / "tests" / "benchmarks" / "README.md", ROOT / ".github" / "CONTRIBUTING.md"]
LONGEST = 100


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def same(printed, shown):
    assert printed.strip() == shown.strip()


@pytest.fixture(scope="module")
def after_the_readme(tmp_path_factory):
    """The folder of somebody who has typed in the README."""
    folder = tmp_path_factory.mktemp("readme")
    for name in ("data", "scenarios"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("thesis", "tutorials", "*.py"))
    (folder / "more.csv").write_text("time,normal_load [mN]\n13,80\n14,60\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("historysim.cli.simulations.processors", lambda: 1)
        pages.type_in((ROOT / "README.md").read_text(encoding="utf-8"), same)
    return folder


def test_the_readme_runs_as_it_stands(after_the_readme):
    made = {path.name for path in after_the_readme.iterdir()}
    assert {"my.nc", "my.history", "my.png", "my_report.html", "my_fitted.toml", "history.png"} <= made


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_page_runs_as_it_stands(page, after_the_readme, tmp_path, monkeypatch):
    shutil.copytree(after_the_readme, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("historysim.cli.simulations.processors", lambda: 1)
    pages.type_in(page.read_text(encoding="utf-8"))


def test_the_readme_is_a_screen():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


@pytest.mark.parametrize("page", PROSE, ids=name_of)
def test_lines_of_prose_are_short(page):
    text = re.sub(r"^(```|\$\$).*?^\1$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    prose = [line for line in text.splitlines() if not line.lstrip().startswith(("|", "!["))]
    assert [line for line in prose if len(line) > LONGEST] == []
