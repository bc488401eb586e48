"""Pictures of the traction over the radius of an asperity: several states in one, and its slip fronts, step by step."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.basics.array_types import Floats
from historysim.basics.units import prefixed, quantity_text
from historysim.errors import InputError
from historysim.recording.named_states import named_states, state_label, step_of
from historysim.results import rebuilt
from historysim.results.analysis.recorded import GROSS_SLIP, check_any, check_recorded, column_of
from historysim.results.analysis.shares import telling_step
from historysim.results.plots.along_path import line_colours, swings
from historysim.results.plots.paper import COLUMN, Drawn, Page, Place, paper
from historysim.results.plots.pictures import PICTURES, Picture
from historysim.results.plots.style import FAINT, STATE_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STATES_IN_ONE, MOST_IN_ONE = 5, 10
LINES, MOST_LINES = 24, 200
POINTS = 401
HIGHEST, CLOSEST = 1.6, 0.9
"""Height of the friction limit over the distance of two lines, and the most that a line comes down to the one below."""


def plot_traction(
    history: "xr.Dataset | Sequence[xr.Dataset]",
    asperity: int | None = None,
    steps: Sequence[int | str] | None = None,
    *,
    across: str = "radius",
    limit: bool = True,
    fronts: bool = False,
    change_from: int | str | None = None,
    labels: Sequence[str] = (),
    **place: Unpack[Place],
) -> Drawn:
    """Draw the traction of an asperity over its radius, or its diameter, at several steps, with the friction limits.

    Parameters
    ----------
    history : xarray.Dataset or sequence of them
        A history with asperities, or several, drawn one after the other; see `historysim.results.rebuilt`.
    asperity : int, optional
        Its label; by default that of the asperity that carries most where the contact map shows most (`telling_step`).
    steps : sequence of int or str, optional
        Up to 10 states, by step or by the name of a waypoint; by default all named ones, or where none has a name 5 of
        the swing of the displacement around the telling step, from its beginning to where the asperity slides.
    across : {"radius", "diameter"}
        From 0 to a, or from -a to a.
    limit : bool
        Draw ±μp of each state, once where states have the same.
    fronts : bool
        Mark on the axis where the slip of each state ends: its stick radius.
    change_from : int or str, optional
        A state; how the traction of each later one differs from its is drawn, too, as thin dashed lines.
    labels : sequence of str, optional
        What the lines are called; by default the names of the states, or steps and times.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide.

    Raises
    ------
    InputError
        A step or an asperity that the history does not have, more steps than can be told apart, or as for
        `historysim.results.rebuilt.asperity_at`.
    """
    several = [history] if isinstance(history, xr.Dataset) else list(history)
    with paper(plot_traction, (COLUMN, 85.0), place) as page:
        draw_traction(
            page,
            several,
            asperity,
            steps,
            across=across,
            limit=limit,
            fronts=fronts,
            change_from=change_from,
            labels=labels,
        )
        if len(several) == 1:
            page.heading(str(several[0].attrs.get("title", "")))
    return page.drawn


ACROSS = ("radius", "diameter")


def draw_traction(
    page: Page,
    histories: Sequence[xr.Dataset],
    asperity: int | None = None,
    steps: Sequence[int | str] | None = None,
    *,
    across: str = "radius",
    limit: bool = True,
    fronts: bool = False,
    change_from: int | str | None = None,
    labels: Sequence[str] = (),
    title: str = "",
) -> None:
    """Draw tractions on a page; parameters and errors as for `plot_traction`."""
    if across not in ACROSS:
        raise InputError(f"across is {across!r}; expected one of {', '.join(ACROSS)}")
    parts, names, asperities, before = list[xr.Dataset](), list[str](), list[int](), list[xr.Dataset | None]()
    for history in histories:
        own, chosen = _chosen(history, asperity, steps, STATES_IN_ONE)
        found = rebuilt.profiles(history, own, chosen, POINTS)
        asperities.append(own)
        start = None if change_from is None else step_of(history, change_from)
        base = None if start is None else rebuilt.profiles(history, own, [start], POINTS).isel(step=0)
        before += [base if start is not None and step > start else None for step in chosen]
        parts += [found.isel(step=row) for row in range(len(chosen))]
        whose = f"{history.attrs.get('title', '')}, " if len(histories) > 1 else ""
        names += [whose + state_label(history, int(step)) for step in found["step"].values]
    if len(parts) > MOST_IN_ONE:
        raise InputError(f"steps has {len(parts)} steps; expected at most {MOST_IN_ONE}, which can be told apart")
    if labels and len(labels) != len(parts):
        raise InputError(f"labels has {len(labels)}; expected one for each of {len(parts)} states")
    most = max(float(part["friction_limit"].max()) for part in parts)
    factor, prefix = prefixed(most)
    along, unit = prefixed(max(float(part["radius"][-1]) for part in parts))
    axes = page.axes()
    axes.axhline(0, color=FAINT, linewidth=0.4, zorder=0)
    shades = line_colours()(np.linspace(0, 1, len(parts)))
    known = list(dict.fromkeys(f"{_friction(part):.3g}" for part in parts if _friction(part) > 0))
    changes = r"change from " + str(change_from)
    for colour, name, part, base in zip(shades, labels or names, parts, before, strict=True):
        # a traction ends at the edge of the contact; what lies beyond is no part of it
        edge = float(part["contact_radius"])
        radius = _both_sides(np.append(np.minimum(part["radius"].values, edge), edge) * along, across, odd=True)
        if limit:
            _draw_limit(axes, part, radius, factor, across, known)
        traction = _both_sides(_to_edge(part, "traction") * factor, across)
        axes.plot(radius, traction, color=colour, linewidth=1.2, label=name)
        if base is not None:
            change = traction - _both_sides(_at_radii_of(part, base) * factor, across)
            thin: dict[str, Any] = {"color": colour, "linewidth": 0.8, "linestyle": (0, (3, 1.5))}
            axes.plot(radius, change, label=changes, **thin)
        stick = float(part["stick_radius"]) * along
        if fronts and stick > 0:
            for side in (stick, -stick) if across == "diameter" else (stick,):
                axes.plot([side], [0], "|", color=colour, ms=9, mew=1.6, zorder=4)
    end = max(float(part["radius"][-1]) for part in parts) * along or 1.0
    axes.set_xlim(-end if across == "diameter" else 0, end)
    alone = all(history.sizes["asperity"] == 1 for history in histories)
    axes.set(
        title=title or ("" if alone else f"Traction of asperity {asperities[0]}"),
        xlabel=rf"{'distance from the centre' if across == 'diameter' else 'radius'} $r$ ({unit}m)",
        ylabel=rf"traction $\tau$ ({prefix}Pa)",
    )
    page.legend(axes)


DASHES = (4, 2), (1, 1.5), (6, 2, 1, 2), (2, 2), (8, 3)
"""Dashes of the limits of one friction coefficient, and of the next."""


def _draw_limit(
    axes: "Axes", part: xr.Dataset, radius: Floats, factor: float, across: str, frictions: Sequence[str]
) -> None:
    """Draw ±μp of a state with its own friction, its dashes those of this friction; once where states have the same."""
    bound, told = _both_sides(_to_edge(part, "friction_limit") * factor, across), f"{_friction(part):.3g}"
    if told not in frictions or any(
        line.get_gid() == LIMIT
        and np.allclose(line.get_xydata(), np.column_stack([radius, bound]), rtol=1e-9, atol=0.0)
        for line in axes.get_lines()
    ):
        return
    pattern = (0, DASHES[frictions.index(told) % len(DASHES)])
    dashes: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "linestyle": pattern, "zorder": 1}
    name = r"$\pm\mu p$" + (rf", $\mu$ = {told}" if len(frictions) > 1 else "")
    axes.plot(radius, bound, label=name, gid=LIMIT, **dashes)
    axes.plot(radius, -bound, **dashes)


LIMIT = "friction limit"
"""What limits are known by among the lines."""


def _friction(part: xr.Dataset) -> float:
    """Return the friction coefficient of a state; 0 where nothing touches."""
    pressure = float(part["pressure"].max())
    return float(part["friction_limit"].max()) / pressure if pressure > 0 else 0.0


def _at_radii_of(part: xr.Dataset, base: xr.Dataset) -> Floats:
    """Return the traction of one state at the radii of another, and 0 at its edge."""
    # both contacts are as large where the normal load is held; elsewhere the radii differ
    return np.append(np.interp(part["radius"].values, base["radius"].values, base["traction"].values, right=0.0), 0.0)


def _to_edge(part: xr.Dataset, name: str) -> Floats:
    """Return a profile with one more point, the edge, where it is 0; what is beyond the edge lies there."""
    values = np.where(part["radius"].values < float(part["contact_radius"]), part[name].values, 0.0)
    return np.append(values, 0.0)


def _both_sides(values: Floats, across: str, *, odd: bool = False) -> Floats:
    """Return values along the radius, or mirrored along the diameter; a radius itself is negative there."""
    if across == "radius":
        return values
    mirrored = values[:0:-1]
    return np.concatenate([-mirrored if odd else mirrored, values])


def plot_slip_fronts(
    history: xr.Dataset,
    asperity: int | None = None,
    steps: Sequence[int | str] | None = None,
    **place: Unpack[Place],
) -> Drawn:
    """Draw the traction across an asperity step by step, each line above the one before, with the fronts of its slip.

    Parameters
    ----------
    history, asperity
        As for `plot_traction`.
    steps : sequence of int or str, optional
        Up to 200 states, by step or name; by default 24 of the swing as in `plot_traction`.
    **place
        ``size`` [mm], ``figure`` or ``ax``; see `Place`.

    Returns
    -------
    Figure, SubFigure or Axes
        What was given, or a new figure 90 mm wide. The stick zone is drawn thick; where it ends is the slip front.

    Raises
    ------
    InputError
        As for `plot_traction`.
    """
    asperity, chosen = _chosen(history, asperity, steps, LINES)
    if len(chosen) > MOST_LINES:
        raise InputError(f"steps has {len(chosen)} steps; expected at most {MOST_LINES} lines")
    found = rebuilt.profiles(history, asperity, chosen, POINTS)
    factor, radius_unit = prefixed(float(found["radius"].values[-1]))
    across = np.concatenate([-found["radius"].values[:0:-1], found["radius"].values]) * factor
    largest = float(found["friction_limit"].values.max(initial=0.0)) or 1.0
    # each change is seen, and no line crosses the one before: from step to step a traction may turn round
    step_up = np.diff(found["traction"].values, axis=0).min(initial=0.0) / largest
    height = min(HIGHEST, CLOSEST / -step_up) if step_up else HIGHEST
    looks: dict[str, dict[str, Any]] = {
        "slips": {"color": STATE_COLOURS[2], "linewidth": 0.8},
        "sticks": {"color": STATE_COLOURS[1], "linewidth": 1.6},
    }
    with paper(plot_slip_fronts, (COLUMN, 110.0), place) as page:
        axes = page.axes()
        for row in range(len(chosen)):
            half = found["traction"].values[row] / largest * height
            line = row + np.concatenate([half[:0:-1], half])
            for name, radius in (("slips", "contact_radius"), ("sticks", "stick_radius")):
                inside = np.abs(across) <= float(found[radius].values[row]) * factor
                if found[radius].values[row] > 0:
                    axes.plot(across[inside], line[inside], solid_capstyle="butt", label=name, **looks[name])
        ticks = np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), 7)).round().astype(int))
        labels = [f"{found['step'].values[row]},  {found['time'].values[row]:.4g} s" for row in ticks]
        axes.set_yticks(ticks, labels)
        axes.set(title=f"Slip fronts of asperity {asperity}", xlabel=f"$r$ ({radius_unit}m)", ylabel="step, time")
        scale = f"one line is {quantity_text(largest / height, 'Pa', 3)} above the next"
        page.legend(axes, extra=scale)
    return page.drawn


def _chosen(
    history: xr.Dataset, asperity: int | None, steps: Sequence[int | str] | None, count: int
) -> tuple[int, list[int]]:
    """Return the asperity and the steps to draw, where they are not said."""
    check_recorded(history, "slip_state", "normal_load", "contact_radius")
    check_any(history)
    if steps is not None and not len(steps):
        raise InputError("steps is empty; expected one step or more")
    telling = telling_step(history)
    if asperity is None:
        heaviest = int(history["normal_load"].isel(step=telling).values.argmax())
        asperity = int(history["asperity"].values[heaviest])
    column = column_of(asperity, history)
    if steps is None and 0 < len(named_states(history)) <= MOST_IN_ONE and count == STATES_IN_ONE:
        steps = list(named_states(history))
    if steps is not None:
        return asperity, [step_of(history, step) for step in steps]
    return asperity, _of_swing(history, column, telling, count)


def _of_swing(history: xr.Dataset, column: int, telling: int, count: int) -> list[int]:
    """Return steps of the swing around a step, up to where an asperity slides."""
    parts = list(swings(history["tangential_displacement"].values))
    first, last = next((part for part in parts if part[0] <= telling <= part[1]), (0, history.sizes["step"] - 1))
    states: npt.NDArray[np.int8] = history["slip_state"].isel(step=slice(first, last + 1), asperity=column).values
    # it slides until it turns round: where the swing begins that may still be the case
    begun = int((states != GROSS_SLIP).argmax())
    slides = np.flatnonzero(states[begun:] == GROSS_SLIP)
    end = first + begun + int(slides[0]) if slides.size else last
    return [int(step) for step in np.unique(np.linspace(first, max(end, first), count).round())]


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipFrontsPicture(Picture):
    """The traction across an asperity step by step, with the fronts of its slip.

    Attributes
    ----------
    asperity
        Which; by default the one that carries most.
    steps
        Up to 200 states, by number or name; by default 24 of the swing.
    """

    asperity: int | None = None
    steps: tuple[int | str, ...] | None = None

    kind = "slip-fronts"
    caption = "The same step by step: what sticks is drawn thick, and its edge is the slip front."
    place = 6

    @classmethod
    def reported(cls, history: xr.Dataset) -> bool:
        """Return whether a report shows it: a patch has no radius to draw over."""
        return super().reported(history) and "stick_area" not in history

    def drawn(self, what: xr.Dataset, **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        return plot_slip_fronts(what, self.asperity, self.steps, **place)
