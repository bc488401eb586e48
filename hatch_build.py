"""Compile the package's C into one library, and read its headers, where it is installed or a wheel of it is built.

The library (`historysim/basics/libhistorysim.so`) knows nothing of Python: a C compiler is enough,
Python's headers are not needed, and one wheel serves all versions of Python. Where there is no C
compiler either, the package ``ziglang`` brings one for the time of the build. The environment's
``CC``, ``CFLAGS`` and ``LDFLAGS`` are honoured, but for what would change the bits of results, and
for the level of optimisation, which is -O3 unless they hold -O0.

For pages, the memory is also compiled to WebAssembly: `historysim/results/report/browser.wasm` is a
tracked file, which ``python hatch_build.py --browser`` writes anew. The compiler is pinned in
`pyproject.toml` (extra ``browser``), since another one gives other bytes.

The public headers are the declarations: cffi reads them now, into
`historysim/basics/_declarations.py`, so that nothing need be parsed when the package is imported.

``python hatch_build.py`` compiles the library alone, in place, after a change of a ``.c`` or ``.h``
file.
"""

import argparse
import importlib.metadata
import importlib.util
import re
import sys
import sysconfig
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

HERE = Path(__file__).parent
PLACE = Path("historysim", "basics")
CFFI = "cffi>=1.16"
LIBRARY = "libhistorysim" + {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
DECLARATIONS = "_declarations.py"
CERTIFIED = Path("data", "certified")
BROWSER = Path("historysim", "results", "report", "browser.wasm")

# the package itself is not there yet
_SPEC = importlib.util.spec_from_file_location("compiler", HERE / PLACE / "compiler.py")
_COMPILING: Any = importlib.util.module_from_spec(_SPEC)  # type: ignore[arg-type] # the file is there
_SPEC.loader.exec_module(_COMPILING)  # type: ignore[union-attr]
ZIG, compile_wasm = _COMPILING.ZIG, _COMPILING.compile_wasm
compiler, options, compile_shared = (
    _COMPILING.compiler,
    _COMPILING.options,
    _COMPILING.compile_shared,
)

COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
FOR_CPP_ALONE = re.compile(
    r"^[ \t]*#[ \t]*ifdef __cplusplus$.*?^[ \t]*#[ \t]*endif", re.DOTALL | re.MULTILINE
)
CONSTANT = re.compile(r"\s*#\s*define\s+\w+\s+-?(0[xX][0-9a-fA-F]+|[0-9]+)\s*")


class CompiledLibrary(BuildHookInterface):
    """Put the library and its declarations into the wheel; for an editable installation, beside the source."""

    def dependencies(self) -> list[str]:
        """Require cffi, and ziglang where there is no C compiler.

        SystemExit: an interpreter for which there is no cffi.
        """
        if sysconfig.get_config_var("Py_GIL_DISABLED") and sys.version_info < (3, 14):
            raise SystemExit(
                f"historysim: {sys.executable} is a free-threaded build of Python {sys.version_info[0]}."
                f"{sys.version_info[1]}, which cffi does not support; expected a standard build of Python 3.11 or later"
            )
        if compiler():
            return [CFFI]
        self.app.display_info(
            "no C compiler is found (CC, cc, gcc, clang): ziglang is used, which contains one"
        )
        return [CFFI, "ziglang>=0.13"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and say what belongs into the wheel, and for which machines the wheel is."""
        from packaging.tags import platform_tags

        root = Path(self.root)
        self.app.display_info("compiling the C of historysim")
        if version == "editable":
            build(root, root / PLACE)
        else:
            self._folder = tempfile.TemporaryDirectory()
            build(root, Path(self._folder.name))
            for name in (LIBRARY, DECLARATIONS):
                build_data["force_include"][str(Path(self._folder.name, name))] = str(PLACE / name)
            # for `historysim reference`
            build_data["force_include"][str(root / CERTIFIED)] = "historysim/certified"
        # a library that was compiled here is not one for all Linux of an age
        machine = next(
            tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux"))
        )
        build_data["pure_python"], build_data["tag"] = False, f"py3-none-{machine}"


def build(root: Path, folder: Path) -> None:
    """Compile the library of a source tree, and write it and its declarations into a folder.

    Raises
    ------
    RuntimeError
        The compiler fails; the message is its own.
    """
    with tempfile.TemporaryDirectory(dir=folder) as made:
        library, declared = Path(made, LIBRARY), Path(made, DECLARATIONS)
        compile_library(root, library)
        write_declarations(root, declared)
        # whoever has the library of before open keeps it whole
        library.replace(folder / LIBRARY)
        declared.replace(folder / DECLARATIONS)


def compile_library(root: Path, library: Path) -> None:
    """Compile all C of a source tree, in one call of the compiler. Errors as in `build`."""
    files = (file.relative_to(root) for file in root.glob("historysim/**/*.c"))
    # sources for other programs and for browsers are not part of it
    sources = sorted(
        str(root / file) for file in files if file.parts[1] not in {"exchange", "results"}
    )
    command = [*(compiler() or ZIG), *options()]
    try:
        compile_shared(command, sources, library, windows=sys.platform == "win32")
    except RuntimeError as error:
        raise RuntimeError(
            "the C of historysim is not compiled; expected a compiler of C11 that takes gcc's options: name another "
            f"one in CC, or see CFLAGS and LDFLAGS.\n{error}"
        ) from None


def build_browser_library(root: Path, library: Path) -> None:
    """Compile the memory of a source tree to WebAssembly; RuntimeError without the pinned ziglang or if it fails."""
    installed = [
        f"ziglang=={found.version}" for found in importlib.metadata.distributions(name="ziglang")
    ]
    if browser_compiler() not in installed:
        raise RuntimeError(
            f"{BROWSER} is not compiled: {' '.join(installed) or 'no ziglang'} is installed; expected the version that "
            f"gives the same bytes everywhere: pip install {browser_compiler()}"
        )
    source = (root / BROWSER).with_suffix(".c")
    with tempfile.TemporaryDirectory(dir=library.parent) as made:
        compiled = Path(made, library.name)
        compile_wasm([*sorted(map(str, root.glob("historysim/memory/*.c"))), str(source)], compiled)
        compiled.chmod(0o644)
        compiled.replace(library)


def browser_compiler() -> str:
    """Return the pinned requirement of the compiler of WebAssembly, as ``"ziglang==0.13.0"``."""
    extras = tomllib.loads((HERE / "pyproject.toml").read_text("utf-8"))["project"][
        "optional-dependencies"
    ]
    (requirement,) = extras["browser"]
    return str(requirement)


def write_declarations(root: Path, file: Path) -> None:
    """Write what the public headers of a source tree declare, as cffi reads it without a parser."""
    from cffi import FFI

    ffi = FFI()
    headers = (header.read_text("utf-8") for header in sorted(root.glob("historysim/**/*.h")))
    ffi.cdef("\n".join(public for public in map(declarations, headers) if public))
    ffi.set_source("historysim.basics._declarations", None)
    ffi.emit_python_code(str(file))
    with file.open("a", encoding="utf-8") as more:
        more.write(f"\nLIBRARY = {LIBRARY!r}\n")


def declarations(header: str) -> str:
    """Return what a header declares as cffi takes it: constants, types and functions; nothing if it is not public.

    Of directives only ``#define NAME integer`` is understood, and whole ``#ifdef __cplusplus`` are
    left out.
    """
    text = COMMENT.sub(" ", header).replace("\\\n", " ")
    lines = FOR_CPP_ALONE.sub("", text).splitlines()
    text = "\n".join(
        line for line in lines if not line.lstrip().startswith("#") or CONSTANT.fullmatch(line)
    )
    return re.sub(r"\bHS_API\b", "", text) if "HS_API" in text else ""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Compile the C of historysim in place.")
    parser.add_argument(
        "--browser", action="store_true", help=f"write {BROWSER} instead of the library"
    )
    try:
        if parser.parse_args().browser:
            build_browser_library(HERE, HERE / BROWSER)
        else:
            build(HERE, HERE / PLACE)
    except RuntimeError as error:
        sys.exit(str(error))
