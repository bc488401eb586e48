"""The bodies that remember: asperities, their ensemble, friction laws, the instrument, and whether the model holds."""
