"""Validity of the model for a contact: its assumptions, checked at the greatest load.

The asperities are paraboloids (a ≪ R), elastic, without adhesion, and independent of each other.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from historysim.asperities.asperity_set import AsperitySet, require_asperities
from historysim.asperities.body import Body
from historysim.asperities.instrument import RIGID, Instrument
from historysim.asperities.law import FrictionLaw
from historysim.basics.arguments import Booleans, Floats, Integers
from historysim.basics.units import quantity_text
from historysim.basics.wording import Finding, count_text
from historysim.contact import hertz
from historysim.contact.materials import HARDNESS_OF_YIELD
from historysim.surfaces.summits import detached_summits

if TYPE_CHECKING:
    from historysim.asperities.curves import NormalCurves
    from historysim.asperities.line_contact import LineContact

STEEPEST = 0.3  # a/R up to which a paraboloid approximates a sphere, and strains are small (Hertz)
# fraction of the normal load that asperities beyond a limit may carry, or that adhesion may add
MOST_LOAD = 0.1
# fraction of the normal load that asperities with overlapping contact circles may carry
MOST_OVERLAP = 0.2
MOST_AREA = 0.05  # contact area over nominal area up to which asperities count as independent
MOST_ON_OUTLIERS = 0.5  # fraction of the normal load that a few outliers may carry
# Number of circles up to which all pairs are compared, which is faster than importing a neighbour
# search.
MOST_PAIRED = 500
# Contact area over nominal area up to which summits that yield do so alone: beyond it the pressure
# rises above the hardness, since displaced material has no free surface left (Pullen and Williamson
# 1972).
MOST_YIELDED_AREA = 0.5
STRAIN = 0.2  # representative strain of an indentation over a/R (Tabor 1951)
# Strain of a Vickers indentation, which measures hardness, and the factor within which a strain
# counts as equal.
STRAIN_OF_VICKERS, STRAIN_RANGE = 0.08, 2.0
MOST_BEFORE_ROWS = 0.2  # approach of the first row of a normal curve relative to the last row
MOST_ERROR = 0.01  # largest error of a normal curve, relative to its largest load
# Mean pressure at which a sphere begins to flow, over the hardness (Greenwood and Williamson 1966:
# peak pressure 0.6 H) and over the yield stress (Johnson 1985, section 6.1: peak pressure 1.6 Y for
# ν = 0.3).
ONSET_OF_HARDNESS, ONSET_OF_YIELD = 0.4, 1.07
# Largest pressure at which a cylinder begins to flow, over the yield stress (Johnson 1985, section
# 6.2: von Mises), and its least length in half-widths for plane strain.
ONSET_OF_LINE, LEAST_LENGTH = 1.79, 10.0


@attrs.frozen
class _Contact:
    """Asperities in contact (asperity): radii R, approaches δ, contact radii a [m], and normal loads N [N].

    For yielded asperities R and δ belong to the flattened summit, and ``virgin_radius`` is the radius
    before yielding.
    """

    ensemble: AsperitySet
    instrument: Instrument
    index: Integers
    summit_radius: Floats
    approach: Floats
    normal_load: Floats
    virgin_radius: Floats
    yielded: Booleans

    @property
    def contact_radius(self) -> Floats:
        return hertz.contact_radius(self.approach, summit_radius=self.summit_radius)

    @property
    def area(self) -> float:
        return float(np.pi * (self.contact_radius**2).sum())

    @property
    def mean_pressure(self) -> str:
        return quantity_text(self.normal_load.sum() / self.area, "Pa", 3)

    def share(self, which: Booleans) -> float:
        """Return the fraction of the normal load on selected asperities."""
        return float(self.normal_load[which].sum() / self.normal_load.sum())


def findings(
    ensemble: Body, approach: float, instrument: Instrument = RIGID
) -> tuple[Finding, ...]:
    """Check the assumptions of the model at an approach [m]; return those violated, each with a remedy.

    The approach is the largest one of the highest summit from first touch in a history. The README
    of the package lists all findings. Assumptions about unknown properties of an ensemble
    (hardness, yield stress and surface energies of its materials, positions, nominal area) are not
    checked; patches of normal curves have only `first_row` and `normal_curve`.
    """
    contact: Any = ensemble
    if ensemble.line_length is not None:
        return tuple(_check_line(contact, approach, instrument))
    # patches with normal curves may interact, and are not spheres
    if not ensemble.has_radii:
        return tuple(finding for finding in _check_curve(contact.curves) if finding is not None)
    contact = _contact(require_asperities(ensemble), approach, instrument)
    if contact is None:
        return ()
    checks = [
        _outliers,
        _steep,
        _yielding,
        _area,
        _overlap,
        _hardening,
        _cracks,
        _adhesion,
        _resolution,
        _rising,
    ]
    return tuple(finding for check in checks if (finding := check(contact)) is not None)


def _contact(ensemble: AsperitySet, approach: float, instrument: Instrument) -> _Contact | None:
    depth = ensemble.summit_height - (ensemble.highest_summit - approach)
    index = np.flatnonzero(depth > 0)
    virgin = ensemble.summit_radius[index]
    radius, depth, yielded = virgin, depth[index], np.zeros(index.size, dtype=bool)
    if "yielding" in ensemble.laws and index.size:
        state = ensemble.advance(ensemble.initial_state(), normal_displacement=approach)
        if (after_yielding := state.yielded) is not None:
            radius, yielded = (
                after_yielding.summit_radius[index],
                after_yielding.yielding_load[index] > 0,
            )
            depth = np.where(yielded, depth - after_yielding.yielded_depth[index], depth)
    load = hertz.normal_load(
        depth, summit_radius=radius, contact_modulus=ensemble.pair.contact_modulus
    )
    # a tiny approach underflows
    return (
        _Contact(ensemble, instrument, index, radius, depth, load, virgin, yielded)
        if load.sum() > 0
        else None
    )


def _over(name: str, value: float, limit: float, text: str) -> Finding | None:
    return Finding(name, value, limit, text) if value > limit else None


def _check_line(line: "LineContact", approach: float, instrument: Instrument) -> Iterator[Finding]:
    """Yield the assumptions that a cylinder at an approach violates: small slopes, plane strain, no yielding."""
    load = float(line.curves.total(np.asarray(max(approach, 0.0))))
    width = float(line.half_width(load))
    if width == 0.0:
        return
    if width > STEEPEST * line.radius:
        text = (
            f"the half-width is {_percent(width / line.radius)} of the radius, where Hertz' theory does not hold: "
            "press less"
        )
        yield Finding("steep", width / line.radius, STEEPEST, text)
    if line.length < LEAST_LENGTH * width:
        text = (
            f"the contact is {line.length / width:.2g} half-widths long, and plane strain needs {LEAST_LENGTH:g} or "
            "more, since the ends of the cylinder carry otherwise: press less, or take a sphere"
        )
        yield Finding("plane_strain", width / line.length, 1.0 / LEAST_LENGTH, text)
    pair = line.pair
    limit = pair.yield_stress or (pair.hardness or 0.0) / HARDNESS_OF_YIELD
    pressure = float(line.pressure(0.0, line.advance(line.initial_state(), normal_load=load)))
    if limit and pressure > ONSET_OF_LINE * limit:
        text = (
            f"the pressure of {quantity_text(pressure, 'Pa', 3)} in the middle exceeds the elastic limit of "
            f"{quantity_text(ONSET_OF_LINE * limit, 'Pa', 3)}: reduce the load"
        )
        yield Finding("yield", pressure / limit, ONSET_OF_LINE, text)
    displacement = float(line.friction.max()) * approach
    if 0.0 < displacement < instrument.displacement_resolution:
        yield _resolution_finding(displacement, instrument)


def _check_curve(curves: "NormalCurves") -> list[Finding | None]:
    if not (curves.is_extrapolated_to_touch or curves.noise is not None):
        # solutions have their first row at first touch, and closely spaced rows
        return []
    first_row, error = float(curves.approach[0] / curves.approach[-1]), curves.error()
    extrapolation = (
        f"the lightest load of the normal curve is at {_percent(first_row)} of its range of approach: the load "
        "carried below it is a guess (a power of the approach); measure lighter loads"
    )
    location = "between its rows" if curves.noise is None else "under its noise"
    between = f"the normal curve may be off by {_percent(error)} of its largest load {location}; measure more rows"
    return [
        _over("first_row", first_row, MOST_BEFORE_ROWS, extrapolation),
        _over("normal_curve", error, MOST_ERROR, between),
    ]


def _outliers(contact: _Contact) -> Finding | None:
    height = contact.ensemble.summit_height
    count = detached_summits(height)
    if not count:
        return None
    share = contact.share(height[contact.index] >= np.sort(height)[-count])
    text = (
        f"{count_text(count, 'summit', 'summits')} of {height.size:,} apart above all others, with {_percent(share)} "
        "of the normal load: check whether they are spikes or dirt; for a map, remove them with spikes or outliers, or "
        "crop it"
    )
    return _over("outliers", share, MOST_ON_OUTLIERS, text)


def _steep(contact: _Contact) -> Finding | None:
    share = contact.share(contact.contact_radius > STEEPEST * contact.summit_radius)
    text = (
        f"{_percent(share)} of the normal load is carried by asperities with a/R > {STEEPEST} (mean pressure "
        f"{contact.mean_pressure}), where Hertz' theory does not hold: filter the map (s_filter), or press less"
    )
    return _over("steep", share, MOST_LOAD, text)


def _yielding(contact: _Contact) -> Finding | None:
    ensemble, pair = contact.ensemble, contact.ensemble.pair
    hardness = pair.hardness or HARDNESS_OF_YIELD * (pair.yield_stress or 0.0)
    if "yielding" in ensemble.laws or not hardness:
        return None
    onset = (
        ONSET_OF_YIELD * pair.yield_stress
        if pair.yield_stress is not None
        else ONSET_OF_HARDNESS * hardness
    )
    pressure = hertz.mean_pressure(contact.normal_load, contact_radius=contact.contact_radius)
    share = contact.share(pressure > onset)
    spread = float(ensemble.summit_height.std())
    index = pair.contact_modulus / hardness * math.sqrt(spread / ensemble.summit_radius.mean())
    plasticity = f", plasticity index {index:.2g}" if spread else ""
    text = (
        f"asperities carrying {_percent(share)} of the normal load exceed the elastic limit (mean pressure "
        f"{contact.mean_pressure}, onset at {quantity_text(onset, 'Pa', 3)}{plasticity}); set surface.yielding, "
        "reduce the load, or use a run-in surface"
    )
    return _over("yield", share, MOST_LOAD, text)


def _hardening(contact: _Contact) -> Finding | None:
    on_yielded = contact.normal_load * contact.yielded
    if not on_yielded.sum() > MOST_LOAD * contact.normal_load.sum():
        return None
    strains = STRAIN * contact.contact_radius / contact.virgin_radius
    strain = float((strains * on_yielded).sum() / on_yielded.sum())
    if 1 / STRAIN_RANGE <= strain / STRAIN_OF_VICKERS <= STRAIN_RANGE:
        return None
    text = (
        f"summits that have yielded are strained by {_percent(strain)} (0.2 a/R, by load), and hardness is measured at "
        f"{_percent(STRAIN_OF_VICKERS)}: of a metal that hardens, take the hardness at that strain"
    )
    return Finding("hardening", strain, STRAIN_OF_VICKERS, text)


def _cracks(contact: _Contact) -> Finding | None:
    threshold = contact.ensemble.pair.cracking_load
    if threshold is None or "yielding" not in contact.ensemble.laws:
        return None
    share = contact.share(contact.normal_load > threshold)
    text = (
        f"{_percent(share)} of the normal load is carried by asperities beyond the threshold of median cracks, "
        f"{quantity_text(threshold, 'N', 3)} (Lawn and Evans 1977), where the model lets the material flow; press less"
    )
    return _over("cracks", share, MOST_LOAD, text)


def _area(contact: _Contact) -> Finding | None:
    if contact.ensemble.nominal_area is None:
        return None
    share = contact.area / contact.ensemble.nominal_area
    text = f"the contact area is {_percent(share)} of the nominal area"
    mend = "press less, or take a larger nominal area"
    if "yielding" in contact.ensemble.laws and share > MOST_YIELDED_AREA:
        reason = "what yields has nowhere to go, and the pressure rises above the hardness, which the model leaves out"
        return Finding("bulk", share, MOST_YIELDED_AREA, f"{text}: {reason}; {mend}")
    reason = f"asperities are independent only up to some {_percent(MOST_AREA)}: real contacts are stiffer"
    return _over("area", share, MOST_AREA, f"{text}, and {reason}; {mend}")


def _overlap(contact: _Contact) -> Finding | None:
    ensemble, index = contact.ensemble, contact.index
    if ensemble.x is None or ensemble.y is None or index.size < 2:
        return None
    overlaps = overlapping(
        np.stack([ensemble.x[index], ensemble.y[index]], axis=1), contact.contact_radius
    )
    for name, which, adjective in (
        ("merging", overlaps & contact.yielded, "yielded "),
        ("overlap", overlaps, ""),
    ):
        share = contact.share(which)
        text = (
            f"{_percent(share)} of the normal load is carried by {int(which.sum()):,} {adjective}asperities with "
            "contacts that overlap others, which the model treats as independent: filter the map (s_filter), prune its "
            "summits (prune), or press less"
        )
        if share > MOST_OVERLAP:
            return Finding(name, share, MOST_OVERLAP, text)
    return None


def overlapping(centre: Floats, radius: Floats) -> Booleans:
    """Return True for circles (circle) that overlap another, from their centres (circle, 2) and radii [m]."""
    i, j = _near(centre, radius)
    distance = np.hypot(*(centre[i] - centre[j]).T)
    both = (i != j) & (distance < radius[i] + radius[j])
    result = np.zeros(radius.size, dtype=bool)
    result[i[both]] = result[j[both]] = True
    return result


def _near(centre: Floats, radius: Floats) -> tuple[Integers, Integers]:
    """Return the index pairs of neighbouring circles, among which are all that overlap."""
    if radius.size <= MOST_PAIRED:
        i, j = np.indices((radius.size, radius.size)).reshape(2, -1)
        return i, j
    from scipy.spatial import cKDTree

    # of two circles that overlap, the smaller one has its centre within twice the radius of the
    # larger one
    near = cKDTree(centre).query_ball_point(centre, 2 * radius)
    i = np.repeat(np.arange(radius.size), [len(neighbours) for neighbours in near])
    return i, np.concatenate([np.asarray(neighbours, dtype=np.int64) for neighbours in near])


def _adhesion(contact: _Contact) -> Finding | None:
    work = contact.ensemble.pair.work_of_adhesion
    if work is None or "attraction" in contact.ensemble.laws:
        return None
    unit = np.pi * work * contact.summit_radius
    share = float(1.5 * unit.sum() / contact.normal_load.sum())
    lightest = float(np.quantile(contact.normal_load / unit, 0.1))
    text = (
        f"adhesion, which is left out, could pull with {_percent(share)} of the normal load (JKR; N/(πWR) is "
        f"{lightest:.2g} or less at the tenth of the contacts that is loaded least): press more, "
        "model it with [attraction], or see [adhesion]"
    )
    return _over("adhesion", share, MOST_LOAD, text)


def _resolution(contact: _Contact) -> Finding | None:
    ensemble, resolution = contact.ensemble, contact.instrument.displacement_resolution
    product = float((ensemble.friction[contact.index] * contact.approach).max())
    displacement = ensemble.pair.displacement_ratio * product
    if not 0 < displacement < resolution:
        return None
    return _resolution_finding(displacement, contact.instrument)


def _resolution_finding(displacement: float, instrument: Instrument) -> Finding:
    resolution = instrument.displacement_resolution
    text = (
        f"the preliminary displacement, {quantity_text(displacement, 'm', 3)}, is below what the instrument resolves, "
        f"{quantity_text(resolution, 'm')}: press more, or use a finer instrument"
    )
    return Finding("resolution", displacement, resolution, text)


def _rising(contact: _Contact) -> Finding | None:
    law, approach = contact.ensemble.laws.get("friction"), float(contact.approach.max())
    steepest = law.steepest_rise() if isinstance(law, FrictionLaw) else 0.0
    share = steepest * contact.ensemble.pair.displacement_ratio * approach
    if share < 1:
        return None
    text = (
        f"friction rises with the distance slid by {steepest:.3g} /m, faster than 1/(θδ) = {steepest / share:.3g} /m "
        f"at an approach of {quantity_text(approach, 'm', 3)}: springs that slide stick again immediately, and the "
        "loads have no unique answer; take a table that rises more slowly, or press less"
    )
    return Finding("rising", share, 1.0, text)


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"
