"""Pictures of the traction over the radius of an asperity: several states in one, its slip fronts, and its memory."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import attrs
import numpy as np
import numpy.typing as npt
import xarray as xr

from historysim.asperities.asperity import Asperity
from historysim.basics.arguments import Floats
from historysim.basics.fields import Quantity
from historysim.basics.units import newtons, quantity_text
from historysim.errors import InputError
from historysim.results import rebuilt
from historysim.results.analysis.recorded import GROSS_SLIP, check_any, check_recorded, column_of
from historysim.results.analysis.slips import representative_step
from historysim.results.origin import named_states, state_label, step_of
from historysim.results.plots.canvas import COLUMN, Canvas
from historysim.results.plots.pictures import PICTURES, Panel, Picture, several_of
from historysim.results.plots.style import (
    FAINT,
    INK,
    SPAN,
    STATE_COLOURS,
    line_colours,
    scale_of,
    scaled,
    swings,
    zero_lines,
)
from historysim.results.plots.style import LINES as STYLES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ACROSS = ("radius", "diameter")
STATES_IN_ONE, MOST_IN_ONE = 5, 10
LINES, MOST_LINES, MOST_TICKS = 24, 200, 8
POINTS = 401
# Dashes of the limits of one friction coefficient, and of the next.
DASHES = (4, 2), (1, 1.5), (6, 2, 1, 2), (2, 2), (8, 3)
GREY = "#7a7a7a"
LIMIT = "friction limit"  # the group of limits among the lines


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

    kind, size, several = "traction", (COLUMN, 85.0), True
    caption = "The traction over the radius of the asperity that carries most, step by step from a reversal"
    # a patch has no radius to draw over
    order, needs = 5, "stick_radius"

    @classmethod
    def caption_of(cls, history: xr.Dataset) -> str:
        """Return the caption with the asperity and its load."""
        asperity, _ = _chosen(history, None, None, STATES_IN_ONE)
        load = float(history["normal_load"].sel(asperity=asperity).max())
        return f"{cls.caption}: asperity {asperity}, up to {quantity_text(load, 'N', 3)}."

    def draw(self, canvas: Canvas, data: "xr.Dataset | Sequence[xr.Dataset]") -> None:
        """Draw the states of one history, or of several one after the other."""
        if self.across not in ACROSS:
            raise InputError(f"across is {self.across!r}; expected one of {', '.join(ACROSS)}")
        histories = several_of(data)
        states = [state for history in histories for state in self._states(history, alone=len(histories) == 1)]
        if len(states) > MOST_IN_ONE:
            raise InputError(f"{len(states)} steps given; at most {MOST_IN_ONE} fit in one figure")
        if self.labels and len(self.labels) != len(states):
            raise InputError(f"labels has {len(self.labels)}; expected one for each of {len(states)} states")
        profiles = [state.profile for state in states]
        factor, stress_unit = scale_of("Pa", *(part["friction_limit"].values for part in profiles))
        along, unit = scale_of("m", *(part["radius"].values for part in profiles))
        axes = canvas.axes()
        zero_lines(axes, vertical=False)
        frictions = list(dict.fromkeys(f"{_friction(part):.3g}" for part in profiles if _friction(part) > 0))
        shades: Any = line_colours()(np.linspace(0, 1, len(states)))
        # states with names are no course: each has a colour of its own, but grey, which limits have
        own = [colour for colour, *_ in STYLES if colour != GREY]
        if len(states) <= len(own) and all(state.named for state in states):
            shades = own[: len(states)]
        for colour, label, state in zip(shades, self.labels or [each.label for each in states], states, strict=True):
            self._draw_state(axes, state, label, colour, along, factor, frictions)
        if self.fronts and self.letters:
            self._name_fronts(axes, states, along)
        end = max(float(part["radius"][-1]) for part in profiles) * along or 1.0
        if self.ellipse_at is not None:
            end = max(end, self._draw_ellipse(axes, states, along, factor))
        axes.set_xlim(-end if self.across == "diameter" else 0, end)
        axes.set(
            xlabel=rf"{'distance from the centre' if self.across == 'diameter' else 'radius'} $r$ ({unit})",
            ylabel=rf"traction $\tau$ ({stress_unit})",
        )
        if any(history.sizes["asperity"] > 1 for history in histories):
            axes.set_title(f"Traction of asperity {states[0].asperity}")
        canvas.legend(axes)
        canvas.title(axes, self.title, str(histories[0].attrs.get("title", "")) if len(histories) == 1 else "")

    def _states(self, history: xr.Dataset, *, alone: bool) -> "list[_State]":
        asperity, steps = _chosen(history, self.asperity, self.steps, STATES_IN_ONE)
        found = rebuilt.profiles(history, asperity, steps, POINTS)
        start = None if self.change_from is None else step_of(history, self.change_from)
        base = None if start is None else rebuilt.profiles(history, asperity, [start], POINTS).isel(step=0)
        before = "" if alone else f"{history.attrs.get('title', '')}, "
        return [
            _State(
                asperity,
                before + state_label(history, int(found["step"].values[row])),
                found.isel(step=row),
                base if start is not None and step > start else None,
                step in named_states(history).values(),
                float(history["normal_load"].values[step, column_of(asperity, history)]),
            )
            for row, step in enumerate(steps)
        ]

    def _draw_state(
        self,
        axes: "Axes",
        state: "_State",
        label: str,
        colour: Any,
        along: float,
        factor: float,
        frictions: Sequence[str],
    ) -> None:
        part = state.profile
        # a traction ends at the edge of the contact; what lies beyond is no part of it
        edge = float(part["contact_radius"])
        radius = self._both_sides(np.append(np.minimum(part["radius"].values, edge), edge) * along, odd=True)
        if self.limit:
            bound = self._both_sides(_to_edge(part, "friction_limit") * factor)
            _draw_limit(axes, radius, bound, f"{_friction(part):.3g}", frictions)
        traction = self._both_sides(_to_edge(part, "traction") * factor)
        axes.plot(radius, traction, color=colour, linewidth=1.2, label=label)
        if state.base is not None:
            change = traction - self._both_sides(_at_radii_of(part, state.base) * factor)
            thin: dict[str, Any] = {"color": colour, "linewidth": 0.8, "linestyle": (0, (3, 1.5))}
            axes.plot(radius, change, label=f"change from {self.change_from}", **thin)
        stick = float(part["stick_radius"]) * along
        if self.fronts and stick > 0:
            for side in (stick, -stick) if self.across == "diameter" else (stick,):
                axes.plot([side], [0], "|", color=colour, ms=9, mew=1.6, zorder=4)

    def _name_fronts(self, axes: "Axes", states: "Sequence[_State]", along: float) -> None:
        """Name the slip fronts above the axis, and below it the annulus of slip of a single one."""
        looks: dict[str, Any] = {"ha": "center", "fontstyle": "italic", "textcoords": "offset points", "zorder": 6}
        ends = [
            (float(state.profile["stick_radius"]) * along, float(state.profile["contact_radius"]) * along)
            for state in states
            if float(state.profile["stick_radius"]) > 0
        ]
        if len(self.letters) != len(ends):
            raise InputError(f"letters has {len(self.letters)}; expected one for each of {len(ends)} slip fronts")
        for letter, (stick, _) in zip(self.letters, ends, strict=True):
            axes.annotate(letter, (stick, 0), (-5, 3), **looks)
        if len(ends) == 1:
            (letter,), ((stick, edge),) = self.letters, ends
            below: Any = axes.get_xaxis_transform()
            axes.annotate("", (stick, 0.42), (edge, 0.42), xycoords=below, textcoords=below, arrowprops=SPAN)
            axes.annotate(f"a - {letter}", ((stick + edge) / 2, 0.42), (0, -10), xycoords=below, **looks)

    def _draw_ellipse(self, axes: "Axes", states: "Sequence[_State]", along: float, factor: float) -> float:
        """Draw the friction limit of a sphere at another load, where μ goes as N^(-1/3), and return its radius."""
        one = max(states, key=lambda state: float(state.profile["friction_limit"].max()))
        if one.normal_load <= 0 or (self.ellipse_at or 0.0) <= 0:
            raise InputError("ellipse_at: expected a load above 0, and a state in contact")
        wider = ((self.ellipse_at or 0.0) / one.normal_load) ** (1 / 3)
        radius = np.append(one.profile["radius"].values, float(one.profile["contact_radius"])) * wider * along
        bound = self._both_sides(_to_edge(one.profile, "friction_limit") * factor)
        dots: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}
        name = rf"slides at {quantity_text(self.ellipse_at or 0.0, 'N')}, $\mu \propto N^{{-1/3}}$"
        for sign, label in ((1, name), (-1, None)):
            axes.plot(self._both_sides(radius, odd=True), sign * bound, label=label, **dots)
        return float(radius[-1])

    def _both_sides(self, values: Floats, *, odd: bool = False) -> Floats:
        """Return values along the radius, or mirrored along the diameter; a radius itself is negative there."""
        return values if self.across == "radius" else _mirrored(values, odd=odd)


@attrs.frozen(eq=False)
class _State:
    """A state of an asperity: its label, its profiles over the radius, and those that changes are drawn from."""

    asperity: int
    label: str
    profile: xr.Dataset
    base: xr.Dataset | None
    named: bool
    normal_load: float


def _draw_limit(axes: "Axes", radius: Floats, bound: Floats, friction: str, frictions: Sequence[str]) -> None:
    """Draw ±μp of a state with its own friction, its dashes those of this friction; once where states have the same."""
    limits = [line.get_xydata() for line in axes.get_lines() if line.get_gid() == LIMIT]
    same = any(np.allclose(each, np.column_stack([radius, bound]), rtol=1e-9, atol=0.0) for each in limits)
    if friction not in frictions or same:
        return
    pattern = (0, DASHES[frictions.index(friction) % len(DASHES)])
    dashes: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "linestyle": pattern, "zorder": 1}
    name = r"$\pm\mu p$" + (rf", $\mu$ = {friction}" if len(frictions) > 1 else "")
    axes.plot(radius, bound, label=name, gid=LIMIT, **dashes)
    axes.plot(radius, -bound, **dashes)


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


def _mirrored(values: Floats, *, odd: bool = False) -> Floats:
    other = values[:0:-1]
    return np.concatenate([-other if odd else other, values])


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

    kind, size, alone = "slip-fronts", (COLUMN, 110.0), True
    caption = "The same step by step: what sticks is drawn thick, and its edge is the slip front."
    order, needs = 6, "stick_radius"

    def draw(self, canvas: Canvas, data: xr.Dataset) -> None:
        """Draw each line above the one before; the stick zone is thick, and where it ends is the slip front."""
        asperity, chosen = _chosen(data, self.asperity, self.steps, LINES)
        if len(chosen) > MOST_LINES:
            raise InputError(f"{len(chosen)} steps given; at most {MOST_LINES} fit in one figure")
        found = rebuilt.profiles(data, asperity, chosen, POINTS)
        factor, radius_unit = scale_of("m", found["radius"].values)
        across = _mirrored(found["radius"].values, odd=True) * factor
        largest = float(found["friction_limit"].values.max(initial=0.0)) or 1.0
        # each change is seen, and no line crosses the one before: from step to step a traction may turn round
        step_up = np.diff(found["traction"].values, axis=0).min(initial=0.0) / largest
        height = min(HIGHEST, CLOSEST / -step_up) if step_up else HIGHEST
        looks: dict[str, dict[str, Any]] = {
            "slips": {"color": STATE_COLOURS[2], "linewidth": 0.8},
            "sticks": {"color": STATE_COLOURS[1], "linewidth": 1.6},
        }
        axes = canvas.axes()
        for row in range(len(chosen)):
            line = row + _mirrored(found["traction"].values[row] / largest * height)
            for name, radius in (("slips", "contact_radius"), ("sticks", "stick_radius")):
                inside = np.abs(across) <= float(found[radius].values[row]) * factor
                if found[radius].values[row] > 0:
                    axes.plot(across[inside], line[inside], solid_capstyle="butt", label=name, **looks[name])
        ticks = np.arange(0, len(chosen), -(-len(chosen) // MOST_TICKS))
        labels = [f"{found['step'].values[row]},  {found['time'].values[row]:.4g} s" for row in ticks]
        axes.set_yticks(ticks, labels)
        axes.set(title=f"Slip fronts of asperity {asperity}", xlabel=f"$r$ ({radius_unit})", ylabel="step, time")
        canvas.legend(axes, extra=f"{quantity_text(largest / height, 'Pa', 3)} from line to line")


def _chosen(
    history: xr.Dataset, asperity: int | None, steps: Sequence[int | str] | None, count: int
) -> tuple[int, list[int]]:
    """Return the asperity and the steps to draw, by default of the one that carries most."""
    check_recorded(history, "slip_state", "normal_load", "contact_radius")
    check_any(history)
    if steps is not None and not len(steps):
        raise InputError("steps is empty; expected one step or more")
    telling = representative_step(history)
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
class AsperityPicture(Picture):
    """The traction that one asperity remembers, within ± friction times the pressure; reversals are dotted."""

    kind, of, size, alone = "asperity", (Asperity,), (COLUMN, 66.0), True

    def draw(self, canvas: Canvas, data: Asperity) -> None:
        """Draw it over the radius."""
        extent = 1.1 * data.contact_radius or 1.0
        radius = np.linspace(0.0, extent, 801)
        limit = data.friction * data.pressure(radius)
        lengths, length_unit = scaled(radius, "m")
        stresses, stress_unit = scaled(np.stack([data.traction(radius), limit, -limit]), "Pa")
        axes = canvas.axes()
        for bound, label in ((stresses[1], "± friction × pressure"), (stresses[2], None)):
            axes.plot(lengths, bound, color=FAINT, linewidth=0.8, linestyle="--", label=label)
        axes.plot(lengths, stresses[0], color=STATE_COLOURS[1], linewidth=1.2, label="traction")
        for reversal in data.reversal_points.radius:
            axes.axvline(reversal * lengths[-1] / extent, color=INK, linewidth=0.5, linestyle=":")
        axes.set_xlim(0.0, lengths[-1])
        axes.set(xlabel=f"radius ({length_unit})", ylabel=f"tangential traction ({stress_unit})")
        axes.set_title(f"asperity {data.index}, {data.slip_state.name.lower().replace('_', ' ')}")
        canvas.legend(axes)
