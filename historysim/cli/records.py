"""Commands that read records of an instrument: columns, loops, compare, fit."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from historysim.basics.files import replacing
from historysim.cli.arguments import check_target, path_type, quantity_option, text_options
from historysim.cli.output import print_lines, print_table, save
from historysim.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from historysim.asperities.instrument import Instrument
    from historysim.measured.comparison import Comparison
    from historysim.measured.loops import Loops
    from historysim.measured.observation import Observation, Passage
    from historysim.measured.record import Record
    from historysim.scenario.scenario import Scenario
    from historysim.tables import Format

NOISE_SHARE = 0.05
"""Swings of a result's displacement, over its range, below which no loop is looked for."""


@click.command()
@click.argument("file", type=path_type)
@text_options
def columns(file: Path, layout: "Format") -> None:
    """List the columns of FILE, a file of numbers, as a scenario names them."""
    from historysim.tables import describe

    found = describe(file, layout)
    print_table([("column", "unit", "values", "first"), *((c.column, c.unit, c.values, c.first) for c in found)])


@click.command()
@click.argument("file", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option(
    "--dead-band",
    help="Swings below which there is no reversal, as \"5 nm\". [default: the scenario's; 5 % of a result's range]",
)
@click.option("-o", "--output", type=path_type, help="Also write all loops to this file (netCDF).")
def loops(file: Path, skip: int, dead_band: str | None, output: Path | None) -> None:
    """Say what the friction loops of FILE are like: of a scenario's measured record, or of a result."""
    band = None if dead_band is None else quantity_option("--dead-band", dead_band, "m")
    if output is not None:
        check_target(output, file)
    from historysim.results.files import kind_of, open_result

    kind = kind_of(file)
    if kind == "height map":
        raise InputError(f"{file}: is no scenario (.toml) and no result of historysim run; expected one of them")
    if kind == "result":
        from historysim.results import analysis

        with open_result(file) as history:
            displacement = history["tangential_displacement"].values
            band = NOISE_SHARE * float(displacement.max() - displacement.min()) if band is None else band
            found = analysis.friction_loops(history, dead_band=band, skip=skip)
    else:
        from historysim.measured.loops import find_loops

        loaded, record = _measured(file, *([] if output is None else [output]))
        band = record.dead_band["tangential_displacement"] if band is None else band
        with _reported(loaded):
            found = find_loops(
                record.time,
                record["tangential_displacement"],
                record["tangential_load"],
                record.get("normal_load"),
                dead_band=band,
                skip=skip,
            )
        print_lines(record.remarks)
    if output is not None:
        with replacing(output) as unfinished:
            found.to_dataset().to_netcdf(unfinished)
    print_lines(_sequence_lines(found, band))
    print_table(found.rows())
    if output is not None:
        click.echo(output)


def _sequence_lines(loops: "Loops", dead_band: float) -> list[tuple[str, str]]:
    """Say what range pairs the displacement has, and, at several loads, how friction goes with the load."""
    import numpy as np

    from historysim.basics.units import quantity_text
    from historysim.measured.fitting import power_law
    from historysim.measured.range_pairs import range_pairs

    pairs = range_pairs(loops.record.displacement, dead_band=dead_band)
    closed = pairs.range[pairs.count == 1]
    largest = f", up to {quantity_text(float(closed.max()), 'm')}" if closed.size else ""
    lines = [("range pairs", f"{closed.size:,} closed{largest}; {pairs.range.size - closed.size:,} half cycles")]
    load, friction = loops.normal_load.mean(axis=1), loops.friction_coefficient.mean(axis=1)
    known = (load > 0) & (friction > 0)
    load, friction = load[known], friction[known]
    # over one load there is nothing to tell
    if load.size >= 3 and np.ptp(load) > 0.05 * load.max():
        law = power_law(load, friction)
        interval = f"95 %: {law.exponent_low:+.3f} to {law.exponent_high:+.3f}"
        lines.append(("friction over load", f"coefficient goes with the power {law.exponent:+.3f} of N ({interval})"))
    return lines


@click.command()
@click.argument("scenario", type=path_type)
@click.option("--skip", default=0, show_default=True, help="Loops at the start to leave out.")
@click.option("-o", "--output", type=path_type, help="The picture. [default: SCENARIO's name with _comparison.png]")
def compare(scenario: Path, skip: int, output: Path | None) -> None:
    """Set the model of SCENARIO beside what was measured: time series, loops, energy per loop."""
    output = output or Path(f"{scenario.stem}_comparison.png")
    check_target(output, scenario)
    from historysim.measured.observation import observe, passed

    loaded, record = _measured(scenario, output)
    with _reported(loaded):
        observation = observe(record, skip=skip)
    passage = passed(loaded.ensemble(), loaded.instrument, observation)
    comparison = _compared(record, observation, passage, skip, loaded.instrument)
    save(_comparison_picture(comparison, loaded), output)
    print_lines([*record.remarks, *comparison.summary()])
    print_table(comparison.rows())
    click.echo(output)


@click.command()
@click.argument("scenario", type=path_type)
@click.option(
    "-o", "--output", type=path_type, help="The fitted scenario. [default: SCENARIO's name with _fitted.toml]"
)
def fit(scenario: Path, output: Path | None) -> None:
    """Fit parameters of SCENARIO, as its [fit] says, to what was measured; write the fitted scenario and a picture."""
    output = output or Path(f"{scenario.stem}_fitted.toml")
    if output.suffix != ".toml":
        raise InputError(f"{output}: {output.suffix or 'no'} ending; expected .toml, since it is a scenario")
    picture = output.with_suffix(".png")
    check_target(output, scenario)
    check_target(picture, scenario)
    from historysim.measured import fitting
    from historysim.measured.observation import observe
    from historysim.scenario import fit as scenario_fit

    loaded, record = _measured(scenario, output, picture)
    section, model, start = scenario_fit.model_of(loaded)
    with _reported(loaded):
        observation = observe(
            record, skip=section.skip, displacement_noise=section.displacement_noise, load_noise=section.load_noise
        )
        found = fitting.fit(model, start, observation)
    comparison = _compared(record, observation, found.passage, section.skip, model(found.values)[1])
    text = scenario_fit.fitted_text(loaded, found, output)
    with replacing(output) as unfinished:
        unfinished.write_text(text, encoding="utf-8")
        save(_comparison_picture(comparison, loaded), picture)
    print_lines([*record.remarks, *found.summary(), *comparison.summary()])
    print_table(comparison.rows())
    click.echo(picture)
    click.echo(output)


def _measured(path: Path, *targets: Path) -> "tuple[Scenario, Record]":
    """Load a scenario and the record that it replays, which none of the targets may overwrite."""
    from historysim.scenario import scenario

    loaded = scenario.load(path)
    record = loaded.measured()
    for target in targets:
        check_target(target, path.parent / loaded.sections.loading.file)  # type: ignore[union-attr] # it is measured
    return loaded, record


@contextmanager
def _reported(loaded: "Scenario") -> Iterator[None]:
    """Name the scenario, where its record is not what it is taken for."""
    from historysim.basics.places import at
    from historysim.scenario.schema import reported

    with reported(loaded.path.name), at("loading"):
        yield


def _compared(
    record: "Record", observation: "Observation", passage: "Passage", skip: int, instrument: "Instrument"
) -> "Comparison":
    from historysim.measured.comparison import compare as compared

    dead_band = record.dead_band["tangential_displacement"]
    return compared(observation, passage, dead_band=dead_band, skip=skip, instrument=instrument)


def _comparison_picture(comparison: "Comparison", loaded: "Scenario") -> "Figure":
    from historysim.results.plots.comparison import plot_comparison

    return plot_comparison(comparison, loaded.title)


COMMANDS = (columns, loops, compare, fit)
