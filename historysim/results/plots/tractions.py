"""Pictures of the traction of an asperity: states over its radius, slip fronts, its memory, and arrows over a plane."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.asperity import Asperity
from historysim.basics.arguments import Floats
from historysim.basics.fields import Quantity
from historysim.basics.units import newtons, quantity_text
from historysim.errors import InputError
from historysim.results import rebuilt
from historysim.results.analysis.recorded import GROSS_SLIP, check_any, check_recorded, find_column
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS, Canvas
from historysim.results.plots.pictures import PICTURES, Panel, Picture, as_history_list
from historysim.results.plots.style import (
    DASHED,
    FAINT,
    INK,
    SPAN,
    STATE_COLOURS,
    line_colours,
    patches,
    swings,
    zero_lines,
)
from historysim.results.plots.style import LINES as STYLES
from historysim.results.steps import named_states, resolve_step, state_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ACROSS = ("radius", "diameter")
STATES_IN_ONE, MOST_IN_ONE = 5, 10
LINES, MOST_LINES, MOST_TICKS = 24, 200, 8
POINTS = 401
# Dashes of the limits of one friction coefficient, and of the next.
DASHES = (4, 2), (1, 1.5), (6, 2, 1, 2), (2, 2), (8, 3)
GREY = "#7a7a7a"


@PICTURES.register
@attrs.frozen(kw_only=True)
class TractionPicture(Panel):
    """The traction of an asperity at several states.

    Attributes
    ----------
    steps
        Up to 10 states, by name or number; by default all that have a name, or else 5 of the swing.
    asperity
        Which; by default the one that carries most.
    across
        ``"radius"`` or ``"diameter"``.
    limit
        Draws ±μp of each state.
    fronts
        Marks where slip ends.
    letters
        What these marks are called, in the order of the states; of a single one the annulus of slip has a name, too.
    ellipse_at
        A normal load at which a sphere of the same shear strength slides: its ellipse is as high, and wider.
    change_from
        A state from which on changes are drawn.

    Examples
    --------
    [[picture]]
    kind = "traction"
    across = "diameter"
    """

    steps: tuple[str | int, ...] | None = None
    asperity: int | None = None
    across: str = "radius"
    limit: bool = True
    fronts: bool = False
    letters: tuple[str, ...] = ()
    ellipse_at: Annotated[float | None, Quantity("N")] = attrs.field(
        default=None, converter=attrs.converters.optional(newtons)
    )
    change_from: str | None = None

    kind, size, accepts_several, headed = "traction", (COLUMN, 85.0), True, True
    caption = "The traction over the radius of the asperity that carries most, step by step from a reversal"
    # a patch has no radius to draw over
    order, needs = 5, "stick_radius"

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption with the asperity and its load."""
        asperity, _ = _chosen(history, None, None, STATES_IN_ONE)
        load = float(history["normal_load"].sel(asperity=asperity).max())
        return f"{cls.caption}: asperity {asperity}, up to {quantity_text(load, 'N', 3)}."

    def draw(self, canvas: Canvas, data: "xr.Dataset | Sequence[xr.Dataset]") -> None:
        """Draw the states of one history, or of several one after the other."""
        if self.across not in ACROSS:
            raise InputError(f"across is {self.across!r}; expected one of {', '.join(ACROSS)}")
        histories = as_history_list(data)
        states = [state for history in histories for state in self._states(history, single=len(histories) == 1)]
        if len(states) > MOST_IN_ONE:
            raise InputError(f"{len(states)} steps given; at most {MOST_IN_ONE} fit in one figure")
        labels = self.called_as([state.label for state in states], "states")
        axes = canvas.axes()
        # pictures drawn before, on these axes or on others with the same x axis, remain visible
        radius_end = max(panel.dataLim.x1 for panel in axes.get_shared_x_axes().get_siblings(axes))
        zero_lines(axes, vertical=False)
        if self.limit:
            self._draw_limits(axes, states)
        shades: Any = line_colours()(np.linspace(0, 1, len(states)))
        # states with names are no course: each has a colour of its own, but grey, which limits have
        colours = [colour for colour, *_ in STYLES if colour != GREY]
        if len(states) <= len(colours) and all(state.named for state in states):
            shades = colours[: len(states)]
        for colour, label, state in zip(shades, labels, states, strict=True):
            self._draw_state(axes, state, label, colour)
        if self.fronts and self.letters:
            self._name_fronts(axes, states)
        radius_end = max(radius_end, *(float(state.profile["radius"][-1]) for state in states)) or 1.0
        if self.ellipse_at is not None:
            radius_end = max(radius_end, self._draw_ellipse(axes, states, self.ellipse_at))
        axes.set_xlim(-radius_end if self.across == "diameter" else 0, radius_end)
        along = "distance from the centre" if self.across == "diameter" else "radius"
        axes.set(xlabel=f"{along} $r$ (m)", ylabel=r"traction $\tau$ (Pa)")
        if any(history.sizes["asperity"] > 1 for history in histories):
            axes.set_title(f"Traction of asperity {states[0].asperity}")

    def _states(self, history: xr.Dataset, *, single: bool) -> "list[_State]":
        asperity, steps = _chosen(history, self.asperity, self.steps, STATES_IN_ONE)
        profiles = rebuilt.profiles(history, asperity, steps, POINTS)
        start = None if self.change_from is None else resolve_step(self.change_from, history)
        base = None if start is None else rebuilt.profiles(history, asperity, [start], POINTS).isel(step=0)
        prefix = "" if single else f"{history.attrs.get('title', '')}, "
        return [
            _State(
                asperity,
                prefix + state_label(history, int(profiles["step"].values[row])),
                profiles.isel(step=row),
                base if start is not None and step > start else None,
                step in named_states(history).values(),
                float(history["normal_load"].isel(step=step, asperity=find_column(asperity, history))),
            )
            for row, step in enumerate(steps)
        ]

    def _draw_state(self, axes: "Axes", state: "_State", label: str, colour: Any) -> None:
        profile = state.profile
        radius, traction = self._line(profile, "traction")
        axes.plot(radius, traction, color=colour, linewidth=1.2, label=label)
        if state.base is not None:
            # both contacts are as large where the normal load is held; elsewhere the radii differ
            at, base = profile["radius"].values, state.base
            base_traction = np.append(np.interp(at, base["radius"].values, base["traction"].values, right=0.0), 0.0)
            thin: dict[str, Any] = {"color": colour, "linewidth": 0.8, "linestyle": (0, (3, 1.5))}
            axes.plot(
                radius, traction - self._both_sides(base_traction), label=f"change from {self.change_from}", **thin
            )
        stick = float(profile["stick_radius"])
        if self.fronts and stick > 0:
            for side in (stick, -stick) if self.across == "diameter" else (stick,):
                axes.plot([side], [0], "|", color=colour, ms=9, mew=1.6, zorder=4)

    def _draw_limits(self, axes: "Axes", states: "Sequence[_State]") -> None:
        """Draw ±μp of each state, dashed by friction coefficient; once for states with equal limits."""
        frictions = list(dict.fromkeys(state.friction for state in states if state.friction))
        seen: list[Floats] = []
        for state in states:
            line = np.stack(self._line(state.profile, "friction_limit"))
            if not state.friction or any(np.allclose(drawn_line, line, rtol=1e-9, atol=0.0) for drawn_line in seen):
                continue
            seen.append(line)
            pattern = (0, DASHES[frictions.index(state.friction) % len(DASHES)])
            name = r"$\pm\mu p$" + (rf", $\mu$ = {state.friction}" if len(frictions) > 1 else "")
            for sign, label in ((1, name), (-1, None)):
                looks = DASHED | {"linewidth": 0.8, "linestyle": pattern, "zorder": 1}
                axes.plot(line[0], sign * line[1], label=label, **looks)

    def _name_fronts(self, axes: "Axes", states: "Sequence[_State]") -> None:
        """Name the slip fronts above the axis, and below it the annulus of slip of a single one."""
        looks: dict[str, Any] = {"ha": "center", "fontstyle": "italic", "textcoords": "offset points", "zorder": 6}
        profiles = [state.profile for state in states if float(state.profile["stick_radius"]) > 0]
        ends = [(float(profile["stick_radius"]), float(profile["contact_radius"])) for profile in profiles]
        if len(self.letters) != len(ends):
            raise InputError(f"letters has {len(self.letters)}; expected one for each of {len(ends)} slip fronts")
        for letter, (stick, _) in zip(self.letters, ends, strict=True):
            axes.annotate(letter, (stick, 0), (-5, 3), **looks)
        if len(ends) == 1:
            (letter,), ((stick, edge),) = self.letters, ends
            below: Any = axes.get_xaxis_transform()
            axes.annotate("", (stick, 0.42), (edge, 0.42), xycoords=below, textcoords=below, arrowprops=SPAN)
            axes.annotate(f"a - {letter}", ((stick + edge) / 2, 0.42), (0, -10), xycoords=below, **looks)

    def _draw_ellipse(self, axes: "Axes", states: "Sequence[_State]", load: float) -> float:
        """Draw the friction limit of a sphere at another load, where μ goes as N^(-1/3), and return its radius."""
        reference = max(states, key=lambda state: float(state.profile["friction_limit"].max()))
        if reference.normal_load <= 0 or load <= 0:
            raise InputError("ellipse_at: expected a load above 0, and a state in contact")
        radius, bound = self._line(reference.profile, "friction_limit")
        radius = radius * (load / reference.normal_load) ** (1 / 3)
        dots: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}
        name = rf"slides at {quantity_text(load, 'N')}, $\mu \propto N^{{-1/3}}$"
        for sign, label in ((1, name), (-1, None)):
            axes.plot(radius, sign * bound, label=label, **dots)
        return float(radius[-1])

    def _line(self, profile: xr.Dataset, name: str) -> tuple[Floats, Floats]:
        """Return the radii of a profile and its values, up to the edge of the contact, where they are 0."""
        edge, radius = float(profile["contact_radius"]), profile["radius"].values
        values = np.append(np.where(radius < edge, profile[name].values, 0.0), 0.0)
        return self._both_sides(np.append(np.minimum(radius, edge), edge), odd=True), self._both_sides(values)

    def _both_sides(self, values: Floats, *, odd: bool = False) -> Floats:
        """Return values along the radius, or mirrored along the diameter; a radius itself is negative there."""
        return values if self.across == "radius" else _mirror(values, odd=odd)


@attrs.frozen(eq=False)
class _State:
    """A state of an asperity: its label, its profiles over the radius, and those that changes are drawn from."""

    asperity: int
    label: str
    profile: xr.Dataset
    base: xr.Dataset | None
    named: bool
    normal_load: float

    @property
    def friction(self) -> str:
        """Its friction coefficient; empty where nothing touches, or without friction."""
        limit, pressure = (float(self.profile[name].max()) for name in ("friction_limit", "pressure"))
        return f"{limit / pressure:.3g}" if limit > 0 else ""


def _mirror(values: Floats, *, odd: bool = False) -> Floats:
    negative_side = values[:0:-1]
    return np.concatenate([-negative_side if odd else negative_side, values])


# Height of the friction limit over the distance of two lines, and the most that a line comes down to the one below.
HIGHEST, CLOSEST = 1.6, 0.9


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

    kind, size, own_figure = "slip-fronts", (COLUMN, 110.0), True
    caption = "The same step by step: what sticks is drawn thick, and its edge is the slip front."
    order, needs = 6, "stick_radius"

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw each line above the one before; the stick zone is thick, and where it ends is the slip front."""
        asperity, chosen = _chosen(data, self.asperity, self.steps, LINES)
        if len(chosen) > MOST_LINES:
            raise InputError(f"{len(chosen)} steps given; at most {MOST_LINES} fit in one figure")
        profiles = rebuilt.profiles(data, asperity, chosen, POINTS)
        across = _mirror(profiles["radius"].values, odd=True)
        largest = float(profiles["friction_limit"].values.max(initial=0.0)) or 1.0
        # each change is seen, and no line crosses the one before: from step to step a traction may turn round
        step_up = np.diff(profiles["traction"].values, axis=0).min(initial=0.0) / largest
        height = min(HIGHEST, CLOSEST / -step_up) if step_up else HIGHEST
        axes = canvas.axes()
        for row in range(len(chosen)):
            line = row + _mirror(profiles["traction"].values[row] / largest * height)
            for name, radius_name, colour, width in (
                ("slips", "contact_radius", STATE_COLOURS[2], 0.8),
                ("sticks", "stick_radius", STATE_COLOURS[1], 1.6),
            ):
                radius = float(profiles[radius_name].values[row])
                if radius > 0:
                    inside = np.abs(across) <= radius
                    looks: dict[str, Any] = {"color": colour, "linewidth": width, "solid_capstyle": "butt"}
                    axes.plot(across[inside], line[inside], label=name, **looks)
        ticks = np.arange(0, len(chosen), -(-len(chosen) // MOST_TICKS))
        labels = [f"{profiles['step'].values[row]},  {profiles['time'].values[row]:.4g} s" for row in ticks]
        axes.set_yticks(ticks, labels)
        axes.set(title=f"Slip fronts of asperity {asperity}", xlabel="$r$ (m)", ylabel="step, time")
        canvas.legend(extra=f"{quantity_text(largest / height, 'Pa', 3)} from line to line")


def _chosen(
    history: xr.Dataset, asperity: int | None, steps: Sequence[int | str] | None, count: int
) -> tuple[int, list[int]]:
    """Return the asperity and the steps to draw, by default of the one that carries most."""
    check_recorded(history, "slip_state", "normal_load", "contact_radius")
    check_any(history)
    if steps is not None and not len(steps):
        raise InputError("steps is empty; expected one step or more")
    middle = representative_step(history)
    if asperity is None:
        heaviest = int(history["normal_load"].isel(step=middle).values.argmax())
        asperity = int(history["asperity"].values[heaviest])
    column = find_column(asperity, history)
    if steps is None and 0 < len(named_states(history)) <= MOST_IN_ONE and count == STATES_IN_ONE:
        steps = list(named_states(history))
    if steps is not None:
        return asperity, [resolve_step(step, history) for step in steps]
    return asperity, _swing_steps(history, column, middle, count)


def _swing_steps(history: xr.Dataset, column: int, middle: int, count: int) -> list[int]:
    """Return steps of the swing around a step, up to where an asperity slides."""
    ranges = list(swings(history["tangential_displacement"].values))
    start, stop = next(
        (limits for limits in ranges if limits[0] <= middle <= limits[1]), (0, history.sizes["step"] - 1)
    )
    states = history["slip_state"].isel(step=slice(start, stop + 1), asperity=column).values
    # it slides until it turns round: where the swing begins that may still be the case
    begun = int((states != GROSS_SLIP).argmax())
    slides = np.flatnonzero(states[begun:] == GROSS_SLIP)
    stop_step = start + begun + int(slides[0]) if slides.size else stop
    return [int(step) for step in np.unique(np.linspace(start, max(stop_step, start), count).round())]


@PICTURES.register
@attrs.frozen(kw_only=True)
class AsperityPicture(Picture):
    """The traction that one asperity remembers, within ± friction times the pressure; reversals are dotted."""

    kind, of, size, own_figure = "asperity", (Asperity,), (COLUMN, 66.0), True

    def draw(self, canvas: Canvas, data: Asperity) -> None:
        """Draw it over the radius."""
        extent = 1.1 * data.contact_radius or 1.0
        radius = np.linspace(0.0, extent, 801)
        axes = canvas.axes()
        for sign, label in ((1, "± friction × pressure"), (-1, None)):
            bound = sign * data.friction * data.pressure(radius)
            axes.plot(radius, bound, color=FAINT, linewidth=0.8, linestyle="--", label=label)
        traction = data.traction(radius)
        names = ("traction in x", "traction in y") if traction.ndim > 1 else ("traction",)
        columns = traction.reshape(radius.size, -1).T
        for name, values, colour in zip(names, columns, STATE_COLOURS[1:], strict=False):
            axes.plot(radius, values, color=colour, linewidth=1.2, label=name)
        for reversal in data.reversal_points.radius if data.has_moved_straight else ():
            axes.axvline(reversal, color=INK, linewidth=0.5, linestyle=":")
        axes.set(xlim=(0.0, extent), xlabel="radius (m)", ylabel="tangential traction (Pa)")
        label = "asperity" if data.index is None else f"asperity {data.index}"
        axes.set_title(f"{label}, {data.state_text}")


RINGS = (0.15, 0.38, 0.61, 0.8, 0.94)  # radii of the rings that have arrows, over the contact radius
MOST_CIRCLES, CIRCLES = 12, 6
SLIPPING, STICKING = "#c9c9c9", "#ffffff"


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipAnnulusPicture(Picture):
    """The tractions over the contact of an asperity at several steps, as arrows; where it slips is grey.

    From the middle to the dashed circle it sticks; the annulus around that slips in the direction of its traction,
    which is the friction limit. Arrows are in scale with one another, and circles, too.

    Attributes
    ----------
    asperity
        Which; by default the one that carries most.
    steps
        Up to 12 states, by number or name; by default all that have a name, or else 6 after the first move.
    """

    asperity: int | None = None
    steps: tuple[int | str, ...] | None = None

    kind, size, own_figure, order, only_planar = "slip-annulus", (TWO_COLUMNS, 125.0), True, 5, True
    needs = "stick_radius"
    caption = "Tractions over the contact of the asperity that carries most; where it slips is grey."

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw a circle for each step."""
        check_recorded(data, "slip_state", "normal_load", "contact_radius")
        check_any(data)
        steps = self._chosen(data)
        label = self.asperity
        if label is None:
            label = int(data["asperity"].values[data["normal_load"].isel(step=steps).values.max(axis=0).argmax()])
        asperities = rebuilt.replay_asperities(data, label, steps)
        edge = max(contact.contact_radius for contact in asperities)
        if edge == 0:
            raise InputError(f"asperity {label} does not touch at any of the steps; expected one at which it does")
        rings = [_ring_arrows(contact) for contact in asperities]
        largest_traction = max(float(np.hypot(*arrows[:, 2:].T).max(initial=0.0)) for arrows in rings)
        # the longest arrow is as long as rings stand apart
        arrow: dict[str, Any] = {
            "angles": "xy",
            "scale_units": "xy",
            "scale": (largest_traction or 1.0) / (0.25 * edge),
        }
        arrow |= {"color": INK, "pivot": "mid", "width": 0.006, "minlength": 0.3, "zorder": 3}
        grid = canvas.maps(len(steps), max(1, round((len(steps) * canvas.height / canvas.width) ** 0.5)))
        for axes, contact, arrows, step in zip(grid.flat, asperities, rings, steps, strict=False):
            _draw_circles(axes, contact)
            axes.quiver(*arrows.T, **arrow)
            axes.set_title(state_label(data, step))
            axes.set_aspect("equal")
        for axes in grid.flat[len(steps) :]:
            axes.set_visible(False)
        grid[0, 0].set(xlim=(-1.08 * edge, 1.08 * edge), ylim=(-1.08 * edge, 1.08 * edge))
        handles = patches((STICKING, SLIPPING), ("sticks", "slips"))
        canvas.legend(extra=f"longest arrow: {quantity_text(largest_traction, 'Pa', 3)}", handles=handles)
        title = str(data.attrs.get("title", ""))
        canvas.heading(f"{title}: asperity {label}" if title else f"Asperity {label}")

    def _chosen(self, data: xr.Dataset) -> list[int]:
        if self.steps is not None and not 0 < len(self.steps) <= MOST_CIRCLES:
            raise InputError(f"steps has {len(self.steps)}; expected 1 to {MOST_CIRCLES}")
        if self.steps is not None:
            return [resolve_step(candidate, data) for candidate in self.steps]
        named = list(named_states(data).values())
        if 0 < len(named) <= MOST_CIRCLES:
            return named
        moved = np.flatnonzero(data["total_tangential_load"].values.any(axis=1))
        start = int(moved[0]) if moved.size else 0
        return [
            int(candidate)
            for candidate in np.unique(np.linspace(start, data.sizes["step"] - 1, CIRCLES + 1)[1:].round())
        ]


def _ring_arrows(contact: Any) -> Floats:
    """Return places [m] and tractions [Pa] on the rings of an asperity (arrow, 4)."""
    if contact.contact_radius == 0:
        return np.empty((0, 4))
    tractions = []
    for share, traction in zip(RINGS, contact.traction(np.array(RINGS) * contact.contact_radius), strict=True):
        count = max(1, round(16 * share))
        around = np.arange(count) / count * 2 * np.pi
        at = share * contact.contact_radius * np.stack([np.cos(around), np.sin(around)], axis=1)
        tractions.append(np.column_stack([at, np.broadcast_to(traction, at.shape)]))
    return np.concatenate(tractions)


def _draw_circles(axes: "Axes", contact: Any) -> None:
    """Draw the contact of an asperity and its stick zone."""
    from matplotlib.patches import Circle

    if contact.contact_radius > 0:
        axes.add_patch(Circle((0, 0), contact.contact_radius, facecolor=SLIPPING, edgecolor=INK, linewidth=0.9))
    if contact.stick_radius > 0:
        looks: dict[str, Any] = {"facecolor": STICKING, "edgecolor": INK, "linewidth": 0.7, "linestyle": (0, (3, 2))}
        axes.add_patch(Circle((0, 0), contact.stick_radius, **looks))
