"""The traction memory of asperities: a C library without dependencies, and its Python binding.

`README.md` has the theory and the layout of a memory; `historysim.h` is the public header of the
library. Other packages call it through `binding`.
"""

from pathlib import Path


def get_include() -> str:
    """Return the folder of ``historysim.h``, for C programs that step a memory themselves.

    Examples
    --------
    >>> from pathlib import Path
    >>> (Path(hs.get_include()) / "historysim.h").is_file()
    True
    """
    return str(Path(__file__).parent)
