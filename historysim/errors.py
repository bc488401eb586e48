"""The errors a caller can tell apart.

Each message says what came, what was expected, how to mend it, and where.
"""


class HistorySimError(Exception):
    """Any error that historysim raises on purpose."""


class InputError(HistorySimError, ValueError):
    """A value, scenario or file that cannot be used as it is."""


class LoadError(HistorySimError):
    """A load that the contact cannot carry: there is no equilibrium at the requested value."""


class FrictionLimitError(LoadError):
    """A tangential load beyond what friction can hold.

    Attributes
    ----------
    request, limit : float
        The load asked for and the largest the contact carries [N].
    path : int
        Position, in the paths that were asked for, of the one that could not be walked.
    """

    def __init__(self, request: float, limit: float, path: int = 0) -> None:
        super().__init__(
            f"a tangential load of {request:.6g} N is beyond the friction limit of {limit:.6g} N (Σ μ N), so there is "
            "no equilibrium; lower it, raise the normal load first, control the displacement instead, or choose "
            "`saturate` to hold the load at the limit"
        )
        self.request, self.limit, self.path = request, limit, path
