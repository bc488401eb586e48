"""Textures: n equal asperities in place of one, what their scatter does, and one that is larger than the others."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

from historysim.basics.places import at
from historysim.basics.units import quantity
from historysim.basics.wording import nearest
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.scenario.grid import expand
from historysim.studies.design_studies.study import (
    Quantities,
    Quantity,
    Seeds,
    StoredSweepOptions,
    is_several,
    over_numbers,
    swept,
    with_spread,
)

if TYPE_CHECKING:
    import xarray as xr

SCALINGS = ("self-similar", "curvature-invariant")
STANDING = ("ground", "level")


def equal_asperities(
    pair: MaterialPair,
    *,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    pitch: Quantity,
    count: Iterable[tuple[int, int]] | tuple[int, int] = ((1, 1), (2, 2), (4, 4), (8, 8)),
    scaling: str | Iterable[str] = SCALINGS,
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return what n equal asperities in place of one do, which carry F/n each.

    The preliminary displacement falls as n^(-1/2) where they are self-similar (radius R/√n), and as n^(-2/3) where they
    keep the radius; the contact area stays, or grows as n^(1/3).

    Parameters
    ----------
    pair : MaterialPair
    radius : float, str or several
        R [m] of the one asperity that they replace.
    normal_load : float, str or several
        F [N] of all of them together.
    friction : float or several
        μ.
    pitch : float or str
        Distance from one to the next [m]: it tells where their contacts would overlap, and changes nothing else.
    count : (nx, ny) or several of them
        Their numbers along x and y.
    scaling : str or several
        ``"self-similar"``, ``"curvature-invariant"``.
    **options
        ``workers``, ``executor``, ``store``, ``progress``, ``tell``, as for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` and ``peak_approach`` [m], ``peak_contact_area`` [m²], over what there are several
        of; that of ``count`` is ``asperity_count``, n.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.

    Notes
    -----
    Winogrodzka, section 6.2.1, Fig. 6.4, with the load per contact F/n.
    """
    as_given: Any = count
    if not is_several(as_given):
        raise InputError(f"equal_asperities: count is {count!r}; expected (nx, ny), or several of them")
    counts: list[Any] = [list(each) if is_several(each) else each for each in as_given]
    one = not all(isinstance(each, list) for each in counts)
    values = {
        "surface.scaling": scaling,
        "surface.radius": radius,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
        **({} if one else {"surface.count": counts}),
    }
    tables = _texture(pitch, counts if one else counts[0])
    outputs = ("preliminary_displacement", "peak_contact_area", "peak_approach")
    table = swept(
        "equal_asperities", "n equal asperities in place of one", pair, tables, values, outputs=outputs, **options
    )
    numbers = [] if one else [nx * ny for nx, ny in counts]
    return over_numbers(table, "surface_count", "asperity_count", numbers, long_name="number of asperities", units="1")


def texture_tolerances(  # noqa: PLR0913 - the keys of a scenario
    pair: MaterialPair,
    *,
    count: tuple[int, int],
    pitch: Quantity,
    radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    height_scatter: Quantities,
    radius_scatter: float | Iterable[float] = 0.0,
    seeds: Seeds = range(1, 11),
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return what scatter of heights and radii does to a texture, and how far that is chance.

    Parameters
    ----------
    pair : MaterialPair
    count : (nx, ny)
        Numbers of asperities along x and y.
    pitch : float or str
        Distance from one to the next [m].
    radius, normal_load, friction
        R [m] of each asperity, F [N] of all together, μ; each one or several.
    height_scatter : float, str or several
        Standard deviation of the Gaussian heights [m].
    radius_scatter : float or several
        Standard deviation of the log-normal radii over their mean [1].
    seeds : several int, or a range
        A texture is drawn with each.
    **options
        As for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m] and ``peak_contact_count`` [1] over what there are several of, and
        ``surface_seed``; of each over the seeds ``NAME_mean``, ``NAME_standard_deviation``, ``NAME_quantile``, as by
        `historysim.spread`.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.

    Notes
    -----
    Winogrodzka, sections 6.2 and 7.3: equal radii and heights are asked for.
    """
    values = {
        "surface.height_scatter": height_scatter,
        "surface.radius_scatter": radius_scatter,
        "surface.radius": radius,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
        "surface.seed": seeds,
    }
    outputs = ("preliminary_displacement", "peak_contact_count")
    tables = _texture(pitch, list(count))
    title = "scatter of heights and radii of a texture"
    return with_spread(swept("texture_tolerances", title, pair, tables, values, outputs=outputs, **options))


def one_large_asperity(
    pair: MaterialPair,
    *,
    count: int,
    radius: Quantity,
    large_radius: Quantities,
    normal_load: Quantities,
    friction: Quantities,
    standing: str = "ground",
    **options: Unpack[StoredSweepOptions],
) -> "xr.Dataset":
    """Return what one asperity of another radius does among n equal ones.

    At the level of the others it hardly counts; standing out it decides: alone, its preliminary displacement is
    θμ (9 F²/(16 E*² R))^(1/3).

    Parameters
    ----------
    pair : MaterialPair
    count : int
        Number of asperities, n, 1 or more; the first is the other one.
    radius : float or str
        R [m] of the others.
    large_radius : float, str or several
        That of the first [m].
    normal_load, friction
        F [N] of all together, μ; each one or several.
    standing : {"ground", "level"}
        All are half balls on one plane, so that each is as high as its radius; or all summits are at one level.
    **options
        As for `historysim.sweep`.

    Returns
    -------
    xarray.Dataset
        ``preliminary_displacement`` [m], ``critical_asperity`` and ``peak_contact_count`` over what there are several
        of; that of ``large_radius`` is ``surface_radius_0``, with ``surface_height_0`` along it where they stand on the
        ground.

    Raises
    ------
    InputError
        A value that cannot be used, with its key; all cells have failed.

    Notes
    -----
    Winogrodzka, section 6.2.1, Fig. 6.2 b.
    """
    if standing not in STANDING:
        raise InputError(f"one_large_asperity: standing is {standing!r}; {nearest(str(standing), STANDING)}")
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise InputError(f"one_large_asperity: count is {count!r}; expected a whole number of 1 or more")
    values: dict[str, Any] = {
        "surface.radius[0]": large_radius,
        "friction.coefficient": friction,
        "loading.waypoints[0].normal_load": normal_load,
    }
    several = is_several(large_radius)
    together = []
    if standing == "ground":
        with at("one_large_asperity", "radius"):
            others = quantity(radius, "m")
        with at("one_large_asperity", "large_radius"):
            each: list[Any] = expand(large_radius) if several else [large_radius]
            own = [quantity(one, "m") - others for one in each]
        values["surface.height[0]"] = own if several else own[0]
        together = [["surface.radius[0]", "surface.height[0]"]] if several else []
    tables = {
        "surface": {"kind": "summits", "height": [0.0] * count, "radius": [radius] * count},
        **_loaded(),
    }
    outputs = ("preliminary_displacement", "critical_asperity", "peak_contact_count")
    title = f"one asperity of another radius among {count}"
    return swept("one_large_asperity", title, pair, tables, values, outputs=outputs, together=together, **options)


def _texture(pitch: Quantity, count: object) -> dict[str, Any]:
    return {"surface": {"kind": "textured", "count": count, "pitch": pitch}, **_loaded()}


def _loaded() -> dict[str, Any]:
    return {"friction": {}, "loading": {"waypoints": [{"time": 0.0}]}}
