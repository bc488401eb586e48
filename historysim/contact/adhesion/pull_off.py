"""What an adhesive contact can carry: what controls its pull-off, and the check that no load pulls harder."""

from typing import Literal

import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import checked
from historysim.basics.array_types import Floats
from historysim.errors import InputError, LoadError

Control = Literal["load", "displacement"]
"""What is controlled while a contact is pulled apart."""


def is_load(control: Control) -> bool:
    """Return whether the load is controlled.

    Raises
    ------
    InputError
        Neither ``"load"`` nor ``"displacement"``.
    """
    if control not in {"load", "displacement"}:
        raise InputError(f"control is {control!r}; expected 'load' or 'displacement'")
    return control == "load"


def carried(name: str, load: npt.ArrayLike, pull_off: Floats, unit: str) -> Floats:
    """Return a load as floats; one that is below the pull-off load by a few roundings is put on it.

    Parameters
    ----------
    name : str
        The name of the argument, for the message.
    load, pull_off : array_like
        Both in the unit.
    unit : str
        The unit, for the message.

    Raises
    ------
    LoadError
        A load below the pull-off load.
    """
    asked, limit = np.broadcast_arrays(checked(name, load), pull_off)
    beyond = asked < limit * (1 + 16 * np.finfo(np.float64).eps)
    if beyond.any():
        raise LoadError(
            f"{name} of {asked[beyond][0]:.9g} {unit} pulls harder than the contact can carry, so there is no "
            f"equilibrium; expected no less than the pull-off load of {limit[beyond][0]:.9g} {unit}"
        )
    carried: Floats = np.maximum(asked, limit)
    return carried
