"""One contact without memory: pure functions of scalars or numpy arrays, in SI."""
