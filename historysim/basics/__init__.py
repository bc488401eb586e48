"""Shared foundations: units at the boundary, argument checks, limits, messages and safe files."""
