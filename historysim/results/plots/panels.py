"""Pictures that stand beside others in the figure of a scenario: loops, tractions, and numbers of a sweep."""

from typing import TYPE_CHECKING, Annotated, Any, Unpack

import attrs

from historysim.basics.fields import Quantity
from historysim.basics.places import misfit
from historysim.basics.wording import shown
from historysim.results.plots.paper import Drawn, Page, Place
from historysim.results.plots.pictures import HISTORY, PICTURES, SWEEP, Picture

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

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
    """Friction loops over one another: of histories, or of the cells of a sweep.

    Attributes
    ----------
    steps
        Names or numbers of states that are marked; by default all that have a name.
    first_loading
        Normal loads whose curves of first loading are drawn.
    work
        Shades the closed loop between ±δ. Of a sweep it needs ``preliminary_displacement`` among the outputs.
    drift
        Draws it between the δ of two loops; needs the same.
    drive
        Behind an instrument the loop of the drive, too.
    loads
        Both loads along the named states, beside the loop.

    Examples
    --------
    [[picture]]
    kind = "loops"
    loads = true
    """

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

    def draw(self, page: Page, what: "xr.Dataset") -> None:
        """Draw on a page."""
        from historysim.results.plots.swept_cells import cells_of
        from historysim.results.plots.together import LOOP, LoopMarks, draw_together

        marks = LoopMarks(**{name: getattr(self, name) for name in attrs.fields_dict(LoopMarks)})
        draw_together(page, cells_of(what, LOOP, self.labels, self.where), marks, self.title)

    def drawn(self, what: "xr.Dataset | Sequence[xr.Dataset]", **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        from historysim.results.plots.together import LoopMarks, plot_together

        marks = LoopMarks(**{name: getattr(self, name) for name in attrs.fields_dict(LoopMarks)})
        return plot_together(what, self.labels, where=self.where, marks=marks, title=self.title, **place)


@PICTURES.register
@attrs.frozen(kw_only=True)
class TractionPicture(Panel):
    """The traction of an asperity at several states.

    Attributes
    ----------
    steps
        Up to 10 states, by name or number; by default all that have a name, or else 5 of the swing.
    asperity
        Which; by default the one that carries most.
    across
        ``"radius"`` or ``"diameter"``.
    limit
        Draws ±μp of each state.
    fronts
        Marks where slip ends.
    change_from
        A state from which on changes are drawn.

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

    def draw(self, page: Page, what: "xr.Dataset") -> None:
        """Draw on a page."""
        from historysim.results.plots.traction_profile import draw_traction

        draw_traction(page, [what], self.asperity, self.steps, title=self.title, **self._options)

    def drawn(self, what: "xr.Dataset | Sequence[xr.Dataset]", **place: Unpack[Place]) -> Drawn:
        """Return a figure of it alone."""
        from historysim.results.plots.traction_profile import plot_traction

        return plot_traction(what, self.asperity, self.steps, **self._options, **place)


@PICTURES.register
@attrs.frozen(kw_only=True)
class CurvePicture(Panel):
    """A number of a sweep over what was swept, or over another number.

    Attributes
    ----------
    quantity
        The number of the sweep.
    over
        A dimension, or another number, such as ``peak_nominal_pressure``.
    each
        The dimension of the lines.
    spread
        ``"deviation"``, ``"quantiles"`` or ``"none"``.
    fit
        ``"straight"`` (with R²) or ``"power"`` (with the exponent).
    logarithmic
        Both axes.

    Examples
    --------
    [[picture]]
    kind = "curve"
    quantity = "presliding_work"
    over = "loading_waypoints[0]_normal_load"
    fit = "power"
    """

    quantity: str
    over: str | None = None
    each: str | None = None
    spread: str = "deviation"
    fit: str | None = None
    logarithmic: bool | None = None

    kind, of = "curve", (SWEEP,)

    def draw(self, page: Page, what: "xr.Dataset") -> None:
        """Draw on a page."""
        from historysim.results.plots.swept import draw_swept
        from historysim.results.plots.swept_cells import selected

        names = ("each", "spread", "fit", "logarithmic", "labels", "title")
        options = {name: getattr(self, name) for name in names}
        draw_swept(page, selected(what, self.where), self.quantity, self.over, **options)


@PICTURES.register
@attrs.frozen(kw_only=True)
class BarsPicture(Panel):
    """A number of the cells of a sweep as bars in groups, with the difference within each.

    Attributes
    ----------
    quantity
        The number of the sweep.
    groups
        A table of lists with the name of each bar.

    Examples
    --------
    [[picture]]
    kind = "bars"
    quantity = "preliminary_displacement"
    groups = { "1 N" = ["100 m", "1000 m"] }
    """

    quantity: str
    groups: dict[str, Any]

    kind, of = "bars", (SWEEP,)

    def __attrs_post_init__(self) -> None:
        """Check that groups are lists of names."""
        for name, bars in self.groups.items():
            if not isinstance(bars, list) or not bars or not all(isinstance(bar, str) for bar in bars):
                raise misfit(f"{shown(bars)}; expected an array with the names of its bars", "groups", name)

    def draw(self, page: Page, what: "xr.Dataset") -> None:
        """Draw on a page."""
        from historysim.results.plots.swept import draw_bars
        from historysim.results.plots.swept_cells import selected

        draw_bars(page, selected(what, self.where), self.quantity, self.groups, self.title)
