"""The errors a caller can tell apart.

Each message says what came, what was expected, how to mend it, and where.
"""


class HistorySimError(Exception):
    """Any error that historysim raises on purpose."""


class InputError(HistorySimError, ValueError):
    """A value, scenario or file that cannot be used as it is."""


class LoadError(HistorySimError):
    """A load that the contact cannot carry: there is no equilibrium at the requested value."""
