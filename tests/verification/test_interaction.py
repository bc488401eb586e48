"""Asperities that press on one another through the body."""

import math

import numpy as np
import pytest
from dense_contact import DenseContact

import historysim as hs


@pytest.mark.slow
def test_areas(page):
    """Real area at light loads

    Compared with **Persson, and Bush, Gibson and Thomas**, at vanishing load: A = κ N/(E* g) with
    the rms slope g and κ = √(8/π) (B. N. J. Persson, *J. Chem. Phys.* 115, 2001, 3840) or √(2π) (A.
    W. Bush, R. D. Gibson and T. R. Thomas, *Wear* 35, 1975, 87). Solutions of whole maps in the
    literature lie between them: 1.8 to 2.2 (S. Hyun and others, *Phys. Rev. E* 70, 2004, 026117).
    So does the whole map here, when its pixel is extrapolated to zero.

    The model ends where the map does: patches of few points are too large by half a pixel all
    around, 8 % here at 256² points, and at lighter loads κ scatters, as few patches carry them.
    """

    def areas(heights, loads):
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        kappa = []
        for coarser in (2, 1):
            surface = hs.Surface(heights[::coarser, ::coarser], 0.5e-6 * coarser, periodic=True)
            found = hs.area_laws(surface, pair, loads)
            kappa.append(
                found.real_contact_area * pair.contact_modulus * found.rms_slope / found.normal_load
            )
        return kappa

    heights = hs.random_surface(
        (512, 512), 0.5e-6, 24e-9, 20e-6, seed=1, autocorrelation="gaussian"
    ).heights
    loads = np.array([1e-4, 0.1, 0.2])
    coarse, fine = page.shows(areas, heights, loads)
    persson = fine.sel(law="Persson").values
    page.row(
        "κ of Persson at 0.1 mN",
        math.sqrt(8 / math.pi),
        persson[0],
        1e-3,
        "A/A₀ = 2e-5, and the square",
    )
    # at a light load the laws know no neighbours: summits are far above the mean
    page.row(
        "κ of Bush, Gibson and Thomas", math.sqrt(2 * math.pi), fine.sel(law="Bush–Gibson–Thomas").values[0], 0.1,
        "falls with the load as 1/z²",
    )  # fmt: skip
    whole = (2 * fine - coarse).sel(law="whole map").values[1:]
    page.row("κ of the whole map", 2.0, whole, 0.2, "range of the literature", of="1", scale=1)

    @page.picture
    def draw(axes):
        for law in ("Bush–Gibson–Thomas", "Persson"):
            axes.plot(1e3 * loads[1:], fine.sel(law=law)[1:], "-o", ms=3, label=law)
        axes.plot(
            1e3 * loads[1:], fine.sel(law="whole map")[1:], "-s", ms=3, label="whole map, 512²"
        )
        axes.plot(1e3 * loads[1:], whole, "--s", ms=3, label="pixel extrapolated to 0")
        axes.set(xlabel="normal load (mN)", ylabel="A E* g/N", ylim=(1.4, 3.0))
        axes.legend(fontsize=6)


def test_normal_contact(page):
    """Pressures of a rough map

    Compared with **Tamaas** (L. Frérot and others, *J. Open Source Softw.* 5, 2020, 2121), another
    program, by its own conjugate gradients, on a map of 64² points that repeats.

    The model ends where the half-space does: slopes are small, and the body is thick compared with
    the map.
    """
    tamaas = pytest.importorskip("tamaas")

    def rough_map():
        surface = hs.random_surface(
            (64, 64), 1e-6, 50e-9, 14e-6, seed=2, autocorrelation="gaussian"
        )
        solutions = hs.NormalSolutions.solve(surface, largest_load=5e-11)  # over E* [m²]
        return surface, solutions

    surface, solutions = page.shows(rough_map)
    row = solutions.load.shape[0] // 2
    load = solutions.load[row].sum()
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [64.0, 64.0], [64, 64])
    model.E, model.nu = 1.0, 0.0
    solver = tamaas.PolonskyKeerRey(model, surface.heights / 1e-6, 1e-12)
    tamaas.set_log_level(tamaas.LogLevel.error)
    solver.solve(load / 64e-6**2)
    found = np.zeros(64 * 64)
    found[solutions.point] = solutions.pressure[row]
    page.row(
        "pressures, over E*",
        np.array(model.traction).ravel(),
        found,
        1e-4,
        "both iterate",
        of="the largest",
    )

    @page.picture
    def draw(axes):
        image = axes.imshow(
            1e3 * found.reshape(64, 64).T, origin="lower", cmap="gray_r", extent=(0, 64, 0, 64)
        )
        axes.figure.colorbar(image, label="pressure over E*, 10⁻³")
        axes.set(xlabel="x (µm)", ylabel="y (µm)")


def test_friction_on_a_map(page):
    """Friction loops of a rough map alone on its half-space

    Compared with **a dense brute force** (`dense_contact.py`): every point of the map presses on
    every other one by Love's formula, and Coulomb's law holds at every point, in 48 and 96 small
    steps a move, extrapolated.

    The model ends where ν is above 0: normal and tangential fields then act on one another, and the
    page on full interaction says by how much.
    """

    def loops(surface, reach):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        solutions = hs.NormalSolutions.solve(surface, largest_approach=reach)
        rough = hs.Ensemble.from_solutions(pair, solutions, friction=0.2)
        state, found = rough.initial_state(), []
        for part, share in moves:  # of the approach, and of μ times it
            state = rough.advance(
                state, normal_displacement=part * reach, tangential_displacement=share * 0.2 * reach
            )
            found.append((state.normal_load, state.tangential_load, state.dissipated_energy))
        return np.array(found)

    heights = hs.random_surface(
        (28, 28), 48 / 28, 0.3, 14.0, seed=3, autocorrelation="gaussian"
    ).heights
    surface, reach = hs.Surface(heights, 48 / 28), 0.5 * heights.max()
    moves = [(1.0, 0.0), (1.0, 0.7), (1.0, -0.4), (0.6, -0.1), (0.8, 0.5), (0.8, -0.2), (0.8, 0.5)]
    found = page.shows(loops, surface, reach)
    brute = DenseContact(surface.heights, 48 / 28, reach)
    walked = [
        brute.history([(part * reach, share * 0.2 * reach) for part, share in moves], 0.2, parts)
        for parts in (24, 48)
    ]
    expected = np.array([
        (p.sum() * brute.cell, (2 * q2 - q1).sum() * brute.cell, 2 * e2 - e1)
        for (_, q1, e1), (p, q2, e2) in zip(*walked, strict=True)
    ])  # fmt: skip
    limit = 0.2 * expected[:, 0].max()
    page.row(
        "normal load, of E*", expected[:, 0], found[:, 0], 5e-3, "50 solved loads", of="the largest"
    )
    page.row(
        "tangential load, of E*",
        expected[:, 1],
        found[:, 1],
        5e-3,
        "steps, 50 solved loads",
        of="μN",
        scale=limit,
    )
    page.row(
        "energy lost, of E*",
        expected[:, 2],
        found[:, 2],
        1e-2,
        "steps, 50 solved loads",
        of="all of it",
    )

    @page.picture
    def draw(axes):
        axes.plot(found[:, 1] / limit, "-", label="found")
        axes.plot(expected[:, 1] / limit, "k.", label="brute force")
        axes.set(xlabel="move", ylabel="tangential load, of μN")
