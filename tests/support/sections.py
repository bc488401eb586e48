"""A ``[surface]`` of each kind, whole scenarios around them, and the files that they name."""

import numpy as np
from broken import toml

from historysim.scenario import scenario

RADIUS = 2e-6
AMOUNT = {"summit_density": 1e10, "nominal_area": 2.5e-9}
ROUGH = {
    "shape": [24, 17],
    "pixel_size": [1e-6, 2e-6],
    "rms_height": 1e-8,
    "autocorrelation_length": [4e-6, 5e-6],
    "seed": 3,
}
OTHER = {**ROUGH, "seed": 4, "shape": [20, 20]}
TABLE_HEIGHTS, DENSITY = [-1e-8, 0.0, 3e-8], [1.0, 4.0, 0.5]

# a section of each kind, by a name
SECTIONS = {
    "sphere": {"kind": "sphere", "radius": RADIUS},
    "inline summits": {
        "kind": "summits",
        "height": [0.0, -1e-8],
        "radius": [1e-6, 2e-6],
        "x": [0.0, 1e-5],
        "y": 0.0,
    },
    "inclined summits": {
        "kind": "summits",
        "height": [0.0, -1e-8],
        "radius": 1e-6,
        "slope": [0.1, -0.2],
    },
    "summit table": {
        "kind": "summits",
        "file": "summits.csv",
        "columns": {"height": {"column": "z", "unit": "nm"}, "radius": "R", "x": "x", "y": "y"},
        "delimiter": ";",
    },
    "textured": {
        "kind": "textured",
        "count": [3, 4],
        "pitch": [1e-5, 2e-5],
        "radius": RADIUS,
        "scaling": "self-similar",
        "height_scatter": 1e-9,
        "radius_scatter": 0.2,
        "seed": 5,
    },
    "gaussian statistics": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "rms_height": 1e-8,
        "seed": 2,
    },
    "inline statistics": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "height": TABLE_HEIGHTS,
        "density": DENSITY,
        "seed": 2,
    },
    "statistics of gaps": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "gap": [0.0, 1e-8],
        "density": [1.0, 0],
    },
    "statistics table": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "file": "density.csv",
        "columns": {"height": {"column": "h", "unit": "nm"}, "density": "p"},
        "delimiter": ",",
        "seed": 2,
    },
    "random": {
        "kind": "random",
        **ROUGH,
        "autocorrelation": "gaussian",
        "rule": 5,
    },
    "measured": {
        "kind": "measured",
        "file": "maps/rough.txt",
        "pixel_size": [1e-6, 2e-6],
        "height_unit": "nm",
        "form": "quadratic",
        "rms_height": 2e-8,
        "mirrored": True,
        "rule": 5,
    },
    "sum": {
        "kind": "sum",
        "first": {"kind": "random", **ROUGH},
        "second": {"kind": "random", **OTHER},
        "shift": [1e-6, 3e-6],
        "rotation": 0.3,
        "interpolation": "spline",
        "rule": 5,
    },
    "meeting": {
        "kind": "meeting",
        "first": {"kind": "random", **ROUGH},
        "second": {"kind": "random", **OTHER},
        "shift": [1e-6, 3e-6],
    },
}
# sections with as few keys as there can be
SHORT = {
    "inline summits": {"kind": "summits", "height": [0.0, -1e-8], "radius": RADIUS},
    "summit table": {
        "kind": "summits",
        "file": "comma.csv",
        "columns": {"height": "z", "radius": "R"},
    },
    "textured": {"kind": "textured", "count": [3, 4], "pitch": 1e-5, "radius": RADIUS},
    "gaussian statistics": {"kind": "statistics", "radius": RADIUS, **AMOUNT, "rms_height": 1e-8},
    "inline statistics": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "height": TABLE_HEIGHTS,
        "density": DENSITY,
    },
    "statistics table": {
        "kind": "statistics",
        "radius": RADIUS,
        **AMOUNT,
        "file": "density.csv",
        "columns": {"gap": "h", "density": "p"},
    },
    "random": {"kind": "random", **ROUGH, "pixel_size": 1e-6, "autocorrelation_length": 4e-6},
    "measured": {
        "kind": "measured",
        "file": "maps/rough.txt",
        "pixel_size": 1e-6,
        "height_unit": "nm",
    },
    "sum": {
        "kind": "sum",
        "first": {"kind": "random", **ROUGH},
        "second": {"kind": "random", **OTHER},
    },
}

LINES = """
[materials]
contact_modulus = 1e9
shear_modulus = 1e9
[friction]
coefficient = 0.2
[record]
asperities = "all"
[loading]
waypoints = [{ time = 0, normal_load = 0 }]
"""


def bumps(shape, seed=0):
    """Rough heights in nm on a bowl, as a text file has them: lines of y, columns of x."""
    y, x = np.indices(shape)
    return np.random.default_rng(seed).normal(size=shape) + 0.02 * (x - 4.0) ** 2 + 0.1 * y


def write_files(folder):
    """Write the files that the sections name."""
    (folder / "maps").mkdir()
    np.savetxt(folder / "maps" / "rough.txt", bumps((14, 11)))
    (folder / "summits.csv").write_text(
        "z;R;x;y;mu\n0;1e-5;0;1e-6;0.2\n12.5;2e-5;3e-6;0;0.1\n", encoding="utf-8"
    )
    (folder / "comma.csv").write_text("z,R\n-1e-8,1e-5\n0,2e-5\n", encoding="utf-8")
    (folder / "density.csv").write_text("h,p\n0,1\n10,4\n40,0.5\n", encoding="utf-8")


def section(entry):
    return "[surface]\n" + "".join(f"{key} = {toml(value)}\n" for key, value in entry.items())


def loaded(folder, entry, lines=LINES):
    path = folder / "s.toml"
    path.write_text(section(entry) + lines, encoding="utf-8")
    return scenario.load(path)
