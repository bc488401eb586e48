"""One contact whose radius, load and friction change."""

from typing import TYPE_CHECKING, Unpack

from historysim.contact.materials import MaterialPair
from historysim.studies.design_studies.study import Quantities, StoredSweepOptions, swept

if TYPE_CHECKING:
    import xarray as xr


def radius_load_friction(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    later_load: Quantities | None = None,
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return the preliminary displacement of one contact, which goes as R^(-1/3) N^(2/3) μ, and how it drifts.

    Parameters
    ----------
    pair : MaterialPair
    radius : float, str or several
        R [m].
    normal_load : float, str or several
        N [N].
    friction : float or several
        μ.
    later_load : float, str or several, optional
        The normal load to which the first one changes [N].
    **options
        ``workers``, ``executor``, ``store``, ``progress``, ``tell``, as for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m] at the greater of the two loads over what there are several of; with a later
        load also ``drift``, |δ2 - δ1| [m], and ``branch_drift`` [m], by how much the backward branch is off the 2 δ1
        that it should take. `historysim.drift_along` tells the change along any of its dimensions.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.

    Notes
    -----
    Winogrodzka, section 6.2.1, Figs. 6.5 (radius), 6.6 (load) and 6.7 (friction).
    """
    values = {
        "surface.radius": radius,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
    }
    waypoints = [{"time": 0.0}]
    outputs = ["preliminary_displacement"]
    if later_load is not None:
        values["loading.waypoints[1].normal_load"] = later_load
        waypoints.append({"time": 1.0})
        outputs += ["drift", "branch_drift"]
    tables = {"surface": {"kind": "sphere"}, "friction": {}, "loading": {"waypoints": waypoints}}
    title = "one contact of other radius, load and friction"
    return swept("radius_load_friction", title, pair, tables, values, outputs=outputs, **options)
