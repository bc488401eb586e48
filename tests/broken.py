"""Scenarios and tables that are good, and hypothesis strategies that break them."""

import tomllib

from hypothesis import strategies as st

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
    SPHERE + "[loading]\nwaypoints = [{ time = 0, normal_load = 0.01 }, { after = 1, tangential_load = 0.003 }]\n"
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

SUMMITS_CSV = "z,R,mu\n0,1e-5,0.2\n12.5,2e-5,0.1\n"
LOADS_CSV = "t;U;N\n0;0;50\n\n0.5;100;50\n1.0;-100;50.5\n"

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
    "",
]
VALUES = st.one_of(
    st.booleans(),
    st.integers(),
    st.sampled_from([0, -1, 10**400, 10**30, 2**63]),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["50 mN", "1e999 N", "-3 nm", "silicon", "summits", "sphere", "totals", "loads.csv", "§"]),
    st.dates(),
    st.datetimes(),
    st.lists(st.one_of(st.integers(), st.text(max_size=3), st.floats()), max_size=3),
    st.dictionaries(st.sampled_from(WORDS), st.one_of(st.integers(), st.text(max_size=3)), max_size=3),
)


def toml(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(letter):08x}" for letter in value if not 0xD800 <= ord(letter) < 0xE000) + '"'
    return value.isoformat() if hasattr(value, "isoformat") else hex(value) if value_is_huge(value) else str(value)


def value_is_huge(value):
    return isinstance(value, int) and value > 2**62


def places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


@st.composite
def broken_documents(draw):
    document = tomllib.loads(draw(st.sampled_from([WAYPOINTS, BLOCKS, MEASURED])))
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
                    [b"nan", b"-", b",", b";", b"\n", b'"', b"[", b"=", b"1e400", b"\0", bytes(content[:stop])]
                ),
            )
        )
    return bytes(content[: draw(st.integers(0, len(content)))] if draw(st.booleans()) else content)
