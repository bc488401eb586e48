import importlib.metadata
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tarfile
import zipfile
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

from hatchling.bridge.app import Application
from pytest import fixture, mark, raises, skip

import historysim
from historysim.basics._declarations import LIBRARY

ROOT = Path(historysim.__file__).parents[1]
SPEC = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
hatch_build = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(hatch_build)

EXCHANGE = ROOT / "historysim" / "exchange"
APART = {EXCHANGE, (ROOT / hatch_build.BROWSER).parent}
C_FILES = sorted(
    str(file) for file in ROOT.glob("historysim/**/*.c") if not APART & {*file.parents}
)
NO_COMPILER = "needs a C compiler"
compiles = mark.skipif(not hatch_build.compiler(), reason=NO_COMPILER)
NAMES = [name for name in ("gcc", "clang") if shutil.which(name)]

HEADER = """
/* HS_API is in this comment, too: HS_API int none(void); */
#ifndef HS_ONE_H
#define HS_ONE_H
#include <stddef.h>
#include <stdint.h>
#ifndef HS_API
# define HS_API __attribute__((visibility("default")))
#endif
#ifdef __cplusplus
extern "C" {
#endif

#define HS_LANES 3
  #  define HS_MASK 0x10 // a comment
#define HS_LEAST -2
#define HS_LONG \\
    12
#define HS_HALF 0.5
#define HS_TWICE(x) (2 * (x))

typedef enum { HS_FIRST, HS_SECOND = 5 } hs_kind;
typedef struct hs_thing hs_thing; // opaque
typedef double (*hs_law)(void *context, double slid);
typedef struct {
    int8_t flag;
    double values[HS_LANES]; /* [N] */
    hs_law law;
} hs_state;

HS_API double hs_sum(const hs_state *state, hs_kind kind);
HS_API size_t hs_size(void);

#ifdef __cplusplus
}
#endif
#endif
"""
SOURCE = """
#include "one.h"
#include "../two/two.h"
double hs_sum(const hs_state *state, hs_kind kind) {
    double sum = kind == HS_SECOND ? state->law(0, state->flag) : 0.0;
    for (int i = 0; i < HS_LANES; i++) sum += state->values[i];
    return sum + hs_hidden();
}
size_t hs_size(void) { return sizeof(hs_state); }
"""
TREE = {
    "one/one.h": HEADER,
    "one/one.c": SOURCE,
    "two/two.h": "double hs_hidden(void);\n",
    "two/two.c": '#include "two.h"\n#include <math.h>\ndouble hs_hidden(void) { return sqrt(4.0); }\n',
}


@fixture
def tree(tmp_path):
    """A small source tree like the package's."""
    if not hatch_build.compiler():
        skip(NO_COMPILER)
    for name, text in TREE.items():
        file = tmp_path / "tree" / "historysim" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    (tmp_path / "tree" / hatch_build.PLACE).mkdir()
    return tmp_path / "tree"


@fixture
def no_compiler(monkeypatch, tmp_path):
    """A PATH without any program."""
    (tmp_path / "empty").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.delenv("CC", raising=False)


def hook(root):
    return hatch_build.CompiledLibrary(str(root), {}, None, None, "", "wheel", Application())


def built(tree, folder):
    """Build a tree's library into a folder, and load it by the declarations next to it."""
    folder.mkdir(exist_ok=True)
    hatch_build.build(tree, folder)
    made = {}
    exec((folder / hatch_build.DECLARATIONS).read_text(encoding="utf-8"), made)  # noqa: S102 - as the package does
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [hatch_build.DECLARATIONS, made["LIBRARY"]]
    )
    return made["ffi"], made["ffi"].dlopen(str(folder / made["LIBRARY"]))


def test_only_integers_are_left_of_the_directives():
    text = hatch_build.declarations(HEADER)
    assert [line.split() for line in text.splitlines() if "#" in line] == [
        ["#define", "HS_LANES", "3"],
        ["#", "define", "HS_MASK", "0x10"],
        ["#define", "HS_LEAST", "-2"],
        ["#define", "HS_LONG", "12"],
    ]
    assert not {"HS_API", "extern", "none", "comment"} & set(text.replace("(", " ").split())


def test_a_header_that_marks_nothing_is_not_public():
    assert hatch_build.declarations(TREE["two/two.h"]) == ""
    assert (
        hatch_build.declarations((ROOT / "historysim/basics/api.h").read_text(encoding="utf-8"))
        == ""
    )


def test_the_library_has_the_declared_functions(tree, tmp_path):
    ffi, lib = built(tree, tmp_path / "out")
    assert sorted(dir(lib)) == [
        "HS_FIRST",
        "HS_LANES",
        "HS_LEAST",
        "HS_LONG",
        "HS_MASK",
        "HS_SECOND",
        "hs_size",
        "hs_sum",
    ]
    assert (lib.HS_LANES, lib.HS_MASK, lib.HS_LEAST, lib.HS_LONG, lib.HS_SECOND) == (
        3,
        16,
        -2,
        12,
        5,
    )
    assert lib.hs_size() == ffi.sizeof("hs_state") == 40
    law = ffi.callback("hs_law", lambda _, slid: 100.0 * slid)
    state = ffi.new("hs_state *", {"flag": 3, "values": [1.0, 2.0, 4.0], "law": law})
    assert lib.hs_sum(state, lib.HS_FIRST) == 9.0
    assert lib.hs_sum(state, lib.HS_SECOND) == 309.0
    with raises(AttributeError):
        lib.hs_hidden  # noqa: B018 - looking it up is the test


def test_an_editable_installation_is_built_in_place(tree):
    data = {"force_include": {}}
    hook(tree).initialize("editable", data)
    place = tree / hatch_build.PLACE
    assert {path.name for path in place.iterdir()} == {LIBRARY, hatch_build.DECLARATIONS}
    before = (place / LIBRARY).stat().st_ino
    hook(tree).initialize("editable", data)
    # what another process has open stays whole
    assert (place / LIBRARY).stat().st_ino != before
    assert data["force_include"] == {}


def test_variables_of_the_environment_are_honoured(tree, tmp_path, monkeypatch):
    asked = tmp_path / "asked"
    script = tmp_path / "my cc"
    script.write_text(
        f'#!/bin/sh\nprintf "%s\\n" "$@" > {asked}\nexec {hatch_build.compiler()[0]} "$@"\n'
    )
    script.chmod(0o755)
    monkeypatch.setenv("CC", f"{shlex.quote(str(script))} -DFIRST")
    monkeypatch.setenv("CFLAGS", "-O1 -DA='b c' -ffast-math -std=gnu11")
    monkeypatch.setenv("LDFLAGS", "-Wl,-s")
    built(tree, tmp_path / "out")
    options = asked.read_text().splitlines()
    assert options[0] == "-DFIRST"
    assert options.index("-O1") < options.index("-DA=b c") < options.index("-O3")
    assert "-ffast-math" not in options
    monkeypatch.setenv("CFLAGS", "-g -O0")
    built(tree, tmp_path / "plain")
    assert [option for option in asked.read_text().splitlines() if option.startswith("-O")] == [
        "-O0"
    ]
    assert options.index("-std=gnu11") < options.index("-std=c11")
    assert "-Wl,-s" in options


BITS = """
#include "one.h"
double hs_sum(const hs_state *state, hs_kind kind) {
    const double *v = state->values;
    return kind ? v[0] * v[1] + v[2] : (v[0] + v[1]) - v[1];
}
size_t hs_size(void) { return 0; }
"""
ASK_FOR_BITS = """
import sys
sys.path.insert(0, sys.argv[1])
from _declarations import ffi, LIBRARY
lib = ffi.dlopen(sys.argv[1] + "/" + LIBRARY)
ask = lambda kind, *values: lib.hs_sum(ffi.new("hs_state *", {"values": values}), kind)
print(ask(0, 1.0, 1e17, 0.0), ask(5, 1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0), float.fromhex("0x1p-1060") * 0.5 > 0)
"""


@mark.parametrize("name", NAMES)
def test_no_flag_changes_the_bits(tree, tmp_path, monkeypatch, name):
    (tree / "historysim" / "one" / "one.c").write_text(BITS)
    monkeypatch.setenv("CC", name)
    monkeypatch.setenv(
        "CFLAGS", "-march=native -Ofast -ffp-contract=fast -funsafe-math-optimizations"
    )
    monkeypatch.setenv("LDFLAGS", "-ffast-math -ffp-contract=fast")
    built(tree, tmp_path / "out")
    done = subprocess.run(
        [sys.executable, "-c", ASK_FOR_BITS, str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=True,
    )
    # reordered sums give 1, contracted products -2⁻⁶⁰, and numbers below the normal ones are
    # flushed to 0
    assert done.stdout.split() == ["0.0", "0.0", "True"]


def test_an_error_of_the_compiler_is_reported(tree, tmp_path):
    (tree / "historysim" / "two" / "two.c").write_text("not C")
    with raises(RuntimeError, match=r"expected a compiler of C11(.|\n)*two\.c(.|\n)*error") as told:
        hatch_build.build(tree, tmp_path)
    assert "-ffp-contract=off" in str(told.value)
    assert not [path for path in tmp_path.iterdir() if path.suffix in {".so", ".py"}]


@compiles
def test_a_compiler_is_found(monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    assert hatch_build.compiler() in ([name] for name in ("cc", "gcc", "clang"))
    assert hook(ROOT).dependencies() == [hatch_build.CFFI]


@mark.parametrize("version, refused", [((3, 13, 1), True), ((3, 14, 0), False)])
def test_a_free_threaded_interpreter_without_cffi_is_refused_in_words(
    monkeypatch, version, refused
):
    monkeypatch.setattr("sysconfig.get_config_var", lambda name: int(name == "Py_GIL_DISABLED"))
    monkeypatch.setattr(hatch_build.sys, "version_info", version)
    with (
        raises(SystemExit, match=r"free-threaded build of Python 3\.13")
        if refused
        else nullcontext()
    ):
        hook(ROOT).dependencies()


@mark.parametrize("version", ["0.14.1", None])
def test_only_the_pinned_compiler_builds_the_library_of_browsers(tmp_path, monkeypatch, version):
    found = [] if version is None else [SimpleNamespace(version=version)]
    monkeypatch.setattr(hatch_build.importlib.metadata, "distributions", lambda **_: found)
    said = f"{f'ziglang=={version}' if version else 'no ziglang'} is installed; .* pip install ziglang==[0-9.]+$"
    with raises(RuntimeError, match=said):
        hatch_build.build_browser_library(ROOT, tmp_path / "browser.wasm")
    assert list(tmp_path.iterdir()) == []


@mark.ci
def test_the_tracked_library_of_browsers_is_of_the_present_sources(tmp_path):
    pinned = hatch_build.browser_compiler()
    installed = {
        f"ziglang=={found.version}" for found in importlib.metadata.distributions(name="ziglang")
    }
    if pinned not in installed:
        skip(f"needs {pinned}: pip install -e '.[browser]'")
    library = tmp_path / "browser.wasm"
    hatch_build.build_browser_library(ROOT, library)
    tracked = ROOT / hatch_build.BROWSER
    same = library.read_bytes() == tracked.read_bytes()
    assert same, (
        f"{hatch_build.BROWSER} is of other sources; expected that of: python hatch_build.py --browser"
    )


@mark.usefixtures("no_compiler")
def test_without_a_compiler_one_is_required(capsys, monkeypatch):
    assert hatch_build.compiler() == []
    _, asked = hook(ROOT).dependencies()
    assert asked.startswith("ziglang")
    assert "no C compiler is found" in "".join(capsys.readouterr())
    monkeypatch.setenv("CC", "mine")
    assert hook(ROOT).dependencies() == [hatch_build.CFFI]


@mark.usefixtures("no_compiler")
def test_a_compiler_without_headers_is_none(tmp_path):
    broken = tmp_path / "empty" / "gcc"
    broken.write_text("#!/bin/sh\nexit 1\n")
    broken.chmod(0o755)
    assert hatch_build.compiler() == []


def python(*command, folder=ROOT, **environment):
    """What Python says, run in a folder."""
    done = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


COUNT = """
import historysim
from historysim.measured.reduction import turning_points
print(historysim.__file__, len(turning_points([0, 2, 1, 3])))
"""


def check_wheel(wheel, folder):
    """Look at a wheel, and use it where it was unpacked."""
    assert wheel.name.split("-", 2)[2].startswith("py3-none-")
    assert not wheel.name.endswith("-any.whl")
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
        packed.extractall(folder)  # noqa: S202 - our own
    for name in (
        f"historysim/basics/{LIBRARY}",
        f"historysim/basics/{hatch_build.DECLARATIONS}",
        hatch_build.BROWSER,
    ):
        assert names.count(str(name)) == 1
    assert {name for name in names if name.endswith((".c", ".h"))} >= {
        "historysim/measured/reduction.h"
    }
    home = folder / "historysim" / "__init__.py"
    assert python("-P", "-c", COUNT, PYTHONPATH=str(folder)).split() == [str(home), "4"]


@mark.ci
@compiles
def test_a_wheel_is_built_from_the_sources_alone(tmp_path):
    python("-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path))
    (sources,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sources) as packed:
        names = packed.getnames()
        packed.extractall(tmp_path, filter="data")
    assert not [name for name in names if name.endswith((LIBRARY, hatch_build.DECLARATIONS))]
    unpacked = tmp_path / sources.name.removesuffix(".tar.gz")
    python(
        "-m",
        "hatchling",
        "build",
        "-t",
        "wheel",
        "-d",
        str(tmp_path),
        folder=unpacked,
        CFLAGS="-O0",
    )
    assert not (unpacked / hatch_build.PLACE / LIBRARY).exists()
    (wheel,) = tmp_path.glob("*.whl")
    check_wheel(wheel, tmp_path / "wheel")


@mark.ci
@mark.usefixtures("no_compiler")
def test_a_wheel_is_built_where_there_is_no_compiler(tmp_path):
    said = python("-m", "pip", "wheel", "--no-deps", "-v", "-w", str(tmp_path), ".", CFLAGS="-O0")
    assert "no C compiler is found" in said
    (wheel,) = tmp_path.glob("*.whl")
    check_wheel(wheel, tmp_path / "wheel")


WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-fsyntax-only"]


@mark.ci
@mark.parametrize("name", NAMES)
@mark.parametrize("language", ["c", "c++"])
def test_no_compiler_warns(name, language):
    standard = {"c": "-std=c11", "c++": "-std=c++17"}[language]
    subprocess.run([name, "-x", language, standard, *WARNINGS, *C_FILES], check=True)


@mark.ci
@mark.parametrize("name", NAMES)
@mark.parametrize("language", ["c", "c++"])
def test_each_header_compiles_by_itself_and_twice(name, language, tmp_path):
    headers = sorted(
        file for file in ROOT.glob("historysim/**/*.h") if EXCHANGE not in file.parents
    )
    for number, header in enumerate(headers):
        program = f'#include "{header}"\n#include "{header}"\nint main(void) {{ return 0; }}\n'
        (tmp_path / f"{number}_{header.stem}.c").write_text(program, encoding="utf-8")
    subprocess.run([name, "-x", language, *WARNINGS, *map(str, tmp_path.glob("*.c"))], check=True)
