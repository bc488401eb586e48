"""The CF conventions, by compliance-checker."""

import contextlib
import warnings


def conventions(path):
    """What compliance-checker says of a file: errors and warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from compliance_checker.base import BaseCheck
        from compliance_checker.runner import CheckSuite

        if not CheckSuite.checkers:
            CheckSuite.load_all_available_checkers()
        suite = CheckSuite()
        with contextlib.closing(suite.load_dataset(str(path))) as dataset:
            results, failures = suite.run_all(dataset, ["cf:1.11"])["cf:1.11"]
    assert not failures
    severe = {True: [], False: []}
    for result in results:
        passed, of = result.value if isinstance(result.value, tuple) else (bool(result.value), True)
        if passed < of:
            severe[result.weight == BaseCheck.HIGH].extend(result.msgs)
    return severe[True], severe[False]
