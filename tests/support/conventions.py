"""The conventions CF and ACDD, by compliance-checker."""

import contextlib
import warnings

WEIGHTS = {"highly recommended": 3, "recommended": 2}


def checked(path, checker):
    """What compliance-checker finds in a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from compliance_checker.runner import CheckSuite

        if not CheckSuite.checkers:
            CheckSuite.load_all_available_checkers()
        suite = CheckSuite()
        with contextlib.closing(suite.load_dataset(str(path))) as dataset:
            results, failures = suite.run_all(dataset, [checker])[checker]
    assert not failures
    return results


def conventions(path):
    """What compliance-checker says of a file: errors and warnings."""
    severe = {True: [], False: []}
    for result in checked(path, "cf:1.11"):
        passed, of = result.value if isinstance(result.value, tuple) else (bool(result.value), True)
        if passed < of:
            severe[result.weight == WEIGHTS["highly recommended"]].extend(result.msgs)
    return severe[True], severe[False]


def discovery(path, weight):
    """What a catalogue would miss in a file, by ACDD 1.3; there are no standard names for our variables."""
    found = []
    for result in checked(path, "acdd:1.3"):
        if result.weight != WEIGHTS[weight]:
            continue
        missing = [text for text in result.msgs if text != "standard_name"]
        if result.name.startswith("variable"):
            found += [f"{result.name} {', '.join(missing)}"] if missing else []
        else:
            found += missing
    return found
