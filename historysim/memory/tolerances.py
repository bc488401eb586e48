"""What counts as equal."""

import numpy as np

EPSILON = float(np.finfo(np.float64).eps)

# two displacements or loads that rounding alone keeps apart; a closed loop is recognised by it
TIE = 32 * EPSILON

# rounding that a request at the friction limit may carry from its units
LIMIT_SLACK = 1e-12
