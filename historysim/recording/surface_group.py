"""The surface beside the history: its summits, and its height map where there is one, as a group of a result."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.interaction.solutions import NormalSolutions
from historysim.recording.variables import SOLUTIONS, SUMMITS, SURFACE, Variable
from historysim.surfaces.heights import Surface
from historysim.surfaces.summits import Summits

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

GROUP = "surface"
MOST_POINTS = 512
"""Points of a height map along each axis that are kept, and as many in all of a profile: what a picture can show."""

Array = npt.NDArray[Any]


def dataset(
    summits: Summits | None, surface: Surface | None = None, solutions: NormalSolutions | None = None
) -> "xr.Dataset":
    """Return summits, and the height map thinned to what a picture can show, as a Dataset.

    Parameters
    ----------
    summits : Summits, optional
        All summits, in the order of the ensemble; of a contact that is no ensemble of summits, none are kept.
    surface : Surface, optional
        The map that they were found on.
    solutions : NormalSolutions, optional
        Of a map whose asperities press on one another: the points that touch, and their pressures.

    Returns
    -------
    xarray.Dataset
        Dimensions ``summit`` and, with a map, ``x`` and ``y``; see `historysim.recording.variables`. The attribute
        ``thinning``
        says that every so many-th point of the map is kept along x and along y.
    """
    arrays: dict[str, Array] = {}
    attributes: dict[str, Any] = {}
    if summits is not None and summits.nominal_area:
        attributes["nominal_area"] = summits.nominal_area
    if summits is not None and solutions is None:
        columns = (summits.height, summits.radius, summits.x, summits.y)
        arrays |= {
            variable.name: column for variable, column in zip(SUMMITS, columns, strict=True) if column is not None
        }
    if solutions is not None:
        points = (solutions.point, solutions.patch, solutions.first_touch)
        solved = (solutions.approach, solutions.pressure)
        for variable, values in zip(SOLUTIONS, (*points, *solved), strict=True):
            arrays[variable.name] = values.astype(np.float64)
        attributes |= {"shape": list(solutions.shape), "change_of_area_at_half_the_points": solutions.coarse[1]}
        attributes["periodic"] = int(surface is not None and surface.periodic)
    if surface is not None:
        most = MOST_POINTS**2 if 1 in surface.shape else MOST_POINTS
        strides = [-(-size // most) for size in surface.shape]
        axes = (
            np.arange(0, size, stride) * pixel
            for size, stride, pixel in zip(surface.shape, strides, surface.pixel_size, strict=True)
        )
        heights = surface.heights[:: strides[0], :: strides[1]]
        arrays |= zip((variable.name for variable in SURFACE), (*axes, heights), strict=True)
        attributes["thinning"] = strides
    return from_arrays(arrays, attributes)


def from_arrays(arrays: Mapping[str, Array], attributes: Mapping[str, Any]) -> "xr.Dataset":
    """Return what `dataset` gives from the arrays of its variables."""
    import xarray as xr

    variables = {
        variable.name: xr.Variable(
            variable.dimensions,
            arrays[variable.name],
            variable.attributes,
            encoding={"_FillValue": _fill_value(variable)},
        )
        for variable in (*SURFACE, *SUMMITS, *SOLUTIONS)
        if variable.name in arrays
    }
    kept = {
        key: np.array(value, dtype=np.int32) if isinstance(value, list) else value for key, value in attributes.items()
    }
    return xr.Dataset(variables, attrs=kept)


def _fill_value(variable: Variable) -> float | None:
    """Give what stands for a missing value: NaN for heights; nothing else is ever missing."""
    return np.nan if variable.name == "height" else None


def write(file: "netCDF4.Dataset", content: "xr.Dataset") -> None:
    """Write what `dataset` gives into the group ``surface`` of an open file.

    What stands there is the same as what ``to_netcdf`` makes of it.
    """
    group = file.createGroup(GROUP)
    group.setncatts(content.attrs)
    for name, size in content.sizes.items():
        group.createDimension(str(name), size)
    for variable in (*SURFACE, *SUMMITS, *SOLUTIONS):
        if variable.name in content.variables:
            fill = _fill_value(variable)
            made = group.createVariable(
                variable.name,
                variable.dtype,
                variable.dimensions,
                fill_value=False if fill is None else fill,
                compression="zlib",
            )
            made.setncatts(variable.attributes)
            made[:] = content[variable.name].values
