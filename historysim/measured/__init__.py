"""Measured load sequences: what was recorded, made ready for the contact."""
