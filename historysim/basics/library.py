"""The package's C, compiled where it was installed: one library for all rooms, declared by their headers."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from historysim.errors import InstallationError

try:
    from historysim.basics import _declarations

    ffi: Any = _declarations.ffi
    lib: Any = ffi.dlopen(str(Path(__file__).with_name(_declarations.LIBRARY)))
except (ImportError, OSError) as error:
    raise InstallationError(
        f"the compiled library of historysim cannot be loaded ({error}); expected it in {Path(__file__).parent}, where "
        "installing puts it: in a clone run `pip install -e .`, elsewhere `pip install --force-reinstall historysim`"
    ) from error

_ROWS = {
    np.dtype(np.float64): "double[]",
    np.dtype(np.int64): "int64_t[]",
    np.dtype(np.int8): "int8_t[]",
    np.dtype(np.uint8): "uint8_t[]",
    np.dtype(np.bool_): "bool[]",
}


def pointer(array: npt.NDArray[Any]) -> Any:
    """Return an array's own memory as C takes it; the array has to outlive the call.

    Parameters
    ----------
    array : array
        In a row (C contiguous), of float64, int64, int8, uint8 or bool, in the machine's order of bytes.

    Raises
    ------
    ValueError
        Not in a row.
    KeyError
        Of another type.
    """
    return ffi.from_buffer(_ROWS[array.dtype], array)
