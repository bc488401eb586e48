"""The command line. Only click is imported here, so that ``--help`` answers at once."""

import os
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim._version import __version__
from historysim.errors import HistorySimError, InputError

if TYPE_CHECKING:
    import xarray as xr

NETCDF_BEGINNINGS = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")


class NotPossible(click.ClickException):
    """What was asked for cannot be carried out."""

    exit_code = 1


class BadInput(click.ClickException):
    """What was given cannot be used."""

    exit_code = 2


class Interrupted(click.ClickException):
    """The user has stopped the program."""

    exit_code = 130


class Commands(click.Group):
    """Commands whose errors end as one message and an exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise BadInput(str(error)) from error
        except HistorySimError as error:
            raise NotPossible(str(error)) from error
        except BrokenPipeError:
            raise
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            raise NotPossible(f"{place}{error.strerror or error}") from error
        except MemoryError as error:
            raise NotPossible("the memory does not suffice; record fewer asperities, or split the loads") from error
        except KeyboardInterrupt as error:
            raise Interrupted("interrupted") from error


path_type = click.Path(path_type=Path)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
def main() -> None:
    """Replay load histories across rough frictional contacts, exactly."""


@main.command()
@click.argument("scenario", type=path_type)
@click.option("-o", "--output", type=path_type, help="The result (netCDF). [default: SCENARIO's name with .nc, here]")
@click.option("--plot", "with_picture", is_flag=True, help="Also draw the result, beside it.")
@click.option("-q", "--quiet", is_flag=True, help="Print nothing.")
def run(scenario: Path, output: Path | None, with_picture: bool, quiet: bool) -> None:
    """Replay SCENARIO (TOML) and write the history to a netCDF file."""
    output = output or Path(f"{scenario.stem}.nc")
    _check_target(output, scenario)
    picture = output.with_suffix(".png")
    if with_picture:
        _check_target(picture, scenario, output)
    from historysim import analysis, simulation

    with simulation.run(scenario, output, progress=not quiet) as history:
        if with_picture:
            _draw(history, picture)
        lines = [*analysis.summary(history), ("result", str(output))]
    if not quiet:
        _print_lines([*lines, ("picture", str(picture))] if with_picture else lines)


@main.command()
@click.argument("scenario", type=path_type)
def validate(scenario: Path) -> None:
    """Check SCENARIO (TOML) and the files that it names, without running it."""
    _print_lines(_scenario_lines(scenario))
    click.echo("valid")


@main.command()
@click.argument("file", type=path_type)
def show(file: Path) -> None:
    """Say in a few lines what FILE, a scenario or a result, holds."""
    if not _is_netcdf(file):
        if file.is_file() and file.suffix != ".toml":
            raise InputError(
                f"{file}: is not a netCDF file, nor named .toml; expected a scenario or a result of historysim run"
            )
        _print_lines(_scenario_lines(file))
        return
    from historysim import analysis

    with _opened(file) as history:
        _print_lines(analysis.summary(history))
        click.echo()
        one_line = {key: str(value) for key, value in history.attrs.items() if "\n" not in str(value).strip()}
        _print_lines(one_line.items())


@main.command()
@click.argument("result", type=path_type)
@click.option("-o", "--output", type=path_type, help="The picture (PNG, PDF, SVG). [default: RESULT with .png]")
def plot(result: Path, output: Path | None) -> None:
    """Draw RESULT (netCDF): the friction loop, the loads, and the slip state of the asperities."""
    with _opened(result) as history:
        output = output or result.with_suffix(".png")
        _check_target(output, result)
        _draw(history, output)
    click.echo(output)


def _check_target(path: Path, *sources: Path) -> None:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; expected the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")
    if any(
        path.absolute() == source.absolute() or (path.exists() and source.exists() and path.samefile(source))
        for source in sources
    ):
        raise InputError(f"{path}: would overwrite what it is made from; choose another name")


def _scenario_lines(path: Path) -> list[tuple[str, str]]:
    from historysim import scenario
    from historysim.analysis import duration_text

    loaded = scenario.load(path)
    ensemble, events = loaded.checked()
    duration = duration_text(events[-1].time - events[0].time)
    return [
        ("title", " ".join(loaded.title.split()) or path.stem),
        ("asperities", f"{len(ensemble):,}"),
        ("events", f"{len(events):,} over {duration}"),
        ("substeps", str(loaded.substeps)),
        ("recorded asperities", loaded.record if isinstance(loaded.record, str) else f"{len(loaded.record):,} chosen"),
    ]


def _print_lines(lines: Iterable[tuple[str, str]]) -> None:
    lines = list(lines)
    width = max((len(label) for label, _ in lines), default=0) + 2
    for label, value in lines:
        click.echo(f"{label:<{width}}{value}")


def _is_netcdf(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(8).startswith(NETCDF_BEGINNINGS)
    except (OSError, ValueError):
        return False


@contextmanager
def _opened(path: Path) -> Iterator["xr.Dataset"]:
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; expected a result of historysim run (netCDF)")
    if not _is_netcdf(path):
        raise InputError(f"{path}: is not a netCDF file; expected a result of historysim run")
    import xarray as xr

    try:
        history = xr.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error
    with history:
        if not history.attrs.get("complete"):
            raise InputError(f"{path}: is not a finished result of historysim run; run the scenario again")
        try:
            yield history
        except RuntimeError as error:
            if not str(error).startswith("NetCDF: "):
                raise
            raise InputError(f"{path}: is damaged ({error}); run the scenario again") from error


def _draw(history: "xr.Dataset", picture: Path) -> None:
    from historysim.plots.history import overview

    figure = overview(history)
    known = figure.canvas.get_supported_filetypes()
    kind = picture.suffix.removeprefix(".").lower()
    if kind not in known:
        raise InputError(f"{picture}: {kind or 'no'} ending; expected one of {', '.join(sorted(known))}")
    unfinished = picture.with_name(f".{picture.name}.{os.getpid()}.part")
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            figure.savefig(unfinished, format=kind, dpi=200)
        unfinished.replace(picture)
    finally:
        unfinished.unlink(missing_ok=True)
