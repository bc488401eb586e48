"""Pictures of the traction of an asperity: states over its radius, slip fronts, its memory, and arrows over a plane."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import attrs
import numpy as np
import xarray as xr

from historysim.asperities.asperity import Asperity
from historysim.basics.arguments import Floats
from historysim.basics.fields import Force
from historysim.basics.units import quantity_text
from historysim.errors import InputError
from historysim.results import recompute
from historysim.results.analysis.recorded import GROSS_SLIP, check_any, check_recorded, find_column
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.canvas import COLUMN, TWO_COLUMNS
from historysim.results.plots.chart import Chart, Curve, Item, Note, Shape, Sheet, span, state_keys
from historysim.results.plots.pictures import PICTURES, Panel, Picture, as_history_list
from historysim.results.plots.style import DASHED, FAINT, INK, STATE_COLOURS, Look, line_colours
from historysim.results.plots.style import LINES as STYLES
from historysim.results.steps import named_states, resolve_step, state_label

ACROSS = {"radius": "radius", "diameter": "distance from the centre"}
STATES_IN_ONE, MOST_IN_ONE = 5, 10
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
        Its label; by default the one that carries most.
    across
        ``"radius"`` or ``"diameter"``.
    limit
        Draws ±μp of each state.
    fronts
        Marks the slip fronts.
    letters
        Names of these marks, in the order of the states; of a single one the annulus of slip has a
        name, too.
    ellipse_at
        A normal load at which a sphere of the same shear strength slides: its ellipse is as high,
        and wider.
    change_from
        A state from which changes are drawn.

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
    ellipse_at: Force | None = None
    change_from: str | None = None

    kind, size, accepts_several, headed = "traction", (COLUMN, 85.0), True, True
    caption = "The traction over the radius of the asperity that carries most, step by step from a reversal"
    # a patch has no radius to draw over
    order, needs, report_options = 5, "stick_radius", {"fronts": True}

    @classmethod
    def report_caption(cls, history: xr.Dataset) -> str:
        """Return the caption with the asperity and its load."""
        asperity, _ = _chosen(history, None, None)
        load = float(history["normal_load"].sel(asperity=asperity).max())
        return f"{cls.caption}: asperity {asperity}, up to {quantity_text(load, 'N', 3)}."

    def sheet(self, data: "xr.Dataset | Sequence[xr.Dataset]") -> Chart:
        """Return the states of one history, or of several in sequence."""
        if self.across not in ACROSS:
            raise InputError(f"across is {self.across!r}; expected one of {', '.join(ACROSS)}")
        histories = as_history_list(data)
        states = [
            state
            for history in histories
            for state in self._states(history, single=len(histories) == 1)
        ]
        if len(states) > MOST_IN_ONE:
            raise InputError(f"{len(states)} steps given; at most {MOST_IN_ONE} fit in one figure")
        labels = self.resolve_labels([state.label for state in states], "states")
        shades: Any = line_colours()(np.linspace(0, 1, len(states)))
        # named states are separate: each has its colour, but not the grey of limits
        colours = [colour for colour, *_ in STYLES if colour != GREY]
        if len(states) <= len(colours) and all(state.named for state in states):
            shades = colours[: len(states)]
        items = self._limits(states) if self.limit else []
        for colour, label, state in zip(shades, labels, states, strict=True):
            items += self._state(state, label, colour)
        if self.fronts and self.letters:
            items += self._front_names(states)
        reach = max(float(state.profile["radius"][-1]) for state in states)
        if self.ellipse_at is not None:
            ellipse, radius = self._ellipse(states, self.ellipse_at)
            items = items + ellipse
            reach = max(reach, radius)
        has_neighbours = any(history.sizes["asperity"] > 1 for history in histories)
        return Chart(
            items=[*items, _Reach(reach or 1.0, both=self.across == "diameter")],
            x=f"{ACROSS[self.across]} $r$ (m)",
            y=r"traction $\tau$ (Pa)",
            title=f"Traction of asperity {states[0].asperity}" if has_neighbours else "",
            zero="x",
        )

    def _states(self, history: xr.Dataset, *, single: bool) -> "list[_State]":
        asperity, steps = _chosen(history, self.asperity, self.steps)
        profiles = recompute.profiles(history, asperity, steps, POINTS)
        start = None if self.change_from is None else resolve_step(self.change_from, history)
        base = (
            None
            if start is None
            else recompute.profiles(history, asperity, [start], POINTS).isel(step=0)
        )
        prefix = "" if single else f"{history.attrs.get('title', '')}, "
        return [
            _State(
                asperity,
                prefix + state_label(history, int(profiles["step"].values[row])),
                profiles.isel(step=row),
                base if start is not None and step > start else None,
                step in named_states(history).values(),
                float(
                    history["normal_load"].isel(step=step, asperity=find_column(asperity, history))
                ),
            )
            for row, step in enumerate(steps)
        ]

    def _state(self, state: "_State", label: str, colour: Any) -> list[Item]:
        """Return the traction of a state, its change and its slip fronts."""
        profile = state.profile
        radius, traction = self._line(profile, "traction")
        items: list[Item] = [Curve(radius, traction, label, {"color": colour, "linewidth": 1.2})]
        if state.base is not None:
            # the radii differ where the normal load changes
            at = profile["radius"].values
            base = state.base
            base_traction = np.append(
                np.interp(at, base["radius"].values, base["traction"].values, right=0.0), 0.0
            )
            thin = {"color": colour, "linewidth": 0.8, "linestyle": (0, (3, 1.5))}
            change = traction - self._both_sides(base_traction)
            items.append(Curve(radius, change, f"change from {self.change_from}", thin))
        stick = float(profile["stick_radius"])
        if self.fronts and stick > 0:
            sides = (stick, -stick) if self.across == "diameter" else (stick,)
            look = {
                "marker": "|",
                "linestyle": "",
                "color": colour,
                "ms": 9,
                "mew": 1.6,
                "zorder": 4,
            }
            items.append(Curve(sides, [0] * len(sides), "", look))
        return items

    def _limits(self, states: "Sequence[_State]") -> list[Item]:
        """Return ±μp of each state, dashed by friction coefficient; once for states with equal limits."""
        frictions = list(dict.fromkeys(state.friction for state in states if state.friction))
        seen: list[Floats] = []
        items: list[Item] = []
        for state in states:
            line = np.stack(self._line(state.profile, "friction_limit"))
            if not state.friction or any(
                np.allclose(drawn_line, line, rtol=1e-9, atol=0.0) for drawn_line in seen
            ):
                continue
            seen.append(line)
            pattern = (0, DASHES[frictions.index(state.friction) % len(DASHES)])
            name = r"$\pm\mu p$" + (rf", $\mu$ = {state.friction}" if len(frictions) > 1 else "")
            look = DASHED | {"linewidth": 0.8, "linestyle": pattern, "zorder": 1}
            items += [Curve(line[0], line[1], name, look), Curve(line[0], -line[1], "", look)]
        return items

    def _front_names(self, states: "Sequence[_State]") -> list[Item]:
        """Return the names of the slip fronts above the axis, and below it the annulus of slip of a single one."""
        profiles = [state.profile for state in states if float(state.profile["stick_radius"]) > 0]
        ends = [
            (float(profile["stick_radius"]), float(profile["contact_radius"]))
            for profile in profiles
        ]
        if len(self.letters) != len(ends):
            raise InputError(
                f"letters has {len(self.letters)}; expected one for each of {len(ends)} slip fronts"
            )
        look = {"ha": "center", "fontstyle": "italic", "fontsize": 8}
        items: list[Item] = [
            Note(letter, (stick, 0), (-5, 3), look)
            for letter, (stick, _) in zip(self.letters, ends, strict=True)
        ]
        if len(ends) == 1:
            (letter,), ((stick, edge),) = self.letters, ends
            below = ("data", "axes fraction")
            items.append(span((stick, 0.42), (edge, 0.42), xycoords=below, textcoords=below))
            items.append(
                Note(
                    f"a - {letter}", ((stick + edge) / 2, 0.42), (0, -2), look | {"xycoords": below}
                )
            )
        return items

    def _ellipse(self, states: "Sequence[_State]", load: float) -> tuple[list[Item], float]:
        """Return the friction limit of a sphere at another load, where μ varies as N^(-1/3), and its radius."""
        reference = max(states, key=lambda state: float(state.profile["friction_limit"].max()))
        if reference.normal_load <= 0 or load <= 0:
            raise InputError("ellipse_at: expected a load above 0, and a state in contact")
        radius, bound = self._line(reference.profile, "friction_limit")
        radius = radius * (load / reference.normal_load) ** (1 / 3)
        dots = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.5))}
        name = rf"slides at {quantity_text(load, 'N')}, $\mu \propto N^{{-1/3}}$"
        return [Curve(radius, bound, name, dots), Curve(radius, -bound, "", dots)], float(
            radius[-1]
        )

    def _line(self, profile: xr.Dataset, name: str) -> tuple[Floats, Floats]:
        """Return the radii of a profile and its values, up to the edge of the contact, where they are 0."""
        edge = float(profile["contact_radius"])
        radius = profile["radius"].values
        values = np.append(np.where(radius < edge, profile[name].values, 0.0), 0.0)
        return self._both_sides(
            np.append(np.minimum(radius, edge), edge), odd=True
        ), self._both_sides(values)

    def _both_sides(self, values: Floats, *, odd: bool = False) -> Floats:
        """Return values along the radius, or mirrored along the diameter; a radius itself is negative there."""
        return values if self.across == "radius" else _mirror(values, odd=odd)


@attrs.frozen(eq=False)
class _Reach:
    """Limits of the radius that keep earlier curves visible, on these axes and on others with the same x axis."""

    radius: float
    both: bool

    def draw(self, axes: Any) -> None:
        """Set the limits."""
        siblings = axes.get_shared_x_axes().get_siblings(axes)
        reach = max(self.radius, *(panel.dataLim.x1 for panel in siblings))
        axes.set_xlim(-reach if self.both else 0, reach)


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
        limit, pressure = (
            float(self.profile[name].max()) for name in ("friction_limit", "pressure")
        )
        return f"{limit / pressure:.3g}" if limit > 0 else ""


def _mirror(values: Floats, *, odd: bool = False) -> Floats:
    negative_side = values[:0:-1]
    return np.concatenate([-negative_side if odd else negative_side, values])


def _chosen(
    history: xr.Dataset, asperity: int | None, steps: Sequence[int | str] | None
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
    if steps is None and 0 < len(named_states(history)) <= MOST_IN_ONE:
        steps = list(named_states(history))
    if steps is not None:
        return asperity, [resolve_step(step, history) for step in steps]
    return asperity, _swing_steps(history, column, middle)


def _swing_steps(history: xr.Dataset, column: int, middle: int) -> list[int]:
    """Return steps of the swing around a step, up to where an asperity slides."""
    ranges = list(_swings(history["tangential_displacement"].values))
    start, stop = next(
        (limits for limits in ranges if limits[0] <= middle <= limits[1]),
        (0, history.sizes["step"] - 1),
    )
    states = history["slip_state"].isel(step=slice(start, stop + 1), asperity=column).values
    # it slides until it turns round: where the swing begins that may still be the case
    begun = int((states != GROSS_SLIP).argmax())
    slides = np.flatnonzero(states[begun:] == GROSS_SLIP)
    stop_step = start + begun + int(slides[0]) if slides.size else stop
    return [
        int(step)
        for step in np.unique(np.linspace(start, max(stop_step, start), STATES_IN_ONE).round())
    ]


def _swings(x: Floats) -> Iterator[tuple[int, int]]:
    """Yield the ends of each swing; a change of direction counts when it exceeds a tenth of the range."""
    threshold = np.ptp(x) / 10
    start = turn = 0
    for index, value in enumerate(x):
        if (value - x[turn]) * (x[turn] - x[start]) >= 0:
            turn = index
        elif abs(value - x[turn]) > threshold:
            yield start, turn
            start, turn = turn, index
    if threshold > 0:
        yield start, turn


@PICTURES.register
@attrs.frozen(kw_only=True)
class AsperityPicture(Picture):
    """The traction memory of one asperity, within ± friction times the pressure; reversals are dotted."""

    kind, of, size, own_figure = "asperity", (Asperity,), (COLUMN, 66.0), True

    def sheet(self, data: Asperity) -> Chart:
        """Return the traction over the radius."""
        extent = 1.1 * data.contact_radius or 1.0
        radius = np.linspace(0.0, extent, 801)
        bound = data.friction * data.pressure(radius)
        traction = data.traction(radius)
        dashes = {"color": FAINT, "linewidth": 0.8, "linestyle": "--"}
        items: list[Item] = [
            Curve(radius, bound, "± friction × pressure", dashes),
            Curve(radius, -bound, "", dashes),
        ]
        names = ("traction in x", "traction in y") if traction.ndim > 1 else ("traction",)
        columns = traction.reshape(radius.size, -1).T
        for name, values, colour in zip(names, columns, STATE_COLOURS[1:], strict=False):
            items.append(Curve(radius, values, name, {"color": colour, "linewidth": 1.2}))
        dots = {"color": INK, "linewidth": 0.5, "linestyle": ":"}
        reversals = data.reversal_points.radius if data.has_moved_straight else ()
        items += [Shape("axvline", (reversal,), dots) for reversal in reversals]
        title = (
            f"{'asperity' if data.index is None else f'asperity {data.index}'}, {data.state_text}"
        )
        label = "tangential traction (Pa)"
        axes = {"xlim": (0.0, extent)}
        return Chart(items=items, x="radius (m)", y=label, title=title, axes=axes)


# radii of the rings that have arrows, over the contact radius
RINGS = (0.15, 0.38, 0.61, 0.8, 0.94)
MOST_CIRCLES, CIRCLES = 12, 6
SLIPPING, STICKING = "#c9c9c9", "#ffffff"
ANNULUS_KEYS = partial(state_keys, (STICKING, SLIPPING), ("sticks", "slips"))


@PICTURES.register
@attrs.frozen(kw_only=True)
class SlipAnnulusPicture(Picture):
    """The tractions over the contact of an asperity at several steps, as arrows; where it slips is grey.

    From the middle to the dashed circle it sticks; the annulus around that slips in the direction
    of its traction, which is the friction limit. Arrows are in scale with one another, and circles,
    too.

    Attributes
    ----------
    asperity
        Its label; by default the one that carries most.
    steps
        Up to 12 states, by number or name; by default all that have a name, or else 6 after the
        first move.
    """

    asperity: int | None = None
    steps: tuple[int | str, ...] | None = None

    kind, size, own_figure, order, only_planar = "slip-annulus", (TWO_COLUMNS, 125.0), True, 5, True
    in_one_direction = "traction"
    needs = "stick_radius"
    caption = (
        "Tractions over the contact of the asperity that carries most; where it slips is grey."
    )

    def sheet(self, data: xr.Dataset) -> Sheet:
        """Return a circle for each step."""
        check_recorded(data, "slip_state", "normal_load", "contact_radius")
        check_any(data)
        steps = self._chosen(data)
        label = self.asperity
        if label is None:
            label = int(
                data["asperity"].values[
                    data["normal_load"].isel(step=steps).values.max(axis=0).argmax()
                ]
            )
        contacts = recompute.replay_asperities(data, label, steps)
        edge = max(contact.contact_radius for contact in contacts)
        if edge == 0:
            raise InputError(
                f"asperity {label} does not touch at any of the steps; expected one at which it does"
            )
        rings = [_ring_arrows(contact) for contact in contacts]
        largest = max(float(np.hypot(*arrows[:, 2:].T).max(initial=0.0)) for arrows in rings)
        # the longest arrow is as long as the distance of two rings
        arrow = {
            "angles": "xy",
            "scale_units": "xy",
            "scale": (largest or 1.0) / (0.25 * edge),
            "color": INK,
        }
        arrow |= {"pivot": "mid", "width": 0.006, "minlength": 0.3, "zorder": 3}
        limits = (-1.08 * edge, 1.08 * edge)
        axes = {"aspect": "equal", "xlim": limits, "ylim": limits}
        options: Look = {
            "share": "map",
            "axes": axes,
            "x": "$x$ (m)",
            "y": "$y$ (m)",
            "height": 34.0,
        }
        charts = {
            letter: Chart(
                items=[*_circles(contact), Shape("quiver", tuple(arrows.T), arrow)],
                title=state_label(data, step),
                keys=ANNULUS_KEYS(),
                **options,
            )
            for letter, contact, arrows, step in zip(
                "ABCDEFGHIJKL", contacts, rings, steps, strict=False
            )
        }
        letters = "".join(charts)
        wide, narrow = (
            ";".join(
                letters[k : k + across].ljust(across, ".") for k in range(0, len(letters), across)
            )
            for across in (min(len(letters), 3 if len(letters) < 7 else 4), min(len(letters), 2))
        )
        title = ": ".join(filter(None, (str(data.attrs.get("title", "")), f"asperity {label}")))
        note = f"longest arrow: {quantity_text(largest, 'Pa', 3)}"
        return Sheet(
            charts, wide=wide, narrow=narrow, subtitle=title[0].upper() + title[1:], note=note
        )

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
            for candidate in np.unique(
                np.linspace(start, data.sizes["step"] - 1, CIRCLES + 1)[1:].round()
            )
        ]


def _ring_arrows(contact: Any) -> Floats:
    """Return places [m] and tractions [Pa] on the rings of an asperity (arrow, 4)."""
    if contact.contact_radius == 0:
        return np.empty((0, 4))
    tractions = []
    for share, traction in zip(
        RINGS, contact.traction(np.array(RINGS) * contact.contact_radius), strict=True
    ):
        count = max(1, round(16 * share))
        around = np.arange(count) / count * 2 * np.pi
        at = share * contact.contact_radius * np.stack([np.cos(around), np.sin(around)], axis=1)
        tractions.append(np.column_stack([at, np.broadcast_to(traction, at.shape)]))
    return np.concatenate(tractions)


def _circles(contact: Any) -> list[Item]:
    """Return the contact of an asperity and its stick zone."""
    angle = np.linspace(0, 2 * np.pi, 181)
    edge = {"facecolor": SLIPPING, "edgecolor": INK, "linewidth": 0.9}
    front = {"facecolor": STICKING, "edgecolor": INK, "linewidth": 0.7, "linestyle": (0, (3, 2))}
    radii = ((contact.contact_radius, edge), (contact.stick_radius, front))
    return [
        Shape("fill", (r * np.cos(angle), r * np.sin(angle)), look) for r, look in radii if r > 0
    ]
