import ctypes
import math
import re
import shutil
import subprocess
import sys

import numpy as np
import same_bits
from c_core import ROOT, SANITIZED, SUPPORT, WARNINGS, compiled, hatch_build, walked
from cffi import FFI
from hypothesis import example, given
from hypothesis import strategies as st
from pytest import approx, fixture, mark, param, skip

import historysim as hs

EPS = np.finfo(float).eps
CC = hatch_build.compiler()
HISTORIES = 12  # tests/scripts/same_bits.py compares any number
pytestmark = mark.skipif(not CC, reason="needs a C compiler")


@mark.parametrize(
    "compiler, standard",
    [
        (None, "-std=c11"),
        *(
            param(*each, marks=mark.ci)
            for each in (
                ("gcc", "-std=c11"),
                ("g++", "-std=c++17"),
                ("clang", "-std=c11"),
                ("clang++", "-std=c++17"),
            )
        ),
    ],
)
def test_a_c_program_integrates_loops_without_python(tmp_path, compiler, standard):
    if compiler and not shutil.which(compiler):
        skip(f"needs {compiler}")
    command = [compiler] if compiler else CC
    program = compiled(
        command, SUPPORT / "c_program.c", tmp_path, *WARNINGS, "-fPIC", standard=standard
    )
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("expected") == 10


def test_readme_programs_run(tmp_path):
    text = (ROOT / "historysim" / "memory" / "README.md").read_text(encoding="utf-8")
    shown = dict(re.findall(r"```(python)\n(.*?)```", text, re.DOTALL))
    programs = re.findall(r"```c\n(.*?)```", text, re.DOTALL)
    assert len(programs) == 3
    for number, (sign, code) in enumerate(zip(("", "", "-"), programs, strict=True)):
        head, *body = code.splitlines()
        lines = [
            head,
            "#include <math.h>",
            "int main(void) {",
            *body,
            f"return !({sign}force > 0.0); }}",
        ]
        (tmp_path / "program.c").write_text("\n".join(lines), encoding="utf-8")
        subprocess.run(
            [
                compiled(
                    CC, tmp_path / "program.c", tmp_path, *WARNINGS, "-fPIC", name=f"shown{number}"
                )
            ],
            check=True,
        )
    # the lines that link the library of the installed package
    (link,) = re.findall(r"^    (I=.*?)\n    (cc .*?)$", text, re.MULTILINE)
    if sys.platform == "linux" and shutil.which("cc") and shutil.which("python"):
        subprocess.run(["sh", "-ec", "\n".join([*link, "./program"])], check=True, cwd=tmp_path)  # noqa: S607 - the shell of the system
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    ensemble = hs.Ensemble(pair, [0.0, -1e-9], 1e-4, 0.3)
    state = ensemble.advance(ensemble.initial_state(), normal_load=0.01)
    names = vars(ctypes) | {"math": math, "stepper": ensemble.stepper(state)}
    exec(shown["python"], names)  # noqa: S102 - our own
    after = ensemble.advance(
        state, normal_displacement=state.approach, tangential_displacement=7e-9
    )
    assert names["stepper"].tangential_load == after.tangential_load > 0


# -- other codes: histories of fixed size, and trial, commit, revert


@fixture(scope="module")
def grains(tmp_path_factory):
    return compiled(
        CC,
        SUPPORT / "grains.c",
        tmp_path_factory.mktemp("grains"),
        *WARNINGS,
        "-fPIC",
        "-DCONTACTS=100",
    )


def numbers(program, *words):
    done = subprocess.run([program, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return [[float(word) for word in line.split()] for line in done.stdout.splitlines()]


def test_histories_of_fixed_size_err_by_no_more_than_their_bound(grains):
    rooms = (3, 16)
    found = {room: numbers(grains, str(room))[0] for room in rooms}
    for largest, error, bound in found.values():
        assert 0 < error <= bound
        assert largest > 0
    errors = [found[room][1] for room in rooms]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.01 * found[16][0]


def test_histories_that_fit_are_kept_to_the_bit(grains):
    _, error, bound = numbers(grains, "200")[0]
    assert error == bound == 0


def test_a_material_is_tried_committed_and_reverted(tmp_path):
    program = compiled(CC, SUPPORT / "material.c", tmp_path, *WARNINGS, "-fPIC")
    pair = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=50e9 / (4 * 0.6))
    ensemble = hs.Ensemble(pair, 0.0, 1e-3, 0.2)
    state = ensemble.advance(
        ensemble.initial_state(), normal_load=50e-3, tangential_displacement=0.0
    )
    frame = 2e6
    # the same balance, the contact in series with a drive that holds: K (F/K - U) = T
    instrument = hs.Instrument(lateral_stiffness=frame)
    for (place, force, trials), load in zip(
        numbers(program), (12e-3, 45e-3, -10e-3, 9e-3, -45e-3, 45e-3, 0.0), strict=True
    ):
        state = ensemble.advance(state, tangential_displacement=load / frame, instrument=instrument)
        assert place == approx(state.tangential_displacement, rel=1e-9, abs=1e-18)
        assert force == approx(state.tangential_load, rel=1e-9)
        # Newton's method with an exact tangent, and one step that is given up after four trials
        assert trials <= 12
    assert np.isfinite(force)


@mark.ci
@mark.parametrize("program", ["grains.c", "material.c"])
def test_sanitizers_find_nothing_in_other_codes(tmp_path, program):
    assert numbers(compiled(CC, SUPPORT / program, tmp_path, *SANITIZED, "-DCONTACTS=10"))


# -- labels ----------------------------------------------------------------------------------------


@fixture(scope="module")
def inside(tmp_path_factory):
    """The core with everything seen from outside, and how to call it."""
    library = compiled(
        CC, None, tmp_path_factory.mktemp("inside"), *WARNINGS, "-fPIC", "-shared", name="core.so"
    )
    ffi = FFI()
    ffi.cdef("""
        typedef struct { const double *gap, *weight, *load; int64_t count; const void *clusters; } hs_curve;
        double hs_label_at(hs_curve curve, double total, double guess, double rigid, double compliance);
        double hs_cube_root(double x);
    """)
    return ffi, ffi.dlopen(str(library))


@given(
    count=st.integers(1, 40),
    seed=st.integers(0, 2**32 - 1),
    softness=st.floats(-12, 12),
    depth=st.floats(-12, 0),
    guess=st.floats(0, 2),
)
@example(count=1, seed=0, softness=0.0, depth=-3.0, guess=0.0)
def test_a_label_is_found_from_label_and_load_together(inside, count, seed, softness, depth, guess):
    ffi, lib = inside
    rng = np.random.default_rng(seed)
    gap = np.sort(rng.uniform(0.0, 1.0, count))
    gap -= gap[0]
    weight, compliance, label = rng.uniform(0.5, 1.0, count), 10**softness, 10**depth
    load = np.sum(weight * np.maximum(label - gap, 0.0) ** 1.5)
    kept = ffi.from_buffer("double[]", gap), ffi.from_buffer("double[]", weight)
    found = lib.hs_label_at(
        (*kept, ffi.NULL, count, ffi.NULL), label + compliance * load, guess, 1.0, compliance
    )
    assert found == approx(label, rel=16 * EPS)


@given(
    count=st.integers(1, 40),
    seed=st.integers(0, 2**32 - 1),
    softness=st.floats(-6, 6),
    part=st.floats(1e-6, 1.2),
    rigid=st.sampled_from([0.0, 1.0]),
)
def test_a_label_is_found_between_knots(inside, count, seed, softness, part, rigid):
    ffi, lib = inside
    rng = np.random.default_rng(seed)
    gap = np.append(0.0, np.sort(rng.uniform(0.0, 1.0, count)))
    # knots at one place are a jump of the stiffness
    gap[2:] = np.where(rng.random(count - 1) < 0.3, gap[1:-1], gap[2:])
    gap = np.maximum.accumulate(gap)
    stiffness = np.cumsum(rng.uniform(0.1, 1.0, count + 1))
    load = np.append(0.0, np.cumsum(np.diff(gap) * 0.5 * (stiffness[1:] + stiffness[:-1])))
    label, compliance = part * gap[-1], 10**softness
    piece = max(int(np.searchsorted(gap, label, side="left")) - 1, 0)
    bend = (
        (stiffness[piece + 1] - stiffness[piece]) / (gap[piece + 1] - gap[piece])
        if piece < count
        else 0.0
    )
    x = label - gap[piece]
    total = rigid * label + compliance * (load[piece] + x * (stiffness[piece] + 0.5 * bend * x))
    kept = [ffi.from_buffer("double[]", each) for each in (gap, stiffness, load)]
    found = lib.hs_label_at((*kept, count + 1, ffi.NULL), total, 0.0, rigid, compliance)
    assert found == approx(label, rel=256 * EPS)


@given(st.floats(min_value=1e-300, max_value=1e300))
def test_the_cube_root_agrees_with_libm(inside, x):
    assert inside[1].hs_cube_root(x) == approx(np.cbrt(x), rel=2 * EPS)


# -- random histories ------------------------------------------------------------------------------


@mark.ci
@mark.parametrize("histories, steps", [("random_histories.c", 200), ("planar_histories.c", 20)])
def test_sanitizers_find_nothing_in_random_histories(tmp_path, histories, steps):
    program = compiled(CC, SUPPORT / histories, tmp_path, *SANITIZED)
    assert len(walked(program, 0, 12, steps)) == 12


def histories_of(name, folder, histories):
    compiler, _, runner = same_bits.builds()[name]
    if not same_bits.is_there(compiler, runner):
        skip(f"needs {' and '.join([compiler[0], *runner])}")
    return same_bits.digests(name, histories, folder, steps=300)


@fixture(scope="module")
def plain_histories(tmp_path_factory):
    """What random histories print that were compiled without any optimisation."""
    return histories_of("gcc -O0", tmp_path_factory.mktemp("plain"), HISTORIES)


@mark.ci
@mark.parametrize("name", list(same_bits.builds())[1:])
def test_other_compilers_and_processors_give_the_same_bits(tmp_path, name, plain_histories):
    assert same_bits.differing(plain_histories, histories_of(name, tmp_path, HISTORIES))[0] == []
