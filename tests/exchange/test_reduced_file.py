"""Reduced models as files that show, plot and report read, and their picture."""

import json
import re
from html import unescape

import matplotlib.pyplot as plt
import numpy as np
from click.testing import CliRunner
from pytest import approx, fixture, mark, raises
from reduced_contacts import LOAD, job, rough

import historysim as hs
from historysim.cli import main
from historysim.exchange.reduced.reducing import VirginCurve


@fixture(scope="module")
def model():
    return hs.reduce(job(rough(), varies=True), elements=6)


@fixture
def path(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    model.write("reduced.json")
    return tmp_path / "reduced.json"


@mark.parametrize("varies", [False, True])
def test_a_model_comes_back_from_its_file(tmp_path, varies):
    model = hs.reduce(job(rough(), varies=varies), elements=6)
    model.write(tmp_path / "reduced.json")
    found = hs.open(tmp_path / "reduced.json")
    assert type(found) is type(model)
    assert found.as_dict() == model.as_dict()
    way, loads = LOAD * np.array([1e-9, -1e-8, 3e-8]), np.array([LOAD, 0.5 * LOAD, LOAD])
    asked = (way, loads) if varies else (way,)
    assert found.force(*asked).tolist() == model.force(*asked).tolist()
    found.write(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "reduced.json").read_bytes()
    model.write(tmp_path / "reduced.nc")
    springs = hs.open(tmp_path / "reduced.nc")
    assert springs.stiffness.values.tolist() == model.stiffness.tolist()
    assert springs.attrs["bound_of_load"] == model.bound * model.friction_limit
    if varies:
        assert springs.limit_at_load.values.tolist() == model.scaling.limit.tolist()


def test_show_plot_and_report_take_the_file(path):
    for words in (["show"], ["plot", "-o", "r.png"], ["report", "-o", "r.html"]):
        done = CliRunner().invoke(main, [words[0], path.name, *words[1:]])
        assert done.exit_code == 0, done.output
    page = (path.parent / "r.html").read_text(encoding="utf-8")
    plain = unescape(re.sub("<[^>]*>", " ", page))
    model = hs.open(path)
    for label, told in model.summary():
        assert label in plain
        assert told in plain
    assert "Where the normal load varies no bound is known" in plain
    assert page.count("data:image/webp;base64,") == 1
    assert page.count("<tr>") == len(model.summary()) + 1 + len(model)
    assert hs.report(model) == page
    assert "<td" in model._repr_html_()


def test_the_picture_shows_the_contact_as_it_moves():
    ensemble = rough()
    model = hs.reduce(job(ensemble), elements=6)
    loop, spectrum = hs.plot(model, figure=plt.figure()).axes
    lines = {line.get_label(): line.get_xydata() for line in loop.get_lines()}
    contact, springs = lines["contact"], lines["6 springs"]
    curve = VirginCurve(ensemble, LOAD)
    unit = contact[:, 0].max() / (0.8 * curve.end)
    power = 10 ** np.round(np.log10(unit))
    _, exact = ensemble.advance_many(curve.rest, tangential_displacement=contact[:, 0] / power)
    part = contact[:, 1] / contact[:, 1].max()
    assert part == approx(exact.tangential_load / exact.tangential_load.max(), abs=1e-7)
    assert (abs(springs[:, 1] - contact[:, 1]) <= model.bound * contact[:, 1].max() * 1.5).all()
    assert spectrum.get_lines()[0].get_ydata().size == 6


def without(key):
    return lambda told: {name: value for name, value in told.items() if name != key}


@mark.parametrize(
    "change, said",
    [
        (without("limit_N"), "'limit_N'"),
        (lambda told: told | {"limit_N": told["limit_N"][1:]}, "unequal lengths"),
        (lambda told: told | {"stiffness_N_per_m": ["a"] * 6}, "stiffness_N_per_m is"),
        (
            lambda told: told | {"normal_load_N": -1},
            "normal_load_N is -1; expected a finite number greater than 0",
        ),
        (lambda told: told | {"format": "historysim reduced model 1"}, "create it again"),
    ],
)
def test_damaged_files_are_reported(path, change, said):
    path.write_text(
        json.dumps(change(json.loads(path.read_text(encoding="utf-8")))), encoding="utf-8"
    )
    with raises(hs.InputError, match=re.escape(said)) as told:
        hs.report(path)
    assert str(told.value).startswith(f"{path}: ")
