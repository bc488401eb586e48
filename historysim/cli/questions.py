"""Commands that answer questions: table, of a result; kinds, of what scenarios may name."""

from pathlib import Path
from typing import Any

import click

from historysim.basics.targets import Output, check_outputs, unmarked
from historysim.basics.wording import nearest
from historysim.cli.options import force_option, json_option, path_type
from historysim.cli.output import TABLES_OF_QUESTIONS, Answer, save_dataset, tell
from historysim.errors import InputError

QUESTIONS = (
    "branch-drift",
    "critical-asperity",
    "cycle-drift",
    "drift",
    "energy-per-cycle",
    "first-slips",
    "friction-loops",
    "mean-pressure",
    "nominal-pressure",
    "peak-pressure",
    "point-maps",
    "positioning-error",
    "preliminary-displacement",
    "preliminary-displacements",
    "presliding-work",
    "profiles",
    "reversal-points",
    "run-drift",
    "seen-at-rest",
    "slides-first",
    "slip-shares",
    "stick-ratio",
    "summary",
    "tangential-stiffness",
    "telling-step",
    "time-series",
    "total-mean-pressure",
    "validity",
)
"""What a result answers with a table, as the methods of ``history.contact`` are called."""
VTU = unmarked("a mesh for ParaView", ".vtu")
AT_A_STEP = {"point-maps": "step", "profiles": "steps", "reversal-points": "step"}
"""Questions about a step, with the name of that parameter."""


class Question(click.ParamType):  # type: ignore[type-arg]
    """The name of a question."""

    name = "question"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name, with hyphens."""
        question = str(value).replace("_", "-")
        if question not in QUESTIONS:
            self.fail(f"{value!r} is no question; {nearest(question, QUESTIONS)}", param, ctx)
        return question

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:  # noqa: ARG002
        """Return the questions that begin so, for a shell that completes them."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(each) for each in QUESTIONS if each.startswith(incomplete)]


@click.command(epilog=f"The questions: {', '.join(QUESTIONS)}.")
@click.argument("result", type=path_type)
@click.argument("question", type=Question())
@click.option(
    "-o", "--output", type=path_type, help="The table (CSV, netCDF; VTU of point-maps). [default: RESULT_QUESTION.csv]"
)
@click.option("--asperity", type=int, help="The asperity, for profiles, reversal-points and time-series.")
@click.option("--step", type=int, help="The step, for point-maps, profiles and reversal-points. [default: the last]")
@click.option(
    "--with",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    help="Another parameter of the question, such as first=0; may be given several times.",
)
@json_option
@force_option
def table(
    result: Path,
    question: str,
    output: Path | None,
    asperity: int | None,
    step: int | None,
    parameters: tuple[str, ...],
    as_json: bool,
    force: bool,
) -> None:
    """Ask RESULT a QUESTION, and write the answer as a table.

    The questions are methods of history.contact in Python, where their documentation says what the columns are.
    """
    output = output or result.with_name(f"{result.stem}_{question}.csv")
    kinds = (VTU,) if question == "point-maps" and output.suffix.lower() == ".vtu" else TABLES_OF_QUESTIONS
    check_outputs([Output(output, kinds)], [result], force=force)
    given = dict(_parameter(text) for text in parameters)
    if asperity is not None:
        given["asperity"] = asperity
    if question in AT_A_STEP:
        given.setdefault(AT_A_STEP[question], -1 if step is None else step)
    elif step is not None:
        raise InputError(f"{question}: takes no --step")
    from historysim.results.answers import answer
    from historysim.results.result_files import open_result

    with open_result(result) as history:
        if question == "run-drift" and "second" in given:
            with open_result(Path(given["second"])) as other:
                given["second"] = other.load()
        dataset = answer(history, question.replace("-", "_"), given)
        if question == "profiles":
            # a row for each radius
            dataset = dataset.isel(step=0)
        if kinds == (VTU,):
            from historysim.results.point_maps import write_vtk

            write_vtk(dataset, output)
        else:
            save_dataset(dataset, output)
        tell(Answer(files=[output], data=lambda: dataset), as_json=as_json)


def _parameter(text: str) -> tuple[str, Any]:
    """Return name and value of a parameter: a number, or else a text."""
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
@json_option
def kinds(what: str | None, name: str | None, as_json: bool) -> None:
    """List the groups of kinds (laws, surfaces, …), the kinds of one group, WHAT, or the keys of one kind, NAME.

    A kind of another package has the package and its version behind it.
    """
    from historysim.scenario.kinds import kinds as listed

    tell(Answer(listed(what, name)), as_json=as_json)


COMMANDS = (table, kinds)
