"""The inverse: which finish, or which texture, keeps a drift."""

from typing import TYPE_CHECKING, Any, Unpack

from historysim.basics.places import at
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.scenario.grid import expand
from historysim.scenario.overriding import plain
from historysim.studies.design import design
from historysim.studies.design_studies.study import Quantity, Seeds, SweepOptions, scenario_for

if TYPE_CHECKING:
    import xarray as xr

Pair = tuple[Quantity, Quantity]


def finish_for_a_drift(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    drift: Quantity,
    normal_load: Pair,
    friction: float,
    autocorrelation_length: Quantity,
    between: Pair = ("1 nm", "1 µm"),
    shape: tuple[int, int] = (256, 256),
    pixel_size: Quantity = "1 µm",
    seeds: Seeds = range(1, 21),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the rms height at which the preliminary displacement of random surfaces drifts by so much.

    Parameters
    ----------
    pair : MaterialPair
    drift : float or str
        |δ2 - δ1| [m] that is wanted.
    normal_load : (first, second)
        The loads between which it drifts [N].
    friction : float
        μ.
    autocorrelation_length : float or str
        β [m] of the exponential autocorrelation.
    between : (least, greatest)
        The rms heights among which it is sought [m].
    shape, pixel_size
        Points of the map, and their distance [m].
    seeds : several int, or a range
        One is found for each, which tells how far it is chance.
    **options
        ``workers``, ``executor``, ``progress``, ``tell``, as for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``surface_rms_height`` [m] over ``surface_seed``, ``drift`` there, and ``drift_at_median``, as from
        `historysim.design`, of which `historysim.studies.design.summary` tells the lines.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; there is no such rms height.
    """
    surface = {
        "kind": "random",
        "shape": list(shape),
        "pixel_size": pixel_size,
        "autocorrelation_length": autocorrelation_length,
    }
    question = ("rms_height", between, drift)
    return _sought(
        "finish", pair, surface, question, normal_load=normal_load, friction=friction, seeds=seeds, **options
    )


def texture_for_a_drift(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    drift: Quantity,
    normal_load: Pair,
    friction: float,
    count: tuple[int, int],
    pitch: Quantity,
    between: Pair,
    height_scatter: Quantity = 0.0,
    radius_scatter: float = 0.0,
    seeds: Seeds = (1,),
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the radius of the asperities of a texture at which its preliminary displacement drifts by so much.

    Parameters
    ----------
    pair, drift, normal_load, friction, **options
        As for `finish_for_a_drift`.
    count : (nx, ny)
        Numbers of asperities along x and y.
    pitch : float or str
        Distance from one to the next [m].
    between : (least, greatest)
        The radii among which it is sought [m].
    height_scatter, radius_scatter
        Standard deviations of the heights [m], and of the radii over their mean [1].
    seeds : several int, or a range
        One is found for each, which tells how far it is chance.

    Returns
    -------
    xarray.Dataset
        ``surface_radius`` [m] over ``surface_seed``, ``drift`` there, and ``drift_at_median``, as from
        `historysim.design`.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; there is no such radius.
    """
    surface = {
        "kind": "textured",
        "count": list(count),
        "pitch": pitch,
        "height_scatter": height_scatter,
        "radius_scatter": radius_scatter,
    }
    question = ("radius", between, drift)
    return _sought(
        "texture", pair, surface, question, normal_load=normal_load, friction=friction, seeds=seeds, **options
    )


def _sought(
    what: str,
    pair: MaterialPair,
    surface: dict[str, Any],
    question: tuple[str, Pair, Quantity],
    *,
    normal_load: Pair,
    friction: float,
    seeds: Seeds,
    **options: Unpack[SweepOptions],
) -> "xr.Dataset":
    """Return the value of a key of the surface at which the drift from one load to the other is what is wanted."""
    key, between, wanted = question
    name, title = f"{what}_for_a_drift", f"the {what} for a drift"
    asked: dict[str, Any] = {"normal_load": normal_load, "between": between}
    for argument, ends in asked.items():
        if not isinstance(ends, tuple | list) or len(ends) != 2:
            with at(name, argument):
                raise InputError(f"{ends!r}; expected two values")
    waypoints = [{"time": float(time), "normal_load": load} for time, load in enumerate(normal_load)]
    tables = {
        "surface": {**surface, key: between[0]},
        "friction": {"coefficient": friction},
        "loading": {"waypoints": waypoints},
    }
    with at(name, "seeds"):
        drawn = plain(expand(seeds))
    section = {"key": f"surface.{key}", "between": list(between), "target": wanted, "over": {"surface.seed": drawn}}
    scenario = scenario_for(name, title, pair, {**tables, "design": section}, {"surface.seed": drawn[0]})
    return design(scenario, **options)
