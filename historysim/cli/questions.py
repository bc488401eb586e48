"""Commands that answer questions: table, of a result; kinds, of what scenarios may name."""

from pathlib import Path

import click

from historysim.basics.targets import Output, check_outputs
from historysim.cli.options import force_option, path_type
from historysim.cli.output import TABLES_OF_QUESTIONS, print_lines, save_dataset
from historysim.errors import InputError

TABLES = (
    "critical_asperity",
    "energy_per_cycle",
    "first_slips",
    "mean_pressure",
    "peak_pressure",
    "preliminary_displacement",
    "preliminary_displacements",
    "presliding_work",
    "profiles",
    "reversal_points",
    "slip_shares",
    "stick_ratio",
    "tangential_stiffness",
    "time_series",
    "total_mean_pressure",
)
"""Questions whose answer is a table, by the names that they have in Python."""
OF_AN_ASPERITY = ("profiles", "reversal_points")
PERHAPS_OF_ONE = ("time_series",)


@click.command()
@click.argument("result", type=path_type)
@click.argument("question", type=click.Choice([name.replace("_", "-") for name in TABLES]))
@click.option("-o", "--output", type=path_type, help="The table (CSV, netCDF). [default: RESULT_QUESTION.csv]")
@click.option("--asperity", type=int, help="Of profiles, reversal-points and time-series: whose.")
@click.option("--step", type=int, help="Of profiles and reversal-points: at which step. [default: the last]")
@force_option
def table(
    result: Path, question: str, output: Path | None, asperity: int | None, step: int | None, force: bool
) -> None:
    """Ask RESULT a QUESTION, and write the answer as a table.

    The questions are methods of history.contact in Python, where their documentation says what the columns are.
    """
    output = output or result.with_name(f"{result.stem}_{question}.csv")
    check_outputs([Output(output, TABLES_OF_QUESTIONS)], [result], force=force)
    name = question.replace("-", "_")
    if name in OF_AN_ASPERITY and asperity is None:
        raise InputError(f"{question}: is of one asperity; expected --asperity")
    if step is not None and name not in OF_AN_ASPERITY:
        raise InputError(f"{question}: takes no --step")
    if asperity is not None and name not in OF_AN_ASPERITY + PERHAPS_OF_ONE:
        raise InputError(f"{question}: takes no --asperity")
    of_one = {} if asperity is None else {"asperity": asperity}
    if name in OF_AN_ASPERITY:
        # both have a parameter of another name for it
        of_one["steps" if name == "profiles" else "step"] = -1 if step is None else step
    import xarray as xr

    from historysim.results.accessor import Questions
    from historysim.results.result_files import open_result

    with open_result(result) as history:
        asked = getattr(Questions(history), name)
        answer = asked(**of_one)
        if name == "profiles":
            # a row for each radius
            answer = answer.isel(step=0)
        save_dataset(answer.to_dataset(name=name) if isinstance(answer, xr.DataArray) else answer, output)
    click.echo(output)


@click.command()
@click.argument("what", required=False)
@click.argument("name", required=False)
def kinds(what: str | None, name: str | None) -> None:
    """Say which kinds of laws, surfaces, … there are, the NAMEs of one kind, WHAT, or the keys of one of them.

    Those of other packages have the package and its version behind them.
    """
    from historysim.scenario.kinds import kinds as told

    print_lines(told(what, name))


COMMANDS = (table, kinds)
