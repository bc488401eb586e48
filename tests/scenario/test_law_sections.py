"""``[friction]`` with a law, ``[wear]``, ``surface.yielding``, and what else evolves in a scenario."""

from pytest import approx, mark, raises

import historysim as hs
from historysim.asperities import laws
from historysim.asperities.wear import EnergyWear
from historysim.asperities.yielding import KogutEtsion, Thornton
from historysim.scenario.scenario_summary import summary

SCENARIO = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
{friction}
[loading]
waypoints = [{{ time = 0, normal_load = "10 mN" }}, {{ time = 1, {more} }}]
"""
COULOMB = "[friction]\ncoefficient = 0.2"


def loaded(folder, friction=COULOMB, more='normal_load = "90 mN"'):
    path = folder / "s.toml"
    path.write_text(SCENARIO.format(friction=friction, more=more))
    return hs.load(path)


@mark.parametrize(
    "sections, name, law",
    [
        (
            '[friction]\nlaw = "shear strength"\nshear_strength = "11 MPa"',
            "law",
            laws.ShearStrength(11e6),
        ),
        (
            f'{COULOMB}\n[wear]\nlaw = "energy"\nvolume_per_energy = "2 mm3/J"\nshape = "blunted"',
            "wear",
            EnergyWear(volume_per_energy=2e-9, shape="blunted"),
        ),
        (
            f'yielding = "kogut-etsion"\n{COULOMB}',
            "yielding",
            KogutEtsion(hardness=hs.material("float glass").hardness, poissons_ratio=0.2),
        ),
        (
            f'yielding = {{ law = "thornton", hardness = "5.5 GPa", poissons_ratio = 0.3 }}\n{COULOMB}',
            "yielding",
            Thornton(hardness=5.5e9, poissons_ratio=0.3),
        ),
    ],
)
def test_a_law_is_read(tmp_path, sections, name, law):
    assert getattr(loaded(tmp_path, sections).ensemble(), name) == law


def test_friction_of_a_law_is_in_the_history(tmp_path):
    history = (
        loaded(tmp_path, '[friction]\nlaw = "shear strength"\nshear_strength = "11.37 MPa"')
        .replay()
        .dataset()
    )
    displacement = hs.analysis.preliminary_displacement(history).values
    assert displacement * 1e9 == approx([5.50, 11.44], abs=0.005)
    assert history.friction_law.startswith(
        "Bowden-Tabor: shear strength 11.37 MPa on the Hertz area"
    )


@mark.parametrize(
    "more, said",
    [
        ("normal_load = 0.1, asperities = [0]", "asperities: given without friction"),
        ("friction = 0.1, asperities = [3]", "asperity 3 does not exist"),
        ("geometry = { asperities = [0] }", "neither summit_height nor summit_radius"),
    ],
)
def test_a_wrong_change_of_asperities_is_refused(tmp_path, more, said):
    with raises(hs.InputError, match=said):
        loaded(tmp_path, more=more).build()


def test_validate_tells_the_laws(tmp_path):
    scenario = loaded(tmp_path, f"{COULOMB}\n[wear]\nlaw = 'energy'\nvolume_per_energy = 1e-12")
    assert dict(summary(scenario))["wear"].startswith("energy wear: 1e-12 m³/J")
