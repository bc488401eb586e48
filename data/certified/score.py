"""Score the results of a contact law on the certified load histories; needs numpy alone.

    python score.py RESULT.csv CASE [--tolerance 0.01] [--json]
    python score.py --all FOLDER [--tolerance 0.01] [--json]
    python score.py --page FOLDER     # a page of Markdown: a folder of results for each code

RESULT.csv has the rows and column names of CASE.csv. A folder holds one result for each case, named
CASE.csv. The exit status is 1 unless every case is there, complete, and exact or within tolerance.
An error is the difference of a column over its unit (μN, full slip, μN × full slip), which
CASE.yaml states. A column is exact within ten times the bound of the case.
"""

import argparse
import json
import math
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
PASSING = ("exact", "passes")
# errors of up to so many bounds are exact: the reference cannot tell which of both is wrong
EXACT = 10.0
LEAST_LOAD = 0.1  # of μN; below, the direction of a load means nothing


class ScoreError(ValueError):
    """A result or case that cannot be scored; the message names the file, the problem and the fix."""


def list_cases():
    """Names of all cases, in order."""
    return sorted(path.stem for path in FOLDER.glob("[0-9][0-9]_*.yaml"))


def read_yaml(path):
    """Read a description: `key: value` lines, lists in brackets, and mappings indented by two spaces."""
    settings, section = {}, None
    for line in path.read_text(encoding="utf-8").splitlines():
        key, _, text = line.partition(": ")
        if line.endswith(":") and not line.startswith(" "):
            section = settings[line[:-1]] = {}
        elif line.startswith("  "):
            section[key.strip()] = _value(text)
        elif text:
            settings[key] = _value(text)
    return settings


def _value(text):
    if text.startswith("["):
        return [_value(each.strip()) for each in text[1:-1].split(",")]
    try:
        return float(text)
    except ValueError:
        return text.strip('"')


def read_csv(path):
    """Read named columns of numbers from a file with one header line."""
    try:
        lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as problem:
        raise ScoreError(
            f"{path}: cannot be read ({problem}); expected a CSV file in UTF-8"
        ) from None
    if not lines:
        raise ScoreError(f"{path}: is empty; expected a header line and one line for each waypoint")
    names = [name.strip() for name in lines[0].split(",")]
    if len(set(names)) < len(names):
        raise ScoreError(
            f"{path}: a column name occurs twice in {', '.join(names)}; name each column once"
        )
    columns = np.empty((len(lines) - 1, len(names)))
    for row, line in enumerate(lines[1:]):
        cells = line.split(",")
        if len(cells) != len(names):
            raise ScoreError(
                f"{path}: row {row + 1} has {len(cells)} cells; expected {len(names)}, as in the header"
            )
        for k, cell in enumerate(cells):
            try:
                columns[row, k] = float(cell)
            except ValueError:
                where = f"{cell.strip()!r} in row {row + 1}, column {names[k]}"
                raise ScoreError(
                    f"{path}: {where}; expected a number with a decimal point"
                ) from None
    return dict(zip(names, columns.T, strict=True))


def read_case(name):
    """Read a case: its description and its columns."""
    stem = Path(name).stem
    if stem not in list_cases():
        raise ScoreError(f"{name}: is not a case; expected one of {', '.join(list_cases())}")
    return read_yaml(FOLDER / f"{stem}.yaml"), read_csv(FOLDER / f"{stem}.csv")


def compute_errors(result, name):
    """Largest error of a result by column, over its unit; `result` maps column names to arrays."""
    return {column: largest(each) for column, each in compute_differences(result, name).items()}


def compute_differences(result, name):
    """Differences of a result from the answer by column and row, over the unit of the column."""
    case, answer = read_case(name)
    rows = answer["t"].size
    if not set(case["expected"]) & set(result):
        expected = ", ".join(case["expected"])
        raise ScoreError(
            f"{name}: the result has the columns {', '.join(result)}; expected at least one of {expected}"
        )
    differences = {}
    for column in answer:
        if column not in result:
            continue
        values = np.asarray(result[column], dtype=float)
        if values.shape != (rows,):
            raise ScoreError(
                f"{name}: column {column} has {values.size} rows; expected {rows}, one for each row of {name}.csv"
            )
        if column in case["expected"]:
            differences[column] = (values - answer[column]) / case["units"][column]
            continue
        # the inputs of the case: another path would be scored for nothing
        allowed = 1e-6 * np.abs(answer[column]).max()
        if not np.allclose(values, answer[column], rtol=1e-6, atol=allowed):
            raise ScoreError(
                f"{name}: column {column} is an input of the case and differs; expected that of {name}.csv"
            )
    return differences


def largest(differences):
    """Largest size; infinite if a number is missing."""
    size = np.abs(differences)
    return float(np.where(np.isnan(size), np.inf, size).max(initial=0.0))


def root_mean_square(differences):
    """Root mean square; infinite if a number is missing."""
    mean = float(np.sqrt(np.mean(np.square(differences))))
    return math.inf if math.isnan(mean) else mean


def compute_angle(result, name):
    """Largest error of the direction of the tangential load [degrees]; None along a line."""
    case, answer = read_case(name)
    pair = ("Tx", "Ty")
    if not set(pair) <= set(case["expected"]) & set(result):
        return None
    expected, found = (
        columns[pair[0]] + 1j * np.asarray(columns[pair[1]]) for columns in (answer, result)
    )
    loaded = np.abs(expected) > LEAST_LOAD * case["units"]["Tx"]
    turn = np.angle(found[loaded] * expected[loaded].conj(), deg=True)
    return largest(turn)


def verdict(errors, bounds, tolerance=0.0):
    """Compare errors with the bounds of a case and with a tolerance.

    Returns "fails" beyond ten bounds plus tolerance; else "incomplete" if columns with a bound are
    missing; else "exact" within ten bounds, and "passes" otherwise.
    """
    excess = max(errors[column] - EXACT * bounds[column] for column in errors)
    if excess > tolerance:
        return "fails"
    if bounds.keys() - errors.keys():
        return "incomplete"
    return "exact" if excess <= 0 else "passes"


def compute_score(result, name, tolerance=0.0):
    """Score of a result: its columns, the largest error over bound, the error of the angle, the verdict."""
    bounds = read_case(name)[0]["bounds"]
    columns = {
        column: {
            "largest": largest(each),
            "rms": root_mean_square(each),
            "bound": bounds[column],
            "verdict": verdict({column: largest(each)}, {column: bounds[column]}, tolerance),
        }
        for column, each in compute_differences(result, name).items()
    }
    errors = {column: each["largest"] for column, each in columns.items()}
    return {
        "columns": columns,
        "missing": sorted(bounds.keys() - errors.keys()),
        "angle": compute_angle(result, name),
        "ratio": max(error / bounds[column] for column, error in errors.items()),
        "verdict": verdict(errors, bounds, tolerance),
    }


def score_folder(folder, tolerance=0.0):
    """Scores of a folder by case, None without a result; and its one number."""
    if not folder.is_dir():
        raise ScoreError(
            f"{folder}: is not a folder; expected one with a result for each case, named CASE.csv"
        )
    paths = {name: folder / f"{name}.csv" for name in list_cases()}
    if not any(path.exists() for path in paths.values()):
        raise ScoreError(
            f"{folder}: holds no result; expected files named as the cases, such as {list_cases()[0]}.csv"
        )
    scores = {
        name: compute_score(read_csv(path), name, tolerance) if path.exists() else None
        for name, path in paths.items()
    }
    return {"cases": scores} | summarise(scores)


def summarise(scores):
    """Geometric mean of error over bound, at least 1 in each case, and counts of verdicts.

    Cases without a result are no part of the mean. They, and incomplete ones, count as failures.
    """
    found = [score for score in scores.values() if score]
    logarithms = [math.log(max(score["ratio"], 1.0)) for score in found]
    verdicts = [score["verdict"] if score else "no result" for score in scores.values()]
    return {
        "geometric_mean": math.exp(sum(logarithms) / len(found)),
        "failures": sum(each not in PASSING for each in verdicts),
        "verdicts": {each: verdicts.count(each) for each in dict.fromkeys(verdicts)},
    }


def format_score(score, bounds):
    """Lines of a table with errors, bound and verdict of each column, and of the case."""
    lines = [f"{'column':8}{'largest':>10}{'rms':>10}{'bound':>10}  verdict"]
    for column, bound in bounds.items():
        each = score["columns"].get(column)
        if each is None:
            lines.append(f"{column:8}{'–':>10}{'–':>10}{bound:10.1e}  missing")
            continue
        lines.append(
            f"{column:8}{each['largest']:10.1e}{each['rms']:10.1e}{bound:10.1e}  {each['verdict']}"
        )
    if score["angle"] is not None:
        lines.append(f"{'angle':8}{score['angle']:10.2g} degrees")
    lines.append(f"{'case':38}  {score['verdict']}")
    return lines


# columns of a table: what the columns of a case have in common
GROUPS = {"loads": "NTq", "displacements": "duc", "energy": "E"}


def largest_of(score, letters):
    """Largest error of the columns that begin with one of the letters; None without such."""
    errors = [each["largest"] for column, each in score["columns"].items() if column[0] in letters]
    return max(errors, default=None)


def format_table(found):
    """Lines of a table: largest errors, the angle, error over bound and verdict of each case."""
    heads = [*GROUPS, "angle", "over bound"]
    lines = [f"{'case':28}" + "".join(f"{head:>15}" for head in heads) + "  verdict"]
    for name, score in found["cases"].items():
        if score is None:
            lines.append(f"{name:28}" + f"{'–':>15}" * len(heads) + "  no result")
            continue
        values = [largest_of(score, letters) for letters in GROUPS.values()]
        values += [score["angle"], score["ratio"]]
        cells = "".join(f"{'–' if value is None else format(value, '.1e'):>15}" for value in values)
        lines.append(f"{name:28}{cells}  {score['verdict']}")
    counts = ", ".join(f"{count} {text}" for text, count in found["verdicts"].items())
    lines.append(f"geometric mean of error over bound: {found['geometric_mean']:.2g}; {counts}")
    return lines


def format_page(folder):
    """Page of Markdown with the scores of the codes of a folder; each has a folder of results."""
    codes = sorted(path for path in folder.iterdir() if path.is_dir())
    if not codes:
        raise ScoreError(f"{folder}: holds no folder; expected one for each code")
    found = {path.name: score_folder(path) for path in codes}
    lines = [
        "# Scores of codes on the certified load histories",
        "",
        "Largest error of loads or displacements over their unit, and of the energy after the slash. *Exact*",
        "is within ten times the bound of the case; `python score.py --page results` makes this page.",
        "",
        "| case | " + " | ".join(found) + " | bound |",
        "| --- |" + " --- |" * (len(found) + 1),
    ]
    for name in list_cases():
        bounds = read_case(name)[0]["bounds"]
        own = {"columns": {column: {"largest": bound} for column, bound in bounds.items()}}
        cells = [_page_cell(each["cases"][name]) for each in found.values()]
        lines.append(f"| {name} | " + " | ".join([*cells, _page_cell(own)]) + " |")
    means = [f"{each['geometric_mean']:.2g}" for each in found.values()]
    failures = [str(each["failures"]) for each in found.values()]
    lines.append("| **geometric mean of error over bound** | " + " | ".join([*means, "1"]) + " |")
    lines.append(
        "| **failures**, with cases left out or incomplete | " + " | ".join([*failures, "–"]) + " |"
    )
    return lines


def _page_cell(score):
    if score is None:
        return "–"
    motion = [largest_of(score, GROUPS["loads"]), largest_of(score, GROUPS["displacements"])]
    values = [max((each for each in motion if each is not None), default=None)]
    values.append(largest_of(score, GROUPS["energy"]))
    text = " / ".join("–" if value is None else f"{value:.0e}" for value in values)
    return f"**{text}**" if score.get("verdict") == "exact" else text


def main():
    """Print the score of one result or of a folder of results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "result", nargs="?", type=Path, help="CSV file with the rows and columns of the case"
    )
    parser.add_argument("case", nargs="?", help="name of the case, such as 02_nested_reversals")
    parser.add_argument(
        "--all", type=Path, metavar="FOLDER", help="score every CASE.csv of a folder"
    )
    parser.add_argument(
        "--tolerance", type=float, default=0.0, help="accuracy that you state for your law"
    )
    parser.add_argument("--json", action="store_true", help="print the score as JSON")
    parser.add_argument(
        "--page", type=Path, metavar="FOLDER", help="print a page on the codes of a folder"
    )
    options = parser.parse_args()
    if not options.all and not options.case and not options.page:
        parser.error("expected RESULT.csv and CASE, --all FOLDER, or --page FOLDER")
    try:
        if options.page:
            print("\n".join(format_page(options.page)))
            return
        if options.all:
            found = score_folder(options.all, options.tolerance)
            lines, passed = format_table(found), not found["failures"]
        else:
            found = compute_score(read_csv(options.result), options.case, options.tolerance)
            lines = format_score(found, read_case(options.case)[0]["bounds"])
            passed = found["verdict"] in PASSING
    except ScoreError as problem:
        sys.exit(f"score.py: {problem}")
    print(to_json(found) if options.json else "\n".join(lines))
    sys.exit(0 if passed else 1)


def to_json(found):
    """JSON text; an infinite error, for which JSON has no number, is null."""

    def finite(value):
        if isinstance(value, dict):
            return {key: finite(each) for key, each in value.items()}
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(finite(found), indent=1, allow_nan=False)


if __name__ == "__main__":
    main()
