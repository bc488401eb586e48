"""Reduced models: few springs that slide, in parallel, in place of a contact, with a bound of their error."""
