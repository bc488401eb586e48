"""Records of sliding one way: friction over time or distance, the static peak at its start, and how it runs in.

README.md of this folder, "Sliding one way", says how each number is found.
"""

import math
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, get_args

import attrs
import numpy as np

from historysim.basics.arguments import ArrayLike, Booleans, Floats, Integers, scalar
from historysim.basics.units import duration_text, quantity_text
from historysim.basics.wording import count_text, html_table
from historysim.errors import InputError
from historysim.measured.reduction import (
    FEWEST_SPIKES,
    REVERSAL,
    SPIKE,
    channel,
    check_order,
    count_of_spikes,
    deviation_by_median,
    estimate_white_noise,
    estimated_noise,
    history_channels,
    loop_dead_band,
    turning_points,
)
from historysim.recording.stored_units import unit_factor

if TYPE_CHECKING:
    import xarray as xr

    from historysim.measured.reduction import Measurement
from historysim.measured.steady_friction import Approach, select_approach

Over = Literal["time", "distance"]
Kind = TypeVar("Kind", bound="attrs.AttrsInstance")
WINDOWS = 50
UNITS = {"time": "s", "distance": "m"}
FIRST_PART = 0.1  # share of the record, by time or distance, in which the static peak is looked for
# share of the friction of the second window from which on a record without a peak is taken to slide
SLIDES = 0.95
# share of the friction of the second half of a record below which the rig rests before it starts
RESTS = 0.05
# share of windows of negative friction from which on a channel is the wrong way round
BACKWARDS = 0.9
# Outliers: samples of the running median that they are far from, how far over most coefficients,
# and largest share.
WIDTH_OF_OUTLIERS, FAR, MOST_COEFFICIENTS, MOST_OUTLIERS = 9, 5.0, 0.9, 0.01
# samples of the running median that takes spikes off, and rest before the start
WIDTH_OF_SPIKES = 5
USUAL_STEPS = 0.9  # share of the steps from sample to sample that are no spikes'
# value of the attribute ``content`` of a file of such a course
CONTENT_OF_COURSE = "friction over time or distance"


@attrs.frozen
class StaticPeak:
    """The greatest friction coefficient at the start of sliding, or of the whole record."""

    coefficient: float  #: T/N of one sample [1]
    place: float  #: where: a time [s] or a distance [m]
    lifted: float  #: what noise adds to the greatest of as many samples, about [1]


@attrs.frozen(eq=False)
class Sliding:
    """Friction of a record that slides one way."""

    over: Over  #: what friction is given over
    place: Floats  #: (sample) The time [s] or the distance [m] since the start
    #: (sample) T/N, positive in the direction of sliding [1]; NaN where it is not known any more
    coefficient: Floats
    window_place: Floats  #: (window) The middle of each window [s or m]
    window_mean: Floats  #: (window) Mean of μ [1]
    window_deviation: Floats  #: (window) Standard deviation of μ [1]
    window_count: Integers  #: (window) Number of samples
    peak: StaticPeak | None  #: none where friction does not stand out at the start
    approach: Approach | None  #: none where friction does not run in towards a steady value
    no_approach: str = ""  #: why there is none
    #: the greatest coefficient anywhere, such as the peak of a direct shear test
    strength: StaticPeak | None = None
    #: lines of (label, text): what was done to the record before
    remarks: tuple[tuple[str, str], ...] = ()

    def __repr__(self) -> str:
        return f"<Sliding: {', '.join(f'{label} {text}' for label, text in self.summary())}>"

    def _repr_html_(self) -> str:
        return html_table(self.summary())

    def summary(self) -> list[tuple[str, str]]:
        """Return lines of (label, text): how far it slid, the mean, the peak, and the approach to the steady value."""
        means = self.window_mean
        length = float(np.ptp(self.place))
        scatter = (
            f" ± {means.std(ddof=1):.2g}: mean ± standard deviation of the windows"
            if means.size > 1
            else ""
        )
        windows = (
            f"{count_text(means.size, 'window', 'windows')} of {self._text(length / means.size)}"
        )
        peak = "none above the noise"
        if self.peak is not None:
            peak = f"{self.peak.coefficient:.4g} at {self._text(self.peak.place)}"
            peak += f"; of this, noise makes about {self.peak.lifted:.1g}"
        lines = [
            *self.remarks,
            ("slides", f"{self._text(length)}, in {windows}"),
            ("friction coefficient", f"{means.mean():.4g}{scatter}"),
            ("static peak", peak),
            *self._strength_text(),
        ]
        approach = self.approach
        if approach is None:
            return [*lines, ("steady value", f"no running-in of this form: {self.no_approach}")]
        beyond = (
            ""
            if approach.settled
            else ": beyond the record, which is shorter than two lengths of the approach"
        )
        steady = f"{approach.steady:.4g} (95 %: {approach.steady_low:.4g} to {approach.steady_high:.4g}){beyond}"
        start = (
            f"{approach.start:.4g} (95 %: {approach.start_low:.4g} to {approach.start_high:.4g})"
        )
        low = self._text(approach.length_low)
        high = self._text(approach.length_high)
        return [
            *lines,
            ("steady value", steady),
            ("start of running-in", f"{start} at {self._text(approach.origin)}"),
            (
                f"{self.over} of running-in",
                f"{self._text(approach.length)} (95 %: {low} to {high}), to 1/e",
            ),
        ]

    def _strength_text(self) -> list[tuple[str, str]]:
        """Return the peak strength, unless it is the static peak."""
        if self.strength is None or (
            self.peak is not None and self.peak.place == self.strength.place
        ):
            return []
        noise = (
            f"; of this, noise makes about {self.strength.lifted:.1g}"
            if self.strength.lifted > 0
            else ""
        )
        return [
            (
                "peak strength",
                f"T/N = {self.strength.coefficient:.4g} at {self._text(self.strength.place)}{noise}",
            )
        ]

    def to_dataset(self) -> "xr.Dataset":
        """Return the windows as a Dataset with the dimension window; ``[friction.course]`` reads its file.

        `from_dataset` returns all of it but the samples.
        """
        import xarray as xr

        attributes: dict[str, Any] = {
            "title": f"friction over {self.over}",
            "content": CONTENT_OF_COURSE,
            "record_start": float(self.place[0]),
            "record_end": float(self.place[-1]),
            "no_approach": self.no_approach,
            "remarks": "\n".join(f"{label}: {text}" for label, text in self.remarks),
        }
        for name, result in (
            ("peak", self.peak),
            ("approach", self.approach),
            ("strength", self.strength),
        ):
            if result is not None:
                attributes |= {
                    f"{name}_{key}": float(value) for key, value in attrs.asdict(result).items()
                }
        columns = {
            "coefficient": (self.window_mean, "friction coefficient"),
            "standard_deviation": (self.window_deviation, "standard deviation of a sample"),
            "count": (self.window_count, "samples"),
        }
        return xr.Dataset(
            {
                name: ("window", values, {"long_name": text, "units": "1"})
                for name, (values, text) in columns.items()
            },
            coords={
                self.over: (
                    "window",
                    self.window_place,
                    {"long_name": self.over, "units": UNITS[self.over]},
                )
            },
            attrs={name: value for name, value in attributes.items() if value != ""},
        )

    @classmethod
    def from_dataset(cls, table: "xr.Dataset") -> Self:
        """Restore the result of `to_dataset`, with the first and last position only of the samples.

        A Dataset of something else is an InputError.
        """
        over = next((over for over in get_args(Over) if over in table.coords), None)
        if table.attrs.get("content") != CONTENT_OF_COURSE or over is None:
            raise InputError(
                "this Dataset is no friction over time or distance; expected one of historysim sliding"
            )
        ends = [float(table.attrs[name]) for name in ("record_start", "record_end")]
        remarks = filter(None, str(table.attrs.get("remarks", "")).split("\n"))

        def restore(name: str, kind: type[Kind]) -> Kind | None:
            fields = {
                field.name: table.attrs.get(f"{name}_{field.name}") for field in attrs.fields(kind)
            }
            return None if None in fields.values() else kind(**fields)

        return cls(
            over=over,
            place=np.array(ends),
            coefficient=np.full(2, np.nan),
            window_place=table[over].values * unit_factor(over, table[over].attrs, UNITS[over]),
            window_mean=table["coefficient"].values,
            window_deviation=table["standard_deviation"].values,
            window_count=table["count"].values,
            peak=restore("peak", StaticPeak),
            approach=restore("approach", Approach),
            no_approach=str(table.attrs.get("no_approach", "")),
            strength=restore("strength", StaticPeak),
            remarks=tuple(
                (label, text) for label, _, text in (line.partition(": ") for line in remarks)
            ),
        )

    def _text(self, place: float) -> str:
        return duration_text(place) if self.over == "time" else quantity_text(place, "m")


def sliding_of_measurement(
    measurement: "Measurement", *, over: Over | None = None, windows: int = WINDOWS
) -> Sliding:
    """Return the friction of a measurement that slides one way; without displacement, over time alone."""
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
    return attrs.evolve(friction, remarks=(*measurement.remarks, *friction.remarks))


def sliding_of_history(
    history: "xr.Dataset", *, over: Over | None = None, windows: int = WINDOWS
) -> Sliding:
    """Return the friction of a simulated history that slides one way."""
    time, moved, load, normal = history_channels(history)
    return sliding_of_channels(time, load, normal, moved, over=over, windows=windows)


def sliding_of_channels(
    time: ArrayLike,
    tangential_load: ArrayLike,
    normal_load: ArrayLike,
    displacement: ArrayLike | None = None,
    *,
    over: Over | None = None,
    windows: int = WINDOWS,
    dead_band: float | None = None,
) -> Sliding:
    """Return the friction of a record that slides one way; samples at which N is not positive are left out."""
    load = channel("tangential_load", tangential_load)
    normal = channel("normal_load", normal_load, load.size)
    times = channel("time", time, load.size)
    check_order(times)
    count = scalar("windows", windows, least=1)
    if count % 1:
        raise InputError(f"windows is {count:g}; expected a whole number, 1 or more")
    moved = None if displacement is None else channel("displacement", displacement, load.size)
    rests = moved is not None and over == "time" and _rests(moved)
    sense = (
        (1.0 if load.mean() >= 0 else -1.0)
        if moved is None or rests
        else _find_direction(times, moved, dead_band)
    )
    along = _place(over, times, moved, sense)
    pressed = normal > 0
    if not pressed.any():
        raise InputError(
            "the normal load presses at no sample; expected more than 0 N: write scale = -1 where it does"
        )
    along = along[pressed]
    friction = sense * load[pressed] / normal[pressed]
    name: Over = over or ("time" if moved is None else "distance")
    friction, remarks = _interpolate_outliers(times[pressed], friction)
    if name == "time":
        begins = _begins(
            along, friction, None if rests or moved is None else moved[pressed], int(count)
        )
        if begins:
            duration = duration_text(float(along[begins] - along[0]))
            remarks.append(("left out", f"the first {duration}, in which the rig rests"))
        along = along[begins:]
        friction = friction[begins:]
    edges = np.linspace(along[0], along[-1], int(count) + 1)
    means = _windows(along, friction, edges)
    if moved is not None and not rests and np.mean(means[0] < 0) >= BACKWARDS:
        raise InputError(
            f"the friction coefficient is {means[0].mean():.3g}: friction would give energy instead of taking it; "
            "expected tangential displacement and tangential_load positive in one direction: reverse one of the two, "
            "with a scale of -1"
        )
    smooth, spikes = _smooth_spikes(friction)
    remarks += spikes
    # noise that is correlated from sample to sample is more than what one differs from the next by
    window = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, int(count) - 1)
    about_means = deviation_by_median(friction - means[0][window])
    noise = max(estimate_white_noise(friction), about_means)
    peak = _peak(along, smooth, edges, means[0], noise)
    top = int(smooth.argmax())
    lifted = noise * math.sqrt(2 * math.log(max(smooth.size, 2)))
    strength = StaticPeak(float(smooth[top]), float(along[top]), lifted)
    tried = select_approach(
        along, friction, edges, _starts(along, smooth, means[0]) if peak is None else [peak.place]
    )
    approach, reason = (None, tried) if isinstance(tried, str) else (tried, "")
    middle = (edges[1:] + edges[:-1]) / 2
    return Sliding(
        name, along, friction, middle, *means, peak, approach, reason, strength, tuple(remarks)
    )


def _interpolate_outliers(time: Floats, friction: Floats) -> tuple[Floats, list[tuple[str, str]]]:
    """Interpolate friction over outliers; return a remark as well."""
    outliers = _find_outliers(friction)
    if not outliers.any():
        return friction, []
    known = np.flatnonzero(~outliers)
    interpolated = np.interp(np.arange(friction.size), known, friction[known])
    return interpolated, [("outliers", _outlier_text(time, friction, outliers))]


def _smooth_spikes(friction: Floats) -> tuple[Floats, list[tuple[str, str]]]:
    """Smooth friction if it has spikes; return a remark as well."""
    spikes = count_of_spikes(friction, USUAL_STEPS)
    if spikes < FEWEST_SPIKES:
        return friction, []
    many = f"{count_text(spikes, 'sample', 'samples')} of {friction.size:,} stand out from both neighbours"
    text = f"{many}: static peak and start are those of a median of {WIDTH_OF_SPIKES} samples"
    return _running_median(friction, WIDTH_OF_SPIKES), [("spikes", text)]


def _find_outliers(friction: Floats) -> Booleans:
    """Return the few samples that are far from friction before and behind them, as a broken row is (sample)."""
    deviation = np.abs(friction - _running_median(friction, WIDTH_OF_OUTLIERS))
    usual = deviation_by_median(friction - np.median(friction))
    largest = float(np.quantile(np.abs(friction), MOST_COEFFICIENTS))
    limit = max(FAR * largest, SPIKE * usual, SPIKE * estimate_white_noise(friction))
    outliers: Booleans = deviation > limit
    return (
        outliers
        if outliers.sum() <= max(MOST_OUTLIERS * friction.size, 1)
        else np.zeros_like(outliers)
    )


def _outlier_text(time: Floats, friction: Floats, outliers: Booleans) -> str:
    """Return which samples are left out as outliers, the farthest with its time, and the median of the record."""
    middle = float(np.median(friction))
    farthest = int(np.argmax(np.where(outliers, np.abs(friction - middle), -1.0)))
    is_far = "is" if outliers.sum() == 1 else "are"
    return (
        f"{count_text(int(outliers.sum()), 'sample', 'samples')} of {friction.size:,} {is_far} far from the others, "
        f"whose median is {middle:.4g}: T/N = {friction[farthest]:.4g} at t = {duration_text(float(time[farthest]))}; "
        "left out here, mend the file"
    )


def _begins(along: Floats, friction: Floats, moved: Floats | None, windows: int) -> int:
    """Return the sample at which the rig starts, where it rests at first for a window or longer; else 0."""
    if moved is not None:
        # it starts where it has moved by more than noise
        rests = np.abs(moved - moved[0]) <= 2 * REVERSAL * estimated_noise(moved)
    else:
        # without a displacement, where the load has reached a share of what it is later
        smooth = _running_median(friction, WIDTH_OF_SPIKES)
        rests = np.abs(smooth) < RESTS * np.median(friction[friction.size // 2 :])
    start = int(rests.argmin())
    return start if along[start] - along[0] >= (along[-1] - along[0]) / windows else 0


def _running_median(values: Floats, samples: int) -> Floats:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, min(samples, values.size)))


def _rests(moved: Floats) -> bool:
    """Return True if a displacement is noise alone."""
    noise = estimated_noise(moved)
    return bool(np.ptp(moved) <= 2 * REVERSAL * noise) or bool(np.ptp(moved) == 0)


def _find_direction(time: Floats, moved: Floats, dead_band: float | None) -> float:
    """Return the direction of a displacement without reversals."""
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
        raise InputError(
            "the tangential displacement was not measured; expected it for friction over the distance"
        )
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
    is_last = np.append(np.diff(along) > 0, True)
    up_to = np.interp(edges, along[is_last], integral[is_last])
    lengths = np.diff(edges)
    mean = np.divide(
        np.diff(up_to), lengths, out=np.full(windows, friction.mean()), where=lengths > 0
    )
    number = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, windows - 1)
    count = np.bincount(number, minlength=windows)
    with np.errstate(invalid="ignore", divide="ignore"):
        window_means = np.bincount(number, friction, windows) / count
        square = np.bincount(number, (friction - window_means[number]) ** 2, windows)
        deviation = np.sqrt(square / (count - 1))
    return mean, np.where(count > 1, deviation, math.nan), count


def _peak(
    along: Floats, friction: Floats, edges: Floats, mean: Floats, noise: float
) -> StaticPeak | None:
    initial = along - along[0] <= FIRST_PART * (along[-1] - along[0])
    if not initial.any() or initial.all():
        return None
    index = int(np.argmax(np.where(initial, friction, -math.inf)))
    behind = edges[:-1] >= along[index]
    if not behind.any():
        return None
    lifted = noise * math.sqrt(2 * math.log(max(int(initial.sum()), 2)))
    # running-in falls by itself from window to window; a peak exceeds the extrapolation of the next
    # windows
    near = np.flatnonzero(behind)[:2]
    level = float(mean[near[0]] + max(mean[near[0]] - mean[near[-1]], 0.0))
    if friction[index] - level <= 2 * lifted:
        return None
    return StaticPeak(float(friction[index]), float(along[index]), lifted)


def _starts(along: Floats, friction: Floats, mean: Floats) -> list[float]:
    """Return where sliding may begin: near the friction of the second window, of the last half, and the greatest.

    Before it the contact bends, and so does a soft rig, for longer than a window.
    """
    levels = (
        mean[min(1, mean.size - 1)],
        float(np.median(mean[mean.size // 2 :])),
        float(mean.max()),
    )
    return sorted({float(along[int((friction >= SLIDES * level).argmax())]) for level in levels})
