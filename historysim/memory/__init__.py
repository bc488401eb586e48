"""The traction memory of asperities: a C library without dependencies, and how Python has it.

`README.md` has the theory, and how a memory is laid out; `historysim.h` is the library's public
face. `binding` is what the other rooms call it by.
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
