"""Shares of the contacts, of their area and of the load that stick, slip in part, or slide."""

from typing import TYPE_CHECKING

import numpy as np

from historysim.results.analysis.recorded import STATES, check_recorded
from historysim.results.analysis.step_blocks import blocks

if TYPE_CHECKING:
    import xarray as xr

SHARES = {
    "share_of_contacts": "share of the contacts in each slip state",
    "share_of_area": "share of the contact area that asperities in each slip state have",
    "share_of_normal_load": "share of the normal load that asperities in each slip state carry",
    "share_of_tangential_load": "share of the tangential load that asperities in each slip state carry",
}


def slip_shares(history: "xr.Dataset") -> "xr.Dataset":
    """Return which shares of the contacts, of area and load are in each slip state, and which share of the area slips.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities or patches; where only some are recorded, the shares are of those.

    Returns
    -------
    xarray.Dataset
        Along ``step`` and ``slip_state`` (full_stick, partial_slip, gross_slip), each row with a sum of 1, or of 0
        where nothing touches: ``share_of_contacts``, ``share_of_area``, ``share_of_normal_load`` and
        ``share_of_tangential_load``, the last by the magnitude of each asperity's. Along ``step`` alone:
        ``slipping_area``, the share of the contact area outside the stick radii, also inside contacts in partial slip.

    Raises
    ------
    InputError
        A history without asperities, or of patches without areas.
    """
    import xarray as xr

    patches = "contact_area" in history
    sizes = ("contact_area", "stick_area") if patches else ("contact_radius", "stick_radius")
    names = ("slip_state", *sizes, "normal_load", "tangential_load")
    check_recorded(history, *names)
    steps = history.sizes["step"]
    shares = np.zeros((len(SHARES), steps, len(STATES)))
    slipping = np.zeros(steps)
    for first, block in blocks(history, names):
        state, area, stick, normal, tangential = (block[name].values for name in names)
        if not patches:
            # π falls out of a share
            area, stick = area**2, stick**2
        here = slice(first, first + len(state))
        whole = area.sum(axis=1)
        np.divide(whole - stick.sum(axis=1), whole, out=slipping[here], where=whole > 0)
        for number, weight in enumerate((state > 0, area, normal, np.abs(tangential))):
            parts = np.stack([np.where(state == value, weight, 0.0).sum(axis=1) for value in (1, 2, 3)], axis=1)
            total = parts.sum(axis=1, keepdims=True)
            np.divide(parts, total, out=shares[number, here], where=total > 0)
    variables = {
        name: (("step", "slip_state"), values, {"units": "1", "long_name": text})
        for (name, text), values in zip(SHARES.items(), shares, strict=True)
    }
    text = "share of the contact area outside the stick radii"
    return xr.Dataset(
        {**variables, "slipping_area": ("step", slipping, {"units": "1", "long_name": text})},
        coords={"time": history["time"], "slip_state": list(STATES)},
    )


def telling_step(history: "xr.Dataset") -> int:
    """Return the step whose contact map shows most: where half of the contact area slips, or nearest to that.

    Parameters
    ----------
    history : xarray.Dataset
        As for `slip_shares`.

    Returns
    -------
    int
        The position of the first such step; that of the greatest normal load where no contact ever slips in part.

    Raises
    ------
    InputError
        As for `slip_shares`.
    """
    slipping = slip_shares(history)["slipping_area"].values
    if ((slipping > 0) & (slipping < 1)).any():
        return int(np.abs(slipping - 0.5).argmin())
    return int(history["total_normal_load"].values.argmax())
