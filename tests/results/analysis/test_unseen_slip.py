"""Slip that begins and ends between recorded steps is reported, with the substeps that show it."""

import re

import numpy as np
import pytest

import historysim as hs
from historysim.results.analysis.slips import slip_note
from historysim.results.plots.pictures import PICTURES

PAIR = hs.MaterialPair.from_moduli(contact_modulus=5e10, shear_modulus=1.2e10)
BALL = hs.Ensemble(PAIR, 0.0, 1e-6, 0.2)
REACH = 1.74e-9
SWINGS = [hs.TangentialDisplacement(1.0 + 2 * i, (-1) ** i * 30e-9) for i in range(4)]
EVENTS = [hs.NormalDisplacement(0.0, REACH / (PAIR.displacement_ratio * 0.2)), *SWINGS]


@pytest.mark.parametrize("substeps", [1, 8, 20])
def test_unseen_slip_is_reported_with_the_necessary_substeps(substeps):
    note = slip_note(hs.replay(BALL, EVENTS, substeps=substeps))
    asked = substeps * int(re.search(r"What shows it: (\d+) times as many substeps", note)[1])
    # ten steps on the way of virgin loading, 30 nm long, of 1.74 nm
    assert asked == pytest.approx(10 * 30e-9 / REACH, rel=0.17)
    shown = hs.replay(BALL, EVENTS, substeps=asked)
    assert slip_note(shown) == ""
    partial = (shown["slip_state"] == hs.SlipState.PARTIAL_SLIP).values[:, 0]
    assert partial[:asked].sum() >= 9


def test_sticking_and_resolved_histories_have_no_note():
    short = [
        EVENTS[0],
        hs.TangentialDisplacement(1.0, 0.5e-9),
        hs.TangentialDisplacement(3.0, -0.5e-9),
    ]
    assert slip_note(hs.replay(BALL, short)) == ""
    still = hs.replay(BALL, EVENTS[:1])
    assert slip_note(still) == slip_note(still.drop_vars("tangential_displacement")) == ""


def test_captions_follow_the_history():
    two = hs.Ensemble(PAIR, np.array([0.0, -1e-9]), 1e-6, 0.2)
    for substeps, least in ((1, 1.0), (20, 0.8)):
        history = hs.replay(two, EVENTS, substeps=substeps)
        share = float(
            history.contact.slip_shares().slipping_area[history.contact.representative_step()]
        )
        caption = PICTURES["contact-map"].report_caption(history)
        if substeps == 1:
            expected = (
                "no step shows partial slip; all of it slips."
                if share == 1
                else "nothing of it slips."
            )
            assert caption.endswith(expected)
        else:
            assert share > least
            assert (
                caption
                == f"The contact at the step where nearest to half of its area slips: {100 * share:.0f} %."
            )
    totals = hs.replay(two, EVENTS, record="totals")
    assert "energy" in PICTURES["history"].report_caption(totals)
    assert "slip state" in PICTURES["history"].report_caption(history)
