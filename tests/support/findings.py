"""What is found in records, and advised: a row for each, with a faulty record and the effect of following the advice.

``python tests/support/findings.py`` counts false alarms in 1,000 clean records and writes the table
in ``historysim/measured/README.md``. Another finding is another row of `FINDINGS`.
"""

import functools
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import synthetic
from clean_records import BODIES, FRICTION, LOAD, PAIR, SLIPS, clean_record, loaded
from records import scenario_text

import historysim as hs
from historysim.basics.units import to_si
from historysim.errors import InputError
from historysim.measured import correction
from historysim.measured.branches import Trace, closed_period
from historysim.measured.comparison import Comparison
from historysim.measured.fitting import check_start, fit_parameters
from historysim.measured.loops import loops_of_measurement
from historysim.measured.observation import observe
from historysim.measured.reduction import Measurement, loop_dead_band, resample
from historysim.measured.response import compute_response
from historysim.measured.search import OFFSET
from historysim.scenario.loading_kinds.channels import ForceChannel, hum_remark

PAGE = Path(__file__).resolve().parents[2] / "historysim" / "measured" / "README.md"
HEADING = "### Findings and their remedies"
MANY, FEW = 1000, 6  # clean records: those of the page, and those of each run of the tests

SOUND = attrs.evolve(synthetic.measured("ball", 0, loads=(LOAD,), loops=8, rate=20), dead_band={})
FORCE, MOVED, TIME = SOUND["tangential_load"], SOUND["tangential_displacement"], SOUND.time
SINE = 200e-9 * np.sin(2 * np.pi * TIME / 32)


def changed(load=FORCE, moved=MOVED):
    """Give the sound record with other channels."""
    channels = {**SOUND.channels, "tangential_displacement": moved}
    return attrs.evolve(SOUND, channels=channels, response={"tangential_load": load})


def spiked():
    """Give the sound record with spikes of three per mille of the samples."""
    load = FORCE.copy()
    load[np.random.default_rng(0).choice(TIME.size, TIME.size * 3 // 1000, replace=False)] += 0.02
    return changed(load)


def corrected(record, correct):
    """Give a record with another load."""
    return attrs.evolve(record, response={"tangential_load": correct(record["tangential_load"])})


def centred(record, _):
    """Do what ``centred = true`` does."""
    return corrected(
        record,
        lambda load: load - correction.offset_of_cycles(load, dead_band=loop_dead_band(load)).value,
    )


def drift_free(record, _):
    """Do what ``drift_free = true`` does."""
    band = loop_dead_band(record["tangential_load"])
    drift = correction.drift_of_cycles(record.time, record["tangential_load"], dead_band=band).value
    return corrected(record, lambda load: load - drift * (record.time - record.time[0]))


def without_spikes(record, _):
    """Do what ``median = 5`` does."""
    return corrected(record, lambda load: correction.running_median(load, 5))


def without_play(record, note):
    """Do what ``free_play`` does."""
    width = to_si(re.search(r'free_play = "(.*?)"', note)[1], "m")
    closing = to_si((re.search(r'closing_load = "(.*?)"', note) or ["", "0 N"])[1], "N")
    moved, load = record["tangential_displacement"], record["tangential_load"]
    moved = correction.remove_free_play(moved, load, width, closing_load=closing)
    return attrs.evolve(record, channels={**record.channels, "tangential_displacement": moved})


def shifted(record, note):
    """Do what ``shift`` does."""
    shift = to_si(re.search(r'shift = "(.*?)"', note)[1], "s")
    found = corrected(record, lambda load: resample(record.time, load, record.time, shift=shift))
    known = np.isfinite(found["tangential_load"])
    groups = (
        {name: values[known] for name, values in group.items()}
        for group in (found.channels, found.response)
    )
    channels, response = groups
    return attrs.evolve(found, time=found.time[known], channels=channels, response=response)


def without_spring(record, note):
    """Do what ``parallel_stiffness`` does."""
    return record.without_spring(to_si(re.search(r'parallel_stiffness = "(.*?)"', note)[1], "N/m"))


def with_dead_band(record, note):
    """Do what a larger ``dead_band`` does."""
    band = to_si(re.search(r"six deviations, (.*?), or more", note)[1], "m")
    return attrs.evolve(record, dead_band={"tangential_displacement": band})


def close_to_noise():
    """Give the sound record with noise of a twentieth of its stroke."""
    return changed(moved=MOVED + np.random.default_rng(0).normal(0, np.ptp(MOVED) / 20, TIME.size))


def with_median(record, note):
    """Do what ``median`` at the displacement does."""
    window = int(re.search(r"median = (\d+) at the displacement", note)[1])
    return changed(moved=correction.running_median(record["tangential_displacement"], window))


def notched(record, note):
    """Do what ``notch`` does."""
    frequency = float(re.search(r"notch = ([\d.]+)", note)[1])
    return corrected(record, lambda load: correction.notch(record.time, load, frequency))


def hums_of(record):
    """Give the remark on hum in the load."""
    found = hum_remark(
        ForceChannel(column="T"), "tangential_load", record.time, record["tangential_load"], 0.0
    )
    return [] if found is None else [found]


def hummed():
    """Give the sound record with hum of the load at 3 Hz."""
    return changed(FORCE + 1e-3 * np.sin(2 * np.pi * 3 * TIME))


def noisy():
    """Give a record with noise of the displacement and a dead band that it passes."""
    moved = MOVED + np.random.default_rng(0).normal(0, 1e-9, TIME.size)
    return attrs.evolve(changed(moved=moved), dead_band={"tangential_displacement": 1e-9})


def slipping():
    """Give the sound record with drops of the load along sliding, and slow rises after them."""
    period = TIME % 0.5 / 0.5
    return changed(FORCE * np.where(np.abs(FORCE) > 9.7e-3, 0.8 + 0.2 * period, 1.0))


# -- a model compared with a record
# -------------------------------------------------------------------------


SERIES = hs.Instrument(synthetic.STIFFNESS)


def compared(case):
    """Compare a record with a ball behind an instrument."""
    record, instrument = case
    seen = observe(record)
    ball = hs.Ensemble(PAIR, 0.0, 2.5e-3, FRICTION)

    def respond(other):
        return compute_response(ball, other, seen)

    return Comparison(seen, respond(instrument), instrument, respond=respond)


def notes_of_comparison(case):
    """Give the notes on a record next to its model."""
    return compared(case).notes


def differences(case):
    """Give the difference of model and record, over the largest load."""
    left = compared(case).residuals
    return (left.rms / left.largest,)


def of_record(follow):
    """Follow advice on the record of a comparison."""
    return lambda case, note: (follow(case[0], note), case[1])


def sloping(case=None, _=""):
    """Give a record under a normal load that varies with the position, taken for constant; a case gets its column."""
    normal = LOAD * (1 + 0.08 * MOVED / np.abs(MOVED).max())
    varying = attrs.evolve(SOUND, channels={**SOUND.channels, "normal_load": normal})
    if case is not None:
        return attrs.evolve(case[0], channels=varying.channels), case[1]
    ball = hs.Ensemble(PAIR, 0.0, 2.5e-3, FRICTION)
    return changed(compute_response(ball, SERIES, observe(varying)).tangential_load), SERIES


def in_series(case, note):
    """Do what ``lateral_stiffness`` does."""
    stiffness = to_si(re.search(r'lateral_stiffness = "(.*?)"', note)[1], "N/m")
    return case[0], hs.Instrument(stiffness)


def coefficients(case, note=""):
    """Give the friction at both ends of a record that drifts from 95 to 105 % of it: the mean, or as a note has it."""
    found = re.search(r"from ([\d.]+) at the start to ([\d.]+) at the end", note)
    return tuple(map(float, found.groups())) if found else (case, FRICTION)


def drifting():
    """Give the sound record with friction that rises by 10 %."""
    return changed(FORCE * (0.95 + 0.1 * TIME / TIME[-1]))


def drift_errors(case):
    """Give the largest error of the friction coefficient at the ends of that record."""
    ends = case if isinstance(case, tuple) else (FRICTION, FRICTION)
    return (max(abs(ends[0] / (0.95 * FRICTION) - 1), abs(ends[1] / (1.05 * FRICTION) - 1)),)


# -- a fit
# ---------------------------------------------------------------------------------------------------


def mid_stroke(amplitude=0.6):
    """Give a record that begins in mid-stroke, by default in partial slip; its first sample is taken for its zero."""
    moved = amplitude * SLIPS["sphere"] * np.sin(2 * np.pi * (np.arange(241) / 60 + 0.13))
    load = (
        BODIES["sphere"]
        .advance_many(loaded("sphere"), tangential_displacement=moved)[1]
        .tangential_load
    )
    load = load + np.random.default_rng(0).normal(0, 1e-5, load.size)
    channels = {
        "normal_load": np.full(moved.size, LOAD),
        "tangential_displacement": moved - moved[0],
    }
    return Measurement(np.arange(241) / 60, channels, {"tangential_load": load}), ("friction",)


def notes_on_start(case):
    """Give the note of a fit on the start of a record."""
    return check_start(observe(case[0]))


def fit_error(case, skip=0):
    """Give the error of the fitted friction."""
    record, names = case
    start = {"friction": 1.3 * FRICTION, OFFSET: 0.0}

    def ball(values):
        return hs.Ensemble(PAIR, 0.0, 2.5e-3, values["friction"]), hs.Instrument()

    seen = attrs.evolve(observe(record, skip=skip), starts_displaced=OFFSET in names)
    found = fit_parameters(ball, {name: start[name] for name in names}, seen)
    return (abs(found.values["friction"] / FRICTION - 1),)


# -- files
# ---------------------------------------------------------------------------------------------------


@attrs.frozen
class File:
    """A file of a record, and how a scenario reads it."""

    columns: dict[str, Iterable[Any]]
    entries: dict[str, str | None] = attrs.Factory(dict)
    loading: str = ""

    @classmethod
    def of(cls, record, **others):
        """Give the file of a record."""
        columns = {
            "t": record.time,
            "N": record["normal_load"],
            "u": record["tangential_displacement"],
        }
        return cls({**columns, "T": record["tangential_load"], **others})

    def read(self):
        """Give the record that is read."""
        entries = {"tangential_displacement": '"u"', **self.entries}
        text = scenario_text(entries, {"tangential_load": '"T"'}, loading=self.loading)
        rows = zip(*(map(str, values) for values in self.columns.values()), strict=True)
        lines = [",".join(self.columns), *map(",".join, rows), ""]
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "m.csv").write_text("\n".join(lines), encoding="utf-8")
            (Path(folder) / "s.toml").write_text(text, encoding="utf-8")
            return hs.load(Path(folder) / "s.toml").measurement()

    def with_entry(self, name, entry):
        """Give it with another entry of ``[loading.columns]``."""
        return attrs.evolve(self, entries={**self.entries, name: entry})


def notes_of_file(file):
    """Give the remarks on a file, or why it is refused."""
    try:
        return [text for label, text in file.read().remarks if label in {"file", "hum"}]
    except InputError as error:
        return [str(error)]


def errors_of_file(file):
    """Give the error of the channels that are read."""
    try:
        return (distance(file.read()),)
    except InputError:
        return (np.nan,)


def loop_errors_of_file(file):
    """Give the error of the energy of the loops that are read."""
    energy = loops_of_measurement(file.read()).statistics("dissipated_energy").mean
    return (abs(energy / ENERGY - 1),)


def stored_cycles():
    """Give a fretting log: three periods that were stored by themselves, from mid-stroke on, the last two with wear."""
    start, count = TIME.size // 2 + 40, 640
    part = slice(start, start + count)
    loads = [scale * FORCE[part] for scale in (1.0, 1.5, 2.0)]
    columns = {
        "Cycle": np.repeat([1, 10, 100], count),
        "N": np.full(3 * count, LOAD),
        "u": np.tile(MOVED[part], 3),
    }
    return File({**columns, "T": np.concatenate(loads)}, {"time": None})


def broken():
    """Give a file with a cell that is no number."""
    file = File.of(SOUND)
    cells = list(map(str, FORCE.tolist()))
    cells[1000] = "1..5"
    return attrs.evolve(file, columns={**file.columns, "T": cells})


def mended(file, _):
    """Mend the cell in the file."""
    return attrs.evolve(file, columns={**file.columns, "T": FORCE})


def with_rate(file, note):
    """Do what ``rate`` does."""
    return attrs.evolve(file.with_entry("time", None), loading=re.search(r'rate = ".*?"', note)[0])


@attrs.frozen(eq=False)
class Finding:
    """A note, when it is given, and what its remedy does."""

    finding: str
    words: str  #: a regular expression that its note matches
    test: str
    precondition: str
    remedy: str
    fault: Callable[[], Any]  #: a record that has it
    follow: Callable[[Any, str], Any] | None = None  #: that record after the advice in a note
    withheld: str = ""  #: what is done where there is no record to mend
    notes: Callable[[Any], Iterable[str]] = lambda record: notes_of(record)  # noqa: PLW0108 - defined below
    names: tuple[str, ...] = ("energy", "μ", "channels")
    errors: Callable[[Any], tuple[float, ...]] = lambda record: errors_of(record)  # noqa: PLW0108 - defined below
    #: the record as it would be without the finding
    unadvised: Callable[[Any], Any] = lambda case: case
    repeats: bool = (
        False  #: whether the note is on the record, and stays true once the model allows for it
    )


FINDINGS = (
    Finding(
        "spring in parallel",
        "a spring in parallel with the contact",
        "last two quarters of the branches have one slope, alike forward and backward",
        "slope known within 20 %; the branch begins four times steeper",
        "`parallel_stiffness` in `[instrument]`",
        lambda: changed(FORCE + 4e4 * MOVED),
        without_spring,
    ),
    Finding(
        "stop",
        "the load rises again at the ends of the stroke",
        "the load at the end is a tenth or more above the level part before it, and above the line through it by three "
        "standard errors",
        "a part of three bins of 20 or 40 that rises by less than 3 %; two branches",
        "shorter strokes",
        lambda: changed(FORCE + 4e5 * (MOVED - np.clip(MOVED, -150e-9, 150e-9))),
        lambda *_: SOUND,
    ),
    Finding(
        "ellipse",
        "no branch is level, as those of a spring with a damper",
        "half the height follows √(1 − x²) within 4 %, the middle a line within 5 %",
        "load higher forward than backward, energy above 0",
        "none in the program",
        lambda: changed(
            2e4 * SINE + 6e-3 * np.cos(2 * np.pi * TIME / 32) + 1e-6 * FORCE, SINE + 1e-9 * FORCE
        ),
        None,
        "no coefficient",
    ),
    Finding(
        "offset of the load",
        "the tangential load has an offset",
        "mean of both directions beyond 2 % of friction and its interval of 95 %",
        "branches surely level at their ends",
        "`centred`",
        lambda: changed(FORCE + 1e-3),
        centred,
    ),
    Finding(
        "drift of the zero",
        "the zero of the tangential load drifts",
        "means of both directions lie on a line beyond their scatter",
        "branches surely level at their ends",
        "`drift_free`",
        lambda: changed(FORCE + 1e-3 * TIME / TIME[-1]),
        drift_free,
    ),
    Finding(
        "free play",
        "the displacement continues by",
        "displacement at zero load beyond three times the elastic part, 3 % of the stroke and ten deviations of noise",
        "branches surely level at their ends",
        "`free_play` with `closing_load`",
        lambda: changed(moved=MOVED + 20e-9 * np.clip(FORCE / 5e-4, -1, 1)),
        without_play,
    ),
    Finding(
        "lag, or play of the drive",
        "the load stays for",
        "likewise behind a reversal",
        "branches surely level at their ends",
        "`shift`",
        lambda: changed(np.roll(FORCE, 12)),
        shifted,
    ),
    Finding(
        "clipped load",
        "it looks clipped",
        "five samples or more in a row, and 5 ‰ of all, are the very extreme",
        "between both extremes each sample has independent white noise, of a digit or more",
        "a wider range",
        lambda: changed(np.clip(FORCE, -9e-3, 9e-3)),
        lambda *_: SOUND,
    ),
    Finding(
        "spikes",
        "they look like spikes",
        "samples stand out from both neighbours by ten deviations of noise and three usual steps",
        "three or more",
        "`median`",
        spiked,
        without_spikes,
    ),
    Finding(
        "|F|",
        "the force is never negative",
        "no sample below 0, some within 20 % of it",
        "loops that give energy, or no higher forward than backward",
        "the signed column",
        lambda: changed(np.abs(FORCE)),
        lambda *_: SOUND,
    ),
    Finding(
        "counter that wraps",
        "jumps by 65,536",
        "all large steps are 2^16, 2^24 or 2^32 last digits, within one usual step",
        "usual steps below 1/16 of that",
        "unwrap before reading",
        lambda: changed((np.round(FORCE / 4e-7) % 65536) * 4e-7),
        lambda *_: SOUND,
    ),
    Finding(
        "stick-slip",
        "it looks like stick-slip",
        "the load falls by a tenth of friction or more from sample to sample, twice a branch, and three times as often "
        "as it rises",
        "falls beyond ten deviations of noise",
        "none in the program",
        slipping,
        None,
        "friction is the mean over it",
    ),
    Finding(
        "dead band below noise",
        "noise may be taken for reversals",
        "dead band below six deviations of the noise of the displacement",
        "noise of the displacement is known",
        "`dead_band`",
        noisy,
        with_dead_band,
    ),
    Finding(
        "stroke close to noise",
        "reversal points are unreliable",
        "the stroke is below 40 deviations of the noise of the displacement",
        "dead band above six of them",
        "`median`, or longer strokes",
        close_to_noise,
        with_median,
    ),
    Finding(
        "closed period",
        "the record is one closed period",
        "no whole loop, and both ends meet: their gap of the load is below a quarter of the mean height of the loop",
        "that height is clear of noise",
        "done: it starts at its maximum",
        lambda: clean_record(1).cycle(600),
        None,
        "one loop, not refused",
    ),
    Finding(
        "friction drifts",
        "the friction coefficient drifts",
        "coefficients of the loops lie on a line beyond their scatter (99 %)",
        "six loops or more at one load; rise above 1 ‰",
        "`[friction.course]`, for `run`",
        drifting,
        coefficients,
        names=("μ at the ends",),
        errors=drift_errors,
        repeats=True,
    ),
    Finding(
        "lag (`compare`, `fit`)",
        "the load is behind the displacement by",
        "score test: of the misfit alike in all loops it explains 60 %, and 5 % more than other parameters",
        "four branches or more at one load; size clear of 0 (99.9 %), 1 % of the load",
        "`shift`",
        lambda: (changed(np.roll(FORCE, 6)), SERIES),
        of_record(shifted),
        notes=notes_of_comparison,
        names=("difference",),
        errors=differences,
    ),
    Finding(
        "free play (`compare`, `fit`)",
        "the displacement continues by .* try free_play",
        "the same",
        "the same",
        "`free_play`",
        lambda: (changed(moved=MOVED + 5e-9 * np.sign(FORCE)), SERIES),
        of_record(without_play),
        notes=notes_of_comparison,
        names=("difference",),
        errors=differences,
    ),
    Finding(
        "spring in parallel (`compare`, `fit`)",
        "the load rises along each stroke by",
        "the same",
        "the same",
        "`parallel_stiffness`",
        lambda: (changed(FORCE + 2e3 * MOVED), SERIES),
        of_record(without_spring),
        notes=notes_of_comparison,
        names=("difference",),
        errors=differences,
    ),
    Finding(
        "normal load along the stroke (`compare`, `fit`)",
        "friction varies with the position",
        "the same",
        "the same",
        "a column as `normal_load`",
        sloping,
        sloping,
        notes=notes_of_comparison,
        names=("difference",),
        errors=differences,
    ),
    Finding(
        "compliance in series (`compare`, `fit`)",
        "the record is softer at reversals than the model",
        "stiffness at reversals below half of the model's by three standard errors",
        "both have loops of friction",
        "`lateral_stiffness`",
        lambda: (SOUND, hs.Instrument()),
        in_series,
        notes=notes_of_comparison,
        names=("difference",),
        errors=differences,
    ),
    Finding(
        "start in mid-stroke (`fit`)",
        "the record does not begin at rest",
        "the first load is a tenth of half the height of the loops or more from zero and their middle",
        "five deviations of noise; no loop skipped with a centred displacement",
        '`displacement_offset` in `[fit]`; where it slides `past = "unknown"`',
        mid_stroke,
        lambda case, _: (case[0], ("friction", OFFSET)),
        notes=notes_on_start,
        names=("μ",),
        errors=fit_error,
        repeats=True,
    ),
    Finding(
        "hum (reading)",
        "notch = ",
        "a line in the spectrum between turns, beyond noise but for 10⁻⁴",
        "even clock; a tenth of the power between turns",
        "`notch`",
        hummed,
        notched,
        notes=hums_of,
    ),
    Finding(
        "zero of the stage (reading)",
        "its first sample, .*, is its zero",
        "the first reading of a displacement is beyond six deviations of noise",
        "neither `offset` nor `centred`",
        "done; `offset = 0` takes the readings",
        lambda: File.of(SOUND, u=MOVED + 5e-6),
        lambda file, _: file,
        notes=notes_of_file,
        names=("channels",),
        errors=errors_of_file,
        repeats=True,
        unadvised=lambda file: file.with_entry(
            "tangential_displacement", '{ column = "u", offset = 0 }'
        ),
    ),
    Finding(
        "repeated times (reading)",
        "have the time of the sample before",
        "successive times are equal",
        "none",
        "`rate`",
        lambda: File.of(SOUND, t=np.floor(TIME / 2) * 2),
        with_rate,
        notes=notes_of_file,
        names=("channels",),
        errors=errors_of_file,
    ),
    Finding(
        "runs joined (reading)",
        "these runs are joined",
        "a column by the name of a run or cycle counts up in blocks",
        "no `runs_by`",
        '`runs_by` with `run = "each"`',
        stored_cycles,
        lambda file, _: attrs.evolve(file, loading='runs_by = "Cycle"\nrun = 1'),
        notes=notes_of_file,
        names=("energy of the first",),
        errors=loop_errors_of_file,
    ),
    Finding(
        "broken cell (reading)",
        "expected a finite number; correct it in the file",
        "a cell of a column that is read is no number",
        "none",
        "mend it; dropping rows comes second, with their number",
        broken,
        mended,
        notes=notes_of_file,
        names=("channels",),
        errors=errors_of_file,
    ),
)


def notes_of(record):
    """Give the notes on a record, or why it is refused."""
    try:
        return loops_of_measurement(record).notes
    except InputError as error:
        return (str(error),)


def note_of(finding, record):
    """Give the note of a finding on a record; None where there is none."""
    return next((note for note in finding.notes(record) if re.search(finding.words, note)), None)


def false_alarms(seeds):
    """Count the findings in clean records, and name what was found in addition."""
    counts: Counter[str] = Counter()
    for seed in seeds:
        record = clean_record(seed)
        counts["closed period"] += is_closed(record.cycle(0))
        for note in all_notes(record):
            of = next((each.finding for each in FINDINGS if re.search(each.words, note)), None)
            if of is None and not is_true(note, record):
                of = f"{seed}: {note}"
            counts[of] += of is not None
    return +counts


def all_notes(record):
    """Give all notes on a clean record: on reading it from a file, on its loops, and next to its own model."""
    seen = observe(record.measurement)
    comparison_notes = Comparison(
        seen, compute_response(record.ensemble, hs.Instrument(), seen)
    ).notes
    return {
        *notes_of(record.measurement),
        *notes_of_file(File.of(record.measurement)),
        *comparison_notes,
        *check_start(seen),
    }


def is_closed(cycle):
    """Say whether a cycle is taken for a closed period."""
    names = "tangential_displacement", "tangential_load", "normal_load"
    trace = Trace.from_channels(cycle.time, *(cycle[name] for name in names))
    return closed_period(trace, loop_dead_band(trace.displacement)) is not None


def closed_periods(seeds, *, after):
    """Count the records whose first cycle, or a later one from any place on, is taken for a closed period."""
    count = 0
    for seed in seeds:
        record = clean_record(seed)
        first = record.per_cycle + 7 * seed % record.per_cycle if after else 0
        count += is_closed(record.cycle(first))
    return count


def is_true(note, record):
    """Say whether a note is right of a clean record: it sticks, or has few samples on steep branches."""
    sticks = re.search(r"do not reach sliding|longer strokes slide", note)
    return bool(sticks and not record.slides) or "without a stiffness at reversal" in note


def errors_of(record):
    """Give the relative errors of energy, friction and channels of a record that would be the sound one."""
    try:
        found = loops_of_measurement(record)
    except InputError:
        return np.nan, np.nan, distance(record)
    energy = found.statistics("dissipated_energy").mean / ENERGY - 1
    return (
        abs(energy),
        abs(found.statistics("friction_coefficient").mean / FRICTION - 1),
        distance(record),
    )


def distance(record):
    """Give how far both channels are from those of the sound record, over friction and stroke."""
    sizes = {"tangential_load": LOAD * FRICTION, "tangential_displacement": np.ptp(MOVED)}
    off = [
        np.mean((record[name] - np.interp(record.time, TIME, SOUND[name])) ** 2) / size**2
        for name, size in sizes.items()
    ]
    return float(np.sqrt(np.sum(off)))


ENERGY = loops_of_measurement(SOUND).statistics("dissipated_energy").mean


@functools.cache
def effect(finding):
    """Give the errors before and after the advice; None where there is none."""
    record = finding.fault()
    note = note_of(finding, record)
    assert note is not None, finding.notes(record)
    if finding.follow is None:
        return None
    return finding.errors(finding.unadvised(record)), finding.errors(finding.follow(record, note))


def effect_text(finding):
    """Give the effect of the advice in a cell."""
    errors = effect(finding)
    if errors is None:
        return finding.withheld
    texts = ["none" if np.isnan(size) else f"{100 * size:.1f} %" for size in np.ravel(errors)]
    count = len(finding.names)
    return ", ".join(
        f"{name} {texts[i]} → {texts[i + count]}" for i, name in enumerate(finding.names)
    )


def table(counts):
    """Give the table of the page."""
    head = (
        "finding",
        "test",
        "precondition",
        "remedy",
        "false alarms",
        "error, before → after the advice",
    )
    rows = [head, ("---",) * len(head)]
    for each in FINDINGS:
        cells = (
            each.finding,
            each.test,
            each.precondition,
            each.remedy,
            str(counts[each.finding]),
            effect_text(each),
        )
        rows.append(tuple(cell.replace("|", "\\|") for cell in cells))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def section():
    """Give the table as printed on the page."""
    return re.search(rf"{HEADING}\n.*?\n(\| finding.*?)\n\n", PAGE.read_text("utf-8"), re.DOTALL)[1]


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    found = false_alarms(range(MANY))
    sys.stdout.write(f"{found}\n")
    PAGE.write_text(PAGE.read_text("utf-8").replace(section(), table(found)), "utf-8")
