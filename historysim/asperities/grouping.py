"""Which asperities share one traction memory, and in which order they stand in a contact."""

import attrs
import numpy as np
import numpy.typing as npt

from historysim.asperities.state import EnsembleState
from historysim.memory.friction import refresh_loads
from historysim.memory.layout import APPROACH, Contact, Integers, Memory

Floats = npt.NDArray[np.float64]


def groups(*keys: npt.NDArray[np.generic]) -> Integers:
    """Return the friction group of each asperity, a number from 0: those that are alike in every key share one.

    Asperities that have had the same coefficient ever since they touched share one traction memory.
    """
    numbers = np.zeros(len(keys[0]), dtype=np.int64)
    for key in keys:
        if (key == key[0]).all():
            continue
        _, rank = np.unique(key, return_inverse=True)
        _, numbers = np.unique(numbers * (rank.max() + 1) + rank, return_inverse=True)
    return numbers


def ordered(
    group: Integers,
    friction: Floats,
    gap: Floats,
    weight: Floats,
    index: Integers | None = None,
    *,
    by_gap: Integers | None = None,
) -> tuple[Contact, Integers]:
    """Return a contact whose asperities stand by group and gap, and which one stands at each position.

    Parameters
    ----------
    group, friction, gap, weight : array (asperity)
        Groups are numbered from 0; coefficients are those of the groups.
    index : array (asperity), optional
        Asperities of one gap stand in its order among all groups; by default in that in which they come.
    by_gap : array (asperity), optional
        Their order by ascending gap, and then in that in which they come, where it is known.
    """
    smallest = np.full(group.max() + 1, np.inf)
    np.minimum.at(smallest, group, gap)
    # sorting by gap takes the most of all; what stands in order already is sorted again in no time
    ascending = np.argsort(gap, kind="stable") if by_gap is None else by_gap
    place = np.empty(smallest.size, dtype=np.int64)
    place[np.argsort(smallest, kind="stable")] = np.arange(smallest.size)
    order = ascending if smallest.size == 1 else ascending[np.argsort(place[group[ascending]], kind="stable")]
    first = np.flatnonzero(np.diff(group[order], prepend=-1, append=-1))
    among_all = ascending if index is None else np.lexsort((index, gap))
    by_group = gap[order], weight[order]
    # of one group all stand in the one order, and the fewer arrays there are, the more of them a cache holds
    sorted_gap, sorted_weight = by_group if among_all is order else (gap[among_all], weight[among_all])
    contact = Contact(
        *by_group,
        first=first.astype(np.int64),
        friction=friction[order[first[:-1]]],
        sorted_gap=sorted_gap,
        sorted_weight=sorted_weight,
    )
    return contact, order.astype(np.int64)


def regrouped(state: EnsembleState, *keys: Floats) -> EnsembleState:
    """Return a state whose groups are split where asperities are not alike in keys (asperity) any more.

    Each part keeps what the group remembers.
    """
    before = np.empty(state.order.size, dtype=np.int64)
    before[state.order] = np.repeat(np.arange(state.contact.friction.size), np.diff(state.contact.first))
    group = groups(before, *keys)
    if group.max() + 1 == state.contact.friction.size:
        return state
    gap, weight, dissipated = (np.empty(state.order.size) for _ in range(3))
    gap[state.order], weight[state.order] = state.contact.gap, state.contact.weight
    dissipated[state.order] = state.memory.dissipated
    contact, order = ordered(group, state.contact.friction[before], gap, weight)
    leader = contact.first[:-1]
    parent = before[order[leader]]
    touches = contact.gap[leader] < state.memory.now[APPROACH]
    memory = Memory(
        vertices=state.memory.vertices[parent],
        depth=np.where(touches, state.memory.depth[parent], 0),
        steep=state.memory.steep[parent],
        dissipated=dissipated[order],
        now=state.memory.now.copy(),
    )
    refresh_loads(contact, memory)
    return attrs.evolve(state, contact=contact, order=order, memory=memory, deeper=None)


def leaders(state: EnsembleState) -> Integers:
    """Return the ensemble index of each group's highest asperity."""
    return state.order[state.contact.first[:-1]]
