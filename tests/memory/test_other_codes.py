"""The C as an interface for other codes: histories of fixed size, and trial, commit, revert."""

import subprocess

import numpy as np
from c_core import SUPPORT, WARNINGS, compiled, hatch_build
from pytest import approx, fixture, mark

import historysim as hs

CC = hatch_build.compiler()
LEAKS = ["-O0", "-g", "-fsanitize=address"]
pytestmark = mark.skipif(not CC, reason="needs a C compiler")


@fixture(scope="module")
def grains(tmp_path_factory):
    return compiled(
        CC,
        SUPPORT / "grains.c",
        tmp_path_factory.mktemp("grains"),
        *WARNINGS,
        *LEAKS,
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
    program = compiled(CC, SUPPORT / "material.c", tmp_path, *WARNINGS, *LEAKS)
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
