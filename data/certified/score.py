"""Score the result of a contact law on a certified load history; needs numpy alone.

    python score.py RESULT.csv CASE [--tolerance 0.01]
    python score.py --all FOLDER [--tolerance 0.01]

RESULT.csv has the rows and column names of CASE.csv. Columns of the answer that are left out are
not scored, and the result is "incomplete". A folder holds one result for each case, named CASE.csv.
The exit status is 1 if a scored case fails or is incomplete.
An error is the largest difference of a column over its unit (μN, full slip, μN × full slip), which
CASE.yaml states.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
PASSING = ("exact", "passes")


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
    """Errors of a result by column, each over its unit; `result` maps column names to arrays."""
    case, answer = read_case(name)
    rows = answer["t"].size
    if not set(case["expected"]) & set(result):
        expected = ", ".join(case["expected"])
        raise ScoreError(
            f"{name}: the result has the columns {', '.join(result)}; expected at least one of {expected}"
        )
    errors = {}
    for column in answer:
        if column not in result:
            continue
        values = np.asarray(result[column], dtype=float)
        if values.shape != (rows,):
            raise ScoreError(
                f"{name}: column {column} has {values.size} rows; expected {rows}, one for each row of {name}.csv"
            )
        if column not in case["expected"]:
            # the inputs of the case: another path would be scored for nothing
            if not np.allclose(
                values, answer[column], rtol=1e-6, atol=1e-6 * np.abs(answer[column]).max()
            ):
                raise ScoreError(
                    f"{name}: column {column} is an input of the case and differs; expected that of {name}.csv"
                )
            continue
        difference = np.abs(values - answer[column]) / case["units"][column]
        errors[column] = float(np.where(np.isnan(difference), np.inf, difference).max(initial=0.0))
    return errors


def verdict(errors, bounds, tolerance=0.0):
    """Compare errors with the bounds of a case and with a tolerance.

    Returns "fails" beyond bounds plus tolerance; else "incomplete" if columns with a bound are
    missing; else "exact" within the bounds, where the reference cannot tell a result from the
    answer, and "passes" otherwise.
    """
    excess = max(errors[column] - bounds[column] for column in errors)
    if excess > tolerance:
        return "fails"
    if bounds.keys() - errors.keys():
        return "incomplete"
    return "exact" if excess <= 0 else "passes"


def format_score(result, name, tolerance):
    """Lines of a table, with error, bound and verdict of each column and of the case; and whether the case passes."""
    bounds = read_case(name)[0]["bounds"]
    errors = compute_errors(result, name)
    lines = [f"{'column':8}{'error':>10}{'bound':>10}  verdict"]
    for column, bound in bounds.items():
        if column not in errors:
            lines.append(f"{column:8}{'–':>10}{bound:10.1e}  missing")
            continue
        error = errors[column]
        lines.append(
            f"{column:8}{error:10.1e}{bound:10.1e}  {verdict({column: error}, {column: bound}, tolerance)}"
        )
    overall = verdict(errors, bounds, tolerance)
    lines.append(f"{'case':28}  {overall}")
    return lines, overall in PASSING


def format_table(folder, tolerance):
    """Lines of a table, the largest error of loads, displacements and energy in each case; and whether all pass.

    Cases without a result count neither way.
    """
    if not folder.is_dir():
        raise ScoreError(
            f"{folder}: is not a folder; expected one with a result for each case, named CASE.csv"
        )
    found = [name for name in list_cases() if (folder / f"{name}.csv").exists()]
    if not found:
        raise ScoreError(
            f"{folder}: holds no result; expected files named as the cases, such as {list_cases()[0]}.csv"
        )
    all_pass = True
    lines = [f"{'case':32}{'T':>10}{'u':>10}{'E':>10}  verdict"]
    for name in list_cases():
        if name not in found:
            lines.append(f"{name:32}{'–':>10}{'–':>10}{'–':>10}  no result")
            continue
        errors, bounds = (
            compute_errors(read_csv(folder / f"{name}.csv"), name),
            read_case(name)[0]["bounds"],
        )
        largest = {
            group: max(
                (error for column, error in errors.items() if column.startswith(group)),
                default=None,
            )
            for group in "TuE"
        }
        cells = "".join(
            f"{'–' if error is None else format(error, '.1e'):>10}" for error in largest.values()
        )
        overall = verdict(errors, bounds, tolerance)
        all_pass &= overall in PASSING
        lines.append(f"{name:32}{cells}  {overall}")
    return lines, all_pass


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
    options = parser.parse_args()
    if not options.all and not options.case:
        parser.error("expected RESULT.csv and CASE, or --all FOLDER")
    try:
        if options.all:
            lines, passed = format_table(options.all, options.tolerance)
        else:
            lines, passed = format_score(read_csv(options.result), options.case, options.tolerance)
    except ScoreError as problem:
        sys.exit(f"score.py: {problem}")
    print("\n".join(lines))
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
