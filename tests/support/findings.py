"""What `loops` finds in a record and advises: a row for each, with a faulty record and what following the advice does.

``python tests/support/findings.py`` counts false alarms in 1,000 clean records and writes the table in
``historysim/measured/README.md``. Another finding is another row of `FINDINGS`.
"""

import re
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import synthetic
from clean_records import FRICTION, LOAD, clean_record

from historysim.basics.units import in_si
from historysim.errors import InputError
from historysim.measured import correction
from historysim.measured.branches import Trace, closed_period
from historysim.measured.loops import loops_of_measurement
from historysim.measured.reduction import Measurement, loop_dead_band, resample

PAGE = Path(__file__).resolve().parents[2] / "historysim" / "measured" / "README.md"
HEADING = "### Findings and their remedies"
MANY, FEW = 1000, 48  # clean records: those of the page, and those of each run of the tests

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
        record, lambda load: load - correction.offset_of_cycles(load, dead_band=loop_dead_band(load)).value
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
    width = in_si(re.search(r'free_play = "(.*?)"', note)[1], "m")
    closing = in_si(re.search(r'closing_load = "(.*?)"', note)[1], "N")
    moved, load = record["tangential_displacement"], record["tangential_load"]
    moved = correction.remove_free_play(moved, load, width, closing_load=closing)
    return attrs.evolve(record, channels={**record.channels, "tangential_displacement": moved})


def shifted(record, note):
    """Do what ``shift`` does."""
    shift = in_si(re.search(r'shift = "(.*?)"', note)[1], "s")
    found = corrected(record, lambda load: resample(record.time, load, record.time, shift=shift))
    known = np.isfinite(found["tangential_load"])
    groups = ({name: values[known] for name, values in group.items()} for group in (found.channels, found.response))
    channels, response = groups
    return attrs.evolve(found, time=found.time[known], channels=channels, response=response)


def without_spring(record, note):
    """Do what ``parallel_stiffness`` does."""
    return record.without_spring(in_si(re.search(r'parallel_stiffness = "(.*?)"', note)[1], "N/m"))


@attrs.frozen
class Finding:
    """A note, when it is given, and what its remedy does."""

    finding: str
    words: str  #: a regular expression that its note matches
    test: str
    precondition: str
    remedy: str
    fault: Callable[[], Measurement]  #: a record that has it
    follow: Callable[[Measurement, str], Measurement] | None = None  #: that record after the advice in a note
    withheld: str = ""  #: what is done where there is no record to mend


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
        "ellipse",
        "no branch is level, as those of a spring with a damper",
        "half the height follows √(1 − x²) within 4 %, the middle a line within 5 %",
        "load higher forward than backward, energy above 0",
        "none in the program",
        lambda: changed(2e4 * SINE + 6e-3 * np.cos(2 * np.pi * TIME / 32) + 1e-6 * FORCE, SINE + 1e-9 * FORCE),
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
        "the displacement goes on by",
        "displacement at zero load beyond three times that beside it, 3 % of the stroke and ten deviations of noise",
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
        "between both extremes each sample has white noise of its own, of a digit or more",
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
)


def notes_of(record):
    """Give the notes on a record, or why it is refused."""
    try:
        return loops_of_measurement(record).notes
    except InputError as error:
        return (str(error),)


def note_of(finding, record):
    """Give the note of a finding on a record; None where there is none."""
    return next((note for note in notes_of(record) if re.search(finding.words, note)), None)


def false_alarms(seeds):
    """Count the findings in clean records, and name what was found beside them."""
    counts: Counter[str] = Counter()
    for seed in seeds:
        record = clean_record(seed)
        for note in notes_of(record.measurement):
            of = next((each.finding for each in FINDINGS if re.search(each.words, note)), None)
            if of is None and not is_true(note, record):
                of = f"{seed}: {note}"
            counts[of] += of is not None
    return +counts


def closed_periods(seeds, *, after):
    """Count the records whose first cycle, or a later one from any place on, is taken for a closed period."""
    count = 0
    for seed in seeds:
        record = clean_record(seed)
        first = record.per_cycle + 7 * seed % record.per_cycle if after else 0
        cycle = record.cycle(first)
        names = "tangential_displacement", "tangential_load", "normal_load"
        trace = Trace.of(cycle.time, *(cycle[name] for name in names))
        count += closed_period(trace, loop_dead_band(trace.displacement)) is not None
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
    return abs(energy), abs(found.statistics("friction_coefficient").mean / FRICTION - 1), distance(record)


def distance(record):
    """Give how far both channels are from those of the sound record, over friction and stroke."""
    sizes = {"tangential_load": LOAD * FRICTION, "tangential_displacement": np.ptp(MOVED)}
    off = [
        np.mean((record[name] - np.interp(record.time, TIME, SOUND[name])) ** 2) / size**2
        for name, size in sizes.items()
    ]
    return float(np.sqrt(np.sum(off)))


ENERGY = loops_of_measurement(SOUND).statistics("dissipated_energy").mean


def effect(finding):
    """Give the errors of energy, friction and channels before and after the advice; None where there is none."""
    record = finding.fault()
    note = note_of(finding, record)
    assert note is not None, notes_of(record)
    if finding.follow is None:
        return None
    return errors_of(record), errors_of(finding.follow(record, note))


def effect_text(finding):
    """Give the effect of the advice in a cell."""
    errors = effect(finding)
    if errors is None:
        return finding.withheld
    texts = ["none" if np.isnan(size) else f"{100 * size:.1f} %" for size in np.ravel(errors)]
    names = "energy", "μ", "channels"
    return ", ".join(f"{name} {texts[i]} → {texts[i + 3]}" for i, name in enumerate(names))


def table(counts):
    """Give the table of the page."""
    head = ("finding", "test", "precondition", "remedy", "false alarms", "error, before → after the advice")
    rows = [head, ("---",) * len(head)]
    for each in FINDINGS:
        cells = (each.finding, each.test, each.precondition, each.remedy, str(counts[each.finding]), effect_text(each))
        rows.append(tuple(cell.replace("|", "\\|") for cell in cells))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def section():
    """Give the table as it stands on the page."""
    return re.search(rf"{HEADING}\n.*?\n(\| finding.*?)\n\n", PAGE.read_text("utf-8"), re.DOTALL)[1]


if __name__ == "__main__":
    found = false_alarms(range(MANY))
    sys.stdout.write(f"{found}\n")
    PAGE.write_text(PAGE.read_text("utf-8").replace(section(), table(found)), "utf-8")
