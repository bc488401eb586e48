"""The command line; the module of a command is imported when it is used."""

import click

from historysim._version import __version__
from historysim.cli.exit_codes import Commands

# Printed if no command is given.
INTRODUCTION = """\
Replay load histories across rough frictional contacts, exactly.

  a scenario (TOML)      historysim run my.toml
  a measured record      historysim columns record.csv -o my.toml
  a height map           historysim show map.txt
  a result (netCDF)      historysim show my.nc, historysim plot my.nc, historysim report my.nc

historysim --help lists all commands, and historysim COMMAND --help the options of one."""


@click.group(
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 the loads cannot be carried out, 2 bad input, 130 interrupted.",
)
@click.version_option(__version__)
@click.option("-v", "--verbose", count=True, help="Log progress to stderr; -vv for details.")
@click.pass_context
def main(context: click.Context, verbose: int) -> None:
    """Replay load histories across rough frictional contacts, exactly."""
    if context.invoked_subcommand is None:
        click.echo(INTRODUCTION)
    if verbose:
        import logging

        logging.basicConfig(format="%(asctime)s %(name)s: %(message)s", datefmt="%H:%M:%S")
        logging.getLogger("historysim").setLevel(logging.INFO if verbose == 1 else logging.DEBUG)
