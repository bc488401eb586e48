import pytest

import historysim as hs
from historysim.asperities.instrument import Instrument
from historysim.basics.findings import read, written
from historysim.recording.recorded_validity import findings

PAIR = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)


def names(events, **resolutions):
    return [finding.name for finding in findings(BALL, events, Instrument(**resolutions))]


def test_the_greatest_load_of_all_is_looked_at():
    steep = BALL.approach_at(1.0)
    assert steep < 0.09e-3
    heavy = hs.NormalLoad(1.0, 50e-3 * (0.09e-3 / BALL.approach_at(50e-3)) ** 1.5 * 1.1)
    assert names([hs.NormalLoad(0.0, 1e-3), heavy, hs.NormalLoad(2.0, 1e-3)]) == ["steep"]
    assert names([hs.NormalLoad(0.0, 1e-3)]) == []
    assert names([hs.NormalDisplacement(0.0, 0.1e-3), hs.NormalDisplacement(1.0, 0.0)]) == ["steep"]


@pytest.mark.parametrize(
    ("event", "resolution"),
    [
        (hs.TangentialDisplacement(1.0, -2e-9), "displacement_resolution"),
        (hs.TangentialLoad(1.0, -2e-9), "load_resolution"),
    ],
)
def test_amplitudes_below_the_resolution_are_told(event, resolution):
    events = [hs.NormalLoad(0.0, 50e-3), event]
    assert names(events) == []
    assert names(events, **{resolution: 1.9e-9}) == []
    assert names(events, **{resolution: 2.1e-9}) == ["amplitude"]
    # the largest of them counts
    assert names([*events, type(event)(2.0, 3e-9)], **{resolution: 2.1e-9}) == []


def test_findings_are_read_as_they_were_written():
    found = findings(BALL, [hs.NormalDisplacement(0.0, 0.1e-3)])
    assert read(written(found)) == found != ()
    assert read(written(())) == ()
