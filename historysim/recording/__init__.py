"""What is written down: the table of variables, recorders, netCDF, the surface beside the history."""
