"""``[fit]``: parameters of a scenario fitted to what was measured, and the scenario with what was found."""

import os
from collections.abc import Callable, Iterable, Mapping, MutableMapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.ensemble import Ensemble, Patches
from historysim.asperities.instrument import Instrument
from historysim.basics.display import html_table
from historysim.basics.files import replacing
from historysim.basics.places import at
from historysim.basics.progress import progress_bar
from historysim.basics.targets import FITTED, Output, check_outputs
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.results.plots.pictures import figure_of
from historysim.results.report.page import page_of
from historysim.scenario.compare import sticking_stiffness
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import reported
from historysim.scenario.sections import FitSection

if TYPE_CHECKING:
    from historysim.measured.comparison import Comparison
    from historysim.measured.fitting import Parameter, ParameterFit
    from historysim.results.plots.canvas import FigureOrAxes, Place

Model = Callable[[Mapping[str, float]], tuple[Ensemble, Instrument]]


def model_of(scenario: Scenario) -> tuple[FitSection, Model, dict[str, float]]:
    """Return ``[fit]``, the model as a function of the parameters that are fitted, and where these start.

    Raises InputError: a scenario without ``[fit]``, or with parameters that it does not have.
    """
    ensemble, instrument = scenario.ensemble(), scenario.instrument
    section = scenario.sections.fit
    with reported(scenario.path.name):
        if section is None:
            raise InputError('fit: missing; expected [fit] with parameters = ["friction", …]')
        with at("fit", "parameters"):
            if "friction" in section.parameters and scenario.sections.friction is None:
                raise InputError("friction: is a column of the surface; expected [friction] with a coefficient to fit")
            if ensemble.evolves or ensemble.law is not None:
                raise InputError("friction or geometry evolves in this scenario; expected constant ones for a fit")
            start = {name: _start(name, ensemble, instrument) for name in section.parameters}

    height = ensemble.summit_height
    mean = height.mean()

    def model(values: Mapping[str, float]) -> tuple[Ensemble, Instrument]:
        pair = ensemble.pair
        if "shear_modulus" in values:
            pair = MaterialPair.from_moduli(
                contact_modulus=pair.contact_modulus, shear_modulus=values["shear_modulus"], **pair.limits
            )
        if ensemble.curves is not None:
            friction = values.get("friction", float(ensemble.friction[0]))
            top, tolerance = ensemble.highest_summit, ensemble.tolerance
            changed: Ensemble = Patches(pair, ensemble.curves, friction, highest_summit=top, tolerance=tolerance)
        else:
            changed = Ensemble(
                pair,
                mean + values.get("height_scale", 1.0) * (height - mean),
                ensemble.summit_radius,
                values.get("friction", ensemble.friction),
                tolerance=ensemble.tolerance,
            )
        return (
            changed,
            attrs.evolve(instrument, lateral_stiffness=values.get("lateral_stiffness", instrument.lateral_stiffness)),
        )

    return section, model, start


def _start(name: str, ensemble: Ensemble, instrument: Instrument) -> float:
    if name == "friction":
        coefficients = np.unique(ensemble.friction)
        if coefficients.size > 1 or coefficients[0] == 0:
            raise InputError("friction: expected one coefficient for all asperities, greater than 0, to start from")
        return float(coefficients[0])
    if name == "lateral_stiffness":
        if instrument.rigid:
            raise InputError("lateral_stiffness: expected [instrument] with a lateral_stiffness to start from")
        return instrument.lateral_stiffness
    if name == "height_scale":
        if ensemble.curves is not None:
            raise InputError("height_scale: is part of the normal curve already; expected a surface of summits")
        if np.ptp(ensemble.summit_height) == 0:
            raise InputError("height_scale: all summits are equally high; expected a rough surface")
        return 1.0
    return ensemble.pair.shear_modulus


@attrs.frozen(eq=False)
class Fit:
    """Parameters of a scenario that were fitted to what was measured."""

    scenario: Scenario
    """The scenario as it was."""
    estimates: "ParameterFit"
    """What was found, how sure it is, and what the data cannot tell."""
    comparison: "Comparison"
    """The fitted model beside what was measured."""

    def __repr__(self) -> str:
        return f"<Fit: {', '.join(f'{label} {text}' for label, text in self.estimates.summary())}>"

    def _repr_html_(self) -> str:
        return html_table(self.estimates.summary()) + self.comparison._repr_html_()

    @property
    def parameters(self) -> "tuple[Parameter, ...]":
        """The estimates, with their intervals."""
        return self.estimates.parameters

    @property
    def values(self) -> dict[str, float]:
        """The estimates by name, in SI."""
        return self.estimates.values

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): what was found, how sure it is, and how far the two are still apart."""
        return [*self.estimates.summary(), *self.comparison.summary()]

    def scenario_text(self, output: str | Path) -> str:
        """Return the scenario with the fitted values, as TOML that keeps its comments.

        Parameters
        ----------
        output : path
            The file that it is for, to which its paths are relative.
        """
        return fitted_text(self.scenario, self.parameters, Path(output))

    def write(self, output: str | Path) -> None:
        """Write the scenario with the fitted values to a file, whole or not at all.

        Parameters
        ----------
        output : path
            An existing file is replaced.

        Raises
        ------
        InputError
            It is a file that the scenario reads, or has another ending than .toml.
        OSError
            It cannot be written.
        """
        text = self.scenario_text(output)
        check_outputs([Output(Path(output), (FITTED,))], self.scenario.files, force=True)
        with replacing(Path(output)) as unfinished:
            unfinished.write_text(text, encoding="utf-8")


def fit(scenario: Scenario | str | Path, *, progress: bool = False) -> Fit:
    """Return the parameters of a scenario, fitted as its ``[fit]`` says to what was measured.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario with ``[fit]`` whose loading is measured, with a tangential load to fit to.
    progress : bool
        Count the walks along the record on standard error where that is a terminal and they take long.

    Raises
    ------
    InputError
        A scenario that cannot be used, has no ``[fit]`` or measures no tangential load, fewer loops than are to be
        skipped, or loops that run the wrong way round.
    LoadError
        A normal load that the contact cannot carry.
    """
    from historysim.measured.comparison import Comparison, observe
    from historysim.measured.fitting import fit_parameters

    scenario = as_scenario(scenario)
    scenario.check_steady_friction()
    measurement = scenario.measurement()
    section, model, start = model_of(scenario)
    with reported(scenario.path.name), at("loading"):
        observation = observe(
            measurement,
            skip=section.skip,
            displacement_noise=section.displacement_noise,
            load_noise=section.load_noise,
        )
        # how many walks it takes is not known before
        with progress_bar(progress, " walks", desc="fitting", delay=2) as notify:
            estimates = fit_parameters(model, start, observation, notify=notify)
    ensemble, instrument = model(estimates.values)
    stiffness = sticking_stiffness(ensemble, observation)
    return Fit(scenario, estimates, Comparison.of(observation, estimates.response, instrument, stiffness))


def fitted_text(scenario: Scenario, parameters: "Iterable[Parameter]", output: Path) -> str:
    """Return the scenario with the fitted values, as TOML that keeps its comments; paths are relative to `output`."""
    import tomlkit

    document: Any = tomlkit.parse(scenario.text.removeprefix("\ufeff"))
    for parameter in parameters:
        if parameter.name == "friction":
            _put(document["friction"], "coefficient", parameter)
        elif parameter.name == "lateral_stiffness":
            _put(document["instrument"], "lateral_stiffness", parameter)
        elif parameter.name == "height_scale":
            surface = scenario.sections.surface
            scale = getattr(surface, "height_scale", None)
            _put(document["surface"], "height_scale", parameter, scale or 1.0)
        else:
            _put_moduli(document, scenario, parameter)
    if "run" in document["loading"]:
        document["loading"]["run"] = scenario.run
    before, after = scenario.path.parent.absolute(), output.parent.absolute()
    if before != after:
        _move_files(document, before, after)
    return tomlkit.dumps(document)


def _put(table: MutableMapping[str, Any], key: str, parameter: "Parameter", unit: float = 1.0) -> None:
    """Write a fitted value in its place, in front of the comment that stands there."""
    import tomlkit

    value = tomlkit.float_(parameter.value * unit)
    known = table[key].trivia.comment.removeprefix("#").strip() if key in table else ""
    value.comment("; ".join(filter(None, [f"fitted, {parameter.interval(1 / unit)}", known])))
    table[key] = value


def _put_moduli(document: MutableMapping[str, Any], scenario: Scenario, parameter: "Parameter") -> None:
    """Write a fitted shear modulus of the pair, which takes the place of the two materials."""
    import tomlkit

    if "shear_modulus" not in document["materials"]:
        pair, adhesion = scenario.sections.materials.pair(), scenario.sections.adhesion
        if adhesion is not None:
            # it may follow from the two materials, which are not named any more
            document["adhesion"]["work_of_adhesion"] = adhesion.work(pair)
        modulus = tomlkit.float_(pair.contact_modulus)
        if pair.first and pair.second:
            modulus.comment(f"of {pair.first.name} and {pair.second.name}")
        document["materials"] = tomlkit.table()
        document["materials"]["contact_modulus"] = modulus
    _put(document["materials"], "shear_modulus", parameter)


def _move_files(table: MutableMapping[str, Any], before: Path, after: Path) -> None:
    """Make every relative ``file`` of a table relative to another folder."""
    for key, value in table.items():
        if isinstance(value, MutableMapping):
            _move_files(value, before, after)
        elif key == "file" and not Path(value).is_absolute():
            table[key] = Path(os.path.relpath(before / value, after)).as_posix()


@figure_of.register(Fit)
def _figure(fit: Fit, *, place: "Place", **_: object) -> "FigureOrAxes":
    return figure_of(fit.comparison, title=fit.scenario.title, place=place)


@page_of.register(Fit)
def _page(fit: Fit) -> str:
    from historysim.results.report.others import comparison_page

    scenario = fit.scenario
    return comparison_page(
        fit.comparison,
        scenario.title or scenario.path.stem,
        scenario.text,
        fitted=fit.estimates.summary(),
        result=fit.scenario_text(scenario.path),
    )
