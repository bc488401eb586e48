"""Leaf modules: nothing in the core imports them."""

import pytest
from import_graph import ROOT, package_imports

LEAVES = {
    "FMU": ["exchange/fmu"],
    "reduced models": ["exchange/reduced"],
    "report": ["results/report"],
    "gallery": ["studies/gallery.py"],
    "design studies": ["studies/design.py"],
    "adhesion theory": [
        "contact/adhesion*",
        "asperities/adhering.py",
        "results/plots/adhesion*.py",
    ],
    "solvers and batches": ["coupling.py", "asperities/contact_batch.py"],
}
COMMANDS = "cli"  # may import any package where a command is called
# How modules begin that import a leaf on request, except commands.
CALLERS = {
    # types register their pages
    "report": ("verbs", "scenario.fit", "scenario.runs", "studies.gallery", "exchange.reduced."),
    "design studies": ("studies.validation",),
    "adhesion theory": ("scenario.scenario", "scenario.figure", "scenario.picture_section"),
}


def files_of(leaf):
    found = [path for pattern in LEAVES[leaf] for path in ROOT.glob(pattern)]
    assert len(found) >= len(LEAVES[leaf]), f"{leaf} has moved"
    return found


@pytest.mark.ci
@pytest.mark.parametrize("leaf", LEAVES)
def test_nothing_in_the_core_imports_a_leaf(leaf):
    inside = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in files_of(leaf)}

    def is_inside(name):
        return any(name == one or name.startswith(f"{one}.") for one in inside)

    allowed = (f"{COMMANDS}.", *CALLERS.get(leaf, ()))
    found = [
        name
        for name, (own, _) in package_imports().items()
        if not is_inside(name) and any(map(is_inside, own))
    ]
    assert [name for name in found if not name.startswith(allowed)] == []
