"""The page of the gallery: every scenario with what it shows, and its picture, drawn by the package itself."""

import re
from pathlib import Path

from historysim import gallery
from historysim.studies.gallery import find_gallery_files

SECTION = re.compile(
    # the name of the file, which the page links to, is left out
    r'<section id="([^"]+)"><h2>(.*?)</h2>\n(?:<p class="note">.*?</p>)?(.*?)</section>',
    re.DOTALL,
)


def is_up_to_date(page: Path, root: Path) -> bool:
    """Return whether nothing of which the pictures are made has changed since."""
    made_of = (path for folder in ("scenarios", "data", "historysim") for path in (root / folder).rglob("*.*"))
    newest = max(path.stat().st_mtime for path in made_of if "__pycache__" not in path.parts)
    return page.exists() and page.stat().st_mtime >= newest


def draw(root: Path, page: Path, workers: int, *, progress: bool) -> None:
    """Write the pictures of all scenarios to one page, which takes some minutes, if they are not up to date."""
    if not is_up_to_date(page, root):
        page.parent.mkdir(parents=True, exist_ok=True)
        gallery(root / "scenarios", page, workers=workers, scripts=True, progress=progress)


def _sections(text: str) -> dict[str, tuple[str, str]]:
    """Return the title and the HTML of each section of the page, by its anchor; it has to have some."""
    found = {anchor: (title, parts) for anchor, title, parts in SECTION.findall(text)}
    if not found:
        raise SystemExit("the page of the gallery has no sections as .site/gallery.py expects them; mend SECTION")
    return found


def pages(root: Path, drawn: Path) -> dict[str, str]:
    """Return the pages by their names; where nothing is drawn, they name the scenarios alone."""
    folder = root / "scenarios"
    found = _sections(drawn.read_text(encoding="utf-8")) if drawn.exists() else {}
    parts: dict[str, list[str]] = {}
    for path in find_gallery_files(folder, scripts=True):
        name = path.relative_to(folder).as_posix()
        title, body = found.get(name, (path.stem, "<p>Not drawn.</p>"))
        group = parts.setdefault(name.rpartition("/")[0] or "scenarios", [])
        group += [f"## {title}", f"[{name}](../scenarios/{name})", f"```{{raw}} html\n{body}\n```"]
    made = {"gallery.md": "# Gallery\n\n```{toctree}\n" + "\n".join(f"gallery/{group}" for group in parts) + "\n```\n"}
    titles = {"scenarios": "Scenarios", "thesis": "Figures of the thesis"}
    return made | {
        f"gallery/{group}.md": f"# {titles.get(group, group)}\n\n" + "\n\n".join(texts) + "\n"
        for group, texts in parts.items()
    }
