"""Recorders: select asperities, project rows of a replay onto variables, and store them."""

import abc
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, final

import attrs
import numpy as np

from historysim.asperities.body import Body, require, select_touching
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.law import FrictionLaw
from historysim.basics.arguments import DIRECTION, Array, Floats, Integers
from historysim.basics.fields import choice
from historysim.errors import InputError
from historysim.loads.event_sequence import (
    are_loads,
    channel_values,
    check_pressing,
    is_planar,
    time_text,
)
from historysim.loads.events import (
    Event,
    FrictionRamp,
    GeometryChange,
    NormalDisplacement,
    NormalLoad,
    TangentialDisplacement,
    TangentialLoad,
)
from historysim.loads.schedule import changes_geometry, friction_changes
from historysim.memory.paths import PROJECTED, Rows, blank_rows
from historysim.recording.variables import (
    COMPONENTS,
    COORDINATES,
    OF_DIRECTION,
    SLIDE_TIME,
    Changes,
    Variable,
    recorded_variables,
)

if TYPE_CHECKING:
    import xarray as xr

    from historysim.asperities.state import State
Selection = str | Sequence[int]


class JobOptions(TypedDict, total=False):
    """Options of `Replay`."""

    substeps: int
    saturate: bool
    record: Selection
    instrument: Instrument
    threads: int | None
    hold: bool | None
    past: str  #: one of `PASTS`


UNTOUCHED, UNKNOWN = "untouched", "unknown"
PASTS = (UNTOUCHED, UNKNOWN)
check_past = choice(*PASTS)
FORGOTTEN = "past_forgotten_time"  # attribute of a history with an unknown past

# largest number of rows replayed before they are recorded and progress is shown
ROWS_AT_ONCE = 1 << 12
# Rows times asperities in memory between writes to a file; twice as many during a write.
CELLS_AT_ONCE = 1 << 20
# Rows times asperities replayed before progress is shown, if all of them are kept in memory.
CELLS_IN_MEMORY = 1 << 24


def chosen_asperities(
    ensemble: Body, events: Sequence[Event], record: Selection
) -> Integers | None:
    """Return the indices of the asperities to record, ascending, or None for totals alone.

    "touching" selects asperities that touch at any time, inclined ones that may touch, and all if
    that is not known (wear, changed geometry). InputError if the word is another one, or an index
    does not exist or is repeated.
    """
    if isinstance(record, str) and record == "totals":
        return None
    if isinstance(record, str) and record in {"all", "touching"}:
        if record == "all" or changes_geometry(events):
            return np.arange(len(ensemble))
        load, approach = (_largest(events, kind) for kind in (NormalLoad, NormalDisplacement))
        # how far a tangential load moves them is not known before
        is_loaded = channel_values(events, TangentialLoad).size > 0
        displacement = (
            np.inf
            if is_loaded
            else float(np.abs(channel_values(events, TangentialDisplacement)).max(initial=0.0))
        )
        return np.flatnonzero(select_touching(ensemble, load, approach, displacement))
    selection = np.asarray(record if not isinstance(record, str) else ())
    if selection.ndim != 1 or selection.dtype.kind not in "iu" or selection.size == 0:
        raise InputError(
            f"record is {record!r}; expected 'touching', 'all', 'totals' or a list of asperity indices"
        )
    indices, counts = np.unique(selection.astype(np.int64), return_counts=True)
    outside = indices[(indices < 0) | (indices >= len(ensemble))]
    if outside.size or counts.max() > 1:
        problem = f"names asperity {outside[0]}" if outside.size else "names an asperity twice"
        raise InputError(
            f"record {problem}; expected indices from 0 to {len(ensemble) - 1}, each once"
        )
    return indices


def find_changes(ensemble: Body, events: Sequence[Event], instrument: Instrument) -> Changes:
    """Return the optional physics of a history; InputError if it does not support two tangential directions."""
    planar = is_planar(events)
    # events of one direction may be arrays, of which no objects are made
    kinds = (
        {type(event).name for event in events if isinstance(event, FrictionRamp | GeometryChange)}
        if planar
        else ()
    )
    if planar and (problem := ensemble.direction_limit or ", ".join(sorted(kinds))):
        raise InputError(
            f"{problem} supports one tangential direction only; expected one number in each load event, not two"
        )
    _check_supported(ensemble, events)
    law, wears = ensemble.laws.get("friction"), "wear" in ensemble.laws
    depends_on = law.depends_on if isinstance(law, FrictionLaw) else "nothing"
    changes = friction_changes(events)
    differs = (
        (depends_on not in {"nothing", "total"} and len(ensemble) > 1)
        or ensemble.friction.min() < ensemble.friction.max()
        or any(bad_event.differs for bad_event in changes)
    )
    return Changes(
        friction=bool(changes) or depends_on != "nothing",
        friction_differs=bool(differs) and ensemble.has_radii,
        sliding=ensemble.slides,
        wear=wears,
        yielding="yielding" in ensemble.laws,
        geometry=wears or changes_geometry(events),
        spring=not instrument.rigid,
        parallel=instrument.parallel_stiffness > 0,
        patches=not ensemble.has_radii,
        areas=ensemble.has_areas,
        attraction=ensemble.attracts,
        lines=ensemble.line_length is not None,
        planar=planar,
    )


def _check_supported(ensemble: Body, events: Sequence[Event]) -> None:
    """Check that a body supports the changes of friction and geometry in events; InputError names the event."""
    if not ensemble.attracts:
        check_pressing(events)
    if not ensemble.unsupported or are_loads(events):
        return
    for index, event in enumerate(events):
        try:
            # items that are not events are refused by the check of their order
            require(ensemble, *getattr(event, "needs", ()))
        except InputError as error:
            raise InputError.for_event(index, time_text(event.time), error) from None


def largest_approach(ensemble: Body, events: Sequence[Event]) -> float:
    """Return the largest approach of the highest summit in the events [m], 0 if nothing touches."""
    return max(
        _largest(events, NormalDisplacement), ensemble.approach_at(_largest(events, NormalLoad))
    )


def _largest(events: Sequence[Event], kind: type[NormalLoad | NormalDisplacement]) -> float:
    # channels run straight between waypoints, so the extremes are waypoints
    return float(channel_values(events, kind).max(initial=0.0))


@attrs.define
class Recorder(abc.ABC):
    """Base class of recorders of the rows of one history.

    A replay fills the rows that the recorder provides, and then states their times.
    """

    ensemble: Body
    asperities: Integers | None  #: (asperity) Indices to record; None for totals alone
    steps: int  #: rows that the whole history records
    instrument: Instrument = attrs.field(default=RIGID, kw_only=True)  #: in series with the contact
    #: optional physics of the history
    changes: Changes = attrs.field(default=Changes(), kw_only=True)
    #: Time at which each recorded asperity first slid [s], NaN for never; known at the end.
    slide_time: Floats | None = attrs.field(default=None, init=False)
    _filled: int = attrs.field(default=0, init=False)
    rows: Rows = attrs.field(init=False)  #: those given last to be filled, or more, in SI units

    @property
    def columns(self) -> int:
        """Number of recorded asperities."""
        return 0 if self.asperities is None else self.asperities.size

    @property
    def rows_at_once(self) -> int:
        """Largest number of rows that are replayed before they are recorded and progress is shown."""
        return self._steps_in_memory(CELLS_AT_ONCE)

    def _steps_in_memory(self, cells: int) -> int:
        return max(1, min(ROWS_AT_ONCE, cells // max(self.columns, 1)))

    @property
    def totals(self) -> tuple[Variable, ...]:
        """Variables along ``step`` alone."""
        return recorded_variables(self.changes)[0]

    @property
    def per_asperity(self) -> tuple[Variable, ...]:
        """Variables along ``step`` and ``asperity``."""
        return () if self.asperities is None else recorded_variables(self.changes)[1]

    def new_rows(self, count: int) -> Rows:
        """Return empty rows with arrays for all recorded variables."""
        always = (*PROJECTED, "dissipated_energy")
        more = {
            variable.source for variable in self.per_asperity if variable.derived is None
        } - set(always)
        columns = None if self.asperities is None else self.columns
        return blank_rows(count, columns, *sorted(more), planar=self.changes.planar)

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        self.rows = self.new_rows(count)
        return self.rows

    @abc.abstractmethod
    def record(self, times: Array) -> None:
        """Record the filled rows as the rows at these times [s]."""

    def conclude(self, state: "State") -> None:
        """Record the slide times of asperities from the state after the last row."""
        if self.asperities is not None:
            self.slide_time = self.ensemble.slide_time(state)[self.asperities]

    def project(self, rows: Rows) -> list[tuple[Variable, Array]]:
        """Return the variables along ``step`` with their values in these rows."""
        variables = *self.totals, *self.per_asperity
        return [
            (variable, variable.values(rows, self.ensemble, self.instrument))
            for variable in variables
        ]


@final
@attrs.define
class DatasetRecorder(Recorder):
    """Rows of one history in memory, projected onto the variables at the end."""

    _times: Array = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        self.rows = self.new_rows(self.steps)
        self._times = np.zeros(self.steps)

    @property
    def rows_at_once(self) -> int:
        """As for `Recorder`; fewer for patches, since their rows are made from many more elements."""
        return (
            self._steps_in_memory(CELLS_IN_MEMORY)
            if self.ensemble.has_radii
            else super().rows_at_once
        )

    def blank(self, count: int) -> Rows:
        """Return rows for the replay to fill next."""
        return self.rows[self._filled : self._filled + count]

    def record(self, times: Array) -> None:
        """Record the filled rows as the rows at these times [s]."""
        self._times[self._filled : self._filled + times.size] = times
        self._filled += times.size

    def dataset(self, attributes: Mapping[str, Any]) -> "xr.Dataset":
        """Return the recorded history, with these attributes."""
        once = [] if self.slide_time is None else [(SLIDE_TIME, self.slide_time)]
        coordinates = [
            *asperity_coordinates(self.ensemble, self.asperities),
            (COORDINATES[0], self._times),
        ]
        return labelled_dataset(
            [*self.project(self.rows), *once], coordinates, attributes, planar=self.changes.planar
        )


@final
@attrs.define
class TotalsRecorder(Recorder):
    """Selected totals of one history in memory."""

    names: tuple[str, ...]  #: fields of ``hs_totals``
    values: dict[str, Floats] = attrs.field(init=False)  #: (step) by name, in SI units

    def __attrs_post_init__(self) -> None:
        self.asperities = None
        self.values = {name: np.empty(self.steps) for name in self.names}

    def record(self, times: Array) -> None:
        """Keep the selected totals of the rows that were given last."""
        rows = slice(self._filled, self._filled + times.size)
        for name, values in self.values.items():
            values[rows] = self.rows.totals[name]
        self._filled += times.size


@final
@attrs.define
class StateOnly(Recorder):
    """Recorder that discards rows, if only the final state is requested."""

    def __attrs_post_init__(self) -> None:
        self.asperities = None

    def record(self, times: Array) -> None:
        """Discard the rows."""


def labelled_dataset(
    data: Iterable[tuple[Variable, Any]],
    coordinates: Iterable[tuple[Variable, Any]],
    attributes: Mapping[str, Any],
    *,
    planar: bool,
) -> "xr.Dataset":
    """Return a complete history of arrays, which xarray may read lazily, with the metadata of their variables."""
    import xarray as xr

    def label(arrays: Iterable[tuple[Variable, Any]]) -> dict[str, xr.Variable]:
        return {
            one.name: xr.Variable(
                one.dimensions, values, one.attributes, {"_FillValue": None, "dtype": one.dtype}
            )
            for one, values in arrays
        }

    labels = label(coordinates)
    if planar:
        labels[DIRECTION] = xr.Variable(DIRECTION, list(COMPONENTS), {"long_name": OF_DIRECTION})
    return xr.Dataset(label(data), labels, {**attributes, "complete": np.int8(1)})


def asperity_coordinates(
    ensemble: Body, asperities: Integers | None
) -> list[tuple[Variable, Array]]:
    """Coordinates along ``asperity``, with their values."""
    if asperities is None:
        return []
    values: dict[str, Array] = {"asperity": asperities}
    values |= {name: source[asperities] for name, source in ensemble.coordinates.items()}
    return [
        (variable, values[variable.name]) for variable in COORDINATES if variable.name in values
    ]
