"""A rough contact as 16 springs that slide, with the bound of their error.

The contact is that of 10_random_rough_surface.toml at 90 mN. Whatever its history at that normal
load, the tangential load of the springs is within the grey band around that of the contact.
"""

# historysim gallery: example

from pathlib import Path

import historysim as hs


def calculated() -> object:
    """Return the reduced model."""
    return hs.reduce(Path(__file__).with_name("10_random_rough_surface.toml"), elements=16)


if __name__ == "__main__":
    calculated().write("springs.json")
