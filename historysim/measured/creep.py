"""Holds at reversals: prediction of the contact's memory, creep, and drift of the sensor zero.

README.md of this folder, "Drift and creep", has the definitions.
"""

import math
from typing import Any

import attrs
import numpy as np

from historysim.asperities.body import Body
from historysim.asperities.instrument import Instrument
from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.units import duration_text, quantity_text
from historysim.basics.wording import count_text, html_table
from historysim.errors import InputError
from historysim.measured.holds import Rest, find_rests, quiet
from historysim.measured.intervals import student_factor
from historysim.measured.loop_table import CONFIDENCE
from historysim.measured.observation import Observation, observe
from historysim.measured.reduction import (
    Measurement,
    estimate_white_noise,
    estimated_noise,
    loop_dead_band,
)
from historysim.measured.response import compute_response

FEWEST_HOLDS = 3  # holds from which on their scatter is known
FINENESS = 10  # means of a hold in a decade of its time
ONSETS = 80  # times of onset that are tried
# squares of the scatter that another form has to leave more before relaxation is over log time
CLEARLY_BETTER = 8.0
# Creep over a thousandth of the stroke that a search starts from at least, and steps of the search.
LEAST_START, MOST_ROUNDS = 1e-3, 30
# Onsets, and parts of the measured change, of which the best begins the search.
FIRST_ONSETS, FIRST_SHARES = 4, (0.03, 0.3, 1.0)
LEAST_ROLE = 0.02  # part of the tangential load at the limit below which a hold has none to relax


@attrs.frozen
class Hold:
    """A hold, with the parts of the change of its tangential load from its start to its end [N], which add up."""

    start: float  #: [s]
    duration: float  #: [s]
    normal_load: float  #: its mean [N]
    tangential_load: float  #: where the displacement has come to rest [N]
    change: float  #: what was measured [N]
    memory: float  #: what the contact's memory predicts of displacement and normal load [N]
    #: change with the logarithm of time, against the load [N]; NaN where the record does not say
    relaxation: float
    sensor: float  #: change with time in one direction, whatever the load [N]; likewise

    @property
    def rest(self) -> float:
        """Unexplained change [N]."""
        return self.change - self.memory - self.relaxation - self.sensor


@attrs.frozen
class WithInterval:
    """A number with its interval of 95 %."""

    value: float
    low: float
    high: float

    def text(self, unit: str) -> str:
        """Return it as a string."""
        low, high = (quantity_text(bound, unit, 3) for bound in (self.low, self.high))
        return f"{quantity_text(self.value, unit, 3)} (95 %: {low} to {high})"


@attrs.frozen(eq=False)
class Creep:
    """Result of the holds of a record: creep c ln(1 + t/τ) against the load, in addition to memory."""

    holds: tuple[Hold, ...]
    per_decade: WithInterval  #: by how much the contact creeps in each decade of time, c ln 10 [m]
    #: Share of the tangential load that this takes in each decade of time, while the drive rests
    #: [1].
    relaxation: WithInterval
    onset: float  #: τ [s]; NaN where the record does not say
    sensor_drift: WithInterval  #: drift of the zero of the load [N/s]
    unknown: str = ""  #: why the record does not say how the load relaxes; empty where it does
    #: (point) Since the start of the hold [s]
    time: Floats = attrs.field(repr=False, factory=lambda: np.empty(0))
    #: (point) Means of what memory and sensor leave of the load, over the load at the start of the
    #: hold [1].
    relaxed: Floats = attrs.field(repr=False, factory=lambda: np.empty(0))
    #: (point) Whether that load is positive.
    forward: Booleans = attrs.field(repr=False, factory=lambda: np.empty(0, dtype=bool))
    #: lines of (label, text): what was done to the record before
    remarks: tuple[tuple[str, str], ...] = ()

    def __repr__(self) -> str:
        return f"<Creep: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        heading, *rows = self.rows()
        return html_table(self.summary()) + html_table(rows, heading)

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text)."""
        lasting = sorted(hold.duration for hold in self.holds)
        length = duration_text(lasting[0])
        if lasting[-1] > 1.01 * lasting[0]:
            length = f"{length} to {duration_text(lasting[-1])}"
        lines = [*self.remarks, ("holds", f"{len(self.holds):,}, of {length}")]
        largest = max(self.holds, key=lambda hold: abs(hold.memory)).memory
        lines.append(
            ("memory predicts", f"changes of up to {quantity_text(abs(largest), 'N', 3)} in a hold")
        )
        if self.unknown:
            return [*lines, ("relaxation", f"the record does not say: {self.unknown}")]
        share = [f"{100 * value:.3g} %" for value in attrs.astuple(self.relaxation)]
        return [
            *lines,
            (
                "relaxation",
                f"{share[0]} of the tangential load in a decade of time (95 %: {share[1]} to {share[2]})",
            ),
            ("creep of the contact", f"{self.per_decade.text('m')} in a decade of time"),
            ("onset", f"about {duration_text(self.onset)} after the displacement has come to rest"),
            ("drift of the sensor", self.sensor_drift.text("N/s")),
        ]

    def rows(self) -> list[tuple[str, ...]]:
        """Return a table of strings with a row for each hold."""
        heading = ("start", "duration", "load", "change", "memory", "relaxation", "sensor", "rest")

        def to_row(hold: Hold) -> tuple[str, ...]:
            changes = (
                hold.tangential_load,
                hold.change,
                hold.memory,
                hold.relaxation,
                hold.sensor,
                hold.rest,
            )
            texts = [
                "–" if math.isnan(change) else quantity_text(change, "N", 3) for change in changes
            ]
            return (f"{hold.start:.6g} s", duration_text(hold.duration), *texts)

        return [heading, *map(to_row, self.holds)]


def separate_creep(measurement: Measurement, ensemble: Body, instrument: Instrument) -> Creep:
    """Separate memory, creep and sensor drift in the holds of a record.

    InputError: no holds, or a record without tangential displacement, tangential load or normal
    load.
    """
    load = measurement["tangential_load"]
    time = measurement.time
    record = _Record.from_measurement(measurement, ensemble, instrument)
    law = _creeping(record)
    reason = law.unknown
    relaxes = np.zeros(load.size)
    memory = record.compute_load(0.0, 1.0)
    if not reason:
        steady = record.at_steady_load()
        relaxes = steady.compute_load(law.creep, law.onset) - steady.compute_load(0.0, law.onset)
        memory = record.compute_load(law.creep, law.onset) - relaxes
    points = record.points(load - memory)
    fit = _Fit.minimise(points)
    reason = reason or _better(points, fit)
    held = []
    for rest in record.rests:
        long = float(rest.since(time)[-1])
        held.append(
            Hold(
                start=rest.origin,
                duration=long,
                normal_load=float(measurement["normal_load"][rest.samples].mean()),
                tangential_load=rest.start(load),
                change=rest.change(load),
                memory=rest.change(memory),
                relaxation=math.nan if reason else rest.change(relaxes),
                sensor=math.nan if reason else law.drift.value * long,
            )
        )
    value = law.per_decade.value
    share = math.log(10) * fit.share / value if value else math.nan
    return Creep(
        holds=tuple(held),
        per_decade=law.per_decade,
        relaxation=WithInterval(*(share * value for value in attrs.astuple(law.per_decade))),
        onset=math.nan if reason else law.onset,
        sensor_drift=law.drift,
        unknown=reason,
        time=points.time,
        relaxed=fit.relaxation(points),
        forward=points.load > 0,
        remarks=measurement.remarks,
    )


@attrs.frozen(eq=False)
class _Points:
    """Means of load residuals in the holds, each over a fraction of a decade of time."""

    hold: Integers  #: (point)
    time: Floats  #: (point) Since the start of the hold [s]
    left: Floats  #: (point) Measured less predicted load [N]
    load: Floats  #: (point) Tangential load at the start of the hold [N]
    count: Floats  #: (point) Samples of the mean

    def subtract_hold_means(self, values: Floats) -> Floats:
        """Return values (point) less their weighted mean in each hold."""
        weight = np.bincount(self.hold, self.count)
        mean = np.bincount(self.hold, self.count * values) / np.maximum(weight, 1.0)
        return values - mean[self.hold]

    @property
    def onsets(self) -> tuple[float, float]:
        """The logarithms of the times between which an onset is looked for."""
        return math.log(float(self.time.min()) / 10), math.log(10 * float(self.time.max()))


@attrs.frozen(eq=False)
class _Record:
    """A record, with the contact that creeps in its holds."""

    load: Floats  #: (sample) What was measured [N]
    observation: Observation
    ensemble: Body
    instrument: Instrument
    rests: list[Rest]
    sense: Floats  #: (hold) Sign of the tangential load

    @classmethod
    def from_measurement(
        cls, measurement: Measurement, ensemble: Body, instrument: Instrument
    ) -> "_Record":
        """Return a record without the noise of displacement and normal load in its holds."""
        displacement = measurement["tangential_displacement"]
        load = measurement["tangential_load"]
        least = LEAST_ROLE * float(np.abs(load).max())
        rests = [part for part in find_rests(measurement) if abs(part.start(load)) > least]
        if not rests:
            raise InputError(
                "the tangential load is 0 in all holds, so that it has nothing to relax from"
            )
        still = quiet(measurement, rests)
        band = loop_dead_band(displacement, measurement.dead_band.get("tangential_displacement"))
        still = attrs.evolve(still, dead_band={**still.dead_band, "tangential_displacement": band})
        observation = observe(
            still,
            displacement_noise=estimated_noise(displacement),
            load_noise=estimate_white_noise(load),
        )
        return cls(
            load,
            observation,
            ensemble,
            instrument,
            rests,
            np.sign([part.start(load) for part in rests]),
        )

    def at_steady_load(self) -> "_Record":
        """Return the same with the normal load of the start of each hold throughout it."""
        normal = self.observation.normal_load.copy()
        for rest in self.rests:
            normal[rest.samples] = normal[rest.samples[0]]
        return attrs.evolve(self, observation=attrs.evolve(self.observation, normal_load=normal))

    def compute_load(self, creep: float, onset: float) -> Floats:
        """Return the tangential load (sample) [N] where the contact creeps by creep ln(1 + t/onset) [m] in each hold.

        What has crept stays, until the contact slides.
        """
        time = self.observation.time
        moved = self.observation.displacement.copy()
        for rest, sense in zip(self.rests, self.sense, strict=True):
            crept = sense * creep * _growth(rest.since(time), onset)
            moved[rest.samples] -= crept
            moved[rest.samples[-1] + 1 :] -= crept[-1]
        observation = attrs.evolve(self.observation, displacement=moved)
        return compute_response(self.ensemble, self.instrument, observation).tangential_load

    def points(self, left: Floats) -> _Points:
        """Average load residuals (sample) [N] in the holds over fractions of a decade."""
        columns: list[list[float]] = []
        for number, rest in enumerate(self.rests):
            # the first sample may still be on its way
            since = rest.since(self.observation.time)[1:]
            residual = left[rest.samples][1:]
            group = np.floor(FINENESS * np.log10(np.maximum(since, np.finfo(float).tiny))).astype(
                int
            )
            for number_of_group in np.unique(group[since > 0]):
                members = group == number_of_group
                columns.append(
                    [
                        number,
                        since[members].mean(),
                        residual[members].mean(),
                        rest.start(self.load),
                        members.sum(),
                    ]
                )
        hold, *others = np.array(columns).T
        return _Points(hold.astype(int), *others)


_NOTHING = WithInterval(math.nan, math.nan, math.nan)


@attrs.frozen
class _Law:
    """Creep of a contact, and the drift of its sensor."""

    creep: float = math.nan
    onset: float = math.nan
    per_decade: WithInterval = _NOTHING
    drift: WithInterval = _NOTHING
    unknown: str = ""


def _creeping(record: _Record) -> _Law:
    """Return the creep with which the model has the least squares in the holds, with intervals of 95 %.

    These leave the holds out one by one (jackknife): that has all that differs from hold to hold,
    in it correlated noise. The model is taken as linear there.
    """
    count = len(record.rests)
    if count < FEWEST_HOLDS:
        few = count_text(count, "hold", "holds")
        return _Law(unknown=f"it has {few}; expected {FEWEST_HOLDS} or more, for an interval")
    measured = record.points(record.load)
    steady = record.at_steady_load()
    unit = 1e-3 * float(np.ptp(record.observation.displacement))
    drift_unit = float(np.abs(measured.load).mean()) / float(measured.time.max())
    onset = math.sqrt(float(measured.time.min() * measured.time.max()))
    # share of the load that creep by one unit takes over ln(1 + t/τ)
    relaxed = _Fit.minimise(
        record.points(steady.compute_load(unit, onset) - steady.compute_load(0.0, onset))
    ).share
    if not relaxed > 0:
        return _Law(unknown="the contact of the model carries no tangential load there")
    solution = _solve(record, measured, unit, drift_unit, relaxed)
    if not solution.jac[:, 0].any():
        return _Law(
            unknown="none is seen; noise decides, or slip as the normal load falls hides it"
        )
    of_hold = measured.hold == np.arange(count)[:, np.newaxis]
    squares = np.array([solution.jac[members].T @ solution.jac[members] for members in of_hold])
    across = np.array([solution.jac[members].T @ solution.fun[members] for members in of_hold])
    remaining = zip(squares.sum(axis=0) - squares, across.sum(axis=0) - across, strict=True)
    moves = np.array([-np.linalg.pinv(square) @ gradient for square, gradient in remaining])
    variance = (count - 1) / count * np.sum((moves - moves.mean(axis=0)) ** 2, axis=0)
    reach = student_factor(count - 1, CONFIDENCE) * np.sqrt(variance)
    per_decade, drift = (
        WithInterval(*(of * float(solution.x[at] + sign * reach[at]) for sign in (0, -1, 1)))
        for at, of in ((0, unit * math.log(10)), (2, drift_unit))
    )
    unknown = ""
    if not per_decade.low > 0:
        limit = 100 * relaxed * per_decade.high / unit
        unknown = f"noise decides; a decade of time changes the load by less than {limit:.2g} %"
    return _Law(float(solution.x[0]) * unit, math.exp(solution.x[1]), per_decade, drift, unknown)


def _solve(
    record: _Record, measured: _Points, unit: float, drift_unit: float, relaxed: float
) -> Any:  # noqa: ANN401 - scipy gives no types
    """Return the least squares, from the best of some starts: under a falling load little creep has no minimum."""
    from scipy.optimize import least_squares

    mean_load = float(np.abs(measured.load).mean())

    def left(unknowns: Floats) -> Floats:
        points = record.points(
            record.load - record.compute_load(unknowns[0] * unit, math.exp(unknowns[1]))
        )
        drift = unknowns[2] * drift_unit * points.time
        return np.asarray(
            np.sqrt(points.count) / mean_load * points.subtract_hold_means(points.left - drift)
        )

    time, (low, high) = measured.time, measured.onsets
    change = max(abs(rest.change(record.load)) for rest in record.rests)
    onsets = np.geomspace(time.min(), time.max() / 10, FIRST_ONSETS)
    full_creep = change / mean_load / relaxed / np.log1p(time.max() / onsets)
    starts = [
        np.array([max(share * creep, LEAST_START), math.log(onset), 0.0])
        for share in FIRST_SHARES
        for onset, creep in zip(onsets, full_creep, strict=True)
    ]
    return least_squares(
        left,
        min(starts, key=lambda creep: float(np.sum(left(creep) ** 2))),
        bounds=([0.0, low - 1e-6, -np.inf], [np.inf, high + 1e-6, np.inf]),
        x_scale=[max(float(full_creep.mean()), LEAST_START), 1.0, 0.01],
        diff_step=1e-4,
        xtol=1e-6,
        max_nfev=MOST_ROUNDS,
    )


def _growth(time: Any, onset: float) -> Any:  # noqa: ANN401 - a number or an array
    return np.log1p(time / onset)


def _levelling(time: Floats, length: float) -> Floats:
    return np.asarray(1 - np.exp(-time / length))


@attrs.frozen
class _Fit:
    """Least squares of left = a_hold - share load form(t) + drift t."""

    squares: float
    share: float
    drift: float
    onset: float

    @classmethod
    def minimise(cls, points: _Points, form: Any = _growth) -> "_Fit":  # noqa: ANN401 - a function of time and onset
        """Return the best over the onset."""
        from scipy.optimize import minimize_scalar

        tried = np.linspace(*points.onsets, ONSETS)
        squares = [
            cls._at_onset(points, form, float(np.exp(onset_log))).squares for onset_log in tried
        ]
        best = int(np.argmin(squares))
        around = tried[max(best - 1, 0)], tried[min(best + 1, ONSETS - 1)]
        finer = minimize_scalar(
            lambda onset_log: cls._at_onset(points, form, math.exp(onset_log)).squares,
            bounds=around,
        )
        onset = finer.x if finer.fun < squares[best] else tried[best]
        return cls._at_onset(points, form, float(np.exp(onset)))

    @classmethod
    def _at_onset(cls, points: _Points, form: Any, onset: float) -> "_Fit":  # noqa: ANN401 - as for `minimise`
        root = np.sqrt(points.count)
        columns = [-points.load * form(points.time, onset), points.time]
        design = np.column_stack([root * points.subtract_hold_means(column) for column in columns])
        scale = np.maximum(np.abs(design).max(axis=0), np.finfo(float).tiny)
        goal = root * points.subtract_hold_means(points.left)
        solution = np.linalg.lstsq(design / scale, goal, rcond=None)[0] / scale
        return cls(
            float(np.sum((goal - design @ solution) ** 2)),
            float(solution[0]),
            float(solution[1]),
            onset,
        )

    def relaxation(self, points: _Points) -> Floats:
        """Return residuals less drift, over the load, with the mean of the fit in each hold."""
        form = -self.share * np.asarray(_growth(points.time, self.onset))
        residual = (points.left - self.drift * points.time) / points.load
        return points.subtract_hold_means(residual) + form - points.subtract_hold_means(form)


def _better(points: _Points, fit: _Fit) -> str:
    """Return the reason why relaxation may not be logarithmic in time; empty if it is."""
    scatter = fit.squares / max(points.hold.size - int(points.hold.max()) - 4, 1)
    levels = _Fit.minimise(points, _levelling).squares
    if levels < fit.squares - CLEARLY_BETTER * scatter:
        return "the load levels off: an exponential of time describes the holds better"
    if levels < fit.squares + CLEARLY_BETTER * scatter:
        return "holds are too short, or too noisy: an exponential of time describes them as well"
    return ""
