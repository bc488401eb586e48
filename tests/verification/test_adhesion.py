"""Adhesive contacts of one asperity."""

import math

import numpy as np
from adhesive import PULL, UNLOADED, E, R, Springs, W, contact
from scipy.optimize import minimize, minimize_scalar


def test_jkr(page):
    """A tip that adheres, by Johnson, Kendall and Roberts

    Compared with **the least energy**: the elastic energy of a sphere pressed in by δ over a circle
    of radius a, less the energy of adhesion and the work of the load, is minimised over a and δ. K.
    L. Johnson, K. Kendall and A. D. Roberts, *Proc. R. Soc. A* 324 (1971) 301 give the pull-off,
    −3/2 πwR.

    The model ends where the replay begins: adhesion is not in the history of loads. A run says
    which theory its asperities would need.
    """

    def jkr():
        from historysim.contact import adhesion

        tip = {"summit_radius": 2e-6, "contact_modulus": 5e9, "work_of_adhesion": 0.08}
        pull_off = adhesion.jkr_pull_off_load(summit_radius=2e-6, work_of_adhesion=0.08)
        loads = np.linspace(-0.7e-6, 2e-6, 10)
        radius = adhesion.jkr_contact_radius(loads, **tip)
        return pull_off, loads, radius

    depth = UNLOADED**2 / R

    def least(load):
        """Contact radius at the least energy under a load."""

        def potential(state):
            a, approach = state[0] * UNLOADED, state[1] * depth
            elastic = E * (approach**2 * a - 2 * approach * a**3 / (3 * R) + a**5 / (5 * R**2))
            return (elastic - math.pi * W * a**2 - load * approach) / (PULL * depth)

        # near enough: a start too far out is over the barrier, and comes apart
        start = [1.5, 2.0] if load >= 0 else [0.85, 0.2]
        return (
            minimize(
                potential, start, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15}
            ).x[0]
            * UNLOADED
        )

    pull_off, loads, radius = page.shows(jkr)
    page.row("pull-off [N]", -1.5 * PULL, pull_off, 1e-14)
    expected = np.array([least(load) for load in loads])
    page.row("contact radius [m]", expected, radius, 1e-6, "minimiser, √ε")

    @page.picture
    def draw(axes):
        axes.plot(1e6 * loads, 1e9 * radius, label="JKR")
        axes.plot(1e6 * loads, 1e9 * expected, "k.", label="least energy")
        axes.set(xlabel="normal load (µN)", ylabel="contact radius (nm)")


def test_dmt(page):
    """A stiff tip that adheres, by Derjaguin, Muller and Toporov

    Compared with **Hertz under a greater load**, N + 2πwR: the attraction acts outside the contact
    and leaves its shape alone (*J. Colloid Interface Sci.* 53, 1975, 314).

    The model ends where the attraction bends the surfaces: then Maugis' theory is between this one
    and JKR.
    """

    def dmt():
        from historysim.contact import adhesion

        tip = {"summit_radius": 2e-6, "contact_modulus": 5e9, "work_of_adhesion": 0.08}
        loads = np.linspace(-1.0e-6, 2e-6, 40)
        radius = adhesion.dmt_contact_radius(loads, **tip)
        pull_off = adhesion.dmt_pull_off_load(summit_radius=2e-6, work_of_adhesion=0.08)
        return loads, radius, pull_off

    loads, radius, pull_off = page.shows(dmt)
    expected = np.cbrt(0.75 * R * (loads + 2 * PULL) / E)
    page.row("contact radius [m]", expected, radius, 1e-14)
    page.row("pull-off [N]", -2 * PULL, pull_off, 1e-14)

    @page.picture
    def draw(axes):
        hertz = np.cbrt(0.75 * R * np.maximum(loads, 0) / E)
        axes.plot(1e6 * loads, 1e9 * radius, label="DMT")
        axes.plot(1e6 * loads, 1e9 * hertz, "0.6", label="Hertz")
        axes.plot(1e6 * loads[::5], 1e9 * expected[::5], "k.")
        axes.set(xlabel="normal load (µN)", ylabel="contact radius (nm)")


def test_maugis(page):
    """The map between DMT and JKR

    Compared with **a row of springs** with a constant attraction out to the edge of the zone
    (`adhesive.py`), solved by quadrature and bisection without Maugis' equations, over four decades
    of his parameter λ. Its least load is sought by a minimiser.

    The model ends where the attraction is not constant out to an edge (Dugdale's law): a real one
    falls with the gap, and the pull-off of the same work differs by some per cent near λ = 1.
    """

    def maugis(contacts):
        from historysim.contact import adhesion

        pull_off = [adhesion.maugis_pull_off_load(**each) for each in contacts]
        radius = [adhesion.maugis_contact_radius(1e-6, **each) for each in contacts]
        return np.array(pull_off), np.array(radius)

    parameter = np.array([0.1, 0.3, 1.0, 3.0, 10.0])
    contacts = [contact(each) for each in parameter]
    pull_off, radius = page.shows(maugis, contacts)
    expected = [
        minimize_scalar(
            lambda share, own=own: Springs.of(share * UNLOADED, **own).load / PULL, bounds=(0.01, 1),
            options={"xatol": 1e-5},
        ).fun
        for own in contacts
    ]  # fmt: skip
    page.row("pull-off over πwR", expected, pull_off / PULL, 1e-9, "minimiser, (1e-5)² in a")
    loads = [Springs.of(a, **own).load for a, own in zip(radius, contacts, strict=True)]
    page.row("load of the springs at the radius under 1 µN [N]", 1e-6, loads, 1e-8, "quadrature")

    @page.picture
    def draw(axes):
        axes.axhline(2, color="0.7")
        axes.axhline(1.5, color="0.7")
        axes.semilogx(parameter, -pull_off / PULL, label="found")
        axes.semilogx(parameter, -np.array(expected), "k.", label="springs")
        axes.set(xlabel="Maugis' λ", ylabel="pull-off over πwR (grey: limits)")


def test_in_a_run(page):
    """Which theory the asperities of a run would need

    Compared with **Tabor's parameter** by hand, μ_T = (R w²/(E*² z₀³))^(1/3), and Maugis' λ = 1.16
    μ_T.

    The model ends where the map of Johnson and Greenwood does: water and oil between the surfaces,
    and roughness upon the summits, weaken adhesion.
    """

    def tabor():
        from historysim.contact import adhesion

        tip = {"contact_modulus": 5e9, "work_of_adhesion": 0.08, "equilibrium_separation": 0.3e-9}
        radii = np.array([1e-7, 1e-6, 1e-5, 1e-3])
        found = adhesion.tabor_parameter(summit_radius=radii, **tip)
        lam = adhesion.maugis_parameter(summit_radius=radii, **tip)
        return radii, found, lam

    radii, found, lam = page.shows(tabor)
    expected = np.cbrt(radii * 0.08**2 / (5e9**2 * (0.3e-9) ** 3))
    page.row("Tabor's parameter", expected, found, 1e-14)
    page.row("Maugis' λ", 1.1570 * expected, lam, 2e-4, "1.157, printed digits")

    @page.picture
    def draw(axes):
        axes.loglog(1e6 * radii, found, "-o", ms=3, label="Tabor")
        axes.loglog(1e6 * radii, lam, "-s", ms=3, label="Maugis")
        axes.axhspan(0.1, 5, color="0.9")
        axes.set(xlabel="summit radius (µm)", ylabel="parameter (grey: Maugis)")
