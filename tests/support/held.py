"""Records with holds at reversals: loads of a contact that creeps over log time, as an instrument measures them."""

import attrs
import numpy as np

import historysim as hs
from historysim.loads.event_sequence import SampledLoads
from historysim.measured.reduction import Measurement

PAIR = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
STIFF = hs.Instrument(334e3)


def contact():
    heights = np.random.default_rng(3).normal(0.0, 60e-9, 40)
    return hs.Ensemble(PAIR, heights, 20e-6, 0.2)


def engine(time, normal, displacement):
    """Replay each sample as an event, behind the instrument."""
    job = hs.Replay(
        contact(), SampledLoads(time, normal, displacement), record="totals", instrument=STIFF
    )
    return job.dataset()["total_tangential_load"].to_numpy()


@attrs.frozen(kw_only=True)
class Holds:
    """A record: triangular moves of ±300 nm in 5 s, each followed by a hold at the reversal; SI throughout."""

    creep: float = 0.5e-9  #: of the contact in a decade of time [m]
    onset: float = 0.5
    length: float = 200.0
    count: int = 10
    rate: float = 10.0
    displacement_noise: float = 1e-9
    load_noise: float = 6e-6
    correlation: float = 0.0  #: of the noise of the load from sample to sample
    scatter: float = 0.0  #: of the creep from hold to hold, as a share
    sensor: float = 0.0  #: drift of the zero [N/s]
    fall: float = 0.0  #: by which share the normal load falls in each hold
    exponential: bool = False

    def record(self, seed):
        random = np.random.default_rng(seed)
        move, amplitude = 5.0, 300e-9
        period = move + self.length
        time = np.arange(0.0, self.count * period, 1 / self.rate)
        number, phase = np.divmod(time, period)
        start = np.where(number == 0, 0.0, amplitude * (-1.0) ** number * -1)
        end = amplitude * (-1.0) ** number
        way = np.minimum(phase / move, 1.0)
        since = np.maximum(phase - move, 0.0)
        displacement = start + (end - start) * way
        normal = 50e-3 * (1 - self.fall * since / self.length)
        rests = since > 0
        form = (
            1 - np.exp(-since / self.onset)
            if self.exponential
            else np.log1p(since / self.onset) / np.log(10)
        )
        each = self.creep * (1 + self.scatter * random.standard_normal(self.count))
        crept = (each * (-1.0) ** np.arange(self.count))[number.astype(int)] * form
        # the creep exists when the next move begins, and is taken up on its way
        last = np.array([0.0, *(crept[(number == n) & rests][-1] for n in range(self.count - 1))])
        crept += last[number.astype(int)] * (1 - way) * ~rests
        load = engine(time, normal, displacement - crept)
        white = random.standard_normal(time.size)
        noise = white.copy()
        if self.correlation:
            from scipy.signal import lfilter

            noise = lfilter([np.sqrt(1 - self.correlation**2)], [1, -self.correlation], white)
        load = load + self.sensor * time + self.load_noise * noise
        channels = {
            "normal_load": normal * (1 + 2e-4 * random.standard_normal(time.size)),
            "tangential_displacement": displacement
            + self.displacement_noise * random.standard_normal(time.size),
        }
        return Measurement(
            time, channels, {"tangential_load": load}, {"tangential_displacement": 20e-9}
        )
