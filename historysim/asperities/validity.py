"""Whether the model may be used for a contact: its assumptions, checked where the load is greatest.

The asperities are paraboloids (a small beside R), elastic, without adhesion, and independent of each other.
"""

import math
from collections.abc import Iterator

import attrs
import numpy as np

from historysim.asperities.curves import NormalCurves
from historysim.asperities.ensemble import Ensemble
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.yielding import HARDNESS_OF_YIELD
from historysim.basics.array_types import Booleans, Floats, Integers
from historysim.basics.findings import Finding
from historysim.basics.units import quantity_text
from historysim.basics.wording import counted
from historysim.contact import hertz
from historysim.surfaces.summits import detached_summits

STEEPEST = 0.3
"""a/R up to which the paraboloid stands for the sphere, and Hertz' theory for small strains."""
MOST_LOAD = 0.1
"""Share of the normal load that may stand on asperities beyond a limit, and that adhesion may add to it."""
MOST_OVERLAP = 0.2
"""Share of the normal load that may stand on asperities with contact circles that overlap."""
MOST_AREA = 0.05
"""Contact area over nominal area up to which asperities are taken to be independent."""
MOST_ON_OUTLIERS = 0.5
"""Share of the normal load that a handful of outliers may carry."""
MOST_PAIRED = 500
"""Circles of which all pairs are looked at, which takes less time than to import a search for neighbours."""
MOST_YIELDED_AREA = 0.5
"""Contact area over nominal area up to which summits that yield do so alone: beyond it the pressure rises above the
hardness, since what is pressed down has nowhere to go (Pullen and Williamson 1972)."""
STRAIN = 0.2
"""Representative strain of an indentation over a/R (Tabor 1951)."""
STRAIN_OF_VICKERS, STRAIN_RANGE = 0.08, 2.0
"""That of a Vickers indentation, by which hardness is measured, and the factor either side within which it is taken."""
MOST_BEFORE_ROWS = 0.2
"""Approach of the first row of a normal curve, over that of the last."""
MOST_ERROR = 0.01
"""What a normal curve may be off by, over its largest load."""
ONSET_OF_HARDNESS, ONSET_OF_YIELD = 0.4, 1.07
"""Mean pressure at which a sphere begins to flow, over the hardness (Greenwood and Williamson 1966: peak pressure
0.6 H) and over the yield stress (Johnson 1985, section 6.1: peak pressure 1.6 Y for ν = 0.3)."""


@attrs.frozen
class _Touching:
    """The asperities that touch: radii R, approaches δ, contact radii a [m], and normal loads N [N].

    Where they have yielded R and δ are those of the summit that is left, and the radius before is ``virgin_radius``.
    """

    index: Integers
    summit_radius: Floats
    approach: Floats
    contact_radius: Floats
    normal_load: Floats
    virgin_radius: Floats
    yielded: Booleans

    @property
    def area(self) -> float:
        return float(np.pi * (self.contact_radius**2).sum())

    def share(self, which: Booleans) -> float:
        """Return the share of the normal load that stands on some of them."""
        return float(self.normal_load[which].sum() / self.normal_load.sum())


def findings(ensemble: Ensemble, approach: float, instrument: Instrument = RIGID) -> tuple[Finding, ...]:
    """Return which assumptions of the model do not hold at an approach, with what can be done.

    The page of this room lists all of them. What is not known of an ensemble (hardness, yield stress and surface
    energies of its materials, positions, nominal area) is not checked; patches of normal curves have `first_row` and
    `normal_curve` alone.

    Parameters
    ----------
    ensemble : Ensemble
    approach : float
        Approach of the highest summit from first touch [m]; take the greatest of a history.
    instrument : Instrument, optional
        With a resolution of the displacement, which the preliminary displacement is compared with.

    Returns
    -------
    tuple of Finding
        Those that do not hold; none where nothing touches.
    """
    # patches with normal curves may press on one another, and are no spheres
    if ensemble.curves is not None:
        return tuple(_curve(ensemble.curves))
    touching = _touching(ensemble, approach)
    return () if touching is None else tuple(_found(ensemble, touching, instrument))


def _touching(ensemble: Ensemble, approach: float) -> _Touching | None:
    depth = ensemble.summit_height - (ensemble.highest_summit - approach)
    index = np.flatnonzero(depth > 0)
    virgin = ensemble.summit_radius[index]
    radius, depth, yielded = virgin, depth[index], np.zeros(index.size, dtype=bool)
    if ensemble.yielding is not None and index.size:
        state = ensemble.advance(ensemble.initial_state(), normal_displacement=approach)
        if (left := state.yielded) is not None:
            radius, yielded = left.summit_radius[index], left.yielding_load[index] > 0
            depth = np.where(yielded, depth - left.yielded_depth[index], depth)
    load = hertz.normal_load(depth, summit_radius=radius, contact_modulus=ensemble.pair.contact_modulus)
    # an approach that is next to nothing underflows
    if not load.sum() > 0:
        return None
    return _Touching(index, radius, depth, hertz.contact_radius(depth, summit_radius=radius), load, virgin, yielded)


def _found(ensemble: Ensemble, touching: _Touching, instrument: Instrument) -> Iterator[Finding]:
    yield from _outliers(ensemble, touching)
    yield from _steep(touching)
    if ensemble.yielding is None:
        yield from _yielding(ensemble, touching)
    yield from _area(ensemble, touching)
    yield from _overlapping(ensemble, touching)
    if ensemble.yielding is not None:
        yield from _hardening(touching)
    yield from _cracking(ensemble, touching)
    yield from _adhering(ensemble, touching)
    yield from _unresolved(ensemble, touching, instrument)
    yield from _rising(ensemble, touching)


def _curve(curves: NormalCurves) -> Iterator[Finding]:
    if not (curves.guessed_before_rows or curves.noise is not None):
        # of solutions the first row is that of the first touch, and rows are close
        return
    first = float(curves.approach[0] / curves.approach[-1])
    text = (
        f"the lightest load of the normal curve stands at {_percent(first)} of its range of approach: what is "
        "carried below it, and by every slip front there, is a guess (a power of the approach); measure lighter "
        "loads"
    )
    yield from _over("first_row", first, MOST_BEFORE_ROWS, text)
    error = curves.error()
    why = "between its rows" if curves.noise is None else "under its noise"
    text = (
        f"the normal curve may be off by {_percent(error)} of its largest load {why}, and so may all loads: "
        "measure more rows"
    )
    yield from _over("normal_curve", error, MOST_ERROR, text)


def _outliers(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    count = detached_summits(ensemble.summit_height)
    if not count:
        return
    highest = np.sort(ensemble.summit_height)[-count]
    share = touching.share(ensemble.summit_height[touching.index] >= highest)
    stand = "stands" if count == 1 else "stand"
    text = (
        f"{counted(count, 'summit', 'summits')} of {len(ensemble):,}, which {stand} apart above all others, "
        f"{'carries' if count == 1 else 'carry'} {_percent(share)} of the normal load: see whether they are spikes "
        "or dirt; of a map, take them off with spikes or outliers, or crop it"
    )
    yield from _over("outliers", share, MOST_ON_OUTLIERS, text)


def _steep(touching: _Touching) -> Iterator[Finding]:
    share = touching.share(touching.contact_radius > STEEPEST * touching.summit_radius)
    pressure = quantity_text(touching.normal_load.sum() / touching.area, "Pa", 3)
    text = (
        f"{_percent(share)} of the normal load stands on asperities with a/R > {STEEPEST} (mean pressure "
        f"{pressure}), where Hertz' theory does not hold: filter the map (s_filter) to what its resolution "
        "supports, if the radii come from one, or press less"
    )
    yield from _over("steep", share, MOST_LOAD, text)


def _yielding(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    pair = ensemble.pair
    if pair.yield_stress is not None:
        onset, hardness = ONSET_OF_YIELD * pair.yield_stress, HARDNESS_OF_YIELD * pair.yield_stress
    elif pair.hardness is not None:
        onset, hardness = ONSET_OF_HARDNESS * pair.hardness, pair.hardness
    else:
        return
    hardness = pair.hardness or hardness
    pressure = hertz.mean_pressure(touching.normal_load, contact_radius=touching.contact_radius)
    share = touching.share(pressure > onset)
    mean = touching.normal_load.sum() / touching.area
    spread = float(ensemble.summit_height.std())
    index = pair.contact_modulus / hardness * math.sqrt(spread / ensemble.summit_radius.mean())
    plasticity = f", plasticity index {index:.2g}" if spread else ""
    text = (
        f"asperities carrying {_percent(share)} of the normal load exceed the elastic limit (mean pressure "
        f"{quantity_text(mean, 'Pa', 3)}, onset at {quantity_text(onset, 'Pa', 3)}{plasticity}); set surface.yielding, "
        "reduce the load, or use a run-in surface"
    )
    yield from _over("yield", share, MOST_LOAD, text)


def _hardening(touching: _Touching) -> Iterator[Finding]:
    on_yielded = touching.normal_load * touching.yielded
    if not on_yielded.sum() > MOST_LOAD * touching.normal_load.sum():
        return
    strains = STRAIN * touching.contact_radius / touching.virgin_radius
    strain = float((strains * on_yielded).sum() / on_yielded.sum())
    if not 1 / STRAIN_RANGE <= strain / STRAIN_OF_VICKERS <= STRAIN_RANGE:
        yield Finding(
            "hardening",
            strain,
            STRAIN_OF_VICKERS,
            f"summits that have yielded are strained by {_percent(strain)} (0.2 a/R, by load), and hardness is "
            f"measured at {_percent(STRAIN_OF_VICKERS)}: work hardening is left out; of a metal that hardens, take the "
            "hardness at that strain",
        )


def _cracking(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    threshold = ensemble.pair.cracking_load
    if threshold is None or ensemble.yielding is None:
        return
    share = touching.share(touching.normal_load > threshold)
    most = quantity_text(float(touching.normal_load.max()), "N", 3)
    text = (
        f"{_percent(share)} of the normal load stands on asperities that carry up to {most}, beyond the threshold "
        f"of median cracks, {quantity_text(threshold, 'N', 3)} (Lawn and Evans 1977): a brittle material cracks "
        "there, and the model lets it flow; press less"
    )
    yield from _over("cracks", share, MOST_LOAD, text)


def _area(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    if ensemble.nominal_area is None:
        return
    share = touching.area / ensemble.nominal_area
    if ensemble.yielding is not None and share > MOST_YIELDED_AREA:
        yield Finding(
            "bulk",
            share,
            MOST_YIELDED_AREA,
            f"the contact area is {_percent(share)} of the nominal area: what yields there has nowhere to go, and the "
            "pressure rises above the hardness, which the model leaves out; press less, or take a larger nominal area",
        )
    elif share > MOST_AREA:
        yield Finding(
            "area",
            share,
            MOST_AREA,
            f"the contact area is {_percent(share)} of the nominal area, and asperities are independent only up to "
            f"some {_percent(MOST_AREA)}: real contacts are stiffer; press less, or take a larger nominal area",
        )


def _overlapping(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    if ensemble.x is None or ensemble.y is None or touching.index.size < 2:
        return
    place = np.stack([ensemble.x[touching.index], ensemble.y[touching.index]], axis=1)
    overlaps = overlapping(place, touching.contact_radius)
    share = touching.share(overlaps & touching.yielded)
    text = (
        f"{_percent(share)} of the normal load stands on yielded asperities with contacts that overlap others: "
        "such summits merge into one, and the model has them yield alone; filter the map (s_filter), prune its summits "
        "(prune), or press less"
    )
    if share > MOST_OVERLAP:
        yield Finding("merging", share, MOST_OVERLAP, text)
        return
    share = touching.share(overlaps)
    text = (
        f"{_percent(share)} of the normal load stands on {int(overlaps.sum()):,} asperities with contacts "
        "that overlap, which the model takes as independent: filter the map (s_filter), prune its summits (prune), or "
        "press less"
    )
    yield from _over("overlap", share, MOST_OVERLAP, text)


def overlapping(place: Floats, radius: Floats) -> Booleans:
    """Return which circles (circle) overlap another one, of their centres (circle, 2) and radii [m]."""
    one, other = _near(place, radius)
    distance = np.hypot(*(place[one] - place[other]).T)
    both = (one != other) & (distance < radius[one] + radius[other])
    result = np.zeros(radius.size, dtype=bool)
    result[one[both]] = result[other[both]] = True
    return result


def _near(place: Floats, radius: Floats) -> tuple[Integers, Integers]:
    """Return pairs of circles, among which are all that overlap."""
    if radius.size <= MOST_PAIRED:
        one, other = np.indices((radius.size, radius.size)).reshape(2, -1)
        return one, other
    from scipy.spatial import cKDTree

    # of two circles that overlap, the smaller one has its centre within twice the radius of the larger one
    near = cKDTree(place).query_ball_point(place, 2 * radius)
    one = np.repeat(np.arange(radius.size), [len(others) for others in near])
    return one, np.concatenate([np.asarray(others, dtype=np.int64) for others in near])


def _adhering(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    work = ensemble.pair.work_of_adhesion
    if work is None:
        return
    unit = np.pi * work * touching.summit_radius
    share = float(1.5 * unit.sum() / touching.normal_load.sum())
    lightest = float(np.quantile(touching.normal_load / unit, 0.1))
    text = (
        f"adhesion, which is left out, could pull with {_percent(share)} of the normal load (JKR; N/(πWR) is "
        f"{lightest:.2g} or less at the tenth of the contacts that is loaded least): press more, or see [adhesion]"
    )
    yield from _over("adhesion", share, MOST_LOAD, text)


def _unresolved(ensemble: Ensemble, touching: _Touching, instrument: Instrument) -> Iterator[Finding]:
    most = float((ensemble.friction[touching.index] * touching.approach).max())
    displacement = ensemble.pair.displacement_ratio * most
    if 0 < displacement < instrument.displacement_resolution:
        resolution = quantity_text(instrument.displacement_resolution, "m")
        yield Finding(
            "resolution",
            displacement,
            instrument.displacement_resolution,
            f"the preliminary displacement, {quantity_text(displacement, 'm', 3)}, is below what the instrument "
            f"resolves, {resolution}: press more, or use a finer instrument",
        )


def _over(name: str, value: float, most: float, text: str) -> Iterator[Finding]:
    if value > most:
        yield Finding(name, value, most, text)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def _rising(ensemble: Ensemble, touching: _Touching) -> Iterator[Finding]:
    steepest = 0.0 if ensemble.law is None else ensemble.law.steepest_rise()
    approach = float(touching.approach.max())
    share = steepest * ensemble.pair.displacement_ratio * approach
    if share >= 1:
        yield Finding(
            "rising",
            share,
            1.0,
            f"friction rises with the distance slid by {steepest:.3g} /m, faster than 1/(θδ) = {steepest / share:.3g} "
            f"/m at an approach of {quantity_text(approach, 'm', 3)}: springs that slide stick again at once, and the "
            "loads have no unique answer; take a table that rises more slowly, or press less",
        )
