"""Pressures, tractions, stick and slip at each point of a contact with full interaction, at a step."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.asperities.state import EnsembleState
from historysim.basics.array_types import Floats
from historysim.basics.files import replacing
from historysim.errors import InputError
from historysim.results.analysis.recorded import position_of
from historysim.results.asking import question
from historysim.results.origin import Origin, ask_origin

Answer = TypeVar("Answer")

SEPARATED, STICKS, SLIPS = 0, 1, 2
SOLVED = "solved_pressure"  # what the surface of a result holds where its asperities press on one another


@attrs.frozen(eq=False)
class PointMaps:
    """A contact, point by point: arrays (x, y)."""

    pressure: Floats
    traction: Floats
    """pressure and traction: [Pa], 0 where nothing touches; the traction has the sign of the tangential load."""
    contact_state: npt.NDArray[np.int8]
    """`SEPARATED`, `STICKS` or `SLIPS`."""


def maps_of(origin: Origin, state: EnsembleState) -> PointMaps:
    """Return the maps of a state of the contact that a history comes from."""
    arrays, shape = origin.surface, origin.settings["surface_attributes"]["shape"]
    found, modulus = origin.ensemble.superposition(state), origin.ensemble.pair.contact_modulus
    first_touch, point = arrays["first_touch"], arrays["point"].astype(np.int64)
    maps = np.zeros((3, int(np.prod(shape))))
    maps[0, point] = found.normal @ arrays[SOLVED] * modulus
    maps[1, point] = found.tangential @ arrays[SOLVED] * modulus
    zone = np.where(first_touch <= found.stick_approach, STICKS, SLIPS)
    maps[2, point] = np.where(first_touch <= found.approach, zone, SEPARATED)
    pressure, traction, contact_state = maps.reshape(3, *shape)
    # a point begins to touch between two solutions, whose pressures are blended there
    return PointMaps(pressure, traction, contact_state.astype(np.int8))


def sides_of(origin: Origin) -> tuple[float, float]:
    """Return the lengths of the map [m]: the last point is one step before the end."""
    x, y = (np.asarray(origin.surface[name]) for name in ("x", "y"))
    return float(x[-1] + x[1] - x[0]), float(y[-1] + y[1] - y[0])


def answered(history: xr.Dataset, question: Callable[[Origin], Answer]) -> Answer:
    """Return what the origin of a history with maps answers; InputError where it has no origin, or no maps."""
    found = ask_origin(history, lambda origin: (origin, question(origin) if SOLVED in origin.surface else None))
    if found is None:
        raise InputError(
            "contact maps need the event log: pass the file written by `historysim run`, or keep NAME.history beside it"
        )
    origin, answer = found
    if answer is None:
        raise InputError(
            f'{origin.settings["title"]}: has no contact maps; expected a surface with interaction = "full"'
        )
    return answer


@question(table="x,pressure")
def point_maps(history: xr.Dataset, step: int = -1) -> xr.Dataset:
    """Return pressures, tractions, stick and slip of all points of the map at a step.

    ``pressure`` and ``traction`` [Pa] and ``contact_state`` along ``x`` and ``y`` [m], of a run with
    ``interaction = "full"``, from its file. The step is a position; negative ones count from the end.

    InputError: a step that the history does not have, or a history that is not from a file with its events, or without
    maps.
    """
    step = position_of(step, history)
    at = float(history["time"].values[step])
    maps, sides = answered(history, lambda origin: (maps_of(origin, origin.state(at)), sides_of(origin)))
    axes = {
        name: (name, np.arange(size) * side / size, {"units": "m", "long_name": f"position along {name}"})
        for name, size, side in zip("xy", maps.pressure.shape, sides, strict=True)
    }
    flags = {
        "flag_values": np.array([SEPARATED, STICKS, SLIPS], dtype=np.int8),
        "flag_meanings": "separated sticks slips",
    }
    variables: dict[str, Any] = {
        "pressure": (("x", "y"), maps.pressure, {"units": "Pa", "long_name": "contact pressure"}),
        "traction": (("x", "y"), maps.traction, {"units": "Pa", "long_name": "tangential traction"}),
        "contact_state": (("x", "y"), maps.contact_state, {"long_name": "whether points touch, and slip", **flags}),
    }
    return xr.Dataset(variables, axes, {"title": history.attrs.get("title", ""), "time": at, "step": step})


def write_vtk(maps: xr.Dataset, path: str | Path) -> None:
    """Write what `point_maps` returns as a mesh of squares, one for each point, which ParaView opens (VTU)."""
    try:
        import meshio
    except ImportError as error:
        raise InputError(
            'a file for ParaView needs an extra; expected pip install "historysim[vtk]", or a netCDF file (.nc)'
        ) from error
    edges = []
    for name in ("x", "y"):
        at = maps[name].values
        step = at[1] - at[0]
        edges.append(np.append(at, at[-1] + step) - 0.5 * step)
    corners = np.stack(np.meshgrid(*edges, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    nx, ny = maps.sizes["x"], maps.sizes["y"]
    first = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    squares = np.stack([first, first + ny + 1, first + ny + 2, first + 1], axis=1)
    values = {str(name): [each.values.ravel()] for name, each in maps.data_vars.items()}
    mesh = meshio.Mesh(corners, [("quad", squares)], cell_data=values)
    with replacing(Path(path)) as unfinished:
        meshio.write(unfinished, mesh, file_format="vtu")
