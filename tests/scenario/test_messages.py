"""Messages about scenarios whose keys contradict one another or their files, compared with messages.txt.

Wrong types, units and names of single keys are in test_schema_errors.py. The file is reviewed in
diffs; after an intended change ``PYTHONPATH=tests/support python tests/scenario/test_messages.py``
writes it again.
"""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from records import scenario_text, write_columns
from sections import LINES, SECTIONS, SHORT, section, write_files

import historysim as hs

GOLDEN = Path(__file__).with_name("messages.txt")
SPHERE = 'surface = { kind = "sphere", radius = "2.5 mm" }\nmaterials = { first = "silicon", second = "silica" }\n'
WAYPOINTS = (
    SPHERE
    + "friction = { coefficient = 0.2 }\nloading = { waypoints = [{ time = 0, normal_load = 0.01 }] }\n"
)
BLOCKS = (
    SPHERE
    + """friction = { coefficient = 0.2 }
[[loading.blocks]]
each = { after = 1, normal_load = [0.01, 0.02] }
waypoints = [{ after = 1, tangential_load = 0.001 }]
"""
)
MEASURED = scenario_text(
    response={"tangential_load": '"T"'}, more='[fit]\nparameters = ["friction"]\n'
)
BASES = {
    "waypoints": WAYPOINTS,
    "blocks": BLOCKS,
    "measured": MEASURED,
    **{name: section(SECTIONS[name]) + LINES for name in ("random", "sum", "inclined summits")},
    "map": section(SECTIONS["measured"]) + LINES,
    "table": section(SHORT["summit table"]) + LINES,
    "textured": section(SHORT["textured"]) + LINES,
}
NORMAL, MOVED = "loading.columns.normal_load", "loading.columns.tangential_displacement"
POINT = "loading.waypoints[0]"
CASES = [
    ("waypoints", {POINT: {"time": 0}}),
    ("waypoints", {POINT: {"normal_load": 1}}),
    ("waypoints", {f"{POINT}.normal_displacement": 1}),
    ("waypoints", {"loading.substeps": 900_000_000}),
    ("waypoints", {"record.asperities": [1]}),
    ("waypoints", {f"{POINT}.friction": [1, 2, 3]}),
    ("waypoints", {f"{POINT}.asperities": [0]}),
    ("waypoints", {f"{POINT}.geometry": {"asperities": [0]}}),
    ("waypoints", {"materials.shear_modulus": 1}),
    ("waypoints", {"materials": {"contact_modulus": 1}}),
    ("waypoints", {"loading.waypoints": [{"time": 0, "normal_load": 1, "name": "K"}] * 2}),
    ("waypoints", {"friction.shear_strength": "1 MPa"}),
    ("waypoints", {"surface.yielding": "thorton"}),
    ("waypoints", {"surface.yielding": {"hardness": 1}}),
    ("waypoints", {"surface.height_scale": 2, "surface.interaction": "full"}),
    ("waypoints", {"fit.parameters": ["friction"]}),
    ("waypoints", {"picture": {"kind": "bars", "quantity": "drift", "groups": {"a": "b"}}}),
    ("waypoints", {"picture.work": True}),
    ("waypoints", {"sweep.over.a": [1], "sweep.together": [["a", "c"]]}),
    ("waypoints", {"sweep.over": {"a": {"from": "1 nm", "to": "2 µm", "count": 2}}}),
    ("waypoints", {"title.x": 1}),
    ("waypoints", {"loading.waypoints[2].time": 1}),
    ("blocks", {"loading.blocks[0].repeat": 1_000_000_000}),
    ("blocks", {"loading.blocks[0].each.friction": [0.1]}),
    ("blocks", {"loading.blocks[0].waypoints[0].time": 1}),
    ("blocks", {"loading.blocks[0].waypoints[0].name": "K"}),
    ("measured", {"loading.file": "none.csv"}),
    ("measured", {"loading.columns.time": "tt"}),
    ("measured", {"loading.file": "uneven.csv"}),
    ("measured", {"loading.file": "pulled.csv"}),
    ("measured", {"loading.file": "comma.txt"}),
    ("measured", {"loading.file": "back.csv"}),
    *(
        ("measured", {"loading.file": "repeated.csv", key: value})
        for key, value in (
            ("loading.interval", 1),
            (f"{MOVED}.drift_free", True),
            (f"{MOVED}.shift", 1),
        )
    ),
    ("measured", {"loading.start": 100}),
    ("measured", {"loading.start": 5, "loading.end": 1}),
    ("measured", {"loading.run": 4}),
    ("measured", {"loading.run": "each"}),
    ("measured", {"loading.rate": "400 Hz"}),
    ("measured", {"loading.block": [1, 2]}),
    ("measured", {NORMAL: {"column": "N", "unit": "mm"}}),
    ("measured", {NORMAL: {"column": "N", "time": {"column": "t", "unit": "mm"}}}),
    ("measured", {NORMAL: {"column": "N", "time": "u"}}),
    ("measured", {NORMAL: {"column": "N", "centred": True}}),
    ("measured", {NORMAL: {"column": "N", "constant": 1}}),
    ("measured", {NORMAL: {"constant": "-1 N"}}),
    ("measured", {NORMAL: {"column": 0}}),
    ("measured", {NORMAL: {"column": "N", "occurrence": 0}}),
    ("measured", {NORMAL: {"difference": ["N", "T", "u"]}}),
    ("measured", {NORMAL: {"sum": ["N", "T"], "column": "N"}}),
    ("measured", {NORMAL: {"column": "T", "times": "Fn"}}),
    ("measured", {NORMAL: {"column": "T", "times": "normal_load"}}),
    ("measured", {NORMAL: {"column": "N", "retrace": "T", "shift": 1}}),
    ("measured", {f"{MOVED}.closing_load": 1}),
    ("measured", {f"{MOVED}.low_pass": 200}),
    ("measured", {f"{MOVED}.median": 4}),
    ("measured", {"loading.columns.tangential_load": "T"}),
    ("measured", {"loading.response.tangential_displacement": "T"}),
    (
        "measured",
        {"loading.response.normal_displacement": {"column": "u", "unit": "nm", "free_play": 1}},
    ),
    ("measured", {"fit.parameters": ["lateral_stiffness"]}),
    ("measured", {"fit.parameters": ["height_scale"]}),
    ("measured", {"fit.parameters": ["displacement_offset"], f"{MOVED}.centred": True}),
    ("random", {"surface.s_filter": "0.1 µm"}),
    ("random", {"surface.ball_radius": "1 µm"}),
    ("map", {"surface.file": "maps"}),
    ("map", {"surface.height_unit": "mN"}),
    ("map", {"surface.form": "polynomial"}),
    ("map", {"surface.file": "bowl.txt", "surface.form": "mean", "surface.rule": 9}),
    ("table", {"surface.file": "radius.csv"}),
    ("table", {"surface.columns.radius": "Q"}),
    ("table", {"surface.columns.friction": "z"}),
    ("textured", {"surface.count": [3, 0]}),
    ("textured", {"surface.height_scatter": 1e-9}),
    (
        "sum",
        {
            "surface.shift": [1, 1],
            "surface.first": SHORT["measured"],
            "surface.second": SHORT["measured"],
        },
    ),
    ("sum", {"surface.second.ball_radius": 1}),
    ("inclined summits", {"surface.slope": [1.0, -9.0]}),
    ("inclined summits", {"surface.yielding": "thornton"}),
]


def write_records(folder):
    """Write the files that the cases name."""
    write_files(folder)
    write_columns(
        folder / "m.csv", t=np.arange(15), N=np.ones(15), u=np.sin(np.arange(15)), T=np.zeros(15)
    )
    write_columns(
        folder / "back.csv", t=[0, 1, 0.5, 3], N=np.ones(4), u=[0, 1, 2, 4], T=np.zeros(4)
    )
    write_columns(
        folder / "repeated.csv", t=[0, 1, 1, 3], N=np.ones(4), u=[0, 1, 2, 4], T=np.zeros(4)
    )
    write_columns(folder / "pulled.csv", t=[0, 1], N=[1, -1], u=[0, 1], T=[0, 0])
    (folder / "uneven.csv").write_text("t,N,u,T\n0,1,0,0\n1,1\n", encoding="utf-8")
    (folder / "comma.txt").write_text("t;N;u;T\n0;1,5;0;0\n", encoding="utf-8")
    (folder / "radius.csv").write_text("z,R\n0,1e-5\n\n1,-1e-5\n", encoding="utf-8")
    np.savetxt(
        folder / "bowl.txt", np.add.outer(np.linspace(-1, 1, 7) ** 2, np.linspace(-1, 1, 9) ** 2)
    )


def use(path, values):
    """Build a scenario with other values, read its record and fit it."""
    scenario = hs.load(path, values)
    scenario.build()
    scenario.measurement()
    hs.fit(scenario)


def all_messages(folder):
    """Yield the message of each case below the case."""
    write_records(folder)
    for base, values in CASES:
        (folder / "s.toml").write_text(BASES[base], encoding="utf-8")
        with pytest.raises(hs.InputError) as refused:
            use(folder / "s.toml", values)
        yield f"{base} {values}\n    {refused.value}\n".replace(str(folder), "FOLDER")


def test_messages_are_those_of_the_reviewed_file(tmp_path):
    assert "\n".join(all_messages(tmp_path)) == GOLDEN.read_text(encoding="utf-8")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        GOLDEN.write_text("\n".join(all_messages(Path(folder))), encoding="utf-8")
