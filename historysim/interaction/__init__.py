"""Rough contacts with asperities that press on one another: frictionless solutions of a whole height map."""
