"""Many asperities under one flat."""

import math
from pathlib import Path

import numpy as np
from hertz_sums import SOFT, approaches, displacement
from scipy.integrate import quad
from scipy.stats import norm

import historysim as hs

FOLDER = Path(__file__).parents[2] / "data"


def test_greenwood_williamson(page):
    """Greenwood and Williamson's surface

    Compared with **Hertz over Gaussian heights by quadrature**, as J. A. Greenwood and J. B. P.
    Williamson (*Proc. R. Soc. A* 295, 1966, 300) write their integrals.

    The model ends where summits press on one another, at areas above a few per cent of the nominal
    one, and where their radii differ with their heights.
    """

    def greenwood_williamson():
        # E*, R, σ, density, A₀
        steel = hs.theory.GreenwoodWilliamson(115e9, 8e-6, 0.6e-6, 2e10, 1e-6)
        separation = np.array([0.5, 1.0, 2.0, 3.0]) * 0.6e-6
        load, area = steel.normal_load(separation), steel.contact_area(separation)
        return separation, load, area

    def integral(function, d):
        return 2e10 * 1e-6 * quad(
            lambda z: function(z - d) * norm.pdf(z, 0, 0.6e-6), d, d + 6e-6, points=[d + 2e-7, d + 1e-6],
            epsabs=0, epsrel=1e-11, limit=400,
        )[0]  # fmt: skip

    separation, load, area = page.shows(greenwood_williamson)
    loads = [
        integral(lambda depth: 4 / 3 * 115e9 * math.sqrt(8e-6) * depth**1.5, d) for d in separation
    ]
    areas = [integral(lambda depth: math.pi * 8e-6 * depth, d) for d in separation]
    page.row("load [N]", loads, load, 1e-9, "quadrature")
    page.row("area [m²]", areas, area, 1e-9, "quadrature")

    @page.picture
    def draw(axes):
        axes.loglog(load, area, label="found")
        axes.loglog(loads, areas, "k.", label="quadrature")
        axes.set(xlabel="normal load (N)", ylabel="real area (m²)")


def test_ensemble_of_drawn_summits(page):
    """An ensemble of drawn summits

    Compared with **Greenwood and Williamson's integrals**: ten ensembles of 2000 summits each,
    drawn with the seeds 0 to 9, under the load of the integral at a separation of one deviation.
    The bound is four standard errors of the mean.

    The model ends where the statistics do: one surface has one set of summits, and its highest few
    decide at low loads.
    """

    def drawn():
        pair = hs.MaterialPair.from_moduli(contact_modulus=115e9, shear_modulus=30e9)
        areas = []
        for seed in range(10):
            height = np.random.default_rng(seed).normal(0.0, 0.6e-6, 2000)
            rough = hs.Ensemble(pair, height, summit_radius=8e-6, friction=0.2)
            state = rough.advance(rough.initial_state(), normal_load=expected_load)
            areas.append(np.pi * 8e-6 * np.maximum(state.approach - height.max() + height, 0).sum())
        return np.array(areas)

    integral = hs.theory.GreenwoodWilliamson(115e9, 8e-6, 0.6e-6, 2000, 1.0)
    expected_load = float(integral.normal_load(0.6e-6))
    areas = page.shows(drawn)
    bound = 4 * areas.std(ddof=1) / math.sqrt(10) / areas.mean()
    page.row(
        "mean real area [m²]",
        float(integral.contact_area(0.6e-6)),
        areas.mean(),
        bound,
        "4 standard errors",
    )

    @page.picture
    def draw(axes):
        axes.plot(range(10), 1e12 * areas, "o", ms=3, label="ensembles")
        axes.axhline(1e12 * float(integral.contact_area(0.6e-6)), color="k", label="integral")
        axes.set(xlabel="seed", ylabel="real area (µm²)")


def test_preliminary_displacement(page):
    """Preliminary displacement and the critical asperity

    Compared with **Hertz's law for each summit, by bisection** on the total load, and Mindlin's θμδ
    of each (`hertz_sums.py`), for the 200 summits of `data/summits_200.csv`.

    The model ends where the body turns or bends: all summits share one displacement.
    """

    def preliminary(summits):
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        rough = hs.Ensemble(pair, summits["height"], summits["radius"], friction=0.2)
        events = [hs.NormalLoad(0.0, 70e-3), hs.TangentialDisplacement(1.0, 100e-9)]
        history = hs.replay(rough, events, substeps=400, record="all")
        slides = history.contact.slides_first()
        return rough, history, slides

    table = np.genfromtxt(FOLDER / "summits_200.csv", delimiter=",", names=True, comments="#")
    names = table.dtype.names
    height = table[next(name for name in names if "height" in name)]
    radius = table[next(name for name in names if "radius" in name)]
    factor_height, factor_radius = (10.0 ** -(9 if "nm" in text else 6) for text in (
        next(name for name in names if "height" in name), next(name for name in names if "radius" in name)
    ))  # fmt: skip
    summits = {"height": height * factor_height, "radius": radius * factor_radius}
    rough, history, slides = page.shows(preliminary, summits)
    depth = approaches(70e-3, summits["height"], summits["radius"], SOFT[0])
    full = displacement(70e-3, summits["height"], summits["radius"], 0.2, SOFT)
    last = history.isel(step=-1)
    found = rough.advance(rough.initial_state(), normal_load=70e-3)
    each = [rough.asperity(i, found).preliminary_displacement for i in range(len(rough))]
    own = SOFT[0] / (4 * SOFT[1]) * 0.2 * depth
    page.row("approach of the highest summit [m]", depth.max(), found.approach, 1e-12)
    page.row("preliminary displacement of the surface [m]", full, max(each), 1e-12)
    page.row("of each asperity [m]", own, each, 1e-12, of="the largest")
    order = np.argsort(own[depth > 0])
    critical = int(np.flatnonzero(depth > 0)[order[-1]])
    page.row(
        "number of the critical asperity",
        critical,
        int(np.ravel(slides)[-1]),
        0.0,
        "a whole number",
        scale=1,
    )
    page.row(
        "asperities that touch",
        (depth > 0).sum(),
        int((last.contact_radius > 0).sum()),
        0.0,
        "a whole number",
        scale=1,
    )

    @page.picture
    def draw(axes):
        axes.plot(1e9 * history.tangential_displacement, 1e3 * history.total_tangential_load)
        axes.axvline(1e9 * full, color="0.6")
        axes.set(xlabel="displacement (nm)", ylabel="tangential load (mN); grey: θμδ")


def test_random_surface(page):
    """A random surface, and its summits

    Compared with **Nayak's density of summits** (*J. Lubr. Technol.* 93, 1971, 398), m₄/(6√3 π m₂),
    and the moments of the prescribed autocorrelation exp(−2.3 r²/β²). The bound is four standard
    errors over eight seeds, and the step of the grid.

    The model ends where heights are not Gaussian.
    """

    def surfaces():
        maps = [
            hs.random_surface((512, 512), 1e-6, 50e-9, 30e-6, seed=seed, autocorrelation="gaussian")
            for seed in range(8)
        ]
        statistics = [each.statistics() for each in maps]
        density = np.array([len(each.summits(9).height) / each.nominal_area for each in maps])
        slope = np.array([math.sqrt(2 * each.moments.m2) for each in statistics])
        return density, slope, maps[0]

    density, slope, first = page.shows(surfaces)
    m2, m4 = 2 * 2.3 / 30e-6**2 * 50e-9**2, 12 * 2.3**2 / 30e-6**4 * 50e-9**2
    for name, expected, found, grid in (
        ("rms slope", math.sqrt(2 * m2), slope, 5e-3),
        ("summits per area [1/m²]", m4 / m2 / (6 * math.sqrt(3) * math.pi), density, 0.015),
    ):
        bound = 4 * found.std(ddof=1) / math.sqrt(8) / found.mean() + grid
        page.row(name, expected, found.mean(), bound, "4 standard errors, and the grid")

    @page.picture
    def draw(axes):
        image = axes.imshow(
            1e9 * first.heights[:128, :128].T, origin="lower", extent=(0, 128, 0, 128), cmap="gray"
        )
        axes.figure.colorbar(image, label="height (nm)")
        axes.set(xlabel="x (µm)", ylabel="y (µm)")
