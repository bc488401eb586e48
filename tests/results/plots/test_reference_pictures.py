"""Every picture at the sizes of a journal: nothing overlaps, and it looks like the reference that was examined.

The references are in `reference_pictures/`. After an intended change, write them again with
`HISTORYSIM_NEW_PICTURES=1 pytest -m "slow or not slow"
tests/results/plots/test_reference_pictures.py`, and look at each that git says has changed.
"""

import io
import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
from overlapping import on_top_of_each_other
from pictured import PICTURES
from PIL import Image
from pytest import approx, mark, param, skip

pytestmark = mark.ci

SIZES = (90, 70), (90, 120), (180, 120)
KEPT = Path(__file__).parents[2] / "reference_pictures"
MADE_WITH = "3.11"  # other versions of matplotlib set letters and ticks otherwise
DOTS_PER_INCH, COLOURS = 80, 64
DIFFERENCE = 6.0  # root of the mean square difference of two pictures, of 255


# variants of pictures that the others show already
VARIANTS = {"history-totals", "history-wear", "panels", "full-interaction", "traction-friction"}
VARIANTS |= {"summits-apart", "figure"}


def pixels(figure):
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DOTS_PER_INCH)
    return Image.open(stream).convert("RGB")


@mark.parametrize(
    "name, size",
    [
        param(
            name,
            size,
            id=f"{name}-{size[0]}x{size[1]}",
            marks=mark.slow if size != SIZES[0] or name in VARIANTS else (),
        )
        for name in PICTURES
        for size in SIZES
    ],
)
def test_a_picture_fits_its_size_and_equals_its_reference(name, size):
    figure = PICTURES[name](size=size)
    assert figure.get_size_inches() * 25.4 == approx(size)
    assert on_top_of_each_other(figure) == []
    # what there is no room for, and advice, is next to the figure
    assert not any("room" in text.get_text() for text in figure.findobj(mpl.text.Text))
    assert not any(
        "-" in text.get_text()
        for text in figure.findobj(mpl.text.Text)
        if text.get_text()[1:].isdecimal()
    )
    # nor does what names things lie on a panel; half a pixel is rounding
    legends = [
        legend.get_window_extent().padded(-0.5) for legend in figure.findobj(mpl.legend.Legend)
    ]
    assert not any(
        box.overlaps(axes.get_window_extent()) for box in legends for axes in figure.axes
    )
    path = KEPT / f"{name}_{size[0]:g}x{size[1]:g}.png"
    now = pixels(figure)
    if os.environ.get("HISTORYSIM_NEW_PICTURES"):
        KEPT.mkdir(exist_ok=True)
        now.quantize(COLOURS).save(path, optimize=True)
        return
    if not mpl.__version__.startswith(MADE_WITH):
        skip(f"the pictures were made with matplotlib {MADE_WITH}")
    with Image.open(path) as kept:
        before = np.asarray(kept.convert("RGB"), dtype=float)
    assert before.shape == np.asarray(now).shape
    assert np.sqrt(np.mean((np.asarray(now, dtype=float) - before) ** 2)) < DIFFERENCE
