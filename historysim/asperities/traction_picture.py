"""A small picture of the traction of an asperity, as SVG, for notebooks."""

from typing import Any

import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import quantity_text

WIDTH, HEIGHT, MARGIN = 300.0, 130.0, 18.0  # [px]
COLOURS = ("#0072b2", "#d55e00")  # of the traction, or its components in x and y
EXTENT = 1.1  # drawn diameter over that of the contact


def traction_svg(asperity: Any) -> str:
    """Draw the traction along the diameter, in x in two directions, between ± friction × pressure (dashed)."""
    edge = asperity.contact_radius
    if edge == 0.0:
        return ""
    # denser near the edge and near the middle, where tractions are steep
    share = np.sin(np.linspace(-0.5, 0.5, 161) * np.pi)
    position = np.concatenate([[-EXTENT], share, [EXTENT]])
    limit = asperity.friction * asperity.pressure(position * edge)
    traction = asperity.traction(position * edge).reshape(position.size, -1)
    peak = max(float(np.abs(limit).max()), float(np.abs(traction).max())) or 1.0
    shapes = [
        f'<line x1="0" y1="{HEIGHT / 2}" x2="{WIDTH}" y2="{HEIGHT / 2}" stroke="#999" stroke-width="0.6"/>',
        *(
            _curve(position, bound / peak, "#777", ' stroke-dasharray="4 3"')
            for bound in (limit, -limit)
        ),
        *(
            _curve(position, values / peak, colour)
            for values, colour in zip(traction.T, COLOURS, strict=False)
        ),
        *(_mark(sign * asperity.stick_radius / edge) for sign in (-1.0, 1.0)),
    ]
    names = "traction" if traction.shape[1] == 1 else "traction in x (blue) and y (orange)"
    title = f"{names}, ± friction × pressure up to {quantity_text(float(limit.max()), 'Pa', 3)} (dashed)"
    size = f'width="{WIDTH:.0f}" height="{HEIGHT:.0f}" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img"><title>{title}</title>{"".join(shapes)}</svg>'


def _curve(position: Floats, height: Floats, colour: str, more: str = "") -> str:
    """Return a polyline: positions relative to the contact radius, heights relative to the peak."""
    x = WIDTH / 2 * (1 + position / EXTENT)
    y = HEIGHT / 2 - (HEIGHT / 2 - MARGIN) * height
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.4"{more}/>'


def _mark(position: float) -> str:
    """Return a dotted vertical line at the edge of the stick zone."""
    x = WIDTH / 2 * (1 + position / EXTENT)
    style = 'stroke="#333" stroke-width="0.6" stroke-dasharray="1 3"'
    return f'<line x1="{x:.1f}" y1="0" x2="{x:.1f}" y2="{HEIGHT}" {style}/>'
