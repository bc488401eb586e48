"""Time base of a file of numbers: the column of times, or the sampling rate that a header states."""

import re
from collections.abc import Iterable

import numpy as np

from historysim.basics.arguments import Floats
from historysim.basics.units import conversion_factor, is_unit
from historysim.errors import InputError

FEWEST_TIMES = 4  # smallest number of values that are judged
_UNEVEN = 1e-3  # largest deviation of even steps, over their median, in addition to the last digit
# largest fraction of steps at which the clock of a file with several runs starts again
_FALLS = 0.1

_SAMPLING = r"sampl\w*|abtast\w*|scan|acqui\w*|record\w*|logg?(?:ing)?|mess|[ée]chantillon\w*|采样|サンプリング|取样"
_GAP = r"[\W_]*(?:d['’]|de |of )?"
# Names of entries in full, or of parts of a name of which one is about sampling.
_INTERVAL = re.compile(
    rf"(?i)(?:{_SAMPLING}){_GAP}(?:time\W*)?(?:interval\w*|period\w*|time|zeit|step|dt|间隔|周期|間隔)"
    rf"|(?:interval\w*|p[ée]riode){_GAP}(?:{_SAMPLING})"
    r"|(?:time|zeit)?[\W_]*interval\w*|time[\W_]*(?:step|increment)|zeitschritt|pas de temps|wf_increment"
    r"|d_?t|delta[\W_]?[tx]|[δ∆Δ]t|t_?s|t_?sample|时间间隔|時間間隔"
)
_RATE = re.compile(
    rf"(?i)(?:{_SAMPLING}){_GAP}(?:rate|freq\w*|率|频率|周波数|レート)"
    rf"|(?:fr[ée]quence|frequency|rate){_GAP}(?:{_SAMPLING})|f_?s|f_?sample|s_?r|rate|abtastrate|abtastfrequenz"
)
# A label, its unit in brackets, and a number with or without a unit behind signs such as ":" or
# "=".
_ENTRY = re.compile(
    r"(?P<label>[^\W\d][^\[\](){}:=;,|\t\"\d]*?)\s*(?:[\[(](?P<unit>[^\])]+)[\])])?[\"\s]*(?:[:=;,|\t\"]|\s)+"
    r"(?P<number>[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)(?:[\"\s]*(?P<behind>[^\W\d_]+))?"
)


def is_time(times: Floats) -> bool:
    """Return True if values may be the times of samples, in one run or in several of which each starts again."""
    steps = np.diff(times)
    return times.size < 2 or bool(np.ptp(times) > 0 and (steps < 0).mean() <= _FALLS)


def is_even_time(values: Floats) -> bool:
    """Return True if values rise in even steps, within the rounding of their last digit."""
    if values.size < FEWEST_TIMES:
        return False
    steps = np.diff(values)
    step = float(np.median(steps))
    distinct = np.unique(steps)
    digit = float(np.diff(distinct).max(initial=0.0)) if distinct.size == 2 else 0.0
    return bool(
        steps.min() > 0 and np.abs(steps - step).max() <= _UNEVEN * step + min(digit, 0.5 * step)
    )


def header_rate(lines: Iterable[str]) -> tuple[float, str] | None:
    """Return the sampling rate [Hz] that an entry of a header states, and this entry; None without one."""
    for line in lines:
        for entry in _ENTRY.finditer(line.strip()):
            unit = entry["unit"] or (
                entry["behind"] if entry["behind"] and is_unit(entry["behind"]) else ""
            )
            if rate := entry_rate(entry["label"], float(entry["number"].replace(",", ".")), unit):
                return rate, entry[0].strip()
    return None


def entry_rate(label: str, value: float, unit: str) -> float | None:
    """Return the sampling rate [Hz] of an entry with a name such as ``Interval``, ``dt`` or ``fs``; None for others."""
    for pattern, si in ((_INTERVAL, "s"), (_RATE, "Hz")):
        if not pattern.fullmatch(label.strip(" ._")) or not value > 0:
            continue
        try:
            number = value * conversion_factor(unit or si, si)
        except InputError:
            continue
        return 1 / number if si == "s" else number
    return None
