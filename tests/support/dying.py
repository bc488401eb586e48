"""A worker of a sweep that the system ends at one cell, as it does where memory is short."""

import os

from historysim.studies import sweep

compute_batch = sweep.compute_batch


def computed_unless_3(batch):
    if any(point.get("surface.seed") == 3 for _, _, point in batch.cells):
        os._exit(9)
    return compute_batch(batch)
