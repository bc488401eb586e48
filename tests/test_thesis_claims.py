"""Claims of the source that no figure tests by itself: each has a number, which the page of the thesis repeats."""

import numpy as np
from hertz_sums import HARD, SOFT, approaches, displacement
from pytest import approx, fixture, mark
from scipy import integrate
from thesis import FOLDER, NANO, calculated, listed, repeats, scenario, swept

import historysim as hs
from historysim.results import analysis
from historysim.results.steps import named_states

pytestmark = mark.ci

LOAD = "loading_waypoints_0_normal_load"


@fixture
def at_states(tmp_path):
    """The named states of the one run of a figure, by their names."""

    def run(name):
        with hs.run(scenario(name), tmp_path / f"{name}.nc") as history:
            history.load()
            return {state: history.isel(step=step) for state, step in named_states(history).items()}

    return run


def stored(load, tangential):
    """Energy of first loading of the ball of 2.5 mm [J], in springs along its contact radius (Jäger; Popov)."""
    modulus, shear = SOFT
    depth = (9 * load**2 / (16 * 2.5e-3 * modulus**2)) ** (1 / 3)
    limit = modulus / (4 * shear) * 2 * 0.2
    u = limit / 2 * depth * (1 - (1 - tangential / (0.2 * load)) ** (2 / 3))
    # a spring at x is pressed by d - x²/R
    energy, _ = integrate.quad(
        lambda x: min(u, limit / 2 * (depth - x**2 / 2.5e-3)) ** 2,
        0,
        np.sqrt(2.5e-3 * depth),
        points=[np.sqrt(2.5e-3 * (depth - 2 * u / limit))],
        epsrel=1e-12,
        epsabs=0,
    )
    return 4 * shear * energy


def test_what_falling_loads_do(at_states):
    rising, falling = at_states("fig_2_09"), at_states("fig_2_11")
    lost = [
        float(b.total_dissipated_energy - a.total_dissipated_energy)
        for a, b in ((rising["A"], rising["B"]), (falling["A"], falling["B"]))
    ]
    assert lost[0] == approx(0, abs=1e-9 * lost[1])
    # the work of T, less what springs of 8 G* dx store: (U, or θμ of their depth) squared
    store = [stored(load, 4e-3) for load in (50e-3, 30e-3)]
    moved = float(falling["B"].tangential_displacement - falling["A"].tangential_displacement)
    assert lost[1] == approx(4e-3 * moved + store[0] - store[1], rel=1e-6)
    repeats(
        "N falling during pre-sliding wears, N rising does not (2.4)",
        f"0 J where N rises from 50 to 70 mN, {lost[1] * 1e12:.2f} pJ where it falls to 30 at T = 4 mN",
    )
    before, after = (float(falling[state].tangential_displacement) * NANO for state in "AB")
    assert [before, after] == approx([4.5225, 5.788], abs=5e-4)
    repeats(
        "small changes of N or T shift the position (2.2.3.1)",
        f"at held T only N falling does: {before:.2f} → {after:.2f} nm from (50, 4) to (30, 4) mN",
    )


def test_one_ball():
    silica, silicon = swept("fig_4_01a").preliminary_displacement.values * NANO
    repeats(
        "silica displaces less because of its μ (4.2)",
        f"{silica:.2f} against {silicon:.2f} nm; reversed at equal μ",
    )
    loops = swept("fig_4_01b")
    first, *_, last = loops.preliminary_displacement.values * NANO
    repeats("4 to 11 nm from 10 to 70 mN (4.2)", f"{first:.2f} to {last:.2f} nm")
    constant = np.log(last / first) / np.log(7)
    law = swept("fig_4_07").preliminary_displacement.values[0]
    repeats(
        "δ ∝ N^(1/3) if μ ∝ N^(-1/3) (4.2)",
        f"power {np.log(law[-1] / law[0]) / np.log(9):.3f}; {constant:.3f} at constant μ (4.1 b)",
    )
    traction, _ = calculated("fig_4_08")
    power, adhering, coulomb = traction.greatest_traction.sel(ball="a  Si").values
    # friction over load varies as the traction of the law over that of constant μ
    area = 1 + np.log((adhering / coulomb)[-1] / (adhering / coulomb)[0]) / np.log(9)
    assert area == approx(0.519, abs=1e-3)
    repeats(
        "area with adhesion varies with the load much as Hertz's (4.2)",
        f"JKR N^{area:.3f} from 10 to 90 mN, Hertz N^.667",
    )
    repeats(
        "stress rises with the load (4.4.3); high at low load, then level (4.6)",
        f"F ∝ N^.7 {power[0] / 1e6:.2f} → {power[-1] / 1e6:.2f} MPa; JKR {adhering[0] / 1e6:.2f} → "
        f"{adhering[-1] / 1e6:.2f}: "
        "the two exclude each other",
    )
    pressure = float(swept("fig_4_07").peak_mean_pressure[0, -1]) / 1e6
    repeats("115 MPa at 90 mN (4.5.1)", f"{pressure:.1f}")
    instrument = swept("fig_4_04")
    contact = instrument.preliminary_displacement.values
    drive = contact + instrument.total_tangential_load.max("step").values / 334e3
    # the load of the spring varies as N, the contact as N^(2/3)
    ratios = 1 + np.outer(drive / contact - 1, (np.array([10, 90]) / 30) ** (1 / 3))
    assert [ratios.min(), ratios.max()] == approx([2.0, 3.3], abs=0.05)
    repeats(
        "measured displacement about twice theory (4.4)",
        f"{ratios.min():.1f} to {ratios.max():.1f} from 10 to 90 mN with 334 mN/µm in series",
    )
    secant = 0.12 * 10e-3 / (first / NANO) / 1e3
    repeats("767 mN/µm at 10 mN; mean 350 (4.4)", f"{1.5 * secant:.1f}; secant {secant:.0f}")


def test_a_ball_that_is_attracted():
    """2πRW and 4πRγ by hand; loads from outside, and T/N at sliding, from histories."""
    silicon = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    laws = {
        2 * np.pi * 2.5e-3 * 0.1213: hs.attraction.DMT(work_of_adhesion=0.1213),
        4 * np.pi * 2.5e-3 * 0.072: hs.attraction.Meniscus(
            surface_tension=0.072, contact_angles=(0.0, 0.0)
        ),
    }
    pulls, held = [], []
    for force, law in laws.items():
        ball = hs.Ensemble(silicon, 0.0, 2.5e-3, 0.12, attraction=law)
        loads = np.array([0.0, 10e-3, 30e-3, 50e-3, 70e-3, 90e-3])
        events = [hs.NormalLoad(float(time), load) for time, load in enumerate(loads.tolist())]
        history = hs.replay(ball, events)
        assert history.friction_limit.values == approx(0.12 * (loads + force), rel=1e-9)
        pulls.append(-1e3 * history.contact.pull_off().attrs["pull_off_load"])
        assert pulls[-1] == approx(1e3 * force, rel=1e-9)
        held.append(1e3 * float(history.friction_limit[0]))
        ratios = history.friction_limit.values[1:] / (0.12 * loads[1:])
        if law.kind == "dmt":
            listed_ratios = ", ".join(f"{ratio:.3f}" for ratio in ratios)
    repeats(
        "meniscus and atomic forces hold a ball when the load is gone (2.2)",
        f"pull-off of DMT {pulls[0]:.3f}, of water {pulls[1]:.3f} mN; T up to {held[0]:.3f}, {held[1]:.3f} mN at N = 0",
    )
    repeats(
        "friction is high at low load, then level: adhesion (4.6)",
        f"T/N at sliding {listed_ratios} μ at 10 to 90 mN",
    )


def test_rough_surfaces_that_no_figure_shows():
    found, functions = calculated("claims_on_rough")
    heading, *rows = functions["rows"](found)
    table = {name: dict(zip(heading[1:], values, strict=True)) for name, *values in rows}
    # one surface by bisection, and what JKR would pull with
    one = hs.random_surface((256, 256), 1e-6, 0.1e-6, 20e-6, seed=3).summits(rule=9)
    depth = [approaches(load, one.height, one.radius, SOFT[0]) for load in found.normal_load.values]
    cell = found.sel(rms_height=0.1e-6).isel(seed=2)
    assert cell.contact_area.values == approx(
        [np.pi * (one.radius * each).sum() for each in depth], rel=1e-6
    )
    ratio = SOFT[0] / (4 * SOFT[1])
    assert cell.preliminary_displacement.values == approx(
        [0.2 * ratio * each.max() for each in depth], rel=1e-6
    )
    pull = 1.5 * np.pi * 2 * np.sqrt(44.1e-3 * 83.4e-3) * one.radius[depth[1] > 0].sum()
    assert float(cell.adhesion) == approx(pull / 50e-3, rel=1e-6)
    area, friction = (
        table["power of the area over the load, 10 to 90 mN"],
        table["change of μ from 50 to 90 mN"],
    )
    assert all(0.9 < float(each) < 1 for each in area.values())
    repeats(
        "the contact area is proportional to the load, hence a constant μ (2.3, 4.4.1, 5.5.1)",
        f"power {area['24 nm']} at 24 nm, {area['0.1 µm']} at .1 µm, {area['1 µm']} at 1 µm; with a constant shear "
        "strength "
        f"μ changes by {friction['24 nm']} from 50 to 90 mN at 24 nm",
    )
    share, ball = (
        table["adhesion over the load"],
        1.5 * np.pi * 2 * np.sqrt(44.1e-3 * 83.4e-3) * 2.5e-3,
    )
    repeats(
        "adhesion negligible on rough contacts (2.2.2, 7)",
        f"pull-off of all contacts {share['1 µm']} of 50 mN at 1 µm, {share['0.1 µm']} at .1 µm, {share['24 nm']} at "
        "24 nm; "
        f"one ball {100 * ball / 10e-3:.0f} % at 10 mN, {100 * ball / 90e-3:.1f} % at 90",
    )
    more = table["change of δ with 10 % more load"]
    repeats(
        "load matters more than friction (6.2.1, 7)",
        f"10 % of N moves δ by {more['24 nm']} (24 nm), {more['1 µm']} (1 µm), {100 * (1.1 ** (2 / 3) - 1):.1f} % (one "
        "ball); 10 % of μ by 10 %. True only of the ranges drawn",
    )
    spread = [[row[name] for row in map(table.get, sizes(table))] for name in ("24 nm", "1 µm")]
    errors = found.sizes["surface"]
    absolute = found.displacement_of_size.sel(rms_height=24e-9).std("surface", ddof=1).values * NANO
    assert absolute[-1] < absolute[0]
    repeats(
        "larger nominal area, less variation (6.2.2, 7)",
        f"relative deviation {', '.join(spread[0])} at 24 nm, {', '.join(spread[1])} at 1 µm for sides of 64, 128, "
        "256 µm: "
        f"no trend, ± {100 / np.sqrt(2 * (errors - 1)):.0f} % with {errors} surfaces; absolute deviation "
        f"{listed(absolute, 2)} nm at 24 nm",
    )
    small = hs.random_surface((64, 64), 1e-6, 1e-6, 20e-6, seed=5).summits(rule=9)
    own = displacement(50e-3, small.height, small.radius, 0.2, SOFT)
    assert float(found.displacement_of_size.isel(side=0).sel(rms_height=1e-6)[4]) == approx(
        own, rel=1e-6
    )
    assert len(functions["drawn"](found)) == 2


def sizes(table):
    """The rows about the size of the surface."""
    return [name for name in table if name.startswith("relative deviation")]


def test_loops_of_rough_surfaces(tmp_path):
    found = swept("fig_5_05b").preliminary_displacement
    repeats(
        "two surfaces of one Rq differ by almost 2 (5.3.1)",
        f"largest over smallest of five {float(found.max() / found.min()):.2f}",
    )
    with hs.run(scenario("fig_5_05a"), tmp_path / "one.nc") as history:
        critical = int(analysis.critical_asperity(history)[0])
        count = hs.load(scenario("fig_5_05a")).surface().summits.height
    assert critical == int(count.argmax())
    repeats(
        "the critical asperity is typically, not necessarily, the highest (5.2)",
        f"with one pair and one μ always, here the highest of {count.size:,}",
    )


def test_textures_and_one_larger_asperity():
    found = hs.sweep(hs.load(FOLDER.parent / "19_one_large_asperity.toml")).preliminary_displacement
    radius, height = found.dims[:2] if "radius" in found.dims[0] else found.dims[1::-1]
    level = found.isel({height: 0}).values * NANO
    assert np.argmin(level) == len(level) - 1
    # standing out by what its radius is larger: .05, .25 and 1.5 µm
    out = [
        float(found.isel({radius: row, height: column})) * NANO
        for row, column in ((1, 1), (2, 2), (4, 3))
    ]
    one = displacement(
        10e-3, np.append(0.25e-6, np.zeros(63)), np.append(0.75e-6, np.full(63, 0.5e-6)), 0.5, HARD
    )
    assert out[1] == approx(one * NANO, rel=1e-9)
    repeats(
        "one larger asperity among equal ones decides (6.2.1)",
        f"at one level hardly, {level[0]:.2f} → {level[-1]:.2f} nm; standing out by .05, .25, 1.5 µm {listed(out)} nm",
    )
    texture = swept("fig_6_04").preliminary_displacement.isel(surface_count=7).values * NANO
    rough, _ = calculated("fig_6_09")
    random = float(rough.b_displacement.isel(radii=1).sel(rms_height=1e-6).mean("seed")) * NANO
    scatter = hs.sweep(
        hs.load(FOLDER.parent / "18_texture_tolerances.toml")
    ).preliminary_displacement
    heights = scatter.isel(surface_radius_scatter=0).mean("surface_seed").values * NANO
    repeats(
        "textures beat random surfaces (6.2.2, 7)",
        f"64 contacts {texture.min():.1f} to {texture.max():.1f} nm at 10 mN, random Rq 1 µm {random:.0f} nm at 50 "
        "mN, so "
        f"{random / 5 ** (2 / 3):.0f} or more at 10 (no power above 2/3); heights that scatter by 100 nm undo it: "
        f"{heights[0]:.1f} → {heights[-1]:.1f} nm (18)",
    )


def test_worn_pairs():
    one, five = (
        swept(name).preliminary_displacement.values * 1e6 for name in ("fig_6_15", "fig_6_16")
    )
    drift = [abs(np.diff(each)[[0, 2]]) for each in (one, five)]
    repeats(
        "drift of .1 to .2 µm (6.5)",
        f"100 → 1000 m: {listed(drift[0], 3)} µm at 1 N, {listed(drift[1], 2)} µm at 5 N, ambient and vacuum",
    )
    assert (one[2:] > one[:2]).all()
    assert five[3] < five[1]
    repeats(
        "vacuum above ambient, longer distance more (6.3.3)",
        f"but 5 N, 1000 m: {five[1]:.2f} µm in ambient, {five[3]:.2f} in vacuum",
    )


@mark.slow
def test_maps_that_are_run_in():
    """Yielding, and wear, take the highest summits: δ and what maps differ by fall, radii rise."""
    found, functions = calculated("fig_5_23_to")
    last = found.isel({"pass": -1}).sel(normal_load=5.0)
    first = found.isel({"pass": 0}).sel(normal_load=5.0)
    elastic = found.elastic_displacement.sel(normal_load=5.0)
    surface = hs.random_surface((128, 128), 1e-6, 1.18e-6, 20e-6, seed=2).summits(rule=9)
    assert float(elastic[1]) == approx(
        displacement(5.0, surface.height, surface.radius, 0.3, HARD), rel=1e-6
    )
    names = "preliminary_displacement", "touching_radius"
    reach = [float(each.mean("seed")) * NANO for each in (elastic, first[names[0]], last[names[0]])]
    spread = [
        float(each.std("seed", ddof=1)) * NANO
        for each in (elastic, first[names[0]], last[names[0]])
    ]
    radius = [float(each[names[1]].mean("seed")) * 1e6 for each in (first, last)]
    assert reach[0] > 2 * reach[1] > 2 * reach[2]
    assert spread[0] > spread[1] > spread[2]
    assert radius[1] > 1.5 * radius[0]
    words = f"{spread[0]:.0f}, {spread[1]:.0f}, {spread[2]:.0f} nm"
    repeats(
        "5.23, 6.15–6.17, G.2",
        f"alumina on zirconia, {found.sizes['seed']} maps, 5 N: {reach[0]:.0f} nm by Hertz, {reach[1]:.0f} yielding, "
        f"{reach[2]:.0f} in the eighth pass; deviation {words}; radii {radius[0]:.2f} → {radius[1]:.2f} µm",
    )
    repeats(
        "run-in surfaces spread less (5.3.1, 5.4.1)",
        f"deviation {words} by Hertz, yielding, in the eighth pass",
    )
    assert len(functions["drawn"](found)) == 2


def test_misprints():
    """What the equations would give as they are printed."""
    work = 2 * np.sqrt(44.1e-3 * 83.4e-3)
    pulls = [share * np.pi * work * 2.5 for share in (2, 1.5)]
    repeats("Eq. 2.6", f"{pulls[0]:.3f} for {pulls[1]:.3f} mN of the ball of silicon on glass")

    def printed(load):
        """Eq. A.2, F_f = μN = 1, over δ."""
        return 2 * (1 - (1 - load) / 2) ** (2 / 3) - (1 - load) ** (2 / 3) - 1

    repeats(
        "Eq. A.2",
        f"{printed(0):.2f} δ left at T = 0 for {2 ** (1 / 3) - 1:.2f} δ; {printed(-1):.2f} δ at -μN for -1.00 δ: no "
        "loop closes",
    )

    def over_g(sapphire, zirconia=81.0, other=0.312):
        return (2 - 0.309) / sapphire + (2 - other) / zirconia

    right, own = 462.6 / (2 * 1.309), 205 / (2 * 1.312)
    high = [100 * (over_g(144.3) / each - 1) for each in (over_g(right), over_g(right, own))]
    glass = 100 * (over_g(144.3, 26, 0.2) / over_g(right, 26, 0.2) - 1)
    assert hs.material("alumina").shear_modulus == approx(144.3e9)
    repeats(
        "Table B.1, G of sapphire",
        f"E/2(1 + ν) is {right:.1f} GPa: δ of chapter 6 is {high[0]:.1f} % too high, {high[1]:.1f} % with the same "
        "of zirconia "
        f"({own:.1f} for 81 GPa); of alumina on glass {glass:.1f} %",
    )
