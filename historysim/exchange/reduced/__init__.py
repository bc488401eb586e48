"""Reduced models: few sliding springs in parallel that replace a contact, with an error bound."""
