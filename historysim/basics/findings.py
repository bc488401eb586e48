"""Findings: what an assumption of the model meets in a contact where it does not hold, as values and as text."""

import json
from collections.abc import Iterable

import attrs


@attrs.frozen
class Finding:
    """An assumption of the model that does not hold."""

    name: str
    """Which one, in a word."""
    value: float
    limit: float
    """The value at which it is no longer assumed to hold."""
    text: str
    """Both in a line, with a remedy."""


def written(findings: Iterable[Finding]) -> str:
    """Return findings as JSON, one on each line."""
    lines = (json.dumps(attrs.asdict(finding), ensure_ascii=False) for finding in findings)
    return "[\n" + ",\n".join(lines) + "\n]"


def read(text: str) -> tuple[Finding, ...]:
    """Return the findings of what `written` gives."""
    return tuple(Finding(**entry) for entry in json.loads(text))
