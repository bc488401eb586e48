"""`ContactBatch`: many independent contacts of balls, each with an approach and a displacement of its own."""

from typing import Any, Self

import numpy as np
import numpy.typing as npt

from historysim.asperities.law import coulomb
from historysim.basics.arguments import Floats, checked, one_per, workable
from historysim.basics.library import OneAtATime, ffi, lib, pointer
from historysim.basics.limits import LARGEST, SMALLEST
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check, owned

# what a step need not look up
_FLOAT, _DOUBLES, _row_of = np.dtype(np.float64), ffi.typeof("double[]"), ffi.from_buffer
_takes, _step = lib.hs_batch_accepts, lib.hs_batch_step


class ContactBatch:
    """Hertzian contacts that share nothing but their materials, such as those of grains, stepped in place.

    Each path of each contact is straight in its approach and displacement and is carried exactly, as an `Ensemble` of
    one asperity would carry it. The displacement is along one direction, which the caller keeps. Energies are not kept:
    what friction takes is the work of the loads less what comes back. A batch is of one thread at a time: another one
    that comes in meanwhile gets an error.

    Parameters
    ----------
    pair : MaterialPair
    radius : array_like
        Effective radius R of each contact [m], 1/R = 1/R1 + 1/R2, > 0; one for all or one per contact.
    friction : array_like
        Coulomb coefficients μ ≥ 0, one for all or one per contact.
    count : int
        Number of contacts.

    Raises
    ------
    InputError
        A number that is not finite or out of range, or arrays of different lengths.
    """

    _loads: Floats
    _rows: tuple[Any, ...]

    def __init__(self, pair: MaterialPair, radius: npt.ArrayLike, friction: npt.ArrayLike, count: int) -> None:
        if not isinstance(pair, MaterialPair):
            raise InputError(f"pair is {pair!r}; expected a MaterialPair")
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise InputError(f"count is {count!r}; expected a whole number of contacts, 1 or more")
        radii = workable("radius", checked("radius", radius, above=0), smallest=SMALLEST)
        if radii.size > 1:
            radii = one_per("contact", "contacts", "radius", radii, int(count))
        coefficients = coulomb(friction, int(count)) if np.size(friction) > 1 else coulomb(friction, 1)
        scale = np.atleast_1d(4.0 / 3.0 * pair.contact_modulus * np.sqrt(radii))
        self._count = int(count)
        self.__dict__.update(_held(np.zeros((2, self._count))))
        self._place = OneAtATime("the batch: a batch for each thread, such as batch.save()")
        self._of = coefficients.tobytes(), scale.tobytes(), pair.displacement_ratio
        made = lib.hs_batch_new(
            count, coefficients.size, pointer(coefficients), scale.size, pointer(scale), pair.displacement_ratio
        )
        self._batch = owned(made, lib.hs_batch_free)

    def __len__(self) -> int:
        """Return the number of contacts."""
        return self._count

    @property
    def normal_load(self) -> Floats:
        """Normal loads after the last step [N] (contact)."""
        loads: Floats = self._loads[0]
        return loads

    @property
    def tangential_load(self) -> Floats:
        """Tangential loads after the last step [N] (contact); a positive one resists a positive displacement."""
        loads: Floats = self._loads[1]
        return loads

    def __repr__(self) -> str:
        return f"<ContactBatch: {len(self)} contacts, {np.count_nonzero(self.normal_load)} touch>"

    def step(self, approach: npt.ArrayLike, tangential_displacement: npt.ArrayLike) -> None:
        """Carry each contact straight to its approach and displacement.

        Parameters
        ----------
        approach, tangential_displacement : array_like (contact)
            δ and U [m]. A negative δ, where the balls are apart, erases what the contact remembers. A contact that
            touches on its path does so where the straight path from its last place has δ = 0; the first starts from
            δ = U = 0. Numbers that are not finite, or not one for each contact, are an InputError, as is another
            thread that steps it: then nothing is changed.
        """
        places = self._as_they_are(approach, tangential_displacement)
        if places is None:
            given = ("approach", approach), ("tangential_displacement", tangential_displacement)
            places = tuple(pointer(self._each(*each)) for each in given)
        with self._place:
            check(_step(self._batch, *places, *self._rows))

    def _as_they_are(self, *given: Any) -> tuple[Any, ...] | None:
        """Return what the library takes as it is; None where something has to be converted, or is refused."""
        for values in given:
            plain = type(values) is np.ndarray and values.dtype is _FLOAT and values.shape == (self._count,)
            if not plain or not values.flags.c_contiguous:
                return None
        places = tuple([_row_of(_DOUBLES, values) for values in given])
        return places if _takes(self._batch, *places, LARGEST) else None

    def forget(self, contacts: npt.ArrayLike) -> None:
        """Make contacts new, by index, such as where grains have new neighbours: unloaded, at δ = U = 0."""
        chosen = np.atleast_1d(np.asarray(contacts))
        if not np.issubdtype(chosen.dtype, np.integer) or not np.all((chosen >= 0) & (chosen < len(self))):
            raise InputError(f"contacts is {contacts!r}; expected indices from 0 to {len(self) - 1}")
        with self._place:
            for contact in chosen.tolist():
                lib.hs_batch_forget(self._batch, contact)
            self._loads[:, chosen] = 0.0

    def save(self) -> Self:
        """Return an independent copy, such as before a trial."""
        saved = type(self).__new__(type(self))
        saved.__dict__.update(self.__dict__ | {"_place": self._place.copy_guard()} | self._copied())
        return saved

    def restore(self, saved: Self) -> None:
        """Go on from what `save` has returned; InputError for a batch of other contacts."""
        if len(saved) != len(self) or saved._of != self._of:
            raise InputError(
                f"saved is of {len(saved)} contacts of other radii, friction or materials; expected what save() of "
                f"this batch of {len(self)} returned"
            )
        copied = saved._copied()
        with self._place:
            self.__dict__.update(copied)

    def _copied(self) -> dict[str, Any]:
        with self._place:
            return _held(self._loads.copy()) | {"_batch": owned(lib.hs_batch_copy(self._batch), lib.hs_batch_free)}

    def _each(self, name: str, values: npt.ArrayLike) -> Floats:
        array = workable(name, checked(name, values))
        if array.shape != (len(self),):
            raise InputError(f"{name} has shape {array.shape}; expected one number for each of {len(self)} contacts")
        return np.ascontiguousarray(array)


def _held(loads: Floats) -> dict[str, Any]:
    """Return the loads of a batch, and where they stand, as the library takes it."""
    return {"_loads": loads, "_rows": tuple(map(pointer, loads))}
