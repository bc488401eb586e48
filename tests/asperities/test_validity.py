import math

import numpy as np
from pairs import PLAIN
from pytest import approx, mark

import historysim as hs
from historysim.asperities import laws, validity
from historysim.asperities.instrument import Instrument
from historysim.asperities.validity import findings, overlapping
from historysim.asperities.yielding import KogutEtsion
from historysim.contact import adhesion, hertz

PAIR = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9)


def names(found):
    return [finding.name for finding in found]


def rough(rms_height):
    surface = hs.random_surface((256, 256), 1e-6, rms_height, 20e-6, seed=1)
    pair = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
    return hs.Ensemble.from_summits(pair, surface.summits(9), 0.2)


def sphere(approach_over_radius, pair=PAIR, **options):
    ensemble = hs.Ensemble(pair, 0.0, 1e-3, 0.2)
    return findings(ensemble, approach_over_radius * 1e-3, **options)


def test_the_rough_surface_of_the_source_is_reported_once_and_the_smooth_one_not():
    coarse = rough(1e-6)
    found = findings(coarse, coarse.approach_at(50e-3))
    assert names(found) == ["steep", "yield"]
    # by Hertz, one by one
    depth = coarse.summit_height - coarse.highest_summit + coarse.approach_at(50e-3)
    loads = [
        hertz.normal_load(d, summit_radius=r, contact_modulus=coarse.pair.contact_modulus)
        for d, r in zip(depth, coarse.summit_radius, strict=True)
    ]
    steep = [
        load for load, d, r in zip(loads, depth, coarse.summit_radius, strict=True) if d > 0.09 * r
    ]
    assert found[0].value == approx(sum(steep) / 50e-3, rel=1e-9)
    assert found[0].value > 0.9
    assert "\n" not in found[0].text
    assert "s_filter" in found[0].text
    smooth = rough(24e-9)
    assert findings(smooth, smooth.approach_at(50e-3)) == ()


def test_a_sphere_is_steep_from_a_ratio_on():
    assert names(sphere(0.29**2)) == []
    assert names(sphere(0.31**2)) == ["steep"]


def test_yield_begins_where_hertz_pressure_says_so():
    # mean pressure 4 E* a / (3π R)
    ratio = 0.1
    mean = 4 * 50e9 * ratio / (3 * math.pi)
    moduli = {"contact_modulus": 50e9, "shear_modulus": 12e9}
    for limits, expected in (
        ({}, []),
        ({"yield_stress": mean / 1.06}, []),
        ({"yield_stress": mean / 1.08}, ["yield"]),
        ({"hardness": mean / 0.39}, []),
        ({"hardness": mean / 0.41}, ["yield"]),
    ):
        pair = hs.MaterialPair.from_moduli(**moduli, **limits)
        assert names(sphere(ratio**2, pair)) == expected, limits


def test_the_plasticity_index_agrees_with_greenwood_and_williamson():
    pair = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9, hardness=1e9)
    height = np.array([0.0, -1e-9, -3e-9, -4e-9])
    ensemble = hs.Ensemble(pair, height, 1e-6, 0.2)
    index = 50 * math.sqrt(np.std(height) / 1e-6)
    (found,) = findings(ensemble, 5e-9)
    assert f"plasticity index {index:.2g}" in found.text


def test_the_contact_area_is_compared_with_the_nominal_one():
    area = math.pi * 1e-3 * 1e-6
    for nominal, expected in ((area / 0.04, []), (area / 0.06, ["area"]), (None, [])):
        ensemble = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2, nominal_area=nominal)
        assert names(findings(ensemble, 1e-6)) == expected


@mark.parametrize("few", [0, 60])
def test_circles_that_overlap_are_those_that_a_search_of_all_pairs_finds(few, monkeypatch):
    monkeypatch.setattr(validity, "MOST_PAIRED", few)
    rng = np.random.default_rng(1)
    for _ in range(20):
        place = rng.uniform(0, 1, (60, 2))
        radius = rng.lognormal(-4, 1, 60)
        apart = np.hypot(*(place[:, None] - place[None]).T)
        pairs = (apart < radius[:, None] + radius[None]) & ~np.eye(60, dtype=bool)
        assert np.array_equal(overlapping(place, radius), pairs.any(axis=0))


def test_asperities_that_overlap_are_reported():
    contact_radius = math.sqrt(1e-3 * 1e-6)
    for distance, expected in ((1.9, ["overlap"]), (2.1, [])):
        place = {"x": [0.0, distance * contact_radius], "y": [0.0, 0.0]}
        ensemble = hs.Ensemble(PAIR, [0.0, 0.0], 1e-3, 0.2, **place)
        assert names(findings(ensemble, 1e-6)) == expected
    assert names(findings(hs.Ensemble(PAIR, [0.0, 0.0], 1e-3, 0.2), 1e-6)) == []


def test_adhesion_is_reported_from_the_pull_off_load_of_jkr():
    work, radius = 0.1, 1e-3
    pull_off = -float(adhesion.jkr_pull_off_load(summit_radius=radius, work_of_adhesion=work))
    moduli = {"contact_modulus": 50e9, "shear_modulus": 12e9}
    ensemble = hs.Ensemble(
        hs.MaterialPair.from_moduli(**moduli, work_of_adhesion=work), 0.0, radius, 0.2
    )
    (found,) = findings(ensemble, ensemble.approach_at(9 * pull_off))
    assert found.name == "adhesion"
    assert found.value == approx(1 / 9)
    # 9 pull-offs of 1.5 πWR
    assert "N/(πWR) is 14 or less" in found.text
    assert findings(ensemble, ensemble.approach_at(11 * pull_off)) == ()
    # the attraction is in the model
    attracted = hs.Ensemble(
        ensemble.pair, 0.0, radius, 0.2, attraction=hs.attraction.DMT(work_of_adhesion=work)
    )
    assert findings(attracted, ensemble.approach_at(9 * pull_off)) == ()


# half-width of the limit over the radius: √ of 4 P R/(π E* l), p = E* b/(2 R)
CYLINDER_LIMITS = {"steep": 0.3, "plane_strain": 0.02, "yield": 2 * 1.79 * 0.5e9 / 50e9}


@mark.parametrize("name", CYLINDER_LIMITS)
@mark.parametrize("nu", [0.0, 0.4])
def test_the_limits_of_a_cylinder(name, nu):
    stress = {"yield_stress": 0.5e9} if name == "yield" else {}
    pair = hs.MaterialPair.from_moduli(
        contact_modulus=50e9, shear_modulus=50e9 * (1 - nu) / 2, **stress
    )
    radius, length = 0.01, 0.2 * 0.01 if name == "plane_strain" else 0.1
    cylinder = hs.LineContact(pair, radius, length, 0.3, 0.1)
    for factor, reported in ((0.99, False), (1.01, True)):
        load = math.pi * 50e9 * length * radius * (factor * CYLINDER_LIMITS[name]) ** 2 / 4
        found = findings(cylinder, cylinder.approach_at(load))
        assert names(found) == [name] * reported
    slip = 0.3 * cylinder.approach_at(1.0)  # θ = 1 for every ν
    assert names(
        findings(
            cylinder, cylinder.approach_at(1.0), Instrument(displacement_resolution=1.01 * slip)
        )
    )
    assert not findings(
        cylinder, cylinder.approach_at(1.0), Instrument(displacement_resolution=0.99 * slip)
    )


def test_what_the_instrument_does_not_resolve_is_reported():
    displacement = PAIR.displacement_ratio * 0.2 * 1e-9
    ensemble = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)
    (found,) = findings(ensemble, 1e-9, Instrument(displacement_resolution=1.01 * displacement))
    assert (found.name, found.value) == ("resolution", approx(displacement))
    assert findings(ensemble, 1e-9, Instrument(displacement_resolution=0.99 * displacement)) == ()


def test_two_spikes_that_carry_all_are_reported():
    rng = np.random.default_rng(1)
    height = rng.normal(0, 100e-9, 5000)
    for spikes, expected in ((0.0, []), (3e-6, ["outliers"])):
        spiked = height.copy()
        spiked[[10, 20]] = spikes or spiked[[10, 20]]
        ensemble = hs.Ensemble(PAIR, spiked, 10e-6, 0.2)
        found = findings(ensemble, 100e-9)
        assert names(found) == expected
        if found:
            assert found[0].value == 1.0
            assert "2 summits of 5,000" in found[0].text


@mark.parametrize("distance, reported", [(1.1, False), (0.9, True)])
def test_friction_that_rises_faster_than_springs_can_slide_is_reported(distance, reported):
    """Where Δμ/Δs is 1/(θδ) a spring that slides gains as much limit as it is strained."""
    rise = 0.3 * PLAIN.displacement_ratio * 0.01 * distance
    law = laws.SlidFriction([0.0, rise, 2 * rise], [0.2, 0.5, 0.5])
    ensemble = hs.Ensemble(PLAIN, [0.0, -0.02], 1.0, law)
    found = [each for each in findings(ensemble, 0.01) if each.name == "rising"]
    assert bool(found) == reported
    assert all("faster than 1/(θδ)" in each.text for each in found)


def yielding(contact_radius_over_radius, **options):
    """A ball of hardness 1 GPa, pressed until its contact is so wide on first loading."""
    pair = hs.MaterialPair.from_moduli(
        contact_modulus=50e9, shear_modulus=12e9, hardness=1e9, **options
    )
    law = KogutEtsion(hardness=1e9, poissons_ratio=0.3)
    # A = 2πRδ where all is plastic
    return hs.Ensemble(pair, 0.0, 1e-3, 0.2, yielding=law), 0.5e-3 * contact_radius_over_radius**2


def test_where_the_model_of_yielding_ends():
    # 0.2 a/R is 6 %, within a factor of two of a Vickers indentation's
    assert names(findings(*yielding(0.3))) == []
    ensemble, approach = yielding(0.1)
    (found,) = findings(ensemble, approach)
    _, radius = ensemble.yielding.first_loading(
        np.array([approach]), np.array([1e-3]), ensemble.pair
    )
    assert (found.name, found.value) == (
        "hardening",
        approx(0.2 * radius[0] / 1e-3, rel=1e-6),
    )
    # all of it carries the hardness
    load = 1e9 * math.pi * (0.3e-3) ** 2
    assert names(findings(*yielding(0.3, cracking_load=1.01 * load))) == []
    (found,) = findings(*yielding(0.3, cracking_load=0.99 * load))
    assert found.name == "cracks"
    assert "Lawn and Evans 1977" in found.text
    ensemble, approach = yielding(0.3)
    area = math.pi * (0.3e-3) ** 2
    for nominal, expected in ((area / 0.04, []), (area / 0.4, ["area"]), (area / 0.6, ["bulk"])):
        on = hs.Ensemble(
            ensemble.pair, 0.0, 1e-3, 0.2, yielding=ensemble.yielding, nominal_area=nominal
        )
        assert names(findings(on, approach)) == expected
    for distance, expected in ((0.7e-3, []), (0.5e-3, ["merging"])):
        two = hs.Ensemble(
            ensemble.pair,
            [0.0, 0.0],
            1e-3,
            0.2,
            yielding=ensemble.yielding,
            x=[0.0, distance],
            y=[0.0, 0.0],
        )
        assert names(findings(two, approach)) == expected


def test_the_load_at_which_glass_cracks_is_of_the_order_of_lawn_and_evans():
    """0.02 N for soda-lime glass: 2.2e4 K⁴/H³."""
    glass = hs.material("float glass")
    assert glass.cracking_load == approx(2.2e4 * 0.75e6**4 / 5.9e9**3)
    assert 0.005 < glass.cracking_load < 0.1
    assert hs.material("copper").cracking_load is None
    assert hs.MaterialPair(hs.material("copper"), glass).cracking_load == glass.cracking_load
