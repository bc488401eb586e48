"""Machine code that is kept on the disk, loaded without what only a compiler needs."""

from typing import Any

from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys


class KeptCode(FunctionCache):
    """Numba's cache of one function, of which a process that compiles nothing takes but the code.

    Numba's own has all functions and types that it knows registered before it looks at the disk, and imports
    scipy.linalg for that, which takes longer than to load the code. The code needs none of it but numba's runtime;
    whoever has to compile has them registered then.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, or None."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)
