import attrs
from golden import check_messages
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx, mark, warns

from historysim.contact.materials import MATERIALS, Material, MaterialPair, material
from historysim.errors import UnlikelyValueWarning

# name: E [GPa], ν, G [GPa], γ [mJ/m²], Rq [nm], R [mm]; Table B.1 of Winogrodzka's thesis
TABLE = {
    "silicon": (112, 0.28, 44, 44.1, (2, 3), 2.5),
    "silica": (73.6, 0.17, 31.4, 44.1, (3, 5), 2.5),
    "sapphire": (462.6, 0.309, 144.3, 41.1, (8, 10), 2.5),
    "alumina": (462.6, 0.309, 144.3, 41.1, (8, 10), 2.5),
    "float glass": (64, 0.2, 26, 83.4, (0.7, 1), None),
    "zirconia": (205, 0.312, 81, 45.6, None, 2.5),
}


ASKED_FIRST = (
    "steel 100Cr6",
    "steel 316",
    "tungsten carbide",
    "silicon nitride",
    "silicon carbide",
    "PTFE",
    "PEEK",
    "aluminium",
    "brass",
    "titanium",
    "diamond-like carbon",
    "fused silica",
    "BK7",
)


def test_the_table_holds_these_materials():
    assert set(MATERIALS) >= {*TABLE, *ASKED_FIRST}
    for name, row in MATERIALS.items():
        assert row.name == name
        assert material(name.upper()) is row
        assert row.source
        # an onset of yield is looked for everywhere; no hardness is beyond the modulus of a
        # lattice, about E/10
        assert row.youngs_modulus / 500 < row.hardness < row.youngs_modulus / 7


@mark.parametrize("name", TABLE)
def test_built_in_material(name):
    modulus, ratio, shear, energy, roughness, radius = TABLE[name]
    row = material(name)
    assert row.youngs_modulus == approx(modulus * 1e9, rel=1e-15)
    assert row.poissons_ratio == ratio
    assert row.shear_modulus == approx(shear * 1e9, rel=1e-15)
    assert row.surface_energy == approx(energy * 1e-3, rel=1e-15)
    assert row.roughness == (roughness and approx([q * 1e-9 for q in roughness], rel=1e-15))
    assert row.ball_radius == (radius and approx(radius * 1e-3, rel=1e-15))
    assert "Table B.1" in row.source


@mark.parametrize("name", ["float glass", "Float_Glass", "FLOAT-GLASS", " float  glass "])
def test_a_name_may_be_written_in_these_ways(name):
    assert material(name) is MATERIALS["float glass"]


@mark.parametrize(
    "alias, name",
    [
        ("SiC", "silicon carbide"),
        ("Al2O3", "alumina"),
        ("Si₃N₄", "silicon nitride"),
        ("zro2", "zirconia"),
        ("WC-Co", "tungsten carbide"),
        ("AISI 52100", "steel 100Cr6"),
        ("Ti-6Al-4V", "titanium Ti6Al4V"),
        ("Teflon", "PTFE"),
        ("aluminum", "aluminium"),
    ],
)
def test_formulas_and_common_names_are_aliases(alias, name):
    assert material(alias) is MATERIALS[name]


@mark.parametrize("given_as", [{}, {"shear_modulus": None}])
def test_shear_modulus_follows_from_isotropy(given_as):
    assert Material("steel", 210e9, 0.3, **given_as).shear_modulus == approx(210e9 / 2.6, rel=1e-15)


def test_silicon_on_float_glass():
    pair = MaterialPair(material("silicon"), material("float glass"))
    # by hand from Table B.1: 1/E* = 0.9216/112 + 0.96/64, 1/G* = 1.72/44 + 1.8/26 [1/GPa]
    assert pair.contact_modulus == approx(43.050430504e9, rel=1e-10)
    assert pair.shear_modulus == approx(9.231762427e9, rel=1e-9)
    assert pair.displacement_ratio == approx(1.165823721, rel=1e-9)


def test_a_material_takes_texts_with_units():
    found = Material(
        "x", "64 GPa", 0.2, roughness=("1 nm", 2e-9), ball_radius="2.5 mm", hardness="6 GPa"
    )
    assert found == Material(
        "x", 64e9, 0.2, roughness=(1e-9, 2e-9), ball_radius=2.5e-3, hardness=6e9
    )
    energetic = Material("x", 1e9, 0.2, "0.4 GPa", "40 mJ m-2")
    assert (energetic.shear_modulus, energetic.surface_energy) == (0.4e9, 0.04)


@mark.parametrize(
    "wrong, shown", [({"youngs_modulus": 210}, "210 Pa"), ({"hardness": 7.2}, "7.2 Pa")]
)
def test_moduli_that_no_material_has_are_reported(wrong, shown):
    with warns(
        UnlikelyValueWarning, match=rf"Material: \w+ is {shown}, which is implausible: .* in Pa"
    ):
        Material(**{"name": "steel", "youngs_modulus": 210e9, "poissons_ratio": 0.3} | wrong)


@given(st.floats(-0.99, 0.5), st.floats(-0.99, 0.5), st.floats(1e-3, 1e3))
def test_dundurs_beta_by_the_definition_in_kolosovs_constants(first_ratio, second_ratio, scale):
    # Dundurs: [μ1 (κ2 - 1) - μ2 (κ1 - 1)] / [μ1 (κ2 + 1) + μ2 (κ1 + 1)], κ = 3 - 4ν in plane
    # strain, the sign turned
    first, second = Material("a", 1e9, first_ratio), Material("b", 1e9 * scale, second_ratio)
    kappa = 3 - 4 * first_ratio, 3 - 4 * second_ratio
    shear = first.shear_modulus, second.shear_modulus
    whole = shear[0] * (kappa[1] + 1) + shear[1] * (kappa[0] + 1)
    expected = (shear[1] * (kappa[0] - 1) - shear[0] * (kappa[1] - 1)) / whole
    beta = MaterialPair(first, second).dundurs_beta
    assert beta == approx(expected, abs=1e-14)
    assert MaterialPair(second, first).dundurs_beta == approx(-beta, abs=1e-15)
    assert abs(beta) <= 0.75
    assert MaterialPair(first, first).dundurs_beta == 0


def test_a_pair_has_a_repr():
    pair = MaterialPair(material("silicon"), material("float glass"))
    assert repr(pair) == "MaterialPair(material('silicon'), material('float glass'))"
    assert str(pair) == "silicon on float glass: E* = 43.05 GPa, G* = 9.232 GPa"
    assert (
        str(MaterialPair.from_moduli(contact_modulus=1e9, shear_modulus=2.5e8))
        == "pair: E* = 1 GPa, G* = 250 MPa"
    )
    silicon = material("silicon")
    text = repr(silicon)
    assert text.startswith("Material(name='silicon', youngs_modulus=112000000000.0")
    assert "None" not in text
    assert eval(text, {"Material": Material}) == silicon  # noqa: S307 - a repr of ours
    # a material of a built-in name with other numbers is written out
    other = attrs.evolve(material("silicon"), youngs_modulus=130e9)
    assert repr(other).startswith(
        "Material(name='silicon', youngs_modulus=130000000000.0, poissons_ratio=0.28, "
    )
    assert eval(repr(other)) == other  # noqa: S307 - the very text under test


@given(st.floats(-0.99, 0.5), st.floats(-0.99, 0.5), st.floats(1e-3, 1e3))
def test_a_pair_has_no_order_and_scales_with_its_moduli(first_ratio, second_ratio, scale):
    first, second = Material("a", 1e9, first_ratio), Material("b", 1e9 * scale, second_ratio)
    there, back = MaterialPair(first, second), MaterialPair(second, first)
    assert (there.contact_modulus, there.shear_modulus) == (
        back.contact_modulus,
        back.shear_modulus,
    )
    scaled = MaterialPair(Material("a", 7e9, first_ratio), Material("b", 7e9 * scale, second_ratio))
    assert scaled.contact_modulus == approx(7 * there.contact_modulus, rel=1e-14)
    assert scaled.displacement_ratio == approx(there.displacement_ratio, rel=1e-14)


def test_pair_from_moduli():
    pair = MaterialPair.from_moduli(contact_modulus=1, shear_modulus=0.25)
    assert pair.first is pair.second is None
    assert (pair.contact_modulus, pair.shear_modulus, pair.displacement_ratio) == (1.0, 0.25, 1.0)
    assert repr(pair) == "MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)"
    assert eval(repr(pair)) == pair  # noqa: S307 - the very text under test


def test_messages():
    check_messages(globals())
