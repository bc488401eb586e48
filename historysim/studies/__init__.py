"""Many runs: sweeps over the keys of a scenario, and what design studies ask of them."""
