"""Data that a figure does not show: lines outside of their axes and data squeezed into a corner."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.patches import Rectangle

LEAST_COVERAGE = 0.1  # fraction of the width, and of the height, of axes that data have to span
# fraction of the markers of a cloud that have to lie inside: outliers may be cut off
LEAST_INSIDE = 0.9
TOLERANCE = 0.01  # fraction of the axes by which a line may reach beyond them: half of its width


def hidden_data(figure):
    """Describe each panel of a figure whose lines leave it or cover less than a tenth of it."""
    panels = [axes for axes in figure.findobj(Axes) if axes.axison and axes.get_visible()]
    panels = [axes for axes in panels if axes.get_label() != "<colorbar>"]
    for axes in panels:
        # limits follow the data and the aspect only when somebody asks
        axes.apply_aspect()
        axes.get_xlim(), axes.get_ylim()
    known = {axes: positions_of(axes) for axes in panels}
    return [
        fault
        for axes in panels
        if not axes.images
        for fault in (*cut_off(axes), *squeezed(axes, known))
    ]


def name_of(axes):
    """The title or the label of a panel."""
    return (
        axes.get_title(loc="left")
        or axes.get_title()
        or axes.get_ylabel()
        or axes.get_xlabel()
        or "a panel"
    )


def cut_off(axes):
    """Describe lines that leave a panel, and clouds of markers that are mostly outside."""
    for line in axes.lines:
        if not all(line.get_transform().contains_branch_seperately(axes.transData)):
            # a line across the panel, such as that of zero, need not be seen
            continue
        points = fractions(axes, line, line.get_xydata())
        beyond = np.abs(np.nan_to_num(points, nan=0.5) - 0.5).max(axis=1, initial=0.0) - 0.5
        cloud = line.get_linestyle() == "None"
        if beyond.size and np.mean(beyond > TOLERANCE) > (1 - LEAST_INSIDE if cloud else 0.0):
            yield f"{name_of(axes)}: {line.get_label()} leaves the axes by {beyond.max():.3g} of them"


def squeezed(axes, known):
    """Describe a direction in which the data of a panel, and of those that share its limits, cover nearly nothing."""
    for direction, shared in enumerate((axes.get_shared_x_axes(), axes.get_shared_y_axes())):
        together = [
            known[each][:, direction] for each in shared.get_siblings(axes) if each in known
        ]
        values = np.concatenate(together)
        values = values[np.isfinite(values)]
        limits, scale = (
            (axes.get_xlim(), axes.get_xscale()),
            (axes.get_ylim(), axes.get_yscale()),
        )[direction]
        if scale == "linear" and min(limits) <= 0 <= max(limits):
            # what is drawn from zero covers the way from there
            values = np.append(values, -limits[0] / (limits[1] - limits[0]))
        # a constant has no extent
        if (
            values.size
            and np.ptp(values) > 1e-12
            and np.ptp(np.clip(values, 0.0, 1.0)) < LEAST_COVERAGE
        ):
            yield f"{name_of(axes)}: data cover {np.ptp(np.clip(values, 0, 1)):.3g} of the axes in {'xy'[direction]}"


def positions_of(axes):
    """Positions of all data of a panel in fractions of it (point, 2), NaN where a direction is not one of data."""
    found = [fractions(axes, artist, points) for artist, points in data_of(axes)]
    return np.concatenate([np.empty((0, 2)), *found])


def fractions(axes, artist, points):
    """Points of an artist in fractions of the axes, NaN in a direction that is not one of data."""
    cloud = isinstance(artist, PathCollection)
    transform = artist.get_offset_transform() if cloud else artist.get_transform()
    in_data = transform.contains_branch_seperately(axes.transData)
    points = np.ma.filled(np.ma.asarray(points, dtype=float), np.nan)
    if not points.size or not any(in_data):
        return np.empty((0, 2))
    found = axes.transAxes.inverted().transform(transform.transform(points))
    return np.where(in_data, found, np.nan)


def data_of(axes):
    """Yield lines, markers, areas and bars of a panel, with their points."""
    yield from ((line, line.get_xydata()) for line in axes.lines)
    for artist in axes.collections:
        if isinstance(artist, PathCollection):
            yield artist, artist.get_offsets()
        else:
            yield from ((artist, path.vertices) for path in artist.get_paths())
    for artist in axes.patches:
        yield (
            artist,
            [[0, 0], [1, 1]] if isinstance(artist, Rectangle) else artist.get_path().vertices,
        )
