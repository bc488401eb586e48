"""How much is taken: each limit is a number here, and can be raised by whoever starts the program.

They are far beyond what is measured or modelled, and below what ends in an hour or fills the memory. Where one is met,
the message says which, and how to raise it: ``HISTORYSIM_MOST_STEPS=1e9 historysim run …``.
"""

import os

LIMITS = {
    "STEPS": 100_000_000,  # rows of a history
    "POINTS": 1_000_000,  # of a sweep
    "SCENARIO_BYTES": 50_000_000,  # some million waypoints
    "KEY_PARTS": 64,  # names with dots between them, and tables within tables
    "LINE_BYTES": 20_000_000,  # of a text
    "BLOCKS": 5_000,  # tables of a text
    "HDF5_OBJECTS": 100_000,  # groups and datasets of a file
    "HDF5_DEPTH": 32,  # groups within groups
}


def most(name: str) -> int:
    """Return a limit, as the environment raises or lowers it."""
    try:
        return int(float(os.environ.get(f"HISTORYSIM_MOST_{name}", "")))
    except (ValueError, OverflowError):
        return LIMITS[name]


def at_most(name: str) -> str:
    """Return what a message says of a limit: how much is expected at most, and what raises it."""
    return f"expected {most(name):,} at most (the environment variable HISTORYSIM_MOST_{name} raises it)"
