"""Asperities that yield, wear and change their friction."""

import numpy as np
from evolving_springs import EvolvingSprings
from yielding_springs import YieldingSprings

import historysim as hs

MODULUS, SHEAR, HARDNESS, RATIO, MU = 43e9, 9.227e9, 5.5e9, 0.25, 0.2


def test_yielding_laws(page):
    """First loading of a summit that yields

    Compared with **the printed laws**: L. Kogut and I. Etsion (*J. Appl. Mech.* 69, 2002, 657),
    1.40 x^1.263 and 0.94 x^1.146 for x = δ/δ_c from 6 to 110, and C. Thornton (*J. Appl. Mech.* 64,
    1997, 383), straight in x.

    The model ends where a summit flows as a whole: beyond x = 110 the mean pressure is the
    hardness.
    """

    def first_loading(x):
        pair = hs.MaterialPair.from_moduli(
            contact_modulus=43e9, shear_modulus=9.227e9, hardness=5.5e9
        )
        found = {}
        for law in (
            hs.yielding.KogutEtsion(poissons_ratio=0.25),
            hs.yielding.Thornton(poissons_ratio=0.25),
        ):
            known = law.of(pair)
            critical = known.critical_approach(np.array([1e-6]), pair)[0]
            loads, radii = known.first_loading(x * critical, np.full(x.size, 1e-6), pair)
            at_onset = 4 / 3 * 43e9 * np.sqrt(1e-6) * critical**1.5
            found[law.kind] = loads / at_onset, radii**2 / (1e-6 * critical)
        return found

    x = np.array([8.0, 12.0, 25.0, 50.0, 90.0])
    found = page.shows(first_loading, x)
    page.row(
        "load, Kogut and Etsion", 1.40 * x**1.263, found["kogut-etsion"][0], 1e-10, of="at onset"
    )
    page.row(
        "area, Kogut and Etsion", 0.94 * x**1.146, found["kogut-etsion"][1], 1e-10, of="at onset"
    )
    page.row("load, Thornton", 1 + 1.5 * (x - 1), found["thornton"][0], 1e-10, of="at onset")

    @page.picture
    def draw(axes):
        axes.loglog(x, found["kogut-etsion"][0], label="Kogut and Etsion")
        axes.loglog(x, found["thornton"][0], label="Thornton")
        axes.loglog(x, 1.40 * x**1.263, "k.", x, 1 + 1.5 * (x - 1), "k.")
        axes.loglog(x, x**1.5, "0.6", label="Hertz")
        axes.set(xlabel="approach over that at onset", ylabel="load over that at onset")


def test_yielding_history(page):
    """A history in which summits yield

    Compared with **springs in 1000 small steps** a move (`yielding_springs.py`) under three summits
    that yield by Kogut and Etsion's law, on and on, with tractions in all.

    The model ends where friction itself makes a summit yield: the laws are for loads along the
    normal.
    """

    def yields(height, radius, moves):
        pair = hs.MaterialPair.from_moduli(
            contact_modulus=43e9, shear_modulus=9.227e9, hardness=5.5e9
        )
        law = hs.yielding.KogutEtsion(poissons_ratio=0.25)
        rough = hs.Ensemble(pair, height, radius, friction=0.2, yielding=law)
        state, found = rough.initial_state(), []
        for approach, displacement in moves:
            state = rough.advance(
                state, normal_displacement=approach, tangential_displacement=displacement
            )
            found.append((state.normal_load, state.tangential_load, state.dissipated_energy))
        return np.array(found)

    height, radius = np.array([0.0, -20e-9, -50e-9]), np.array([1e-6, 1.5e-6, 0.7e-6])
    rng = np.random.default_rng(3)
    theta = MODULUS / (4 * SHEAR)
    depths = rng.uniform(0.1, 1, 8) * 150e-9 * np.arange(2, 10) / 9
    moves = np.column_stack([depths, theta * MU * rng.uniform(-1, 1, 8) * depths])
    found = page.shows(yields, height, radius, moves)
    springs = YieldingSprings(MODULUS, SHEAR, HARDNESS, RATIO, MU, height, radius, 180e-9, 1500)
    expected = []
    for approach, displacement in moves:
        springs.go(approach, displacement, 1000)
        expected.append(
            (springs.normal_loads().sum(), springs.tangential_loads.sum(), springs.dissipated.sum())
        )
    expected = np.array(expected)
    limit = MU * expected[:, 0].max()
    page.row("normal load [N]", expected[:, 0], found[:, 0], 1e-11, of="the largest")
    page.row(
        "tangential load [N]",
        expected[:, 1],
        found[:, 1],
        1e-3,
        "springs: first order",
        of="μN",
        scale=limit,
    )
    page.row(
        "energy lost by friction [J]",
        expected[:, 2],
        found[:, 2],
        4e-3,
        "springs: first order",
        of="all of it",
    )

    @page.picture
    def draw(axes):
        axes.plot(1e6 * found[:, 0], "-", label="N, found")
        axes.plot(1e6 * expected[:, 0], "k.", label="springs")
        axes.plot(1e6 * found[:, 1] / MU, "-", label="T/μ, found")
        axes.plot(1e6 * expected[:, 1] / MU, "k.")
        axes.set(xlabel="move", ylabel="load (µN)")
        axes.legend(fontsize=6)


def test_wear_volume(page):
    """Volume worn off by sliding

    Compared with **Archard's law by hand**, V = K N s/H (J. F. Archard, *J. Appl. Phys.* 24, 1953,
    981), under a constant load, with the distance s slid beyond the preliminary displacement.

    The model ends where debris stays in the contact. Volume that is lost in partial slip waits
    until the asperity slides.
    """

    def worn():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        wear = hs.wear.ArchardWear(coefficient=1e-6, hardness="6 GPa")
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2, wear=wear)
        events = [hs.NormalLoad(0.0, 50e-3), hs.TangentialDisplacement(1.0, 1e-6)]
        events += [hs.TangentialDisplacement(2.0, -1e-6), hs.TangentialDisplacement(3.0, 1e-6)]
        history = hs.replay(ball, events, substeps=20)
        return history

    history = page.shows(worn)
    slid = history.slid_distance.values[:, 0]
    volume = history.worn_volume.values[:, 0]
    page.row("volume [m³]", 1e-6 * 50e-3 * slid / 6e9, volume, 1e-10, of="the last")
    # a turn takes twice the preliminary displacement before the asperity slides back
    page.row("distance slid [m]", 5e-6 - 5 * FULL, slid[-1], 1e-5, "wear lowers the ball a little")

    @page.picture
    def draw(axes):
        axes.plot(1e6 * slid, 1e18 * volume, label="found")
        axes.plot(1e6 * slid[::6], 1e18 * 1e-6 * 50e-3 * slid[::6] / 6e9, "k.", label="Archard")
        axes.set(xlabel="distance slid (µm)", ylabel="worn volume (µm³)")


FULL = 3 * 0.2 * 50e-3 / (
    16
    * (0.75 * 50e-3 * 2.5e-3 * ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)) ** (1 / 3)
    / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9)
)  # fmt: skip


def test_friction_laws(page):
    """Friction that depends on load and on the distance slid

    Compared with **springs in small steps** (`evolving_springs.py`) whose coefficient follows the
    law step by step, for three asperities; two runs of 200 and 400 steps a move tell their error.

    The model ends where friction depends on time and speed: laws know loads, areas and distances.
    """

    def laws(moves):
        from historysim.asperities.laws import PowerLaw, SlidFriction

        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        shape = {"summit_height": [0.0, -0.012, -0.03], "summit_radius": [1.0, 0.7, 0.9]}
        found = []
        for law in (PowerLaw(0.4, 0.01, -0.3), SlidFriction([0.0, 0.05, 0.2], [0.5, 0.3, 0.4])):
            rough = hs.Ensemble(pair, **shape, friction=law, follow_sliding=True)
            state = rough.initial_state()
            for approach, displacement in moves:
                state = rough.advance(
                    state, normal_displacement=approach, tangential_displacement=displacement
                )
                found.append((state.tangential_load, state.dissipated_energy))
        return np.array(found)

    moves = [(0.06, 0.0), (0.06, 0.05), (0.08, 0.02), (0.05, 0.12), (0.05, -0.05), (0.07, 0.2)]
    found = page.shows(laws, moves)
    laws = (
        lambda n, _total, _r, _s: 0.4 * (np.maximum(n, 1e-30) / 0.01) ** -0.3,
        lambda _n, _total, _r, s: np.interp(s, [0.0, 0.05, 0.2], [0.5, 0.3, 0.4]),
    )
    coarse, fine = (
        np.concatenate([evolved(law, moves, steps) for law in laws]) for steps in (200, 400)
    )
    expected = 2 * fine - coarse
    error = 3 * np.abs(fine - coarse).max(axis=0) / np.abs(expected).max(axis=0)
    page.row(
        "tangential load [N]",
        expected[:, 0],
        found[:, 0],
        max(error[0], 2e-3),
        "springs: first order",
        of="the largest",
    )
    page.row(
        "energy lost [J]",
        expected[:, 1],
        found[:, 1],
        max(error[1], 2e-3),
        "springs: first order",
        of="all of it",
    )

    @page.picture
    def draw(axes):
        half = len(moves)
        for name, rows in (("power law", slice(0, half)), ("distance slid", slice(half, None))):
            axes.plot(found[rows, 0], label=name)
            axes.plot(expected[rows, 0], "k.")
        axes.set(xlabel="move", ylabel="tangential load (N)")


def evolved(law, moves, steps):
    row = EvolvingSprings(1.0, 0.25, [0.0, -0.012, -0.03], [1.0, 0.7, 0.9], law, 0.12)
    found = []
    for approach, displacement in moves:
        row.go(("displacement", approach), ("displacement", displacement), steps)
        found.append((row.tangential_loads.sum(), row.dissipated.sum()))
    return np.array(found)
