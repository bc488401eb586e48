"""Texts of a figure that lie on one another, or leave the paper."""

import itertools

import matplotlib as mpl


def texts(figure):
    """Return all texts that are seen, each with its box."""
    found = []
    for text in figure.findobj(mpl.text.Text):
        if text.get_visible() and text.get_text().strip() and text.get_alpha() != 0:
            box = text.get_window_extent()
            if box.width > 0 and box.height > 0:
                found.append((text, box))
    return found


def on_top_of_each_other(figure):
    """Return pairs of texts that overlap by more than a pixel, and texts that leave the paper."""
    figure.draw_without_rendering()
    hidden = undrawn(figure)
    shown = [(text, box) for text, box in texts(figure) if text not in hidden]
    wrong = [
        (one.get_text(), other.get_text())
        for (one, first), (other, second) in itertools.combinations(shown, 2)
        if first.padded(-1.0).overlaps(second.padded(-1.0)) and free(one) and free(other)
    ]
    paper = figure.bbox.padded(2.0)
    inside = [(text, paper.contains(*box.min) and paper.contains(*box.max)) for text, box in shown]
    return wrong + [text.get_text() for text, fits in inside if not fits]


def free(text):
    """Tell whether a text is no letter of a state on a loop: two of these may be one state."""
    return text.get_fontstyle() != "italic"


def undrawn(figure):
    """Return the labels of ticks that are not drawn: those beyond the ends of their axis."""
    found = set()
    for axes in figure.findobj(mpl.axes.Axes):
        for axis in (axes.xaxis, axes.yaxis):
            every = {
                label
                for tick in (*axis.majorTicks, *axis.minorTicks)
                for label in (tick.label1, tick.label2)
            }
            found |= every - {
                label for tick in axis._update_ticks() for label in (tick.label1, tick.label2)
            }
    return found
