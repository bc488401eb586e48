"""Tangential stiffness along the path, of each asperity."""

from typing import TYPE_CHECKING

from historysim.errors import InputError
from historysim.results.analysis.recorded import check_recorded

if TYPE_CHECKING:
    import xarray as xr

RADIUS = {"onward": "stick_radius", "reversed": "contact_radius"}


def tangential_stiffness(history: "xr.Dataset", direction: str = "onward") -> "xr.DataArray":
    """Return the tangential stiffness of each asperity at each step, at a fixed approach.

    An asperity whose stick zone has the radius c has 8 G* c while the displacement goes on, which is 0 where it slides;
    where the displacement turns round, what slid sticks again and it has 8 G* a (Mindlin 1949). The sum over all
    asperities that touch is the recorded ``tangential_stiffness`` (onward), except where a fall of friction lets discs
    inside a stick zone slide.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities.
    direction : {"onward", "reversed"}
        Whether the displacement goes on as it does, or turns round.

    Returns
    -------
    xarray.DataArray
        dT/dU [N/m] along ``step`` and ``asperity``, computed where it is read; 0 where an asperity does not touch.

    Raises
    ------
    InputError
        Another direction, or a history without asperities or of patches.
    """
    from historysim.results.analysis.derived import derived

    if direction not in RADIUS:
        raise InputError(f"direction is {direction!r}; expected 'onward' or 'reversed'")
    check_recorded(history, RADIUS[direction])
    factor = 8 * float(history.attrs["shear_modulus"])
    return derived(
        history,
        "tangential_stiffness",
        lambda radius: factor * radius,
        [RADIUS[direction]],
        units="N m-1",
        long_name=f"tangential stiffness of the asperity, displacement {direction}",
    )
