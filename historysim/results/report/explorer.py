"""The interactive part of a report: an interactive time slider for loop and contact map, and asperities to click on.

A page is to open at once: of a large result a part is embedded, and the page says which.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from historysim.basics.arguments import Floats, Integers
from historysim.errors import InputError
from historysim.results import rebuilt
from historysim.results.analysis.recorded import CHANGING_HEIGHT, check_any, present_friction
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.style import FAINT, INK, MARK, STATE_COLOURS, STATES, scale_of

# Steps of the slider, asperities on the map, points of the loop, and friction coefficients with tractions.
MOST_STEPS, MOST_ASPERITIES, MOST_POINTS, MOST_GROUPS = 300, 200, 4000, 12
PROFILE_POINTS = 241
SCRIPT = Path(__file__).with_name("explorer.js")
TARGET = "explorer"
OWN_LOADS = ("normal", "tangential", "limit")  # of an asperity [N]
LOADS = ("time", "tangential_displacement", "total_tangential_load", "total_normal_load")


class Excerpt(NamedTuple):
    """The part of a history that is embedded: arrays along its steps and asperities."""

    steps: Integers  #: positions in the history (step)
    first_shown: int  #: the one that is shown when the page opens
    columns: Integers  #: positions of those asperities that carry most at the peak normal load (asperity)
    #: State, loads and limit [N], contact radius [m] (of a patch that of its area) and stick ratio (step, asperity).
    cells: dict[str, Floats]
    group: Integers  #: friction group (asperity)
    #: Of each step of each friction group after the other, arrays (vertex, 2): the separation at which the springs of a
    #: vertex first touched [m], and its weight in the superposition of Hertz pressures. Empty without known memories.
    vertices: list[Floats]
    notes: tuple[str, ...]  #: which part of the history this is, and what is missing, in sentences


def excerpt(history: xr.Dataset) -> Excerpt:
    """Return the part of a history with asperities that a page shows: all of a small one."""
    check_any(history)
    total, recorded = history.sizes["step"], history.sizes["asperity"]
    telling = representative_step(history)
    steps = np.union1d(_spaced(total, MOST_STEPS), telling)
    peak = history["normal_load"].isel(step=int(history["total_normal_load"].values.argmax())).values
    columns = np.sort(np.argsort(-peak, kind="stable")[:MOST_ASPERITIES])
    group, vertices, notes = _memories(history, steps, columns)
    kept = [f"{steps.size:,} of {total:,} steps"] if steps.size < total else []
    if columns.size < recorded:
        carried = 100 * peak[columns].sum() / max(peak.sum(), 1e-300)
        kept.append(
            f"{columns.size:,} of {recorded:,} recorded asperities, which carry {carried:.3g} % of the peak normal load"
        )
    if kept:
        notes = [f"To keep the page small, it holds {'; '.join(kept)}.", *notes]
    cells = _cells(history, steps, columns)
    return Excerpt(steps, int(np.searchsorted(steps, telling)), columns, cells, group, vertices, tuple(notes))


def _spaced(count: int, most: int) -> Integers:
    """Return no more than so many positions among others, evenly."""
    return np.linspace(0, count - 1, min(count, most)).round().astype(np.int64)


def _cells(history: xr.Dataset, steps: Integers, columns: Integers) -> dict[str, Floats]:
    patches = "contact_area" in history
    sizes = ("contact_area", "stick_area") if patches else ("contact_radius", "stick_radius")
    names = ("slip_state", "normal_load", "tangential_load", *sizes)
    # step by step: all of them at once may not fit into memory
    rows = [[history[name].isel(step=int(step)).values[columns] for name in names] for step in steps]
    state, normal, tangential, contact, stick = (np.array(values) for values in zip(*rows, strict=True))
    if patches:
        contact, stick = np.sqrt(contact / np.pi), np.sqrt(stick / np.pi)
    friction = present_friction(history)
    shape = steps.size, history.sizes["asperity"]
    coefficients = np.broadcast_to(friction.of(steps if friction.changes else 0), shape)[:, columns]
    return {
        "state": state.astype(np.uint8),
        "normal": normal,
        "tangential": tangential,
        "limit": coefficients * normal,
        "contact_radius": contact,
        "stick_ratio": np.divide(stick, contact, out=np.zeros_like(stick), where=contact > 0),
    }


def _memories(history: xr.Dataset, steps: Integers, columns: Integers) -> tuple[Integers, list[Floats], list[str]]:
    """Return the friction group of each asperity, the vertices of each group at each step, and why there are none."""
    height, friction = (history[name].values[columns] for name in ("summit_height", "friction"))
    coefficients, group = np.unique(friction, return_inverse=True)
    if "stick_area" in history:
        return group, [], ["Patches have no traction profiles; the contact map below has their tractions."]
    why = ""
    if present_friction(history).changes or CHANGING_HEIGHT in history:
        # what asperities of one coefficient share at the start they need not share later
        why = "friction or heights change in the history"
    elif coefficients.size > MOST_GROUPS:
        why = f"there are {coefficients.size:,} friction coefficients, and at most {MOST_GROUPS} are embedded"
    vertices: list[Floats] = []
    try:
        for number in range(0 if why else coefficients.size):
            # the highest asperity of a group sees all that the group remembers
            highest = columns[group == number][height[group == number].argmax()]
            label = int(history["asperity"].values[highest])
            for asperity in rebuilt.asperities_at(history, label, steps.tolist()):
                radius, weight = asperity.superposition
                touched = asperity.summit_height - radius**2 / asperity.summit_radius
                vertices.append(np.stack([touched, weight], axis=1))
    except InputError as error:
        vertices, why = [], str(error)
    return group, vertices, [f"There are no traction profiles: {why}."] if why else []


def explorer(history: xr.Dataset) -> tuple[str, str, tuple[str, ...]]:
    """Return the library of a page, its interactive part as HTML, and notes on what that leaves out of the history.

    Raises ImportError without Bokeh, InputError where no asperity ever touches, or for patches without areas.
    """
    from bokeh.embed import json_item
    from bokeh.resources import Resources

    part = excerpt(history)
    layout, clock, marks = _layout(history, part)
    item = json.dumps(json_item(layout)).replace("</", "<\\/")
    carries_most = int(part.cells["normal"][part.first_shown].argmax())
    # the first state is shown by the same callbacks as later ones, and typing by those of clicks
    begin = f"""
const byId = (id) => view.model.document.get_model_by_id(id);
const chosen = byId("{marks.id}").selected, clock = byId("{clock.id}");
const control = (name) => document.getElementById("{TARGET}-" + name);
control("time").addEventListener("input", (event) => {{ clock.data = {{ now: [Number(event.target.value)] }}; }});
control("asperity").addEventListener("input", (event) => {{ chosen.indices = [Number(event.target.value)]; }});
chosen.indices = [{carries_most}];
clock.data = {{ now: [{part.first_shown}] }};"""
    body = (
        f"{_controls(history, part)}\n<script>\nBokeh.embed.embed_item({item}, '{TARGET}-panels').then((views) => {{"
        f"for (const view of views) {{ {begin} }} }});\n</script>"
    )
    # nothing is fetched: the library stands in the page
    library = Resources(mode="inline", minified=True, components=["bokeh"]).render()
    return library, body, part.notes


def _controls(history: xr.Dataset, part: Excerpt) -> str:
    """Return the room of the interactive part, with what it is moved by: each with a label, and usable by keyboard."""
    labels = history["asperity"].values[part.columns]
    options = "".join(f'<option value="{number}">{label}</option>' for number, label in enumerate(labels))
    key = "".join(
        f'<li><span class="dot" style="background: {colour}"></span>{name}</li>'
        for colour, name in zip(STATE_COLOURS, STATES, strict=True)
    )
    return (
        f'<div class="explorer" id="{TARGET}">'
        f'<p class="controls"><span class="control"><label for="{TARGET}-time">time</label>'
        f'<input type="range" id="{TARGET}-time" min="0" max="{part.steps.size - 1}" value="{part.first_shown}"></span>'
        f'<span class="control"><label for="{TARGET}-asperity">asperity</label>'
        f'<select id="{TARGET}-asperity">{options}</select></span></p>'
        f'<p id="{TARGET}-shown" aria-live="polite"></p><p id="{TARGET}-clicked" aria-live="polite"></p>'
        f'<ul class="key">{key}</ul><div id="{TARGET}-panels"></div></div>'
    )


def _layout(history: xr.Dataset, part: Excerpt) -> tuple[Any, Any, Any]:
    """Return the layout, the source that holds the step that is shown, and that of the map."""
    from bokeh.layouts import column
    from bokeh.models import ColumnDataSource, CustomJS, InlineStyleSheet

    time, displacement, load, normal = (history[name].values for name in LOADS)
    readable = {
        "length": scale_of("m", displacement),
        "force": scale_of("N", load),
        "normal": scale_of("N", normal),
        "own": scale_of("N", part.cells["normal"]),
        "radius": scale_of("m", part.cells["contact_radius"]),
        "stress": scale_of("Pa", _peak_traction(part)),
    }
    scales = {name: factor for name, (factor, _) in readable.items()}
    units = {name: unit for name, (_, unit) in readable.items()}
    thin = np.union1d(_spaced(time.size, MOST_POINTS), part.steps)
    sources = {name: ColumnDataSource(each, name=name) for name, each in _columns(history, part, scales).items()}
    line = ColumnDataSource({"x": displacement[thin] * scales["length"], "y": load[thin] * scales["force"]})
    constants = {
        "modulus": float(history.attrs["contact_modulus"]),
        "colours": list(STATE_COLOURS),
        "names": list(STATES),
        "count": int(part.columns.size),
        "points": PROFILE_POINTS,
        "scales": scales,
        "units": units,
        "target": TARGET,
    }
    moved = CustomJS(args={**sources, **constants}, code=SCRIPT.read_text(encoding="utf-8"))
    sources["clock"].js_on_change("data", moved)
    sources["map"].selected.js_on_change("indices", moved)
    panels = _figures(history, {**sources, "line": line}, units)
    # without memories there is no traction to show
    shown = panels if part.vertices else panels[:-1]
    styles = [InlineStyleSheet(css=BESIDE)]
    return column(*shown, stylesheets=styles, width_policy="max"), sources["clock"], sources["map"]


def _columns(history: xr.Dataset, part: Excerpt, scales: dict[str, float]) -> dict[str, dict[str, Any]]:
    """Return what the script reads and changes, by the name of its source."""
    steps = part.steps
    time, displacement, load, normal = (history[name].values for name in LOADS)
    lists = np.concatenate([np.zeros((0, 2)), *part.vertices])
    return {
        "steps": {
            "step": steps.astype(np.int32),
            "time": time[steps],
            "displacement": displacement[steps] * scales["length"],
            "load": load[steps] * scales["force"],
            "normal": normal[steps] * scales["normal"],
            "separation": history["separation"].values[steps],
        },
        "cells": {
            "state": part.cells["state"].ravel(),
            **{name: (part.cells[name].ravel() * scales["own"]).astype(np.float32) for name in OWN_LOADS},
            "stick_ratio": part.cells["stick_ratio"].ravel().astype(np.float32),
        },
        "vertices": {"separation": lists[:, 0], "weight": lists[:, 1]},
        "ends": {"end": np.cumsum([len(each) for each in part.vertices], dtype=np.int32)},
        "map": _marks(history, part),
        # filled as soon as the page is there; without a point no axis would know where it begins
        "marker": {"x": [0.0], "y": [0.0]},
        "moment": {"x": [0.0], "y": [0.0]},
        "curve": {"time": [0.0], "load": [0.0], "limit": [0.0], "below": [0.0]},
        "profile": {"radius": [0.0], "traction": [0.0], "limit": [0.0], "below": [0.0]},
        "clock": {"now": [0]},
    }


# Panels stand beside one another where there is room for two.
BESIDE = """:host {
  display: grid !important; grid-template-columns: repeat(auto-fit, minmax(min(100%, 22rem), 1fr)); gap: 8px;
  width: 100% !important;
}"""


def _peak_traction(part: Excerpt) -> Floats:
    """Return the friction limit of the traction in the middle of each asperity [Pa], for the unit of its picture."""
    area = np.pi * part.cells["contact_radius"] ** 2
    return 1.5 * np.divide(part.cells["limit"], area, out=np.zeros_like(area), where=area > 0)


def _marks(history: xr.Dataset, part: Excerpt) -> dict[str, Any]:
    """Return what the map is drawn from: positions where there are some, else summit heights and radii."""
    own = history.isel(asperity=part.columns)
    height = own["summit_height"].values
    radius = own["summit_radius"].values if "summit_radius" in own.coords else np.ones_like(height)
    across, up = ("x", "y") if _placed(history) else ("summit_height", "summit_radius")
    x, y = (own[name].values if name in own.coords else np.zeros_like(height) for name in (across, up))
    return {
        "asperity": own["asperity"].values.astype(np.int32),
        "x": x * scale_of("m", x)[0],
        "y": y * scale_of("m", y)[0],
        "fill": [STATE_COLOURS[0]] * height.size,
        "height": height,
        "radius": radius,
        "friction": own["friction"].values,
        "group": part.group.astype(np.int32),
        "reach": part.cells["contact_radius"].max(axis=0),
    }


def _placed(history: xr.Dataset) -> bool:
    return {"x", "y"} <= set(history.coords)


def _figures(history: xr.Dataset, sources: dict[str, Any], units: dict[str, str]) -> list[Any]:
    from bokeh.models import HoverTool, TapTool
    from bokeh.plotting import figure

    def panel(name: str, title: str, across: str, up: str, **options: Any) -> Any:
        made = figure(
            name=f"{name}_figure",
            title=title,
            x_axis_label=across,
            y_axis_label=up,
            tools="pan,box_zoom,wheel_zoom,reset,save",
            toolbar_location="above",
            sizing_mode="stretch_width",
            min_width=260,
            height=320,
            **options,
        )
        made.toolbar.logo = None
        made.grid.grid_line_alpha = 0.4
        return made

    loop = panel("loop", "Friction loop", f"U ({units['length']})", f"T ({units['force']})")
    loop.line("x", "y", source=sources["line"], line_color=FAINT)
    loop.scatter("x", "y", source=sources["marker"], size=11, fill_color=STATE_COLOURS[2], line_color=INK)

    names = ("x", "y") if _placed(history) else ("summit_height", "summit_radius")
    labels = []
    for name in names:
        unit = scale_of("m", history[name].values if name in history.coords else [])[1]
        when = " at the start" if CHANGING_HEIGHT in history and name.startswith("summit") else ""
        labels.append(f"{name.replace('_', ' ')}{when} ({unit})")
    title = "Contact map: click an asperity" if _placed(history) else "Asperities by height: click one"
    contacts = panel("contacts", title, *labels, match_aspect=_placed(history))
    marks = contacts.scatter("x", "y", source=sources["map"], size=9, fill_color="fill", line_color=INK)
    # what is not clicked keeps its colour
    marks.nonselection_glyph = None
    marks.selection_glyph = marks.glyph.clone(size=14, line_width=3)
    contacts.add_tools(TapTool(renderers=[marks]), HoverTool(renderers=[marks], tooltips=[("asperity", "@asperity")]))

    own = panel("history", "The asperity over time", "time (s)", f"T ({units['own']})")
    profile = panel("profile", "Traction over its radius", f"r ({units['radius']})", f"τ ({units['stress']})")
    for made, source, across, up in ((own, "curve", "time", "load"), (profile, "profile", "radius", "traction")):
        made.line(across, up, source=sources[source], line_color=MARK, line_width=1.5)
        for side in ("limit", "below"):
            made.line(across, side, source=sources[source], line_color=FAINT, line_dash="dashed")
    own.scatter("x", "y", source=sources["moment"], size=9, fill_color=STATE_COLOURS[2], line_color=INK)
    return [loop, contacts, own, profile]
