"""Commands that look at files, and ask them: show, plot, report, gallery, table, kinds."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.targets import PAGE, PICTURE, OutputFormat, csv_table, netcdf
from historysim.basics.wording import nearest, shell_word
from historysim.cli import options
from historysim.cli.output import check_outputs, notice, save, save_table, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.results.asking import Question
    from historysim.scenario.scenario import Scenario


class PictureOption(click.Option):
    """Names the pictures where help is asked for, and not before: they stand in modules that draw."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help."""
        from historysim.scenario.kinds import registries

        pictures = registries()["plots"]

        def names(of: str) -> str:
            return ", ".join(name for name, kind in pictures.items() if of in kind.of)

        several = " or ".join(name for name, kind in pictures.items() if kind.accepts_several)
        self.help = (
            f"Of a result: {names('history')}; of several: {several}; of a sweep: loops, or which number; of a "
            f"scenario: {names('scenario')}. `historysim kinds plots NAME` lists the options of one."
        )
        return super().get_help_record(ctx)


# Options of pictures that stand by themselves; all of them may be given by --with.
SHORT = {
    "steps": "Of loops and traction: states by number or name, as K,L,120.",
    "across": "What a traction is drawn over: radius or diameter.",
    "labels": "Of loops and traction: names of the lines, with commas between.",
    "step": "Draw the contact map of a result at this step: a number, partial or peak.",
    "asperity": "Of traction: which asperity.",
    "panels": "Of the picture history: some of loop,loads,states,energy.",
}
# What the file of a height map does not say.
HEIGHT_MAP = {
    "pixel-size": 'As "0.5 µm", if it has none; twice for x and y.',
    "height-unit": "Unit of its heights, if it names none.",
    "lateral-unit": "Unit of its coordinates, if it has some without.",
    "missing": "Number of the file that stands for missing points; once for each.",
    "channel": "Channel of a height map, by its number from 0 or its name.",
    "form": "What to take off a height map first. [default: plane]",
}
# Arguments of `hs.plot` that say what is drawn and where: the command has them itself, or Python alone.
NO_OPTIONS = {"what", "name", "picture", "place", "size", "figure", "ax"}


def _options(texts: dict[str, str]) -> Callable[[Any], Any]:
    """Give a command options by their names, each with its help."""

    def add(command: Any) -> Any:
        for name, text in reversed(texts.items()):
            command = click.option(f"--{name}", multiple=name in {"pixel-size", "missing"}, help=text)(command)
        return command

    return add


several_files = click.argument("files", type=options.path_type, nargs=-1, required=True, metavar="FILE…")


@click.command()
@several_files
@click.option("-v", "--verbose", is_flag=True, help="Of a result: also its attributes, digests and versions.")
@options.shared("json", "set")
@_options(HEIGHT_MAP)
def show(files: tuple[Path, ...], verbose: bool, values: dict[str, Any], **height_map: object) -> None:
    """Summarise FILE: a scenario, result, log, sweep or height map.

    Also what `loops -o` and `sliding -o` have written. Two height maps of one place, before and after: what was lost
    between them.
    """
    from historysim.verbs import show as shown

    what = _one(files, values) if len(files) == 1 or values else list(files)
    write_answer(shown(what, attributes=verbose, **_given(height_map)))


@click.command()
@several_files
@options.output_option("The picture (PNG, PDF, SVG). [default: FILE's name with .png]")
@click.option("--picture", cls=PictureOption)
@options.with_option("OPTION=VALUE", "An option of the picture.")
@_options(SHORT)
@click.option("--adhesion", is_flag=True, help="Draw the adhesion map of a scenario, with asperities of it.")
@options.shared("size", "force", "set")
@_options(HEIGHT_MAP)
def plot(
    files: tuple[Path, ...],
    output: Path | None,
    picture: str | None,
    choices: dict[str, Any],
    adhesion: bool,
    size: tuple[float, float] | None,
    values: dict[str, Any],
    **others: Any,
) -> None:
    """Draw FILE, or several results in one picture.

    A result: what [picture] of its scenario says, or the friction loop, the loads, and the slip state of the
    asperities; with --step the surface, its summits in contact coloured by their slip state; other pictures by name.
    Several results: their friction loops over one another. A scenario or a height map: the surface with its
    summits, and with the name of a picture of results what a run of it gives; two height maps of one place: what was
    lost between them. Friction loops: how they change from one to the
    next. Friction over time or distance: that. A sweep: a number over what was swept.
    """
    file = files[0]
    if wrong := NO_OPTIONS & choices.keys():
        raise InputError(f"--with: {min(wrong)} is not an option of a picture; see `historysim kinds plots`")
    choices = {name.replace("-", "_"): value for name, value in choices.items()}
    choices = {name: others.pop(name) for name in SHORT} | choices | {"adhesion": adhesion or None}
    choices = {name: value for name, value in choices.items() if value is not None}
    from historysim.results.result_files import kind_of

    kind = kind_of(file)
    if output is None:
        # pictures of results stand beside them, others here
        folder = file.parent if kind in {"result", "loops", "sliding", "sweep"} else Path()
        surface = "step" in choices or kind in {"scenario", "height map"}
        map_name = "before-after" if len(files) > 1 else "surface"
        name = picture or ("adhesion" if "adhesion" in choices else map_name if surface else "")
        output = folder / f"{file.stem}{'_' if name else ''}{name}.png"
    if kind == "log":
        raise InputError(f"{file}: is a log; expected its result; historysim run {shell_word(file)} recomputes it")
    one = _one(files, values)
    check_outputs([*options.files_read(one), *files], (output, PICTURE))
    from historysim.verbs import plot as draw

    what = one if len(files) == 1 else list(files)
    save(draw(what, picture=picture, size=size, **choices, **_given(others)), output)
    click.echo(output)


@click.command()
@options.shared("file")
@options.output_option("The page (HTML). [default: FILE's name with _report.html]")
@options.shared("force")
def report(file: Path, output: Path | None) -> None:
    """Write a report of FILE, one HTML page that opens anywhere.

    A result: summary, validity, pictures, provenance, and an interactive time slider for the loop and the contact
    map. A sweep; what `loops -o`, `loops --levels` and `sliding -o` have written; a scenario with measured loading,
    which is fitted or compared.
    """
    output = output or file.with_name(f"{file.stem}_report.html")
    check_outputs(options.files_read(file), (output, PAGE))
    from historysim.verbs import report as written

    written(file, output)
    click.echo(output)


@click.command()
@click.argument("folder", type=options.path_type, default="scenarios")
@options.output_option("The page (HTML).", default="gallery.html", show_default=True)
@options.shared("workers", "quiet")
@click.option(
    "--scripts",
    is_flag=True,
    help="Also run the Python scripts in FOLDER that are marked as examples. Run only code of people you trust.",
)
@options.shared("force")
def gallery(folder: Path, output: Path, workers: int, scripts: bool) -> None:
    """Run all scenarios in FOLDER and draw them on one HTML page.

    Scenarios with [sweep] are swept; hidden files and folders are left out. FOLDER is "scenarios" where none is named,
    as in the repository. Scripts are run with --scripts only, and only those that hold the line "# historysim gallery:
    example".
    """
    from historysim.studies.gallery import find_gallery_files
    from historysim.studies.gallery import gallery as written

    files = check_outputs(find_gallery_files(folder, scripts=scripts), (output, PAGE))
    progress = not options.given("quiet")
    written(folder, output, workers=workers, scripts=scripts, progress=progress, notify=notice)
    write_answer(files=files)


def _one(files: tuple[Path, ...], values: dict[str, Any]) -> "Scenario | Path":
    """Return the first file, or its scenario with other values."""
    if len(files) > 1 and values:
        raise InputError("--set: belongs to one scenario; expected one FILE")
    return options.scenario_or_file(files[0], values)


def _given(height_map: dict[str, object]) -> dict[str, Any]:
    """Return the given options of a height map, as `read_surface` takes them."""
    given: dict[str, Any] = {name: value for name, value in height_map.items() if value not in {None, ()}}
    if "pixel_size" in given:
        sizes = given["pixel_size"]
        if len(sizes) > 2:
            raise InputError(f"--pixel-size given {len(sizes)} times; expected it once, or twice for x and y")
        given["pixel_size"] = sizes[0], sizes[-1]
    if given.get("channel", "").isdecimal():
        given["channel"] = int(given["channel"])
    return given


class QuestionName(click.ParamType):  # type: ignore[type-arg]
    """The name of a question, with hyphens or underscores."""

    name = "question"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name as it is in Python."""
        from historysim.results.asking import earlier_names

        known, name = _tables(), str(value).replace("-", "_")
        name = earlier_names().get(name, name)
        if name not in known:
            hint = nearest(name.replace("_", "-"), [each.replace("_", "-") for each in known])
            self.fail(f"{value!r} is no question; {hint}", param, ctx)
        return name

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002 - as click calls it
        """Return the questions that begin so, for a shell that completes them."""
        from click.shell_completion import CompletionItem

        names = (each.replace("_", "-") for each in _tables())
        return [CompletionItem(each) for each in names if each.startswith(incomplete)]


class TableCommand(click.Command):
    """Its help lists the questions, which are imported for it alone."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as click calls it
        """Write each question with the first line of its documentation."""
        with formatter.section("Questions"):
            formatter.write_dl([(name.replace("_", "-"), each.text) for name, each in _tables().items()])


def _tables() -> "dict[str, Question]":
    """Return the questions with a table as answer."""
    from historysim.results.asking import questions

    return {name: each for name, each in questions().items() if each.table is not None}


@click.command(cls=TableCommand)
@click.argument("result", type=options.path_type)
@click.argument("question", type=QuestionName())
@options.output_option("The table (CSV, netCDF). [default: RESULT_QUESTION.csv]")
@click.option("--asperity", type=int, help="The asperity, for a question about one.")
@click.option("--step", help="The step, by number or name, for a question about one. [default: the last]")
@options.with_option("NAME=VALUE", "Another parameter of the question, such as first=0; may be given several times.")
@options.shared("json", "force")
def table(
    result: Path,
    question: str,
    output: Path | None,
    asperity: int | None,
    step: str | None,
    choices: dict[str, str],
) -> None:
    """Compute a QUESTION from RESULT and write CSV or netCDF.

    In Python the questions are methods of history.contact; their documentation describes the columns.
    """
    asks, shown = _tables()[question], question.replace("_", "-")
    output = output or result.with_name(f"{result.stem}_{shown}.csv")
    files = check_outputs([result], (output, *_outputs()))
    given = {name: _number(value) for name, value in choices.items()}
    if asperity is not None:
        given["asperity"] = asperity
    if asks.step:
        given.setdefault(asks.step, -1 if step is None else step)
    elif step is not None:
        raise InputError(f"{shown}: takes no --step")
    if question == "time_series" and asperity is None and output.suffix.lower() == ".csv":
        # a spreadsheet has no room for the columns of all asperities
        given.setdefault("form", "totals")
    from historysim.results.accessor import answer
    from historysim.results.result_files import open_result

    with open_result(result) as history:
        if question == "run_drift" and "second" in given:
            with open_result(Path(given["second"])) as other:
                given["second"] = other.load()
        dataset = answer(history, question, given)
        if question == "profiles":
            # a row for each radius
            dataset = dataset.isel(step=0)
        save_table(dataset, output)
        write_answer(files=files, data=lambda: dataset)


def _outputs() -> tuple[OutputFormat, ...]:
    """Return the forms of tables of questions."""
    headers = (header for each in _tables().values() for header in each.headers())
    form = "a table of historysim"
    return netcdf(form, "table", "history over time"), csv_table(form, *headers)


def _number(value: str) -> Any:
    """Return a number, or else the string."""
    for kind in (int, float):
        try:
            return kind(value)
        except ValueError:
            continue
    return value


@click.command()
@click.argument("what", required=False)
@click.argument("name", required=False)
@options.shared("json")
def kinds(what: str | None, name: str | None) -> None:
    """List laws, surfaces and other kinds, and their keys.

    Without arguments the groups of kinds, with WHAT the kinds of one group, with NAME the keys of one kind. Kinds
    from plug-ins are listed with package and version.
    """
    from historysim.scenario.kinds import kinds as listed

    write_answer(listed(what, name))
