"""Scenarios and tables that are good, and hypothesis strategies that break them."""

import tomllib

from hypothesis import strategies as st

from historysim.scenario.loading_kinds import inline
from historysim.surfaces import distribution, random

SPHERE = """
[materials]
contact_modulus = 1.0
shear_modulus = 0.25
[surface]
kind = "sphere"
radius = 1.0
[friction]
coefficient = 0.5
"""

WAYPOINTS = (
    SPHERE
    + "[loading]\nwaypoints = [{ time = 0, normal_load = 0.01 }, { after = 1, tangential_load = 0.003 }]\n"
)

BLOCKS = """
title = "four loops of ±100 nm at each of 50, 70 and 90 mN"
[materials]
first = "silicon"
second = { name = "glass", youngs_modulus = "64 GPa", poissons_ratio = 0.2, shear_modulus = "26 GPa" }
[surface]
kind = "summits"
height = ["0 nm", "10 nm", 2e-8]
radius = "20 µm"
x = [0, 1e-5, 2e-5]
y = [0, 0, 0]
[friction]
coefficient = [0.1, 0.2, 0.3]
[[loading.blocks]]
each = { after = "1 s", normal_load = ["50 mN", "70 mN", "90 mN"] }
repeat = 4
waypoints = [
    { after = "250 ms", tangential_displacement = "100 nm" },
    { after = "500 ms", tangential_displacement = "-100 nm" },
    { after = "250 ms", tangential_displacement = 0 },
]
[record]
asperities = [0, 2]
"""

MEASURED = """
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "summits"
file = "summits.csv"
[surface.columns]
height = { column = "z", unit = "nm" }
radius = "R"
friction = "mu"
[loading]
file = "loads.csv"
delimiter = ";"
substeps = 2
saturate = true
[loading.columns]
time = "t"
normal_load = { column = "N", unit = "mN" }
tangential_displacement = { column = "U", unit = "nm" }
[record]
asperities = "totals"
"""

PRESSED = """
[materials]
contact_modulus = "40 GPa"
shear_modulus = "10 GPa"
[friction]
coefficient = 0.2
[loading]
waypoints = [{ time = 0, normal_load = "1 mN" }, { after = 1, tangential_displacement = "5 nm" }]
"""

TEXTURED = f"""{PRESSED}
[surface]
kind = "textured"
count = [4, 3]
pitch = ["10 µm", 1e-5]
radius = "2 µm"
scaling = "self-similar"
height_scatter = "1 nm"
radius_scatter = 0.1
seed = 1
"""

GAUSSIAN = f"""{PRESSED}
[surface]
kind = "statistics"
radius = "2 µm"
summit_density = "0.01 µm-2"
nominal_area = "2000 µm2"
rms_height = "10 nm"
"""

DENSITY = f"""{PRESSED}
[surface]
kind = "statistics"
file = "density.csv"
radius = "2 µm"
summit_density = 1e10
nominal_area = 2e-9
seed = 3
[surface.columns]
gap = {{ column = "g", unit = "nm" }}
density = "p"
"""

RANDOM = f"""{PRESSED}
[surface]
kind = "random"
shape = [16, 12]
pixel_size = ["1 µm", "2 µm"]
rms_height = "10 nm"
autocorrelation_length = ["4 µm", 4e-6]
autocorrelation = "gaussian"
seed = 1
rule = 5
"""

ROUGH_ON_ROUGH = f"""{PRESSED}
[surface]
kind = "sum"
shift = ["1 µm", 0]
rotation = "10 degree"
[surface.first]
kind = "random"
shape = [9, 8]
pixel_size = 1e-6
rms_height = 1e-8
autocorrelation_length = 4e-6
seed = 1
[surface.second]
kind = "measured"
file = "map.txt"
pixel_size = "1 µm"
height_unit = "nm"
form = "quadratic"
rms_height = "5 nm"
mirrored = true
"""

SURFACES = [TEXTURED, GAUSSIAN, DENSITY, RANDOM, ROUGH_ON_ROUGH]
DOCUMENTS = [WAYPOINTS, BLOCKS, MEASURED, *SURFACES]

SUMMITS_CSV = "z,R,mu\n0,1e-5,0.2\n12.5,2e-5,0.1\n"
LOADS_CSV = "t;U;N\n0;0;50\n\n0.5;100;50\n1.0;-100;50.5\n"
DENSITY_CSV = "g,p\n0,1\n5,2\n20,0\n"
MAP_TXT = "# a map\n" + "0 1 0 3 0 1 2 0 1\n1 9 2 0 1 0 1 3 0\n0 2 1 4 8 2 0 1 nan\n" * 3
FILES = {
    "summits.csv": SUMMITS_CSV,
    "loads.csv": LOADS_CSV,
    "density.csv": DENSITY_CSV,
    "map.txt": MAP_TXT,
}

WORDS = [
    "time",
    "after",
    "normal_load",
    "first",
    "coefficient",
    "kind",
    "file",
    "columns",
    "waypoints",
    "each",
    "x",
    "seed",
    "rule",
    "height",
    "second",
]
WORDS.append("")
VALUES = st.one_of(
    st.booleans(),
    st.integers(),
    st.sampled_from([0, -1, 10**400, 10**30, 2**63]),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(
        [
            "50 mN",
            "1e999 N",
            "-3 nm",
            "silicon",
            "summits",
            "sphere",
            "totals",
            "loads.csv",
            "sum",
            "map.txt",
            "1 µm",
            "§",
        ]
    ),
    st.dates(),
    st.datetimes(),
    st.lists(st.one_of(st.integers(), st.text(max_size=3), st.floats()), max_size=3),
    st.sampled_from([1e-300, 1e300, 5e-324, 1.7e308, 1e-9]),
    st.dictionaries(
        st.sampled_from(WORDS), st.one_of(st.integers(), st.text(max_size=3)), max_size=3
    ),
)


def keep_small(monkeypatch):
    """Let what is larger than any test needs be refused, as what is larger than any machine holds is."""
    for module, name in (
        (inline, "MOST_EVENTS"),
        (distribution, "MOST_SUMMITS"),
        (random, "MOST_POINTS"),
    ):
        monkeypatch.setattr(module, name, 1000)
    monkeypatch.setenv("HISTORYSIM_MOST_STEPS", "1000")


def toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return (
            '"'
            + "".join(
                f"\\U{ord(letter):08x}" for letter in value if not 0xD800 <= ord(letter) < 0xE000
            )
            + '"'
        )
    return (
        value.isoformat()
        if hasattr(value, "isoformat")
        else hex(value)
        if value_is_huge(value)
        else str(value)
    )


def value_is_huge(value):
    return isinstance(value, int) and value > 2**62


def places(value, path=()):
    yield path
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, item in items:
        yield from places(item, (*path, key))


@st.composite
def broken_documents(draw):
    document = tomllib.loads(draw(st.sampled_from(DOCUMENTS)))
    for _ in range(draw(st.integers(1, 4))):
        path = draw(st.sampled_from([place for place in places(document) if place]))
        *above, key = path
        holder = document
        for step in above:
            holder = holder[step]
        action = draw(st.sampled_from(["delete", "duplicate", "replace", "rename"]))
        if action == "delete":
            del holder[key]
        elif action == "replace":
            holder[key] = draw(VALUES)
        elif isinstance(holder, list):
            holder.insert(draw(st.integers(0, len(holder))), holder[key])
        else:
            holder[draw(st.one_of(st.sampled_from(WORDS), st.text(max_size=5)))] = holder[key]
            if action == "rename":
                holder.pop(key, None)
        if not document:
            break
    return "\n".join(f"{toml(key)} = {toml(value)}" for key, value in document.items()).encode()


@st.composite
def broken_bytes(draw, sources):
    content = bytearray(draw(st.sampled_from(sources)).encode())
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(content)))
        stop = draw(st.integers(start, min(len(content), start + 30)))
        content[start:stop] = draw(
            st.one_of(
                st.binary(max_size=5),
                st.sampled_from(
                    [
                        b"nan",
                        b"-",
                        b",",
                        b";",
                        b"\n",
                        b'"',
                        b"[",
                        b"=",
                        b"1e400",
                        b"\0",
                        bytes(content[:stop]),
                    ]
                ),
            )
        )
    return bytes(content[: draw(st.integers(0, len(content)))] if draw(st.booleans()) else content)
