"""Questions to a recorded history: plain functions of a Dataset, none of which needs the engine.

What has one value for each step is computed in blocks of steps, and what has one for each step and asperity where it is
read, so that a history may be larger than memory.
"""

from historysim.results.analysis.cycles import energy_per_cycle, friction_loops
from historysim.results.analysis.history_summary import summary, validity
from historysim.results.analysis.preliminary import critical_asperity, drift, preliminary_displacement
from historysim.results.analysis.presliding import preliminary_displacements, presliding_work
from historysim.results.analysis.pressure import (
    mean_pressure,
    nominal_pressure,
    peak_pressure,
    stick_ratio,
    total_mean_pressure,
)
from historysim.results.analysis.recorded import is_complete
from historysim.results.analysis.shares import slip_shares, telling_step
from historysim.results.analysis.slips import first_slips, slides_first
from historysim.results.analysis.stiffness import tangential_stiffness
from historysim.results.analysis.time_series import time_series

__all__ = [
    "critical_asperity",
    "drift",
    "energy_per_cycle",
    "first_slips",
    "friction_loops",
    "is_complete",
    "mean_pressure",
    "nominal_pressure",
    "peak_pressure",
    "preliminary_displacement",
    "preliminary_displacements",
    "presliding_work",
    "slides_first",
    "slip_shares",
    "stick_ratio",
    "summary",
    "tangential_stiffness",
    "telling_step",
    "time_series",
    "total_mean_pressure",
    "validity",
]


def __dir__() -> list[str]:
    return sorted(__all__)
