"""Questions to a Dataset: analysis and pictures."""
