"""`ReducedModel`: springs in place of a contact, which go to files for other programs and come back from JSON."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Self

import attrs

from historysim.basics.display import html_table
from historysim.basics.files import beginning
from historysim.errors import InputError
from historysim.exchange.reduced.model_files import write_springs
from historysim.exchange.reduced.springs import FORMAT, Springs
from historysim.results.plots.pictures import figure_of
from historysim.results.report.page import page_of
from historysim.results.result_files import FILES, FileKind

if TYPE_CHECKING:
    from historysim.results.plots.canvas import FigureOrAxes, Place


@attrs.frozen(eq=False)
class ReducedModel(Springs):
    """Springs in parallel that slide, in place of a contact; see `Springs` for what stands in it."""

    def _repr_html_(self) -> str:
        return html_table(self.summary())

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a model from the JSON file that `write` has written.

        Raises
        ------
        InputError
            The file is damaged, or from another version.
        """
        try:
            return cls.from_dict(json.loads(Path(path).read_text(encoding="utf-8")))
        except (OSError, ValueError, RecursionError, InputError) as error:
            raise InputError(f"{path}: {error}") from error

    def write(self, output: str | Path, *, form: str | None = None, force: bool = False) -> None:
        """Write the model for another program.

        Parameters
        ----------
        output : path
            Its ending says for which: .json, .csv, .m (MATLAB), .mo (Modelica), .tcl (OpenSees), .py (OpenSeesPy).
        form : str, optional
            ``"pyharm"`` or ``"tmdsimpy"`` for a .py of these programs.
        force : bool
            Replace a file that is none of historysim, too.

        Raises
        ------
        InputError
            An ending or form that is not known, or a file of somebody else.
        OSError
            It cannot be written.
        """
        write_springs(self, Path(output), form=form, force=force)


@FILES.register
class ReducedFile(FileKind):
    """A reduced model (JSON), as ``historysim reduce`` writes it."""

    kind = "reduced model"

    @classmethod
    def is_one(cls, path: Path) -> bool:
        """Return whether a file says that it is one."""
        return path.suffix.lower() == ".json" and FORMAT[:-1].encode() in beginning(path, 1024)

    @classmethod
    def read(cls, path: Path) -> ReducedModel:
        """Return the model."""
        return ReducedModel.read(path)


@figure_of.register(ReducedModel)
def _figure(model: ReducedModel, *, place: "Place", **_: object) -> "FigureOrAxes":
    from historysim.exchange.reduced.reduced_picture import ReducedPicture

    return ReducedPicture().figure(model, place)


@page_of.register(ReducedModel)
def _page(model: ReducedModel) -> str:
    from historysim.exchange.reduced.reduced_picture import reduced_page

    return reduced_page(model)
