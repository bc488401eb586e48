"""One cell of a sweep: the outputs of a scenario at one point."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import xarray as xr

from historysim.basics.wording import format_value, nearest
from historysim.errors import InputError, field_error
from historysim.recording.variables import COORDINATES, known_variables
from historysim.results.analysis.per_asperity import nominal_pressure, total_mean_pressure
from historysim.results.analysis.preliminary import (
    critical_asperity,
    drift,
    preliminary_displacement,
    presliding_work,
)
from historysim.results.analysis.recorded import sizes
from historysim.results.history_drift import branch_drift
from historysim.scenario.document import find_named_files
from historysim.scenario.scenario import Scenario
from historysim.studies.store import stamp

if TYPE_CHECKING:
    from historysim.scenario.surface_kinds import BuiltSurface


@attrs.frozen
class Summary:
    """A summary value of a history."""

    units: str  #: UDUNITS string; "1" where dimensionless
    long_name: str
    #: Computes the value from a history that has the coordinates of all asperities.
    of: Callable[[xr.Dataset], float]


def _at_peak(history: xr.Dataset) -> xr.Dataset:
    return history.isel(step=[int(history["total_normal_load"].values.argmax())])


def _approach(history: xr.Dataset) -> float:
    heights = history[
        "present_summit_height" if "present_summit_height" in history else "summit_height"
    ]
    highest = heights.transpose(..., "asperity").values.max(axis=-1, initial=-np.inf)
    return float((highest - history["separation"].values).max(initial=0.0))


def _deviation(values: xr.DataArray) -> float:
    return float(values.values.std(ddof=1)) if values.size > 1 else math.nan


def _initial_stiffness(peak: xr.Dataset) -> float:
    """Return Σ 8 G* a of the asperities that touch."""
    depth = np.maximum(peak["summit_height"].values - peak["separation"].values, 0.0)
    radius = np.sqrt(peak["summit_radius"].values * depth)
    return float(8 * peak.attrs["shear_modulus"] * radius.sum())


def _first(history: xr.Dataset) -> int:
    return int((history["contact_count"].values > 0).argmax())


# Summary values by name.
SUMMARIES = {
    "peak_normal_load": Summary(
        "N", "greatest normal load", lambda h: h["total_normal_load"].values.max()
    ),
    "peak_tangential_load": Summary(
        "N",
        "greatest tangential load, of either sign",
        lambda h: sizes(h, "total_tangential_load").max(),
    ),
    "preliminary_displacement": Summary(
        "m",
        "preliminary displacement at the greatest normal load",
        lambda h: preliminary_displacement(_at_peak(h)).values[0],
    ),
    "drift": Summary(
        "m",
        "change of the preliminary displacement between the first step in contact and the last step, either way",
        lambda h: drift(h, _first(h), -1),
    ),
    "branch_drift": Summary(
        "m",
        "branch drift between the first step in contact and the last step, without sign",
        lambda h: branch_drift(h, _first(h), -1),
    ),
    "critical_asperity": Summary(
        "1",
        "asperity that is the last to slide at the greatest normal load",
        lambda h: critical_asperity(_at_peak(h)).values[0],
    ),
    "peak_contact_count": Summary(
        "1", "greatest number of asperities in contact", lambda h: h["contact_count"].values.max()
    ),
    "peak_contact_area": Summary(
        "m2", "greatest real contact area", lambda h: h["real_contact_area"].values.max()
    ),
    "peak_approach": Summary(
        "m", "greatest approach of the highest summit from first touch", _approach
    ),
    "final_dissipated_energy": Summary(
        "J",
        "energy dissipated by friction in the whole history",
        lambda h: h["total_dissipated_energy"].values[-1],
    ),
    "presliding_work": Summary(
        "J",
        "mechanical work of pre-sliding at the greatest normal load, closed loop between ±δ",
        lambda h: presliding_work(_at_peak(h)).values[0],
    ),
    "peak_mean_pressure": Summary(
        "Pa",
        "greatest mean pressure over the real contact area",
        lambda h: total_mean_pressure(h).values.max(),
    ),
    "peak_nominal_pressure": Summary(
        "Pa",
        "greatest normal load over the nominal area",
        lambda h: nominal_pressure(h).values.max(),
    ),
    "initial_stiffness": Summary(
        "N m-1",
        "tangential stiffness at the greatest normal load, before anything slips",
        lambda h: _initial_stiffness(_at_peak(h)),
    ),
    "mean_summit_height": Summary(
        "m", "mean height of all summits", lambda h: h["summit_height"].values.mean()
    ),
    "mean_summit_radius": Summary(
        "m", "mean radius of all summits", lambda h: h["summit_radius"].values.mean()
    ),
    "summit_height_deviation": Summary(
        "m",
        "standard deviation of the heights of all summits",
        lambda h: _deviation(h["summit_height"]),
    ),
    "summit_radius_deviation": Summary(
        "m",
        "standard deviation of the radii of all summits",
        lambda h: _deviation(h["summit_radius"]),
    ),
    "summit_count": Summary("1", "number of all summits", lambda h: h.sizes["asperity"]),
}

# summary values of all summits, touching or not
OF_ALL_SUMMITS = frozenset(name for name in SUMMARIES if "summit_" in name)
# default outputs of a sweep: summary values that any contact has, also patches and contacts without
# areas
DEFAULT_OUTPUTS = tuple(SUMMARIES)[: tuple(SUMMARIES).index("presliding_work")]

# variables of each asperity along step, by name
OF_EACH = frozenset(
    variable.name for variable in known_variables() if "asperity" in variable.dimensions
)
# totals along step, by name
ROWS = frozenset(variable.name for variable in known_variables()) - OF_EACH


def chosen_outputs(names: Iterable[str]) -> tuple[str, ...]:
    """Return the outputs of these names, by default `DEFAULT_OUTPUTS`; InputError if a name is unknown."""
    names = tuple(names)
    names_known = (*SUMMARIES, *sorted(ROWS), *sorted(OF_EACH))
    for index, name in enumerate(names):
        if name not in names_known:
            raise field_error(
                f"{format_value(name)}; {nearest(str(name), names_known)}", "outputs", index
            )
    return tuple(dict.fromkeys(names)) or DEFAULT_OUTPUTS


def needs_rows(outputs: Sequence[str]) -> bool:
    """Return True if an output is a variable of each asperity."""
    return not OF_EACH.isdisjoint(outputs)


# surfaces in the memory of a process, for cells with the same surface
SURFACES_KEPT = 2


def cell(scenario: Scenario, point: Mapping[str, Any], outputs: Sequence[str] = ()) -> xr.Dataset:
    """Return the outputs of a scenario at one point of a sweep, for any engine that computes cells.

    It depends only on its arguments and on the files that the scenario names: any process gives the
    same bits.

    Parameters
    ----------
    scenario : Scenario
    point : dict
        Values of its keys, as ``{"friction.coefficient": 0.3, "surface.seed": 7}``.
    outputs : sequence of str
        As for `historysim.sweep`; by default `DEFAULT_OUTPUTS`. The attribute ``validity`` has the
        assumptions of the model that do not hold, as in a history.

    Raises
    ------
    InputError, LoadError
        As for `historysim.run`.
    """
    outputs = chosen_outputs(outputs)
    loaded = scenario.at(point)
    history = _history(loaded, with_rows=needs_rows(outputs))
    summaries: dict[str, Any] = {}
    rows = []
    for name in outputs:
        if name in SUMMARIES:
            summary = SUMMARIES[name]
            if name in OF_ALL_SUMMITS and history.sizes.get("asperity") != int(
                history.attrs["number_of_asperities"]
            ):
                raise InputError(
                    f"{name}: not all summits are recorded together with rows of each asperity; expected "
                    'record.asperities = "all", or it in a sweep without these rows'
                )
            summaries[name] = xr.Variable(
                (),
                float(summary.of(history)),
                {"long_name": summary.long_name, "units": summary.units},
            )
        elif name in history:
            rows.append(name)
        else:
            raise InputError(f"{name}: is not in the history of this scenario; {_where(name)}")
    dataset = history[rows].assign(summaries)
    dataset.attrs = {"validity": history.attrs["validity"]}
    return dataset


def _where(name: str) -> str:
    if name.endswith("slid_distance"):
        return "expected record.sliding = true, which follows it"
    return "it belongs to a contact that evolves, to another kind of contact, or to an instrument"


def _history(loaded: Scenario, *, with_rows: bool) -> xr.Dataset:
    """Return the history of a scenario: with the rows of its asperities, or with the heights of all asperities."""
    if with_rows and loaded.sections.record.asperities == "totals":
        raise InputError(
            f'{loaded.path.name}: record.asperities: "totals"; expected others, since outputs need rows of asperities'
        )
    # cells are computed by as many processes as there are processors
    job = attrs.evolve(loaded.build(surface=_surface(loaded)).replay, threads=1)
    records_rows = with_rows or not job.changes.steady
    with loaded.locate_errors():
        # the cost of totals does not depend on the number of asperities; only coordinates that
        # summaries read are added
        history = (job if records_rows else attrs.evolve(job, record="totals")).dataset()
    if records_rows:
        return history
    values = job.ensemble.coordinates
    summit_values = {
        coordinate.name: ("asperity", values[coordinate.name], coordinate.attributes)
        for coordinate in COORDINATES
        if coordinate.name in values
        and coordinate.name in {"summit_height", "summit_radius", "friction"}
    }
    return history.assign_coords({"asperity": np.arange(len(job.ensemble)), **summit_values})


_surfaces: "dict[object, BuiltSurface]" = {}


def _surface(loaded: Scenario) -> "BuiltSurface":
    """Return the surface of a scenario, built once for consecutive cells with the same surface."""
    # a surface depends on its keys and on the files that they name
    section, folder = loaded.sections.surface, loaded.path.parent
    key = (repr(section), folder, *map(stamp, find_named_files(section, folder)))
    built = _surfaces.pop(key, None) or loaded.surface()
    _surfaces[key] = built
    while len(_surfaces) > SURFACES_KEPT:
        del _surfaces[next(iter(_surfaces))]
    return built
