"""Sampled loads: what a record says of both channels at each of its samples, without an object for each event."""

from collections.abc import Sequence
from typing import overload

import attrs

from historysim.basics.array_types import Floats
from historysim.loads.events import Event, NormalLoad, TangentialDisplacement


@attrs.frozen(eq=False)
class SampledLoads(Sequence[Event]):
    """Events of a record: at each sample a normal load and a tangential displacement, in this order.

    A replay of them is that of the events one by one, but each sample has a step of its own, also where times repeat.
    """

    time: Floats
    """(sample) Times, which do not decrease [s]."""
    normal_load: Floats
    """(sample) [N], 0 or more."""
    tangential_displacement: Floats
    """(sample) [m], that of the drive where there is an instrument."""

    def __len__(self) -> int:
        """Return the number of events, two for each sample."""
        return 2 * self.time.size

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> list[Event]: ...
    def __getitem__(self, index: int | slice) -> Event | list[Event]:
        """Return an event, or those of a slice."""
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(index)
        sample, second = divmod(index % len(self), 2)
        time = float(self.time[sample])
        if second:
            return TangentialDisplacement(time, float(self.tangential_displacement[sample]))
        return NormalLoad(time, float(self.normal_load[sample]))
