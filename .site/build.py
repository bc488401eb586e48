"""Build the documentation site into ``build/site``: ``python .site/build.py``.

Prose stands in READMEs in the folders that it is about. They are laid out as they stand in the repository, so that
links between them are the same here and there; the pages of this folder, and those that are made from the package,
stand above them. Nothing is fetched, and what comes out needs no network.
"""

import argparse
import shutil
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import interface
import keys
import scenarios_page

ROOT = HERE.parent
FOLDERS = ("data", "historysim", "scenarios", "tests")
COPIED = {".md", ".png", ".toml", ".py", ".csv", ".c", ".h"}
"""Endings of the files that pages consist of or link to."""


def files() -> list[Path]:
    """Return the files of the repository that the site has."""
    found = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE")]
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            hidden = any(part.startswith((".", "_")) for part in path.relative_to(ROOT).parts[:-1])
            if path.suffix in COPIED and path.is_file() and not hidden:
                found.append(path)
    return found


def lay_out(source: Path) -> None:
    """Bring the pages together; a file that has not changed keeps its time, so that Sphinx reads it once."""
    pages = {
        **{path.relative_to(ROOT): path.read_bytes() for path in files()},
        **{Path(path.name): path.read_bytes() for path in HERE.glob("*.md")},
        Path("contributing.md"): (ROOT / ".github" / "CONTRIBUTING.md").read_bytes(),
        **{Path(name): text.encode() for name, text in (keys.pages() | interface.pages() | scenarios_page.pages(ROOT)).items()},
    }
    for path in sorted(source.rglob("*"), reverse=True):
        if path.is_file() and path.relative_to(source) not in pages:
            path.unlink()
    for name, content in pages.items():
        path = source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)


def main() -> int:
    """Build the site, and return the exit code."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "site")
    parser.add_argument("--no-gallery", action="store_true", help="leave out the pictures, which take some minutes")
    parser.add_argument("--workers", type=int, default=2, help="processes that draw the gallery")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    source = output.with_name(output.name + "-source")
    lay_out(source)
    if not arguments.no_gallery:
        scenarios_page.draw(ROOT / "scenarios", output / "pictures.html", arguments.workers)
    return build_main(["-q", "-W", "--keep-going", "-c", str(HERE), "-d", str(source / ".doctrees"), str(source), str(output)])


if __name__ == "__main__":
    sys.exit(main())
