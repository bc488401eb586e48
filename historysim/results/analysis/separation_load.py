"""Pull-off of a contact whose asperities attract."""

from typing import TYPE_CHECKING

import numpy as np

from historysim.errors import InputError
from historysim.results.analysis.recorded import describe
from historysim.results.queries import query

if TYPE_CHECKING:
    import xarray as xr


@query(table="approach,normal_load", planar=True)
def pull_off(history: "xr.Dataset", points: int = 201) -> "xr.Dataset":
    """Return the load from outside on the way back from the largest approach of the history, and where it pulls off.

    ``normal_load`` [N] and ``attraction`` [N] along ``approach`` [m], falling from the largest one
    to the first touch; attributes ``pull_off_load`` [N], the least load, ``pull_off_approach`` [m],
    and ``highest_summit`` [m], the separation at first touch. Under a controlled load the contact
    jumps apart there.

    InputError: a history without attraction, without its file or replay, or in which nothing
    touches.
    """
    import xarray as xr

    from historysim.asperities.attracting import AttractingEnsemble
    from historysim.results.source import query_source

    job = query_source(history, lambda origin: origin.job)
    if job is None:
        raise InputError(
            "the pull-off needs the contact itself: pass the file written by historysim run, or the history returned "
            "by hs.run or hs.replay"
        )
    ensemble = job.ensemble
    if not isinstance(ensemble, AttractingEnsemble):
        raise InputError(
            "the contact has no attraction, so that nothing pulls off; expected one with attraction"
        )
    deepest = float(ensemble.highest_summit - history["separation"].values.min())
    if deepest <= 0.0:
        raise InputError(
            "nothing touches in the history, so that nothing pulls off; expected one that presses"
        )
    touches = ensemble.pulls.touch[ensemble.pulls.touch < deepest]
    # both sides of each touch, where the load jumps
    approach = np.concatenate(
        [np.linspace(0.0, deepest, points), touches, np.nextafter(touches, np.inf)]
    )
    approach = np.unique(approach)[::-1]
    attraction = ensemble.pulls.compute_sum(approach)
    load = np.array([ensemble.contact_load(float(depth)) for depth in approach]) - attraction
    least, place = ensemble.pull_off(deepest)
    along = describe("approach", approach, "approach of the highest summit from first touch", "m")
    data = {
        "normal_load": describe("approach", load, "normal load from outside", "N"),
        "attraction": describe(
            "approach", attraction, "attraction of all touching asperities", "N"
        ),
    }
    attributes = {
        "title": history.attrs.get("title", ""),
        "pull_off_load": least,
        "pull_off_approach": place,
        "highest_summit": ensemble.highest_summit,
    }
    return xr.Dataset(data, {"approach": along}, attributes)
