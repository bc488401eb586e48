"""Measured load sequences: friction loops, comparison with a model, fits and creep."""
