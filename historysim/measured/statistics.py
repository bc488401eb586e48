"""Mean and scatter of one quantity over loops."""

import math
from typing import Self

import attrs
import numpy as np

from historysim.basics.array_types import Floats
from historysim.basics.units import scaled


@attrs.frozen
class LoopStatistics:
    """Mean and scatter of one quantity over the loops."""

    mean: float
    """NaN where no loop has a value."""
    standard_deviation: float
    """Of one loop, with count - 1 in the denominator; NaN for fewer than two."""
    count: int
    """The loops that have a value."""

    @classmethod
    def of(cls, values: Floats) -> Self:
        """Return those of values (loop), or of (loop, direction), of which each loop counts with its mean."""
        values = values.reshape(len(values), -1).mean(axis=1)
        values = values[np.isfinite(values)]
        return cls(
            mean=float(values.mean()) if values.size else math.nan,
            standard_deviation=float(values.std(ddof=1)) if values.size > 1 else math.nan,
            count=values.size,
        )

    def text(self, unit: str, loops: int) -> str:
        """Return mean ± standard deviation as a text, and of how many loops where that is not all of them."""
        if self.count == 0:
            return "–"
        factor, symbol = scaled(self.mean, unit)
        # a scatter at the level of rounding is none
        spread = self.standard_deviation if self.standard_deviation > 1e-12 * abs(self.mean) else 0.0
        scatter = f" ± {spread * factor:.2g}" if self.count > 1 else ""
        some = f" (of {self.count})" if self.count < loops else ""
        return f"{self.mean * factor:.4g}{scatter}{symbol}{some}"
