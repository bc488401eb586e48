"""One cell of a sweep: a scenario at a point, replayed, and what is asked of its history."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.errors import InputError
from historysim.recording.changes import Changes
from historysim.scenario.input_files import files_of
from historysim.scenario.scenario import Scenario
from historysim.studies.input_digests import stamp
from historysim.studies.outputs import OF_ALL_SUMMITS, SUMMARIES, asks_for_each, chosen_outputs

if TYPE_CHECKING:
    import xarray as xr

    from historysim.scenario.surface_kinds import BuiltSurface

SURFACES_KEPT = 2
"""Surfaces that a process keeps, so that cells which stand on the same one do not make it again."""


def cell(scenario: Scenario, point: Mapping[str, Any], outputs: Sequence[str] = ()) -> "xr.Dataset":
    """Return what a scenario gives at one point of a sweep.

    It depends on its arguments, and the files that the scenario names, alone: any process gives the same bits.

    Parameters
    ----------
    scenario : Scenario
    point : dict
        Values of its keys, as ``{"friction.coefficient": 0.3, "surface.seed": 7}``.
    outputs : sequence of str
        Names of summaries, of totals along ``step``, or of variables of each asperity along ``step`` and ``asperity``;
        `historysim.studies.outputs.UNASKED` by default.

    Returns
    -------
    xarray.Dataset
        The outputs; where some have rows, with the coordinate ``time``. The attribute ``validity`` tells which
        assumptions of the model do not hold, as in a history.

    Raises
    ------
    InputError, LoadError
        As for `historysim.run`.
    """
    import xarray as xr

    outputs = chosen_outputs(outputs)
    loaded = scenario.at(point)
    history = _history(loaded, each=asks_for_each(outputs))
    summaries: dict[str, Any] = {}
    rows = []
    for name in outputs:
        if name in SUMMARIES:
            summary = SUMMARIES[name]
            if name in OF_ALL_SUMMITS and history.sizes.get("asperity") != int(history.attrs["number_of_asperities"]):
                raise InputError(
                    f"{name}: not all summits are recorded beside rows of each asperity; expected "
                    'record.asperities = "all", or it in a sweep without these rows'
                )
            summaries[name] = xr.Variable(
                (), float(summary.of(history)), {"long_name": summary.long_name, "units": summary.units}
            )
        elif name in history:
            rows.append(name)
        else:
            raise InputError(f"{name}: this scenario has none; {_where(name)}")
    dataset = history[rows].assign(summaries)
    dataset.attrs = {"validity": history.attrs["validity"]}
    return dataset


def _where(name: str) -> str:
    if name.endswith("slid_distance"):
        return "expected record.sliding = true, which follows it"
    return "it belongs to what evolves, to another kind of contact, or to an instrument"


def _history(loaded: Scenario, *, each: bool) -> "xr.Dataset":
    """Return the history of a scenario: with the rows of its asperities, or else with the heights of all of them."""
    if each and loaded.record == "totals":
        raise InputError(
            f'{loaded.path.name}: record.asperities: "totals"; expected others, since their rows are asked for'
        )
    # cells are computed by as many processes as there are processors
    job = attrs.evolve(loaded.build(surface=_surface(loaded)).replay, threads=1)
    if each or attrs.evolve(job.changes, friction_differs=False) != Changes():
        return job.dataset()
    # totals cost the same whatever the number of asperities; of these only what the summaries read is put beside them
    history = attrs.evolve(job, record="totals").dataset()
    own = job.ensemble.coordinates
    beside = {name: ("asperity", own[name]) for name in ("summit_height", "summit_radius", "friction") if name in own}
    return history.assign_coords({"asperity": np.arange(len(job.ensemble)), **beside})


_surfaces: "dict[object, BuiltSurface]" = {}


def _surface(loaded: Scenario) -> "BuiltSurface":
    """Return the surface of a scenario, made once for cells that follow one another on it."""
    # a surface is what its keys say, and the files that these name
    section, folder = loaded.sections.surface, loaded.path.parent
    key = (repr(section), folder, *map(stamp, files_of(section, folder)))
    built = _surfaces.pop(key, None) or loaded.surface()
    _surfaces[key] = built
    while len(_surfaces) > SURFACES_KEPT:
        del _surfaces[next(iter(_surfaces))]
    return built
