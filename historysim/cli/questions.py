"""Commands that answer questions: table, about a result; kinds, about what scenarios may name."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.basics.targets import OutputFormat, csv_table, netcdf, unmarked
from historysim.basics.wording import nearest
from historysim.cli import options
from historysim.cli.output import check_outputs, save_table, write_answer
from historysim.errors import InputError

if TYPE_CHECKING:
    from historysim.results.asking import Question

VTU = unmarked("a mesh for ParaView", ".vtu")


class QuestionName(click.ParamType):  # type: ignore[type-arg]
    """The name of a question, with hyphens or underscores."""

    name = "question"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name as it is in Python."""
        known, name = _tables(), str(value).replace("-", "_")
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
@options.output_option("The table (CSV, netCDF; VTU of point-maps). [default: RESULT_QUESTION.csv]")
@click.option("--asperity", type=int, help="The asperity, for a question about one.")
@click.option("--step", type=int, help="The step, for a question about one. [default: the last]")
@click.option(
    "--with",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    help="Another parameter of the question, such as first=0; may be given several times.",
)
@options.shared("json", "force")
def table(
    result: Path,
    question: str,
    output: Path | None,
    asperity: int | None,
    step: int | None,
    parameters: tuple[str, ...],
) -> None:
    """Compute a QUESTION from RESULT and write CSV or netCDF.

    In Python the questions are methods of history.contact; their documentation describes the columns.
    """
    asks, shown = _tables()[question], question.replace("_", "-")
    output = output or result.with_name(f"{result.stem}_{shown}.csv")
    mesh = question == "point_maps" and output.suffix.lower() == ".vtu"
    files = check_outputs([result], (output, VTU) if mesh else (output, *_outputs()))
    given = dict(_parameter(text) for text in parameters)
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
        if mesh:
            from historysim.results.rebuilt import write_vtk

            write_vtk(dataset, output)
        else:
            save_table(dataset, output)
        write_answer(files=files, data=lambda: dataset)


def _outputs() -> tuple[OutputFormat, ...]:
    """Return the forms of tables of questions."""
    headers = (header for each in _tables().values() for header in each.headers())
    form = "a table of historysim"
    return netcdf(form, "table", "history over time"), csv_table(form, *headers)


def _parameter(text: str) -> tuple[str, Any]:
    """Return name and value of a parameter: a number, or else a string."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise InputError(f"--with {text!r}: expected NAME=VALUE, such as first=0")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


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
