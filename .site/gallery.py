"""The page of the gallery: every scenario with what it shows, and its picture, drawn by the package itself."""

import base64
import io
import re
from html import escape
from pathlib import Path

from PIL import Image

from historysim import gallery
from historysim.studies.gallery import find_gallery_files

SECTION = re.compile(
    # the name of the file, which the page links to, is left out
    r'<section id="([^"]+)"><h2>(.*?)</h2>\n(?:<p class="note">.*?</p>)?(.*?)</section>',
    re.DOTALL,
)
IMAGE = re.compile(r'<img[^>]* src="data:image/\w+;base64,([^"]+)"')
THUMBNAIL = (300, 260)  # points


def is_up_to_date(page: Path, root: Path) -> bool:
    """Return whether nothing of which the pictures are made has changed since."""
    made_of = (
        path
        for folder in ("scenarios", "data", "historysim")
        for path in (root / folder).rglob("*.*")
    )
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
        raise SystemExit(
            "the page of the gallery has no sections as .site/gallery.py expects them; mend SECTION"
        )
    return found


def _thumbnail(link: str, title: str, body: str) -> str:
    """Return a link to a section: its first picture, reduced, above its title."""
    image = ""
    if found := IMAGE.search(body):
        stream = io.BytesIO()
        with Image.open(io.BytesIO(base64.b64decode(found[1]))) as picture:
            picture.thumbnail(THUMBNAIL)
            picture.save(stream, "webp")
        data = base64.b64encode(stream.getvalue()).decode("ascii")
        image = f'<img src="data:image/webp;base64,{data}" alt="">'
    return f'<a href="{link}">{image}<span>{title}</span></a>'


def pages(root: Path, drawn: Path) -> dict[str, str]:
    """Return the pages by their names; where nothing is drawn, they name the scenarios alone."""
    folder = root / "scenarios"
    found = _sections(drawn.read_text(encoding="utf-8")) if drawn.exists() else {}
    titles = {"scenarios": "Scenarios", "thesis": "Figures of the thesis"}
    parts: dict[str, list[str]] = {}
    thumbnails: dict[str, list[str]] = {}
    for path in find_gallery_files(folder, scripts=True):
        name = path.relative_to(folder).as_posix()
        title, body = found.get(name, (escape(path.stem), "<p>Not drawn.</p>"))
        folder_name = name.rpartition("/")[0] or "scenarios"
        label = f"scenario-{re.sub('[^a-z0-9]+', '-', path.name.lower())}"
        thumbnails.setdefault(folder_name, []).append(
            _thumbnail(f"gallery/{folder_name}.html#{label}", title, body)
        )
        group = parts.setdefault(folder_name, [])
        group += [
            f"({label})=\n## {title}",
            f"[{name}](../scenarios/{name})",
            f"```{{raw}} html\n{body}\n```",
        ]
    overview = ["# Gallery"]
    for group, links in thumbnails.items():
        grid = '<div class="thumbnails">' + "\n".join(links) + "</div>"
        overview += [f"## {titles.get(group, group)}", f"```{{raw}} html\n{grid}\n```"]
    tree = "\n".join(f"gallery/{group}" for group in parts)
    made = {"gallery.md": "\n\n".join([*overview, f"```{{toctree}}\n:hidden:\n{tree}\n```\n"])}
    return made | {
        f"gallery/{group}.md": f"# {titles.get(group, group)}\n\n" + "\n\n".join(texts) + "\n"
        for group, texts in parts.items()
    }
