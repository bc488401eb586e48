"""Rough surfaces: from heights to summits."""
