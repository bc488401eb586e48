"""`ContactBatch`: many independent contacts of spheres, each with a separate approach and displacement."""

from typing import Any, Self

import numpy as np
import numpy.typing as npt

from historysim.asperities.law import coulomb
from historysim.basics.arguments import Floats, as_floats, as_item_array, workable
from historysim.basics.library import OneAtATime, ffi, lib, pointer
from historysim.basics.limits import LARGEST, SMALLEST
from historysim.contact.materials import MaterialPair
from historysim.errors import InputError
from historysim.memory.binding import check, take_ownership

# module-level references save attribute look-ups in each step
_FLOAT, _DOUBLES, _from_buffer = np.dtype(np.float64), ffi.typeof("double[]"), ffi.from_buffer
_accepts, _step = lib.hs_batch_accepts, lib.hs_batch_step


class ContactBatch:
    """Independent Hertzian contacts of one pair of materials, such as those between grains, stepped in place.

    Each path of each contact is straight in approach and displacement and is integrated exactly, as
    in an `Ensemble` of one asperity. The displacement is along one fixed direction, chosen by the
    caller. Energies are not computed: the dissipated energy is the work of the loads minus the
    recovered energy. Only one thread at a time can use a batch; a second thread gets an error.

    Parameters
    ----------
    pair : MaterialPair
    radius : array_like
        Effective radius R of each contact [m], 1/R = 1/R1 + 1/R2, > 0; one for all or one per
        contact.
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

    def __init__(
        self, pair: MaterialPair, radius: npt.ArrayLike, friction: npt.ArrayLike, count: int
    ) -> None:
        if not isinstance(pair, MaterialPair):
            raise InputError(f"pair is {pair!r}; expected a MaterialPair")
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
            raise InputError(f"count is {count!r}; expected a whole number of contacts, 1 or more")
        radii = workable("radius", as_floats("radius", radius, above=0), smallest=SMALLEST)
        if radii.size > 1:
            radii = as_item_array("contact", "contacts", "radius", radii, int(count))
        coefficients = (
            coulomb(friction, int(count)) if np.size(friction) > 1 else coulomb(friction, 1)
        )
        scale = np.atleast_1d(4.0 / 3.0 * pair.contact_modulus * np.sqrt(radii))
        self._count = int(count)
        self.__dict__.update(_load_fields(np.zeros((2, self._count))))
        self._guard = OneAtATime("the batch: a batch for each thread, such as batch.save()")
        self._identity = coefficients.tobytes(), scale.tobytes(), pair.displacement_ratio
        batch = lib.hs_batch_new(
            count,
            coefficients.size,
            pointer(coefficients),
            scale.size,
            pointer(scale),
            pair.displacement_ratio,
        )
        self._batch = take_ownership(batch, lib.hs_batch_free)

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
        """Move each contact straight to its approach and displacement.

        Parameters
        ----------
        approach, tangential_displacement : array_like (contact)
            δ and U [m]. A negative δ, at which the spheres are separated, erases the memory of the
            contact. First touch on a path is at δ = 0 on the straight line from the previous
            position; the first path starts from δ = U = 0. InputError, without
            any change, if a number is not finite, the numbers are not as many as the contacts, or
            another thread steps the batch.
        """
        pointers = self._native_pointers(approach, tangential_displacement)
        if pointers is None:
            arguments = ("approach", approach), ("tangential_displacement", tangential_displacement)
            pointers = tuple(pointer(self._checked_array(*argument)) for argument in arguments)
        with self._guard:
            check(_step(self._batch, *pointers, *self._rows))

    def _native_pointers(self, *arrays: Any) -> tuple[Any, ...] | None:
        """Return pointers to the arrays without a copy; None if one needs conversion or is invalid."""
        for values in arrays:
            plain = (
                type(values) is np.ndarray
                and values.dtype is _FLOAT
                and values.shape == (self._count,)
            )
            if not plain or not values.flags.c_contiguous:
                return None
        pointers = tuple([_from_buffer(_DOUBLES, values) for values in arrays])
        return pointers if _accepts(self._batch, *pointers, LARGEST) else None

    def forget(self, contacts: npt.ArrayLike) -> None:
        """Reset contacts by index, such as where grains have new neighbours: unloaded, at δ = U = 0."""
        chosen = np.atleast_1d(np.asarray(contacts))
        if not np.issubdtype(chosen.dtype, np.integer) or not np.all(
            (chosen >= 0) & (chosen < len(self))
        ):
            raise InputError(
                f"contacts is {contacts!r}; expected indices from 0 to {len(self) - 1}"
            )
        with self._guard:
            for contact in chosen.tolist():
                lib.hs_batch_forget(self._batch, contact)
            self._loads[:, chosen] = 0.0

    def save(self) -> Self:
        """Return an independent copy, such as before a trial."""
        saved = type(self).__new__(type(self))
        saved.__dict__.update(
            self.__dict__ | {"_place": self._guard.copy_guard()} | self._copy_fields()
        )
        return saved

    def restore(self, saved: Self) -> None:
        """Return to a state saved by `save`; InputError for a batch of other contacts."""
        if len(saved) != len(self) or saved._identity != self._identity:
            raise InputError(
                f"saved has {len(saved)} contacts with other radii, friction or materials; expected the result of "
                f"save() of this batch of {len(self)}"
            )
        fields = saved._copy_fields()
        with self._guard:
            self.__dict__.update(fields)

    def _copy_fields(self) -> dict[str, Any]:
        with self._guard:
            return _load_fields(self._loads.copy()) | {
                "_batch": take_ownership(lib.hs_batch_copy(self._batch), lib.hs_batch_free)
            }

    def _checked_array(self, name: str, values: npt.ArrayLike) -> Floats:
        array = workable(name, as_floats(name, values))
        if array.shape != (len(self),):
            raise InputError(
                f"{name} has shape {array.shape}; expected one number for each of {len(self)} contacts"
            )
        return np.ascontiguousarray(array)


def _load_fields(loads: Floats) -> dict[str, Any]:
    """Return the load fields of a batch: the array, and pointers to its rows for the library."""
    return {"_loads": loads, "_rows": tuple(map(pointer, loads))}
