"""Command for the certified load histories."""

from pathlib import Path

import click

from historysim.cli import options
from historysim.cli.output import write_answer


@click.command()
@click.argument("folder", type=options.path_type, metavar="DIR")
@options.common("json")
def reference(folder: Path) -> None:
    """Write the certified load histories to DIR.

    They check other contact laws. DIR is a new or empty folder. It gets the cases with their
    answers and bounds, score.py, which scores the results of any code with numpy alone, and
    README.md.
    """
    from historysim.exchange.certified import write_reference

    files = write_reference(folder)
    cases = [path for path in files if path.suffix == ".yaml"]
    write_answer([("cases", str(len(cases))), ("folder", str(folder))])
