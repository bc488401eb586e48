"""A moving picture: loop and contact map together over a cycle."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from historysim.basics.files import replacing
from historysim.errors import InputError
from historysim.results.analysis.along_time import friction_loops
from historysim.results.analysis.recorded import check_recorded, position_of
from historysim.results.plots.canvas import TWO_COLUMNS, Canvas, Size, in_style, new_figure
from historysim.results.plots.contact_maps import draw_zones, zone_handles, zone_shares, zones_at
from historysim.results.plots.printed import MADE_BY
from historysim.results.plots.style import FAINT, INK, STATE_COLOURS, label_loop, thinned
from historysim.results.plots.surfaces import (
    caption_at,
    contact_at,
    draw_distribution,
    draw_map,
    legend_handles,
    surface_of,
)
from historysim.results.rebuilt import SOLVED

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

LOOP = ("tangential_displacement", "total_tangential_load")
MOST_FRAMES = 60
FRAMES_PER_SECOND = 12
DOTS_PER_INCH = 110
WRITERS = {".gif": "pillow", ".mp4": "ffmpeg", ".webm": "ffmpeg"}  # endings of moving pictures, and what writes them


def animate_contact_map(
    history: xr.Dataset, steps: Sequence[int] | None = None, *, size: Size | None = None
) -> "FuncAnimation":
    """Return a moving picture of the contact map, beside the friction loop with a dot where it stands.

    Parameters
    ----------
    history : xarray.Dataset
        A history with asperities. Without their positions the asperity distribution takes the place of the map. Of
        asperities that press on one another, from the file of a result, the map has the zones that stick and slip.
    steps : sequence of int, optional
        Positions of the steps that are shown; by default up to 60 of the last friction loop, or of all where there is
        no whole loop.
    size : (float, float), optional
        Width and height [mm].

    Returns
    -------
    matplotlib.animation.FuncAnimation
        180 mm wide, or of that size; see `save_animation`.

    Raises
    ------
    InputError
        A history without asperities, or a step that it does not have.
    """
    from matplotlib.animation import FuncAnimation

    check_recorded(history, "slip_state")
    frames = _last_cycle(history) if steps is None else [position_of(step, history) for step in steps]
    if not frames:
        raise InputError("steps is empty; expected one step or more")
    with new_figure(size, (TWO_COLUMNS, 95.0)) as figure:
        canvas = Canvas.of(figure)
        loop, contacts = figure.subplots(1, 2) if canvas.width >= 120.0 else figure.subplots(2, 1)
        move_dot = _dot_on_loop(loop, history, frames)
        captions, draw_frame = _frames(canvas, contacts, history, frames)

    def show(frame: int) -> None:
        with in_style():
            contacts.clear()
            draw_frame(frame)
            move_dot(frame)
            canvas.heading("", captions[frame])
            # ticks are made when they are first drawn, and that is to be in this style
            figure.draw_without_rendering()

    # one layout is that of all frames, with room for the longest heading: otherwise the axes would tremble
    show(max(range(len(frames)), key=lambda frame: len(captions[frame])))
    figure.set_layout_engine("none")
    show(0)
    return FuncAnimation(figure, show, frames=len(frames), interval=1000 / FRAMES_PER_SECOND, init_func=lambda: None)


def _dot_on_loop(axes: "Axes", history: xr.Dataset, frames: Sequence[int]) -> Callable[[int], None]:
    """Draw the friction loop, and return what moves a dot on it to a frame."""
    thin = thinned(history)
    u, t = (thin[name].values for name in LOOP)
    length, force = label_loop(axes, [u], [t])
    axes.plot(u * length, t * force, color=FAINT, linewidth=0.8)
    (dot,) = axes.plot([], [], "o", color=STATE_COLOURS[2], mec=INK, ms=6)
    axes.margins(0.06)
    axes.set_title("Friction loop")
    now = history[[*LOOP]].isel(step=[*frames]).load()
    x, y = now[LOOP[0]].values * length, now[LOOP[1]].values * force
    return lambda frame: dot.set_data([x[frame]], [y[frame]])


def _frames(
    canvas: Canvas, axes: "Axes", history: xr.Dataset, frames: Sequence[int]
) -> tuple[list[str], Callable[[int], None]]:
    """Name what the map shows, and return the captions of the frames and what draws one of them into its axes."""
    surface, captions = surface_of(history), [caption_at(history, step) for step in frames]
    # asperities that press on one another have no summits, but zones
    if SOLVED in surface:
        zones = zones_at(history, frames)
        canvas.legend(handles=zone_handles())

        def draw_zone(frame: int) -> None:
            draw_zones(axes, zones.maps[frame], zones.extent)
            axes.set(title="Contact map", xlabel=f"$x$ ({zones.unit})", ylabel=f"$y$ ({zones.unit})")

        return [f"{each}, {zone_shares(zone)}" for each, zone in zip(captions, zones.maps, strict=True)], draw_zone
    placed = {"summit_x", "summit_y"} <= set(surface.variables)
    canvas.legend(handles=legend_handles(surface, contact_at(surface, history, frames[0]), flat=not placed))

    def draw_summits(frame: int) -> None:
        contact = contact_at(surface, history, frames[frame])
        if placed:
            draw_map(axes, surface, contact)
        else:
            draw_distribution(axes, contact)

    return captions, draw_summits


def save_animation(animation: "FuncAnimation", path: str | Path) -> None:
    """Write a moving picture to a file, which appears when it is complete.

    Parameters
    ----------
    animation : matplotlib.animation.FuncAnimation
    path : path
        Ending with .gif, or with .mp4 or .webm where the program ffmpeg is installed.

    Raises
    ------
    InputError
        Another ending, or there is no ffmpeg.
    OSError
        The file cannot be written.
    """
    from matplotlib.animation import writers

    path = Path(path)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError(f"{path}: {path.suffix or 'no'} ending; expected {', '.join(WRITERS)}")
    if not writers.is_available(writer):
        raise InputError(f"{path}: is written by the program {writer}, which is not installed; expected .gif")
    options: dict[str, Any] = {"fps": FRAMES_PER_SECOND, "dpi": DOTS_PER_INCH}
    with replacing(path, path.suffix) as unfinished:
        animation.save(unfinished, writer=writer, metadata={"comment": MADE_BY}, **options)
        if writer == "pillow":
            _sign(unfinished)


def _sign(path: Path) -> None:
    """Put what has made a GIF into it, as a comment before its end: matplotlib does not pass it on to pillow."""
    with path.open("r+b") as stream:
        stream.seek(-1, 2)
        text = MADE_BY.encode()
        stream.write(b"\x21\xfe" + bytes([len(text)]) + text + b"\x00\x3b")


def _last_cycle(history: xr.Dataset) -> list[int]:
    """Return the steps of the last friction loop, or all, thinned."""
    try:
        first, _, last = friction_loops(history).ends[-1]
    except InputError:
        first, last = 0, history.sizes["step"] - 1
    return [int(step) for step in np.unique(np.linspace(first, last, MOST_FRAMES).round())]
