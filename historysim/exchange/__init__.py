"""Contacts for other programs: a unit of co-simulation (FMU), and models of few springs that slide, with a bound."""
