"""Commands that look at a file: show, plot."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from historysim.cli.arguments import check_target, path_type
from historysim.cli.output import print_lines, save
from historysim.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from historysim.surfaces.heights import Surface


def height_map_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that say what a height map leaves open."""
    for option in (
        click.option("--form", default="plane", show_default=True, help="What to take off a height map first."),
        click.option("--channel", help="Channel of a height map, by its number from 0 or its name."),
        click.option("--lateral-unit", help="Unit of its coordinates, if it has some without."),
        click.option("--height-unit", help="Unit of its heights, if it names none."),
        click.option("--pixel-size", multiple=True, help='As "0.5 µm", if it has none; twice for x and y.'),
    ):
        command = option(command)
    return command


@click.command()
@click.argument("file", type=path_type)
@height_map_options
def show(file: Path, **height_map: Any) -> None:
    """Say in a few lines what FILE holds: a scenario, a result, a log, or a height map."""
    from historysim.results.files import kind_of, open_result

    kind = kind_of(file)
    if kind == "scenario":
        from historysim.scenario.scenario import load
        from historysim.scenario.summary import summary

        print_lines(summary(load(file)))
        return
    if kind == "log":
        print_lines(_log_lines(file))
        return
    if kind == "height map":
        from historysim.surfaces.summary import summary as surface_summary

        print_lines([*surface_summary(_height_map(file, **height_map)), ("form taken off", height_map["form"])])
        return
    from historysim.results import analysis

    with open_result(file) as history:
        print_lines(analysis.summary(history))
        click.echo()
        one_line = {key: str(value) for key, value in history.attrs.items() if "\n" not in str(value).strip()}
        print_lines(one_line.items())


@click.command()
@click.argument("file", type=path_type)
@click.option("-o", "--output", type=path_type, help="The picture (PNG, PDF, SVG). [default: FILE's name with .png]")
@click.option("--step", help="Draw the surface of a result at this step, or at the peak normal load: a number or peak.")
@click.option("--adhesion", is_flag=True, help="Draw the adhesion map with asperities of a scenario.")
@height_map_options
def plot(file: Path, output: Path | None, step: str | None, adhesion: bool, **height_map: Any) -> None:
    """Draw FILE.

    A result: the friction loop, the loads, and the slip state of the asperities; with --step the surface, its summits
    in contact coloured by their slip state. A scenario or a height map: the surface with its summits.
    """
    from historysim.results.files import kind_of, open_result

    kind = kind_of(file)
    if adhesion:
        if kind != "scenario":
            raise InputError(f"--adhesion: {file} is a {kind}; expected a scenario with [adhesion]")
        output = output or Path(f"{file.stem}_adhesion.png")
        check_target(output, file)
        save(_adhesion_map(file), output)
        click.echo(output)
        return
    if step is not None and kind != "result":
        raise InputError(f"--step {step}: {file} is a {kind}; expected a result of historysim run, which has steps")
    if output is None:
        beside = file if kind == "result" else Path(file.name)
        output = beside.with_name(f"{file.stem}_surface.png" if step or kind != "result" else f"{file.stem}.png")
    check_target(output, file)
    if kind == "log":
        raise InputError(f"{file}: is a log; expected its result; historysim run {file} makes it again")
    from historysim.results.plots.history import plot_history
    from historysim.results.plots.surface import plot_surface

    if kind == "scenario":
        save(plot_surface(_scenario_surface(file)), output)
    elif kind == "height map":
        surface = _height_map(file, **height_map)
        save(plot_surface(_map_surface(surface, file.name)), output)
    else:
        with open_result(file) as history:
            if step is None:
                save(plot_history(history), output)
            else:
                save(plot_surface(_result_surface(file, history), history, _step(step, history)), output)
    click.echo(output)


def _log_lines(path: Path) -> list[tuple[str, str]]:
    from historysim.basics.units import duration_text
    from historysim.log.event_log import EventLog

    with EventLog(path) as log:
        events, settings = log.events(), log.settings
        duration = f" over {duration_text(events[-1].time - events[0].time)}" if events else ""
        return [
            ("title", settings["title"] or path.stem),
            ("asperities", f"{len(log.ensemble):,}"),
            ("events", f"{len(events):,}{duration}"),
            ("substeps", str(settings["substeps"])),
            ("made with", f"historysim {settings['historysim_version']}, {settings['made_with']}"),
            ("digest", log.digest),
        ]


def _height_map(
    path: Path,
    *,
    pixel_size: tuple[str, ...],
    height_unit: str | None,
    lateral_unit: str | None,
    channel: str | None,
    form: str,
) -> "Surface":
    from historysim.basics.arguments import representable
    from historysim.surfaces.reading import read_surface

    if len(pixel_size) > 2:
        raise InputError(f"--pixel-size came {len(pixel_size)} times; expected it once, or twice for x and y")
    try:
        surface = read_surface(
            path,
            pixel_size=(pixel_size[0], pixel_size[-1]) if pixel_size else None,
            height_unit=height_unit,
            lateral_unit=lateral_unit,
            channel=int(channel) if channel is not None and channel.isdecimal() else channel,
        )
    except InputError as error:
        raise InputError(
            f"{error} (read as a height map: neither named .toml nor a result of historysim run)"
        ) from error
    with representable():
        return surface.detrended(form)


def _map_surface(surface: "Surface", title: str) -> "xr.Dataset":
    from historysim.basics.arguments import representable
    from historysim.recording import surface_group

    with representable():
        summits = surface.summits(3 if 1 in surface.shape else 9)
    return surface_group.dataset(summits, surface).assign_attrs(title=title)


def _scenario_surface(path: Path) -> "xr.Dataset":
    from historysim.recording import surface_group
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    ground = loaded.ground()
    return surface_group.dataset(ground.summits, ground.surface).assign_attrs(title=loaded.title or path.stem)


def _adhesion_map(path: Path) -> "Figure":
    from historysim.results.plots.adhesion_map import plot_adhesion_map
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    ensemble, events = loaded.checked()
    contact = loaded.adhering(ensemble, events)
    if contact is None:
        raise InputError(f"{path}: has no [adhesion], or nothing touches; expected both to draw the adhesion map")
    ranks = {"greatest load": 0, "median load": contact.asperity.size // 2, "least load": contact.asperity.size - 1}
    marked = {rank: name for name, rank in reversed(ranks.items())}
    return plot_adhesion_map(
        {
            f"asperity {contact.asperity[rank]}, {name}": (
                float(contact.maugis_parameter[rank]),
                float(contact.load_parameter[rank]),
            )
            for rank, name in sorted(marked.items())
        }
    )


def _result_surface(path: Path, history: "xr.Dataset") -> "xr.Dataset":
    import xarray as xr

    from historysim.recording.surface_group import GROUP
    from historysim.results.plots.surface import surface_of

    try:
        return xr.load_dataset(path, engine="netcdf4", group=GROUP)
    except (OSError, KeyError):
        return surface_of(history)


def _step(text: str, history: "xr.Dataset") -> int:
    if text == "peak":
        return int(history["total_normal_load"].values.argmax())
    try:
        return int(text)
    except ValueError:
        raise InputError(f"--step {text}: expected a number from 0 to {history.sizes['step'] - 1}, or peak") from None


COMMANDS = (show, plot)
