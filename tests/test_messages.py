"""Messages about unsuitable arguments of public functions, compared with messages.txt.

Each case is an expression; other golden files are in tests/tables and tests/scenario. They are
reviewed in diffs; after an intended change ``PYTHONPATH=tests/support python
tests/test_messages.py`` writes this one again.
"""

import contextlib
import tempfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from swept import BALL

import historysim as hs
from historysim.basics import arguments, units
from historysim.measured import branches, correction, loops, reduction, sliding
from historysim.scenario import grid
from historysim.surfaces import distribution

MODULES = (arguments, units, branches, correction, loops, reduction, sliding, grid, distribution)
GOLDEN = Path(__file__).with_name("messages.txt")
CASES = """
quantity("0.05", "N")
quantity("5 mm", "N")
quantity("5 Hz", "s")
quantity("5 furlongz", "m")
quantity("20 celsius", "K")
quantity("abc", "N")
quantity("1,5 N", "N")
quantity("10 500 N", "N")
quantity("1e999 N", "N")
quantity(nan, "N")
quantity(10**400, "N")
quantity(True, "N")
quantity(None, "Pa")
quantity([1.0], "m")
quantity("0.2", "1")
quantity("20 %", "1")
quantity("9" * 500, "N")
conversion_factor("celsius", "K")
conversion_factor("0 N", "N")
conversion_factor("1/0 N", "N")
conversion_factor("9**9**9", "1")
conversion_factor("KN", "N")
conversion_factor("mpa", "Pa")
conversion_factor("", "N")
conversion_factor("N" + chr(0xDCFF), "N")
conversion_factor("m^1000000", "m")
as_item_array("summit", "summits", "radius", [[1, 2]], None, above=0)
as_item_array("summit", "summits", "radius", [1, 2], 3, above=0)
as_item_array("summit", "summits", "radius", [1, 0], 2, above=0)
as_item_array("summit", "summits", "radius", "high", None, above=0)
as_item_array("summit", "summits", "radius", "5", None, above=0)
as_item_array("summit", "summits", "radius", True, None, above=0)
as_item_array("summit", "summits", "radius", [1, 2j], None, above=0)
as_floats("summit_height", ["1 µm", "1 N"])
scalar("normal_load", "-50 mN", least=0)
build_grid({})
build_grid({"a": 1})
build_grid({"a": {"from": 1, "cuont": 2}})
build_grid({"a": {"from": 1.5, "count": 2}})
build_grid({"a": {"from": "1 nm", "to": "2 µm", "count": 2}})
build_grid({"a": {"from": 0, "to": 2, "count": 2, "spacing": "logarithmic"}})
build_grid({"a": [1], "b": [2]}, [["a", "c"]])
build_grid({"a": [1], "b": [2], "c": [3]}, [["a", "b"], ["b", "c"]])
build_grid({"a.b": [1], "a_b": [2]})
build_grid({"a": range(2000), "b": range(2000)})
text_with_values("title = 'a'", {"title.x": 1})
text_with_values("a = {}", {"a[0]": 1})
notch(np.array([0, 1, 2, 4.0]), np.zeros(4), 0.3)
low_pass(time, swing, 260.0)
running_median(swing, 4)
sampling_rate(time[:1])
offset_of_cycles(swing[:3], dead_band=0.1)
drift_of_cycles(time, swing, dead_band=0.1)
hs.random_surface((8, 8, 8), 1e-6, 1e-6, 3e-6, seed=1)
hs.random_surface((2**15, 2**14), 1e-6, 1e-6, 3e-6, seed=1)
hs.random_surface((8, 8), 1e-6, -1e-6, 3e-6, seed=1)
hs.random_surface((8, 8), 1e-6, [1e-6, 2e-6], 3e-6, seed=1)
hs.random_surface((8, 8), 1e-6, 1e-6, (3e-6, 4.1e-6), seed=1)
hs.random_surface((8, 8), 1e-6, 1e-6, 3e-6, seed=True)
hs.Summits([1, nan], 1)
hs.Summits([1], -1)
hs.Summits([[1, 2]], 1)
hs.Summits([1, 2], 1, None, [inf, 2])
hs.Summits("high", 1)
hs.Summits(0.0, 1e-6, 0.0, 0.0).meeting(hs.Summits(0.0, 1e-6))
hs.Summits(0.0, 1e-6, 0.0, 0.0).meeting(hs.Summits(0.0, 1e-6, 1.0, 0.0))
hs.textured_summits((2, 2), 1, 1, height_scatter=1.0)
hs.textured_summits((2, 2), 1, 1, radius_scatter=20, seed=1)
hs.textured_summits(4, 1, 1)
hs.textured_summits((10**4, 10**4), 1, 1)
Gaussian(0.0)
Gaussian(1.0).quantile([0.5, 1])
Tabulated([0, 1, 1], [1, 1, 1])
Tabulated([0, 1], [1, -1])
quantile_summits(Gaussian(1.0), 1.0, summit_density=-1.0, nominal_area=1.0)
drawn_summits(Gaussian(1.0), 1.0, summit_density=1.0, nominal_area=1.0, seed=-1)
hs.Surface([[1, 2], [3]], 1)
hs.Surface([["1 nm", "2 K"]], 1)
hs.Surface(None, 1)
hs.Surface(np.zeros((2, 2, 2)), 1)
hs.Surface([nan, nan], 1)
flat.on_ball(0)
flat.on_ball(4e-6)
flat.at_resolution(1e-4)
flat.cropped(x=(2e-6, 1e-6))
flat.cropped(x="all")
flat.scaled(1e-6)
flat.smoothed(0.9e-6)
flat.summits(4)
flat.form("polynomial")
flat.form("plane", 1)
flat.form("polynomial", 13)
flat.form("sphere")
flat.combined(flat, shift=1.0)
flat.combined(flat, rotation=nan)
flat.combined(flat, interpolation="fourrier")
flat.combined(flat, interpolation="fourier")
flat.combined(flat, shift=(1, 0))
hs.Surface(np.zeros(5), 1.0).combined(hs.Surface(np.zeros(5), 1.0), rotation=0.1)
rough.autocorrelation().length("z")
rough.autocorrelation().length("x", 1.0)
hs.register_maps(hs.Surface(np.arange(9.0), 1.0), hs.Surface(np.arange(9.0), 1.0))
turning_points([0, nan, 1])
turning_points([[1, 2]])
turning_points([0, 1], -1)
kept_points([0, 1], [1])
resample([0, 0], [1, 2], [0])
loops_of_channels(time, swing, swing, dead_band=3)
loops_of_channels(time, swing, swing, dead_band=0.1, skip=1)
loops_of_channels(time, swing, swing, dead_band=0.1, skip=0.5)
loops_of_channels(time, swing, swing, dead_band=0.1, definitions=0.5)
loops_of_channels(time, swing, swing, swing[:3], dead_band=0)
loops_of_channels(-time, swing, swing, dead_band=0)
loops_of_channels(time, 0 * swing, swing)
Definitions(reached=1.5)
sliding_of_channels(time, swing, 1 + 0 * time, np.abs(time - 2))
sliding_of_channels(time, 1 + time, -1 - time, time)
sliding_of_channels(time, swing, 1 + 0 * time, over="distance")
sliding_of_channels(time, swing, 1 + 0 * time, windows=2.5)
hs.sliding(3.0)
hs.loops(None)
hs.compare(None)
hs.fit({})
hs.load(None)
hs.show(3)
hs.show(flat, pixel_size=1.0)
hs.report(ball.asperity(0, ball.initial_state()))
hs.plot(history, picture="lop")
hs.plot(history, picture="loops", step=3)
hs.plot(history, picture="traction", asperity=9)
hs.plot(history, picture="hodograph")
hs.plot(history, picture="wear")
hs.plot(history, size=(1, 1))
hs.plot(history, panels=("loops",))
hs.plot(history, pictures="loop")
hs.plots.traction(history, acros="radius")
hs.plots.traction(history, fronts=True, letters=["s"] * 9)
hs.plots.traction(history, ellipse_at=0)
hs.plots.loops(history, colour="stick")
hs.plots.loops(history, labels=["one", "two"])
hs.plots.loops(history, drive=True)
hs.plots.summits([])
hs.plots.summits([hs.Summits(0.0, 1.0)], labels=["one", "two"])
hs.plots.curve(sweep, quantity="height")
hs.plots.curve(sweep, quantity="drift", over="seed", each="seed")
hs.plots.curve(sweep, quantity="drift", spread="variance")
hs.plots.curve(sweep, quantity="drift", fit="cubic")
hs.plots.adhesion_map({"tip": (1.0,)})
hs.plots.adhesion_map({"tip": (-1.0, 1.0)})
history.contact.asperity(9)
history.contact.asperity(0, 500)
history.contact.asperity(0, step=1, time=0.0)
history.contact.profiles(0, 0, points=1)
history.contact.profiles(0, [])
history.contact.drift("hold", 0)
hs.write_csv(xr.Dataset({"a": 1.0}), "t.csv")
hs.write_fmu(job, "a.fmu", fmi=1)
hs.write_fmu(job, "a.fmu", normal="weight")
hs.write_fmu(job, "a.fmu", platforms=["amiga"])
hs.write_fmu(job, "a.fmu", at=nan)
hs.write_fmu(job, "a.fmu", directions=3)
hs.reduce(job, elements=0)
hs.reduce(job, elements=2.5)
hs.reduce(job, normal_load=-1.0)
hs.run("s.toml", threads=0)
hs.sweep("s.toml")
hs.sweep("s.toml", {"surface.radius": ["1 mm", "2 N"]})
hs.sweep("s.toml", {"loading.waypoints[3].time": [1]})
hs.sweep("s.toml", {"friction.coefficient": [0.1]}, outputs=["drfit"])
hs.sweep("s.toml", {"friction.coefficient": [0.1]}, workers=0)
hs.sweep("s.toml", {"friction.coefficient": [0.1]}, executor=3)
hs.design("s.toml")
hs.design("s.toml", "surface.radius")
hs.design("s.toml", "surface.radius", [1, 2])
hs.design("s.toml", "surface.radius", [2, 1], 1e-9)
hs.design("s.toml", "surface.radius", [1, "1 N"], 1e-9)
hs.design("s.toml", "materials.first", ["silicon", "silica"], 1e-9)
hs.design("s.toml", "surface.radios", [1, 2], 1e-9)
hs.design("s.toml", "surface.radius", [1, 2], 1e-9, output="drfit")
hs.design("s.toml", "surface.radius", [1, 2], below=1e-9, quantile=1)
hs.design("s.toml", "surface.radius", [1, 2], 1e-9, below=1e-9)
""".strip().splitlines()


def names():
    """Return the names that the expressions use."""
    pair = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=8e9)
    ball = hs.Ensemble(pair, [0.0, -1e-9], 1e-3, 0.2)
    job = hs.Replay(
        ball, [hs.NormalLoad(0.0, 0.01), hs.TangentialDisplacement(1.0, 1e-8)], substeps=4
    )
    sweep = xr.Dataset(
        {"drift": (("load", "seed"), np.ones((2, 2)))}, {"load": [1.0, 2.0], "seed": [1, 2]}
    )
    return {
        **{name: value for module in MODULES for name, value in vars(module).items()},
        "hs": hs,
        "np": np,
        "xr": xr,
        "nan": np.nan,
        "inf": np.inf,
        "flat": hs.Surface(np.zeros((10, 10)), 1e-6),
        "rough": hs.Surface(np.eye(4), 1e-6),
        "time": np.arange(5.0),
        "swing": np.array([0.0, 1.0, -1.0, 1.0, 0.0]),
        "ball": ball,
        "job": job,
        "history": job.dataset(),
        "sweep": sweep,
    }


def all_messages(folder):
    """Yield the message of each expression below the expression."""
    known = names()
    with contextlib.chdir(folder):
        Path("s.toml").write_text(BALL, encoding="utf-8")
        for case in CASES:
            with pytest.raises((hs.InputError, hs.LoadError)) as refused:
                eval(case, known)  # noqa: S307 - written above
            yield f"{case}\n    {refused.value}\n"
        assert [path.name for path in folder.iterdir()] == ["s.toml"]


def test_messages_are_those_of_the_reviewed_file(tmp_path):
    assert "\n".join(all_messages(tmp_path)) == GOLDEN.read_text(encoding="utf-8")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        GOLDEN.write_text("\n".join(all_messages(Path(folder))), encoding="utf-8")
