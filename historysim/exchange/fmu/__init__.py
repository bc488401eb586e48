"""A contact as a unit of co-simulation by the Functional Mock-up Interface (FMI), in plain C with its memory."""
