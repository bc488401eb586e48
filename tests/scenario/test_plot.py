"""Pictures of whatever has one, by one call."""

import numpy as np
import xarray as xr
from golden import refused
from matplotlib.figure import Figure
from pairs import STIFF as PAIR
from pytest import fixture, mark
from records import BALL

import historysim as hs
from historysim.asperities.adhering import adhering_asperities
from historysim.recording import surface_group

ROUGH = hs.Ensemble(PAIR, [0.0, -1e-8, -2e-8, -1e-6], 1e-3, 0.2)
EVENTS = [
    hs.NormalLoad(0.0, 0.1),
    *(hs.TangentialDisplacement(float(time), (-1) ** time * 1e-7) for time in range(1, 5)),
]
ADHESIVE = """
[adhesion]
work_of_adhesion = 0.05
equilibrium_separation = "0.2 nm"
[loading]
waypoints = [{ time = 0, normal_load = "50 mN" }]
"""


@fixture(scope="module")
def history():
    return hs.replay(ROUGH, EVENTS, substeps=50)


@fixture(scope="module")
def files(tmp_path_factory, history):
    tmp_path = tmp_path_factory.mktemp("files")
    hs.Replay(ROUGH, EVENTS, substeps=50).write(tmp_path / "r.nc")
    hs.loops(history).to_dataset().to_netcdf(tmp_path / "l.nc")
    (tmp_path / "s.toml").write_text(BALL + ADHESIVE, encoding="utf-8")
    np.savetxt(tmp_path / "map.txt", np.pad([[4.0]], 2))
    hs.EventLog.create(tmp_path / "r.history", ROUGH, EVENTS).close()
    return tmp_path


def titles(figure):
    assert isinstance(figure, Figure)
    return [axes.get_title(loc="left") for axes in figure.axes]


SURFACE = hs.Surface(np.pad([[4e-9]], 2), 1e-6)
PRESSED = ROUGH.advance(ROUGH.initial_state(), normal_load=0.1)
ADHESION = {"work_of_adhesion": 0.05, "equilibrium_separation": 2e-10}


@mark.parametrize(
    "make, title",
    [
        (lambda history: history, "Friction loop"),
        (lambda _: SURFACE, "Surface and summits"),
        (lambda _: surface_group.dataset(SURFACE.summits(), SURFACE), "Surface and summits"),
        (hs.loops, "Friction loops"),
        (lambda history: hs.loops(history).to_dataset(), "friction force (mN)"),
        (
            lambda _: ROUGH.asperity(0, ROUGH.advance(PRESSED, tangential_displacement=1e-8)),
            "asperity 0, partial slip",
        ),
        (lambda _: adhering_asperities(ROUGH, 1e-7, **ADHESION), "Adhesion map"),
    ],
)
def test_every_type_with_a_picture_is_drawn(history, make, title):
    assert title in titles(hs.plot(make(history)))


def test_a_history_from_a_file_brings_its_surface_along(tmp_path, history):
    surface = hs.random_surface((32, 32), 1e-6, 1e-7, 5e-6, seed=1)
    assert titles(hs.plot(history, step=-1)) == ["Asperity distribution"]
    opened = history.copy()
    surface_group.dataset(surface.summits(), surface).to_netcdf(tmp_path / "r.nc", group="surface")
    opened.encoding["source"] = str(tmp_path / "r.nc")
    with refused("of other summits than the surface"):
        hs.plot(opened, step=-1)


@mark.parametrize(
    "name, options, title",
    [
        ("r.nc", {"step": "peak"}, "Asperity distribution"),
        ("s.toml", {"picture": "contact-map"}, "Asperity distribution"),
        ("s.toml", {"picture": "adhesion-map"}, "Adhesion map"),
        (
            "map.txt",
            {"pixel_size": "1 µm", "height_unit": "nm", "form": "mean"},
            "Surface and summits",
        ),
    ],
)
def test_files_are_drawn_by_their_type(files, name, options, title):
    assert title in titles(hs.plot(str(files / name), **options))


@mark.parametrize(
    "name, options, said",
    [
        (
            "r.nc",
            {"form": "plane", "channel": 0},
            "form, channel: .*r.nc is a result of historysim run; expected a hei",
        ),
        (
            "s.toml",
            {"picture": "adhesion-map", "asperity": 1},
            "asperity does not apply to the picture adhesion-map",
        ),
        ("r.history", {}, "r.history has no picture"),
    ],
)
def test_options_that_do_not_fit_are_errors(files, name, options, said):
    with refused(said):
        hs.plot(files / name, **options)


@mark.parametrize("what", [None, ROUGH, xr.Dataset({"a": 1})])
def test_objects_without_a_picture_are_refused(what):
    with refused(r"this .* (has no picture|is not a history); expected"):
        hs.plot(what)


def test_reading_options_are_for_files(history):
    with refused("only apply to the path of a height map"):
        hs.plot(history, form="plane")
    with refused("step does not apply to the picture surface"):
        hs.plot(hs.Surface(np.eye(4), 1.0), step=1)
