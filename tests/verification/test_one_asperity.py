"""One asperity: Hertz, Cattaneo, Mindlin and Deresiewicz."""

import math

import numpy as np
from rings import Rings
from scipy.integrate import quad
from scipy.optimize import brentq

import historysim as hs

# Table B.1 of the thesis: silicon on float glass
MODULUS = 1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)
SHEAR = 1 / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9)
RADIUS, LOAD, MU = 2.5e-3, 50e-3, 0.2
CONTACT_RADIUS = (0.75 * LOAD * RADIUS / MODULUS) ** (1 / 3)
LIMIT = MU * LOAD
FULL = 3 * LIMIT / (16 * CONTACT_RADIUS * SHEAR)


def virgin(displacement, limit=LIMIT, full=FULL):
    """Load of a contact that is displaced for the first time (Mindlin 1949)."""
    return limit * (1 - (1 - np.minimum(displacement / full, 1)) ** 1.5)


def test_hertz(page):
    """A ball is pressed on a flat

    Compared with **the closed form of Hertz** (K. L. Johnson, *Contact Mechanics*, 1985, equations
    4.22 to 4.24), with the moduli of silicon and float glass from Table B.1 of the thesis.

    The model ends where the contact is no longer small compared with the ball, where the materials
    yield, and where they adhere. Each run looks at all three.
    """

    def hertz():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        loads = [1e-3, 10e-3, 50e-3, 200e-3]
        states = [ball.advance(ball.initial_state(), normal_load=load) for load in loads]
        contacts = [ball.asperity(0, state) for state in states]
        return np.array(loads), contacts

    loads, contacts = page.shows(hertz)
    radius = (0.75 * loads * RADIUS / MODULUS) ** (1 / 3)
    page.row(
        "contact radius at 200 mN [m]", radius, [each.contact_radius for each in contacts], 1e-14
    )
    page.row("approach [m]", radius**2 / RADIUS, [each.approach for each in contacts], 1e-14)
    peak = 1.5 * loads / (np.pi * radius**2)
    page.row("pressure in the middle [Pa]", peak, [each.pressure(0.0) for each in contacts], 1e-14)

    @page.picture
    def draw(axes):
        r = np.linspace(0, 1.2 * radius[-1], 200)
        for load, each in zip(loads, contacts, strict=True):
            axes.plot(1e6 * r, 1e-6 * each.pressure(r), label=f"{1e3 * load:g} mN")
        axes.set(xlabel="distance from the middle (µm)", ylabel="pressure (MPa)")


def test_cattaneo_mindlin(page):
    """A ball is displaced along the flat

    Compared with **the closed forms of Cattaneo (1938) and Mindlin (1949)** for virgin loading, and
    of Mindlin and Deresiewicz (1953) for the energy of a closed loop.

    The model ends where ν of unlike materials couples normal and tangential displacements (Dundurs'
    β is taken as 0): that is a few per cent of the slip annulus for silicon on glass.
    """

    def loop():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        turns = [0.0, 8e-3, -8e-3, 8e-3]  # N; the limit is 10 mN
        events = [hs.NormalLoad(-1.0, 50e-3)]
        events += [hs.TangentialLoad(float(k), turn) for k, turn in enumerate(turns)]
        history = hs.replay(ball, events, substeps=20)
        return history

    history = page.shows(loop)
    first = history.isel(step=(history.time >= 0) & (history.time <= 1))
    load = first.total_tangential_load.values
    displacement = FULL * (1 - (1 - load / LIMIT) ** (2 / 3))
    page.row("displacement at 8 mN [m]", displacement, first.tangential_displacement.values, 1e-13)
    stick = CONTACT_RADIUS * np.cbrt(1 - load / LIMIT)
    page.row("stick radius [m]", stick, first.stick_radius.values[:, 0], 1e-13)
    f = 0.8
    energy = 9 * LIMIT**2 / (10 * CONTACT_RADIUS * SHEAR)
    energy *= 1 - (1 - f) ** (5 / 3) - 5 * f / 6 * (1 + (1 - f) ** (2 / 3))
    # the energies at the ends of a loop differ by it
    at = [
        float(history.total_dissipated_energy.sel(step=history.time == t).values[-1])
        for t in (1.0, 3.0)
    ]
    page.row("energy of the loop [J]", energy, at[1] - at[0], 1e-12)

    @page.picture
    def draw(axes):
        axes.plot(
            1e9 * history.tangential_displacement,
            1e3 * history.total_tangential_load,
            label="found",
        )
        axes.plot(1e9 * displacement[::4], 1e3 * load[::4], "k.", label="Mindlin")
        axes.set(xlabel="displacement (nm)", ylabel="tangential load (mN)")


def test_tractions(page):
    """Tractions after two reversals

    Compared with **the sum of Hertzian ellipses** that Mindlin and Deresiewicz (1953) print for a
    contact that is loaded, unloaded and loaded again.

    The model ends where a spherical cap is no good picture of the summit. Tractions across the
    motion, which a Poisson's ratio above 0 brings near the edge, are left out.
    """

    def tractions():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        state = ball.advance(ball.initial_state(), normal_load=50e-3)
        for load in (9e-3, -4e-3, 2e-3):
            state = ball.advance(state, tangential_load=load)
        asperity = ball.asperity(0, state)
        return asperity

    asperity = page.shows(tractions)
    turns = np.array([9e-3, -4e-3, 2e-3])
    # each turn changes the load by twice that of the ellipse that slips back
    spans = np.cbrt(
        1 - np.array([turns[0] / 1, (turns[0] - turns[1]) / 2, (turns[2] - turns[1]) / 2]) / LIMIT
    )
    r = np.linspace(0, 0.999, 400) * CONTACT_RADIUS

    def ellipse(radius):
        return 1.5 * LIMIT / (np.pi * CONTACT_RADIUS**3) * np.sqrt(np.maximum(radius**2 - r**2, 0))

    first, second, third = (ellipse(share * CONTACT_RADIUS) for share in spans)
    printed = ellipse(CONTACT_RADIUS) - first - 2 * (ellipse(CONTACT_RADIUS) - second)
    printed += 2 * (ellipse(CONTACT_RADIUS) - third)
    peak = MU * 1.5 * LOAD / (np.pi * CONTACT_RADIUS**2)
    # near an edge of slip a rounding of its radius is its square root in the ellipse
    page.row(
        "traction [Pa]",
        printed,
        asperity.traction(r),
        1e-7,
        "√rounding at an edge",
        of="μp₀",
        scale=peak,
    )
    carried = quad(
        lambda x: 2 * np.pi * x * float(asperity.traction(x)), 0, CONTACT_RADIUS, limit=400
    )[0]
    page.row(
        "their integral [N]", 2e-3, carried, 1e-5, "quadrature over kinks", of="μN", scale=LIMIT
    )

    @page.picture
    def draw(axes):
        axes.plot(1e6 * r, 1e-6 * asperity.traction(r), label="found")
        axes.plot(1e6 * r[::20], 1e-6 * printed[::20], "k.", label="printed")
        bound = 1e-6 * MU * asperity.pressure(r)
        axes.fill_between(1e6 * r, -bound, bound, color="0.9", label="±μp")
        axes.set(xlabel="distance from the middle (µm)", ylabel="traction (MPa)")


PATHS = {
    # normal and tangential load at the end, of those at the start; what comes before: virgin,
    # unloading, reloading
    "T rises": ("virgin", 1.0, 0.75),
    "T falls": ("unloading", 1.0, -0.2),
    "T rises again": ("reloading", 1.0, 0.3),
    "N and T rise, slip": ("virgin", 1.2, 0.8),
    "N and T rise, stick": ("virgin", 1.5, 0.6),
    "N rises, T falls, slip": ("unloading", 1.1, 0.0),
    "N rises, T falls, stick": ("unloading", 1.4, 0.4),
    "N rises, T rises again": ("reloading", 1.1, 0.3),
    "N falls, T rises": ("virgin", 0.8, 0.7),
    "N and T fall": ("unloading", 0.8, 0.0),
    "N falls, T rises again": ("reloading", 0.8, 0.2),
}
# Tangential loads [μN at the start] before the path: a virgin one, on the way down, on the way up.
START = {"virgin": (0.5,), "unloading": (0.6, 0.5), "reloading": (0.6, -0.3, -0.1)}


def compliance_along(kind, normal, tangential):
    """Displacement along a path by the compliances that Mindlin and Deresiewicz (1953) give for each kind of path."""
    *turns, start = START[kind]
    n0, n1, t0, t1 = LOAD, normal * LOAD, start * LIMIT, tangential * LIMIT
    slope = (n1 - n0) / (t1 - t0)
    side = 1 if kind != "unloading" else -1

    def compliance(t):
        n = n0 + slope * (t - t0)
        a = (0.75 * n * RADIUS / MODULUS) ** (1 / 3)
        if side * MU * slope >= 1:
            return 1 / (8 * SHEAR * a)
        # the turn moves with the limit
        since = t if kind == "virgin" else (side * (t - turns[-1] * LIMIT) + MU * (n - n0)) / 2
        used = since / (MU * n)
        return (side * MU * slope + (1 - side * MU * slope) / np.cbrt(1 - used)) / (8 * SHEAR * a)

    return quad(compliance, t0, t1, epsabs=0, epsrel=1e-12)[0]


def test_eleven_paths(page):
    """The eleven paths of Mindlin and Deresiewicz

    Compared with **the tangential compliances of Mindlin and Deresiewicz** (*J. Appl. Mech.* 20,
    1953, 327) for each kind of straight path, integrated by quadrature: normal loads that stay,
    rise or fall, tangential ones that rise, fall or rise again, with slip or without.

    The model ends where a path is not straight between two events: then more events are needed.
    """

    def eleven(paths, start):
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        found = {}
        for name, (before, normal, tangential) in paths.items():
            state = ball.advance(ball.initial_state(), normal_load=50e-3)
            for load in start[before]:  # of μN
                state = ball.advance(state, tangential_load=load * 10e-3)
            end = ball.advance(
                state, normal_load=normal * 50e-3, tangential_load=tangential * 10e-3
            )
            found[name] = end.tangential_displacement - state.tangential_displacement
        return found

    found = page.shows(eleven, PATHS, START)
    for name, path in PATHS.items():
        page.row(f"{name} [m]", compliance_along(*path), found[name], 1e-10, "quadrature")

    @page.picture
    def draw(axes):
        for before, normal, tangential in PATHS.values():
            start = START[before][-1]
            axes.annotate(
                "", (normal, tangential), (1, start), arrowprops={"arrowstyle": "->", "lw": 1}
            )
            axes.plot(1, start, "k.", ms=3)
        axes.plot([0.7, 1.1], [0.7, 1.1], "0.6")
        axes.set(
            xlim=(0.7, 1.6),
            ylim=(-0.5, 1.1),
            xlabel="N over N at the start",
            ylabel="T over μN at the start",
        )


def test_nested_reversals(page):
    """Loops within loops

    Compared with **Masing's rule**: after a turn the virgin curve of twice the size is followed,
    and a closed loop is forgotten, so that T comes back to the bit.

    The model ends where the coefficient of friction or the normal load changes on the way: then the
    memory itself is asked, as in the cases below.
    """

    def nested():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        events = [hs.NormalLoad(-1.0, 50e-3)]
        turns = np.array([0, 20, -10, 12, -4, 6, 0, 6, -4, 12, -10, 20]) * 1e-9
        events += [hs.TangentialDisplacement(float(k), turn) for k, turn in enumerate(turns)]
        history = hs.replay(ball, events, substeps=10)
        return turns, history

    turns, history = page.shows(nested)
    load, place = history.total_tangential_load.values, history.tangential_displacement.values
    at = [int(np.flatnonzero(history.time == k)[-1]) for k in range(turns.size)]
    expected = np.zeros(turns.size)
    expected[1] = virgin(turns[1])
    for k in range(2, 7):
        way = turns[k] - turns[k - 1]
        expected[k] = expected[k - 1] + math.copysign(2 * virgin(abs(way) / 2), way)
    page.row(
        "loads where it turns inward [N]", expected[1:7], load[at][1:7], 1e-14, of="μN", scale=LIMIT
    )
    page.row(
        "loads on the way out [N]", load[at][[5, 4, 3, 2, 1]], load[at][7:12], 0.0, "the same bits"
    )

    @page.picture
    def draw(axes):
        axes.plot(1e9 * place, 1e3 * load)
        axes.plot(1e9 * turns[1:7], 1e3 * expected[1:7], "k.", label="Masing")
        axes.set(xlabel="displacement (nm)", ylabel="tangential load (mN)")


def test_behind_a_spring(page):
    """A contact behind the spring of an instrument

    Compared with **the root of drive = U(T) + T/k**, with Mindlin's U of virgin loading, found by
    bisection.

    The model ends where the drive is not met between two events: there the path is straight in the
    displacement of the contact. More events, or substeps, make it as fine as wanted.
    """

    def driven():
        pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=2.5e-3, friction=0.2)
        drives = np.arange(1, 7) * 5e-9
        events = [hs.NormalLoad(0.0, 50e-3)]
        events += [
            hs.TangentialDisplacement(1.0 + k, float(drive)) for k, drive in enumerate(drives)
        ]
        history = hs.replay(ball, events, instrument=hs.Instrument(lateral_stiffness=5e5))
        return drives, history

    drives, history = page.shows(driven)
    expected = [
        brentq(lambda u, d=d: u + virgin(u) / 5e5 - d, 0, d, xtol=1e-22, rtol=1e-14) for d in drives
    ]
    found = history.tangential_displacement.values[-drives.size :]
    page.row("displacement of the contact [m]", expected, found, 1e-12)
    page.row(
        "tangential load [N]",
        virgin(np.array(expected)),
        history.total_tangential_load.values[-drives.size :],
        1e-12,
    )

    @page.picture
    def draw(axes):
        axes.plot(1e9 * drives, 1e9 * found, label="found")
        axes.plot(1e9 * drives, 1e9 * np.array(expected), "k.", label="root")
        axes.set(xlabel="drive (nm)", ylabel="displacement of the contact (nm)")


def test_fall_of_friction(page):
    """Friction falls under a load

    Compared with **300 rings under Coulomb's law** (`rings.py`), which find the minimum of
    complementary energy. In virgin loading the springs of the memory are exact. After reversals a
    fall may leave tractions beyond the limit inside the contact, and the result says how far
    (`largest_traction_ratio`).

    The model ends where that ratio is large, as in the last row: there the ratio is 1.94.
    """

    def falls(paths):
        pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
        ball = hs.Ensemble(pair, summit_height=0.0, summit_radius=1.0, friction=0.5)
        found = []
        for turns, factor in paths.values():
            state = ball.advance(ball.initial_state(), normal_displacement=1.0)
            for turn in turns:
                state = ball.advance(state, tangential_load=turn * 0.5 * 4 / 3)  # of μN
            state = ball.advance(state, tangential_displacement=state.tangential_displacement)
            found.append(ball.advance(state, friction=0.5 * factor))  # the displacement is held
        return ball, found

    paths = {
        "virgin": ((0.6,), 0.7),
        "after a reversal": ((0.9, -0.3), 0.7),
        "after three, a deep fall": ((0.95, -0.4, 0.7, 0.3), 0.3),
    }
    ball, found = page.shows(falls, paths)
    expected = []
    for turns, factor in paths.values():
        rings = Rings(0.5)
        for turn in turns:
            rings.to(load=turn * 2 / 3)
        expected.append(rings.to(friction=0.5 * factor))
    for (name, (_, factor)), state, rings in zip(paths.items(), found, expected, strict=True):
        bound, why = (
            (2e-5, "300 rings: 1/n²") if "deep" not in name else (0.04, "known: the model ends")
        )
        limit = factor * 2 / 3
        page.row(
            f"T, {name} [N]",
            rings.tangential_load,
            state.tangential_load,
            bound,
            why,
            of="μN",
            scale=limit,
        )

    @page.picture
    def draw(axes):
        r = np.linspace(0, 1, 300)
        for name, state, rings, colour in zip(
            paths, found, expected, ("C0", "C1", "C2"), strict=True
        ):
            axes.plot(r, ball.asperity(0, state).traction(r), colour, label=name)
            edges = np.sqrt(np.cumsum(rings.area) / np.pi)
            axes.plot(edges[::12], rings.traction[::12], ".", color=colour, ms=3)
        axes.set(xlabel="distance from the middle, of a", ylabel="traction, of E* (dots: rings)")
        axes.legend(fontsize=6)
