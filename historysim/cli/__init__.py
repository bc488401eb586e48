"""The command line. Only click is imported here, so that ``--help`` answers at once."""

import click

from historysim._version import __version__
from historysim.cli import logs, pictures, questions, records, runs
from historysim.cli.ending import Commands


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Replay load histories across rough frictional contacts, exactly."""


for command in (*runs.COMMANDS, *logs.COMMANDS, *records.COMMANDS, *pictures.COMMANDS, *questions.COMMANDS):
    main.add_command(command)
