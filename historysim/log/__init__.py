"""The event log of a run: one file with all inputs, and snapshots of the state."""
