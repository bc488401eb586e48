"""A folder of scenarios on one page: what is run, swept and carried out, and what cannot be."""

import base64
import importlib.util
import io
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

import historysim as hs
from historysim.cli import main
from historysim.studies.gallery import EXAMPLE

pytestmark = pytest.mark.ci

BALL = """# A ball is loaded.
#
# Second paragraph,
# of two lines.

title = "A ball & a flat"

[materials]
contact_modulus = 1e10
shear_modulus = 2.5e9

[surface]
kind = "sphere"
radius = "1 mm"

[friction]
coefficient = 0.2

[loading]
waypoints = [
    { time = 0, normal_load = "10 mN" },
    { time = 1, normal_load = "10 mN", tangential_load = "1 mN" },
]
"""
SWEPT = (
    BALL.replace("ball & a flat", "sweep")
    + """
[sweep]
outputs = ["preliminary_displacement"]

[sweep.over]
friction.coefficient = [0.1, 0.2]
"""
)
SCRIPT = '''"""A script.

What it says.
"""

# historysim gallery: example

import xarray as xr


def calculated():
    return xr.Dataset({"square": ("length", [1.0, 4.0], {"units": "m2"})}, {"length": ("length", [1.0, 2.0])})
'''


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "made"
    (made / "below").mkdir(parents=True)
    for name, text in (
        ("01_ball.toml", BALL),
        ("02_sweep.toml", SWEPT),
        ("below/03_script.py", SCRIPT),
    ):
        (made / name).write_text(text, encoding="utf-8")
    return made


def sections(text):
    return dict(re.findall(r'<section id="([^"]+)">(.*?)</section>', text, re.DOTALL))


def test_the_site_shows_a_thumbnail_of_each_scenario(folder, tmp_path):
    spec = importlib.util.spec_from_file_location(
        "gallery", Path(hs.__file__).parents[1] / ".site" / "gallery.py"
    )
    site = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(site)
    folder = folder.rename(tmp_path / "scenarios")
    drawn = tmp_path / "drawn.html"
    hs.gallery(folder, drawn, scripts=True)
    made = site.pages(tmp_path, drawn)
    links = re.findall(r'<a href="(gallery/\w+)\.html#([\w-]+)">(.*?)</a>', made["gallery.md"])
    assert [re.search("<span>(.*)</span>", shown)[1] for *_, shown in links] == [
        "A ball &amp; a flat",
        "A sweep",
        "A script.",
    ]
    for page, label, shown in links:
        assert made[f"{page}.md"].count(f"({label})=\n## ") == 1
        (data,) = re.findall('src="data:image/webp;base64,([^"]+)"', shown)
        with Image.open(io.BytesIO(base64.b64decode(data))) as thumbnail:
            assert 100 <= max(thumbnail.size) <= 300


def test_all_are_run_swept_or_carried_out_and_what_fails_is_named(folder):
    (folder / "bad.toml").write_text(BALL.replace("sphere", "spere"), encoding="utf-8")
    (folder / "none.py").write_text("# historysim gallery: example\nX = 1\n", encoding="utf-8")
    (folder / "wrong.py").write_text("# historysim gallery: example\n1 / 0\n", encoding="utf-8")
    # neither is a part of it
    (folder / ".hidden.toml").write_text(BALL, encoding="utf-8")
    (folder / "plain.py").write_text("1 / 0\n", encoding="utf-8")
    notices = []
    text = hs.gallery(folder, scripts=True, notify=notices.append)
    found = sections(text)
    assert list(found) == [
        "01_ball.toml",
        "02_sweep.toml",
        "bad.toml",
        "none.py",
        "wrong.py",
        "below/03_script.py",
    ]
    # loop, loads and states; traction
    assert [body.count("data:image/webp;base64,") for body in found.values()] == [2, 1, 0, 0, 0, 1]
    # each with a picture has a small one among the links, and folders are groups
    links = text[: text.index('<section id="')]
    assert links.count("data:image/webp;base64,") == 3
    assert links.count("<h3>") == 2
    assert "<h2>A ball &amp; a flat</h2>" in found["01_ball.toml"]
    assert "<p>Second paragraph, of two lines.</p>" in found["01_ball.toml"]
    assert "<h2>A script.</h2>" in found["below/03_script.py"]
    for name, reason in (
        ("bad.toml", "sphere"),
        ("none.py", "calculated"),
        ("wrong.py", "division by zero"),
    ):
        assert "No picture" in found[name]
        assert reason in found[name]
        assert any(name in note and reason in note for note in notices)
    assert len(notices) == 3
    # every link leads to a section, and nothing is fetched
    assert set(re.findall(r'href="#([^"]+)"', text)) == set(found)
    assert not re.search(r'(src|href)="(?!data:|#)', text)


def test_a_scenario_with_adhesion_has_its_map(tmp_path):
    moduli = "contact_modulus = 1e10\nshear_modulus = 2.5e9"
    text = BALL.replace(moduli, 'first = "silicon"\nsecond = "float glass"')
    adhesion = '[adhesion]\nequilibrium_separation = "0.2 nm"\n'
    (tmp_path / "ball.toml").write_text(text + adhesion, encoding="utf-8")
    (body,) = sections(hs.gallery(tmp_path)).values()
    assert "Its asperities on the adhesion map." in body


def test_the_command_writes_the_page(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    below = folder / "below"
    done = CliRunner().invoke(main, ["gallery", str(below), "--workers", "1", "--scripts"])
    assert done.exit_code == 0, done.output
    assert len(sections((tmp_path / "gallery.html").read_text(encoding="utf-8"))) == 1


DRAWN = (
    SCRIPT
    + """

def drawn(found):
    import historysim as hs

    return [hs.plots.curve(found, quantity="square"), hs.plots.curve(found, quantity="square", fit="power")]


def rows(found):
    return [["length", "square"], *([str(x), str(y)] for x, y in zip(found.length.values, found.square.values))]
"""
)
MAP = f'''"""A surface."""

{EXAMPLE}

import historysim as hs


def calculated():
    return hs.Surface([[0.0, 1e-9], [2e-9, 0.0]], 1e-6)
'''
PICTURE = """
[[picture]]
kind = "curve"
quantity = "preliminary_displacement"
"""


def test_pictures_and_tables_of_their_own(tmp_path):
    (tmp_path / "1_script.py").write_text(DRAWN, encoding="utf-8")
    (tmp_path / "2_sweep.toml").write_text(SWEPT + PICTURE, encoding="utf-8")
    (tmp_path / "3_run.toml").write_text(
        BALL + '[picture]\nkind = "loops"\nloads = true\n', encoding="utf-8"
    )
    # whatever has a picture
    (tmp_path / "4_map.py").write_text(MAP, encoding="utf-8")
    notices = []
    found = sections(hs.gallery(tmp_path, scripts=True, notify=notices.append))
    assert notices == []
    assert [body.count("data:image/webp;base64,") for body in found.values()] == [2, 1, 1, 1]
    assert re.search(r"<th[^>]*>length</th>", found["1_script.py"])
    assert "4.0" in found["1_script.py"]
