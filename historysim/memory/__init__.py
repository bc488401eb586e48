"""The traction memory of asperities: which spring of a contact was anchored where, exactly, for any load history."""
