"""Where a wheel is built, the memory's functions are compiled, as those of other packages are: runs then start at once.

What is compiled lies beside the source, where numba looks for it, and is good for this kind of processor and these
versions of Python and numba. Where it is not, or where compiling fails, the first run compiles. A wheel without it,
for any machine, is built with ``HATCH_BUILD_NO_HOOKS=true``.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

KEPT = Path("historysim", "memory", "__pycache__")


class CompileAhead(BuildHookInterface):
    """Put compiled functions into the wheel; for an editable installation, beside the source."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and say what belongs into the wheel."""
        self._folder = tempfile.TemporaryDirectory()
        cache = {} if version == "editable" else {"NUMBA_CACHE_DIR": self._folder.name}
        inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
        done = subprocess.run(
            [sys.executable, "-m", "historysim.ahead"],
            cwd=self.root,
            env=inherited | cache,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            self.app.display_warning(f"nothing is compiled ahead; the first run will compile: {done.stderr}")
            return
        if version == "editable":
            return
        for file in Path(self._folder.name).rglob("*.nb[ci]"):
            build_data["force_include"][str(file)] = str(KEPT / file.name)
        build_data["pure_python"], build_data["infer_tag"] = False, True

    def finalize(self, _version: str, _build_data: dict[str, Any], _path: str) -> None:
        """Take what was compiled away again, which is in the wheel."""
        self._folder.cleanup()
