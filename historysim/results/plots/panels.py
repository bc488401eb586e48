"""Pictures that stand beside others in the figure of a scenario: loops, tractions, and numbers of a sweep."""

from typing import TYPE_CHECKING, Annotated, Any

import attrs

from historysim.basics.fields import Quantity
from historysim.basics.places import misfit
from historysim.basics.wording import shown
from historysim.results.plots.pictures import HISTORY, PICTURES, SWEEP, Picture, Size

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr
    from matplotlib.figure import Figure, SubFigure

LOADS = 50.0
"""What the loads beside loops add to the width [mm]."""


@attrs.frozen(kw_only=True)
class Panel(Picture):
    """What pictures in the figure of a scenario have.

    Attributes
    ----------
    title : str
        A heading above this picture, beside the title of the scenario.
    labels : tuple of str
        What its lines, or surfaces, are called.
    where : dict, optional
        Of a sweep, only the cells with these values of swept keys.
    """

    title: str = ""
    labels: tuple[str, ...] = ()
    where: dict[str, Any] | None = None


@PICTURES.register
@attrs.frozen(kw_only=True)
class LoopsPicture(Panel):
    """Friction loops over one another: of histories, or of the cells of a sweep."""

    steps: tuple[str | int, ...] | None = None
    first_loading: Annotated[tuple[float, ...], Quantity("N")] = ()
    work: bool = False
    drift: bool = False
    drive: bool = False
    loads: bool = False

    kind, of, several = "loops", (HISTORY, SWEEP), True

    @property
    def beside(self) -> float:
        """Width of the loads [mm]."""
        return LOADS if self.loads else 0.0

    def draw(self, figure: "Figure | SubFigure", what: "xr.Dataset") -> None:
        """Draw into a figure, or a part of one."""
        from historysim.results.plots.swept_cells import cells_of
        from historysim.results.plots.together import LOOP, LoopMarks, draw_together

        marks = LoopMarks(**{name: getattr(self, name) for name in attrs.fields_dict(LoopMarks)})
        draw_together(figure, cells_of(what, LOOP, self.labels, self.where), marks, self.title)

    def drawn(self, what: "xr.Dataset | Sequence[xr.Dataset]", size: Size | None = None) -> "Figure":
        """Return a figure of it alone."""
        from historysim.results.plots.together import LoopMarks, plot_together

        marks = LoopMarks(**{name: getattr(self, name) for name in attrs.fields_dict(LoopMarks)})
        return plot_together(what, self.labels, where=self.where, marks=marks, title=self.title, size=size)


@PICTURES.register
@attrs.frozen(kw_only=True)
class TractionPicture(Panel):
    """The traction of an asperity at several states."""

    steps: tuple[str | int, ...] | None = None
    asperity: int | None = None
    across: str = "radius"
    limit: bool = True
    fronts: bool = False
    change_from: str | None = None

    kind, several = "traction", True
    caption = "The traction over the radius of the asperity that carries most, from a reversal until it slides."
    place = 5

    @classmethod
    def reported(cls, history: "xr.Dataset") -> bool:
        """Return whether a report shows it: a patch has no radius to draw over."""
        return super().reported(history) and "stick_area" not in history

    @property
    def _options(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("across", "limit", "fronts", "change_from", "labels")}

    def draw(self, figure: "Figure | SubFigure", what: "xr.Dataset") -> None:
        """Draw into a figure, or a part of one."""
        from historysim.results.plots.traction_profile import draw_traction

        draw_traction(figure, [what], self.asperity, self.steps, title=self.title, **self._options)

    def drawn(self, what: "xr.Dataset | Sequence[xr.Dataset]", size: Size | None = None) -> "Figure":
        """Return a figure of it alone."""
        from historysim.results.plots.traction_profile import plot_traction

        return plot_traction(what, self.asperity, self.steps, size=size, **self._options)


@PICTURES.register
@attrs.frozen(kw_only=True)
class CurvePicture(Panel):
    """A number of a sweep over what was swept, or over another number."""

    quantity: str
    over: str | None = None
    each: str | None = None
    spread: str = "deviation"
    fit: str | None = None
    logarithmic: bool | None = None

    kind, of = "curve", (SWEEP,)

    def draw(self, figure: "Figure | SubFigure", what: "xr.Dataset") -> None:
        """Draw into a figure, or a part of one."""
        from historysim.results.plots.swept import draw_swept
        from historysim.results.plots.swept_cells import selected

        names = ("each", "spread", "fit", "logarithmic", "labels", "title")
        options = {name: getattr(self, name) for name in names}
        draw_swept(figure, selected(what, self.where), self.quantity, self.over, **options)


@PICTURES.register
@attrs.frozen(kw_only=True)
class BarsPicture(Panel):
    """A number of the cells of a sweep as bars in groups, with the difference within each."""

    quantity: str
    groups: dict[str, Any]

    kind, of = "bars", (SWEEP,)

    def __attrs_post_init__(self) -> None:
        """Check that groups are lists of names."""
        for name, bars in self.groups.items():
            if not isinstance(bars, list) or not bars or not all(isinstance(bar, str) for bar in bars):
                raise misfit(f"{shown(bars)}; expected an array with the names of its bars", "groups", name)

    def draw(self, figure: "Figure | SubFigure", what: "xr.Dataset") -> None:
        """Draw into a figure, or a part of one."""
        from historysim.results.plots.swept import draw_bars
        from historysim.results.plots.swept_cells import selected

        draw_bars(figure, selected(what, self.where), self.quantity, self.groups, self.title)
