"""Colours, dashes and markers of lines in one picture: told apart in grey print, too."""

from typing import Any

from historysim.results.plots.style import INK, STATE_COLOURS

LINES = (
    (STATE_COLOURS[1], "-", "o"),
    (STATE_COLOURS[2], "--", "s"),
    ("#4aa8e0", "-.", "^"),
    ("#7a7a7a", ":", "D"),
    ("#b08a1e", (0, (5, 1, 1, 1, 1, 1)), "v"),
    (INK, (0, (1, 2)), "P"),
    ("#6a3d9a", (0, (6, 2)), "X"),
    ("#33864f", (0, (3, 1, 1, 1)), "*"),
)
"""Colour, dashes and marker of each line."""
MOST_LINES = 12


def line_style(number: int, count: int) -> dict[str, Any]:
    """Return colour, dashes and width of one of some lines without markers.

    Up to eight have colours and dashes of their own; of more, such as the steps of a load, the colours go from light
    to dark.
    """
    if count <= len(LINES):
        colour, dashes, _ = LINES[number]
        return {"color": colour, "linestyle": dashes, "linewidth": 1.1}
    from historysim.results.plots.along_path import line_colours

    return {"color": line_colours()(number / max(count - 1, 1)), "linestyle": "-", "linewidth": 1.1}
