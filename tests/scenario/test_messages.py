"""Messages about scenarios whose keys contradict one another or their files, compared with messages.txt.

Wrong types, units and names of single keys are in test_schema_errors.py. The file is reviewed in
diffs; after an intended change, or for a further case, whose first line is added to it,
``PYTHONPATH=tests/support python tests/scenario/test_messages.py`` writes it again.
"""

import ast
import re
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
# a line of the file: name of a scenario, and the values of its keys
CASES = re.compile(rf"^({'|'.join(BASES)}) (\{{.*\}})$", re.MULTILINE)


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
    for base, values in CASES.findall(GOLDEN.read_text(encoding="utf-8")):
        (folder / "s.toml").write_text(BASES[base], encoding="utf-8")
        with pytest.raises(hs.InputError) as refused:
            use(folder / "s.toml", ast.literal_eval(values))
        yield f"{base} {values}\n    {refused.value}\n".replace(str(folder), "FOLDER")


def test_messages_are_those_of_the_reviewed_file(tmp_path):
    assert "\n".join(all_messages(tmp_path)) == GOLDEN.read_text(encoding="utf-8")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        GOLDEN.write_text("\n".join(all_messages(Path(folder))), encoding="utf-8")
