"""What every room needs and no user sees: units at the boundary, argument checks, safe files."""
