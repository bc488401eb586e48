"""`ReducedModel`: springs in place of a contact, which go to files for other programs."""

from pathlib import Path

import attrs

from historysim.exchange.reduced.model_files import write_springs
from historysim.exchange.reduced.springs import Springs


@attrs.frozen(eq=False)
class ReducedModel(Springs):
    """Springs in parallel that slide, in place of a contact; see `Springs` for what stands in it."""

    def write(self, output: str | Path, *, form: str | None = None, force: bool = False) -> None:
        """Write the model for another program.

        Parameters
        ----------
        output : path
            Its ending says for which: .json, .csv, .m (MATLAB), .mo (Modelica), .tcl (OpenSees), .py (OpenSeesPy).
        form : str, optional
            One of `model_files.FORMS`, such as ``"pyharm"``, in place of what the ending says.
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
