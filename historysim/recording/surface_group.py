"""Group ``surface`` of a result: summits, and the height map if there is one."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.basics.arguments import Array
from historysim.recording.netcdf import put_attributes, put_variable
from historysim.recording.variables import Variable

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

    from historysim.interaction.solutions import NormalSolutions
    from historysim.surfaces.heights import Surface
    from historysim.surfaces.summits import Summits

GROUP = "surface"
# Points of a height map stored along each axis, and of a whole profile: the resolution of a picture.
MOST_POINTS = 512

SURFACE = (
    Variable("x", ("x",), "m", "position along x"),
    Variable("y", ("y",), "m", "position along y"),
    Variable("height", ("x", "y"), "m", "height of the surface"),
)
# All summits; ``asperity`` in the history is their index.
SUMMITS = (
    Variable("summit_height", ("summit",), "m", "height of the summit"),
    Variable("summit_radius", ("summit",), "m", "radius of the summit"),
    Variable("summit_x", ("summit",), "m", "position of the summit along x"),
    Variable("summit_y", ("summit",), "m", "position of the summit along y"),
)
# The normal contact of a map with full interaction.
SOLUTIONS = (
    Variable("point", ("point",), "1", "index of the point in the height map, along y first"),
    Variable("point_patch", ("point",), "1", "patch that the point belongs to"),
    Variable("first_touch", ("point",), "m", "approach at which the point first touches"),
    Variable("solved_approach", ("solution",), "m", "approach of a solution of the normal contact"),
    Variable("solved_pressure", ("solution", "point"), "1", "pressure over the contact modulus"),
)
VARIABLES = (*SURFACE, *SUMMITS, *SOLUTIONS)


def contents(
    summits: "Summits | None",
    surface: "Surface | None" = None,
    solutions: "NormalSolutions | None" = None,
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the arrays of the group by their names, and its attributes.

    They are all summits; the map that they were found on, every so many-th point (``thinning``);
    and of a map with full interaction the points that touch and their pressures in place of
    summits.
    """
    values: list[Array | None] = [None] * len(VARIABLES)
    first_surface = len(SURFACE)
    attributes: dict[str, Any] = {}
    if summits is not None and summits.nominal_area:
        attributes["nominal_area"] = summits.nominal_area
    if summits is not None and solutions is None:
        values[first_surface : first_surface + len(SUMMITS)] = (
            summits.height,
            summits.radius,
            summits.x,
            summits.y,
        )
    if solutions is not None:
        points = (solutions.point, solutions.patch, solutions.first_touch)
        values[-len(SOLUTIONS) :] = *points, solutions.approach, solutions.pressure
        attributes |= {
            "shape": list(solutions.shape),
            "change_of_area_at_half_the_points": solutions.coarse[1],
        }
        attributes["periodic"] = int(surface is not None and surface.periodic)
    if surface is not None:
        maximum = MOST_POINTS**2 if 1 in surface.shape else MOST_POINTS
        attributes["thinning"] = strides = [-(-size // maximum) for size in surface.shape]
        lines = zip(surface.shape, strides, surface.pixel_size, strict=True)
        x, y = (np.arange(0, size, stride) * pixel for size, stride, pixel in lines)
        values[:first_surface] = x, y, surface.heights[:: strides[0], :: strides[1]]
    named = zip(VARIABLES, values, strict=True)
    return {
        variable.name: array.astype(np.float64, copy=False)
        for variable, array in named
        if array is not None
    }, attributes


def dataset(
    summits: "Summits | None",
    surface: "Surface | None" = None,
    solutions: "NormalSolutions | None" = None,
) -> "xr.Dataset":
    """Return the group as a Dataset, with dimensions ``summit`` and, with a map, ``x`` and ``y``."""
    import xarray as xr

    arrays, attributes = contents(summits, surface, solutions)
    variables = {
        variable.name: xr.Variable(
            variable.dimensions,
            arrays[variable.name],
            variable.attributes,
            {"_FillValue": _missing(variable) or None},
        )
        for variable in VARIABLES
        if variable.name in arrays
    }
    return xr.Dataset(variables, attrs=_is_kept(attributes))


def write(
    file: "netCDF4.Dataset", arrays: Mapping[str, Array], attributes: Mapping[str, Any]
) -> None:
    """Write the arrays of `contents` into the group ``surface`` of an open file."""
    group = file.createGroup(GROUP)
    put_attributes(group, _is_kept(attributes))
    for variable in VARIABLES:
        if variable.name in arrays:
            put_variable(
                group,
                variable.name,
                variable.dimensions,
                arrays[variable.name],
                variable.attributes,
                fill_value=_missing(variable),
            )


def _is_kept(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: np.array(value, dtype=np.int32) if isinstance(value, list) else value
        for key, value in attributes.items()
    }


def _missing(variable: Variable) -> float | bool:
    """Return the fill value of a variable: NaN for heights, False for variables without missing values."""
    return np.nan if variable.name == "height" else False
