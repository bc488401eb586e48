"""Notices: what a function has to say beside its result."""

from collections.abc import Callable

Notify = Callable[[str], None]
"""Takes a notice, a sentence for the user."""


def silent(_: str) -> None:
    """Tell nobody."""
