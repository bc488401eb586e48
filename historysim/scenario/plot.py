"""Pictures of whatever has one."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from historysim.errors import InputError
from historysim.scenario.opening import Reading, opened
from historysim.scenario.scenario import Scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import xarray as xr
    from matplotlib.figure import Figure

    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.asperity import Asperity
    from historysim.contact.adhesion import Branch
    from historysim.measured.comparison import Comparison
    from historysim.measured.loops import Loops
    from historysim.scenario.fit import Fit
    from historysim.surfaces.heights import Surface

    Drawable = (
        str | Path | xr.Dataset | Scenario | Surface | Loops | Comparison | Fit | Asperity | AdheringAsperities | Branch
    )


def plot(
    what: "Drawable",
    *,
    step: int | str | None = None,
    adhesion: bool = False,
    asperity: int | None = None,
    form: str | None = None,
    **reading: Unpack[Reading],
) -> "Figure":
    """Return a picture of a history, a surface, a scenario, loops, a comparison or an asperity, or of a file of them.

    Each kind has a function of its own with more to choose: `plot_history`, `plot_surface`, `plot_loops`,
    `plot_comparison`, `plot_asperity`, `plot_adhesion_map`, `plot_adhesion_branch`.

    Parameters
    ----------
    what : path, xarray.Dataset, Scenario, Surface, Loops, Comparison, Fit, Asperity, AdheringAsperities or Branch
        Of a history: the friction loop, the loads, and the slip states. Of a scenario or a height map: the surface
        with its summits.
    step : int or "peak", optional
        Of a history, its surface at this step, or at that of the greatest normal load; negative ones count from the
        end.
    adhesion : bool
        Of a scenario with ``[adhesion]``, the adhesion map with its asperities.
    asperity : int, optional
        With `adhesion`, the equilibria of this asperity in place of the map.
    form : str, optional
        What is taken off the height map of a file first; by default a plane.
    **reading
        What the height map of a file leaves open, as for `read_surface`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Something that has no picture, a file that cannot be used, or an option that does not fit what is drawn.
    """
    if isinstance(what, str | Path):
        with opened(what, form=form, **reading) as found:
            return _drawn(found, str(what), Path(what).name, step, adhesion, asperity)
    if form is not None or reading:
        raise InputError("form, pixel_size, …: expected with the path of a height map alone, which is read with them")
    return _drawn(what, f"this {type(what).__name__}", "", step, adhesion, asperity)


def _drawn(what: Any, name: str, title: str, step: int | str | None, adhesion: bool, asperity: int | None) -> "Figure":
    import xarray as xr

    from historysim.surfaces.heights import Surface

    if step is not None and not (isinstance(what, xr.Dataset) and "total_normal_load" in what):
        raise InputError(f"step {step}: {name} has no steps; expected a result of historysim run")
    if adhesion and not isinstance(what, Scenario):
        raise InputError(f"adhesion: {name} is no scenario; expected a scenario with [adhesion]")
    if asperity is not None and not adhesion:
        raise InputError(f"asperity {asperity}: expected with adhesion, to draw the equilibria of this asperity")
    if isinstance(what, xr.Dataset):
        return _dataset(what, name, step)
    if isinstance(what, Surface):
        from historysim.results.plots.surface import plot_surface

        return plot_surface(what, title=title)
    if isinstance(what, Scenario):
        return _adhesion(what, asperity) if adhesion else _ground(what)
    return _object(what, name)


def _dataset(what: "xr.Dataset", name: str, step: int | str | None) -> "Figure":
    if "total_normal_load" in what:
        from historysim.results.plots.history import plot_history
        from historysim.results.plots.surface import plot_surface, surface_of

        if step is None:
            return plot_history(what)
        surface = surface_of(what)
        return _contact_map(what, step) if "solved_pressure" in surface else plot_surface(surface, what, step)
    if "summit_height" in what:
        from historysim.results.plots.surface import plot_surface

        return plot_surface(what)
    if "loop" in what.dims:
        from historysim.results.plots.loop_trends import plot_loop_trends

        return plot_loop_trends(what)
    if "loops" in what.coords:
        from historysim.results.plots.loop_levels import plot_loop_levels

        return plot_loop_levels(what)
    raise InputError(f"{name} is no history; expected a Dataset from historysim, with all its variables")


def _contact_map(history: "xr.Dataset", step: int | str) -> "Figure":
    from historysim.log.event_log import EventLog
    from historysim.log.file import ENDING
    from historysim.results.plots.contact_map import plot_contact_map
    from historysim.results.plots.surface import position_of

    # a surface with its solutions came from a file, beside which its log stands
    path = Path(history.encoding["source"]).with_suffix(ENDING)
    with EventLog(path) as log:
        if history.attrs.get("log_digest") != f"sha256:{log.digest}":
            raise InputError(f"{path}: is not the log of this result; expected that, from which the tractions follow")
        return plot_contact_map(log, float(history["time"].values[position_of(step, history)]))


def _ground(scenario: Scenario) -> "Figure":
    from historysim.recording import surface_group
    from historysim.results.plots.surface import plot_surface

    ground = scenario.ground()
    title = scenario.title or scenario.path.stem
    return plot_surface(surface_group.dataset(ground.summits, ground.surface), title=title)


def _adhesion(scenario: Scenario, asperity: int | None) -> "Figure":
    from historysim.results.plots.adhesion_branch import plot_adhesion_branch
    from historysim.results.plots.adhesion_map import plot_adhesion_map

    contact = scenario.adhering(*scenario.checked())
    if contact is None:
        raise InputError(
            f"{scenario.path}: has no [adhesion], or nothing touches; expected both to draw how adhesive it is"
        )
    if asperity is None:
        return plot_adhesion_map(contact.examples())
    branch = contact.branch(asperity)
    return plot_adhesion_branch(branch, title=f"Equilibria of asperity {asperity} after {branch.model.label}")


def _object(what: object, name: str) -> "Figure":
    from historysim.asperities.adhering import AdheringAsperities
    from historysim.asperities.asperity import Asperity
    from historysim.contact.adhesion import Branch
    from historysim.measured.comparison import Comparison
    from historysim.measured.loops import Loops
    from historysim.results.plots.adhesion_branch import plot_adhesion_branch
    from historysim.results.plots.adhesion_map import plot_adhesion_map
    from historysim.results.plots.asperity import plot_asperity
    from historysim.results.plots.comparison import plot_comparison
    from historysim.results.plots.loops import plot_loops
    from historysim.scenario.fit import Fit

    drawn: Mapping[type, Callable[[Any], Figure]] = {
        Loops: plot_loops,
        Comparison: plot_comparison,
        Asperity: plot_asperity,
        AdheringAsperities: lambda adhering: plot_adhesion_map(adhering.examples()),
        Branch: plot_adhesion_branch,
        Fit: lambda fit: plot_comparison(fit.comparison, fit.scenario.title),
    }
    for kind, picture in drawn.items():
        if isinstance(what, kind):
            return picture(what)
    raise InputError(
        f"{name} has no picture; expected a history, a scenario, a surface, loops, a comparison or an asperity"
    )
