"""How adhesive the asperities of an ensemble are, against the numbers of one contact."""

import math

import pytest
from numpy.testing import assert_allclose

import historysim as hs
from historysim.asperities.adhering import adhering_asperities
from historysim.contact.adhesion import Regime
from historysim.scenario import scenario

PAIR = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=10e9)
WORK, SEPARATION = 0.05, 0.2e-9


def adhering(heights, radii, approach, **changed):
    ensemble = hs.Ensemble(PAIR, heights, radii, 0.2)
    numbers = {"work_of_adhesion": WORK, "equilibrium_separation": SEPARATION} | changed
    return adhering_asperities(ensemble, approach, **numbers)


def test_one_asperity_has_the_numbers_of_its_contact():
    radius, depth = 1e-6, 3e-9
    found = adhering([0.0], radius, depth)
    load = 4 / 3 * 50e9 * math.sqrt(radius) * depth**1.5
    tabor = (radius * WORK**2 / (50e9**2 * SEPARATION**3)) ** (1 / 3)
    assert_allclose(found.normal_load, load, rtol=1e-12)
    assert_allclose(found.load_parameter, load / (math.pi * WORK * radius), rtol=1e-12)
    assert_allclose(found.maugis_parameter, 1.157 * tabor, rtol=1e-3)
    # between the limits of DMT and JKR
    assert 1.5 < -found.pull_off_load[0] / (math.pi * WORK * radius) < 2
    assert found.regime[0] is Regime.MAUGIS


SCENARIO = """
[materials]
first = {first}
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[adhesion]
equilibrium_separation = "0.2 nm"
{work}
[loading]
waypoints = [{{ time = 0, normal_load = "{load} mN" }}]
"""


def adhering_of(tmp_path, first='"silicon"', work="", load=50):
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.format(first=first, work=work, load=load), encoding="utf-8")
    loaded = scenario.load(path)
    return loaded.adhering(loaded.replay())


def test_a_scenario_takes_the_work_of_adhesion_from_its_materials(tmp_path):
    silicon, glass = hs.material("silicon"), hs.material("float glass")
    expected = 2 * math.sqrt(silicon.surface_energy * glass.surface_energy)
    by_energies, by_work = (
        adhering_of(tmp_path),
        adhering_of(tmp_path, work=f"work_of_adhesion = {expected!r}"),
    )
    assert_allclose(by_energies.maugis_parameter, by_work.maugis_parameter, rtol=1e-12)
    assert_allclose(by_energies.load_parameter, 50e-3 / (math.pi * expected * 2.5e-3), rtol=1e-9)
    assert adhering_of(tmp_path, load=0) is None


def test_a_scenario_without_surface_energies_says_what_is_missing(tmp_path):
    first = '{ name = "mine", youngs_modulus = 1e11, poissons_ratio = 0.2 }'
    with pytest.raises(
        hs.InputError, match=r"s\.toml: adhesion\.work_of_adhesion: missing; the materials have no"
    ):
        adhering_of(tmp_path, first=first)


def test_examples_are_the_greatest_the_median_and_the_least_load():
    found = adhering([0.0, -1e-9, -5e-9, -2e-9], [1e-6, 9e-6, 1e-6, 1e-6], 4e-9)
    names = ["asperity 1, greatest load", "asperity 0, median load", "asperity 3, least load"]
    assert list(found.examples()) == names
    assert found.examples()[names[2]] == (found.maugis_parameter[2], found.load_parameter[2])
    # fewer asperities than names
    assert list(adhering([0.0], 1e-6, 4e-9).examples()) == ["asperity 0, greatest load"]
    two = adhering([0.0, -1e-9], 1e-6, 4e-9)
    assert list(two.examples()) == ["asperity 0, greatest load", "asperity 1, median load"]
