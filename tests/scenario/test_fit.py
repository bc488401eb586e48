"""A fit as a scenario says it, and the scenario that comes out."""

import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose
from records import BALL, scenario_text, write_columns

from historysim.errors import InputError
from historysim.measured.fitting import Parameter
from historysim.scenario import scenario
from historysim.scenario.fit import build_model, fitted_text

ALL = 'parameters = ["friction", "lateral_stiffness", "shear_modulus", "height_scale"]'
ROUGH = """
title = "rough"
[materials]  # of the pair
contact_modulus = "100 GPa"
shear_modulus = "20 GPa"  # guessed
[surface]
kind = "summits"
height = ["0 nm", "-20 nm", "-50 nm"]
radius = "1 mm"
[friction]
coefficient = 0.2  # as in the last test
"""
INSTRUMENT = "[instrument]\nlateral_stiffness = '500 N/mm'  # of the maker\n"


@pytest.fixture
def folder(tmp_path):
    write_columns(tmp_path / "m.csv", t=[0, 1, 2], N=[1, 1, 1], u=[0, 1, 0], T=[0, 1, 0])
    return tmp_path


def loaded(folder, fit=ALL, base=ROUGH, more=INSTRUMENT, **options):
    path = folder / "s.toml"
    path.write_text(
        scenario_text(base=base, more=f"{more}[fit]\n{fit}\n", **options), encoding="utf-8"
    )
    return scenario.load(path)


def found(**values):
    """Give fitted parameters."""
    return [Parameter(name, value, 0.9 * value, 1.1 * value) for name, value in values.items()]


def reloaded(folder, text, name="fitted.toml"):
    (folder / name).write_text(text, encoding="utf-8")
    return scenario.load(folder / name)


# -- the model -------------------------------------------------------------------------------------


def test_the_model_is_made_of_its_parameters(folder):
    _, model, _ = build_model(loaded(folder))
    ensemble, instrument = model(
        {"friction": 0.3, "lateral_stiffness": 7.0, "shear_modulus": 5.0, "height_scale": 2.0}
    )
    assert ensemble.pair.shear_modulus == 5
    assert ensemble.pair.contact_modulus == 1e11
    assert instrument.lateral_stiffness == 7
    assert np.unique(ensemble.friction).tolist() == [0.3]
    # the mean of the heights, -70/3 nm, stays
    mean = -70e-9 / 3
    assert_allclose(
        ensemble.summit_height, mean + 2 * (np.array([0, -20e-9, -50e-9]) - mean), atol=1e-20
    )


def refusal(folder, fit=ALL, **options):
    with pytest.raises(InputError) as refused:
        build_model(loaded(folder, fit, **options))
    assert "\n" not in str(refused.value)
    return str(refused.value)


def test_parameters_that_the_scenario_does_not_have(folder):
    assert "fit.parameters: lateral_stiffness: expected [instrument]" in refusal(folder, more="")
    assert "fit.parameters: height_scale: all summits are equally high" in refusal(
        folder, base=BALL
    )
    several = ROUGH.replace("coefficient = 0.2", "coefficient = [0.1, 0.2, 0.2]")
    assert "fit.parameters: friction: expected one coefficient for all" in refusal(
        folder, base=several
    )
    columns = """
[materials]
contact_modulus = "100 GPa"
shear_modulus = "20 GPa"
[surface]
kind = "summits"
file = "z.csv"
columns = { height = "h", radius = "r", friction = "f" }
"""
    (folder / "z.csv").write_text("h,r,f\n0,1e-3,0.2\n-1e-8,1e-3,0.2\n", encoding="utf-8")
    said = refusal(folder, base=columns)
    assert said.startswith(
        "s.toml: fit.parameters: friction: is a column of the surface; expected [friction]"
    )


# -- the scenario that comes out -------------------------------------------------------------------


def test_the_fitted_scenario_holds_the_values_and_the_comments(folder):
    of = loaded(folder)
    text = fitted_text(
        of,
        found(friction=0.25, lateral_stiffness=6e5, shear_modulus=3e10, height_scale=1.5),
        folder / "fitted.toml",
    )
    assert "coefficient = 0.25 # fitted, 95 %: 0.225 to 0.275; as in the last test\n" in text
    assert "lateral_stiffness = 600000.0 # fitted, 95 %: 540000 to 660000; of the maker\n" in text
    assert "shear_modulus = 30000000000.0 # fitted, 95 %: 2.7e+10 to 3.3e+10; guessed\n" in text
    assert "[materials]  # of the pair\n" in text
    assert 'contact_modulus = "100 GPa"\n' in text
    assert "height_scale = 1.5 # fitted, 95 %: 1.35 to 1.65\n" in text
    again = reloaded(folder, text)
    assert again.instrument.lateral_stiffness == 6e5
    ensemble, model = again.ensemble(), build_model(of)[1]
    expected, _ = model(
        {"friction": 0.25, "lateral_stiffness": 6e5, "shear_modulus": 3e10, "height_scale": 1.5}
    )
    assert_allclose(ensemble.summit_height, expected.summit_height, rtol=1e-12, atol=1e-20)
    assert ensemble.pair.shear_modulus == 3e10
    assert np.unique(ensemble.friction).tolist() == [0.25]
    assert tomllib.loads(text)["title"] == "rough"
    assert again.measurement().time.size == 3


def test_a_height_scale_multiplies_the_one_before(folder):
    base = ROUGH.replace('kind = "summits"', 'kind = "summits"\nheight_scale = 2  # twice')
    text = fitted_text(loaded(folder, base=base), found(height_scale=1.5), folder / "fitted.toml")
    assert "height_scale = 3.0 # fitted, 95 %: 2.7 to 3.3; twice\n" in text
    assert np.ptp(reloaded(folder, text).ensemble().summit_height) == pytest.approx(150e-9)


@pytest.mark.parametrize(
    "materials",
    [
        '[materials]\nfirst = "silicon"\nsecond = "float glass"\n',
        '[materials]\nfirst = "silicon"\n[materials.second]\nname = "x"\nyoungs_modulus = 6e10\npoissons_ratio = 0.2\n',
    ],
)
def test_a_fitted_shear_modulus_takes_the_place_of_the_materials(folder, materials):
    base = materials + ROUGH[ROUGH.index("[surface]") :]
    of = loaded(folder, base=base)
    again = reloaded(folder, fitted_text(of, found(shear_modulus=3e10), folder / "fitted.toml"))
    assert again.ensemble().pair.shear_modulus == 3e10
    assert again.ensemble().pair.contact_modulus == of.ensemble().pair.contact_modulus


def test_sections_in_one_line(folder):
    """A comment would end an inline table in the middle."""
    base = ROUGH.replace("[friction]\ncoefficient = 0.2  # as in the last test\n", "")
    base = base.replace(
        'title = "rough"\n', "title = 'rough'\nfriction = { coefficient = 0.2 }  # old\n"
    )
    of = loaded(folder, base=base)
    again = reloaded(folder, fitted_text(of, found(friction=0.25), folder / "fitted.toml"))
    assert np.unique(again.ensemble().friction).tolist() == [0.25]


def test_files_are_found_from_another_folder(folder):
    (folder / "out" / "deep").mkdir(parents=True)
    (folder / "z.csv").write_text("h,r\n0,1e-3\n-1e-8,1e-3\n", encoding="utf-8")
    base = ROUGH.replace(
        'height = ["0 nm", "-20 nm", "-50 nm"]\nradius = "1 mm"',
        'file = "z.csv"\ncolumns = { height = "h", radius = "r" }',
    )
    of = loaded(folder, base=base)
    text = fitted_text(of, found(friction=0.25), folder / "out" / "deep" / "fitted.toml")
    assert tomllib.loads(text)["loading"]["file"] == "../../m.csv"
    again = reloaded(folder / "out" / "deep", text)
    assert again.measurement().time.size == 3
    assert len(again.ensemble()) == 2
    text = fitted_text(of, found(friction=0.25), folder / "fitted.toml")
    assert tomllib.loads(text)["loading"]["file"] == "m.csv"


def test_a_file_that_marks_utf8_and_has_other_line_ends(folder):
    text = scenario_text(base=ROUGH, more=f"{INSTRUMENT}[fit]\n{ALL}\n").replace("\n", "\r\n")
    (folder / "s.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    fitted = fitted_text(
        scenario.load(folder / "s.toml"), found(friction=0.25), folder / "fitted.toml"
    )
    (folder / "fitted.toml").write_bytes(fitted.encode())
    assert np.unique(scenario.load(folder / "fitted.toml").ensemble().friction).tolist() == [0.25]


# -- in one call -----------------------------------------------------------------------------------


# -- the model against the record
# --------------------------------------------------------------------


def test_adhesion_outlives_its_materials(folder):
    base = (
        '[materials]\nfirst = "silicon"\nsecond = "float glass"\n'
        + ROUGH[ROUGH.index("[surface]") :]
    )
    energies = "[adhesion]\nequilibrium_separation = '0.3 nm'\n"
    of = loaded(folder, base=base, more=energies)
    work = of.sections.adhesion.work(of.ensemble().pair)
    text = fitted_text(of, found(shear_modulus=3e10), folder / "fitted.toml")
    assert tomllib.loads(text)["adhesion"]["work_of_adhesion"] == work
