"""Picture of the equilibria of one adhesive contact."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from historysim.basics.units import prefixed
from historysim.contact.adhesion import Branch
from historysim.results.plots.paper import Size, new_figure
from historysim.results.plots.pictures import figure_of
from historysim.results.plots.style import FAINT, INK, MARK, plain_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_adhesion_branch(branch: Branch, *, title: str = "", size: Size | None = None) -> "Figure":
    """Draw the load of a contact over its approach: what is stable, and where it jumps.

    Parameters
    ----------
    branch : Branch
        The equilibria, as `historysim.contact.adhesion.branch` gives them.
    title : str
        A heading; by default the theory.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.figure.Figure
        A figure 130 mm wide.
    """
    length, length_prefix = prefixed(float(np.abs(branch.approach).max()))
    force, force_prefix = prefixed(float(np.abs(branch.normal_load).max()))
    with new_figure(size, (130.0, 102.0)) as figure:
        axes = figure.add_subplot()
        axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
        axes.axvline(0, color=FAINT, linewidth=0.4, zorder=0)
        for name, part, line in _parts(branch):
            axes.plot(branch.approach[part] * length, branch.normal_load[part] * force, label=name, **line)
        for name, point, mark in _jumps(branch):
            x, y = point.approach * length, point.normal_load * force
            load = f", −{-y:.3g} {force_prefix}N" if y < 0 else ""
            axes.plot(x, y, label=name + load, color=MARK, ls="none", zorder=3, clip_on=False, **mark)
        axes.margins(0.06)
        axes.set(
            title=plain_title(title) or f"Equilibria after {branch.model.label}",
            xlabel=rf"approach $\delta$ ({length_prefix}m)",
            ylabel=f"normal load $N$ ({force_prefix}N)",
        )
        figure.legend(loc="outside lower center", ncols=2, columnspacing=2.0)
    return figure


def _parts(branch: Branch) -> "list[tuple[str, npt.NDArray[np.intp], dict[str, Any]]]":
    """Return what to call, which points to draw and how, for each part of the curve that is there."""
    size = branch.normal_load.size
    stable, held = (size - int(mask.sum()) for mask in (branch.stable_under_load, branch.stable_under_displacement))
    # neighbours share a point, so that the curve does not tear
    parts = [
        ("stable", np.arange(max(stable, held), size), {"color": INK, "linewidth": 1.2}),
        (
            "stable under displacement only",
            np.arange(held, stable + 1),
            {"color": INK, "linewidth": 1.0, "linestyle": (0, (4, 2))},
        ),
        (
            "unstable",
            np.arange(min(stable, held) + 1),
            {"color": FAINT, "linewidth": 1.0, "linestyle": (0, (1.2, 1.5))},
        ),
    ]
    return [part for part in parts if part[1].size > 1]


def _jumps(branch: Branch) -> "list[tuple[str, Any, dict[str, Any]]]":
    """Return what to call, where to draw and how, for each point at which the contact jumps."""
    load, displacement = branch.pull_off_under_load, branch.pull_off_under_displacement
    if load == branch.jump_in:
        return []
    pull_off = (
        [("pull-off", load, {"marker": "o", "ms": 5})]
        if load == displacement
        else [
            ("pull-off under load", load, {"marker": "o", "ms": 5}),
            ("pull-off under displacement", displacement, {"marker": "s", "ms": 4.5}),
        ]
    )
    # a ring, since a pull-off may lie right beside it
    return [*pull_off, ("jump-in", branch.jump_in, {"marker": "o", "ms": 9, "mfc": "none"})]


@figure_of.register(Branch)
def _of_branch(what: Branch, *, size: Size | None = None, **_: Any) -> "Figure":
    return plot_adhesion_branch(what, size=size)
