"""Commands for any file: show, plot, report, explore, gallery, table, cycles, kinds."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.files import replacing
from historysim.basics.targets import PAGE, PICTURE, OutputFormat, csv_table, netcdf
from historysim.basics.wording import nearest, shell_word
from historysim.cli import options
from historysim.cli.output import check_outputs, notice, save, save_table, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.results.queries import Query
    from historysim.scenario.scenario import Scenario


class PictureOption(click.Option):
    """Option whose help lists the pictures, which are imported only for that."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help."""
        from historysim.scenario.kinds import registries

        pictures = registries()["plots"]

        def names(content: str) -> str:
            return ", ".join(name for name, kind in pictures.items() if content in kind.of)

        of_several = " or ".join(name for name, kind in pictures.items() if kind.accepts_several)
        self.help = (
            f"Of a result: {names('history')}; of several: {of_several}; of a sweep: loops, or a summary value; of a "
            f"scenario: {names('scenario')}. `historysim kinds plots NAME` lists the options of one."
        )
        return super().get_help_record(ctx)


# Arguments of `hs.plot` that select content and target; they are not options of a picture.
NO_OPTIONS = {"what", "name", "picture", "place", "size", "figure", "ax"}


def _height_map_options(command: Any) -> Any:
    """Add the arguments of `read_surface`, and the form that is removed."""
    missing = {
        "multiple": True,
        "type": str,
        "help": "Number that marks missing points in the file; may be repeated.",
    }
    pixel_size = {
        "multiple": True,
        "help": 'Spacing of the points, as "0.5 µm", if the file has none; twice for x and y.',
    }
    command = options.from_function("verbs:show", "form")(command)
    return options.from_function(
        "surfaces.reading:read_surface",
        *("pixel_size", "height_unit", "lateral_unit", "missing", "channel"),
        missing=missing,
        pixel_size=pixel_size,
    )(command)


several_files = click.argument(
    "files", type=options.path_type, nargs=-1, required=True, metavar="FILE…"
)


@click.command()
@several_files
@options.flag("--attributes", help="Also print the attributes of a result: digests, versions.")
@options.common("json", "set")
@_height_map_options
def show(
    files: tuple[Path, ...], attributes: bool, values: dict[str, Any], **height_map: object
) -> None:
    """Summarise FILE: a scenario, result, log, sweep or height map.

    Also tables written by `loops -o` and `sliding -o`. Of two height maps of one area, before and
    after, the lost material.
    """
    from historysim.verbs import show as summarise

    content = _load_first(files, values) if len(files) == 1 or values else list(files)
    write_answer(summarise(content, attributes=attributes, **_reading(height_map)))


@click.command()
@several_files
@options.output_option("The picture (PNG, PDF, SVG). [default: FILE's name with .png]")
@click.option("--picture", cls=PictureOption)
@click.option("--step", help="Draw a result at this step: a number, a name, partial or peak.")
@options.with_option(
    "OPTION=VALUE", "An option of the picture, as steps=A,B; may be given several times."
)
@options.common("size", "force", "set")
@_height_map_options
def plot(
    files: tuple[Path, ...],
    output: Path | None,
    picture: str | None,
    step: str | None,
    choices: dict[str, Any],
    size: tuple[float, float] | None,
    values: dict[str, Any],
    **height_map: Any,
) -> None:
    """Draw FILE, or several results in one picture.

    A result: [picture] of its scenario, or the friction loop, the loads, and the slip states of the
    asperities; with --step the surface, its summits in contact coloured by their slip state; other
    pictures by name. Several results: their friction loops in one diagram. A scenario or a height
    map: the surface with its summits; with the name of a picture of results the result of a run.
    Two height maps of one area: the lost material. Friction loops: their changes from loop to loop.
    Friction over time or distance: this curve. A sweep: a summary value over the swept keys.
    """
    file = files[0]
    if wrong := NO_OPTIONS & choices.keys():
        raise InputError(
            f"--with: {min(wrong)} is not an option of a picture; see `historysim kinds plots`"
        )
    choices = {name.replace("-", "_"): value for name, value in choices.items()}
    if step is not None:
        choices.setdefault("step", step)
    from historysim.results.result_files import file_type

    kind = file_type(file)
    if output is None:
        # pictures of results are written next to them, others to the current folder
        folder = file.parent if kind in {"result", "loops", "sliding", "sweep"} else Path()
        surface = "step" in choices or kind in {"scenario", "height map"}
        map_name = "before-after" if len(files) > 1 else "surface"
        name = picture or (map_name if surface else "")
        output = folder / f"{file.stem}{'_' if name else ''}{name}.png"
    if kind == "log":
        raise InputError(
            f"{file}: is a log; expected its result; historysim run {shell_word(file)} recomputes it"
        )
    source = _load_first(files, values)
    check_outputs([*options.list_inputs(source), *files], (output, PICTURE))
    from historysim.verbs import plot as draw

    content = source if len(files) == 1 else list(files)
    save(draw(content, picture=picture, size=size, **choices, **_reading(height_map)), output)
    click.echo(output)


@click.command()
@options.common("file")
@options.output_option("The page (HTML). [default: FILE's name with _report.html]")
@options.common("force")
def report(file: Path, output: Path | None) -> None:
    """Write a report of FILE, one HTML page that opens anywhere.

    A result: summary, validity, pictures, provenance, and an interactive time slider for the loop
    and the contact map. A sweep; a table of `loops -o`, `loops --levels` or `sliding -o`; a
    scenario with measured loading, which is fitted or compared.
    """
    output = output or file.with_name(f"{file.stem}_report.html")
    check_outputs(options.list_inputs(file), (output, PAGE))
    from historysim.verbs import report as write_report

    write_report(file, output)
    click.echo(output)


@click.command()
@options.common("file")
@options.output_option("The page (HTML). [default: FILE's name with _explore.html]")
@options.common("force")
def explore(file: Path, output: Path | None) -> None:
    """Write the interactive part of the report of FILE, a result.

    A time slider for the friction loop and the contact map; selectable asperities; variable
    friction and moduli.
    """
    output = output or file.with_name(f"{file.stem}_explore.html")
    check_outputs([file], (output, PAGE))
    from historysim.verbs import explore as explore_history

    page = explore_history(file).page
    with replacing(output) as unfinished:
        unfinished.write_text(page, encoding="utf-8")
    click.echo(output)


@click.command()
@click.argument("folder", type=options.path_type, default="scenarios")
@options.output_option("The page (HTML).", default="gallery.html", show_default=True)
@options.common("workers", "quiet")
@options.flag(
    "--scripts",
    help="Also run the Python scripts in FOLDER that are marked as examples. Only run code that you trust.",
)
@options.common("force")
def gallery(folder: Path, output: Path, workers: int, scripts: bool) -> None:
    """Run all scenarios in FOLDER and draw them on one HTML page.

    Scenarios with [sweep] are swept; hidden files and folders are skipped. FOLDER is "scenarios" by
    default. Scripts are run only with --scripts, and only if they contain the line "# historysim
    gallery: example".
    """
    from historysim.studies import gallery as verb

    files = check_outputs(verb.find_gallery_files(folder, scripts=scripts), (output, PAGE))
    progress = not options.has_flag("quiet")
    verb.gallery(folder, output, workers=workers, scripts=scripts, progress=progress, notify=notice)
    write_answer(files=files)


def _load_first(files: tuple[Path, ...], values: dict[str, Any]) -> "Scenario | Path":
    """Return the first file, or its scenario with replaced values."""
    if len(files) > 1 and values:
        raise InputError("--set: applies to one scenario; expected one FILE")
    return options.load_if_changed(files[0], values)


def _reading(height_map: dict[str, object]) -> dict[str, Any]:
    """Return the options of a height map that are set, as arguments of `read_surface`."""
    reading: dict[str, Any] = {
        name: value for name, value in height_map.items() if value not in {None, ()}
    }
    if "pixel_size" in reading:
        sizes = reading["pixel_size"]
        if len(sizes) > 2:
            raise InputError(
                f"--pixel-size given {len(sizes)} times; expected it once, or twice for x and y"
            )
        reading["pixel_size"] = sizes[0], sizes[-1]
    if reading.get("channel", "").isdecimal():
        reading["channel"] = int(reading["channel"])
    return reading


class QueryName(click.ParamType):  # type: ignore[type-arg]
    """Name of a query, with hyphens or underscores."""

    name = "query"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """Return the name of the query in Python."""
        from historysim.results.queries import earlier_names

        tables, name = _tables(), str(value).replace("-", "_")
        name = earlier_names().get(name, name)
        if name not in tables:
            hint = nearest(
                name.replace("_", "-"), [table_name.replace("_", "-") for table_name in tables]
            )
            self.fail(f"{value!r} is not a query; {hint}", param, ctx)
        return name

    def shell_complete(
        self,
        ctx: click.Context,  # noqa: ARG002 - as click calls it
        param: click.Parameter,  # noqa: ARG002 - as click calls it
        incomplete: str,
    ) -> list[Any]:
        """Return the queries with this beginning, for shell completion."""
        from click.shell_completion import CompletionItem

        names = (name.replace("_", "-") for name in _tables())
        return [CompletionItem(name) for name in names if name.startswith(incomplete)]


class TableCommand(click.Command):
    """Command whose help lists the queries, which are imported only for that."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as click calls it
        """Write each query with the first line of its documentation."""
        with formatter.section("Queries"):
            formatter.write_dl(
                [(name.replace("_", "-"), query.text) for name, query in _tables().items()]
            )


def _tables() -> "dict[str, Query]":
    """Return the queries whose result is a table."""
    from historysim.results.queries import all_queries

    return {name: query for name, query in all_queries().items() if query.table is not None}


@click.command(cls=TableCommand)
@click.argument("result", type=options.path_type)
@click.argument("query", type=QueryName())
@options.output_option("The table (CSV, netCDF). [default: RESULT_QUERY.csv]")
@click.option("--asperity", type=int, help="Label of the asperity, for a query of one asperity.")
@click.option("--step", help="Step by number or name, for a query of one step. [default: the last]")
@options.with_option(
    "NAME=VALUE", "Another parameter of the query, such as first=0; may be given several times."
)
@options.common("json", "force")
def table(
    result: Path,
    query: str,
    output: Path | None,
    asperity: int | None,
    step: str | None,
    choices: dict[str, str],
) -> None:
    """Compute a QUERY from RESULT and write CSV or netCDF.

    In Python the queries are methods of history.contact; their documentation describes the columns.
    """
    table_query, label = _tables()[query], query.replace("_", "-")
    output = output or result.with_name(f"{result.stem}_{label}.csv")
    check_outputs([result], (output, *_outputs()))
    arguments = {name: _number(value) for name, value in choices.items()}
    if asperity is not None:
        arguments["asperity"] = asperity
    if table_query.step:
        arguments.setdefault(table_query.step, -1 if step is None else step)
    elif step is not None:
        raise InputError(f"{label}: has no --step")
    if query == "time_series" and asperity is None and output.suffix.lower() == ".csv":
        # the columns of all asperities do not fit into a spreadsheet
        arguments.setdefault("form", "totals")
    from historysim.results.accessor import evaluate_query
    from historysim.results.result_files import open_result

    with open_result(result) as history:
        if query == "run_drift" and "second" in arguments:
            with open_result(Path(arguments["second"])) as second:
                arguments["second"] = second.load()
        dataset = evaluate_query(history, query, arguments)
        if query == "profiles":
            # one row per radius
            dataset = dataset.isel(step=0)
        outputs = [(output, lambda: save_table(dataset, output))]
        write_answer(data=lambda: dataset, outputs=outputs)


@click.command()
@options.common("file")
@click.option(
    "--asperity", type=int, help="Label of the asperity. [default: the contact as a whole]"
)
@options.output_option("Also write the table to this file (.nc, .csv).")
@options.common("json", "force")
def cycles(file: Path, asperity: int | None, output: Path | None) -> None:
    """List the closed loops and the residue of FILE, a result or a log.

    Each row is an excursion of the tangential load, also at a varying normal load, with the time at
    which it is forgotten and the energy that it has dissipated.
    """
    files = check_outputs([file], (output, *_outputs()))
    from historysim.basics.units import duration_text, quantity_text
    from historysim.log.event_log import EventLog
    from historysim.results.accessor import evaluate_query
    from historysim.results.analysis.cycle_counting import count_cycles
    from historysim.results.result_files import file_type, open_result

    if file_type(file) == "log":
        with EventLog(file) as log:
            counted = count_cycles(log.job(), asperity)
    else:
        with open_result(file) as history:
            counted = evaluate_query(history, "cycles", {"asperity": asperity})
    if output is not None:
        save_table(counted, output)
    units = {
        "tangential_displacement_range": "m",
        "tangential_load_range": "N",
        "dissipated_energy": "J",
    }
    rows: list[tuple[str, ...]] = [
        ("start", "reversal", "end", "range of U", "range of T", "energy", "")
    ]
    for _, row in counted.to_dataframe().iterrows():
        start, reversal, end = (
            "remembered" if row[name] != row[name] else duration_text(float(row[name]))
            for name in ("start_time", "reversal_time", "end_time")
        )
        numbers = [quantity_text(float(row[name]), unit) for name, unit in units.items()]
        rows.append((start, reversal, end, *numbers, "closed" if row["closed"] else "residue"))
    closed = int(counted["closed"].sum())
    energy = quantity_text(float(counted["dissipated_energy"].sum()), "J")
    lines = [
        ("closed loops", f"{closed:,}"),
        ("residue", f"{counted.sizes['cycle'] - closed:,}"),
        ("dissipated energy", energy),
    ]
    write_answer(lines, [rows], files, data=lambda: counted)


def _outputs() -> tuple[OutputFormat, ...]:
    """Return the formats of tables of queries."""
    headers = (header for query in _tables().values() for header in query.headers())
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
@click.argument("group", required=False)
@click.argument("name", required=False)
@options.common("json")
def kinds(group: str | None, name: str | None) -> None:
    """List laws, surfaces and other kinds, and their keys.

    Without arguments the groups of kinds, with GROUP the kinds of one group, with NAME the keys of
    one kind. Kinds from plug-ins are listed with package and version.
    """
    from historysim.scenario.kinds import kinds as list_kinds

    write_answer(list_kinds(group, name))
