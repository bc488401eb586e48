"""Build the documentation site into ``build/site``: ``python .site/build.py``.

Prose is in READMEs of the folders that it describes. They are laid out as in the repository, so
that links between them are the same here and there; the pages of this folder, and those that are
made from the package, are next to them. Nothing is fetched, and what comes out needs no network.
"""

import argparse
import posixpath
import re
import sys
from pathlib import Path

from sphinx.cmd.build import build_main

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import gallery
import interface
import try_it

ROOT = HERE.parent
FOLDERS = ("data", "historysim", "scenarios", "tests")
COPIED = {".md", ".png", ".toml", ".py", ".csv", ".c", ".h", ".cff"}
"""Endings of the files that pages consist of or link to."""
MOVED = {"README.md": "index.md", ".github/CONTRIBUTING.md": "contributing.md"}
"""Pages that stand elsewhere on the site: its first one, and one whose folder has a dot."""
LINK = re.compile(r"\]\(([^)#:\s]+)")


def files() -> list[Path]:
    """Return the files of the repository that the site has."""
    found = [
        ROOT / name
        for name in ("README.md", "CHANGELOG.md", "CITATION.cff", ".github/CONTRIBUTING.md")
    ]
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            hidden = any(
                part.startswith((".", "__pycache__")) for part in path.relative_to(ROOT).parts
            )
            if path.suffix in COPIED and path.is_file() and not hidden:
                found.append(path)
    return found


def relinked(name: str, text: str) -> str:
    """Return a page with links that lead to the places of the site."""

    def led(link: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join(posixpath.dirname(name), link[1]))
        return "](" + posixpath.relpath(
            MOVED.get(target, target), posixpath.dirname(MOVED.get(name, name)) or "."
        )

    return LINK.sub(led, text)


def pages(pictures: Path) -> dict[str, bytes]:
    """Return all that the site is made of, by its path."""
    found = {}
    for path in files():
        name = path.relative_to(ROOT).as_posix()
        content = path.read_bytes()
        found[MOVED.get(name, name)] = (
            relinked(name, content.decode()).encode() if path.suffix == ".md" else content
        )
    found["index.md"] += b"\n" + (HERE / "contents.md").read_bytes()
    found["try_it.md"] = (HERE / "try_it.md").read_bytes()
    made = interface.pages() | gallery.pages(ROOT, pictures)
    return found | {name: text.encode() for name, text in made.items()}


def lay_out(source: Path, pictures: Path) -> None:
    """Bring the pages together; one that has not changed keeps its time, so that Sphinx does not read it again."""
    found = pages(pictures)
    for path in source.rglob("*"):
        if (
            path.is_file()
            and path.relative_to(source).as_posix() not in found
            and ".doctrees" not in path.parts
        ):
            path.unlink()
    for name, content in found.items():
        path = source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)


def main() -> int:
    """Build the site, and return the exit code."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "site")
    parser.add_argument(
        "--no-pictures", action="store_true", help="draw no gallery, which takes some minutes"
    )
    parser.add_argument("--workers", type=int, default=2, help="processes that draw the gallery")
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    source = output.with_name(f"{output.name}-source")
    pictures = output.with_name(f"{output.name}-pictures.html")
    if not arguments.no_pictures:
        gallery.draw(ROOT, pictures, arguments.workers, progress=not arguments.quiet)
    lay_out(source, pictures)
    # Sphinx shows which share of the pages it has read and written: for those who watch
    quiet = [] if sys.stderr.isatty() and not arguments.quiet else ["-q"]
    options = [*quiet, "-W", "--keep-going", "-c", str(HERE), "-d", str(source / ".doctrees")]
    code = build_main([*options, str(source), str(output)])
    if not code:
        (output / "_static" / "try_it.html").write_text(try_it.render(), encoding="utf-8")
        sys.stdout.write(f"{output / 'index.html'}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
