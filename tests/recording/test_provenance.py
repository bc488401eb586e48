"""The attributes of a result: where the model does not hold."""

from click.testing import CliRunner
from pytest import mark, warns

import historysim as hs
from historysim.asperities.instrument import Instrument
from historysim.basics.wording import read_findings, written_findings
from historysim.cli import main
from historysim.recording.provenance import validity_findings

PAIR = hs.MaterialPair.from_moduli(contact_modulus=50e9, shear_modulus=12e9)
BALL = hs.Ensemble(PAIR, 0.0, 1e-3, 0.2)


def names(events, **resolutions):
    return [finding.name for finding in validity_findings(BALL, events, Instrument(**resolutions))]


def test_the_greatest_load_of_all_is_looked_at():
    steep = BALL.approach_at(1.0)
    assert steep < 0.09e-3
    heavy = hs.NormalLoad(1.0, 50e-3 * (0.09e-3 / BALL.approach_at(50e-3)) ** 1.5 * 1.1)
    assert names([hs.NormalLoad(0.0, 1e-3), heavy, hs.NormalLoad(2.0, 1e-3)]) == ["steep"]
    assert names([hs.NormalLoad(0.0, 1e-3)]) == []
    assert names([hs.NormalDisplacement(0.0, 0.1e-3), hs.NormalDisplacement(1.0, 0.0)]) == ["steep"]


@mark.parametrize(
    "event, resolution",
    [
        (hs.TangentialDisplacement(1.0, -2e-9), "displacement_resolution"),
        (hs.TangentialLoad(1.0, -2e-9), "load_resolution"),
    ],
)
def test_amplitudes_below_the_resolution_are_reported(event, resolution):
    events = [hs.NormalLoad(0.0, 50e-3), event]
    assert names(events) == []
    assert names(events, **{resolution: 1.9e-9}) == []
    # the largest of them counts, not how many there are
    small = [*events, type(event)(1.5, 2e-9)]
    assert names(small, **{resolution: 2.1e-9}) == ["amplitude"]
    assert names([*events, type(event)(2.0, 3e-9)], **{resolution: 2.1e-9}) == []


def test_findings_are_read_as_they_were_written():
    found = validity_findings(BALL, [hs.NormalDisplacement(0.0, 0.1e-3)])
    assert read_findings(written_findings(found)) == found != ()
    assert read_findings(written_findings(())) == ()


@mark.parametrize(
    "events",
    [
        [hs.TangentialDisplacement(0.0, 0.0), hs.TangentialDisplacement(1.0, 1e-8)],
        [hs.TangentialDisplacement(1.0, 1e-8), hs.NormalLoad(2.0, 0.0)],
        [hs.NormalDisplacement(0.0, -1e-9), hs.TangentialDisplacement(1.0, 1e-8)],
    ],
)
def test_what_never_touches_is_said_to(events):
    with warns(UserWarning, match="nothing ever touches.*Give a normal load") as warned:
        history = hs.replay(BALL, events)
    assert [each.filename for each in warned] == [__file__]
    assert (history["total_tangential_load"] == 0).all()
    assert any(
        label == "warning" and "nothing ever touches" in text
        for label, text in history.contact.summary()
    )
    assert names(events) == ["contact"]


def test_what_touches_at_any_time_is_not():
    events = [hs.TangentialDisplacement(1.0, 1e-8), hs.NormalLoad(2.0, 1e-3)]
    assert names(events) == names([hs.NormalLoad(0.0, 0.0)]) == []
    hs.replay(BALL, events)


def test_run_and_show_say_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (
        '[materials]\ncontact_modulus = 1e11\nshear_modulus = 2e10\n[surface]\nkind = "sphere"\nradius = 1e-3\n'
        "[friction]\ncoefficient = 0.5\n"
        "[loading]\nwaypoints = [{ time = 1, tangential_displacement = 1e-8 }]\n"
    )
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    for command in (["run", "s.toml"], ["show", "s.nc"]):
        done = CliRunner().invoke(main, command)
        assert done.exit_code == 0
        assert done.output.count("nothing ever touches") == 1
