"""What is found in records, and what the remedies do: none in clean ones, and better numbers in faulty ones."""

import attrs
import findings
import numpy as np
import pytest


def test_clean_records_have_no_finding():
    assert findings.false_alarms(range(findings.FEW)) == {}


@pytest.mark.ci
@pytest.mark.parametrize("finding", findings.FINDINGS, ids=lambda each: each.finding)
def test_the_advice_makes_the_record_better(finding):
    errors = findings.effect(finding)
    if errors is None:
        return
    before, after = np.nan_to_num(errors, nan=np.inf)
    if not finding.repeats:
        record = finding.fault()
        followed = finding.follow(record, findings.note_of(finding, record))
        assert findings.note_of(finding, followed) is None
    # within what noise makes of a sound record
    assert (after <= np.maximum(before, 2e-3)).all()
    assert (after < before - 1e-3).any()
    assert after.max() < 0.05


def test_the_start_of_a_record_that_slides_is_left_to_its_loops():
    """The other way that the note names: a centred displacement, and the first loop skipped."""
    record, names = findings.mid_stroke(1.2)
    (before,) = findings.fit_error((record, names))
    moved = record["tangential_displacement"]
    channels = {
        **record.channels,
        "tangential_displacement": moved - (moved.max() + moved.min()) / 2,
    }
    centred = attrs.evolve(record, channels=channels)
    assert findings.notes_on_start((record, names))
    assert not findings.check_start(findings.observe(centred, skip=1))
    (after,) = findings.fit_error((centred, names), skip=1)
    assert after < 1e-3 < before


@pytest.mark.ci
def test_the_page_has_the_table():
    assert findings.section() == findings.table(
        dict.fromkeys((each.finding for each in findings.FINDINGS), 0)
    )


def test_a_first_cycle_from_rest_is_not_a_closed_period():
    """The script counts 1,000. Most cycles after the first are closed periods: all that are clear of noise."""
    assert findings.closed_periods(range(findings.FEW), after=0) == 0
    assert findings.closed_periods(range(findings.FEW), after=1) > 0.85 * findings.FEW
