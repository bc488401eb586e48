"""The pages on other programs and on the cost of a run: their errors, sizes and lines of Python."""

import json
import re
from pathlib import Path

import compared
import make_paper
import numpy as np
import score
from pytest import approx, mark, param

import historysim as hs

ROOT = Path(__file__).parents[1]
PAGE, SCALE = (
    (ROOT / "tests" / "benchmarks" / name).read_text(encoding="utf-8")
    for name in ("compared.md", "scale.md")
)
BLOCK = re.search(r"<!-- scores -->\n(.*?)\n<!-- end -->", PAGE, re.DOTALL)[1]


def rows_of(text):
    return [
        [*map(str.strip, line.split("|")[1:-1])] for line in text.splitlines() if "---" not in line
    ]


def numbers(cell):
    return [None if text == "–" else float(text) for text in cell.split(" / ")]


@mark.parametrize("every", [3, param(1, marks=mark.slow)])
def test_errors_of_the_page_agree_with_the_laws(every):
    shown = rows_of(BLOCK)
    names = score.list_cases()
    assert [row[0] for row in shown[1:]] == names
    found = rows_of(compared.format_scores(compared.score_laws(names[::every])))
    assert shown[0] == found[0]
    for before, now in zip(shown[1::every], found[1:], strict=True):
        for old, new in zip(before[1:], now[1:], strict=True):
            for was, value in zip(numbers(old), numbers(new), strict=True):
                # two digits are printed; what is exact has errors of rounding
                assert (was is None) == (value is None), before[0]
                assert was is None or max(was, value) < 1e-8 or value == approx(was, rel=0.12), (
                    before[0]
                )


def test_the_paper_has_the_numbers_of_its_results():
    results = json.loads(make_paper.RESULTS.read_text(encoding="utf-8"))
    assert make_paper.PAGE.read_text(encoding="utf-8") == make_paper.write_page(results)
    assert make_paper.score_codes() == results["codes"]
    text = make_paper.TEXT.read_text(encoding="utf-8")
    measured = text[text.index("## The memory") : text.index("## Make it again")]
    # all that is measured comes by name: what is left are counts, names and full slip
    written = re.findall(r"\d+\.\d+", re.sub(r"\{\w+\}", "", measured))
    assert set(written) <= {"0.7", "0.3"}
    shown = set(re.findall(r"pictures/(\w+)\.png", text))
    assert shown == set(make_paper.FIGURES)
    for name in shown:
        assert (make_paper.PICTURES / f"{name}.png").exists()


def test_the_paper_is_right_on_steps():
    results = json.loads(make_paper.RESULTS.read_text(encoding="utf-8"))["steps"]
    found = make_paper.measure_steps(make_paper.STEPS[:5])
    for law in ("vector_springs", "mindlin_deresiewicz", "slider"):
        assert found[law] == approx(results[law][:5], rel=1e-6)
    assert max(found["historysim"]) < 1e-12


def test_a_file_has_as_many_bytes_as_the_page_says(tmp_path):
    contact = hs.Ensemble(
        hs.MaterialPair.from_moduli(contact_modulus=1, shear_modulus=1), np.zeros(2000), 1.0, 0.2
    )
    events = [hs.NormalLoad(0.0, 1.0), hs.TangentialLoad(1.0, 0.1)]
    sizes = {}
    for record in ("totals", "all"):
        for steps in (100, 200):
            path = tmp_path / f"{record}{steps}.nc"
            hs.Replay(contact, events, record=record, substeps=steps).write(path)
            sizes[record, steps] = path.stat().st_size
    assert sizes["all", 200] - sizes["all", 100] == approx(41 * 2000 * 100, rel=0.01)
    assert sizes["totals", 200] - sizes["totals", 100] == approx(90 * 100, rel=0.15)
