"""Many runs: sweeps over the keys of a scenario, and the inverse problem of a sweep."""
