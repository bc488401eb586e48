"""The contact in a browser page, which computes any step: the compiled library, an ensemble and its load paths.

The page of a history that it cannot compute states why, and shows the recorded pictures alone.
"""

import base64
import gzip
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.basics.arguments import DIRECTION, Array, Floats, Integers
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.loads import schedule
from historysim.memory.binding import DISPLACED, are_in_plane
from historysim.memory.paths import Goals, Paths, blank_rows, straight_paths
from historysim.results.analysis.recorded import check_any, check_recorded
from historysim.results.analysis.slips import representative_step
from historysim.results.plots.style import STATES
from historysim.results.recompute import AGREEMENT
from historysim.results.source import query_source

LIBRARY = Path(__file__).with_name("browser.wasm")
SCRIPT = Path(__file__).with_name("browser.js")
# Drawn asperities (those with the greatest loads) and embedded ones; of a larger ensemble the
# recorded ones.
MOST_DRAWN, MOST_EMBEDDED = 2000, 20_000
MOST_STEPS = 20_000  # a path of 96 bytes each, replayed when friction or moduli change
UNITS = ("tangential_displacement", "total_tangential_load")


class Trajectory(NamedTuple):
    """Load paths of an ensemble that lead to the recorded steps of a history."""

    ensemble: Ensemble
    labels: Integers  #: label of each asperity of the ensemble
    paths: Paths
    saturate: bool = False
    instrument: Instrument = RIGID
    note: str = ""


def interactive_part(history: xr.Dataset) -> tuple[str, str, tuple[str, ...]]:
    """Render the script of a page, its interactive part as HTML, and notes on the latter.

    Raises InputError if the page cannot compute the history.
    """
    check_any(history)
    check_recorded(
        history, "normal_load", "slip_state", "summit_height", "summit_radius", "friction"
    )
    trajectory = find_trajectory(history)
    script = f"<script>\n{SCRIPT.read_text(encoding='utf-8')}</script>"
    settings, arrays = embedded_data(history, trajectory)
    data = {
        "library": encode(LIBRARY.read_bytes()),
        "setup": json.dumps(settings),
        "arrays": encode(arrays),
    }
    blocks = "\n".join(
        f'<script type="text/plain" id="{name}">{text}</script>' for name, text in data.items()
    )
    start = f'<script>Explorer.open(document.getElementById("{ROOT}"));</script>'
    notes = (trajectory.note,) if trajectory.note else ()
    return script, f"{controls(settings)}\n{blocks}\n{start}", notes


def encode(content: bytes) -> str:
    """Encode bytes as a page holds them: base64 of gzip, without a time."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def find_trajectory(history: xr.Dataset) -> Trajectory:
    """Find paths to the recorded steps: of the events, or straight ones between the recorded steps.

    Raises InputError if the page cannot replay them.
    """
    for name, text in (
        ("summit_area", "patches"),
        ("stick_area", "patches"),
        ("slope", "summits that meet on slopes"),
    ):
        if name in history.variables:
            raise InputError(f"pages cannot compute {text}; its pictures show what was recorded")
    if history.sizes["step"] > MOST_STEPS:
        raise InputError(
            f"pages compute {MOST_STEPS:,} steps at most, and the history has {history.sizes['step']:,}; expected a "
            f"part of it, such as history.isel(step=slice({MOST_STEPS}))"
        )
    job = query_source(history, lambda origin: origin.job)
    if job is None:
        return _from_steps(history)
    ensemble = job.ensemble
    if not isinstance(ensemble, Ensemble):
        kind = type(ensemble).__name__
        raise InputError(f"pages cannot compute {kind}; its pictures show what was recorded")
    if ensemble.attracts:
        raise InputError("pages cannot compute attraction; its pictures show what was recorded")
    if ensemble.evolves:
        raise InputError(
            "pages cannot compute asperities that evolve; its pictures show what was recorded"
        )
    if job.instrument.parallel_stiffness:
        raise InputError(
            "pages cannot compute a spring in parallel; its pictures show what was recorded"
        )
    blocks = [*schedule.paths(job.events, job.substeps)]
    if len(blocks) != 1 or blocks[0].change is not None or blocks[0].ramp is not None:
        raise InputError(
            "pages cannot compute friction or summits that events change; its pictures show what was recorded"
        )
    time = history["time"].values
    if blocks[0].row_time.shape != time.shape or not np.allclose(
        blocks[0].row_time, time, rtol=1e-12, atol=0
    ):
        return _from_steps(history)
    labels = np.arange(len(ensemble))
    note = ""
    if labels.size > MOST_EMBEDDED:
        labels = history["asperity"].values.astype(np.int64)
        note = (
            f"Of {len(ensemble):,} asperities, the page has the {labels.size:,} that were recorded."
        )
        ensemble = _subset(ensemble, labels)
    return Trajectory(ensemble, labels, blocks[0].paths, job.saturate, job.instrument, note)


def _subset(ensemble: Ensemble, labels: Integers) -> Ensemble:
    height, radius, friction = (
        np.broadcast_to(values, (len(ensemble),))[labels]
        for values in (ensemble.summit_height, ensemble.summit_radius, ensemble.friction)
    )
    options: dict[str, Any] = {
        name: values[labels]
        for name, values in (("x", ensemble.x), ("y", ensemble.y))
        if values is not None
    }
    options |= {"tolerance": ensemble.tolerance, "rings": ensemble.rings}
    return Ensemble(ensemble.pair, height, radius, friction, **options)


def _from_steps(history: xr.Dataset) -> Trajectory:
    """Return straight paths in approach and displacement between recorded steps, if they lead to the recorded loads."""
    unknown = "the history has no events to replay, and "
    if DIRECTION in history.sizes:
        raise InputError(
            f"{unknown}in two directions the path between steps is unknown; expected the result of historysim run"
        )
    pair = MaterialPair.from_moduli(
        contact_modulus=float(history.attrs["contact_modulus"]),
        shear_modulus=float(history.attrs["shear_modulus"]),
    )
    coordinates: dict[str, Any] = {
        name: history[name].values for name in ("x", "y") if name in history.coords
    }
    height, radius, friction = (
        history[name].values for name in ("summit_height", "summit_radius", "friction")
    )
    ensemble = Ensemble(pair, height, radius, friction, **coordinates)
    approach = ensemble.highest_summit - history["separation"].values
    paths = straight_paths(
        Goals(DISPLACED, approach), Goals(DISPLACED, history["tangential_displacement"].values)
    )
    rows = blank_rows(paths.size, None)
    ensemble.advance_along(ensemble.initial_state(), paths, rows=rows)
    for name in ("normal_load", "tangential_load"):
        recorded = history[f"total_{name}"].values
        if np.abs(rows.totals[name] - recorded).max() > AGREEMENT * np.abs(recorded).max():
            raise InputError(
                f"{unknown}its recorded steps leave out part of the load path or of the asperities; expected the "
                "result of historysim run, or more substeps"
            )
    note = (
        "The history has no events: the page moves the contact straight between its recorded steps."
    )
    return Trajectory(ensemble, history["asperity"].values.astype(np.int64), paths, note=note)


def embedded_data(history: xr.Dataset, trajectory: Trajectory) -> tuple[dict[str, Any], bytes]:
    """Return the settings and arrays that the script reads; the settings hold type, start and length of each array."""
    ensemble = trajectory.ensemble
    labels = trajectory.labels
    directions = 2 if DIRECTION in history.sizes or are_in_plane(trajectory.paths) else 1
    peak = (
        history["normal_load"].isel(step=int(history["total_normal_load"].values.argmax())).values
    )
    heaviest = np.argsort(-peak, kind="stable")[:MOST_DRAWN]
    drawn_positions = np.searchsorted(labels, np.sort(history["asperity"].values[heaviest]))
    rings = ensemble.rings
    settings = {
        "modulus": ensemble.pair.contact_modulus,
        "ratio": ensemble.pair.displacement_ratio,
        "directions": directions,
        "rings": [rings.height_classes, rings.rings, rings.tolerance],
        "drive": [
            ensemble.tolerance,
            *trajectory.instrument.directional_compliances(directions),
            float(trajectory.saturate),
        ],
        "rows": history.sizes["step"],
        "first_shown": representative_step(history),
        "labels": labels.tolist(),
        "drawn": drawn_positions.tolist(),
    }
    columns = np.broadcast_arrays(ensemble.summit_height, ensemble.summit_radius, ensemble.friction)
    arrays: dict[str, Array] = dict(zip(("height", "radius", "friction"), columns, strict=True))
    if ensemble.x is not None and ensemble.y is not None:
        arrays |= {"x": ensemble.x, "y": ensemble.y}
    arrays["time"] = history["time"].values
    for name, variable in zip(("displacement", "load"), UNITS, strict=True):
        arrays[f"recorded_{name}"] = _components(history[variable].values, directions).astype(
            np.float32
        )
    blocks, layout, start = [], {}, 0
    for name, values in arrays.items():
        kind = "f4" if values.dtype == np.float32 else "f8"
        content = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
        layout[name] = [kind, start, values.size]
        blocks.append(content + bytes(-len(content) % 8))
        start += len(blocks[-1])
    layout["paths"] = ["u1", start, trajectory.paths.nbytes]
    return settings | {"arrays": layout}, b"".join(blocks) + trajectory.paths.tobytes()


def _components(values: Floats, directions: int) -> Floats:
    """Return values (step, direction); a single direction is x."""
    if values.ndim == 1 and directions == 2:
        values = np.stack([values, np.zeros_like(values)], axis=1)
    return values


ROOT = "explorer"
PANELS = {
    "loop": "Friction loop",
    "map": "Contact map: click an asperity",
    "history": "The asperity over time",
    "traction": "Traction over its radius",
}


def controls(settings: dict[str, Any]) -> str:
    """Render labelled controls, lines of text and the empty panels of the interactive part."""
    labels = settings["labels"]
    slider = (
        '<span class="control"><label for="{0}">{1}</label>'
        '<input type="range" id="{0}" data-part="{0}" {2}></span>'
    )
    number = f'<input type="number" id="asperity" data-part="asperity" min="{labels[0]}" max="{labels[-1]}" step="1">'
    factor = 'min="-1" max="1" step="any" value="0"'
    fields = [
        slider.format(
            "time",
            "time",
            f'min="0" max="{settings["rows"] - 1}" value="{settings["first_shown"]}"',
        ),
        f'<span class="control"><label for="asperity">asperity</label>{number}</span>',
    ]
    for name, label in (("friction", "friction"), ("modulus", "moduli")):
        field = slider.format(name, label, factor).removesuffix("</span>")
        fields.append(f'{field}<output for="{name}" data-part="{name}_value"></output></span>')
    fields.append('<button type="button" data-part="reset">as recorded</button>')
    if settings["directions"] == 2:
        options = '<option value="0">x</option><option value="1">y</option>'
        fields.append(
            '<span class="control"><label for="direction">direction</label>'
            f'<select id="direction" data-part="direction">{options}</select></span>'
        )
    key = "".join(
        f'<li><span class="dot state{number}"></span>{name}</li>'
        for number, name in enumerate(STATES)
    )
    panels = "".join(
        f"<figure><figcaption>{title}</figcaption>"
        f'<svg data-part="{name}" role="img" aria-label="{title}"></svg></figure>'
        for name, title in PANELS.items()
    )
    lines = "".join(
        f'<p data-part="{name}" aria-live="polite"></p>' for name in ("shown", "clicked", "refused")
    )
    return (
        f'<div class="explorer" id="{ROOT}"><p class="controls">{"".join(fields)}</p>{lines}'
        f'<ul class="key">{key}<li><span class="stroke recorded"></span>recorded</li>'
        '<li><span class="stroke computed"></span>computed with the chosen friction and moduli</li></ul>'
        f'<div class="panels">{panels}</div><p class="note" data-part="check"></p></div>'
    )
