"""The equilibria of one adhesive contact: what stands in their picture. That it looks well was seen by eye."""

import io

import matplotlib as mpl
import numpy as np
import pytest

import historysim as hs
from historysim.contact.adhesion import branch

TIP = {"summit_radius": 1e-6, "contact_modulus": 1e9, "work_of_adhesion": 0.05}


def drawn(figure):
    picture = io.BytesIO()
    figure.savefig(picture, dpi=50)
    assert picture.getvalue().startswith(b"\x89PNG")
    (axes,) = figure.axes
    return axes


def marks(axes, markers="osv"):
    return [line for line in axes.get_lines() if line.get_marker() in tuple(markers)]


def drawn_branch(model, separation=1e-9, max_load=3e-7):
    curve = branch(model, **TIP, max_load=max_load, equilibrium_separation=separation)
    axes = drawn(hs.plots.adhesion_branch(curve))
    lines = {line.get_label(): np.array(line.get_data()) * 1e-9 for line in axes.get_lines()}
    return curve, axes, lines


@pytest.mark.parametrize(("model", "separation"), [("jkr", 1e-9), ("maugis", 1e-9), ("maugis", 6e-9)])
def test_what_is_stable_is_drawn_solid(model, separation):
    curve, axes, lines = drawn_branch(model, separation)
    load, held = curve.stable_under_load, curve.stable_under_displacement
    points = np.array([curve.approach, curve.normal_load])
    np.testing.assert_allclose(lines["stable"], points[:, load], rtol=1e-12, atol=1e-24)
    part = lines["stable under displacement only"]
    np.testing.assert_allclose(part[:, :-1], points[:, held & ~load], rtol=1e-12, atol=1e-24)
    np.testing.assert_allclose(lines["unstable"][:, :-1], points[:, ~held], rtol=1e-12, atol=1e-24)
    # the parts meet
    assert (part[:, -1] == lines["stable"][:, 0]).all()
    assert (lines["unstable"][:, -1] == part[:, 0]).all()
    styles = {line.get_label(): line.get_linestyle() for line in axes.get_lines()}
    assert styles["stable"] == "-"
    assert styles["stable under displacement only"] == styles["unstable"] == "--"


def test_jumps_are_marked_with_their_loads():
    curve, axes, lines = drawn_branch("jkr")
    for name, point in (
        ("pull-off under load, −236 nN", curve.pull_off_under_load),
        ("pull-off under displacement, −131 nN", curve.pull_off_under_displacement),
        ("jump-in", curve.jump_in),
    ):
        assert lines[name][:, 0] == pytest.approx([point.approach, point.normal_load], rel=1e-12, abs=1e-24)
    assert axes.get_xlabel() == r"approach $\delta$ (nm)"
    assert axes.get_ylabel() == "normal load $N$ (nN)"
    assert axes.get_title(loc="left") == "Equilibria after JKR"
    legend = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert len(legend) == 6


def test_contacts_without_an_unstable_part():
    curve, axes, lines = drawn_branch("dmt")
    np.testing.assert_allclose(lines["stable"], [curve.approach, curve.normal_load], rtol=1e-12)
    assert "unstable" not in lines
    assert "stable under displacement only" not in lines
    assert [mark.get_label() for mark in marks(axes)] == ["pull-off, −314 nN", "jump-in"]
    _, axes, lines = drawn_branch("hertz")
    assert "stable" in lines
    assert marks(axes) == []


def test_units_follow_the_contact():
    _, axes, _ = drawn_branch("hertz", max_load=2.0)
    assert axes.get_ylabel() == "normal load $N$ (N)"
    # by hand: (3·2/(4·1e9·1e-3))^(2/3) m
    assert axes.get_xlabel() == r"approach $\delta$ (µm)"
    assert axes.get_lines()[2].get_xdata()[-1] == pytest.approx(131.04, abs=0.01)


def test_drawing_does_not_change_the_settings():
    settings = dict(mpl.rcParams)
    hs.plots.adhesion_branch(branch("jkr", **TIP, max_load=1e-7))
    assert dict(mpl.rcParams) == settings
