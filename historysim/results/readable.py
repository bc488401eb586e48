"""Whether a file that calls itself a result of this program is made like one, before anything is asked of it."""

import contextlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from historysim.errors import InputError
from historysim.recording.variables import BEHIND_A_SPRING, COORDINATES, PER_ASPERITY, PER_PATCH, TOTALS

TEXTS = (
    "content",
    "date_created",
    "event_digest",
    "friction_law",
    "historysim_version",
    "history",
    "id",
    "license",
    "log_digest",
    "made_with",
    "scenario",
    "source",
    "summary",
    "title",
    "validity",
    "wear_law",
)
MODULI = ("contact_modulus", "shear_modulus")
KNOWN = {variable.name: variable for variable in (*COORDINATES, *TOTALS, *BEHIND_A_SPRING, *PER_ASPERITY, *PER_PATCH)}
NEEDED = {"time", *(variable.name for variable in TOTALS)} - {"real_contact_area"}
"""Variables that every result has; a contact that is given by its loads alone has no area."""

Shapes = Mapping[str, tuple[tuple[Any, ...], Any]]
"""The dimensions and the type of each variable."""


def check_history(attributes: Mapping[Any, Any], found: Shapes, steps: int, path: Path) -> None:
    """Check what a result says of itself, and that its variables are there, of numbers, along their dimensions.

    Parameters
    ----------
    attributes : dict
    found : dict
        The dimensions and the type of each variable.
    steps : int
    path : Path
        The file, for the message.

    Raises
    ------
    InputError
        Something is missing, or of another kind than this program writes.
    """
    none = [] if steps else ["it has no steps"]
    for problem in itertools.chain(_wrong_attributes(attributes), _wrong_variables(found), none):
        raise InputError(f"{path}: is no result of historysim run, or damaged: {problem}; run the scenario again")


def _wrong_attributes(attributes: Mapping[Any, Any]) -> Iterator[str]:
    for name in TEXTS:
        if name in attributes and not isinstance(attributes[name], str):
            yield f"its attribute {name} is no text"
    for name in MODULI:
        value = attributes.get(name)
        if not (isinstance(value, float | int | np.number) and math.isfinite(value) and value > 0):
            yield f"its attribute {name} is no positive number"
    findings = None
    with contextlib.suppress(ValueError, RecursionError, TypeError):
        findings = json.loads(attributes.get("validity", "[]"))
    if not isinstance(findings, list):
        yield "its attribute validity is no list in JSON"


def _wrong_variables(found: Shapes) -> Iterator[str]:
    for name in sorted(NEEDED - found.keys()):
        yield f"it has no variable {name}"
    for name, (dimensions, dtype) in found.items():
        if name in KNOWN and getattr(dtype, "kind", "") not in "iuf":
            yield f"its variable {name} holds no numbers"
        if name in KNOWN and tuple(dimensions) != KNOWN[name].dimensions and name != "present_friction":
            yield f"its variable {name} goes along {', '.join(map(str, dimensions)) or 'nothing'}"
    if any("asperity" in dimensions for dimensions, _ in found.values()) and "asperity" not in found:
        yield "it does not say which asperities it has"
