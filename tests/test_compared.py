"""The pages that compare and that say what a run costs: their errors, sizes and lines of Python."""

import re
from pathlib import Path

import numpy as np
import other_laws
import pages
import pytest

import historysim as hs

ROOT = Path(__file__).parents[1]
PAGE, SCALE = (
    (ROOT / "tests" / "benchmarks" / name).read_text(encoding="utf-8") for name in ("compared.md", "scale.md")
)
BLOCK = re.search(r"<!-- errors -->\n(.*?)\n<!-- end -->", PAGE, re.DOTALL)[1]
ROWS = {
    cells[0]: cells[1:]
    for cells in ([*map(str.strip, line.split("|")[1:-1])] for line in BLOCK.splitlines() if "---" not in line)
}
NAMES = ROWS["law"]


def shown(law, name):
    return float(ROWS[law][NAMES.index(name)])


@pytest.mark.parametrize("name", ["loops", "coupled", pytest.param("steps", marks=pytest.mark.slow)])
def test_errors_of_the_page_are_those_of_the_laws(name):
    course = other_laws.course(name, ROOT)
    expected, bound = other_laws.reference(course)
    assert {"law", "bound of the reference", *other_laws.LAWS} == set(ROWS)
    for law, run in other_laws.LAWS.items():
        # two digits are printed; what historysim differs by is the rounding of the reference's own error
        assert other_laws.error(course, run(course), expected) == pytest.approx(shown(law, name), rel=0.06), law
    assert bound / course.limit.sum(axis=1).max() == pytest.approx(shown("bound of the reference", name), rel=0.06)
    assert shown("historysim", name) < shown("bound of the reference", name)


def test_the_difference_is_that_of_the_reference():
    course = other_laws.course("coupled", ROOT)
    few, many = (other_laws.error(course, course.found, other_laws.reference(course, n)[0]) for n in (500, 4000))
    # second order, with phases that jump about
    assert many < few / 8


def test_the_lines_of_the_page_are_the_coupled_history():
    names, _ = pages.type_in(PAGE)
    assert names["coupled"].total_tangential_load.identical(other_laws.coupled().total_tangential_load)


def test_a_chunk_of_asperities_alone_is_as_in_the_whole():
    names, _ = pages.type_in(SCALE)
    whole = hs.replay(names["whole"], names["events"], record="all")
    expected = whole.tangential_load.sel(asperity=names["chunk"]).values
    # depths are differences of lengths of nanometres
    np.testing.assert_allclose(names["chunk_history"].tangential_load, expected, atol=1e-13 * np.abs(expected).max())


def test_a_file_has_as_many_bytes_as_the_page_says(tmp_path):
    contact = hs.Ensemble(hs.MaterialPair.from_moduli(contact_modulus=1, shear_modulus=1), np.zeros(2000), 1.0, 0.2)
    events = [hs.NormalLoad(0.0, 1.0), hs.TangentialLoad(1.0, 0.1)]
    sizes = {}
    for record in ("totals", "all"):
        for steps in (100, 200):
            path = tmp_path / f"{record}{steps}.nc"
            hs.Replay(contact, events, record=record, substeps=steps).write(path)
            sizes[record, steps] = path.stat().st_size
    assert sizes["all", 200] - sizes["all", 100] == pytest.approx(41 * 2000 * 100, rel=0.01)
    assert sizes["totals", 200] - sizes["totals", 100] == pytest.approx(90 * 100, rel=0.15)
