"""Quantities recomputed by replay: traction memory of an asperity, maps of full interaction, theory curves.

Contacts move straight in approach and displacement between recorded steps as a rule, so the memory
of one asperity is replayed from those; where its loads then differ from the recorded ones, the
events are replayed.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.asperities.asperity import Asperity
from historysim.asperities.asperity_set import AsperitySet, require_asperities
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.patches import Patches
from historysim.asperities.readout import Readout
from historysim.asperities.state import State
from historysim.basics.arguments import DIRECTION, Floats, scalar
from historysim.basics.units import seconds
from historysim.contact.greenwood_williamson import GreenwoodWilliamson, summit_contact
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.loads.events import NormalDisplacement
from historysim.memory.binding import DISPLACED
from historysim.memory.paths import Goals, blank_rows, straight_paths
from historysim.replaying import Replay
from historysim.results.analysis.recorded import (
    check_recorded,
    describe,
    find_column,
)
from historysim.results.queries import query
from historysim.results.source import ReplaySource, query_source
from historysim.results.steps import find_step, resolve_step

# difference of loads, over the greatest ones, up to which a memory replayed from steps is that of
# the history
AGREEMENT = 1e-6
STEPS_AT_ONCE = 1 << 16  # steps whose paths and rows are held in memory together


@query(per_step=True, table=None, planar=True)
def asperity(
    history: xr.Dataset,
    asperity: int,
    step: int | str | None = None,
    *,
    time: float | str | None = None,
    state: str | None = None,
) -> Asperity:
    """Return an asperity of a history with its traction memory, as an `Asperity`.

    It has ``traction(r)``, ``reversal_points``, and more. The last step is the default.

    Parameters
    ----------
    history : xarray.Dataset
        A history with this asperity, that begins with the first contact.
    asperity : int
        Its label.
    step : int or str, optional
        Position of the step, where negative ones count from the end, or the name of a state.
    time : float or str, optional
        In place of a step, a time [s]: of a recorded step, or any time of a history with its
        events.
    state : str, optional
        In place of a step, the name of a state of the scenario.

    Raises
    ------
    InputError
        A step, a time or an asperity that the history does not have, several of step, time and
        state, a history without asperities or of patches, or one whose steps leave out part of the
        load history, without events in its file.
    """
    chosen = [
        name
        for name, value in (("step", step), ("time", time), ("state", state))
        if value is not None
    ]
    if len(chosen) > 1:
        raise InputError(f"{' and '.join(chosen)} are given; expected one of step, time and state")
    position: int | str = -1
    if time is not None:
        at = seconds(time)
        recorded = find_step(history, at)
        if recorded is None:
            return _between_steps(history, asperity, at)
        position = recorded
    elif chosen:
        position = step if state is None else state  # type: ignore[assignment] # one of them is given
    (result,) = replay_asperities(history, asperity, [position])
    return result


def _between_steps(history: xr.Dataset, asperity: int, time: float) -> Asperity:
    """Return an asperity at a time between recorded steps, replayed from the events of the history."""
    check_recorded(history, "summit_radius")
    times = history["time"].values
    column = find_column(asperity, history)
    if not times[0] <= time <= times[-1]:
        raise InputError(
            f"time {time:g}: the history has {times[0]:g} s to {times[-1]:g} s; expected a time in between"
        )
    asperities = _from_events(history, int(history["asperity"].values[column]), [time])
    if asperities is None:
        upper = int(np.searchsorted(times, time))
        raise InputError(
            f"time {time:g}: no step is recorded then, and the history does not come from a file with its events; "
            f"expected a recorded time, such as {times[upper - 1]:g} s (step {upper - 1}) or {times[upper]:g} s"
        )
    return asperities[0]


def replay_asperities(
    history: xr.Dataset, asperity: int, steps: Sequence[int | str]
) -> list[Asperity]:
    """Return one asperity at several steps; parameters and errors as for `asperity`."""
    check_recorded(
        history, "normal_load", "tangential_load", "summit_radius", "summit_height", "friction"
    )
    column = find_column(asperity, history)
    positions = [resolve_step(step, history) for step in steps]
    # in two directions the path between steps is unknown
    result = None if DIRECTION in history.sizes else _from_steps(history, column, positions)
    if result is None:
        result = _from_events(
            history,
            int(history["asperity"].values[column]),
            history["time"].values[positions].tolist(),
        )
    if result is None:
        raise InputError(
            f"asperity {asperity}: the recorded steps leave out part of its load history, and the history does not "
            "come from a file that holds its events; expected the result of historysim run, or more substeps"
        )
    return result


@query(per_step=True, table="reversal,radius")
def reversal_points(history: xr.Dataset, asperity: int, step: int | str) -> xr.Dataset:
    """Return the reversals in the traction memory of an asperity at a step, from the edge inward.

    Along ``reversal``: ``radius``, the stick radius at the reversal [m], and ``displacement``, the
    tangential displacement of the reversal [m]; see `Asperity.reversal_points`. Parameters and
    errors: `asperity`.
    """
    (at_step,) = replay_asperities(history, asperity, [step])
    points = at_step.reversal_points
    variables = {
        "radius": describe("reversal", points.radius, "stick radius at the reversal", "m"),
        "displacement": describe("reversal", points.displacement, "displacement U there", "m"),
    }
    return xr.Dataset(variables, {"reversal": np.arange(points.size)})


@query(per_step=True, table="radius,pressure")
def profiles(
    history: xr.Dataset, asperity: int, steps: int | str | Sequence[int | str], points: int = 201
) -> xr.Dataset:
    """Return pressure and traction over the radius of an asperity, at one step or at several.

    Parameters
    ----------
    history, asperity
        As for `asperity`.
    steps : int or str, or a sequence of them
        Positions of the steps, where negative ones count from the end, or names of states.
    points : int
        Of the radius, evenly from the middle to the largest of the contact radii; 2 or more.

    Returns
    -------
    xarray.Dataset
        Along ``step`` and ``radius`` [m]: ``pressure`` p(r), ``traction`` τ(r) with the sign of the
        tangential load, and ``friction_limit`` μ p(r), all in Pa; 0 outside the contact. Along
        ``step``: ``time``, ``contact_radius``, ``stick_radius``, and the positions of the steps.

    Raises
    ------
    InputError
        As for `asperity`, or a number of points that is no whole number of 2 or more.
    """
    if not isinstance(points, int | np.integer) or points < 2:
        raise InputError(f"points is {points!r}; expected a whole number of 2 or more")
    chosen = [steps] if isinstance(steps, int | np.integer | str) else list(steps)
    if not chosen:
        raise InputError("steps is empty; expected one step or more")
    asperities = replay_asperities(history, asperity, chosen)
    positions = [resolve_step(step, history) for step in chosen]
    radius = np.linspace(0.0, max(contact.contact_radius for contact in asperities), points)
    pressure = np.array([contact.pressure(radius) for contact in asperities])
    traction = np.array([contact.traction(radius) for contact in asperities])
    limit = pressure * np.array([[contact.friction] for contact in asperities])
    along = ("step", "radius")
    variables = {
        "pressure": describe(along, pressure, "normal pressure", "Pa"),
        "traction": describe(along, traction, "tangential traction", "Pa"),
        "friction_limit": describe(along, limit, "friction limit of the traction", "Pa"),
        "contact_radius": describe(
            "step", [contact.contact_radius for contact in asperities], "contact radius", "m"
        ),
        "stick_radius": describe(
            "step", [contact.stick_radius for contact in asperities], "stick radius", "m"
        ),
    }
    coords = {
        "step": describe("step", positions, "position of the step in the history"),
        "radius": describe("radius", radius, "distance from the middle of the contact", "m"),
        "time": ("step", history["time"].values[positions], history["time"].attrs),
    }
    return xr.Dataset(variables, coords, {"asperity": int(asperity)})


def _from_steps(
    history: xr.Dataset, column: int, positions: Sequence[int]
) -> list[Asperity] | None:
    """Return the asperity at steps, replayed from step to step; None where its loads differ from the recorded ones."""
    if "largest_traction_ratio" in history:
        # where friction changes under a held load the displacement jumps, and a step records its
        # end only
        return None
    rows = slice(0, max(positions) + 1)
    column_data = history.isel(asperity=column)
    height = float(column_data["summit_height"])
    highest = float(history["summit_height"].max())
    pair = MaterialPair.from_moduli(
        contact_modulus=float(history.attrs["contact_modulus"]),
        shear_modulus=float(history.attrs["shear_modulus"]),
    )
    # no other asperity affects this traction memory
    single = Ensemble(
        pair, height, float(column_data["summit_radius"]), float(column_data["friction"])
    )
    approach = height - history["separation"].isel(step=rows).values
    displacement = history["tangential_displacement"].isel(step=rows).values
    recorded = np.stack(
        [column_data[name].isel(step=rows).values for name in ("normal_load", "tangential_load")]
    )
    # before the first step the highest summit just touched
    state = single.advance(
        single.initial_state(), normal_displacement=height - highest, tangential_displacement=0.0
    )
    replayed: dict[int, Asperity] = {}
    loads = np.empty_like(recorded)
    start = 0
    for stop in sorted({*positions, *range(STEPS_AT_ONCE, max(positions), STEPS_AT_ONCE)}):
        block = slice(start, stop + 1)
        paths = straight_paths(
            Goals(DISPLACED, approach[block]), Goals(DISPLACED, displacement[block])
        )
        path_rows = blank_rows(stop + 1 - start, 1)
        state = single.advance_along(state, paths, rows=path_rows, asperities=[0])
        loads[:, block] = path_rows.normal_load[:, 0], path_rows.tangential_load[:, 0]
        if stop in positions:
            replayed[stop] = Asperity.from_readout(
                Readout(single, state, [0]), 0, int(column_data["asperity"])
            )
        start = stop + 1
    off = np.abs(loads - recorded).max(axis=1)
    return (
        None
        if (off > AGREEMENT * np.abs(recorded).max(axis=1)).any()
        else [replayed[step] for step in positions]
    )


def _from_events(history: xr.Dataset, label: int, times: Sequence[float]) -> list[Asperity] | None:
    """Return the asperity at times [s], replayed from the events of the history; None if it has none."""
    return query_source(
        history,
        lambda origin: [
            require_asperities(origin.job.ensemble).asperity(label, origin.state(time))
            for time in times
        ],
    )


Answer = TypeVar("Answer")

SEPARATED, STICKS, SLIPS = 0, 1, 2
SOLVED = "solved_pressure"  # variable of the surface of a result with interacting asperities


class PointMaps(NamedTuple):
    """A contact, point by point: arrays (x, y); pressure and traction [Pa] are 0 where nothing touches."""

    pressure: Floats
    traction: Floats  #: with the sign of the tangential load
    contact_state: npt.NDArray[np.int8]  #: `SEPARATED`, `STICKS` or `SLIPS`


def compute_point_maps(origin: ReplaySource, state: State) -> PointMaps:
    """Return the maps of a state of the contact that a history comes from."""
    arrays = origin.surface
    shape = origin.settings["surface_attributes"]["shape"]
    ensemble = origin.job.ensemble
    if not isinstance(ensemble, Patches):
        raise InputError(
            "the ensemble has no normal curves; expected an ensemble from normal curves"
        )
    position = ensemble.superposition(state)
    modulus = ensemble.pair.contact_modulus
    first_touch = arrays["first_touch"]
    point = arrays["point"].astype(np.int64)
    maps = np.zeros((3, int(np.prod(shape))))
    maps[0, point] = position.normal @ arrays[SOLVED] * modulus
    maps[1, point] = position.tangential @ arrays[SOLVED] * modulus
    zone = np.where(first_touch <= position.stick_approach, STICKS, SLIPS)
    maps[2, point] = np.where(first_touch <= position.approach, zone, SEPARATED)
    pressure, traction, contact_state = maps.reshape(3, *shape)
    # a point begins to touch between two solutions, whose pressures are blended there
    return PointMaps(pressure, traction, contact_state.astype(np.int8))


def map_sides(origin: ReplaySource) -> tuple[float, float]:
    """Return the lengths of the map [m]: the last point is one step before the end."""
    x, y = (np.asarray(origin.surface[name]) for name in ("x", "y"))
    return float(x[-1] + x[1] - x[0]), float(y[-1] + y[1] - y[0])


def query_map_source(history: xr.Dataset, function: Callable[[ReplaySource], Answer]) -> Answer:
    """Evaluate a function of the source of a history with maps; InputError without source or maps."""
    reply = query_source(
        history, lambda origin: (origin, function(origin) if SOLVED in origin.surface else None)
    )
    if reply is None:
        raise InputError(
            "contact maps need the event log: pass the file written by `historysim run`, or keep "
            "NAME.history next to it"
        )
    origin, answer = reply
    if answer is None:
        raise InputError(
            f"{origin.settings.get('title') or 'the history'}: has no contact maps; expected a surface with "
            'interaction = "full"'
        )
    return answer


@query(table="x,pressure")
def point_maps(history: xr.Dataset, step: int | str = -1) -> xr.Dataset:
    """Return pressures, tractions, stick and slip of all points of the map at a step.

    ``pressure`` and ``traction`` [Pa] and ``contact_state`` along ``x`` and ``y`` [m], of a run
    with ``interaction = "full"``, from its file. The step is a position, where negative ones count
    from the end, or the name of a state.

    InputError: a step that the history does not have, or a history that is not from a file with its
    events, or without maps.
    """
    step = resolve_step(step, history)
    at = float(history["time"].values[step])
    maps, sides = query_map_source(
        history, lambda origin: (compute_point_maps(origin, origin.state(at)), map_sides(origin))
    )
    axes = {
        name: describe(name, np.arange(size) * side / size, f"position along {name}", "m")
        for name, size, side in zip("xy", maps.pressure.shape, sides, strict=True)
    }
    along = ("x", "y")
    variables = {
        "pressure": describe(along, maps.pressure, "contact pressure", "Pa"),
        "traction": describe(along, maps.traction, "tangential traction", "Pa"),
        "contact_state": describe(along, maps.contact_state, "whether points touch, and slip"),
    }
    flags = np.array([SEPARATED, STICKS, SLIPS], dtype=np.int8)
    variables["contact_state"][2].update(flag_values=flags, flag_meanings="separated sticks slips")
    return xr.Dataset(
        variables, axes, {"title": history.attrs.get("title", ""), "time": at, "step": step}
    )


FEWEST_OF_GREENWOOD_WILLIAMSON = 20  # summits, below which a deviation of their heights says little
CURVES = {
    "normal_load": ("normal load", "N"),
    "contact_area": ("real contact area", "m2"),
    "normal_stiffness": ("normal stiffness", "N m-1"),
}


@query(table="approach,normal_load")
def load_curve(history: xr.Dataset, points: int = 101) -> xr.Dataset:
    """Return normal load, real contact area and normal stiffness over the approach, on first loading.

    ``normal_load`` [N], ``contact_area`` [m²], ``normal_stiffness`` dN/dδ [N/m] and
    ``contact_count`` along ``approach`` [m] of the highest summit, or the cylinder, evenly up to
    that at the greatest load of the history; the area is left out if it is unknown.
    ``theory_normal_load`` and so on hold, for 20 summits or more, the integrals of Greenwood and
    Williamson with the mean radius, and the mean and deviation of the heights, of all summits; for
    fewer the highest summit, after Hertz. The attribute ``theory`` names the theory; patches have
    none.

    Raises
    ------
    InputError
        A history without its file or replay, without a normal load, or fewer than two points.
    """
    check_recorded(history)
    count = int(scalar("points", points, least=2))
    largest = float(history["total_normal_load"].values.max(initial=0.0))
    if largest == 0:
        raise InputError(
            "the history has no normal load, so it has no approach; expected one that presses"
        )

    def curve(origin: ReplaySource) -> xr.Dataset:
        ensemble = origin.job.ensemble
        state = ensemble.initial_state()
        approach = np.linspace(0.0, ensemble.advance(state, normal_load=largest).approach, count)
        events = [
            NormalDisplacement(float(step), depth) for step, depth in enumerate(approach.tolist())
        ]
        rows = Replay(ensemble, events, record="totals").dataset()
        stiffness = np.zeros(count)
        for step, depth in enumerate(approach[1:].tolist(), start=1):
            state = ensemble.advance(state, normal_displacement=depth)
            stiffness[step] = state.normal_stiffness
        theory, theory_values = (
            _theory(require_asperities(ensemble), approach) if ensemble.has_radii else ("", {})
        )
        simulated: dict[str, Any] = {
            "normal_load": rows["total_normal_load"],
            "contact_area": rows.get("real_contact_area"),
        }
        simulated["normal_stiffness"] = stiffness
        curves = [(name, *of) for name, of in CURVES.items() if simulated[name] is not None]
        data = {
            name: describe("approach", np.asarray(simulated[name]), text, unit)
            for name, text, unit in curves
        }
        for name, text, unit in curves if theory_values else []:
            data[f"theory_{name}"] = describe(
                "approach", theory_values[name], f"{text}, {theory}", unit
            )
        data["contact_count"] = describe(
            "approach", rows["contact_count"].values, "asperities in contact"
        )
        what = "highest summit" if ensemble.line_length is None else "cylinder"
        along = describe("approach", approach, f"approach of the {what} from first touch", "m")
        attributes = {"title": history.attrs.get("title", ""), "theory": theory}
        return xr.Dataset(data, {"approach": along}, attributes)

    result = query_source(history, curve)
    if result is None:
        raise InputError(
            "the load curve needs the contact itself: pass the file written by historysim run, or the history returned "
            "by hs.run or hs.replay"
        )
    return result


def _theory(ensemble: AsperitySet, approach: Floats) -> tuple[str, dict[str, Floats]]:
    """Return the name of a theory, and load, area and stiffness that it gives at approaches of the highest summit."""
    height = ensemble.summit_height
    modulus = ensemble.pair.contact_modulus
    radius = np.broadcast_to(ensemble.summit_radius, height.shape)
    greenwood_williamson = _greenwood_williamson(ensemble)
    if greenwood_williamson is None:
        highest = height == height.max()
        hertz_contact = summit_contact(
            height[highest], radius[highest], height.max() - approach, contact_modulus=modulus
        )
        name = "the highest summit alone, after Hertz" if height.size > 1 else "Hertz"
        return name, {key: getattr(hertz_contact, key) for key in CURVES}
    separation = height.max() - approach
    return "Greenwood and Williamson", {
        key: getattr(greenwood_williamson, key)(separation) for key in CURVES
    }


def _greenwood_williamson(ensemble: AsperitySet) -> GreenwoodWilliamson | None:
    """Return the theory with means and deviation of all summits; None of fewer than 20, or of one level."""
    height = ensemble.summit_height
    if height.size < FEWEST_OF_GREENWOOD_WILLIAMSON or np.ptp(height) == 0:
        return None
    radius = float(np.broadcast_to(ensemble.summit_radius, height.shape).mean())
    modulus = ensemble.pair.contact_modulus
    return GreenwoodWilliamson(
        modulus, radius, float(height.std()), height.size, 1.0, float(height.mean())
    )
