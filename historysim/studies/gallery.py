"""All pictures of a folder of scenarios on one page that opens anywhere."""

import ast
import functools
import itertools
import re
import runpy
import tempfile
from collections import Counter
from pathlib import Path

import attrs
import xarray as xr

from historysim.basics.files import is_file, replacing
from historysim.basics.wording import Notify, progress_bar, silent
from historysim.errors import InputError
from historysim.results.plots import pictures as plots
from historysim.results.report.page import Section, contents, page, paragraph, picture, table
from historysim.results.report.reports import history_pictures, sweep_pictures
from historysim.scenario.figure import draw_scenario_figure, drawable
from historysim.scenario.run import run
from historysim.scenario.scenario import Scenario, load
from historysim.studies.sweep import sweep
from historysim.studies.workers import map_in_order, open_executor
from historysim.verbs import plot

TITLE = "Gallery of scenarios"
SCENARIO, SCRIPT = ".toml", ".py"
# the line of a script that says that it may be carried out
EXAMPLE = "# historysim gallery: example"


def gallery(
    folder: str | Path = "scenarios",
    output: str | Path | None = None,
    *,
    workers: int = 1,
    scripts: bool = False,
    progress: bool = False,
    notify: Notify = silent,
) -> str:
    """Return the pictures of all scenarios in a folder, and in those below it, as one self-contained HTML page.

    Scenarios with ``[sweep]`` are swept, all others are run; ``[picture]`` selects their pictures.
    A scenario that fails is listed on the page with the reason, and the others are drawn. Hidden
    files and folders are left out.

    Parameters
    ----------
    folder : path
        Folder with scenarios (TOML) and scripts (Python).
    output : path, optional
        A file to write the page to, which appears when it is complete.
    workers : int
        As for `historysim.sweep`.
    scripts : bool
        Also run the scripts in the folder that contain the line ``# historysim gallery: example``,
        with the functions described in the README of this package. Scripts run with the rights of
        the user.
    progress : bool
        Show a progress bar if standard error is a terminal.
    notify : callable, optional
        Callback(str) for notices: failed scenarios and their reasons.

    Returns
    -------
    str
        The page.

    Raises
    ------
    InputError
        A folder without scenarios, or an invalid number of workers.
    OSError
        ``output`` cannot be written.
    """
    folder = Path(folder)
    paths = find_gallery_files(folder, scripts=scripts)
    if not paths:
        raise InputError(
            f"{folder}: holds no scenario; expected a folder that does, such as scenarios/ of historysim"
        )
    with (
        open_executor(workers) as (executor, count),
        progress_bar(progress, "file", len(paths), desc="drawing") as done,
    ):
        entries = map_in_order(
            functools.partial(_render_section, folder), paths, executor, count, done
        )
    titles = Counter(section.title for section, _ in entries)
    groups: dict[str, list[Section]] = {}
    for path, (section, failure) in zip(paths, entries, strict=True):
        if failure:
            notify(f"{path}: {failure}")
        title = f"{section.title} ({path.stem})" if titles[section.title] > 1 else section.title
        groups.setdefault(path.parent.as_posix(), []).append(attrs.evolve(section, title=title))
    text = page(
        TITLE, [contents(groups), *(section for group in groups.values() for section in group)]
    )
    if output is not None:
        with replacing(Path(output)) as unfinished:
            unfinished.write_text(text, encoding="utf-8")
    return text


def find_gallery_files(folder: Path, *, scripts: bool) -> list[Path]:
    """Return the scenarios of a folder and its subfolders, and the scripts among them that are marked as examples.

    Links to folders are not followed.
    """
    visible = (
        path
        for path in sorted(folder.rglob("*"))
        if not any(name[0] == "." for name in path.relative_to(folder).parts)
    )
    return [
        path
        for path in visible
        if is_file(path) and (path.suffix == SCENARIO or (scripts and _is_example(path)))
    ]


def _is_example(path: Path) -> bool:
    if path.suffix != SCRIPT:
        return False
    with path.open(encoding="utf-8", errors="replace") as stream:
        return any(line.strip() == EXAMPLE for line in stream)


def _render_section(folder: Path, path: Path) -> tuple[Section, str]:
    """Return a file of a folder as a section of the page, and why it has no picture; empty where it has."""
    name = path.relative_to(folder).as_posix()
    title, content, failure = name, [paragraph(name, "note")], ""
    try:
        title, texts, pictures = _render_script(path) if path.suffix == SCRIPT else _scenario(path)
        content += [paragraph(text) for text in texts] + pictures
    except Exception as error:  # noqa: BLE001 - one failure does not stop the others
        failure = (
            str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        )
        content.append(paragraph(f"No picture: {failure}", "warning"))
    return Section(title, tuple(content), anchor=name), failure


def _render_script(path: Path) -> tuple[str, list[str], list[str]]:
    """Return title, text and pictures of a script."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or path.name
    title, *texts = _paragraphs(text)
    functions = runpy.run_path(str(path))
    if functions.get("calculated") is None:
        raise InputError("has no function calculated; expected one that returns what is drawn")
    result = functions["calculated"]()
    if "drawn" not in functions and isinstance(result, xr.Dataset):
        pictures = sweep_pictures(result)
    else:
        figures = functions.get("drawn", plot)(result)
        pictures = [
            picture(figure, title)
            for figure in (figures if isinstance(figures, list | tuple) else [figures])
        ]
    if "rows" in functions:
        heading, *rows = functions["rows"](result)
        pictures.append(table(rows, heading))
    return title, texts, pictures


def _scenario(path: Path) -> tuple[str, list[str], list[str]]:
    """Return title, text and pictures of a scenario."""
    scenario = load(path)
    pictures = _figure(scenario)
    if scenario.sections.adhesion is not None:
        pictures = [
            picture(plot(scenario, picture="adhesion-map"), "Its asperities on the adhesion map."),
            *pictures,
        ]
    if scenario.sections.sweep is None:
        pictures += _run(scenario)
    elif not scenario.sections.picture or len(drawable(scenario)) < len(scenario.sections.picture):
        table = sweep(scenario)
        pictures += _figure(table) or sweep_pictures(table)
    # the comment that it begins with
    head = itertools.takewhile(lambda line: line.startswith("#"), scenario.text.splitlines())
    return (
        scenario.title or path.stem,
        _paragraphs("\n".join(line.removeprefix("#") for line in head)),
        pictures,
    )


def _figure(source: Scenario | xr.Dataset) -> list[str]:
    """Return the figure of ``[picture]`` with the pictures of a scenario, or those that only its result can show."""
    pictures = tuple(
        one
        for one in drawable(source)
        if isinstance(source, Scenario) or plots.SCENARIO not in one.of
    )
    if not pictures:
        return []
    title = source.title if isinstance(source, Scenario) else str(source.attrs.get("title", ""))
    return [picture(draw_scenario_figure(source, pictures), title)]


def _run(scenario: Scenario) -> list[str]:
    # the surface is stored in the file of the history
    with (
        tempfile.TemporaryDirectory() as folder,
        run(scenario, Path(folder) / "result.nc", notify=silent) as history,
    ):
        # one step has no course
        return _figure(history) or (history_pictures(history) if history.sizes["step"] > 1 else [])


def _paragraphs(text: str) -> list[str]:
    """Split a text at empty lines into paragraphs of one line each."""
    return [" ".join(block.split()) for block in re.split(r"\n\s*\n", text) if block.strip()]
