"""Rough contacts whose asperities press on one another: frictionless solutions of a whole height map."""
