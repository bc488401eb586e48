"""Records of sliding one way: friction over time or distance, the static peak at its start, and how it runs in.

The friction coefficient of a sample is T/N, positive in the direction of sliding. What is read off it:

- **windows** of equal length in time or distance, each with mean and standard deviation of its samples; the mean over
  a distance is that along the displacement, ∫ μ du / ∫ du, so that a rest does not count;
- the **static peak**: the greatest coefficient of the first part of the record, where it stands above the windows of
  sliding behind it by more than twice what noise lifts the greatest of as many samples, σ √(2 ln n), which is told
  beside it;
- the **approach** to the steady value, μ(s) = μ_steady + (μ_start - μ_steady) exp(-s/L), from the peak on, or else from
  where sliding begins; by least squares through the windows (scipy.optimize.curve_fit), with intervals of 95 % from
  their scatter. Where the record is shorter than 2 L, the steady value lies beyond it, and is said to.
"""

import math
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, get_args

import attrs
import numpy as np
import numpy.typing as npt

from historysim.basics.arguments import scalar
from historysim.basics.array_types import Floats, Integers
from historysim.basics.display import html_table
from historysim.basics.units import duration_text, quantity_text
from historysim.basics.wording import counted
from historysim.errors import InputError
from historysim.measured.noise import REVERSAL, noise_of
from historysim.measured.power_law import CONFIDENCE
from historysim.measured.reduction import channel, check_order, estimated_noise, loop_dead_band, turning_points

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.measurement import Measurement

Over = Literal["time", "distance"]
Kind = TypeVar("Kind", bound="attrs.AttrsInstance")

WINDOWS = 50
UNITS = {"time": "s", "distance": "m"}
FIRST_PART = 0.1
"""Share of the record, by time or distance, in which the static peak is looked for."""
SLIDES = 0.95
"""Share of the friction of the second window from which on a record without a peak is taken to slide."""
CONTENT_OF_COURSE = "friction over time or distance"
"""What the attribute ``content`` of a file of such a course says."""


@attrs.frozen
class StaticPeak:
    """The greatest friction coefficient at the start of sliding."""

    coefficient: float
    """T/N of one sample [1]."""
    place: float
    """Where: a time [s] or a distance [m]."""
    lifted: float
    """What noise adds to the greatest of as many samples, about [1]."""


@attrs.frozen
class Approach:
    """μ(s) = steady + (start - steady) exp(-s/length), with intervals of 95 % confidence.

    Attributes
    ----------
    steady, steady_low, steady_high : float
        [1].
    start, start_low, start_high : float
        At the place of `origin` [1].
    length, length_low, length_high : float
        A time [s] or a distance [m].
    origin : float
        Where s = 0: the static peak, or where sliding begins [s or m].
    settled : bool
        Whether the record goes on for two lengths or more; else the steady value lies beyond what was measured.
    """

    steady: float
    steady_low: float
    steady_high: float
    start: float
    start_low: float
    start_high: float
    length: float
    length_low: float
    length_high: float
    origin: float
    settled: bool = attrs.field(converter=bool)

    def at(self, place: npt.ArrayLike) -> Floats:
        """Return μ at times [s] or distances [m]."""
        way = np.asarray(place, dtype=np.float64) - self.origin
        return np.asarray(self.steady + (self.start - self.steady) * np.exp(-way / self.length))


@attrs.frozen(eq=False)
class Sliding:
    """Friction of a record that slides one way.

    Attributes
    ----------
    over : {"time", "distance"}
        What friction is given over.
    place : array (sample)
        The time [s] or the distance [m] since the start of each sample.
    coefficient : array (sample)
        T/N of each sample, positive in the direction of sliding [1]; NaN where it is not known any more.
    window_place, window_mean, window_deviation, window_count : array (window)
        The middle of each window [s or m], mean and standard deviation of μ in it [1], and its samples.
    peak : StaticPeak or None
        None where friction does not stand out at the start.
    approach : Approach or None
        None where friction does not run in towards a steady value.
    remarks : tuple of (label, text)
        What was done to the record before.
    """

    over: Over
    place: Floats
    coefficient: Floats
    window_place: Floats
    window_mean: Floats
    window_deviation: Floats
    window_count: Integers
    peak: StaticPeak | None
    approach: Approach | None
    remarks: tuple[tuple[str, str], ...] = ()

    def __repr__(self) -> str:
        return f"<Sliding: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        return html_table(self.summary())

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): how far it slid, the mean, the peak, and the approach to the steady value."""
        length = self._text(float(np.ptp(self.place)))
        means = self.window_mean
        scatter = f" ± {means.std(ddof=1):.2g}: mean ± standard deviation of the windows" if means.size > 1 else ""
        lines = [
            *self.remarks,
            ("slides", f"{length}, in {counted(means.size, 'window', 'windows')} of {self._text(self._width)}"),
            ("friction coefficient", f"{means.mean():.4g}{scatter}"),
        ]
        if self.peak is None:
            lines.append(("static peak", "none that stands above the noise"))
        else:
            lifted = f"of this, noise makes about {self.peak.lifted:.1g}"
            lines.append(("static peak", f"{self.peak.coefficient:.4g} at {self._text(self.peak.place)}; {lifted}"))
        if self.approach is None:
            return [*lines, ("steady value", "no approach to one that the windows show")]
        approach = self.approach
        beyond = "" if approach.settled else ": beyond the record, which is shorter than two lengths of the approach"
        steady = f"{approach.steady:.4g} (95 %: {approach.steady_low:.4g} to {approach.steady_high:.4g}){beyond}"
        low, high = self._text(approach.length_low), self._text(approach.length_high)
        return [
            *lines,
            ("steady value", steady),
            (
                "start of running-in",
                f"{approach.start:.4g} (95 %: {approach.start_low:.4g} to {approach.start_high:.4g})",
            ),
            (f"{self.over} of running-in", f"{self._text(approach.length)} (95 %: {low} to {high}), to 1/e"),
        ]

    def to_dataset(self) -> "xr.Dataset":
        """Return the windows as a Dataset with the dimension window; ``[friction.course]`` reads its file.

        `from_dataset` returns all of it but the samples.
        """
        import xarray as xr

        unit, attributes = UNITS[self.over], self._ends()
        for name, part in (("peak", self.peak), ("approach", self.approach)):
            if part is not None:
                attributes.update({f"{name}_{key}": float(value) for key, value in attrs.asdict(part).items()})
        return xr.Dataset(
            {
                "coefficient": ("window", self.window_mean, {"long_name": "friction coefficient", "units": "1"}),
                "standard_deviation": (
                    "window",
                    self.window_deviation,
                    {"long_name": "standard deviation of a sample", "units": "1"},
                ),
                "count": ("window", self.window_count, {"long_name": "samples", "units": "1"}),
            },
            coords={self.over: ("window", self.window_place, {"long_name": self.over, "units": unit})},
            attrs={"title": f"friction over {self.over}", "content": CONTENT_OF_COURSE, **attributes},
        )

    @classmethod
    def from_dataset(cls, table: "xr.Dataset") -> Self:
        """Return what `to_dataset` gave; of the samples their first and last place is left.

        A Dataset of something else is an InputError.
        """
        over = next((over for over in get_args(Over) if over in table.coords), None)
        if table.attrs.get("content") != CONTENT_OF_COURSE or over is None:
            raise InputError("this Dataset is no friction over time or distance; expected one of historysim sliding")
        middle = table[over].values
        reach = (middle[-1] - middle[0]) / max(middle.size - 1, 1) / 2
        # a version that did not tell the ends had windows between them all the same
        usual = {"record_start": middle[0] - reach, "record_end": middle[-1] + reach}
        ends = [float(table.attrs.get(name, end)) for name, end in usual.items()]
        remarks = filter(None, str(table.attrs.get("remarks", "")).split("\n"))

        def stored(name: str, kind: type[Kind]) -> Kind | None:
            fields = {field.name: table.attrs.get(f"{name}_{field.name}") for field in attrs.fields(kind)}
            return None if None in fields.values() else kind(**fields)

        return cls(
            over=over,
            place=np.array(ends),
            coefficient=np.full(2, np.nan),
            window_place=middle,
            window_mean=table["coefficient"].values,
            window_deviation=table["standard_deviation"].values,
            window_count=table["count"].values,
            peak=stored("peak", StaticPeak),
            approach=stored("approach", Approach),
            remarks=tuple((label, text) for label, _, text in (line.partition(": ") for line in remarks)),
        )

    def _ends(self) -> dict[str, Any]:
        remarks = "\n".join(f"{label}: {text}" for label, text in self.remarks)
        ends = {"record_start": float(self.place[0]), "record_end": float(self.place[-1])}
        return ends | ({"remarks": remarks} if remarks else {})

    @property
    def _width(self) -> float:
        return float(np.ptp(self.place)) / self.window_mean.size

    def _text(self, place: float) -> str:
        return duration_text(place) if self.over == "time" else quantity_text(place, "m")


def sliding_of_measurement(measurement: "Measurement", *, over: Over | None = None, windows: int = WINDOWS) -> Sliding:
    """Return the friction of a measurement that slides one way; without tangential displacement, over time alone.

    Parameters and errors as for `sliding_of_channels`; a load that was not measured is an InputError, too.
    """
    check_order(measurement.time, measurement.place)
    friction = sliding_of_channels(
        measurement.time,
        measurement["tangential_load"],
        measurement["normal_load"],
        measurement.get("tangential_displacement"),
        over=over,
        windows=windows,
        dead_band=measurement.dead_band.get("tangential_displacement"),
    )
    return attrs.evolve(friction, remarks=measurement.remarks)


def sliding_of_history(history: "xr.Dataset", *, over: Over | None = None, windows: int = WINDOWS) -> Sliding:
    """Return the friction of a simulated history; parameters and errors as for `sliding_of_channels`."""
    names = ("time", "total_tangential_load", "total_normal_load", "tangential_displacement")
    missing = [name for name in names if name not in history.variables]
    if missing:
        raise InputError(f"the Dataset has no {', '.join(missing)}; expected a history, as replay and run return it")
    return sliding_of_channels(*(history[name].values for name in names), over=over, windows=windows)


def sliding_of_channels(
    time: npt.ArrayLike,
    tangential_load: npt.ArrayLike,
    normal_load: npt.ArrayLike,
    displacement: npt.ArrayLike | None = None,
    *,
    over: Over | None = None,
    windows: int = WINDOWS,
    dead_band: float | None = None,
) -> Sliding:
    """Return the friction of a record that slides one way.

    Parameters
    ----------
    time : array_like (sample)
        Times that do not decrease [s].
    tangential_load, normal_load : array_like (sample)
        T and N [N]; samples at which N is not positive are left out.
    displacement : array_like (sample), optional
        Tangential displacement U [m]; without it friction is known over time alone.
    over : {"time", "distance"}, optional
        What friction is given over; by default the distance where it is known.
    windows : int
        How many windows of equal length, 1 or more.
    dead_band : float, optional
        The smallest swing of U that counts as a reversal [m]; by default 5 % of its range.

    Raises
    ------
    InputError
        Missing or infinite samples, times that decrease, channels of different lengths, a displacement that turns back
        or does not move, a normal load that never presses, or another number of windows.
    """
    load = channel("tangential_load", tangential_load)
    normal = channel("normal_load", normal_load, load.size)
    times = channel("time", time, load.size)
    check_order(times, lambda sample: f"time[{sample}]")
    count = scalar("windows", windows, least=1)
    if count % 1:
        raise InputError(f"windows is {count:g}; expected a whole number, 1 or more")
    moved = None if displacement is None else channel("displacement", displacement, load.size)
    rests = moved is not None and over == "time" and _rests(moved)
    sense = (1.0 if load.mean() >= 0 else -1.0) if moved is None or rests else _one_way(times, moved, dead_band)
    along = _place(over, times, moved, sense)
    pressed = normal > 0
    if not pressed.any():
        raise InputError("the normal load presses at no sample; expected more than 0 N: write scale = -1 where it does")
    along, friction = along[pressed], sense * load[pressed] / normal[pressed]
    edges = np.linspace(along[0], along[-1], int(count) + 1)
    means = _windows(along, friction, edges)
    middle = (edges[1:] + edges[:-1]) / 2
    peak = _peak(along, friction, edges, means[0])
    name: Over = over or ("time" if moved is None else "distance")
    origin = _start(along, friction, means[0]) if peak is None else peak.place
    approach = _approach(edges, means[0], origin)
    return Sliding(name, along, friction, middle, *means, peak, approach)


def _rests(moved: Floats) -> bool:
    """Return whether a displacement is all noise: that of what slides was not recorded."""
    noise = estimated_noise(moved)
    return bool(np.ptp(moved) <= 2 * REVERSAL * noise) or bool(np.ptp(moved) == 0)


def _one_way(time: Floats, moved: Floats, dead_band: float | None) -> float:
    """Return the direction of a displacement that goes one way."""
    turns = turning_points(moved, loop_dead_band(moved, dead_band))
    swings = np.diff(moved[turns])
    if not np.any(swings) or _rests(moved):
        raise InputError(
            "the tangential displacement rests; expected one that slides, or --over time, in Python "
            'over="time", which does without it'
        )
    # at its ends a record may waver by less than the dead band
    wide = np.abs(swings) >= loop_dead_band(moved, dead_band)
    if np.unique(np.sign(swings[wide])).size > 1:
        back = time[turns[np.flatnonzero(wide)[1]]]
        raise InputError(
            f"the tangential displacement turns back at t = {back:g} s; expected sliding one way: loops are what "
            "`historysim loops` reads, and start and end of [loading] cut a record"
        )
    return float(np.sign(swings[np.argmax(np.abs(swings))]))


def _place(over: Over | None, time: Floats, moved: Floats | None, sense: float) -> Floats:
    if over not in {None, "time", "distance"}:
        raise InputError(f"over is {over!r}; expected 'time' or 'distance'")
    if over == "distance" and moved is None:
        raise InputError("the tangential displacement was not measured; expected it for friction over the distance")
    if over == "time" or moved is None:
        return time
    # how far it has come: noise does not take it back
    return np.asarray(np.maximum.accumulate(sense * (moved - moved[0])))


def _windows(along: Floats, friction: Floats, edges: Floats) -> tuple[Floats, Floats, Integers]:
    """Return mean along the place, standard deviation and number of the samples of each window."""
    windows = edges.size - 1
    # the integral of the friction up to each sample and, between samples, up to each edge
    steps = np.diff(along) * (friction[1:] + friction[:-1]) / 2
    integral = np.append(0.0, np.cumsum(steps))
    last = np.append(np.diff(along) > 0, True)
    up_to = np.interp(edges, along[last], integral[last])
    lengths = np.diff(edges)
    mean = np.divide(np.diff(up_to), lengths, out=np.full(windows, friction.mean()), where=lengths > 0)
    number = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, windows - 1)
    count = np.bincount(number, minlength=windows)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.bincount(number, friction, windows) / count
        square = np.bincount(number, (friction - own[number]) ** 2, windows)
        deviation = np.sqrt(square / (count - 1))
    return mean, np.where(count > 1, deviation, math.nan), count


def _peak(along: Floats, friction: Floats, edges: Floats, mean: Floats) -> StaticPeak | None:
    first = along - along[0] <= FIRST_PART * (along[-1] - along[0])
    if not first.any() or first.all():
        return None
    place = int(np.argmax(np.where(first, friction, -math.inf)))
    behind = edges[:-1] >= along[place]
    if not behind.any():
        return None
    noise = noise_of(friction)
    lifted = noise * math.sqrt(2 * math.log(max(int(first.sum()), 2)))
    # running-in falls by itself from window to window; a peak stands above what the next windows lead back to
    near = np.flatnonzero(behind)[:2]
    level = float(mean[near[0]] + max(mean[near[0]] - mean[near[-1]], 0.0))
    if friction[place] - level <= 2 * lifted:
        return None
    return StaticPeak(float(friction[place]), float(along[place]), lifted)


def _start(along: Floats, friction: Floats, mean: Floats) -> float:
    """Return where the friction has come near that of the second window: before it the contact bends."""
    reached = friction >= SLIDES * mean[min(1, mean.size - 1)]
    return float(along[int(reached.argmax())])


def _approach(edges: Floats, mean: Floats, origin: float) -> Approach | None:
    """Return the approach that the windows behind a place show; None where there is none."""
    from scipy import optimize, stats

    behind = edges[:-1] >= origin
    place, values = (edges[1:] + edges[:-1])[behind] / 2 - origin, mean[behind]
    if place.size < 5 or np.ptp(values) == 0:
        return None

    def model(way: Floats, steady: float, start: float, length: float) -> Floats:
        return steady + (start - steady) * np.exp(-way / length)

    whole = float(edges[-1] - origin)
    shortest = float(place[1] - place[0]) / 10
    guess = [float(values[-max(place.size // 5, 1) :].mean()), float(values[0]), whole / 5]
    try:
        estimates, covariance = optimize.curve_fit(
            model, place, values, p0=guess, bounds=([-np.inf, -np.inf, shortest], [np.inf, np.inf, 100 * whole])
        )
    except (RuntimeError, ValueError):
        return None
    errors = np.sqrt(np.diag(covariance))
    reach = float(stats.t.ppf((1 + CONFIDENCE) / 2, place.size - 3)) * errors
    # an approach whose height is not told from 0 is none
    if not np.isfinite(reach).all() or abs(estimates[1] - estimates[0]) <= math.hypot(reach[0], reach[1]):
        return None
    bounds = [(float(value), float(value - by), float(value + by)) for value, by in zip(estimates, reach, strict=True)]
    steady, start, length = bounds
    return Approach(*steady, *start, length[0], max(length[1], 0.0), length[2], origin, bool(2 * estimates[2] <= whole))
