"""Commands that replay a scenario: run, validate."""

from pathlib import Path
from typing import Any

import click

from historysim.cli.arguments import check_target, path_type, scenario_or_file, set_option
from historysim.cli.output import notice, print_lines, save


@click.command()
@click.argument("scenario", type=path_type)
@click.option("-o", "--output", type=path_type, help="The result (netCDF). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing.")
@click.option("--resume", is_flag=True, help="Go on where an earlier run was ended, from its log.")
@click.option(
    "--snapshot-every",
    type=click.IntRange(1),
    metavar="STEPS",
    help="Steps that a crash costs at most. [default: some seconds of replay]",
)
@click.option("--compression", type=click.Choice(["none", "zlib", "zstd"]), default="none", show_default=True)
@set_option
def run(
    scenario: Path,
    values: dict[str, Any],
    output: Path | None,
    with_picture: bool,
    quiet: bool,
    resume: bool,
    snapshot_every: int | None,
    compression: str,
) -> None:
    """Replay SCENARIO (TOML), or the log of a run, and write the history to a netCDF file.

    The log, NAME.history, stands beside the result from the beginning.
    """
    output = output or Path(f"{scenario.stem}.nc")
    check_target(output, scenario)
    check_target(output.with_suffix(".history"), *([] if scenario.suffix == ".history" else [scenario, output]))
    picture = output.with_suffix(".png")
    if with_picture:
        check_target(picture, scenario, output)
    from historysim.results import analysis
    from historysim.results.plots.history import plot_history
    from historysim.scenario.run import run as carry_out

    with carry_out(
        scenario_or_file(scenario, values),
        output,
        progress=not quiet,
        resume=resume,
        snapshot_every=snapshot_every,
        compression=compression,
        tell=notice,
    ) as history:
        if with_picture:
            save(plot_history(history), picture)
        lines = [*analysis.summary(history), ("result", str(output))]
    if not quiet:
        print_lines([*lines, ("picture", str(picture))] if with_picture else lines)


@click.command()
@click.argument("scenario", type=path_type)
@set_option
def validate(scenario: Path, values: dict[str, Any]) -> None:
    """Check SCENARIO (TOML) and the files that it names, without running it."""
    from historysim.scenario.scenario import load
    from historysim.scenario.summary import summary

    print_lines(summary(load(scenario, values)))
    click.echo("valid")


COMMANDS = (run, validate)
