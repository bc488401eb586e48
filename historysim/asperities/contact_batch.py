"""`ContactBatch`: many independent contacts of balls, each with an approach and a displacement of its own."""

import copy
from typing import Self

import numpy as np
import numpy.typing as npt

from historysim.asperities.friction import coulomb
from historysim.basics.arguments import checked, one_per
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.single import Singles, step_singles

Floats = npt.NDArray[np.float64]

FIRST_ROOM = 7
"""Vertices that each contact has room for at the beginning: loops have up to five, and a step adds two.

Contacts that need more move, so that what neighbours remember is no longer side by side; a power of two would have all
of them meet in a few places of the cache.
"""


class ContactBatch:
    """Hertzian contacts that share nothing but their materials, such as those of grains, stepped in place.

    Each path of each contact is straight in its approach and displacement and is carried exactly, as an `Ensemble` of
    one asperity would carry it. The displacement is along one direction, which the caller keeps. Energies are not kept:
    what friction takes is the work of the loads less what comes back.

    Parameters
    ----------
    pair : MaterialPair
    radius : array_like
        Effective radius R of each contact [m], 1/R = 1/R1 + 1/R2, > 0; one for all or one per contact.
    friction : array_like
        Coulomb coefficients μ ≥ 0, one for all or one per contact.
    count : int
        Number of contacts.

    Attributes
    ----------
    normal_load, tangential_load : array (contact)
        Loads after the last step [N]; a positive tangential load resists a positive displacement.

    Raises
    ------
    InputError
        A number that is not finite or out of range, or arrays of different lengths.
    """

    def __init__(self, pair: MaterialPair, radius: npt.ArrayLike, friction: npt.ArrayLike, count: int) -> None:
        if not isinstance(pair, MaterialPair):
            raise InputError(f"pair is {pair!r}; expected a MaterialPair")
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise InputError(f"count is {count!r}; expected a whole number of contacts, 1 or more")
        radii = checked("radius", radius, above=0)
        if radii.size > 1:
            radii = one_per("contact", "contacts", "radius", radii, int(count))
        coefficients = coulomb(friction, int(count)) if np.size(friction) > 1 else coulomb(friction, 1)
        self._scale = np.atleast_1d(4.0 / 3.0 * pair.contact_modulus * np.sqrt(radii))
        self._friction = coefficients
        self._ratio = pair.displacement_ratio
        self.normal_load, self.tangential_load = np.zeros(count), np.zeros(count)
        self._singles = Singles(
            vertices=np.zeros((FIRST_ROOM * count + FIRST_ROOM, 4)),
            place=FIRST_ROOM * np.arange(count),
            depth=np.zeros(count, dtype=np.int64),
            room=np.full(count, FIRST_ROOM),
            used=np.array([FIRST_ROOM * count]),
        )

    def __len__(self) -> int:
        """Return the number of contacts."""
        return self.normal_load.size

    def __repr__(self) -> str:
        return f"<ContactBatch: {len(self)} contacts, {np.count_nonzero(self._singles.depth)} touch>"

    def step(self, approach: npt.ArrayLike, tangential_displacement: npt.ArrayLike) -> None:
        """Carry each contact straight to its approach and displacement.

        Parameters
        ----------
        approach : array_like (contact)
            δ [m]; negative where the balls are apart, which erases what the contact remembers. A contact that touches
            on its path does so where the straight path from its last place has δ = 0; the first starts from δ = U = 0.
        tangential_displacement : array_like (contact)
            U [m].

        Raises
        ------
        InputError
            Numbers that are not finite, or not one for each contact.
        """
        places = self._each("approach", approach), self._each("tangential_displacement", tangential_displacement)
        done = 0
        while done < len(self):
            done = step_singles(
                self._singles,
                self._friction,
                self._scale,
                self._ratio,
                *places,
                self.normal_load,
                self.tangential_load,
                done,
            )
            if done < len(self):
                vertices = self._singles.vertices
                more = np.empty((max(len(vertices) // 2, 4 * int(self._singles.room[done])), 4))
                self._singles = self._singles._replace(vertices=np.concatenate([vertices, more]))

    def forget(self, contacts: npt.ArrayLike) -> None:
        """Make contacts new, such as where grains have new neighbours: unloaded, at δ = U = 0.

        Raises
        ------
        InputError
            What are no indices of contacts.
        """
        chosen = np.atleast_1d(np.asarray(contacts))
        if not np.issubdtype(chosen.dtype, np.integer) or not np.all((chosen >= 0) & (chosen < len(self))):
            raise InputError(f"contacts is {contacts!r}; expected indices from 0 to {len(self) - 1}")
        self._singles.vertices[self._singles.place[chosen]] = 0.0
        self._singles.depth[chosen] = 0
        self.normal_load[chosen] = self.tangential_load[chosen] = 0.0

    def save(self) -> Self:
        """Return an independent copy, such as before a trial."""
        return copy.deepcopy(self)

    def restore(self, saved: Self) -> None:
        """Go on from what `save` has returned.

        Raises
        ------
        InputError
            Another number of contacts.
        """
        if len(saved) != len(self):
            raise InputError(f"saved has {len(saved)} contacts; expected {len(self)}")
        self.__dict__.update(copy.deepcopy(saved.__dict__))

    def _each(self, name: str, values: npt.ArrayLike) -> Floats:
        array = checked(name, values)
        if array.shape != (len(self),):
            raise InputError(f"{name} has shape {array.shape}; expected one number for each of {len(self)} contacts")
        return np.ascontiguousarray(array)
