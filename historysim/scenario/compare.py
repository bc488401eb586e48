"""The model of a scenario beside what was measured."""

from pathlib import Path
from typing import TYPE_CHECKING

from historysim.basics.places import at
from historysim.scenario.scenario import Scenario, as_scenario
from historysim.scenario.schema import reported

if TYPE_CHECKING:
    from historysim.asperities.ensemble import Ensemble
    from historysim.measured.comparison import Comparison, Observation


def compare(scenario: Scenario | str | Path, *, skip: int = 0) -> "Comparison":
    """Return the model of a scenario beside what was measured: the same displacements, and the loads of both.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario whose loading is measured, with a tangential load to compare with.
    skip : int
        Loops at the start that are walked through and not compared.

    Returns
    -------
    Comparison
        Its loops have the dead band that the scenario says of the tangential displacement, else as for `loops`.

    Raises
    ------
    InputError
        A scenario that cannot be used or measures no tangential load, fewer loops than are to be skipped, or loops that
        run the wrong way round.
    LoadError
        A normal load that the contact cannot carry.

    Examples
    --------
    >>> comparison = hs.compare("scenarios/15_instrument_in_series.toml")
    >>> print(f"{np.sqrt(np.mean(comparison.difference ** 2)) * 1e6:.0f} µN")
    171 µN
    """
    from historysim.measured.comparison import Comparison, observe, passed

    scenario = as_scenario(scenario)
    scenario.check_steady_friction()
    measurement = scenario.measurement()
    with reported(scenario.path.name), at("loading"):
        observation = observe(measurement, skip=skip)
    ensemble = scenario.ensemble()
    response = passed(ensemble, scenario.instrument, observation)
    return Comparison.of(observation, response, scenario.instrument, sticking_stiffness(ensemble, observation))


def sticking_stiffness(ensemble: "Ensemble", observation: "Observation") -> float:
    """Return the stiffness of a contact where all of it sticks, at the greatest normal load of an observation [N/m]."""
    state = ensemble.advance(ensemble.initial_state(), normal_load=float(observation.normal_load.max()))
    return float(state.tangential_stiffness)
