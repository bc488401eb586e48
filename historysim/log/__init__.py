"""The event log: what a history was made from, on disk, and the snapshots beside it."""
