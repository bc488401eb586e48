"""Record histories: declared variables, recorders, netCDF files, and the group of the surface."""
