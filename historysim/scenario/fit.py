"""Comparison of the model of a scenario with its record, and ``[fit]``: parameters fitted to the record."""

import functools
import os
from collections.abc import Callable, Iterable, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import tomlkit
from tomlkit.items import InlineTable

from historysim.asperities.body import Body
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import Floats
from historysim.basics.files import replacing
from historysim.basics.targets import FITTED, Output, check_outputs
from historysim.basics.wording import html_table, progress_bar
from historysim.errors import InputError, error_path, field_error
from historysim.measured import fit_model
from historysim.measured.comparison import Comparison
from historysim.measured.creep import Creep, separate_creep
from historysim.measured.fit_model import Model, starting_value
from historysim.measured.fitting import Parameter, ParameterFit, fit_parameters
from historysim.measured.observation import Observation, observe
from historysim.measured.reduction import Measurement
from historysim.measured.response import (
    ModelResponse,
    compute_displacement,
    compute_response,
    find_forgotten,
)
from historysim.measured.search import OFFSET
from historysim.recording.recorder import UNKNOWN
from historysim.results.plots.pictures import make_figure
from historysim.results.report.page import render_page
from historysim.scenario.loading_kinds import EACH
from historysim.scenario.optional_sections import FitSection
from historysim.scenario.runs import each_run
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import located_errors

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place

# Samples of a record beyond which a fit averages neighbours, and how many are then left: a fit
# replays them some 1,000 times, each in about 1.5 µs per sample. A hundred branches have a hundred
# means each.
MANY_SAMPLES, AVERAGED_SAMPLES = 50_000, 10_000
# Fits of a record with an unknown past, each of the samples that do not depend on it by the one
# before, and the fraction of the samples by which two such selections may differ.
MOST_FITS, SAME_SAMPLES = 4, 0.01


def build_model(scenario: Scenario) -> tuple[FitSection, Model, dict[str, float]]:
    """Return ``[fit]``, the model as a function of the fitted parameters, and their starting values."""
    ensemble, instrument = scenario.ensemble(), scenario.instrument
    section = scenario.sections.fit
    with located_errors(scenario.path.name):
        if section is None:
            raise InputError('fit: missing; expected [fit] with parameters = ["friction", …]')
        with error_path("fit", "parameters"):
            if "friction" in section.parameters and scenario.sections.friction is None:
                raise InputError(
                    "friction: is a column of the surface; expected [friction] with a coefficient to fit"
                )
            model = fit_model.build_model(ensemble, instrument)
            start = {
                name: _offset_start(scenario)
                if name == OFFSET
                else starting_value(name, ensemble, instrument)
                for name in section.parameters
            }
    return section, model, start


def _offset_start(scenario: Scenario) -> float:
    """Return the starting value of the offset of the tangential displacement [m]."""
    loading = scenario.measured_loading()
    channel = loading.columns.tangential_displacement or loading.response.tangential_displacement
    if channel is None or channel.constant is not None:
        raise InputError(
            f"{OFFSET}: no displacement was measured; expected a column for tangential_displacement"
        )
    if channel.centred:
        raise InputError(
            f"{OFFSET}: centred removes any offset of the tangential displacement; expected one of them: remove "
            "centred = true there, or this parameter"
        )
    return scenario.measurement().offset["tangential_displacement"]


@attrs.frozen(eq=False)
class Fit:
    """Fitted parameters of a scenario."""

    scenario: Scenario  #: the original scenario
    estimates: ParameterFit  #: estimates with their intervals, and undetermined combinations
    comparison: Comparison  #: the fitted model compared with the record

    def __repr__(self) -> str:
        return repr(self.estimates).replace(type(self.estimates).__name__, "Fit", 1)

    def _repr_html_(self) -> str:
        return html_table(self.estimates.summary()) + self.comparison._repr_html_()

    @property
    def parameters(self) -> "tuple[Parameter, ...]":
        """Estimates, with their intervals."""
        return self.estimates.parameters

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name, in SI."""
        return self.estimates.values

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): the estimates with their intervals, and the remaining difference."""
        return [*self.estimates.summary(), *self.comparison.summary()]

    def scenario_text(self, output: str | Path) -> str:
        """Return the scenario with the fitted values as TOML, with its comments; paths are relative to ``output``."""
        return fitted_text(self.scenario, self.parameters, Path(output))

    def write(self, output: str | Path) -> None:
        """Write the scenario with the fitted values to a file, which is replaced, whole or not at all.

        Raises InputError: a file that the scenario reads, or with another suffix than .toml.
        """
        text = self.scenario_text(output)
        check_outputs([Output(Path(output), (FITTED,))], self.scenario.files, force=True)
        with replacing(Path(output)) as unfinished:
            unfinished.write_text(text, encoding="utf-8")


def compare(scenario: Scenario | str | Path, *, skip: int = 0) -> Comparison | Any:  # noqa: ANN401 - Runs, for several runs
    """Compare the model of a scenario with its record: the same displacements, and the loads of both.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario with a measured loading and a tangential load to compare with.
    skip : int
        Loops at the start that are replayed but not compared.

    Returns
    -------
    Comparison, or Runs
        Of several runs a sequence, as from `loops`.
        Its loops use the dead band of the tangential displacement in the scenario, or else the
        default of `loops`.

    Raises
    ------
    InputError
        A scenario that cannot be used or has no measured tangential load, too few loops, or loops
        in the wrong sense.
    LoadError
        A normal load that the contact cannot carry.

    Examples
    --------
    >>> comparison = hs.compare("scenarios/15_instrument_in_series.toml")
    >>> print(f"{np.sqrt(np.mean(comparison.difference ** 2)) * 1e6:.0f} µN")
    171 µN
    """
    scenario = as_scenario(scenario)
    if scenario.run == EACH:
        return each_run(scenario, lambda run: compare(run, skip=skip))
    scenario.check_comparable()
    measurement, instrument = scenario.measurement(), scenario.instrument
    options: dict[str, Any] = {"skip": skip, "parallel_stiffness": instrument.parallel_stiffness}
    with located_errors(scenario.path.name), error_path("loading"):
        observation = observe(measurement, **options)
    ensemble = scenario.ensemble()
    with located_errors(scenario.path.name), error_path("loading"):
        if scenario.sections.loading.past == UNKNOWN:
            forgotten = _find_forgotten(ensemble, instrument, observation)
            observation = observe(measurement, **options, forgotten=forgotten)
    response = compute_response(ensemble, instrument, observation)
    with located_errors(scenario.path.name), error_path("loading"):
        moved = _compute_displacement(scenario, ensemble, instrument, measurement)
    respond = functools.partial(_respond, ensemble, observation)
    return Comparison(observation, response, instrument, moved, respond)


def _find_forgotten(ensemble: Body, instrument: Instrument, observation: Observation) -> int:
    """Find the first sample without an unknown past; InputError if the record never forgets it."""
    forgotten = find_forgotten(ensemble, instrument, observation)
    if forgotten is None:
        raise field_error(
            'is "unknown", and the contact remembers it up to the end of the record; expected strokes that slide, or '
            'past = "untouched" with displacement_offset among the parameters of [fit]',
            "past",
        )
    return forgotten


def _compute_displacement(
    scenario: Scenario, ensemble: Body, instrument: Instrument, measurement: Measurement
) -> Floats | None:
    """Replay the tangential load of a record; None for an unknown past, which a load does not erase."""
    if scenario.sections.loading.past == UNKNOWN:
        return None
    return compute_displacement(ensemble, instrument, measurement)


def creep(scenario: Scenario | str | Path) -> Creep | Any:  # noqa: ANN401 - Runs, for several runs
    """Evaluate the holds at reversals of a measured record: relaxation over log time in addition to memory.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario with a measured loading that has tangential displacement, tangential load and
        normal load. Its model gives the change of the load by memory, from displacement and normal
        load in the holds.

    Returns
    -------
    Creep, or Runs
        Of several runs a sequence, as from `loops`.
        Fraction of the load that relaxes per decade of time, with its interval, or why it is not
        determined; drift of the sensor; contributions to the change in each hold.

    Raises
    ------
    InputError
        A scenario that cannot be used, or a record without holds.
    LoadError
        A normal load that the contact cannot carry.
    """
    scenario = as_scenario(scenario)
    if scenario.run == EACH:
        return each_run(scenario, creep)
    scenario.check_comparable()
    if scenario.sections.loading.past == UNKNOWN:
        problem = 'is "unknown", and creep has no bounds of it; expected past = "untouched"'
        with located_errors(scenario.path.name):
            raise field_error(problem, "loading", "past")
    measurement, ensemble = scenario.measurement(), scenario.ensemble()
    instrument = scenario.instrument
    with located_errors(scenario.path.name), error_path("loading"):
        contact = measurement.without_spring(instrument.parallel_stiffness)
        return separate_creep(contact, ensemble, attrs.evolve(instrument, parallel_stiffness=0.0))


def fit(scenario: Scenario | str | Path, *, progress: bool = False) -> Fit | Any:  # noqa: ANN401 - Runs, for several runs
    """Fit the parameters in ``[fit]`` of a scenario to its record.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario with ``[fit]`` and a measured loading, with a tangential load to fit to.
    progress : bool
        Show a progress bar on standard error if that is a terminal and the fit takes long; the
        number of replays is an estimate.

    Returns
    -------
    Fit, or Runs
        Of several runs a sequence, as from `loops`.

    Raises
    ------
    InputError, LoadError
        As for `compare`; also a scenario without ``[fit]``.
    """
    scenario = as_scenario(scenario)
    if scenario.run == EACH:
        return each_run(scenario, lambda run: fit(run, progress=progress))
    with progress_bar(progress, "record", 1, desc="reading", leave=False) as read:
        measurement, observation, model, start = prepare_fit(scenario)
        read()
    bar = progress_bar(progress, "walk", desc="fitting", delay=2)
    forgotten: int | None = None
    with located_errors(scenario.path.name), error_path("loading"), bar as done:
        solve = functools.partial(fit_parameters, model, start, notify=lambda of: done(1, of))
        if scenario.sections.loading.past == UNKNOWN:
            estimates, forgotten = _fit_unknown_past(scenario, measurement, model, solve)
        else:
            estimates = solve(observation)
    ensemble, instrument = model(estimates.values)
    offset = estimates.values.get(OFFSET, 0.0) - start.get(OFFSET, 0.0)
    # as `compare` of the fitted scenario: all samples, with the fitted zero and, for loops, without
    # the fitted spring
    measurement = measurement.add_displacement_offset(offset)
    observation = _observe_record(
        scenario, measurement, instrument, average=False, forgotten=forgotten
    )
    response = compute_response(ensemble, instrument, observation)
    moved = _compute_displacement(scenario, ensemble, instrument, measurement)
    respond = functools.partial(_respond, ensemble, observation)
    return Fit(scenario, estimates, Comparison(observation, response, instrument, moved, respond))


def _fit_unknown_past(
    scenario: Scenario,
    measurement: Measurement,
    model: Model,
    solve: Callable[[Observation], ParameterFit],
) -> tuple[ParameterFit, int]:
    """Fit the samples that do not depend on the past; return also the first of them.

    Which they are depends on the parameters, so that the first fit is from the end of the first
    whole stroke on.
    """
    observe_record = functools.partial(_observe_record, scenario, measurement, scenario.instrument)
    every = observe_record(average=False)
    forgotten = int(every.turns[min(2, every.turns.size - 2)])
    for _ in range(MOST_FITS):
        estimates = solve(observe_record(forgotten=forgotten))
        found = _find_forgotten(*model(estimates.values), every)
        if 0 <= forgotten - found <= SAME_SAMPLES * every.time.size:
            break
        forgotten = found
    return estimates, forgotten


def _respond(ensemble: Body, observation: Observation, instrument: Instrument) -> ModelResponse:
    return compute_response(ensemble, instrument, observation)


def prepare_fit(
    scenario: Scenario,
) -> "tuple[Measurement, Observation, Model, dict[str, float]]":
    """Return the record, its observation, the model and the starting values of a fit; errors as for `fit`."""
    scenario.check_comparable()
    _, model, start = build_model(scenario)
    measurement = scenario.measurement()
    observation = _observe_record(scenario, measurement, scenario.instrument)
    return measurement, observation, model, start


def _observe_record(
    scenario: Scenario,
    measurement: Measurement,
    instrument: Instrument,
    *,
    average: bool = True,
    forgotten: int | None = None,
) -> Observation:
    """Observe the record of a fit; its loops refer to the contact."""
    section = scenario.sections.fit
    if section is not None and OFFSET in section.parameters:
        measurement = attrs.evolve(measurement, starts_displaced=True)
    noise: dict[str, Any] = {"forgotten": forgotten}
    if section is not None:
        noise |= {
            name: getattr(section, name) for name in ("skip", "displacement_noise", "load_noise")
        }
    with located_errors(scenario.path.name), error_path("loading"):
        seen = observe(measurement, parallel_stiffness=instrument.parallel_stiffness, **noise)
    return seen.average(AVERAGED_SAMPLES) if average and seen.time.size > MANY_SAMPLES else seen


# Section and key of each fitted parameter.
_KEYS = {
    "friction": ("friction", "coefficient"),
    "shear_modulus": ("materials", "shear_modulus"),
    "lateral_stiffness": ("instrument", "lateral_stiffness"),
    "parallel_stiffness": ("instrument", "parallel_stiffness"),
    "height_scale": ("surface", "height_scale"),
}


def fitted_text(scenario: Scenario, parameters: "Iterable[Parameter]", output: Path) -> str:
    """Return the scenario with the fitted values as TOML, with its comments; paths are relative to ``output``."""
    document: Any = tomlkit.parse(scenario.text.removeprefix("\ufeff"))
    for parameter in parameters:
        if parameter.name == OFFSET:
            _put_offset(document["loading"], parameter)
            continue
        section, key = _KEYS[parameter.name]
        if section == "materials" and key not in document[section]:
            _put_pair(document, scenario)
        # an existing height_scale is multiplied
        scale = (
            getattr(scenario.sections.surface, "height_scale", None)
            if key == "height_scale"
            else None
        )
        _put(document[section], key, parameter, scale or 1.0)
    if scenario.run is not None:
        document["loading"]["run"] = scenario.run
    old_folder, new_folder = scenario.path.parent.absolute(), output.parent.absolute()
    if old_folder != new_folder:
        _move_files(document, old_folder, new_folder)
    return tomlkit.dumps(document)


def _put(
    table: MutableMapping[str, Any], key: str, parameter: Parameter, unit: float = 1.0
) -> None:
    """Write a fitted value to its key, in front of an existing comment."""
    value = tomlkit.float_(parameter.value * unit)
    comment = table[key].trivia.comment.removeprefix("#").strip() if key in table else ""
    value.comment("; ".join(filter(None, [f"fitted, {parameter.interval(1 / unit)}", comment])))
    table[key] = value


def _put_offset(loading: MutableMapping[str, Any], parameter: Parameter) -> None:
    """Write a fitted offset into the column of the tangential displacement."""
    name = "tangential_displacement"
    channels = loading["columns"] if name in loading["columns"] else loading["response"]
    if isinstance(channels[name], str):
        column = tomlkit.inline_table()
        column["column"] = str(channels[name])
        channels[name] = column
    channel = channels[name]
    if not isinstance(channel, InlineTable):
        _put(channel, "offset", parameter)
        return
    channel["offset"] = tomlkit.float_(parameter.value)
    # an inline table has no comments inside
    if not isinstance(channels, InlineTable):
        channel.comment(f"offset fitted, {parameter.interval()}")


def _put_pair(document: MutableMapping[str, Any], scenario: Scenario) -> None:
    """Replace the two materials by the contact modulus of the pair, to which a shear modulus is added."""
    pair, adhesion = scenario.sections.materials.pair(), scenario.sections.adhesion
    if adhesion is not None:
        # its default depends on the two materials, which are removed
        document["adhesion"]["work_of_adhesion"] = adhesion.work(pair)
    modulus = tomlkit.float_(pair.contact_modulus)
    if pair.first and pair.second:
        modulus.comment(f"of {pair.first.name} and {pair.second.name}")
    document["materials"] = tomlkit.table()
    document["materials"]["contact_modulus"] = modulus


def _move_files(table: MutableMapping[str, Any], old_folder: Path, new_folder: Path) -> None:
    """Make each relative path ``file`` of a table relative to another folder."""
    for key, value in table.items():
        if isinstance(value, MutableMapping):
            _move_files(value, old_folder, new_folder)
        elif key == "file":
            names = [value] if isinstance(value, str) else value
            moved = [
                name
                if Path(name).is_absolute()
                else Path(os.path.relpath(old_folder / name, new_folder)).as_posix()
                for name in names
            ]
            table[key] = moved[0] if isinstance(value, str) else moved


@make_figure.register(Fit)
def _figure(fit: Fit, *, target: "Place", **_: object) -> "FigureOrAxes":
    return make_figure(fit.comparison, title=fit.scenario.title, target=target)


@render_page.register(Fit)
def _page(fit: Fit) -> str:
    from historysim.results.report.reports import comparison_page

    scenario = fit.scenario
    return comparison_page(
        fit.comparison,
        scenario.title or scenario.path.stem,
        scenario.text,
        fitted=fit.estimates.summary(),
        result=fit.scenario_text(scenario.path),
    )
